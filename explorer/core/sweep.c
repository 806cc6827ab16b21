/* Runs from a start to their motion, for the columns of a diagram and the cells of a chart. */
#include <math.h>
#include <string.h>

#include "page.h"

#define HEAD 20 /* numbers before the states, as in src/core.ts */
#define BLOCK 64

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

/* Settles in blocks, until the run is steady if `early`. Otherwise what repeats to the last bit is not run
   again: only the rest that a whole number of repetitions leaves. */
static capsule_stop settle_by_blocks(double periods, int early)
{
    for (double left = periods; left > 0.0;) {
        const double now = left < 2 * BLOCK ? left : BLOCK;
        capsule_stop stop = page_settle(now);
        left -= now;
        if (stop == CAPSULE_DONE && early && left > 0.0)
            stop = page_steady(1e-12);
        if (stop != CAPSULE_DONE || page.motion.period_number || page.motion.never)
            return stop;
        const int m = left > 0.0 && !early ? repeats() : 0;
        if (m)
            left = fmod(left, m) > 0.0 ? fmod(left, m) + STROBES - STROBES % m : 0.0;
    }
    return page_motion(1e-9);
}

/* The motion that the run comes to from where `start` put it, with its recorded segments: after so many
   periods, with the work done and the monodromy matrix, or early, as soon as it is steady. */
EXPORT(attain) int attain(double periods, int early)
{
    memset(numbers, 0, HEAD * sizeof *numbers);
    memset(&page.motion, 0, sizeof page.motion);
    page.count = 0;
    capsule_stop stop = settle_by_blocks(periods, early);
    if (stop != CAPSULE_DONE)
        return stop;
    const int m = page.motion.period_number, switches = page.motion.switches;
    const int kept = m && m < STROBES ? m : STROBES, rows = kept < page.strobes ? kept : page.strobes;
    const capsule_state end = page.state;
    if (!early || switches)
        stop = page_record(m ? 2 * m + 1 : STROBES);
    page.state = end;
    const int first = m ? page_cycle() : 1, n = m ? switches : (int)page.count - 1;
    if (stop != CAPSULE_DONE && stop != CAPSULE_FULL)
        return stop;
    if (first < 0 && switches)
        return CAPSULE_FULL; /* longer than what is recorded: not told from others */
    const double row[] = {m, page.motion.never ? page.motion.field : 0, page.motion.advance, end.x_r,
                          end.v_r, end.v_c, rows, first < 0 ? 0 : first, first < 0 ? 0 : n};
    memcpy(numbers, row, sizeof row);
    memcpy(numbers + HEAD, page.strobe[page.strobes + 1 - rows], (size_t)rows * sizeof page.strobe[0]);
    if (early || first < 0 || n < 1)
        return CAPSULE_DONE;
    double energies[3] = {0.0};
    capsule_add_energies(&page.map, page.segments + first, (size_t)n, NULL, energies);
    numbers[9] = energies[0];
    numbers[10] = m && page_monodromy(first, numbers + 11);
    return CAPSULE_DONE;
}
