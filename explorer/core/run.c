/* One run: its start, its periods, its recorded segments, and points of their closed forms. */
#include <math.h>
#include <string.h>

#include "page.h"

__attribute__((import_module("page"), import_name("late"))) int page_late(void);

static int late(void *about)
{
    (void)about;
    return page_late();
}

page_run run;
capsule_map map;
capsule_segment segments[ROOM];
size_t count;
capsule_outcome left_open;
capsule_watch watch = {.ask = late};
double numbers[NUMBERS];
capsule_parameters given;

EXPORT(numbers_at) double *numbers_at(void) { return numbers; }
EXPORT(given_at) capsule_parameters *given_at(void) { return &given; }
EXPORT(state_at) capsule_state *state_at(void) { return &run.state; }
EXPORT(motion_at) capsule_motion *motion_at(void) { return &run.motion; }
EXPORT(segments_at) capsule_segment *segments_at(void) { return segments; }
EXPORT(recorded) int recorded(void) { return (int)count; }
EXPORT(passed) double passed(void) { return run.passed; }
EXPORT(why_open) int why_open(void) { return left_open; }
EXPORT(digest) const char *digest(void) { return capsule_digest(); }

EXPORT(prepare) void prepare(void) { capsule_map_remake(&given, &map); }

EXPORT(start) void start(double x_r, double v_r, double v_c, double phase)
{
    run = (page_run){.state = capsule_state_at(&map, x_r, v_r, v_c, phase)};
    count = 0;
}

/* Continues for so many periods, which are counted; what is recorded begins at period 0. */
static capsule_stop go_on(double periods, const capsule_request *request)
{
    const capsule_stop stop = capsule_run(&map, &run.state, (int64_t)periods, request, &count, &left_open);
    run.passed += (double)run.state.period;
    run.state.period = 0;
    return stop;
}

/* Continues for so many periods; the last STROBES states at their ends are kept. */
EXPORT(settle) capsule_stop settle(double periods)
{
    const double last = fmin(periods, STROBES), first = floor(periods - last);
    capsule_request request = {.position = 1, .watch = &watch};
    const capsule_stop stop = first > 0.0 ? go_on(first, &request) : CAPSULE_DONE;
    if (stop != CAPSULE_DONE)
        return stop;
    request.strobe = run.strobe;
    run.strobes = (int)last;
    return go_on(last, &request);
}

/* Keeps the segments of so many periods more. */
EXPORT(record) capsule_stop record(int periods)
{
    return go_on(periods, &(capsule_request){.segments = segments, .room = ROOM, .position = 1,
                                             .watch = &watch});
}

/* The last of the kept states at the ends of periods, at most so many; how many there are. */
EXPORT(strobes) int strobes(int most)
{
    const int rows = most < run.strobes ? most : run.strobes;
    memcpy(numbers, run.strobe[run.strobes + 1 - rows], (size_t)rows * sizeof run.strobe[0]);
    return rows;
}

/* The states (x_r, v_r, v_c, x_c) of a recorded segment at times that the page wrote into `numbers`,
   behind these, and then P at each. */
EXPORT(evaluate) void evaluate(int segment, int times)
{
    double(*at)[CAPSULE_STATE_COUNT + 1] = (double(*)[CAPSULE_STATE_COUNT + 1])(numbers + times);
    const capsule_constants *c = &map.field[segments[segment].field - 1];
    capsule_evaluate(&map, &segments[segment], 1, 0, numbers, (size_t)times, at, NULL);
    for (int k = 0; k < times; k++)
        at[times][k] = capsule_force_at(c, at[k][0], at[k][0] - c->CAPSULE_OWN_STOP, at[k][1]);
}

/* Energies of some recorded segments: the drive's work, the damper's and the friction's loss. */
EXPORT(energies) void energies(int first, int after)
{
    memset(numbers, 0, 3 * sizeof *numbers);
    capsule_add_energies(&map, segments + first, (size_t)(after - first), NULL, numbers);
}
