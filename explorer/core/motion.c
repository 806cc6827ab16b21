/* The motion that a run comes to. One that settles slowly is found by Newton's method on the map of a few
   periods. */
#include <math.h>
#include <string.h>

#include "page.h"

#define NEAR 0.05 /* how near a state must be to that some periods before */
#define FAR 3.2   /* and the motion to the run */
#define LONGEST 8 /* periods of a motion that is looked for */
#define TRIES 3

int page_cycle(void)
{
    for (size_t i = 1; i < page.count; i++)
        if (page.segments[i - 1].target)
            return i + (size_t)page.motion.switches <= page.count ? (int)i : -1;
    return -1;
}

capsule_stop page_steady(double tolerance)
{
    static capsule_event events[2 * ROOM];
    return capsule_steady(&page.map, &page.state, page.strobe + 1, page.strobes, tolerance, events,
                          2 * ROOM, &page_watch, &page.motion, &page.open);
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
    for (int m = 1; m <= LONGEST && 2 * m < page.strobes; m++)
        if (distance(page.strobe[page.strobes], page.strobe[page.strobes - m]) <= NEAR)
            return m;
    return 0;
}

/* Whether deviations die away: all roots of z^3 - trace z^2 + minors z - determinant are within the unit
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
    const capsule_orbit_request request = {.segments = page.segments, .room = ROOM, .watch = &page_watch};
    const double *state = page.strobe[page.strobes], position = page.state.position;
    capsule_orbit orbit;
    page.count = 0;
    if (capsule_solve_orbit(&page.map, state, m, &request, &orbit) != CAPSULE_DONE ||
        (orbit.status != CAPSULE_CLOSED && orbit.status != CAPSULE_CHANGED) ||
        !contracts(orbit.monodromy) || !(distance(orbit.state, state) <= FAR))
        return 0;
    page.state = capsule_state_at(&page.map, orbit.state[0], orbit.state[1], orbit.state[2], 0.0);
    page.state.position = position;
    return 1;
}

capsule_stop page_motion(double tolerance)
{
    page.by_newton = 0;
    const capsule_stop stop = page_steady(tolerance);
    if (stop != CAPSULE_DONE || page.motion.period_number || page.motion.never)
        return stop;
    const capsule_state run = page.state;
    const capsule_motion none = page.motion;
    static double states[STROBES + 1][CAPSULE_STATE_COUNT];
    const int strobes = page.strobes;
    memcpy(states, page.strobe, sizeof states);
    for (int k = 0; k < TRIES; k++) {
        const int m = nearly();
        if (!m || !jump(m) || page_settle(STROBES) != CAPSULE_DONE)
            break;
        if (page_steady(tolerance) == CAPSULE_DONE && page.motion.period_number) {
            page.by_newton = 1;
            return CAPSULE_DONE;
        }
    }
    page.state = run;
    page.motion = none;
    page.strobes = strobes;
    memcpy(page.strobe, states, sizeof states);
    return CAPSULE_DONE;
}
