/* One run: to its resting_state motion, its segments, and points of their closed forms. */
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
double given[7];

EXPORT(numbers_at) double *numbers_at(void) { return numbers; }
EXPORT(given_at) double *given_at(void) { return given; }
EXPORT(digest) const char *digest(void) { return capsule_digest(); }

EXPORT(prepare) void prepare(void)
{
    const capsule_parameters p = {given[0], given[1], given[2], given[3],
                                  given[4], given[5], given[6]};
    capsule_map_remake(&p, &page.map);
}

EXPORT(start) void start(double x_r, double v_r, double v_c, double phase)
{
    page.state = capsule_state_at(&page.map, x_r, v_r, v_c, phase);
    page.passed = 0.0;
    page.strobes = 0;
    page.count = 0;
}

/* Goes on for so many periods; the last STROBES states at their ends are kept. */
capsule_stop page_settle(double periods)
{
    const double last = fmin(periods, STROBES);
    const int64_t first = (int64_t)(periods - last);
    capsule_request request = {.position = 1, .watch = &page_watch};
    size_t written;
    page.passed += (double)page.state.period;
    page.state.period = 0;
    if (first > 0) {
        const capsule_stop stop =
            capsule_run(&page.map, &page.state, first, &request, &written, &page.open);
        if (stop != CAPSULE_DONE)
            return stop;
        page.passed += (double)first;
        page.state.period = 0;
    }
    request.strobe = page.strobe;
    page.strobes = (int)last;
    const capsule_stop stop =
        capsule_run(&page.map, &page.state, (int64_t)last, &request, &written, &page.open);
    if (stop == CAPSULE_DONE) {
        page.passed += last;
        page.state.period = 0;
    }
    return stop;
}
EXPORT(settle) int settle(double periods) { return page_settle(periods); }

/* The periodic motion that the run has come to; `page.motion` says which. */
capsule_stop page_steady(double tolerance)
{
    static capsule_event events[2 * ROOM];
    return capsule_steady(&page.map, &page.state, page.strobe + 1, page.strobes, tolerance, events,
                          2 * ROOM, &page_watch, &page.motion, &page.open);
}
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
    const capsule_request request = {.segments = page.segments, .room = ROOM, .position = 1,
                               .watch = &page_watch};
    page.passed += (double)page.state.period;
    page.state.period = 0;
    page.count = 0;
    return capsule_run(&page.map, &page.state, periods, &request, &page.count, &page.open);
}
EXPORT(record) int record(int periods) { return page_record(periods); }
EXPORT(count) int count(void) { return (int)page.count; }
EXPORT(why_open) int why_open(void) { return page.open; }

EXPORT(where) void where(void)
{
    const double row[] = {page.state.x_r, page.state.v_r, page.state.v_c, page.state.angle,
                          page.state.position, page.passed + (double)page.state.period,
                          page.state.field, page.state.plane};
    memcpy(numbers, row, sizeof row);
}

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
    return SEGMENT_NUMBERS;
}

/* Points of the recorded segments no further apart than `step`, both ends among them: rows of
   segment, time, x_r, v_r, v_c, x_c, and P. The number of rows. */
#define POINT_NUMBERS 7
EXPORT(points) int points(double step)
{
    const double full = 6.283185307179586, omega = page.map.parameters.omega;
    int rows = 0;
    for (size_t i = 0; i < page.count; i++) {
        const capsule_segment *s = &page.segments[i];
        const capsule_constants *c = &page.map.field[s->field - 1];
        const capsule_start from = {s->start[0], s->gap, s->start[1], s->start[2],
                                    s->margin, s->cosine, s->sine};
        const double begin = ((double)s->start_period * full + s->start_angle) / omega;
        const int pieces = 1 + (int)fmin(ceil(s->duration / step), 4096.0);
        for (int k = 0; k <= pieces; k++) {
            if ((rows + 1) * POINT_NUMBERS > NUMBERS)
                return rows;
            const double h = s->duration * k / pieces;
            double change[3] = {0.0, 0.0, 0.0}, advance = 0.0, state[3];
            capsule_flow(c, &from, h, change);
            if (c->drift != 0.0)
                advance = capsule_flow_advance(c, &from, change[0], h);
            state[0] = from.x_r + change[0];
            state[1] = change[1];
            state[2] = c->drift != 0.0 ? from.v_c + change[2] : 0.0;
            if (k == 0)
                memcpy(state, s->start, sizeof state);
            if (k == pieces)
                memcpy(state, s->end, sizeof state);
            const double gap = k == 0 ? s->gap : state[0] - c->delta;
            const double force = capsule_margin_at(c, state[0], gap, state[1]) + c->friction;
            const double row[POINT_NUMBERS] = {(double)i, begin + h, state[0], state[1],
                                               state[2], s->position + advance, force};
            memcpy(numbers + rows++ * POINT_NUMBERS, row, sizeof row);
        }
    }
    return rows;
}
