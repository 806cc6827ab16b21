/* Runs over a wide set of parameters and starts, for compilers' checks and sanitizers: every run
   ends or says what is open, keeps its state finite, and gives the same with and without a pause,
   alone and side by side with others. */
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
    static capsule_crew crew;
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
    const capsule_many many = {.stride = 1, .parameters = rows, .states = states, .stops = stops,
                               .strobe = strobe, .position = 1, .lanes = CHECK_LANES};
    capsule_run_many(&many, RUNS, PERIODS, &crew);
    for (int k = 0; k < RUNS; k++) {
        const capsule_wish wish = {.position = 1};
        capsule_outcome open;
        size_t count;
        capsule_map_remake(&rows[k], &map);
        if (stops[k] != (int8_t)capsule_run(&map, &starts[k], PERIODS, &wish, &count, &open))
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

int main(void)
{
    enum { RUNS = 3000, PERIODS = 10, ROOM = 7 };
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
        const capsule_wish plain = {.strobe = strobe, .position = 1, .lanes = CHECK_LANES};
        const capsule_wish pausing = {.segments = buffer, .room = ROOM};
        const capsule_stop end = capsule_run(&map, &once, PERIODS, &plain, &count, &open);
        capsule_stop stop;
        do {
            stop = capsule_run(&map, &paused, PERIODS, &pausing, &count, &open);
            segments += (long)count;
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
        capsule_state other = one;
        capsule_outcome open;
        size_t count;
        const capsule_wish plain = {.position = 1};
        const capsule_wish wide = {.position = 1, .precision = CAPSULE_DOUBLE_DOUBLE};
        const capsule_stop stop = capsule_run(&map, &one, 1, &plain, &count, &open);
        if (stop != capsule_run(&map, &other, 1, &wide, &count, &open) ||
            fabs(one.x_r - other.x_r) + fabs(one.v_c - other.v_c) > 1e-9)
            return failed("106 bits lead elsewhere", &p);
    }
    printf("%d runs, %ld segments, %ld left open\n", RUNS, segments, open_runs);
    return open_runs > RUNS / 100;
}
