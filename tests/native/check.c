/* Runs over a wide set of parameters and starts, for compilers' checks and sanitizers: every run
   ends or says what is open, keeps its state finite, and gives the same with and without a pause,
   alone and side by side with others, stopped on the way or not. What is no state is refused. */
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

/* Stops from the second time on that it is asked. */
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
            if (stops[k] == CAPSULE_STOPPED && states[k].turn >= PERIODS)
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
        state.turn = i == 2 ? -1000000 : 0;
        state.v_r = i == 3 ? NAN : 0;
        if (capsule_run(&map, &state, 10, i == 4 ? &rows : &request, &count, &open) !=
            CAPSULE_REFUSED)
            return failed("not refused", i == 6 ? &bad : &good);
    }
    return 0;
}

enum { ROOM = 7 }; /* of segments */

/* Whether segments, evaluated where they begin and last first, begin in their own states. */
static int evaluated(const capsule_map *map, const capsule_segment *segments, size_t count)
{
    double times[ROOM], states[ROOM][4];
    for (size_t k = 0; k < count; k++) {
        const capsule_segment *s = &segments[count - 1 - k];
        times[k] = ((double)s->start_turn * 6.283185307179586 + s->start_angle) /
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
        if (stop == CAPSULE_DONE && orbit.closing == CAPSULE_CLOSED) {
            closed++;
            double sum = orbit.work + orbit.peak_force + orbit.peak_contact;
            for (int k = 0; k < GRADIENTS; k++)
                sum += orbit.gradients[k];
            if (!isfinite(sum) || orbit.segments > MOST || orbit.damper_loss < 0.0)
                return failed("an orbit is not finite", &p);
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

int main(void)
{
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
        if (stop != end || once.turn != paused.turn ||
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
    if (refused() || orbits())
        return 1;
    printf("%d lanes: %d runs, %ld segments, %ld left open\n", CHECK_LANES ? CHECK_LANES : capsule_lanes(),
           RUNS, segments, open_runs);
    return open_runs > RUNS / 100;
}
