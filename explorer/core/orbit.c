/* The periodic orbit of the recorded motion, and the bifurcations next to it: by the library's equations
   of an itinerary. */
#include <string.h>

#include "page.h"

/* An orbit: its itinerary, its unknowns, and the equations there. */
typedef struct {
    capsule_itinerary itinerary;
    int32_t fields[LONGEST_ITINERARY];
    double z[CAPSULE_UNKNOWNS(LONGEST_ITINERARY)];
} page_orbit;

enum { DURATION = CAPSULE_UNKNOWNS(0), MATRIX = CAPSULE_STATE_COUNT * CAPSULE_STATE_COUNT };

static page_orbit orbit;
static capsule_system equations;
static double block[CAPSULE_EQUATIONS_ROOM(LONGEST_ITINERARY)];

static const capsule_constants *field_of(int field) { return &page.map.field[field - 1]; }

/* From the recorded segments of one period of the motion, begun in stick if there is any. 0 where they
   are too many. */
static int orbit_from(int first, page_orbit *o)
{
    const capsule_segment *s = page.segments + first;
    const int n = page.motion.switches;
    int begin = 0;
    if (first < 0 || n < 2 || n > LONGEST_ITINERARY)
        return 0;
    while (begin < n && field_of(s[begin].field)->drift != 0.0)
        begin++;
    begin %= n;
    o->itinerary = (capsule_itinerary){o->fields, n, page.motion.period_number, 0};
    memcpy(o->z, s[begin].start, sizeof s[begin].start);
    o->z[DURATION - 1] = s[begin].start_angle;
    for (int i = 0; i < n; i++) {
        o->fields[i] = s[(begin + i) % n].field;
        o->z[DURATION + i] = s[(begin + i) % n].duration;
    }
    equations = capsule_equations_in(block, n);
    return capsule_evaluate_itinerary(&page.map.parameters, &o->itinerary, o->z, &equations) ==
           CAPSULE_DONE;
}

int page_monodromy(int first, double *matrix)
{
    static page_orbit run;
    if (!orbit_from(first, &run))
        return 0;
    memcpy(matrix, equations.monodromy, MATRIX * sizeof *matrix);
    return 1;
}

/* Solves the orbit's equations at the parameters `values`, or with unknown `held` held and the parameter
   `free` in its place, which is written to. 0 where Newton's method fails, or a duration is below 0. */
static int solve(page_orbit *o, double *values, int held, int free, capsule_solution *solution)
{
    static double workspace[CAPSULE_ITINERARY_ROOM(LONGEST_ITINERARY)];
    double direction[CAPSULE_PARAMETER_COUNT] = {0.0};
    capsule_itinerary_request request = {.workspace = workspace, .held = held, .watch = &page_watch};
    capsule_parameters parameters;
    if (free >= 0)
        direction[free] = 1.0, request.direction = direction;
    memcpy(&parameters, values, sizeof parameters);
    o->itinerary.fields = o->fields;
    equations = capsule_equations_in(block, o->itinerary.count);
    if (capsule_solve_itinerary(&o->itinerary, &request, &parameters, o->z, &equations, solution) !=
        CAPSULE_DONE)
        return 0;
    memcpy(values, &parameters, sizeof parameters);
    for (int i = 0; i < o->itinerary.count; i++)
        if (!(o->z[DURATION + i] > 0.0) && (free < 0 || DURATION + i != held))
            return 0;
    return solution->status == CAPSULE_SOLVED;
}

/* The orbit of the recorded motion: whether it closed, its monodromy, x_c's advance, residual, the
   first segment's number among the recorded ones, energies over the motion's period, switches. */
EXPORT(closed) int closed(void)
{
    const int first = page_cycle();
    capsule_solution solution = {0};
    if (!orbit_from(first, &orbit))
        return 0;
    const int done = solve(&orbit, given, 0, -1, &solution);
    double *const energies = numbers + MATRIX + 3;
    memcpy(numbers, equations.monodromy, MATRIX * sizeof *numbers);
    numbers[MATRIX] = equations.advance;
    numbers[MATRIX + 1] = solution.residual;
    numbers[MATRIX + 2] = first;
    memset(energies, 0, 3 * sizeof *energies);
    capsule_add_energies(&page.map, page.segments + first, (size_t)page.motion.switches, NULL, energies);
    energies[3] = page.motion.switches;
    return done ? 1 : -1;
}

/* The orbit that `closed` left, followed to other parameters: its monodromy; 0 where it is lost. */
EXPORT(follow) int follow(void)
{
    capsule_solution solution;
    const int done = solve(&orbit, given, 0, -1, &solution);
    memcpy(numbers, equations.monodromy, MATRIX * sizeof *numbers);
    return done;
}

/* The orbit that `closed` left, or the one found last along its branch, with an unknown held and the
   parameter `free` in its place: 0 to 2 the state, 3 the angle, then the durations. So a branch is followed
   through its folds, where no parameter could be held, and a segment held at 0 is a bifurcation. What is
   found: the monodromy, the parameter, residual, steps; of a segment also the state at its start, P, and the
   fields about it. It takes the orbit's place if it is to be kept. 0 where it is lost. */
EXPORT(hold) int hold(int held, double at, int free, int keep)
{
    static page_orbit next;
    capsule_solution solution;
    double values[CAPSULE_PARAMETER_COUNT];
    next = orbit;
    memcpy(values, given, sizeof values);
    next.z[held] = at;
    if (!solve(&next, values, held, free, &solution))
        return 0;
    const int n = next.itinerary.count, i = held < DURATION ? 0 : held - DURATION, during = next.fields[i];
    capsule_start start;
    memcpy(&start, equations.flows[i].start, sizeof start);
    const double row[] = {values[free], solution.residual, solution.steps, start.x_r, start.v_r, start.v_c,
                          start.margin + field_of(during)->friction, next.fields[(i + n - 1) % n], during,
                          next.fields[(i + 1) % n]};
    memcpy(numbers, equations.monodromy, MATRIX * sizeof *numbers);
    memcpy(numbers + MATRIX, row, sizeof row);
    if (keep) {
        memcpy(given, values, sizeof values);
        orbit = next;
    }
    return 1;
}

/* State and angle in the middle of the orbit's first segment, where no guard is near. */
EXPORT(orbit_within) void orbit_within(void)
{
    static page_orbit half;
    capsule_parameters parameters;
    half = orbit;
    half.itinerary.fields = half.fields;
    half.z[DURATION] /= 2.0;
    memcpy(&parameters, given, sizeof parameters);
    equations = capsule_equations_in(block, half.itinerary.count);
    capsule_evaluate_itinerary(&parameters, &half.itinerary, half.z, &equations);
    memcpy(numbers, equations.flows[0].end, sizeof equations.flows[0].end);
    numbers[DURATION - 1] = half.z[DURATION - 1] + parameters.omega * half.z[DURATION];
}

/* State and angle at the start of the orbit, and its segments' durations; how many. */
EXPORT(unknowns) int unknowns(void)
{
    memcpy(numbers, orbit.z, (size_t)CAPSULE_UNKNOWNS(orbit.itinerary.count) * sizeof *numbers);
    return CAPSULE_UNKNOWNS(orbit.itinerary.count);
}
