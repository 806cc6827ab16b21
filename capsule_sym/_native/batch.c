/* Many runs side by side: each run has a lane of the processor's vectors, and one step advances all
   lanes at once.

   Runs wait in queues, one for each of the linear flows and each length of expansion, so that
      the lanes of a step share their table. If a step proves nothing, or the successor is not certain (a
      corner, a tangency, a line), a shorter expansion is tried; if that fails too, the scalar code repeats
      the run's present segment from its start. It also repeats a segment of many expansions, whose
      rounding errors add up, and moves its switch to the closed form. */
#include <math.h>
#include <string.h>

#include "batch.h"
#include "number.h"

#ifndef CAPSULE_ANY_WIDTH
#define CAPSULE_ANY_WIDTH 0 /* tests of more lanes than the processor has instructions for */
#endif

/* Keys of a guess, for each field: a segment's first expansion, off the impact surface or on it, or its
   second, third or a later one. A negative guess means that no switch is expected. */
enum { KEYS = 5 };

enum { CLEAR_QUEUE = CAPSULE_FLOW_COUNT * CAPSULE_LEVELS }; /* the first of those where no switch is expected */

#ifndef MOST_IN_LANES
#define MOST_IN_LANES 16 /* expansions of a segment that are made side by side */
#endif

/* Work of a step of all lanes, and of the tables of new flows, in expansions. */
enum { STEP = 4, TABLES = 128 };

static void enqueue(capsule_workspace *workspace, int slot, int level)
{
    const int flow = FLOW_OF[workspace->run[slot].field - 1];
    const int queue = level < 0 ? CLEAR_QUEUE + flow : CAPSULE_LEVELS * flow + level;
    workspace->queue[queue][workspace->waiting[queue]++] = (int16_t)slot;
}

/* Queues a run for its next expansion, with the length that the last similar one took. `key` is the key of
   its guess. */
static void schedule(capsule_workspace *workspace, int slot, int field, int key)
{
    const double guess = workspace->run[slot].guess[field - 1][key];
    const int level = guess > 0.0   ? (guess < 0.5 / 1.1) + (guess < 0.25 / 1.1) + (guess < 0.125 / 1.1)
                      : guess < 0.0 ? -1
                                    : 0;
    workspace->run[slot].field = field;
    workspace->run[slot].key = key;
    workspace->run[slot].number[LASTED] = guess;
    enqueue(workspace, slot, level);
}

#if TWO_STOPS
/* Sets the gaps of a state from the gap to its field's stop and the other gap. */
static void set_gaps(capsule_state *state, int field, double own, double other)
{
    const int behind = CONTACT_OF[field - 1] == 2;
    state->gap = behind ? other : own;
    state->back = behind ? own : other;
}

static int touches(const capsule_state *s) { return s->gap == 0.0 || s->back == 0.0; }
#else
static int touches(const capsule_state *s) { return s->gap == 0.0; }
#endif

/* State at which a segment of a field began. */
static capsule_state state_of(const double *began, int field, int64_t period)
{
    const int way = (int)began[WAY], zeros = (int)began[SECOND_ZEROS];
    capsule_state state = {
        .x_r = began[X_R], .gap = began[FAR], .v_r = began[V_R], .v_c = began[V_C],
        .angle = began[ANGLE], .angle_rest = began[ANGLE_REST], .position = began[POSITION],
        .period = period, .bound = way == 0 ? zeros : zeros == 2 ? way : 0, .field = field};
#if TWO_STOPS
    set_gaps(&state, field, began[FAR], began[OTHER]);
#endif
    return state;
}

static capsule_state start_of(const capsule_workspace *workspace, int slot)
{
    return state_of(workspace->run[slot].begun, workspace->run[slot].field, workspace->run[slot].begun_period);
}

typedef struct {
    capsule_workspace *workspace;
    const capsule_batch *batch;
    int64_t periods;
    capsule_lane_step *step;
    int lanes;
    size_t next; /* row */
    int stopped; /* by the watch */
} batch_progress;

static void finish_run(batch_progress *w, int slot, capsule_stop stop, const capsule_state *state)
{
    capsule_workspace *workspace = w->workspace;
    w->batch->states[workspace->run[slot].row] = *state;
    w->batch->stops[workspace->run[slot].row] = (int8_t)stop;
    workspace->idle[workspace->idle_count++] = (int16_t)slot;
}

/* Request of the row's run alone. */
static capsule_request request_of(const batch_progress *w, size_t row)
{
    const capsule_batch *batch = w->batch;
    return (capsule_request){
        .strobe = batch->strobe ? batch->strobe + row * (size_t)(w->periods + 1) : NULL,
        .position = batch->position,
        .watch = batch->watch,
        .precision = batch->precision};
}

/* Request of a run alone up to its next switch. */
static capsule_request request_of_one(const batch_progress *w, size_t row, capsule_event *event)
{
    capsule_request request = request_of(w, row);
    request.events = event;
    request.room = 1;
    return request;
}

/* Runs the next row by the scalar code. */
static void run_scalar(batch_progress *w)
{
    capsule_event *first = w->batch->first ? &w->batch->first[w->next] : NULL;
    const capsule_request request = first ? request_of_one(w, w->next, first) : request_of(w, w->next);
    capsule_outcome open;
    size_t written;
    capsule_map_remake(&w->batch->parameters[w->next], &w->workspace->map);
    const capsule_stop stop = capsule_run(&w->workspace->map, &w->batch->states[w->next], w->periods,
                                          &request, &written, &open);
    w->batch->stops[w->next] = (int8_t)stop;
    w->stopped |= stop == CAPSULE_STOPPED || capsule_asked(w->batch->watch, TABLES / 4);
}

/* Advances a run from a state with the scalar code, segment by segment until lanes can continue it, or to its
   end if the capsule may rest for long. If its next segment is for lanes, it is only queued, unless the
   scalar code must `help` with it. */
static void start_run(batch_progress *w, int slot, capsule_state state, int help)
{
    capsule_workspace *workspace = w->workspace;
    const capsule_batch *batch = w->batch;
    const size_t row = workspace->run[slot].row;
    capsule_map_remake(&batch->parameters[row], &workspace->map);
    if (!capsule_allowed(&workspace->map, &state)) {
        finish_run(w, slot, CAPSULE_REFUSED, &state);
        return;
    }
    for (;; help = 1) {
        capsule_stop stop = CAPSULE_FULL;
        capsule_outcome open;
        size_t written;
        if (help || workspace->map.may_rest) {
            capsule_event event;
            const int whole = workspace->map.may_rest && !batch->first;
            const capsule_request request = whole ? request_of(w, row) : request_of_one(w, row, &event);
            stop = capsule_run(&workspace->map, &state, w->periods, &request, &written, &open);
            if (batch->first && written) {
                batch->first[row] = event;
                finish_run(w, slot, stop, &state);
                return;
            }
        } else if (state.period >= w->periods) {
            stop = CAPSULE_DONE;
        }
        const int field = state.field ? state.field : capsule_code_here(0)->field_at(&workspace->map, &state);
        if (stop == CAPSULE_FULL && !field) {
            if (!help)
                continue; /* by the scalar code, in as many digits as it takes */
            stop = CAPSULE_OPEN;
        }
        if (stop != CAPSULE_FULL) {
            w->stopped |= stop == CAPSULE_STOPPED;
            finish_run(w, slot, stop, &state);
            return;
        }
        const capsule_constants *c = &workspace->map.field[field - 1];
        const double way = DRIFT_OF[field - 1], at_bound = state.bound;
#if TWO_STOPS
        const int behind = CONTACT_OF[field - 1] == 2;
        const double own = behind ? state.back : state.gap;
#else
        const double own = state.gap;
#endif
        double cosine, sine;
        phase_terms(state.angle, state.angle_rest, &sine, &cosine);
        const double slips = state.v_c == 0.0 ? 1.0 + (at_bound == way) : 0.0;
#define OF_RUN(name) [RUN_##name] = c->name,
        const double numbers[CAPSULE_RUN_NUMBERS] = {
#if TWO_STOPS
            [OTHER] = behind ? state.gap : state.back,
#endif
            [X_R] = state.x_r, [FAR] = own, [V_R] = state.v_r, [V_C] = state.v_c,
            [MARGIN] = state.bound ? friction_at(c, at_bound) - c->friction
                                   : margin_at(c, state.x_r, own, state.v_r, cosine),
#if CAPSULE_PULSED
            [HIGH] = c->high,
#else
            [COSINE] = cosine, [SINE] = sine,
#endif
            [ANGLE] = state.angle, [ANGLE_REST] = state.angle_rest, [POSITION] = state.position, [WAY] = way,
            /* A touch, where v_r is 0 too, proves nothing: its first coefficient is 0. */
            [GAP_ZEROS] = touches(&state), [SECOND_ZEROS] = way != 0.0 ? slips : at_bound,
            CAPSULE_RUN_PARAMETERS(OF_RUN)};
#undef OF_RUN
        memcpy(workspace->run[slot].number, numbers, sizeof numbers);
        memcpy(workspace->run[slot].begun, numbers, sizeof numbers);
        workspace->run[slot].period = workspace->run[slot].begun_period = state.period;
        workspace->run[slot].expansions = 0;
        schedule(workspace, slot, field, touches(&state));
        return;
    }
}

/* The field beyond a lane's switch. */
static int field_beyond(const double *number, const capsule_outcomes *out, int l)
{
#if CAPSULE_PULSED
    const int level = number[HIGH] == 0.0;
#else
    const int level = 0;
#endif
    int contact = out->contact >> l & 1;
#if TWO_STOPS
    contact += out->behind >> l & 1;
#endif
    return FIELD_OF[level][contact][(int)number[WAY] + 1];
}

/* Writes the switch of a lane's run from one field to another, if requested. */
static int write_first(batch_progress *w, int slot, int left, int field, int edge)
{
    const capsule_workspace *workspace = w->workspace;
    const double *number = workspace->run[slot].number, v_r = number[V_R], v_c = number[V_C];
    if (!w->batch->first)
        return 0;
    w->batch->first[workspace->run[slot].row] = (capsule_event){
        .period = workspace->run[slot].period, .angle = number[ANGLE], .field = left,
        .plane = edge         ? EDGE_PLANE[LEVEL_OF[field - 1]]
                 : v_c == 0.0 ? field
                              : impact_plane(left, field, v_c, v_r)};
    return 1;
}

/* Applies the result of a step to one of its lanes. */
static void finish_step(batch_progress *w, int slot, int level, const capsule_outcomes *out, int l)
{
    capsule_workspace *workspace = w->workspace;
    double *number = workspace->run[slot].number;
    int field = workspace->run[slot].field, key = workspace->run[slot].key;
    double *guess = &workspace->run[slot].guess[field - 1][key];
    const int crosses = out->crossing >> l & 1, open = out->open >> l & 1;
    const int edge = out->edge >> l & 1;
    const int expansions = ++workspace->run[slot].expansions - open;
    /* A switch after many expansions, whose rounding errors add up, is moved to its place on the closed form
           from the segment's start. */
    if ((out->undetermined >> l & 1) || (crosses && expansions > MOST_SUMMED) ||
        (open && level + 1 == CAPSULE_LEVELS)) {
        start_run(w, slot, start_of(workspace, slot), 1);
        return;
    }
    if (open) {
        workspace->run[slot].expansions = expansions;
        enqueue(workspace, slot, level + 1);
        return;
    }
    if (out->passed >> l & 1) {
        const double *end = out->end[l];
        const int64_t period = ++workspace->run[slot].period;
        if (w->batch->strobe) {
            const size_t row = workspace->run[slot].row * (size_t)(w->periods + 1) + (size_t)period;
            double *mark = w->batch->strobe[row];
            mark[0] = end[0];
            mark[1] = end[2];
            mark[2] = end[3];
        }
        if (period == w->periods) {
            capsule_state last = {.x_r = end[0], .gap = end[1], .v_r = end[2],
                                  .v_c = end[3], .position = end[4], .period = period,
                                  .field = crosses ? 0 : field};
            if (edge) {
                last.plane = EDGE_PLANE[0], last.field = field_beyond(number, out, l);
                write_first(w, slot, field, last.field, edge);
            }
#if TWO_STOPS
            set_gaps(&last, field, end[1], end[5]);
#endif
            finish_run(w, slot, CAPSULE_DONE, &last);
            return;
        }
    }
    if (crosses) {
        const int left = field;
        *guess = number[LASTED];
        key = number[GAP_ZEROS] > 0.0;
        field = field_beyond(number, out, l);
        if (write_first(w, slot, left, field, edge)) {
            const capsule_state start = state_of(number, field, workspace->run[slot].period);
            finish_run(w, slot, CAPSULE_FULL, &start);
            return;
        }
        memcpy(workspace->run[slot].begun, number, sizeof workspace->run[slot].begun);
        workspace->run[slot].begun_period = workspace->run[slot].period;
        workspace->run[slot].expansions = 0;
    } else if (expansions == MOST_IN_LANES) {
        start_run(w, slot, start_of(workspace, slot), 1);
        return;
    } else {
        *guess = level ? 0.0 : -1.0;
        key = key < 2 ? 2 : key < KEYS - 1 ? key + 1 : key;
    }
    schedule(workspace, slot, field, key);
}

static void run_queues(batch_progress *w, size_t end)
{
    capsule_workspace *workspace = w->workspace;
    int fullest = 0;
    for (;;) {
        if (w->stopped) { /* active runs can resume from the starts of their present segments */
            for (int i = 0; i < CLEAR_QUEUE + CAPSULE_FLOW_COUNT; i++)
                while (workspace->waiting[i]) {
                    const int slot = workspace->queue[i][--workspace->waiting[i]];
                    const capsule_state start = start_of(workspace, slot);
                    finish_run(w, slot, CAPSULE_STOPPED, &start);
                }
            return;
        }
        while (workspace->idle_count && w->next < end && !w->stopped) {
            const int slot = workspace->idle[--workspace->idle_count];
            const size_t row = workspace->run[slot].row = w->next;
            w->next += w->batch->stride;
            memset(workspace->run[slot].guess, 0, sizeof workspace->run[slot].guess);
            start_run(w, slot, w->batch->states[row], 0);
        }
        int slot[8];
        for (int i = 0; i < CLEAR_QUEUE + CAPSULE_FLOW_COUNT && workspace->waiting[fullest] < w->lanes; i++)
            if (workspace->waiting[i] > workspace->waiting[fullest])
                fullest = i;
        const int16_t *queue = workspace->queue[fullest];
        const int waiting = workspace->waiting[fullest];
        const int count = waiting < w->lanes ? waiting : w->lanes;
        if (!waiting)
            return;
        int ends = w->batch->strobe != NULL;
        double *runs[8];
        for (int l = 0; l < w->lanes; l++) { /* lanes without a run repeat the first */
            slot[l] = queue[waiting - 1 - (l < count ? l : 0)];
            runs[l] = workspace->run[slot[l]].number;
            ends |= workspace->run[slot[l]].period + 1 == w->periods;
        }
        workspace->waiting[fullest] -= count;
        const int clear = fullest >= CLEAR_QUEUE;
        const int flow = clear ? fullest - CLEAR_QUEUE : fullest / CAPSULE_LEVELS;
        const int level = clear ? 0 : fullest % CAPSULE_LEVELS;
        capsule_outcomes out;
        w->step(&workspace->map.field[ONE_OF_FLOW[flow] - 1], &workspace->map.table[flow], level,
                w->batch->position, ends, runs, &out);
        for (int l = 0; l < count; l++)
            finish_step(w, slot[l], level, &out, l);
        w->stopped |= capsule_asked(w->batch->watch, STEP);
    }
}

int capsule_widest(void)
{
    return CAPSULE_ANY_WIDTH && capsule_lanes() > 1 ? 8 : capsule_lanes();
}

capsule_stop capsule_run_many(const capsule_batch *batch, size_t count, int64_t periods,
                              capsule_workspace *workspace)
{
    if (!batch || !workspace || !batch->stride || periods < 0 || periods > CAPSULE_PERIODS ||
        (count && (!batch->parameters || !batch->states || !batch->stops)))
        return CAPSULE_REFUSED;
    const int widest = capsule_widest(), asked = batch->lanes;
    batch_progress w = {workspace, batch, periods, NULL, capsule_lanes(), 0, 0};
    if (asked == 1 || asked == 4 || asked == 8)
        w.lanes = asked < widest ? asked : widest;
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__))
    w.step = w.lanes == 8 ? capsule_step_8 : capsule_step_4;
#endif
    w.stopped = capsule_over(batch->watch);
    while (w.next < count && !w.stopped) {
        const capsule_parameters *p = &batch->parameters[w.next];
        size_t end = w.next + batch->stride;
        while (end < count && capsule_same_flows(p, &batch->parameters[end]))
            end += batch->stride;
        capsule_map_remake(p, &workspace->map);
        workspace->idle_count = 0;
        for (int slot = 0; slot < CAPSULE_BATCH_SIZE; slot++)
            workspace->idle[workspace->idle_count++] = (int16_t)slot;
        memset(workspace->waiting, 0, sizeof workspace->waiting);
        if (end - w.next == batch->stride || w.lanes == 1) {
            for (; w.next < end && !w.stopped; w.next += batch->stride)
                run_scalar(&w);
            continue;
        }
        w.stopped = capsule_asked(batch->watch, TABLES);
        run_queues(&w, end);
    }
    for (; w.next < count; w.next += batch->stride) /* not begun */
        batch->stops[w.next] = CAPSULE_STOPPED;
    return CAPSULE_DONE;
}
