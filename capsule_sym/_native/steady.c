/* Periodic motion at the end of a run, if there is one. */
#include <math.h>

#include "capsule.h"

/* Largest change of the last `period_number` states from those `after` periods before. */
static double change(double (*states)[3], int count, int after, int period_number)
{
    double most = 0.0;
    for (int k = count - period_number; k < count; k++)
        for (int i = 0; i < 3; i++)
            most = fmax(most, fabs(states[k][i] - states[k - after][i]));
    return most;
}

/* True if the states repeat. Slow alternating convergence to a shorter period looks almost periodic too:
   states within the period must differ by a thousand tolerances. */
static int repeats(double (*states)[3], int count, int period_number, double tolerance)
{
    if (!(change(states, count, period_number, period_number) <= tolerance))
        return 0;
    for (int divisor = 1; divisor < period_number; divisor++)
        if (period_number % divisor == 0 &&
            change(states, count, divisor, period_number) <= 1e3 * tolerance)
            return 0;
    return 1;
}

/* Motion of the run in the next `period_number` periods, and a check that it repeats after them. */
static capsule_stop motion_of(const capsule_map *map, capsule_state state, int period_number,
                              capsule_event *events, size_t room, capsule_watch *watch,
                              capsule_motion *motion, capsule_outcome *open)
{
    size_t first, second;
    capsule_request request = {.events = events, .room = room, .position = 1, .watch = watch};
    state.period = 0;
    state.position = 0.0;
    capsule_stop stop = capsule_run(map, &state, period_number, &request, &first, open);
    if (stop != CAPSULE_DONE)
        return stop;
    const double advance = state.position;
    request.events += first;
    request.room -= first;
    stop = capsule_run(map, &state, 2 * period_number, &request, &second, open);
    if (stop != CAPSULE_DONE && !(stop == CAPSULE_FULL && second > first))
        return stop;
    int same = first == second;
    for (size_t i = 0; same && i < first; i++)
        same = events[i].field == events[first + i].field &&
               events[i].plane == events[first + i].plane;
    if (same) {
        motion->period_number = period_number;
        motion->switches = (int32_t)first;
        motion->advance = advance;
    }
    return CAPSULE_DONE;
}

capsule_stop capsule_steady(const capsule_map *map, const capsule_state *state,
                            double (*states)[3], int count, double tolerance,
                            capsule_event *events, size_t room, capsule_watch *watch,
                            capsule_motion *motion, capsule_outcome *open)
{
    if (!state || !motion || count < 0 || (count > 1 && (!states || !events)))
        return CAPSULE_REFUSED;
    capsule_segment next;
    size_t written;
    capsule_state probe = *state;
    *motion = (capsule_motion){0};
    probe.period = 0;
    const capsule_request first = {.segments = &next, .room = 1, .watch = watch};
    capsule_stop stop = capsule_run(map, &probe, 1, &first, &written, open);
    if (!written)
        return stop;
    motion->field = next.field;
    motion->never = next.outcome == CAPSULE_NEVER;
    for (int period_number = 1; period_number <= count / 2 && !motion->period_number; period_number++) {
        if (capsule_asked(watch, 1 + period_number / 64))
            return CAPSULE_STOPPED;
        if (!repeats(states, count, period_number, tolerance))
            continue;
        stop = motion_of(map, *state, period_number, events, room, watch, motion, open);
        if (stop != CAPSULE_DONE)
            return stop;
    }
    return CAPSULE_DONE;
}
