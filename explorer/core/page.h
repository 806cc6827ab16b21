/* Functions of the C library for the explorer's page, over one static map and run. The page reads the
   library's records, and a table of numbers, from the memory of the WebAssembly instance. */
#ifndef PAGE_H
#define PAGE_H

#include "capsule.h"

#define EXPORT(name) __attribute__((export_name(#name), used))

#define ROOM 4096        /* segments that are kept */
#define STROBES 32       /* states at the ends of the last periods, from which steadiness is decided */
#define NUMBERS (1 << 17)/* numbers that the page reads */
#define LONGEST_ITINERARY 256 /* segments of a motion whose orbit is closed */

/* State of a run, and its motion. */
typedef struct {
    capsule_state state;
    double passed; /* periods; `state.period` is 0 */
    double strobe[STROBES + 1][CAPSULE_STATE_COUNT];
    int strobes; /* rows of it that are there */
    capsule_motion motion;
} page_run;

extern page_run run;
extern capsule_map map;
extern capsule_segment segments[ROOM]; /* recorded */
extern size_t count;                   /* of them */
extern capsule_outcome left_open;      /* what stayed open, where a run stopped at that */
extern capsule_watch watch;            /* checks the page's time limit */
extern double numbers[NUMBERS];        /* results for the page */
extern capsule_parameters given;       /* written by the page */

capsule_stop settle(double periods);

#endif
