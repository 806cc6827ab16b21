/* Columns of a diagram and cells of a chart: runs from a start to their motion. */
#include <math.h>
#include <string.h>

#include "page.h"

#define HEAD 16 /* numbers before the lists of a column */
#define CELL_HEAD 8
#define STATES 32
#define IMPACTS 1024
#define ITINERARY_ROOM ROOM /* as long as what is recorded: no itinerary is cut */
#define BLOCK 64

static int stick(int field) { return page.map.field[field - 1].drift == 0.0; }
static int contact(int field) { return page.map.field[field - 1].contact != 0.0; }

/* Whether the run repeats to the last bit: as it is a function of its state, what follows is known.
   The number of periods after which it does, or 0. */
static int repeats(void)
{
    const double(*last)[3] = (const double(*)[3])page.strobe[page.strobes];
    for (int m = 1; m <= STROBES / 2 && m < page.strobes; m++)
        if (memcmp(last, page.strobe[page.strobes - m], sizeof *last) == 0)
            return m;
    return 0;
}

/* Settles in blocks. What repeats to the last bit is not run again: only the rest that a whole number
   of repetitions leaves. */
static capsule_stop settle_by_blocks(double periods)
{
    double left = periods;
    while (left > 0.0) {
        const double now = left < 2 * BLOCK ? left : BLOCK;
        const capsule_stop stop = page_settle(now);
        if (stop != CAPSULE_DONE)
            return stop;
        left -= now;
        const int m = left > 0.0 ? repeats() : 0;
        if (m)
            left = fmod(left, m) > 0.0 ? fmod(left, m) + STROBES - STROBES % m : 0.0;
    }
    return CAPSULE_DONE;
}

/* The itinerary of the motion as field + 16 * plane of each segment's end, from the recorded cycle. */
static int put_itinerary(double *to, int room, int first)
{
    const int n = page.motion.switches;
    for (int i = 0; i < n && i < room; i++)
        to[i] = page.segments[first + i].field + 16 * page.segments[first + i].target;
    return n < room ? n : room;
}

/* One column, from where `start` put the run: see the reader in src/core.ts for its numbers. */
EXPORT(column) int column(double periods, double tolerance)
{
    double *const states = numbers + HEAD, *const impacts = states + 3 * STATES;
    double *const itinerary = impacts + IMPACTS;
    memset(numbers, 0, HEAD * sizeof *numbers);
    capsule_stop stop = settle_by_blocks(periods);
    if (stop == CAPSULE_DONE)
        stop = page_motion(tolerance);
    numbers[0] = stop;
    numbers[11] = page.state.x_r, numbers[12] = page.state.v_r, numbers[13] = page.state.v_c;
    if (stop != CAPSULE_DONE)
        return stop;
    const int m = page.motion.period_number, kept = m && m < STATES ? m : STATES;
    numbers[1] = m;
    numbers[2] = page.motion.switches;
    numbers[3] = page.motion.never ? page.motion.field : 0;
    const int rows = kept < page.strobes ? kept : page.strobes;
    numbers[8] = rows;
    memcpy(states, page.strobe[page.strobes + 1 - rows], (size_t)rows * sizeof page.strobe[0]);
    const capsule_state end = page.state;
    stop = page_record(m ? 2 * m + 1 : STATES);
    page.state = end;
    if (stop != CAPSULE_DONE && stop != CAPSULE_FULL) {
        numbers[0] = stop;
        return stop;
    }
    const int first = m ? page_cycle() : 1, n = m ? page.motion.switches : (int)page.count - 1;
    if (first < 0 && page.motion.switches) {
        numbers[0] = CAPSULE_FULL; /* longer than what is recorded: not told from others */
        return CAPSULE_FULL;
    }
    if (first < 0 || n < 1) {
        /* Of a motion that never leaves its field there is no segment to measure. */
        const int rests = page.motion.never && stick(page.motion.field);
        numbers[4] = rests ? 0.0 : NAN;
        numbers[5] = NAN;
        numbers[6] = page.motion.never ? (double)rests : NAN;
        numbers[7] = page.motion.never ? (double)(contact(page.motion.field)) : NAN;
        return CAPSULE_DONE;
    }
    double spent = 0.0, rest = 0.0, touch = 0.0, advance = 0.0;
    int hits = 0;
    for (int i = first; i < first + n; i++) {
        const capsule_segment *s = &page.segments[i];
        spent += s->duration;
        advance += s->advance;
        rest += stick(s->field) ? s->duration : 0.0;
        touch += contact(s->field) ? s->duration : 0.0;
        if (contact(s->field) && !contact(page.segments[i - 1].field) && hits < IMPACTS)
            impacts[hits++] = s->start[1];
    }
    const double turns = spent * page.map.parameters.omega / 6.283185307179586;
    double energies[3] = {0.0};
    capsule_add_energies(&page.map, page.segments + first, (size_t)n, NULL, energies);
    numbers[4] = m ? page.motion.advance / m : advance / turns;
    numbers[5] = energies[0] / turns;
    numbers[6] = rest / spent;
    numbers[7] = touch / spent;
    numbers[9] = hits;
    if (m) {
        numbers[10] = put_itinerary(itinerary, ITINERARY_ROOM, first);
        numbers[14] = page_monodromy(first, itinerary + ITINERARY_ROOM);
    }
    return CAPSULE_DONE;
}

/* The mean of the motion's states at phase 0, by which motions that coexist are told apart. */
static void put_mean(double out[3])
{
    const int m = page.motion.period_number, rows = m < 1 ? 1 : m < page.strobes ? m : page.strobes;
    for (int i = 0; i < 3; i++) {
        out[i] = 0.0;
        for (int k = 0; k < rows; k++)
            out[i] += page.strobe[page.strobes - k][i] / rows;
    }
}

/* One cell: its motion's period number, progression, itinerary and mean state, as soon as it is
   steady. */
EXPORT(cell) int cell(double periods)
{
    double left = periods;
    capsule_stop stop = CAPSULE_DONE;
    memset(&page.motion, 0, sizeof page.motion);
    while (left > 0.0 && stop == CAPSULE_DONE) {
        const double now = left < 2 * BLOCK ? left : BLOCK;
        stop = page_settle(now);
        left -= now;
        if (stop == CAPSULE_DONE)
            stop = left > 0.0 ? page_steady(1e-12) : page_motion(1e-9);
        if (page.motion.period_number || page.motion.never)
            break;
    }
    const int m = page.motion.period_number;
    numbers[0] = stop;
    numbers[1] = m;
    numbers[2] = page.motion.never ? page.motion.field : 0;
    /* Of a motion that never leaves its field there is no cycle to measure. */
    numbers[3] = m                                                   ? page.motion.advance / m
                 : page.motion.never && stick(page.motion.field) ? 0.0
                                                                   : NAN;
    numbers[4] = 0;
    put_mean(numbers + 5);
    if (stop == CAPSULE_DONE && m && page.motion.switches) {
        const capsule_stop end = page_record(2 * m + 1);
        const int first = end == CAPSULE_DONE || end == CAPSULE_FULL ? page_cycle() : -1;
        if (first >= 0)
            numbers[4] = put_itinerary(numbers + CELL_HEAD, ITINERARY_ROOM, first);
        else
            numbers[0] = stop = CAPSULE_FULL;
    }
    return stop;
}
