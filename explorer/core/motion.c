/* The motion that a run comes to, for the page, the columns of a diagram and the cells of a chart. One that
   settles slowly is found by Newton's method on the map of a few periods. */
#include <math.h>
#include <string.h>

#include "page.h"

#define NEAR 0.05 /* how near a state must be to that some periods before */
#define FAR 3.2   /* and the motion to the run */
#define LONGEST 8 /* periods of a motion that is looked for */
#define TRIES 3
#define BLOCK 64 /* periods between two looks at whether a run is over */

/* The periodic motion that the run has come to. */
static capsule_stop steady(double tolerance)
{
    static capsule_event events[2 * ROOM];
    return capsule_steady(&map, &run.state, run.strobe + 1, run.strobes, tolerance, events, 2 * ROOM,
                          &watch, &run.motion, &left_open);
}

static double distance(const double *one, const double *other)
{
    double most = 0.0;
    for (int i = 0; i < CAPSULE_STATE_COUNT; i++)
        most = fmax(most, fabs(one[i] - other[i]));
    return most;
}

/* Periods after which the last states come near to each other again; 0 if they do not. */
static int nearly(void)
{
    for (int m = 1; m <= LONGEST && 2 * m < run.strobes; m++)
        if (distance(run.strobe[run.strobes], run.strobe[run.strobes - m]) <= NEAR)
            return m;
    return 0;
}

/* True if deviations decay: all roots of z^3 - trace z^2 + minors z - determinant are within the unit
   circle (Jury's conditions). */
static int contracts(const double m[CAPSULE_STATE_COUNT * CAPSULE_STATE_COUNT])
{
    const double trace = m[0] + m[4] + m[8], first = m[4] * m[8] - m[5] * m[7];
    const double minors = first + (m[0] * m[8] - m[2] * m[6]) + (m[0] * m[4] - m[1] * m[3]);
    const double determinant =
        m[0] * first - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
    return fabs(trace + determinant) < 1.0 + minors && fabs(determinant) < 1.0 &&
           fabs(minors - trace * determinant) < 1.0 - determinant * determinant;
}

/* Takes the run to the stable motion of m periods that Newton's method leads to, if that is near. */
static int jump(int m)
{
    const capsule_orbit_request request = {.segments = segments, .room = ROOM, .watch = &watch};
    const double *state = run.strobe[run.strobes], position = run.state.position;
    capsule_orbit orbit;
    count = 0;
    if (capsule_solve_orbit(&map, state, m, &request, &orbit) != CAPSULE_DONE ||
        (orbit.status != CAPSULE_CLOSED && orbit.status != CAPSULE_CHANGED) ||
        !contracts(orbit.monodromy) || !(distance(orbit.state, state) <= FAR))
        return 0;
    run.state = capsule_state_at(&map, orbit.state[0], orbit.state[1], orbit.state[2], 0.0);
    run.state.position = position;
    return 1;
}

/* The motion that the run has come to, or comes to: where it settles slowly, Newton's method on the map of
   so many periods leads to the stable motion beside it, which is run like any other. */
static capsule_stop attained(double tolerance, int *by_newton)
{
    const capsule_stop stop = steady(tolerance);
    *by_newton = 0;
    if (stop != CAPSULE_DONE || run.motion.period_number || run.motion.never)
        return stop;
    const page_run before = run;
    for (int k = 0; k < TRIES; k++) {
        const int m = nearly();
        if (!m || !jump(m) || settle(STROBES) != CAPSULE_DONE)
            break;
        *by_newton = steady(tolerance) == CAPSULE_DONE && run.motion.period_number;
        if (*by_newton)
            return CAPSULE_DONE;
    }
    run = before;
    return CAPSULE_DONE;
}

/* The same, for the page; whether Newton's method led to it. */
EXPORT(motion) int motion(double tolerance)
{
    int by_newton;
    attained(tolerance, &by_newton);
    return by_newton;
}

/* The number of periods after which the run repeats to the last bit, or 0: as it is a function of its
   state, what follows is known. */
static int repeats(void)
{
    double(*last)[CAPSULE_STATE_COUNT] = &run.strobe[run.strobes];
    for (int m = 1; m <= STROBES / 2 && m < run.strobes; m++)
        if (memcmp(last, last - m, sizeof *last) == 0)
            return m;
    return 0;
}

/* The motion that the run comes to from where `start` put it: after so many periods, or early, as soon as it
   is steady. A motion that repeats to the last bit is not run again, if not early: only the rest that a whole number
   of repetitions leaves. */
EXPORT(attain) capsule_stop attain(double periods, int early)
{
    int by_newton;
    for (double left = periods; left > 0.0;) {
        const double now = left < 2 * BLOCK ? left : BLOCK;
        capsule_stop stop = settle(now);
        left -= now;
        if (stop == CAPSULE_DONE && early && left > 0.0)
            stop = steady(1e-12);
        if (stop != CAPSULE_DONE || run.motion.period_number || run.motion.never)
            return stop;
        const int m = left > 0.0 && !early ? repeats() : 0;
        if (m)
            left = fmod(left, m) > 0.0 ? fmod(left, m) + STROBES - STROBES % m : 0.0;
    }
    return attained(1e-9, &by_newton);
}
