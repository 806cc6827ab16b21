/* One run: to its motion, its segments, and points of their closed forms. */
#include <math.h>
#include <string.h>

#include "page.h"

__attribute__((import_module("page"), import_name("late"))) int page_late(void);

static int late(void *about)
{
    (void)about;
    return page_late();
}

page_run page;
capsule_watch page_watch = {.ask = late};
double numbers[NUMBERS];
double given[CAPSULE_PARAMETER_COUNT];

EXPORT(numbers_at) double *numbers_at(void) { return numbers; }
EXPORT(given_at) double *given_at(void) { return given; }
EXPORT(digest) const char *digest(void) { return capsule_digest(); }

EXPORT(prepare) void prepare(void)
{
    capsule_parameters p;
    memcpy(&p, given, sizeof p);
    capsule_map_remake(&p, &page.map);
}

EXPORT(start) void start(double x_r, double v_r, double v_c, double phase)
{
    page.state = capsule_state_at(&page.map, x_r, v_r, v_c, phase);
    page.passed = 0.0;
    page.strobes = 0;
    page.count = 0;
}

/* Goes on for so many periods, which are counted; what is recorded begins at period 0. */
static capsule_stop go_on(double periods, const capsule_request *request)
{
    const capsule_stop stop = capsule_run(&page.map, &page.state, (int64_t)periods, request, &page.count,
                                          &page.open);
    page.passed += (double)page.state.period;
    page.state.period = 0;
    return stop;
}

/* Goes on for so many periods; the last STROBES states at their ends are kept. */
capsule_stop page_settle(double periods)
{
    const double last = fmin(periods, STROBES), first = floor(periods - last);
    capsule_request request = {.position = 1, .watch = &page_watch};
    const capsule_stop stop = first > 0.0 ? go_on(first, &request) : CAPSULE_DONE;
    if (stop != CAPSULE_DONE)
        return stop;
    request.strobe = page.strobe;
    page.strobes = (int)last;
    return go_on(last, &request);
}
EXPORT(settle) int settle(double periods) { return page_settle(periods); }

EXPORT(steady) int steady(double tolerance)
{
    const capsule_stop stop = page_motion(tolerance);
    numbers[0] = page.motion.period_number;
    numbers[1] = page.motion.advance;
    numbers[2] = page.motion.switches;
    numbers[3] = page.motion.field;
    numbers[4] = page.motion.never;
    numbers[5] = page.by_newton;
    return stop;
}

/* Keeps the segments of so many periods more. */
capsule_stop page_record(int periods)
{
    return go_on(periods, &(capsule_request){.segments = page.segments, .room = ROOM, .position = 1,
                                             .watch = &page_watch});
}
EXPORT(record) int record(int periods) { return page_record(periods); }
EXPORT(why_open) int why_open(void) { return page.open; }

EXPORT(where) void where(void)
{
    const double row[] = {page.state.x_r, page.state.v_r, page.state.v_c, page.state.angle,
                          page.state.position, page.passed,
                          page.state.field, page.state.plane};
    memcpy(numbers, row, sizeof row);
}

/* Rows of the recorded segments; how many. */
#define SEGMENT_NUMBERS 21
EXPORT(segments) int segments(void)
{
    for (size_t i = 0; i < page.count; i++) {
        const capsule_segment *s = &page.segments[i];
        const double row[SEGMENT_NUMBERS] = {
            s->field, s->source, s->target, s->outcome, s->wide, s->evaluations,
            (double)s->start_period, (double)s->end_period, s->start_angle, s->end_angle,
            s->start[0], s->start[1], s->start[2], s->end[0], s->end[1], s->end[2],
            s->duration, s->position, s->advance, s->margin, s->gap};
        memcpy(numbers + i * SEGMENT_NUMBERS, row, sizeof row);
    }
    return (int)page.count;
}

/* Points of the recorded segments no further apart than `step`, both ends among them: rows of
   segment, time, x_r, v_r, v_c, x_c, and P. The number of rows. */
#define POINT_NUMBERS 7
EXPORT(points) int points(double step)
{
    enum { MOST = 4096 };
    static double times[MOST + 2], states[MOST + 2][CAPSULE_STATE_COUNT + 1];
    const double full = 6.283185307179586, omega = page.map.parameters.omega;
    int rows = 0;
    for (size_t i = 0; i < page.count; i++) {
        const capsule_segment *s = &page.segments[i];
        const capsule_constants *c = &page.map.field[s->field - 1];
        const double begin = ((double)s->start_period * full + s->start_angle) / omega;
        const int pieces = 1 + (int)fmin(ceil(s->duration / step), MOST);
        for (int k = 0; k <= pieces; k++)
            times[k] = begin + s->duration * k / pieces;
        capsule_evaluate(&page.map, s, 1, 0, times, (size_t)pieces + 1, states, NULL);
        for (int k = 0; k <= pieces; k++) {
            if ((rows + 1) * POINT_NUMBERS > NUMBERS)
                return rows;
            const double *at = states[k];
            const double force = capsule_margin_at(c, at[0], at[0] - c->delta, at[1]) + c->friction;
            const double row[POINT_NUMBERS] = {(double)i, times[k], at[0], at[1], at[2], at[3], force};
            memcpy(numbers + rows++ * POINT_NUMBERS, row, sizeof row);
        }
    }
    return rows;
}
