/* What the explorer's page asks of the C library, over one static map, run and table of numbers that
   the page reads from the memory of the WebAssembly instance. */
#ifndef PAGE_H
#define PAGE_H

#include "capsule.h"

#define EXPORT(name) __attribute__((export_name(#name), used))

#define ROOM 4096        /* segments that are kept */
#define STROBES 32       /* states at the ends of the last periods, from which steadiness is judged */
#define NUMBERS (1 << 17)/* numbers that the page reads */
#define LONGEST_ITINERARY 256 /* segments of a motion whose orbit is closed */

/* Where a run stands, and the motion that it has come to. */
typedef struct {
    capsule_map map;
    capsule_state state;
    double passed; /* periods; `state.period` is 0 */
    double strobe[STROBES + 1][CAPSULE_STATE_COUNT];
    int strobes; /* rows of it that are there */
    capsule_segment segments[ROOM];
    size_t count;
    capsule_motion motion;
    capsule_outcome open;
    int by_newton;
} page_run;

extern page_run page;
extern capsule_watch page_watch; /* asks the page whether the time is up */
extern double numbers[NUMBERS];  /* what the page asked for, row by row */
extern double given[CAPSULE_PARAMETER_COUNT]; /* the parameters, written by the page */

capsule_stop page_settle(double periods);
capsule_stop page_record(int periods);

/* The periodic motion that the run has come to; `page.motion` says which. */
capsule_stop page_steady(double tolerance);

/* Or comes to: where it settles slowly, Newton's method on the map of so many periods leads to the
   stable motion beside it, which is run like any other; `page.by_newton` says whether that was so. */
capsule_stop page_motion(double tolerance);

/* Where the first whole cycle of the motion starts among the recorded segments; -1 if none does. */
int page_cycle(void);

/* The monodromy matrix of the recorded motion whose cycle starts there, as it was run; 0 if it has none. */
int page_monodromy(int first, double *matrix);

#endif
