/* The way in: what is given is checked, and goes to the code for this processor. */
#include <math.h>

#include "internal.h"

#ifndef CAPSULE_LANES
#define CAPSULE_LANES 8 /* at most; fewer for tests of the narrower ways */
#endif

int capsule_lanes(void)
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

int allowed(const capsule_map *map, const capsule_state *s)
{
    const capsule_parameters *p = &map->parameters;
    return isfinite(p->alpha) && p->alpha >= 0.0 && isfinite(p->omega) && p->omega > 0.0 &&
           isfinite(p->delta) && p->delta >= 0.0 && isfinite(p->zeta) && p->zeta >= 0.0 &&
           isfinite(p->beta) && p->beta >= 0.0 && isfinite(p->gamma) && p->gamma > 0.0 &&
           isfinite(p->f_b) && p->f_b > 0.0 && isfinite(s->x_r) && isfinite(s->gap) && isfinite(s->v_r) &&
           isfinite(s->v_c) && isfinite(s->position) && s->angle >= 0.0 &&
           s->angle <= TWO_PI + 8.0 * UNIT * TWO_PI && fabs(s->angle_rest) <= 1.0 &&
           s->turn >= 0 && s->bound >= -1 && s->bound <= 1 && s->plane >= 0 && s->plane <= 10;
}

capsule_stop capsule_run(const capsule_map *map, capsule_state *state, int64_t periods,
                         const capsule_wish *wish, size_t *written, capsule_outcome *open)
{
    *written = 0;
    *open = CAPSULE_END;
    if (!allowed(map, state) || (wish->strobe && wish->rows && wish->rows < LEAST_ROWS))
        return CAPSULE_REFUSED;
#if defined(__x86_64__) && defined(__GNUC__)
    if (capsule_lanes() > 1)
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
    double cosine, sine;
    if (v_c != 0.0)
        return state;
    /* As a run from here will have it. */
    cosine_sine(angle, rest, &cosine, &sine);
#if defined(__x86_64__) && defined(__GNUC__)
    if (capsule_lanes() > 1) {
        state.plane = depart_fused(map, &state, cosine, sine, &d);
        return state;
    }
#endif
    state.plane = depart(map, &state, cosine, sine, &d);
    return state;
}
