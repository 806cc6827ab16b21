/* What the processor has instructions for, and the code that uses them. */
#include <math.h>

#include "internal.h"

#ifndef CAPSULE_LANES
#define CAPSULE_LANES 8 /* at most; fewer for tests of the narrower ways */
#endif

/* How many lanes this processor has instructions for. */
int lanes_here(void)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (CAPSULE_LANES >= 8 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        return 8;
    if (CAPSULE_LANES >= 4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return 4;
#endif
    return 1;
}

capsule_stop capsule_run(const capsule_map *map, capsule_state *state, int64_t periods,
                         const capsule_wish *wish, size_t *written, capsule_outcome *open)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (lanes_here() > 1)
        return go_fused(map, state, periods, wish, written, open);
#endif
    return go(map, state, periods, wish, written, open);
}

capsule_state capsule_state_at(const capsule_map *map, double x_r, double v_r, double v_c,
                               double phase)
{
    const capsule_parameters *p = &map->parameters;
    const double angle = phase * p->omega, rest = fma(phase, p->omega, -angle);
    capsule_state state = {x_r, x_r - p->delta, v_r, v_c, angle, rest, 0.0, 0, 0, 0};
    departure d;
    if (v_c == 0.0)
        state.plane = depart(map, &state, cos(angle), sin(angle), &d);
    return state;
}
