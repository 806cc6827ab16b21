/* Derivatives along a chain of segments: of a segment's closed form, of the guard that ends it, and over
   a landing. A row holds the derivatives within a segment, by its start, the forcing angle there, the
   time since, and the parameters; total derivatives have columns of their own, the parameters last. */
#ifndef CAPSULE_CHAIN_H
#define CAPSULE_CHAIN_H

#include <string.h>

#include "number.h"

enum {
    STATES = CAPSULE_STATE_COUNT,
    BY_ANGLE = STATES,
    BY_TIME,
    BY_PARAMETER,
    ROW = BY_PARAMETER + CAPSULE_PARAMETER_COUNT,
    ROWS = STATES + 1, /* x_r, v_r, v_c, and x_c's advance */
};
#define BY(parameter) (BY_PARAMETER + (int)(offsetof(capsule_parameters, parameter) / sizeof(double)))

/* Rows of the state and of x_c's advance a time after a segment's start; at rest the last two are 0. */
static inline void chain_rows(const capsule_constants *c, const capsule_start *start, double h,
                              double rows[ROWS][ROW])
{
    memset(rows, 0, ROWS * sizeof *rows);
    capsule_jacobian(c, start, h, &rows[0][0]);
}

/* Total derivatives of what has a row, where the time since the start has `moved`. */
static inline void chain_total(const double *restrict row, const double *restrict state_by,
                               const double *restrict angle_by, const double *restrict moved,
                               int columns, double *restrict total)
{
    for (int k = 0; k < columns; k++)
        total[k] = row[0] * state_by[k] + row[1] * state_by[columns + k] +
                   row[2] * state_by[2 * columns + k] + row[BY_ANGLE] * angle_by[k] +
                   row[BY_TIME] * moved[k];
    for (int k = 0; k < CAPSULE_PARAMETER_COUNT; k++)
        total[columns - CAPSULE_PARAMETER_COUNT + k] += row[BY_PARAMETER + k];
}

/* The row of P, of x_r and v_r with these rows. */
static inline void chain_force(const capsule_constants *c, double x_r, double v_r,
                               const double x_row[ROW], const double v_row[ROW], double row[ROW])
{
    double by_delta, by_zeta, by_beta;
    for (int k = 0; k < ROW; k++)
        row[k] = force_change(c, x_row[k], v_row[k]);
    force_slopes(c, x_r - c->delta, v_r, &by_delta, &by_zeta, &by_beta);
    row[BY(delta)] += by_delta;
    row[BY(zeta)] += by_zeta;
    row[BY(beta)] += by_beta;
}

/* The rate of v_c at a state, and its row at the start of a segment. */
static inline double chain_slip(const capsule_constants *c, double x_r, double v_r, double row[ROW])
{
    const double rate = v_c_rate(c, margin_at(c, x_r, x_r - c->delta, v_r));
    const double by_x[ROW] = {1.0}, by_v[ROW] = {0.0, 1.0};
    chain_force(c, x_r, v_r, by_x, by_v, row);
    row[BY(f_b)] -= c->drift;
    for (int k = 0; k < ROW; k++)
        row[k] = v_c_rate(c, row[k]);
    row[BY(gamma)] -= rate / c->gamma;
    return rate;
}

/* The row of the guard that ends a segment: of x_r - delta where contact changes, of v_c where a slip
   ends, else of P less the bound that it passes. */
static inline void chain_guard(const capsule_constants *c, const capsule_constants *next,
                               const double end[STATES], double rows[ROWS][ROW], double guard[ROW])
{
    const int impact = c->contact != next->contact;
    if (!impact && c->drift == 0.0) {
        chain_force(c, end[0], end[1], rows[0], rows[1], guard);
        guard[BY(f_b)] -= next->drift;
        return;
    }
    memcpy(guard, rows[impact ? 0 : 2], ROW * sizeof *guard);
    guard[BY(delta)] -= impact;
}

/* Takes deviations of the state, a column each, over a landing: v_r' jumps by as much as v_c' does, the
   other way. What sticks has no v_c', even where the landing is so soft that the drift has none. */
static inline void chain_saltation(const capsule_constants *c, const capsule_constants *next,
                                   const double end[STATES], double deviation[STATES][STATES])
{
    const double gap = end[0] - c->delta;
    const double before = v_c_rate(c, margin_at(c, end[0], gap, end[1]));
    const double after = v_c_rate(next, margin_at(next, end[0], gap, end[1]));
    const double ratio = next->drift != 0.0 ? after / before : 0.0;
    for (int k = 0; k < STATES; k++) {
        deviation[1][k] += (1.0 - ratio) * deviation[2][k];
        deviation[2][k] *= ratio;
    }
}

#endif
