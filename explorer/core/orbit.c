/* The periodic orbit of the recorded motion, its branch, and the bifurcations next to it: by the library's
   equations of an itinerary. */
#include <string.h>

#include "page.h"

enum { DURATION = CAPSULE_UNKNOWNS(0), MATRIX = CAPSULE_STATE_COUNT * CAPSULE_STATE_COUNT };

/* The orbit's itinerary, its unknowns, and the equations there. */
static int32_t fields[LONGEST_ITINERARY];
static capsule_itinerary orbit = {.fields = fields};
static double z[CAPSULE_UNKNOWNS(LONGEST_ITINERARY)];
static capsule_system equations;

EXPORT(unknowns_at) double *unknowns_at(void) { return z; }

/* Takes the orbit from the recorded segments of one period of the motion, begun in stick if there is any.
   Its monodromy matrix, as it was run; how many segments, 0 where they are too many. */
EXPORT(take) int take(int first)
{
    static double block[CAPSULE_EQUATIONS_ROOM(LONGEST_ITINERARY)];
    const capsule_segment *s = segments + first;
    const int n = run.motion.switches;
    int begin = 0;
    if (n < 2 || n > LONGEST_ITINERARY)
        return 0;
    while (begin < n && map.field[s[begin].field - 1].drift != 0.0)
        begin++;
    orbit.count = n;
    orbit.periods = run.motion.period_number;
    memcpy(z, s[begin % n].start, sizeof s->start);
    z[DURATION - 1] = s[begin % n].start_angle;
    for (int i = 0; i < n; i++) {
        fields[i] = s[(begin + i) % n].field;
        z[DURATION + i] = s[(begin + i) % n].duration;
    }
    equations = capsule_equations_in(block, n);
    if (capsule_evaluate_itinerary(&map.parameters, &orbit, z, &equations) != CAPSULE_DONE)
        return 0;
    memcpy(numbers, equations.monodromy, MATRIX * sizeof *numbers);
    return n;
}

/* Solves the orbit's equations at the given parameters; or, where `held` is not below 0, with this unknown
   held and the parameter `free` in its place: 0 to 2 the state, 3 the angle, then the durations. So a branch
   is followed through its folds, where no fixed parameter would do, and a fixed segment of duration 0 is a bifurcation.
   Results: the monodromy matrix, x_c's advance, residual, the parameter `free`; of the held segment
   also the state at its start, P, and the fields about it. It takes the orbit's place if it is to be kept.
   0, and the orbit as it was, where Newton's method fails, or a duration is below 0. */
EXPORT(solve) int solve(int held, double at, int free, int keep)
{
    static double workspace[CAPSULE_ITINERARY_ROOM(LONGEST_ITINERARY)], next[sizeof z / sizeof *z];
    double direction[CAPSULE_PARAMETER_COUNT] = {0.0};
    capsule_itinerary_request request = {.workspace = workspace, .held = held, .watch = &watch};
    capsule_parameters p = given;
    capsule_solution solution = {0};
    memcpy(next, z, sizeof z);
    if (held >= 0) {
        next[held] = at;
        direction[free] = 1.0;
        request.direction = direction;
    }
    int done = capsule_solve_itinerary(&orbit, &request, &p, next, &equations, &solution) ==
                   CAPSULE_DONE && solution.status == CAPSULE_SOLVED;
    for (int i = 0; i < orbit.count; i++)
        done &= next[DURATION + i] > 0.0 || (held >= 0 && DURATION + i == held);
    const int n = orbit.count, i = held < DURATION ? 0 : held - DURATION;
    capsule_start start;
    memcpy(&start, equations.flows[i].start, sizeof start);
    const double row[] = {equations.advance, solution.residual, ((const double *)&p)[free], start.x_r,
                          start.v_r, start.v_c, start.margin + map.field[fields[i] - 1].friction,
                          fields[(i + n - 1) % n], fields[i], fields[(i + 1) % n]};
    memcpy(numbers, equations.monodromy, MATRIX * sizeof *numbers);
    memcpy(numbers + MATRIX, row, sizeof row);
    if (done && keep) {
        given = p;
        memcpy(z, next, sizeof z);
    }
    return done;
}

/* State and angle in the middle of the orbit's first segment, where no guard is near. */
EXPORT(orbit_within) void orbit_within(void)
{
    const double whole = z[DURATION];
    z[DURATION] /= 2.0;
    capsule_evaluate_itinerary(&given, &orbit, z, &equations);
    memcpy(numbers, equations.flows[0].end, sizeof equations.flows[0].end);
    numbers[DURATION - 1] = z[DURATION - 1] + given.omega * z[DURATION];
    z[DURATION] = whole;
}
