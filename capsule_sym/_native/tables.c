/* Constants of a parameter set: what expansions of the four linear flows have in common.

   A segment's motion is x_r(h) - x_r(0) = F H + v_r G + C Bd + S B, where F is the force at the
   start, C = alpha cos(angle), S = -alpha omega sin(angle), and

       phi'' + 2 sigma phi' + K phi = drive,    drive = 1, 0, cos(omega h), sin(omega h)/omega

   for phi = H, G, Bd, B, all starting from zero but G' = 1. Their Taylor coefficients in
   s = h/reach do not depend on the state: a segment's are four multiplications each. */
#include <math.h>
#include <string.h>

#include "internal.h"

#define FULL 22 /* terms of the Taylor series that the tables are made from */

/* Changes of basis: of Chebyshev polynomials of degree k on [0, 1], and of s^i in Bernstein form. */
typedef struct {
    double chebyshev[FULL - 2][FULL - 2], bernstein[DEGREE + 1][DEGREE + 1];
} bases;

static void bases_make(bases *b)
{
    memset(b, 0, sizeof *b);
    b->chebyshev[0][0] = 1.0;
    b->chebyshev[1][0] = -1.0, b->chebyshev[1][1] = 2.0;
    for (int k = 2; k < FULL - 2; k++) { /* whole numbers below 2^53 */
        const double *one = b->chebyshev[k - 1], *two = b->chebyshev[k - 2];
        b->chebyshev[k][0] = -2.0 * one[0] - two[0];
        for (int i = 1; i <= k; i++)
            b->chebyshev[k][i] = 4.0 * one[i - 1] - 2.0 * one[i] - two[i];
    }
    for (int j = 0; j <= DEGREE; j++) {
        b->bernstein[j][0] = 1.0;
        for (int i = 1; i <= j; i++)
            b->bernstein[j][i] = b->bernstein[j][i - 1] * (j - i + 1) / (DEGREE - i + 1);
    }
}

/* Lowers the degree of four polynomials sum a[n] s^n from `from` to `to` with the least error, by
   multiples of s^3 times Chebyshev polynomials: adds to `change` and `bend` by how much at most,
   over s^3, their values and their derivatives change. */
static void economize(const bases *b, double (*a)[4], int from, int to, double *change,
                      double *bend)
{
    for (int k = from - 3; k > to - 3; k--) {
        double part[4];
        for (int m = 0; m < 4; m++) {
            part[m] = a[k + 3][m] / b->chebyshev[k][k];
            change[m] += 1.0001 * fabs(part[m]);
            bend[m] += 1.0001 * fabs(part[m]) * (3 + 2 * k * k);
        }
        for (int i = 0; i <= k; i++)
            for (int m = 0; m < 4; m++)
                a[i + 3][m] -= part[m] * b->chebyshev[k][i];
    }
}

/* Coefficients n = 0 .. FULL + 1 of a response in powers of s, and their magnitudes: what the
   recurrence adds up without the signs. Coefficient n is computed within 5 n roundings of it. */
static void response(const capsule_constants *c, double reach, int which, double *phi, double *size)
{
    /* drive[n] h^n/n!, alternating between zero and a term */
    double term = which == 1 ? 0.0 : which == 3 ? reach : 1.0;
    const int parity = which == 3;
    phi[0] = size[0] = 0.0;
    phi[1] = size[1] = which == 1 ? reach : 0.0;
    for (int n = 0; n < FULL; n++) {
        const double drive = n % 2 == parity ? term : 0.0;
        if (n % 2 == parity)
            term = which == 0 ? 0.0 : forcing_next(c, n, reach, term);
        phi[n + 2] = response_next(c, n, reach, drive, phi[n + 1], phi[n]);
        size[n + 2] = response_next_size(c, n, reach, fabs(drive), size[n + 1], size[n]);
    }
}

/* Bound on the Taylor remainder of a response after coefficient FULL at s = 1. With
   y = phi^(FULL), sqrt(y'^2 + K y^2) grows at most by the drive's derivative per unit of time. */
static double remainder_of(const capsule_constants *c, double reach, int which, const double *phi)
{
    double scale = 1.0, drive = which == 2 ? 1.0 : which == 3 ? reach : 0.0;
    for (int n = 1; n <= FULL + 1; n++) /* reach^(FULL + 1) omega^FULL/(FULL + 1)! */
        scale *= (n <= FULL - (which == 3) ? c->omega : 1.0) * reach / n;
    const double last = phi[FULL + 1], before = phi[FULL] * sqrt(c->K) * reach / (FULL + 1);
    /* For B the drive's derivative is omega^(FULL - 1). */
    const double grown = which == 3 ? scale * reach : drive * scale * reach;
    return 1.0001 * (hypot(last, before) + grown);
}

/* The responses at the end of an expansion, by the closed form: in a segment of hundreds of
   expansions an error of their sum would be the same each time. */
static void wholes_make(const capsule_constants *c, capsule_table *t)
{
    const double h = t->reach, omega = c->omega, half = sin(0.5 * omega * h) / omega;
    const capsule_start push = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    const capsule_start kick = {0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0};
    const capsule_start cosine = {0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    const capsule_start sine = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0};
    const capsule_start *start[4] = {&push, &kick, &cosine, &sine};
    const double impulse[4] = {h, 0.0, sin(omega * h) / omega, 2.0 * half * half};
    capsule_constants unit = *c;
    unit.drift = 0.0;
    for (int k = 0; k < 4; k++) {
        double change[3];
        unit.push = k == 0;
        unit.alpha = k == 3 ? 1.0 / omega : k == 2;
        capsule_flow(&unit, start[k], h, change);
        t->x_whole[k] = change[0];
        t->v_whole[k] = change[1];
        const double gained = change[1] - (k == 1);
        t->second_whole[k] =
            c->drift != 0.0
                ? (impulse[k] - gained - 2.0 * c->sigma * h * (k == 1)) / (c->gamma + 1.0)
                : force_change(c, change[0], gained);
    }
}

static void table_make(const bases *b, const capsule_constants *c, double part, capsule_table *t)
{
    memset(t, 0, sizeof *t);
    t->root_K = sqrt(c->K);
    /* A damped response is smaller than the terms of its series: not so far that digits go. */
    const double growth = t->root_K + 2.0 * c->sigma + (c->q < 0.0 ? c->nu : 0.0);
    t->reach = part * lesser(CAPSULE_REACH / c->rate, CAPSULE_GROWTH / growth);
    /* P - P(0) = (1 + kappa) x + 2 zeta (v - v(0)), and gamma v_c' = P - friction. */
    const int drift = c->drift != 0.0;
    const double share = force_change(c, 1.0, 0.0), damper = force_change(c, 0.0, 1.0);
    double by[FULL + 1], rate[FULL + 1];
    for (int n = 1; n <= FULL; n++) {
        by[n] = !drift ? share : n > 1 ? share * t->reach / (c->gamma * n) : 0.0;
        rate[n] = !drift ? damper * (n + 1) / t->reach : n > 1 ? damper / c->gamma : 0.0;
    }
    for (int n = 1; n <= TERMS + 1; n++) {
        t->from_position[n - 1] = by[n];
        t->from_rate[n - 1] = rate[n];
    }
    double x[FULL + 2][4], second[TERMS + 2][4] = {{0}}, rest[4];
    for (int k = 0; k < 4; k++) {
        double phi[FULL + 2], size[FULL + 2];
        response(c, t->reach, k, phi, size);
        rest[k] = remainder_of(c, t->reach, k, phi);
        for (int n = 0; n <= FULL; n++)
            x[n][k] = phi[n];
        for (int n = 1; n <= FULL; n++) {
            const double units = (5 * n + 32) * UNIT;
            const double second_size = by[n] * size[n - drift] + rate[n] * size[n + 1 - drift];
            t->x_error[k] += units * size[n];
            t->v_error[k] += units * n * size[n] / t->reach;
            t->second_error[k] += units * second_size;
            t->x_bend[k] += n * (n - 1) * size[n];
            t->second_bend[k] += n * (n - 1) * second_size;
        }
    }
    wholes_make(c, t);
    double change[4] = {0}, bend[4] = {0}, tail[4] = {0}, unused[4] = {0};
    economize(b, x, FULL, TERMS, change, bend);
    for (int n = 1; n <= TERMS + drift; n++)
        for (int k = 0; k < 4; k++) {
            const double last = n - drift < TERMS ? x[n + 1 - drift][k] : 0.0;
            second[n][k] = by[n] * x[n - drift][k] + rate[n] * last;
        }
    for (int k = 0; k < 4; k++) {
        const double x_left = rest[k] + change[k];
        const double v_left = ((FULL + 1) * rest[k] + bend[k]) / t->reach;
        const double left = drift ? (share * t->reach + damper) / c->gamma * x_left
                                  : force_change_size(c, x_left, v_left);
        t->x_error[k] += x_left;
        t->v_error[k] += v_left;
        t->second_error[k] += left;
        t->x_bend[k] += (FULL + 1) * FULL * rest[k];
        t->second_bend[k] += (FULL + 1) * FULL * left;
        t->x_tail[k] = x_left;
        t->second_tail[k] = left;
        for (int n = 1; n <= TERMS; n++) {
            t->x[k][n - 1] = x[n][k];
        }
    }
    economize(b, x, TERMS, DEGREE, tail, unused);
    for (int k = 0; k < 4; k++) {
        t->x_tail[k] += tail[k];
        tail[k] = 0.0;
    }
    economize(b, second, TERMS + drift, DEGREE, tail, unused);
    for (int k = 0; k < 4; k++) {
        t->second_tail[k] += tail[k];
        for (int j = 1; j <= DEGREE; j++) {
            for (int n = 1; n <= j; n++) {
                t->x_form[k][j - 1] += b->bernstein[j][n] * x[n][k];
                t->second_form[k][j - 1] += b->bernstein[j][n] * second[n][k];
            }
            t->x_range[k] = greater(t->x_range[k], 1.0001 * fabs(t->x_form[k][j - 1]));
            t->second_range[k] =
                greater(t->second_range[k], 1.0001 * fabs(t->second_form[k][j - 1]));
        }
    }
}

void capsule_tables_make(const capsule_map *map, int levels, capsule_table *table)
{
    bases b;
    bases_make(&b);
    for (int flow = 0; flow < 4; flow++)
        for (int level = 0; level < levels; level++)
            table_make(&b, &map->field[FIELD_OF[flow / 2][1 + flow % 2] - 1], ldexp(1.0, -level),
                       &table[levels * flow + level]);
}

static void constants_of(const capsule_parameters *p, capsule_map *map)
{
    map->parameters = *p;
    for (int field = 1; field <= 6; field++)
        capsule_constants_of(field, p->alpha, p->omega, p->delta, p->zeta, p->beta, p->gamma,
                             p->f_b, &map->field[field - 1]);
    const capsule_constants *c = &map->field[1];
    const double amplitude = c->Z2 > 0.0 ? c->alpha / sqrt(c->Z2) : INFINITY;
    map->may_rest = amplitude < c->delta && amplitude * sqrt(force_gain2(c)) < c->f_b;
}

void capsule_map_make(const capsule_parameters *parameters, capsule_map *map)
{
    constants_of(parameters, map);
    capsule_tables_make(map, 1, map->table);
}

void capsule_map_remake(const capsule_parameters *parameters, capsule_map *map)
{
    const capsule_parameters *p = parameters, *old = &map->parameters;
    if (p->omega == old->omega && p->zeta == old->zeta && p->beta == old->beta &&
        p->gamma == old->gamma)
        constants_of(parameters, map); /* alpha, delta and f_b are in no table */
    else
        capsule_map_make(parameters, map);
}

double capsule_margin_at(const capsule_constants *c, double x_r, double gap, double v_r)
{
    return margin_at(c, x_r, gap, v_r);
}

const char *capsule_digest(void)
{
    return CAPSULE_DIGEST;
}
