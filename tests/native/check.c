/* Runs over a wide set of parameters and starts, for compilers' checks and sanitizers: every run
   ends or returns the undecided outcome, keeps its state finite, and gives the same with and without a pause,
   alone and side by side with others, stopped on the way or not. Invalid states are refused. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "capsule.h"

#ifndef CHECK_LANES
#define CHECK_LANES 0
#endif

static uint64_t seed = 1;

static double uniform(double low, double high)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(seed >> 11) * 0x1p-53;
}

static int failed(const char *what, const capsule_parameters *p)
{
    fprintf(stderr, "%s at %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", what, p->alpha, p->omega,
            p->delta, p->zeta, p->beta, p->gamma, p->f_b);
    return 1;
}

static capsule_parameters any_parameters(int i)
{
    capsule_parameters p;
    p.alpha = uniform(0, 3);
    p.omega = exp(uniform(-2, 2));
    p.delta = i % 5 ? uniform(0, 1) : 0;
    p.zeta = i % 3 ? uniform(0, 2) : 0;
    p.beta = exp(uniform(-3, 6));
    p.gamma = exp(uniform(-2, 2));
    p.f_b = uniform(0.1, 2);
    return p;
}

/* Runs that share their flows, side by side and one by one. */
static int side_by_side(int i)
{
    enum { RUNS = 40, PERIODS = 2 };
    static capsule_workspace workspace;
    static capsule_map map;
    static double strobe[RUNS * (PERIODS + 1)][3];
    capsule_parameters rows[RUNS];
    capsule_state starts[RUNS], states[RUNS];
    int8_t stops[RUNS];
    for (int k = 0; k < RUNS; k++) {
        rows[k] = k ? rows[0] : any_parameters(i);
        rows[k].alpha = uniform(0, 3);
        rows[k].delta = k % 5 ? uniform(0, 1) : 0;
        rows[k].f_b = uniform(0.1, 2);
        const double x_r = k % 7 ? uniform(-1, 1) : rows[k].delta, v_r = uniform(-1, 1);
        const double v_c = k % 2 ? uniform(-1, 1) : 0.0;
        capsule_map_remake(&rows[k], &map);
        states[k] = starts[k] = capsule_state_at(&map, x_r, v_r, v_c, 0.157 * k / rows[k].omega);
    }
    const capsule_batch many = {.stride = 1, .parameters = rows, .states = states, .stops = stops,
                               .strobe = strobe, .position = 1, .lanes = CHECK_LANES};
    capsule_run_many(&many, RUNS, PERIODS, &workspace);
    for (int k = 0; k < RUNS; k++) {
        const capsule_request request = {.position = 1};
        capsule_outcome open;
        size_t count;
        capsule_map_remake(&rows[k], &map);
        if (stops[k] != (int8_t)capsule_run(&map, &starts[k], PERIODS, &request, &count, &open))
            return failed("side by side a run stops otherwise", &rows[k]);
        if (!isfinite(states[k].x_r + states[k].v_r + states[k].v_c + states[k].position))
            return failed("not finite side by side", &rows[k]);
        if (rows[k].beta < 20 && rows[k].zeta > 0.05 &&
            fabs(states[k].x_r - starts[k].x_r) + fabs(states[k].v_c - starts[k].v_c) > 1e-8)
            return failed("side by side a run goes elsewhere", &rows[k]);
        if (stops[k] == CAPSULE_DONE &&
            memcmp(&strobe[k * (PERIODS + 1) + PERIODS][0], &states[k].x_r, sizeof(double)) != 0)
            return failed("the last stroboscopic state is not the final one", &rows[k]);
    }
    return 0;
}

/* Stops from its second call on. */
static int second_time(void *about)
{
    return ++*(int *)about > 1;
}

/* Runs side by side that are stopped again and again, and those that are not. */
static int stopped_and_resumed(int i)
{
    enum { RUNS = 40, PERIODS = 300 };
    static capsule_workspace workspace;
    static capsule_map map;
    capsule_parameters rows[RUNS];
    capsule_state states[RUNS], whole[RUNS];
    int8_t stops[RUNS], once[RUNS];
    int asked, rounds = 0, going = 1;
    for (int k = 0; k < RUNS; k++) {
        rows[k] = (capsule_parameters){0.5, 0.8, 0.02, 0.05 + 0.01 * i, 1.5, 3.3, 1};
        rows[k].alpha = 0.5 + 0.01 * k; /* steady motions of one period */
        capsule_map_remake(&rows[k], &map);
        states[k] = whole[k] = capsule_state_at(&map, 0.0, 0.0, 0.0, 0.0);
    }
    capsule_batch many = {
        .stride = 1, .parameters = rows, .states = whole, .stops = once, .position = 1};
    capsule_run_many(&many, RUNS, PERIODS, &workspace);
    capsule_watch watch = {.ask = second_time, .about = &asked};
    many.states = states;
    many.stops = stops;
    many.watch = &watch;
    for (; going; rounds++) {
        asked = going = 0;
        capsule_run_many(&many, RUNS, PERIODS, &workspace);
        for (int k = 0; k < RUNS; k++) {
            going |= stops[k] == CAPSULE_STOPPED;
            if (stops[k] == CAPSULE_STOPPED && states[k].period >= PERIODS)
                return failed("stopped at its end", &rows[k]);
        }
    }
    for (int k = 0; k < RUNS; k++)
        if (stops[k] != once[k] || fabs(states[k].x_r - whole[k].x_r) > 1e-9 ||
            fabs(states[k].position - whole[k].position) > 1e-7)
            return failed("to be stopped changes a run", &rows[k]);
    return rounds < 3 ? failed("never stopped", &rows[0]) : 0;
}

/* States and parameters that are none, each of which once read or wrote beside something. */
static int refused(void)
{
    static capsule_map map;
    static double strobe[11][3];
    const capsule_request request = {.strobe = strobe}, rows = {.strobe = strobe, .rows = 11};
    const capsule_parameters good = {0.7, 0.8, 0.02, 0.05, 1.5, 3.3, 1};
    capsule_parameters bad = good;
    capsule_outcome open;
    size_t count;
    bad.omega = -1;
    for (int i = 0; i < 8; i++) {
        capsule_map_make(i == 6 ? &bad : &good, &map);
        capsule_state state = capsule_state_at(&map, 0, 0, i == 7, i == 5 || i == 6 ? -1e308 : 0);
        state.plane = i == 0 ? 1000000 : state.plane;
        state.bound = i == 1 ? -2 : i == 7; /* |P| = f_b is a fact of the capsule at rest */
        state.period = i == 2 ? -1000000 : 0;
        state.v_r = i == 3 ? NAN : 0;
        if (capsule_run(&map, &state, 10, i == 4 ? &rows : &request, &count, &open) !=
            CAPSULE_REFUSED)
            return failed("not refused", i == 6 ? &bad : &good);
    }
    return 0;
}

enum { ROOM = 7 }; /* of segments */

/* Null pointers, zeroed records and counts that are none: all but one of the arguments are good. */
static int nulls(void)
{
    static capsule_map map, zero_map;
    static capsule_workspace workspace;
    static capsule_segment segments[ROOM];
    const capsule_parameters good = {0.7, 0.8, 0.02, 0.05, 1.5, 3.3, 1}, zero = {0};
    const capsule_request request = {.segments = segments, .room = ROOM};
    const capsule_orbit_request orbit_request = {segments, ROOM, .gradients = 1}, zero_wish = {0};
    const double start[3] = {0, 0, 0}, times[2] = {0, 1};
    double states[4][4] = {{0}}, strobe[4][3] = {{0}}, switches[2][11], rows[2][4][12];
    capsule_state state, first, late;
    capsule_outcome open;
    capsule_event events[4];
    capsule_motion motion;
    capsule_orbit orbit;
    const capsule_request no_rows = {.rows = INT64_MIN};
    capsule_slopes slopes;
    capsule_extremum found[4] = {{9, 9, 9}, {9, 9, 9}, {9, 9, 9}, {9, 9, 9}};
    const capsule_start begin = {.v_r = 1, .cos_theta = 1};
    int8_t stop = 9;
    size_t written;
    capsule_batch batch = {
        .stride = 1, .parameters = &good, .states = &state, .stops = &stop};
    if (capsule_map_make(&good, &map) != CAPSULE_DONE)
        return failed("refused", &good);
    first = late = state = capsule_state_at(&map, 0, 0, 0, 0);
    late.period = INT64_MAX;
    if (capsule_run(&map, &state, 1, &request, &written, &open) != CAPSULE_FULL || written < 2)
        return failed("no two segments", &good);
    state = first;
    const capsule_constants *c = &map.field[0];
#define REFUSED(call)                                                                              \
    if ((call) != CAPSULE_REFUSED)                                                                 \
        return failed(#call, &good);
    REFUSED(capsule_map_make(NULL, &map))
    REFUSED(capsule_map_make(&good, NULL))
    REFUSED(capsule_map_make(&zero, &zero_map))
    REFUSED(capsule_map_remake(NULL, &map))
    REFUSED(capsule_map_remake(&good, NULL))
    REFUSED(capsule_map_remake(&zero, &zero_map))
    REFUSED(capsule_map_constants(NULL, &map))
    REFUSED(capsule_map_constants(&good, NULL))
    REFUSED(capsule_run(NULL, &state, 1, &request, &written, &open))
    REFUSED(capsule_run(&zero_map, &state, 1, &request, &written, &open))
    REFUSED(capsule_run(&map, NULL, 1, &request, &written, &open))
    REFUSED(capsule_run(&map, &late, INT64_MAX, &request, &written, &open))
    REFUSED(capsule_run(&map, &state, INT64_MAX, &request, &written, &open))
    REFUSED(capsule_run(&map, &state, -1, &request, &written, &open))
    REFUSED(capsule_run(&map, &state, 1, NULL, &written, &open))
    REFUSED(capsule_run(&map, &state, 1, &no_rows, &written, &open))
    REFUSED(capsule_run(&map, &state, 1, &request, NULL, &open))
    REFUSED(capsule_run(&map, &state, 1, &request, &written, NULL))
    late = capsule_state_at(NULL, 0, 0, 0, 0);
    REFUSED(capsule_run(&map, &late, 1, &request, &written, &open))
    REFUSED(capsule_run_many(NULL, 1, 1, &workspace))
    REFUSED(capsule_run_many(&batch, 1, 1, NULL))
    REFUSED(capsule_run_many(&batch, 1, -1, &workspace))
    for (int i = 0; i < 4; i++) {
        capsule_batch bad = batch;
        bad.stride = i != 0;
        bad.parameters = i == 1 ? NULL : &good;
        bad.states = i == 2 ? NULL : &state;
        bad.stops = i == 3 ? NULL : &stop;
        REFUSED(capsule_run_many(&bad, 1, 1, &workspace))
    }
    batch.parameters = &zero;
    if (capsule_run_many(&batch, 1, 1, &workspace) != CAPSULE_DONE || stop != CAPSULE_REFUSED)
        return failed("parameters that are zero", &good);
#define STEADY(map, state, states, count, events, motion, open)                                    \
    REFUSED(capsule_steady(map, state, states, count, 1e-9, events, 4, NULL, motion, open))
    STEADY(NULL, &state, strobe, 4, events, &motion, &open)
    STEADY(&map, NULL, strobe, 4, events, &motion, &open)
    STEADY(&map, &state, NULL, 4, events, &motion, &open)
    STEADY(&map, &state, strobe, -1, events, &motion, &open)
    STEADY(&map, &state, strobe, 4, NULL, &motion, &open)
    STEADY(&map, &state, strobe, 4, events, NULL, &open)
    STEADY(&map, &state, strobe, 4, events, &motion, NULL)
    REFUSED(capsule_solve_orbit(NULL, start, 1, &orbit_request, &orbit))
    REFUSED(capsule_solve_orbit(&zero_map, start, 1, &orbit_request, &orbit))
    REFUSED(capsule_solve_orbit(&map, NULL, 1, &orbit_request, &orbit))
    REFUSED(capsule_solve_orbit(&map, start, 1, NULL, &orbit))
    REFUSED(capsule_solve_orbit(&map, start, 1, &zero_wish, &orbit))
    REFUSED(capsule_solve_orbit(&map, start, 1, &orbit_request, NULL))
    REFUSED(capsule_add_energies(NULL, segments, 1, NULL, strobe[0]))
    REFUSED(capsule_add_energies(&map, NULL, 1, NULL, strobe[0]))
    REFUSED(capsule_add_energies(&map, segments, 1, NULL, NULL))
    REFUSED(capsule_slopes_start(NULL))
    capsule_slopes_start(&slopes);
#define NONE(call)                                                                                 \
    if ((call) != 0)                                                                               \
        return failed(#call, &good);
    NONE(capsule_evaluate(NULL, segments, 2, 0, times, 2, states, NULL))
    NONE(capsule_evaluate(&map, NULL, 2, 0, times, 2, states, NULL))
    NONE(capsule_evaluate(&map, segments, 2, 0, NULL, 2, states, NULL))
    NONE(capsule_evaluate(&map, segments, 2, 0, times, 2, NULL, NULL))
    NONE(capsule_differentiate(NULL, segments, 2, &slopes, switches, times, 2, rows, NULL))
    NONE(capsule_differentiate(&map, NULL, 2, &slopes, switches, times, 2, rows, NULL))
    NONE(capsule_differentiate(&map, segments, 2, NULL, switches, times, 2, rows, NULL))
    NONE(capsule_differentiate(&map, segments, 2, &slopes, switches, NULL, 2, rows, NULL))
    NONE(capsule_differentiate(&map, segments, 2, &slopes, switches, times, 2, NULL, NULL))
    segments[1].field = 1000000; /* which the switch before leads to */
    NONE(capsule_differentiate(&map, segments, 2, &slopes, switches, times, 2, rows, NULL))
#define EXTREMA(c, start, quantity, zeros, found, room)                                            \
    if (capsule_find_extrema(c, start, quantity, zeros, 9.0, found, room) != -1)                   \
        return failed("extrema", &good);
    EXTREMA(NULL, &begin, CAPSULE_GAP, 0, found, 4)
    EXTREMA(c, NULL, CAPSULE_GAP, 0, found, 4)
    EXTREMA(c, &begin, (capsule_quantity)7, 0, found, 4)
    EXTREMA(c, &begin, CAPSULE_GAP, 50, found, 4)
    EXTREMA(c, &begin, CAPSULE_GAP, -1, found, 4)
    EXTREMA(c, &begin, CAPSULE_GAP, 0, NULL, 4)
    EXTREMA(c, &begin, CAPSULE_GAP, 0, found, -1)
    if (found[0].kind != 9 || !isnan(capsule_force_at(NULL, 0, 0, 0)))
        return failed("written", &good);
    return 0;
}

/* A limit of work: the same place each time, whatever the machine, and on from there. */
static int limited(void)
{
    static capsule_map map;
    static capsule_workspace workspace;
    const capsule_parameters p = {0, 1.661e-3, .012066, 0, 1.924, 1.568e-8, .03944}; /* 79 million segments */
    capsule_outcome open;
    size_t count;
    capsule_map_make(&p, &map);
    capsule_state state = capsule_state_at(&map, -1e10, -1.8355, -1, 2837.2064), once = state;
    int8_t stop = CAPSULE_DONE;
    capsule_watch watch = {.most = 3 * CAPSULE_WORK}, again = watch, beside = watch;
    const capsule_request request = {.watch = &watch}, other = {.watch = &again};
    const capsule_batch batch = {
        .stride = 1, .parameters = &p, .states = &once, .stops = &stop, .watch = &beside};
    if (capsule_run_many(&batch, 1, 4, &workspace) != CAPSULE_DONE || stop != CAPSULE_STOPPED)
        return failed("no limit of work side by side", &p);
    for (int i = 0; i < 3; i++, beside.most += CAPSULE_WORK) { /* each call resumes */
        const capsule_state before = once;
        if (i && (capsule_run_many(&batch, 1, 4, &workspace) != CAPSULE_DONE ||
                  memcmp(&before.x_r, &once.x_r, sizeof(double)) == 0))
            return failed("no way on side by side", &p);
    }
    once = state;
    if (capsule_run(&map, &state, 4, &request, &count, &open) != CAPSULE_STOPPED ||
        capsule_run(&map, &once, 4, &other, &count, &open) != CAPSULE_STOPPED ||
        watch.done < watch.most || watch.done > watch.most + 4 * CAPSULE_WORK ||
        memcmp(&state.x_r, &once.x_r, sizeof(double)) != 0)
        return failed("no limit of work", &p);
    watch.most *= 2; /* it is held to all that was done */
    if (capsule_run(&map, &state, 4, &request, &count, &open) != CAPSULE_STOPPED ||
        memcmp(&state.x_r, &once.x_r, sizeof(double)) == 0)
        return failed("not on after the limit", &p);
    return 0;
}

/* True if segments, evaluated where they begin and last first, begin in their own states. */
static int evaluated(const capsule_map *map, const capsule_segment *segments, size_t count)
{
    double times[ROOM], states[ROOM][4];
    for (size_t k = 0; k < count; k++) {
        const capsule_segment *s = &segments[count - 1 - k];
        times[k] = ((double)s->start_period * 6.283185307179586 + s->start_angle) /
                   map->parameters.omega;
    }
    if (capsule_evaluate(map, segments, count, 0, times, count, states, NULL) != count)
        return 0;
    for (size_t k = 0; k < count; k++) {
        const capsule_segment *s = &segments[count - 1 - k];
        if (!(fabs(states[k][0] - s->start[0]) <= 1e-9 * (1 + fabs(s->start[1]))) ||
            !(fabs(states[k][3] - s->position) <= 1e-9 * (1 + fabs(s->position))))
            return 0;
    }
    return 1;
}

/* Orbits at the ends of runs: what is closed comes back, and is finite; little room is said. */
static int orbits(void)
{
    enum { TRIED = 60, MOST = 64, GRADIENTS = 49 };
    static capsule_map map;
    static capsule_segment segments[MOST];
    const capsule_request plain = {.position = 1};
    int closed = 0;
    for (int i = 0; i < TRIED; i++) {
        capsule_parameters p = any_parameters(i);
        p.zeta += 0.02, p.beta = fmin(p.beta, 20.0);
        capsule_map_remake(&p, &map);
        capsule_state state = capsule_state_at(&map, 0, 0, 0, 0);
        capsule_outcome open;
        size_t count;
        if (capsule_run(&map, &state, 100, &plain, &count, &open) != CAPSULE_DONE)
            continue;
        const double end[3] = {state.x_r, state.v_r, state.v_c};
        int asked = 0;
        capsule_watch watch = {.ask = second_time, .about = &asked};
        capsule_orbit_request request = {
            segments, MOST, .energies = 1, .forces = 1, .gradients = 1, .watch = &watch};
        capsule_orbit orbit;
        const capsule_stop stop = capsule_solve_orbit(&map, end, 1 + i % 2, &request, &orbit);
        if (stop == CAPSULE_DONE && orbit.status == CAPSULE_CLOSED) {
            closed++;
            double sum = orbit.work + orbit.peak_force + orbit.peak_contact;
            for (int k = 0; k < GRADIENTS; k++)
                sum += orbit.gradients[k];
            if (!isfinite(sum) || orbit.segments > MOST || orbit.damper_loss < 0.0)
                return failed("an orbit is not finite", &p);
            double energies[3] = {0.0};
            capsule_add_energies(&map, segments, (size_t)orbit.segments, NULL, energies);
            const double size = 1e-10 * (1.0 + fabs(energies[0]));
            if (!(fabs(energies[0] - energies[1] - energies[2]) < size) ||
                !(fabs(energies[1] - orbit.damper_loss * (1 + i % 2)) < size))
                return failed("the work is not what is lost", &p);
            state = capsule_state_at(&map, orbit.state[0], orbit.state[1], orbit.state[2], 0);
            capsule_run(&map, &state, 1 + i % 2, &plain, &count, &open);
            if (!(fabs(state.x_r - orbit.state[0]) + fabs(state.v_c - orbit.state[2]) < 1e-9) ||
                !(fabs(state.position / (1 + i % 2) - orbit.progression) < 1e-9))
                return failed("an orbit does not come back", &p);
        }
        request.room = 1;
        if (capsule_solve_orbit(&map, end, 1, &request, &orbit) == CAPSULE_DONE &&
            orbit.segments > 1)
            return failed("more segments than there is room for", &p);
        if (capsule_solve_orbit(&map, end, 0, &request, &orbit) != CAPSULE_REFUSED)
            return failed("an orbit of no period", &p);
    }
    return closed < TRIED / 4 ? failed("hardly an orbit", &map.parameters) : 0;
}

/* Itineraries from anywhere, some with a segment that is held at no duration: what is solved closes. */
static int itineraries(void)
{
    enum { TRIED = 200, MOST = 6 };
    static const int32_t FIELDS[][MOST] = {{5, 2}, {5, 4, 5, 2}, {5, 4, 1, 2}, {4, 1, 3, 6}, {5},
                                           {5, 4, 1, 2, 3, 6}, {1, 2}, {5, 1}, {7}};
    static const int COUNT[] = {2, 4, 4, 4, 1, 6, 2, 2, 1};
    static double block[CAPSULE_SYSTEM_ROOM(MOST)], workspace[CAPSULE_ITINERARY_ROOM(MOST)];
    double direction[CAPSULE_PARAMETER_COUNT] = {1.0};
    int solved = 0;
    for (int i = 0; i < TRIED; i++) {
        const int which = i % 9, n = COUNT[which], mirrored = which == 6;
        const capsule_itinerary itinerary = {FIELDS[which], n, 1, mirrored};
        capsule_parameters p = any_parameters(i), given = p;
        static double less[CAPSULE_EQUATIONS_ROOM(MOST)];
        capsule_system system = capsule_system_in(block, n), alone = capsule_equations_in(less, n);
        capsule_solution solution;
        capsule_itinerary_request request = {.workspace = workspace};
        double z[CAPSULE_UNKNOWNS(MOST)] = {0.1, 0.2, 0.0, 1.0};
        for (int k = 0; k < n; k++)
            z[4 + k] = (0.5 + k) * 12.0 / (n * n * p.omega) / (1 + mirrored);
        if (i % 2)
            request.direction = direction, request.held = 3 + n, z[3 + n] = 0.0;
        const capsule_stop stop =
            capsule_solve_itinerary(&itinerary, &request, &p, z, &system, &solution);
        if ((stop == CAPSULE_REFUSED) != (which > 6))
            return failed("itineraries refused", &given);
        if (stop != CAPSULE_DONE)
            continue;
        if (i % 2 ? z[3 + n] != 0.0 : p.alpha != given.alpha)
            return failed("what is held has moved", &given);
        if (solution.status != CAPSULE_SOLVED)
            continue;
        if (capsule_evaluate_itinerary(&p, &itinerary, z, &alone) != CAPSULE_DONE ||
            memcmp(alone.residual, system.residual, (size_t)(n + 4) * sizeof *z) ||
            memcmp(alone.monodromy, system.monodromy, 9 * sizeof *z) || alone.advance != system.advance)
            return failed("equations without derivatives are others", &given);
        solved++;
        for (int k = 0; k < n + 4; k++)
            if (!(fabs(system.residual[k]) <= solution.residual && solution.residual < 1e-9))
                return failed("an itinerary does not close", &given);
    }
    const capsule_itinerary good = {FIELDS[0], 2, 1, 0}, bad[] = {{NULL, 2, 1, 0}, {FIELDS[0], 0, 1, 0}};
    const capsule_itinerary_request room = {.workspace = workspace}, none = {0};
    for (int i = 0; i < 9; i++) {
        capsule_parameters p = any_parameters(0);
        capsule_system system = capsule_system_in(block, 2);
        capsule_solution solution;
        double z[6] = {0}, *const arrays[] = {system.residual, system.monodromy, system.workspace};
        system.flows = i == 5 ? NULL : system.flows;
        system.residual = i == 6 ? NULL : arrays[0];
        system.monodromy = i == 7 ? NULL : arrays[1];
        system.workspace = i == 8 ? NULL : arrays[2];
        if (i > 4 && capsule_evaluate_itinerary(&p, &good, z, &system) != CAPSULE_REFUSED)
            return failed("a system without an array", &p);
        if (capsule_solve_itinerary(i == 0 ? NULL : i < 3 ? &bad[i - 1] : &good,
                                    i == 3 ? NULL : i == 4 ? &none : &room, &p, z, &system,
                                    &solution) != CAPSULE_REFUSED)
            return failed("an itinerary from null", &p);
    }
    return solved < TRIED / 8 ? failed("hardly an itinerary", &(capsule_parameters){0}) : 0;
}

/* True if the equations of an itinerary at unknowns are not numbers. */
static int without_value(const capsule_parameters *p, const double z[8])
{
    enum { COUNT = 4 };
    static const int32_t FIELDS[COUNT] = {5, 4, 5, 2};
    static double block[CAPSULE_SYSTEM_ROOM(COUNT)], workspace[CAPSULE_ITINERARY_ROOM(COUNT)];
    const capsule_itinerary itinerary = {FIELDS, COUNT, 1, 0};
    const capsule_itinerary_request request = {.workspace = workspace};
    capsule_system system = capsule_system_in(block, COUNT);
    capsule_parameters at = *p;
    capsule_solution solution = {0};
    double found[8], largest = 0.0;
    memcpy(found, z, sizeof found);
    if (capsule_evaluate_itinerary(p, &itinerary, z, &system) != CAPSULE_DONE)
        return 0;
    for (int k = 0; k < 8; k++)
        largest = isfinite(system.residual[k]) ? fmax(largest, fabs(system.residual[k])) : INFINITY;
    const capsule_stop stop = capsule_solve_itinerary(&itinerary, &request, &at, found, &system, &solution);
    return !isfinite(largest) &&
           (stop == CAPSULE_REFUSED || (stop == CAPSULE_DONE && solution.status == CAPSULE_NOT_FINITE));
}

/* Numbers that are no parameters, states, times or durations: no call comes to harm by them. */
static int hostile(void)
{
    enum { TRIED = 5, NUMBERS = 4 + CAPSULE_PARAMETER_COUNT + 7 };
    static const double BAD[TRIED] = {NAN, INFINITY, -INFINITY, 1e308, -1e308};
    static capsule_map map, none;
    static capsule_segment segments[ROOM], one;
    static capsule_workspace workspace;
    const capsule_parameters good = {0.7, 0.8, 0.02, 0.05, 1.5, 3.3, 1};
    const double z[8] = {0.02, -0.3, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    capsule_outcome open;
    size_t count;
    capsule_map_make(&good, &map);
    capsule_state state = capsule_state_at(&map, 0.02, 0.3, 0.0, 0.1);
    capsule_run(&map, &state, 1, &(capsule_request){.segments = segments, .room = ROOM}, &count, &open);
    for (int i = 0; i < TRIED; i++)
        for (int k = 0; k < NUMBERS; k++) {
            capsule_parameters p = good;
            capsule_constants c = map.field[4];
            capsule_start begin = {.x_r = 0.3, .gap = 0.28, .v_r = 0.1, .cos_theta = 1};
            capsule_watch watch = {.most = CAPSULE_WORK};
            capsule_extremum found[4];
            capsule_slopes slopes;
            capsule_orbit orbit;
            double far[8], values[CAPSULE_PARAMETER_COUNT], times[2] = {0.5, BAD[i]}, states[2][4];
            double rows[2][4][CAPSULE_COLUMN_COUNT], energies[3] = {0};
            memcpy(far, z, sizeof far);
            far[k % 8] = BAD[i];
            if (k < 8 && fabs(BAD[i]) != 1e308 && !without_value(&good, far))
                return failed("a residual of no unknowns", &good);
            without_value(&good, far);
            far[k % 8] = -20.0;
            if (k % 8 > 3 && !without_value(&good, far))
                return failed("a residual far below duration 0", &good);
            memcpy(values, &p, sizeof values);
            values[k % CAPSULE_PARAMETER_COUNT] = BAD[i];
            memcpy(&p, values, sizeof p);
            if (!isfinite(BAD[i]) && !without_value(&p, z))
                return failed("a residual of no parameters", &p);
            without_value(&p, z);
            if (capsule_map_make(&p, &none) != CAPSULE_REFUSED && !isfinite(BAD[i]))
                return failed("a map of no parameters", &p);
            capsule_constants_of(1 + k % CAPSULE_FIELD_COUNT, &p, &c);
            capsule_find_extrema(&c, &begin, CAPSULE_FORCE, 0, 3.0, found, 4);
            ((double *)&begin)[k % 7] = BAD[i];
            capsule_find_extrema(&map.field[k % 6], &begin, CAPSULE_SPEED, 0, 3.0, found, 4);
            one = segments[0];
            ((double *)one.start)[k % CAPSULE_STATE_COUNT] = BAD[i];
            capsule_evaluate(&map, &one, 1, 0, times, 2, states, &watch);
            capsule_slopes_start(&slopes);
            capsule_differentiate(&map, &one, 1, &slopes, NULL, times, 2, rows, &watch);
            capsule_add_energies(&map, &one, 1, &watch, energies);
            one = segments[0], one.duration = BAD[i];
            capsule_differentiate(&map, &one, 1, &slopes, NULL, times, 2, rows, &watch);
            capsule_add_energies(&map, &one, 1, &watch, energies);
            const capsule_orbit_request request = {segments + 1, ROOM - 1, 1, 1, 1, &watch};
            double start[3] = {0.02, 0.3, 0.0};
            start[k % 3] = BAD[i];
            capsule_solve_orbit(&map, start, 1, &request, &orbit);
            state = capsule_state_at(&map, start[0], start[1], start[2], k % 2 ? 0.1 : BAD[i]);
            int8_t stop;
            const capsule_batch batch = {.stride = 1, .parameters = &p, .states = &state,
                                         .stops = &stop, .watch = &watch};
            capsule_run_many(&batch, 1, 1, &workspace);
        }
    return 0;
}

int main(int argc, char **argv)
{
    (void)argv;
    if (refused() || nulls() || hostile() || limited())
        return 1;
    if (argc > 1) /* what is refused, and no more */
        return 0;
    enum { RUNS = 3000, PERIODS = 10 };
    static capsule_map map;
    static double strobe[PERIODS + 1][3];
    long segments = 0, open_runs = 0;
    for (int i = 0; i < RUNS; i++) {
        const capsule_parameters p = any_parameters(i);
        const double v_c = i % 2 ? uniform(-1, 1) : 0.0;
        capsule_map_remake(&p, &map);
        const double x_r = i % 7 ? uniform(-1, 1) : p.delta, v_r = uniform(-1, 1);
        capsule_state once = capsule_state_at(&map, x_r, v_r, v_c, uniform(0, 6.28) / p.omega);
        capsule_state paused = once;
        capsule_segment buffer[ROOM];
        capsule_outcome open;
        size_t count;
        const capsule_request plain = {.strobe = strobe, .position = 1};
        const capsule_request pausing = {.segments = buffer, .room = ROOM};
        const capsule_stop end = capsule_run(&map, &once, PERIODS, &plain, &count, &open);
        capsule_stop stop;
        do {
            stop = capsule_run(&map, &paused, PERIODS, &pausing, &count, &open);
            segments += (long)count;
            if (!evaluated(&map, buffer, count))
                return failed("evaluation leads elsewhere", &p);
        } while (stop == CAPSULE_FULL);
        open_runs += stop == CAPSULE_OPEN;
        if (stop != end || once.period != paused.period ||
            (p.beta < 20 && p.zeta > 0.05 && fabs(once.x_r - paused.x_r) > 1e-6))
            return failed("a pause changes the run", &p);
        if (!isfinite(once.x_r + once.v_r + once.v_c + once.position))
            return failed("not finite", &p);
        if (end == CAPSULE_DONE && memcmp(strobe[PERIODS], &once.x_r, sizeof(double)) != 0)
            return failed("the last stroboscopic state is not the final one", &p);
    }
    for (int i = 0; i < 150; i++)
        if (side_by_side(i))
            return 1;
    for (int i = 0; i < 20; i++) {
        const capsule_parameters p = any_parameters(i);
        capsule_map_remake(&p, &map);
        capsule_state one = capsule_state_at(&map, uniform(-1, 1), uniform(-1, 1), 0.1 * (i % 2), 0);
        capsule_state other = one, paused = one;
        capsule_outcome open;
        capsule_event event;
        size_t count;
        const capsule_request plain = {.position = 1};
        const capsule_request wide = {.position = 1, .precision = CAPSULE_DOUBLE_DOUBLE};
        const capsule_request pausing = {
            .precision = CAPSULE_DOUBLE_DOUBLE, .events = &event, .room = 1};
        const capsule_stop stop = capsule_run(&map, &one, 1, &plain, &count, &open);
        capsule_stop last = capsule_run(&map, &other, 1, &wide, &count, &open);
        if (stop != last || fabs(one.x_r - other.x_r) + fabs(one.v_c - other.v_c) > 1e-9)
            return failed("106 bits lead elsewhere", &p);
        do /* each switch is rounded to a state in double precision */
            last = capsule_run(&map, &paused, 1, &pausing, &count, &open);
        while (last == CAPSULE_FULL);
        if (stop != last || fabs(one.x_r - paused.x_r) + fabs(one.v_c - paused.v_c) > 1e-9)
            return failed("pauses of a run in 106 bits lead elsewhere", &p);
    }
    for (int i = 0; i < 4; i++)
        if (stopped_and_resumed(i))
            return 1;
    if (orbits() || itineraries())
        return 1;
    printf("%d lanes: %d runs, %ld segments, %ld left open\n", CHECK_LANES ? CHECK_LANES : capsule_lanes(),
           RUNS, segments, open_runs);
    return open_runs > RUNS / 100;
}
