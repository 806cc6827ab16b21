// Claims of the device source about one expansion after another, and about first switches.
#include "shim.cpp"

// A run by the kernel; with an event by its segments, up to the first switch.
static capsule_stop device_run(const capsule_parameters *p, int64_t periods, capsule_state *state,
                               capsule_event *event)
{
    static capsule_table tables[CAPSULE_FLOW_COUNT];
    static capsule_context contexts[1];
    capsule_map map;
    map.table = tables;
    capsule_map_make(p, &map);
    if (!event) {
        const int32_t flow = 0;
        int8_t stop = CAPSULE_STOPPED;
        blockIdx.x = threadIdx.x = 0;
        capsule_runs(p, &flow, tables, state, contexts, &stop, NULL, periods, 0, 1, INT64_MAX, 1);
        return (capsule_stop)stop;
    }
    const capsule_request request = {};
    capsule_context context;
    memset(&context, 0, sizeof context);
    context.angle = -1.0, context.map = &map, context.request = &request, context.periods = periods;
    while (state->period < periods) {
        capsule_result found;
        run_segment(&context, state, &found);
        if (found.switched) {
            *event = {state->period, state->angle, found.field, state->plane};
            return CAPSULE_FULL;
        }
        if (found.outcome != CAPSULE_END && found.outcome != CAPSULE_NEVER)
            return CAPSULE_OPEN;
    }
    return CAPSULE_DONE;
}

#define PROBE probe_1
extern "C" {
#include "probe.h"

// Runs on from a start, or if `goes_on` from a state; returns the stop, and the state.
int run_to(const capsule_parameters *p, int field, const probe_start *start, int goes_on, int periods,
           capsule_state *state)
{
    if (!goes_on)
        *state = probed_state(p, field, start);
    return device_run(p, periods, state, NULL);
}

// Field and plane of the first switch; 1 if there is one, 0 if none comes, -1 if it is handed back.
int first(int width, const double *p, const double *start, double phase, int periods, int *field,
          int *plane)
{
    (void)width;
    const capsule_parameters *parameters = (const capsule_parameters *)p;
    const double from[1][4] = {{start[0], start[1], start[2], phase}};
    capsule_state state;
    capsule_event event = {};
    blockIdx.x = threadIdx.x = 0;
    capsule_starts(parameters, from, &state, 1);
    const capsule_stop stop = device_run(parameters, periods, &state, &event);
    *field = event.field, *plane = event.plane;
    return stop == CAPSULE_OPEN ? -1 : stop == CAPSULE_FULL;
}
}
