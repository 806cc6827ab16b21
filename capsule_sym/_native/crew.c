/* Many runs side by side: as many lanes of vectors as the processor has take one step of as many
   runs at a time.

   Runs wait in queues, one for each of the four linear flows and each length of expansion, so that
   the lanes of a step share their table. Where a step proves nothing, or what follows is not
   plain (a corner, a tangency, a line), a shorter expansion is tried, and at last the run's
   present segment is taken again from its start by the scalar code. So is a segment of many
   expansions, whose roundings add up: the scalar code moves its switch to the closed form. */
#include <math.h>
#include <string.h>

#include "crew.h"
#include "number.h"

#ifndef CAPSULE_ANY_WIDTH
#define CAPSULE_ANY_WIDTH 0 /* tests of more lanes than the processor has instructions for */
#endif
#define MOST_ADDED 4 /* expansions whose roundings may add up to a switch */

/* What a guess belongs to, of each field: a segment's first expansion, off the impact surface or
   on it, or its second, third or a later one. A negative guess is that no switch comes. */
enum { KEYS = 5 };

enum { CLEAR_QUEUE = 4 * CAPSULE_LEVELS }; /* the first of those where no switch is expected */

#ifndef MOST_BESIDE
#define MOST_BESIDE 16 /* expansions of a segment that are made side by side */
#endif

/* What a step of all lanes, and the tables of new flows, take for a watch, in expansions. */
enum { STEP = 4, TABLES = 128 };

/* By contact and drift. */
static const int8_t FLOW_OF[6] = {1, 0, 1, 3, 2, 3};

static void enqueue(capsule_crew *crew, int slot, int level)
{
    const int flow = FLOW_OF[crew->run[slot].field - 1];
    const int queue = level < 0 ? CLEAR_QUEUE + flow : CAPSULE_LEVELS * flow + level;
    crew->queue[queue][crew->waiting[queue]++] = (int16_t)slot;
}

/* Puts a run where its next expansion is made, of about the length that the last one like it
   took. `key` is that of its guess. */
static void send(capsule_crew *crew, int slot, int field, int key)
{
    const double guess = crew->run[slot].guess[field - 1][key];
    const int level = guess > 0.0   ? (guess < 0.5 / 1.1) + (guess < 0.25 / 1.1) + (guess < 0.125 / 1.1)
                      : guess < 0.0 ? -1
                                    : 0;
    crew->run[slot].field = field;
    crew->run[slot].key = key;
    crew->run[slot].number[LASTED] = guess;
    enqueue(crew, slot, level);
}

/* The state that a segment of a field began at. */
static capsule_state state_of(const double *began, int field, int64_t turn)
{
    const int way = (int)began[WAY], zeros = (int)began[SECOND_ZEROS];
    return (capsule_state){
        .x_r = began[X_R], .gap = began[FAR], .v_r = began[V_R], .v_c = began[V_C],
        .angle = began[ANGLE], .angle_rest = began[ANGLE_REST], .position = began[POSITION],
        .turn = turn, .bound = way == 0 ? zeros : zeros == 2 ? way : 0, .field = field};
}

static capsule_state start_of(const capsule_crew *crew, int slot)
{
    return state_of(crew->run[slot].begun, crew->run[slot].field, crew->run[slot].begun_turn);
}

typedef struct {
    capsule_crew *crew;
    const capsule_many *many;
    int64_t periods;
    capsule_step *step;
    int lanes;
    size_t next; /* row */
    int stopped; /* by the watch */
} work;

static void leave(work *w, int slot, capsule_stop stop, const capsule_state *state)
{
    capsule_crew *crew = w->crew;
    w->many->states[crew->run[slot].row] = *state;
    w->many->stops[crew->run[slot].row] = (int8_t)stop;
    crew->idle[crew->idlers++] = (int16_t)slot;
}

/* The wish of the row's run alone. */
static capsule_wish wish_of(const work *w, size_t row)
{
    const capsule_many *many = w->many;
    return (capsule_wish){
        .strobe = many->strobe ? many->strobe + row * (size_t)(w->periods + 1) : NULL,
        .position = many->position,
        .watch = many->watch,
        .precision = many->precision};
}

/* The wish of a run alone up to its next switch. */
static capsule_wish wish_of_one(const work *w, size_t row, capsule_event *event)
{
    capsule_wish wish = wish_of(w, row);
    wish.events = event;
    wish.room = 1;
    return wish;
}

/* Runs the next row by the scalar code. */
static void alone(work *w)
{
    capsule_event *first = w->many->first ? &w->many->first[w->next] : NULL;
    const capsule_wish wish = first ? wish_of_one(w, w->next, first) : wish_of(w, w->next);
    capsule_outcome open;
    size_t written;
    capsule_map_remake(&w->many->parameters[w->next], &w->crew->map);
    const capsule_stop stop = capsule_run(&w->crew->map, &w->many->states[w->next], w->periods,
                                          &wish, &written, &open);
    w->many->stops[w->next] = (int8_t)stop;
    w->stopped |= stop == CAPSULE_STOPPED || capsule_asked(w->many->watch, TABLES / 4);
}

/* Takes a run on from a state by the scalar code, segment by segment until one is plain, or only
   puts it into its queue if its next one is. */
static void begin(work *w, int slot, capsule_state state, int help)
{
    capsule_crew *crew = w->crew;
    const capsule_many *many = w->many;
    const size_t row = crew->run[slot].row;
    capsule_map_remake(&many->parameters[row], &crew->map);
    if (!capsule_allowed(&crew->map, &state)) {
        leave(w, slot, CAPSULE_REFUSED, &state);
        return;
    }
    for (;; help = 1) {
        capsule_stop stop = CAPSULE_FULL;
        capsule_outcome open;
        size_t written;
        if (help || crew->map.may_rest) {
            capsule_event event;
            const int whole = crew->map.may_rest && !many->first;
            const capsule_wish wish = whole ? wish_of(w, row) : wish_of_one(w, row, &event);
            stop = capsule_run(&crew->map, &state, w->periods, &wish, &written, &open);
            if (many->first && written) {
                many->first[row] = event;
                leave(w, slot, stop, &state);
                return;
            }
        } else if (state.turn >= w->periods) {
            stop = CAPSULE_DONE;
        }
        const int field = state.field ? state.field : capsule_field_at(&crew->map, &state);
        if (stop == CAPSULE_FULL && !field) {
            if (!help)
                continue; /* by the scalar code, in as many digits as it takes */
            stop = CAPSULE_OPEN;
        }
        if (stop != CAPSULE_FULL) {
            w->stopped |= stop == CAPSULE_STOPPED;
            leave(w, slot, stop, &state);
            return;
        }
        if (state.gap == 0.0 && state.v_r == 0.0)
            continue;
        const capsule_constants *c = &crew->map.field[field - 1];
        const double way = DRIFT_OF[field - 1], at_bound = state.bound;
        double cosine, sine;
        sine_cosine(state.angle, state.angle_rest, &sine, &cosine);
        const double slips = state.v_c == 0.0 ? 1.0 + (at_bound == way) : 0.0;
        const double numbers[CAPSULE_CREW_NUMBERS] = {
            [X_R] = state.x_r, [FAR] = state.gap, [V_R] = state.v_r, [V_C] = state.v_c,
            [MARGIN] = state.bound ? at_bound * c->f_b - c->friction
                                   : capsule_margin_at(c, state.x_r, state.gap, state.v_r),
            [ANGLE] = state.angle, [COSINE] = cosine, [SINE] = sine,
            [ANGLE_REST] = state.angle_rest, [POSITION] = state.position, [WAY] = way,
            [GAP_ZEROS] = state.gap == 0.0, [SECOND_ZEROS] = way != 0.0 ? slips : at_bound,
            [ALPHA] = c->alpha, [DELTA] = c->delta, [BOUND] = c->f_b};
        memcpy(crew->run[slot].number, numbers, sizeof numbers);
        memcpy(crew->run[slot].begun, numbers, sizeof numbers);
        crew->run[slot].turn = crew->run[slot].begun_turn = state.turn;
        crew->run[slot].expansions = 0;
        send(crew, slot, field, state.gap == 0.0);
        return;
    }
}

/* What follows from a step for one of its lanes. */
static void settle(work *w, int slot, int level, const capsule_outcomes *out, int l)
{
    capsule_crew *crew = w->crew;
    double *number = crew->run[slot].number;
    int field = crew->run[slot].field, key = crew->run[slot].key;
    double *guess = &crew->run[slot].guess[field - 1][key];
    const int crossing = out->crossing >> l & 1, open = out->open >> l & 1;
    const int expansions = ++crew->run[slot].expansions - open;
    /* A switch after many expansions, whose roundings add up, is moved to where the closed form from
       the segment's start has it. */
    if ((out->unplain >> l & 1) || (crossing && expansions > MOST_ADDED) ||
        (open && level + 1 == CAPSULE_LEVELS)) {
        begin(w, slot, start_of(crew, slot), 1);
        return;
    }
    if (open) {
        crew->run[slot].expansions = expansions;
        enqueue(crew, slot, level + 1);
        return;
    }
    if (out->passed >> l & 1) {
        const double *end = out->end[l];
        const int64_t turn = ++crew->run[slot].turn;
        if (w->many->strobe) {
            const size_t row = crew->run[slot].row * (size_t)(w->periods + 1) + (size_t)turn;
            double *mark = w->many->strobe[row];
            mark[0] = end[0];
            mark[1] = end[2];
            mark[2] = end[3];
        }
        if (turn == w->periods) {
            const capsule_state last = {.x_r = end[0], .gap = end[1], .v_r = end[2],
                                        .v_c = end[3], .position = end[4], .turn = turn,
                                        .field = crossing ? 0 : field};
            leave(w, slot, CAPSULE_DONE, &last);
            return;
        }
    }
    if (crossing) {
        const int left = field;
        *guess = number[LASTED];
        key = number[GAP_ZEROS] > 0.0;
        field = FIELD_OF[out->contact >> l & 1][(int)number[WAY] + 1];
        if (w->many->first) {
            const double v_r = number[V_R], v_c = number[V_C];
            const capsule_state start = state_of(number, field, crew->run[slot].turn);
            w->many->first[crew->run[slot].row] = (capsule_event){
                .turn = start.turn, .angle = number[ANGLE], .field = left,
                .plane = v_c == 0.0 ? field : IMPACT_PLANE[v_c > 0.0][v_r > 0.0]};
            leave(w, slot, CAPSULE_FULL, &start);
            return;
        }
        memcpy(crew->run[slot].begun, number, sizeof crew->run[slot].begun);
        crew->run[slot].begun_turn = crew->run[slot].turn;
        crew->run[slot].expansions = 0;
    } else if (expansions == MOST_BESIDE) {
        begin(w, slot, start_of(crew, slot), 1);
        return;
    } else {
        *guess = level ? 0.0 : -1.0;
        key = key < 2 ? 2 : key < KEYS - 1 ? key + 1 : key;
    }
    send(crew, slot, field, key);
}

static void work_through(work *w, size_t end)
{
    capsule_crew *crew = w->crew;
    int fullest = 0;
    for (;;) {
        if (w->stopped) { /* runs in hand can go on from their present segments' starts */
            for (int i = 0; i < CLEAR_QUEUE + 4; i++)
                while (crew->waiting[i]) {
                    const int slot = crew->queue[i][--crew->waiting[i]];
                    const capsule_state start = start_of(crew, slot);
                    leave(w, slot, CAPSULE_STOPPED, &start);
                }
            return;
        }
        while (crew->idlers && w->next < end && !w->stopped) {
            const int slot = crew->idle[--crew->idlers];
            const size_t row = crew->run[slot].row = w->next;
            w->next += w->many->stride;
            memset(crew->run[slot].guess, 0, sizeof crew->run[slot].guess);
            begin(w, slot, w->many->states[row], 0);
        }
        int slot[8];
        if (crew->waiting[fullest] < w->lanes)
            for (int i = 0; i < CLEAR_QUEUE + 4; i++)
                if (crew->waiting[i] > crew->waiting[fullest])
                    fullest = i;
        const int16_t *queue = crew->queue[fullest];
        const int waiting = crew->waiting[fullest];
        const int count = waiting < w->lanes ? waiting : w->lanes;
        if (!waiting)
            return;
        int ends = w->many->strobe != NULL;
        double *runs[8];
        for (int l = 0; l < w->lanes; l++) { /* lanes without a run repeat the first */
            slot[l] = queue[waiting - 1 - (l < count ? l : 0)];
            runs[l] = crew->run[slot[l]].number;
            ends |= crew->run[slot[l]].turn + 1 == w->periods;
        }
        crew->waiting[fullest] -= count;
        const int clear = fullest >= CLEAR_QUEUE;
        const int flow = clear ? fullest - CLEAR_QUEUE : fullest / CAPSULE_LEVELS;
        const int level = clear ? 0 : fullest % CAPSULE_LEVELS;
        capsule_outcomes out;
        w->step(&crew->map.field[FIELD_OF[flow / 2][1 + flow % 2] - 1], &crew->map.table[flow], level,
                w->many->position, ends, runs, &out);
        for (int l = 0; l < count; l++)
            settle(w, slot[l], level, &out, l);
        w->stopped |= capsule_asked(w->many->watch, STEP);
    }
}

int capsule_widest(void)
{
    return CAPSULE_ANY_WIDTH && capsule_lanes() > 1 ? 8 : capsule_lanes();
}

static int same_flows(const capsule_parameters *p, const capsule_parameters *q)
{
    return p->omega == q->omega && p->zeta == q->zeta && p->beta == q->beta &&
           p->gamma == q->gamma;
}

void capsule_run_many(const capsule_many *many, size_t count, int64_t periods, capsule_crew *crew)
{
    const int widest = capsule_widest(), asked = many->lanes;
    work w = {crew, many, periods, NULL, capsule_lanes(), 0, 0};
    if (!many->stride)
        return;
    if (asked == 1 || asked == 4 || asked == 8)
        w.lanes = asked < widest ? asked : widest;
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__))
    w.step = w.lanes == 8 ? capsule_step_8 : capsule_step_4;
#endif
    w.stopped = capsule_asked(many->watch, CAPSULE_WORK);
    while (w.next < count && !w.stopped) {
        const capsule_parameters *p = &many->parameters[w.next];
        size_t end = w.next + many->stride;
        while (end < count && same_flows(p, &many->parameters[end]))
            end += many->stride;
        capsule_map_remake(p, &crew->map);
        crew->idlers = 0;
        for (int slot = 0; slot < CAPSULE_CREW; slot++)
            crew->idle[crew->idlers++] = (int16_t)slot;
        memset(crew->waiting, 0, sizeof crew->waiting);
        if (end - w.next == many->stride || w.lanes == 1) {
            for (; w.next < end && !w.stopped; w.next += many->stride)
                alone(&w);
            continue;
        }
        w.stopped = capsule_asked(many->watch, TABLES);
        work_through(&w, end);
    }
    for (; w.next < count; w.next += many->stride) /* not begun */
        many->stops[w.next] = CAPSULE_STOPPED;
}
