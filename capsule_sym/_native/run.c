/* Runs of the map: segments chained until the periods are over. Arguments are checked, and passed to the
   code for this processor; switches that double precision cannot decide are decided in 106 bits. */
#include <string.h>

#include "internal.h"
#include "number.h"

#ifndef CAPSULE_LANES
#define CAPSULE_LANES 8 /* at most; fewer for tests of the narrower ways */
#endif

int capsule_lanes(void)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (CAPSULE_LANES >= 8 && __builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        return 8;
    if (CAPSULE_LANES >= 4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return 4;
    return 1;
#elif defined(__aarch64__) && defined(__GNUC__)
    return CAPSULE_LANES >= 4 ? 4 : 1;
#else
    return 1;
#endif
}

int capsule_allowed(const capsule_map *map, const capsule_state *s)
{
    return map && s && capsule_parameters_allowed(&map->parameters) && isfinite(s->x_r) &&
#if TWO_STOPS
           isfinite(s->back) &&
#endif
           isfinite(s->gap) && isfinite(s->v_r) && isfinite(s->v_c) && isfinite(s->position) &&
           s->angle >= 0.0 && s->angle <= TWO_PI + 8.0 * UNIT * TWO_PI &&
           fabs(s->angle_rest) <= 1.0 && s->period >= 0 && s->period <= CAPSULE_PERIODS &&
           s->bound >= -1 && s->bound <= 1 && (s->bound == 0 || s->v_c == 0.0) &&
           s->plane >= 0 && s->plane <= CAPSULE_PLANE_COUNT && s->field >= 0 &&
           s->field <= CAPSULE_FIELD_COUNT;
}

void capsule_write_strobe(const capsule_request *request, int64_t period, double x_r, double v_r, double v_c)
{
    if (request->strobe) {
        double *state = request->strobe[request->rows ? period % request->rows : period];
        state[0] = x_r;
        state[1] = v_r;
        state[2] = v_c;
    }
}

#if !CAPSULE_PULSED
/* State at the end of a period of a segment that rests until then. The forced response is taken at both
   angles and the free part about it advanced alone, so no large time is an argument of a sine. Near resonance
   both are large and cancel: where that loses more digits than such a sine, the closed form advances the whole,
   which is continuous through resonance. */
static void resting_state(const capsule_constants *k, const capsule_start *from, double h, capsule_state *out)
{
    capsule_constants still = *k;
    capsule_start start = *from;
    double change[3], x, v, centre = 0.0;
    out->x_r = out->v_r = 0.0;
    if (k->omega * h * sqrt(k->Z2) >= k->K + k->omega * k->omega) {
        forced(k, from->cos_theta, from->sin_theta, &x, &v);
        forced(k, 1.0, 0.0, &out->x_r, &out->v_r);
        centre = rest_centre(k);
        start.x_r = from->x_r - centre - x, start.v_r = from->v_r - v;
        still.alpha = still.push = 0.0;
    }
    capsule_flow(&still, &start, h, change);
    out->x_r += start.x_r + change[0];
    out->x_r -= 0.0 - centre;
    out->v_r += change[1];
    out->gap = out->x_r - k->CAPSULE_FRONT_GAP;
#if TWO_STOPS
    out->back = out->x_r + k->CAPSULE_BACK_GAP;
#endif
    out->v_c = out->angle = out->angle_rest = 0.0;
}

void capsule_rest(capsule_context *context, double x_r, double v_r, double angle, double angle_rest,
                  int forever, capsule_state *state, capsule_result *p)
{
    const capsule_request *request = context->request;
    const int field = FIELD_OF[0][0][1];
    const capsule_constants *k = &context->map->field[field - 1];
    capsule_start start = {.x_r = x_r, .v_r = v_r};
    sine_cosine(angle, angle_rest, &start.sin_theta, &start.cos_theta);
    const int64_t from = state->period;
    int64_t period = request->strobe ? from + 1 : context->periods;
    if (request->rows && period < context->periods + 1 - request->rows)
        period = context->periods + 1 - request->rows;
    for (; period <= context->periods; period++) {
        const double turns = (double)(period - from), rest = turns * TWO_PI_REST - angle_rest;
        const double h = ((turns * TWO_PI - angle) + rest) / k->omega;
        resting_state(k, &start, h, state);
        capsule_write_strobe(request, period, state->x_r, state->v_r, 0.0);
        if (period < context->periods && capsule_asked(request->watch, 1)) {
            p->stopped = 1;
            return;
        }
        if (period == context->periods)
            p->duration += h;
    }
    state->period = context->periods;
    state->bound = state->plane = 0;
    state->field = field;
    p->outcome = forever ? CAPSULE_NEVER : CAPSULE_END;
    context->exact.known = 0;
}
#endif

const capsule_code *capsule_code_here(int wide)
{
#if defined(__x86_64__) && defined(__GNUC__)
    if (capsule_lanes() > 1)
        return wide ? &capsule_code_wide_fused : &capsule_code_fused;
#endif
    return wide ? &capsule_code_wide : &capsule_code_plain;
}

capsule_stop capsule_run(const capsule_map *map, capsule_state *state, int64_t periods,
                         const capsule_request *request, size_t *written, capsule_outcome *open)
{
    if (!written || !open)
        return CAPSULE_REFUSED;
    *written = 0;
    *open = CAPSULE_END;
    if (!request || !capsule_allowed(map, state) || periods < 0 || periods > CAPSULE_PERIODS ||
        (request->rows && request->rows < LEAST_ROWS))
        return CAPSULE_REFUSED;
    capsule_context context;
    memset(&context, 0, sizeof context);
    context.angle = -1.0;
    context.map = map;
    context.request = request;
    context.periods = periods;
    context.position = request->position || request->segments;
    const capsule_code *const code = capsule_code_here(0), *const wide_code = capsule_code_here(1);
    capsule_wide_table tables[CAPSULE_FLOW_COUNT];
    context.wide = tables;
    const int64_t pause = request->strobe && request->rows ? state->period + request->rows / 2 : periods;
    while (state->period < periods) {
        if (((request->segments || request->events) && *written == request->room) || state->period >= pause)
            return CAPSULE_FULL;
        capsule_result p;
        const capsule_state before = *state;
        int wide = request->precision == CAPSULE_DOUBLE_DOUBLE;
        if (!wide)
            code->run_segment(&context, state, &p);
        const int undecided = wide || (p.outcome != CAPSULE_REGULAR && p.outcome != CAPSULE_END &&
                                       p.outcome != CAPSULE_NEVER);
        if (undecided && !(!wide && (p.stopped || p.gave_up)) &&
            request->precision != CAPSULE_DOUBLE) {
            wide = 1;
            *state = before;
            wide_code->run_segment(&context, state, &p);
        }
        if (p.stopped)
            return CAPSULE_STOPPED;
        if (p.outcome != CAPSULE_REGULAR && p.outcome != CAPSULE_END &&
            p.outcome != CAPSULE_NEVER) {
            *open = p.outcome;
            *state = before;
            return CAPSULE_OPEN;
        }
        if (request->segments) {
            request->segments[(*written)++] = (capsule_segment){
                .start_period = before.period, .end_period = state->period,
                .start_angle = before.angle, .end_angle = state->angle,
                .start = {before.x_r, before.v_r, before.v_c},
                .end = {state->x_r, state->v_r, state->v_c},
                .duration = p.duration, .position = before.position, .advance = p.advance,
                .gap = p.gap, .margin = p.margin, .cosine = p.cosine, .sine = p.sine,
                .field = p.field, .source = before.plane, .target = p.switched ? state->plane : 0,
                .outcome = p.outcome, .evaluations = p.evaluations, .wide = wide};
        } else if (request->events && p.switched) {
            request->events[(*written)++] =
                (capsule_event){state->period, state->angle, p.field, state->plane};
        }
        if (capsule_asked(request->watch, 1 + p.evaluations) && state->period < periods)
            return CAPSULE_STOPPED;
    }
    return CAPSULE_DONE;
}

capsule_state capsule_state_at(const capsule_map *map, double x_r, double v_r, double v_c,
                               double phase)
{
    capsule_state state = {.x_r = x_r, .gap = NAN, .v_r = v_r, .v_c = v_c};
    if (!map)
        return state;
    const capsule_parameters *p = &map->parameters;
    state.gap = x_r - p->CAPSULE_FRONT_GAP;
#if TWO_STOPS
    state.back = x_r + p->CAPSULE_BACK_GAP;
#endif
    state.angle = phase * p->omega;
    state.angle_rest = fma(phase, p->omega, -state.angle);
    if (v_c != 0.0)
        return state;
    state.plane = state.field = capsule_code_here(0)->field_at(map, &state);
    return state;
}

size_t capsule_evaluate(const capsule_map *map, const capsule_segment *segments, size_t count,
                        int more, const double *times, size_t n, double (*states)[4],
                        capsule_watch *watch)
{
    if (!map || !segments || !times || !states)
        return 0;
    return capsule_code_here(0)->states_at(map, segments, count, more, 1, times, n, states, watch);
}
