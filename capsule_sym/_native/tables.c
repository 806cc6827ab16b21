/* Constants of a parameter set: what expansions of the four linear flows have in common.

   A segment's motion is x_r(h) - x_r(0) = F H + v_r G + C Bd + S B, where F is the force at the
   start, C = alpha cos(angle), S = -alpha omega sin(angle), and

       phi'' + 2 sigma phi' + K phi = drive,    drive = 1, 0, cos(omega h), sin(omega h)/omega

   for phi = H, G, Bd, B, all starting from zero but G' = 1. Their Taylor coefficients in
   s = h/reach do not depend on the state: a segment's are four multiplications each. */
#include <math.h>
#include <string.h>

#include "internal.h"

/* Bernstein coefficient j of s^i in degree 12: C(j, i)/C(12, i). */
static const double BERNSTEIN[DEGREE][DEGREE] = {
    {1.0 / 12.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
    {2.0 / 12.0, 1.0 / 66.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
    {3.0 / 12.0, 3.0 / 66.0, 1.0 / 220.0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
    {4.0 / 12.0, 6.0 / 66.0, 4.0 / 220.0, 1.0 / 495.0, 0, 0, 0, 0, 0, 0, 0, 0},
    {5.0 / 12.0, 10.0 / 66.0, 10.0 / 220.0, 5.0 / 495.0, 1.0 / 792.0, 0, 0, 0, 0, 0, 0, 0},
    {6.0 / 12.0, 15.0 / 66.0, 20.0 / 220.0, 15.0 / 495.0, 6.0 / 792.0, 1.0 / 924.0, 0, 0, 0, 0, 0,
     0},
    {7.0 / 12.0, 21.0 / 66.0, 35.0 / 220.0, 35.0 / 495.0, 21.0 / 792.0, 7.0 / 924.0, 1.0 / 792.0, 0,
     0, 0, 0, 0},
    {8.0 / 12.0, 28.0 / 66.0, 56.0 / 220.0, 70.0 / 495.0, 56.0 / 792.0, 28.0 / 924.0, 8.0 / 792.0,
     1.0 / 495.0, 0, 0, 0, 0},
    {9.0 / 12.0, 36.0 / 66.0, 84.0 / 220.0, 126.0 / 495.0, 126.0 / 792.0, 84.0 / 924.0, 36.0 /
     792.0, 9.0 / 495.0, 1.0 / 220.0, 0, 0, 0},
    {10.0 / 12.0, 45.0 / 66.0, 120.0 / 220.0, 210.0 / 495.0, 252.0 / 792.0, 210.0 / 924.0, 120.0 /
     792.0, 45.0 / 495.0, 10.0 / 220.0, 1.0 / 66.0, 0, 0},
    {11.0 / 12.0, 55.0 / 66.0, 165.0 / 220.0, 330.0 / 495.0, 462.0 / 792.0, 462.0 / 924.0, 330.0 /
     792.0, 165.0 / 495.0, 55.0 / 220.0, 11.0 / 66.0, 1.0 / 12.0, 0},
    {12.0 / 12.0, 66.0 / 66.0, 220.0 / 220.0, 495.0 / 495.0, 792.0 / 792.0, 924.0 / 924.0, 792.0 /
     792.0, 495.0 / 495.0, 220.0 / 220.0, 66.0 / 66.0, 12.0 / 12.0, 1.0 / 1.0},
};

/* Coefficients n = 0 .. TERMS + 1 of a response in powers of s, and their magnitudes: what the
   recurrence adds up without the signs. Coefficient n is computed within 5 n roundings of it. */
static void response(const capsule_constants *c, double reach, int which, double *phi, double *size)
{
    const double damping = 2.0 * c->sigma * reach, stiffness = c->K * reach * reach;
    const double angle = c->omega * reach;
    /* drive[n] h^n/n!, alternating between zero and a term */
    double term = which == 1 ? 0.0 : which == 3 ? reach : 1.0;
    const int parity = which == 3;
    phi[0] = size[0] = 0.0;
    phi[1] = size[1] = which == 1 ? reach : 0.0;
    for (int n = 0; n < TERMS; n++) {
        const double pair = (n + 1) * (n + 2);
        double drive = 0.0;
        if (n % 2 == parity) {
            drive = term * reach * reach / pair;
            term = which == 0 ? 0.0 : -term * angle * angle / ((n + 1) * (n + 2));
        }
        phi[n + 2] = drive - damping / (n + 2) * phi[n + 1] - stiffness / pair * phi[n];
        size[n + 2] = fabs(drive) + damping / (n + 2) * size[n + 1] + stiffness / pair * size[n];
    }
}

/* Bound on the Taylor remainder of a response after coefficient TERMS at s = 1. With
   y = phi^(TERMS), sqrt(y'^2 + K y^2) grows at most by the drive's derivative per unit of time. */
static double remainder_of(const capsule_constants *c, double reach, int which, const double *phi)
{
    double scale = 1.0, drive = which == 2 ? 1.0 : which == 3 ? reach : 0.0;
    for (int n = 1; n <= TERMS + 1; n++) /* reach^(TERMS + 1) omega^TERMS/(TERMS + 1)! */
        scale *= (n <= TERMS - (which == 3) ? c->omega : 1.0) * reach / n;
    const double last = phi[TERMS + 1], before = phi[TERMS] * sqrt(c->K) * reach / (TERMS + 1);
    /* For B the drive's derivative is omega^(TERMS - 1). */
    const double grown = which == 3 ? scale * reach : drive * scale * reach;
    return 1.0001 * (hypot(last, before) + grown);
}

void capsule_table_make(const capsule_constants *c, double part, capsule_table *t)
{
    memset(t, 0, sizeof *t);
    t->reach = part * CAPSULE_REACH / c->rate;
    t->root_K = sqrt(c->K);
    /* P - P(0) = (1 + kappa) x + 2 zeta (v - v(0)), and gamma v_c' = P - friction. */
    const double share = 1.0 + c->kappa, damper = 2.0 * c->zeta / t->reach;
    for (int n = 1; n <= TERMS; n++) {
        if (c->drift != 0.0) {
            t->from_position[n - 1] = n > 1 ? share * t->reach / (c->gamma * n) : 0.0;
            t->from_rate[n - 1] = n > 1 ? 2.0 * c->zeta / c->gamma : 0.0;
        } else {
            t->from_position[n - 1] = share;
            t->from_rate[n - 1] = n < TERMS ? damper * (n + 1) : 0.0;
        }
    }
    for (int k = 0; k < 4; k++) {
        double phi[TERMS + 2], size[TERMS + 2];
        response(c, t->reach, k, phi, size);
        const double rest = remainder_of(c, t->reach, k, phi);
        t->x_error[k] = rest;
        t->v_error[k] = (TERMS + 1) * rest / t->reach;
        t->second_error[k] = c->drift != 0.0
                                 ? (share * t->reach + 2.0 * c->zeta) / c->gamma * rest
                                 : share * rest + 2.0 * c->zeta * t->v_error[k];
        t->x_tail[k] = t->x_error[k];
        t->second_tail[k] = t->second_error[k];
        for (int n = 1; n <= TERMS; n++) {
            const double units = (5 * n + 32) * UNIT;
            const double second =
                c->drift != 0.0
                    ? t->from_position[n - 1] * phi[n - 1] + t->from_rate[n - 1] * phi[n]
                    : t->from_position[n - 1] * phi[n] + t->from_rate[n - 1] * phi[n + 1];
            const double second_size =
                c->drift != 0.0
                    ? t->from_position[n - 1] * size[n - 1] + t->from_rate[n - 1] * size[n]
                    : t->from_position[n - 1] * size[n] + t->from_rate[n - 1] * size[n + 1];
            t->x[k][n - 1] = phi[n];
            t->x_whole[k] += phi[n];
            t->v_whole[k] += n * phi[n] / t->reach;
            t->x_error[k] += units * size[n];
            t->v_error[k] += units * n * size[n] / t->reach;
            t->second_error[k] += units * second_size;
            t->x_bend[k] += n * (n - 1) * size[n];
            t->second_bend[k] += n * (n - 1) * second_size;
            if (n > DEGREE) {
                t->x_tail[k] += 1.0001 * fabs(phi[n]);
                t->second_tail[k] += 1.0001 * fabs(second);
                continue;
            }
            for (int j = 1; j <= DEGREE; j++) {
                t->x_form[k][j - 1] += BERNSTEIN[j - 1][n - 1] * phi[n];
                t->second_form[k][j - 1] += BERNSTEIN[j - 1][n - 1] * second;
            }
        }
        for (int j = 0; j < DEGREE; j++) {
            t->x_range[k] = greater(t->x_range[k], 1.0001 * fabs(t->x_form[k][j]));
            t->second_range[k] = greater(t->second_range[k], 1.0001 * fabs(t->second_form[k][j]));
        }
        t->x_bend[k] += (TERMS + 1) * TERMS * rest;
        t->second_bend[k] += (TERMS + 1) * TERMS * t->second_error[k];
    }
}

static void constants_of(const capsule_parameters *p, capsule_map *map)
{
    map->parameters = *p;
    for (int field = 1; field <= 6; field++)
        capsule_constants_of(field, p->alpha, p->omega, p->delta, p->zeta, p->beta, p->gamma,
                             p->f_b, &map->field[field - 1]);
    const capsule_constants *c = &map->field[1];
    const double amplitude = c->Z2 > 0.0 ? c->alpha / sqrt(c->Z2) : INFINITY;
    const double damper = 2.0 * c->zeta * c->omega;
    map->may_rest =
        amplitude < c->delta && amplitude * sqrt(c->K * c->K + damper * damper) < c->f_b;
}

void capsule_map_make(const capsule_parameters *parameters, capsule_map *map)
{
    constants_of(parameters, map);
    for (int contact = 0; contact < 2; contact++) {
        capsule_table_make(&map->field[3 * contact], 1.0, &map->table[2 * contact + 1]);
        capsule_table_make(&map->field[3 * contact + 1], 1.0, &map->table[2 * contact]);
    }
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

const char *capsule_digest(void)
{
    return CAPSULE_DIGEST;
}
