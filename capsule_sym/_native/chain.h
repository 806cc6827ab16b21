/* Derivatives along a chain of segments: of a segment's closed form, of the guard that ends it, and across a
   landing. A row holds the derivatives within a segment, with respect to its start, the forcing angle there,
   the elapsed time, and the parameters; total derivatives have their own columns, the parameters last. */
#ifndef CAPSULE_CHAIN_H
#define CAPSULE_CHAIN_H

#include <math.h>
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

/* Rows of the state and of x_c's advance some time after a segment's start; at rest the last two are 0. */
static inline void chain_rows(const capsule_constants *c, const capsule_start *start, double h,
                              double rows[ROWS][ROW])
{
    memset(rows, 0, ROWS * sizeof *rows);
    capsule_jacobian(c, start, h, &rows[0][0]);
}

/* Total derivatives of a quantity with a row, if the elapsed time has the derivatives `moved`. */
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

/* Row of a function of state and parameters from its gradient. The state's rows have so many columns, the
   last of them for the parameters, and lie `stride` apart. */
static inline void chain_gradient(const double gradient[CAPSULE_SLOPE_COUNT], const double *rows,
                                  int stride, int columns, double *row)
{
    for (int k = 0; k < columns; k++)
        row[k] = gradient[0] * rows[k] + gradient[1] * rows[stride + k] +
                 gradient[2] * rows[2 * stride + k];
    for (int k = 0; k < CAPSULE_PARAMETER_COUNT; k++)
        row[columns - CAPSULE_PARAMETER_COUNT + k] += gradient[STATES + 1 + k];
}

/* Derivatives at a time with derivatives `moved`, from those at a fixed time with the rate of change last. */
static inline void chain_moved(const double by[CAPSULE_COLUMN_COUNT],
                               const double moved[CAPSULE_SLOPE_COUNT], double to[CAPSULE_SLOPE_COUNT])
{
    for (int k = 0; k < CAPSULE_SLOPE_COUNT; k++)
        to[k] = by[k] + by[CAPSULE_SLOPE_COUNT] * moved[k];
}

/* Cosine and sine of the forcing angle some time after a segment's start. */
static inline void chain_turn(const capsule_constants *c, const capsule_start *start, double h,
                              double *cosine, double *sine)
{
    const double co = cos(c->omega * h), si = sin(c->omega * h);
    *cosine = start->cos_theta * co - start->sin_theta * si;
    *sine = start->sin_theta * co + start->cos_theta * si;
}

#if CAPSULE_PULSED
/* Row of the angle after a duration less that of the edge at which a level ends: a share of the turn. */
static inline void chain_edge(const capsule_constants *c, double h, double guard[ROW])
{
    memset(guard, 0, ROW * sizeof *guard);
    guard[BY_ANGLE] = 1.0;
    guard[BY_TIME] = c->omega;
    guard[BY(omega)] = h;
    guard[BY(CAPSULE_HIGH_SHARE)] = -TWO_PI * c->high;
}
#endif

/* Row of the guard that ends a segment some time after its start: the gap of the stop whose contact changes,
   v_c at the end of a slip, else Q less the bound that it passes. */
static inline void chain_guard(const capsule_constants *c, const capsule_constants *next,
                               const capsule_start *start, double h, const double end[STATES],
                               double rows[ROWS][ROW], double guard[ROW])
{
    double gradient[CAPSULE_SLOPE_COUNT];
    if (c->contact != next->contact)
        gap_gradient(c->contact != 0.0 ? c : next, gradient);
    else if (c->drift != 0.0)
        speed_gradient(c, gradient);
    else {
        double cosine = 0.0, sine = 0.0;
        if (CAPSULE_REACTION)
            chain_turn(c, start, h, &cosine, &sine);
        limit_gradient(c, next->drift, end[0] - c->CAPSULE_OWN_STOP, end[1], cosine, sine, gradient);
    }
    chain_gradient(gradient, &rows[0][0], ROW, ROW, guard);
    if (CAPSULE_REACTION && c->contact == next->contact && c->drift == 0.0) {
        guard[BY_ANGLE] += gradient[STATES];
        guard[BY_TIME] += gradient[STATES] * c->omega;
        guard[BY(omega)] += gradient[STATES] * h;
    }
}

/* Maps deviations of the state, a column each, across a landing: v_r' jumps by the opposite of v_c'. A
   sticking capsule has v_c' = 0, even at a landing so soft that the drift has none. */
static inline void chain_saltation(const capsule_constants *c, const capsule_constants *next,
                                   const capsule_start *start, double h, const double end[STATES],
                                   double deviation[STATES][STATES])
{
    const double gap = end[0] - c->CAPSULE_OWN_STOP;
    double cosine = 0.0, sine = 0.0;
    if (CAPSULE_REACTION)
        chain_turn(c, start, h, &cosine, &sine);
    const double before = v_c_rate(c, margin_at(c, end[0], gap, end[1], cosine));
    const double after = v_c_rate(next, margin_at(next, end[0], gap, end[1], cosine));
    const double ratio = next->drift != 0.0 ? after / before : 0.0;
    for (int k = 0; k < STATES; k++) {
        deviation[1][k] += (1.0 - ratio) * deviation[2][k];
        deviation[2][k] *= ratio;
    }
}

#endif
