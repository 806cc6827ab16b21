/* Shared data of the expansions of one linear flow.

   A segment's motion is x_r(h) - x_r(0) = F H + v_r G + C Bd + S B, where F is the force at the
   start, C = alpha cos(angle), S = -alpha omega sin(angle), m times these if the drive reacts, and

       phi'' + 2 sigma phi' + K phi = drive,    drive = 1, 0, cos(omega h), sin(omega h)/omega

   for phi = H, G, Bd, B, all starting from zero but G' = 1. Their Taylor coefficients in
   s = h/reach do not depend on the state: a segment's are a multiplication for each response. Pulses are
   part of the force: there are the first two alone. */
#include <string.h>

#include "number.h"

#ifdef WIDE
#define FULL TERMS
#define SHORTER 0.5 /* of the reach in double precision: as many digits with fewer terms */
#else
#define FULL 22 /* terms of the Taylor series from which the tables are made */
#define SHORTER 1.0
#endif
#define RESPONSES CAPSULE_RESPONSE_COUNT

/* Changes of basis: of Chebyshev polynomials of degree k on [0, 1], and of s^i in Bernstein form. */
typedef struct {
    double chebyshev[FULL][FULL];
    real bernstein[DEGREE + 1][DEGREE + 1];
} bases;

static void bases_make(bases *b)
{
    memset(b, 0, sizeof *b);
    b->chebyshev[0][0] = 1.0;
    b->chebyshev[1][0] = -1.0, b->chebyshev[1][1] = 2.0;
    for (int k = 2; k < (FULL == TERMS ? 0 : FULL - 2); k++) { /* whole numbers below 2^53 */
        const double *one = b->chebyshev[k - 1], *two = b->chebyshev[k - 2];
        b->chebyshev[k][0] = -2.0 * one[0] - two[0];
        for (int i = 1; i <= k; i++)
            b->chebyshev[k][i] = 4.0 * one[i - 1] - 2.0 * one[i] - two[i];
    }
    for (int j = 0; j <= DEGREE; j++) {
        b->bernstein[j][0] = num(1.0);
        for (int i = 1; i <= j; i++)
            b->bernstein[j][i] = over(mul(b->bernstein[j][i - 1], num(j - i + 1.0)), num(DEGREE - i + 1.0));
    }
}

/* Lowers the degree of the responses' polynomials sum a[n] s^n from `from` to `to` with the least error, by
   multiples of s^3 times Chebyshev polynomials. Adds to `change`, `speed` and `bend` the largest changes of
   their values and derivatives, over s^3. With `by_rate` the derivatives change least: by multiples of the
   integrals of s^2 times these polynomials, which are at most s^3/3. */
static void economize(const bases *b, real (*a)[RESPONSES], int from, int to, int by_rate, double *change,
                      double *speed, double *bend)
{
    for (int k = from - 3; k > to - 3; k--) {
        double part[RESPONSES], sizes = 0.0;
        for (int i = 0; i <= k; i++)
            sizes += fabs(b->chebyshev[k][i]);
        for (int m = 0; m < RESPONSES; m++) {
            part[m] = near_to(a[k + 3][m]) / b->chebyshev[k][k];
            if (by_rate) {
                part[m] *= k + 3;
                change[m] += (0.3334 + 4.0 * UNIT * sizes) * fabs(part[m]);
                speed[m] += (1.0001 + 4.0 * UNIT * sizes) * fabs(part[m]);
                bend[m] += 1.0001 * fabs(part[m]) * (2 + 2 * k * k);
                continue;
            }
            change[m] += (1.0001 + 4.0 * UNIT * sizes) * fabs(part[m]);
            speed[m] += 1.0001 * fabs(part[m]) * (3 + 2 * k * k);
            bend[m] += 1.0001 * fabs(part[m]) * (6 + 12 * k * k + 4 * k * k * k * k);
        }
        for (int i = 0; i <= k; i++)
            for (int m = 0; m < RESPONSES; m++)
                a[i + 3][m] = sub(a[i + 3][m], num(part[m] * (by_rate ? b->chebyshev[k][i] / (i + 3)
                                                                      : b->chebyshev[k][i])));
    }
}

/* Coefficients n = 0 .. FULL + 1 of the responses in powers of s; their magnitudes, which the recurrence sums
   without signs; and their errors in units of these. */
typedef struct {
    real phi[FULL + 2][RESPONSES];
    double size[FULL + 2][RESPONSES];
    int units[FULL + 2];
} coefficients;

static void responses_make(const segment *c, const segment_sizes *b, double reach, coefficients *r)
{
    memset(r, 0, sizeof *r);
    r->phi[1][1] = num(reach), r->size[1][1] = reach;
    real even = num(1.0), odd = num(reach); /* terms of the drives cos(omega h) and sin(omega h)/omega */
    for (int n = 0; n < FULL; n++) {
        const real index = num((double)n);
        real drive[RESPONSES];
        for (int k = 0; k < RESPONSES; k++)
            drive[k] = num(k == 0 && n == 0 ? 1.0 : 0.0);
#if CAPSULE_PULSED
        (void)even, (void)odd;
        const int drive_units = RESPONSE_NEXT_DRIVE_UNITS;
#else
        const int drive_units = RESPONSE_NEXT_DRIVE_UNITS + n / 2 * FORCING_NEXT_BEFORE_UNITS;
        real *term = n % 2 ? &odd : &even;
        drive[2 + n % 2] = *term;
        *term = forcing_next(c, index, num(reach), *term);
#endif
        const int last_units = RESPONSE_NEXT_LAST_UNITS + r->units[n + 1];
        const int before_units = RESPONSE_NEXT_BEFORE_UNITS + r->units[n];
        r->units[n + 2] = last_units > before_units ? last_units : before_units;
        r->units[n + 2] = r->units[n + 2] > drive_units ? r->units[n + 2] : drive_units;
        for (int k = 0; k < RESPONSES; k++) {
            r->phi[n + 2][k] = response_next(c, index, num(reach), drive[k], r->phi[n + 1][k], r->phi[n][k]);
            r->size[n + 2][k] =
                response_next_size(b, n, reach, fabs(near_to(drive[k])), r->size[n + 1][k], r->size[n][k]);
        }
    }
}

/* Further units of error of a term of a motion from its evaluation: the state's multiple of its response, a
   product and two sums of `combined`, products and sums of Horner's method or of another basis for each
   power, and six more. */
static int evaluation_units(int n)
{
#if CAPSULE_PULSED
    const int state = REST_FORCE_UNITS;
#else
    const int state = REST_FORCE_UNITS > FORCING_TERMS_UNITS ? REST_FORCE_UNITS : FORCING_TERMS_UNITS;
#endif
    return state + 3 + 2 * n + 6;
}

/* Bound on the Taylor remainder of a response after coefficient FULL at s = 1. With
   y = phi^(FULL), sqrt(y'^2 + K y^2) grows at most by the drive's derivative per unit of time. */
static double remainder_of(const segment_sizes *b, double reach, int which, const coefficients *r)
{
    const double last = near_to(r->phi[FULL + 1][which]);
    const double before = near_to(r->phi[FULL][which]) * sqrt(b->K) * reach / (FULL + 1);
    double grown = which >= 2;
    for (int n = 1; which >= 2 && n <= FULL + 1; n++) /* reach^(FULL + 1) omega^FULL/(FULL + 1)! */
        grown *= (n <= FULL - (which == 3) ? b->omega : 1.0) * reach / n;
    /* For B the drive's derivative is omega^(FULL - 1). */
    return 1.0001 * (hypot(last, before) + grown * reach);
}

/* Relation of the second guard's coefficients (Q's change at rest, v_c's in drift) to those of x_r: two
   neighbours, and the drive's own if it reacts. */
typedef struct {
    real by[FULL + 2], rate[FULL + 2];
    int behind;
#if CAPSULE_REACTION
    real reaction[FULL + 2][RESPONSES];
    double reaction_left[RESPONSES]; /* remainder of the reaction's series, over s^3 */
#endif
} relation;

static relation relation_of(const segment *c, const segment_sizes *z, double reach_, int drift)
{
    relation r = {.behind = BEHIND(drift)};
    const real reach = num(reach_), one = num(1.0), none_ = num(0.0);
    const real share = force_change(c, one, none_), damper = force_change(c, none_, one);
    for (int n = 1; n <= FULL + 1; n++) {
#if CAPSULE_REACTION
        /* (gamma + 1) v_c + v_r has no drive in it. */
        r.by[n] = drift ? none_ : share;
        r.rate[n] = over(mul(drift ? neg(over(one, add(c->gamma, one))) : damper, num(n + 1.0)), reach);
#else
        /* P - P(0) by the changes of x_r and v_r, and gamma v_c' = P - friction. */
        r.by[n] = drift ? over(mul(v_c_rate(c, share), reach), num((double)n)) : share;
        r.rate[n] = drift ? v_c_rate(c, damper) : over(mul(damper, num(n + 1.0)), reach);
#endif
        if (drift && n == 1)
            r.by[n] = r.rate[n] = none_;
    }
#if CAPSULE_REACTION
    memset(r.reaction, 0, sizeof r.reaction);
    memset(r.reaction_left, 0, sizeof r.reaction_left);
    if (drift)
        return r;
    /* cos(omega h) - 1 and sin(omega h)/omega, whose derivatives keep within powers of omega. */
    double left = 1.0;
    for (int n = 1; n <= FULL + 1; n++)
        left *= z->omega * reach_ / n;
    real even = one, odd = reach;
    for (int n = 1; n <= FULL; n++)
        if (n % 2) {
            r.reaction[n][3] = odd;
            odd = forcing_next(c, num((double)n), reach, odd);
        } else {
            even = forcing_next(c, num(n - 2.0), reach, even);
            r.reaction[n][2] = even;
        }
    r.reaction_left[2] = 1.0001 * left;
    r.reaction_left[3] = 1.0001 * left / z->omega;
#else
    (void)z;
#endif
    return r;
}

/* Coefficient n of the second guard in a response, from those of x_r up to `last`. */
static real second_of(const relation *r, const real (*x)[RESPONSES], int last, int n, int k)
{
    const int at = n - r->behind;
    const real next = at < last ? x[at + 1][k] : num(0.0);
    const real term = mad(r->by[n], x[at][k], mul(r->rate[n], next));
#if CAPSULE_REACTION
    return sub(term, r->reaction[n][k]);
#else
    return term;
#endif
}

/* Responses at the end of an expansion, by the closed form if it has the digits: in a segment of hundreds
   of expansions an error of the series would repeat each time. The difference from the series, whose error
   is bounded, is added to that bound, so the closed form's error is proved as well. */
static void wholes_make(const capsule_constants *field, const segment *c, const real (*x)[RESPONSES],
                        const relation *second, table *t)
{
    for (int k = 0; k < RESPONSES; k++) {
        t->x_whole[k] = t->v_whole[k] = t->second_whole[k] = num(0.0);
        for (int n = FULL + second->behind; n >= 1; n--) {
            t->second_whole[k] = add(t->second_whole[k], second_of(second, x, FULL, n, k));
            if (n > FULL)
                continue;
            t->x_whole[k] = add(t->x_whole[k], x[n][k]);
            t->v_whole[k] = add(t->v_whole[k], mul(num((double)n), x[n][k]));
        }
        t->v_whole[k] = over(t->v_whole[k], num(t->reach));
    }
#ifdef WIDE
    (void)field, (void)c;
#else
    const double h = t->reach;
    /* Position, gap, speeds, margin and drive of the starts. */
#if CAPSULE_PULSED
    const capsule_start start[RESPONSES] = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
                                            {0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0}};
    const double impulse[RESPONSES] = {h, 0.0};
#else
    const double omega = c->omega, half = sin(0.5 * omega * h) / omega;
    const capsule_start start[RESPONSES] = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
                                            {0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0},
                                            {0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0},
                                            {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0}};
    const double turned = sin(omega * h) / omega, versine = 2.0 * half * half;
#if CAPSULE_REACTION
    const double impulse[RESPONSES] = {h, 0.0, h, 0.0};
    const double reaction[RESPONSES] = {0.0, 0.0, -omega * omega * versine, turned};
#else
    const double impulse[RESPONSES] = {h, 0.0, turned, versine};
#endif
#endif
    capsule_constants unit[RESPONSES];
    double changes[RESPONSES][3];
    for (int k = 0; k < RESPONSES; k++) {
        unit[k] = *field;
        unit[k].drift = 0.0;
        unit[k].m = 1.0; /* of the drive alone: these starts have no spring */
        unit[k].push = k == 0;
#if !CAPSULE_PULSED
        unit[k].alpha = k == 3 ? 1.0 / omega : k == 2;
#endif
    }
    capsule_flow_each(unit, start, RESPONSES, h, changes[0]);
    for (int k = 0; k < RESPONSES; k++) {
        const double *change = changes[k], gained = change[1] - (k == 1);
        double second_whole =
            c->drift != 0.0
                ? (impulse[k] - gained - force_change(c, 0.0, h * (k == 1) * c->m)) / (c->gamma + 1.0)
                : force_change(c, change[0], gained);
#if CAPSULE_REACTION
        if (c->drift == 0.0)
            second_whole -= reaction[k];
#endif
        t->limit[k][X_ERROR] += fabs(change[0] - t->x_whole[k]);
        t->v_error[k] += fabs(change[1] - t->v_whole[k]);
        t->limit[k][SECOND_ERROR] += fabs(second_whole - t->second_whole[k]);
        t->x_whole[k] = change[0];
        t->v_whole[k] = change[1];
        t->second_whole[k] = second_whole;
    }
#endif
}

/* Bernstein forms of both guards on the whole reach and on its halves, and their ranges; side by side for all
   responses. */
static void forms_make(const bases *b, const real (*x)[RESPONSES], const real (*second)[RESPONSES], table *t)
{
    enum { ALL = 2 * RESPONSES };
    real work[DEGREE + 1][ALL];
    for (int j = 0; j <= DEGREE; j++) {
        for (int k = 0; k < ALL; k++)
            work[j][k] = num(0.0);
        for (int n = 1; n <= j && n <= TERMS + 1; n++)
            for (int k = 0; k < RESPONSES; k++) {
                if (n <= TERMS)
                    work[j][k] = mad(b->bernstein[j][n], x[n][k], work[j][k]);
                work[j][RESPONSES + k] = mad(b->bernstein[j][n], second[n][k], work[j][RESPONSES + k]);
            }
        for (int k = 0; j && k < RESPONSES; k++) {
            const real *one = work[j] + k, *other = one + RESPONSES;
            t->x_form[0][k][j - 1] = *one;
            t->second_form[0][k][j - 1] = *other;
            t->limit[k][X_RANGE] = larger(t->limit[k][X_RANGE], 1.0001 * fabs(near_to(*one)));
            t->limit[k][SECOND_RANGE] = larger(t->limit[k][SECOND_RANGE], 1.0001 * fabs(near_to(*other)));
        }
    }
    /* Half as long each: the left half's form (de Casteljau), whose coefficient 0 is 0. */
    for (int l = 1; l < LEVELS; l++) {
        real half[DEGREE][ALL];
        for (int i = 1; i <= DEGREE; i++) {
            for (int j = 0; j + i <= DEGREE; j++)
                for (int k = 0; k < ALL; k++)
                    work[j][k] = mean(work[j][k], work[j + 1][k]);
            memcpy(half[i - 1], work[0], sizeof *half);
        }
        for (int k = 0; k < ALL; k++)
            work[0][k] = num(0.0);
        memcpy(work + 1, half, sizeof half);
        for (int i = 0; i < DEGREE; i++)
            for (int k = 0; k < RESPONSES; k++) {
                t->x_form[l][k][i] = half[i][k];
                t->second_form[l][k][i] = half[i][RESPONSES + k];
            }
    }
}

/* Reach of expansions, and the sizes of a motion that an energy bounds. */
static void scales_make(const capsule_constants *field, const segment *c, const segment_sizes *z, table *t)
{
    t->root_K = sqrt(z->K);
    t->force_per_energy = near_to(force_per_energy(c, num(t->root_K))) * (1.0 + 4.0 * UNIT);
    t->x_per_energy = (1.0 + 4.0 * UNIT) / t->root_K;
    t->v_c_per_energy = 2.0 * (1.0 + 4.0 * UNIT) / (z->gamma + 1.0);
    t->contact = (int)field->contact;
    /* A damped response is smaller than the terms of its series: the reach is limited so that digits
       remain. */
    const double growth = t->root_K + 2.0 * z->sigma + (field->q < 0.0 ? field->nu : 0.0);
    t->reach = SHORTER * smaller(CAPSULE_REACH / field->rate, CAPSULE_GROWTH / growth);
    t->reach_per_gamma = (1.0 + 4.0 * UNIT) * t->reach / z->gamma;
    t->per_reach = over(num(1.0), num(t->reach));
    for (int l = 0; l < LEVELS; l++)
        t->level[l] = ldexp(1.0, -l);
}

static void table_make(const bases *b, const capsule_constants *field, const segment *c, table *t)
{
    segment_sizes room;
    const segment_sizes *z = sizes_of(c, &room);
    memset(t, 0, sizeof *t);
    scales_make(field, c, z, t);
    const int drift = field->drift != 0.0;
    relation to_second = relation_of(c, z, t->reach, drift);
    for (int n = 1; n <= TERMS + 1; n++) {
        t->from_position[n - 1] = to_second.by[n];
        t->from_rate[n - 1] = to_second.rate[n];
    }
    coefficients of;
    responses_make(c, z, t->reach, &of);
    real(*x)[RESPONSES] = of.phi, second[TERMS + 2][RESPONSES];
    double rest[RESPONSES], sum[5][RESPONSES] = {{0}};
    memset(second, 0, sizeof second);
    for (int k = 0; k < RESPONSES; k++)
        rest[k] = remainder_of(z, t->reach, k, &of);
    for (int n = 1; n <= FULL; n++) {
        const double off = (of.units[n] + evaluation_units(n)) * UNIT;
        const int at = n - to_second.behind;
        /* From P's change (in drift over gamma), with products and quotients; if it needs coefficient n
           + 1 of x_r, that has a larger error, and two more units in its evaluation. */
        double second_off = off + (FORCE_CHANGE_UNITS + 8) * UNIT;
        if (at == n)
            second_off += (of.units[n + 1] - of.units[n] + 2) * UNIT;
#if CAPSULE_REACTION
        /* Two more sums, and the drive's coefficient, whose error is less than a response's and which
           cancels the term that it drives: so its size counts. */
        second_off += 2 * UNIT;
#endif
        const double by = near_to(to_second.by[n]), rate = fabs(near_to(to_second.rate[n]));
        for (int k = 0; k < RESPONSES; k++) {
            const double size = of.size[n][k];
            double second_size = by * of.size[at][k] + rate * of.size[at + 1][k];
#if CAPSULE_REACTION
            second_size += fabs(near_to(to_second.reaction[n][k]));
#endif
            sum[0][k] += off * size;
            sum[1][k] += off * n * size / t->reach;
            sum[2][k] += second_off * second_size;
            t->x_speed[k] += n * size;
            t->second_speed[k] += n * second_size;
            sum[3][k] += n * (n - 1) * size;
            sum[4][k] += n * (n - 1) * second_size;
        }
    }
    for (int k = 0; k < RESPONSES; k++) {
        t->limit[k][X_ERROR] = sum[0][k];
        t->v_error[k] = sum[1][k];
        t->limit[k][SECOND_ERROR] = sum[2][k];
        t->limit[k][X_BEND] = sum[3][k];
        t->limit[k][SECOND_BEND] = sum[4][k];
    }
    wholes_make(field, c, (const real(*)[RESPONSES])x, &to_second, t);
    double change[RESPONSES] = {0}, speed[RESPONSES] = {0}, bend[RESPONSES] = {0}, tail[RESPONSES] = {0}, unused[2][RESPONSES] = {{0}};
    economize(b, x, FULL, TERMS, CAPSULE_REACTION, change, speed, bend); /* v_c is by v_r there */
#if CAPSULE_REACTION
    economize(b, to_second.reaction, FULL, TERMS, 0, to_second.reaction_left, unused[0], unused[1]);
    for (int n = 1; n <= TERMS; n++)
        for (int k = 0; k < 2; k++)
            t->reaction[k][n - 1] = to_second.reaction[n][k + 2];
#endif
    for (int n = 1; n <= TERMS + to_second.behind; n++)
        for (int k = 0; k < RESPONSES; k++)
            second[n][k] = second_of(&to_second, (const real(*)[RESPONSES])x, TERMS, n, k);
    /* The remainder has two parts. Taylor's remainder is at most rest s^(FULL + 1), and derivatives take a
       factor FULL + 1, FULL, ... each. The economized part of the second guard is a polynomial of degree N
       = FULL + 1 or less with values within `left` on [0, 1], so by Markov's inequality its second
       derivative is within 4 N^2 (N^2 - 1)/3 of that, which is more than (FULL + 1) FULL. At rest, and in
       drift with a reaction, a part by v_r is left out as s^2, not s^3: there at most one derivative (two)
       of the guard vanishes at the start, and SECOND_ERROR has all of it. Speeds are those of the motion,
       not of the polynomial, whose difference from it is in the errors. */
    const double N2 = (FULL + 1.0) * (FULL + 1.0), MARKOV = 4.0 / 3.0 * N2 * (N2 - 1.0);
    for (int k = 0; k < RESPONSES; k++) {
        const double x_left = rest[k] + change[k];
        const double v_left = ((FULL + 1) * rest[k] + speed[k]) / t->reach;
#if CAPSULE_REACTION
        const double left = drift ? v_left / (z->gamma + 1.0)
                                  : force_change_size(z, x_left, v_left) + to_second.reaction_left[k];
#else
        const double left = drift ? force_change_size(z, t->reach * x_left, x_left) / z->gamma
                                  : force_change_size(z, x_left, v_left);
#endif
        t->limit[k][X_ERROR] += x_left;
        t->v_error[k] += v_left;
        t->limit[k][SECOND_ERROR] += left;
        t->x_speed[k] += (FULL + 1) * rest[k];
        t->second_speed[k] += (FULL + 1) * left;
        t->limit[k][X_BEND] += (FULL + 1) * FULL * rest[k] + bend[k];
        t->limit[k][SECOND_BEND] += MARKOV * left;
        t->limit[k][X_TAIL] = x_left;
        t->limit[k][SECOND_TAIL] = left;
        for (int n = 1; n <= TERMS; n++)
            t->x[k][n - 1] = x[n][k];
    }
    economize(b, x, TERMS, DEGREE, 0, tail, unused[0], unused[1]);
    for (int k = 0; k < RESPONSES; k++) {
        t->limit[k][X_TAIL] += tail[k];
        tail[k] = 0.0;
    }
    economize(b, second, TERMS + to_second.behind, DEGREE, 0, tail, unused[0], unused[1]);
    for (int k = 0; k < RESPONSES; k++)
        t->limit[k][SECOND_TAIL] += tail[k];
    forms_make(b, (const real(*)[RESPONSES])x, (const real(*)[RESPONSES])second, t);
}
