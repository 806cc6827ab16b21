/* Runs over a wide set of parameters and starts, for compilers' checks and sanitizers: every run
   ends or says what is open, keeps its state finite, and gives the same with and without a pause. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "capsule.h"

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

int main(void)
{
    enum { RUNS = 3000, PERIODS = 10, ROOM = 7 };
    static capsule_map map;
    static double strobe[PERIODS + 1][3];
    long segments = 0, open_runs = 0;
    for (int i = 0; i < RUNS; i++) {
        const capsule_parameters p = {uniform(0, 3),
                                      exp(uniform(-2, 2)),
                                      i % 5 ? uniform(0, 1) : 0,
                                      i % 3 ? uniform(0, 2) : 0,
                                      exp(uniform(-3, 6)),
                                      exp(uniform(-2, 2)),
                                      uniform(0.1, 2)};
        const double v_c = i % 2 ? uniform(-1, 1) : 0.0;
        capsule_map_remake(&p, &map);
        capsule_state once = capsule_state_at(&map, i % 7 ? uniform(-1, 1) : p.delta,
                                              uniform(-1, 1), v_c, uniform(0, 6.28));
        capsule_state paused = once;
        capsule_segment buffer[ROOM];
        capsule_outcome open;
        size_t count;
        const capsule_wish plain = {.strobe = strobe, .position = 1};
        const capsule_wish pausing = {.segments = buffer, .room = ROOM};
        const capsule_stop end = capsule_run(&map, &once, PERIODS, &plain, &count, &open);
        capsule_stop stop;
        do {
            stop = capsule_run(&map, &paused, PERIODS, &pausing, &count, &open);
            segments += (long)count;
        } while (stop == CAPSULE_FULL);
        open_runs += stop == CAPSULE_OPEN;
        if (stop != end || once.turn != paused.turn || (p.beta < 20 && p.zeta > 0.05 && fabs(once.x_r - paused.x_r) > 1e-6))
            return failed("a pause changes the run", &p);
        if (!isfinite(once.x_r + once.v_r + once.v_c + once.position))
            return failed("not finite", &p);
        if (end == CAPSULE_DONE && memcmp(strobe[PERIODS], &once.x_r, sizeof(double)) != 0)
            return failed("the last stroboscopic state is not the final one", &p);
    }
    printf("%d runs, %ld segments, %ld left open\n", RUNS, segments, open_runs);
    return open_runs > RUNS / 100;
}
