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
    double passed; /* periods before `state.period` was set to 0 */
    double strobe[STROBES + 1][3];
    int strobes; /* rows of it that are there */
    capsule_segment segments[ROOM];
    size_t count;
    capsule_motion motion;
    capsule_outcome open;
    int by_newton;
} page_run;

extern page_run page;
extern capsule_watch page_watch; /* asks the page whether the time is up */
extern double numbers[NUMBERS];/* what the page asked for, row by row */
extern double given[7];     /* the seven parameters, written by the page */

capsule_stop page_settle(double periods);
capsule_stop page_steady(double tolerance);
capsule_stop page_record(int periods);

/* A periodic orbit, closed by Newton's method on the equations of its itinerary. */
typedef struct {
    int n, period_number, zero; /* segments, periods, and the segment of zero duration or -1 */
    int pin; /* which of x_r, v_r, v_c and the angle at the start is held at `pinned`; -1: none */
    double pinned;
    int field[LONGEST_ITINERARY];
    double start[3], angle, h[LONGEST_ITINERARY];
    double monodromy[3][3];
    double residual, advance;
    double event[3], event_force; /* state and P where the segment of zero duration stands */
    int steps;
} page_orbit;

/* From the recorded segments of one period of a motion; 0 where they are no orbit. */
int page_orbit_from(const capsule_segment *segments, int n, int period_number, page_orbit *orbit);

/* Closes it at the parameters `values`. With a segment of zero duration, or a part of the start that
   is held, the parameter `free` is an unknown as well, and is written to. 0 where Newton's method
   fails. */
int page_close(page_orbit *orbit, double values[7], int free);

/* Its monodromy matrix and progression as it stands, without closing it. */
void page_linearize(page_orbit *orbit, double values[7]);

/* State and angle in the middle of its first segment. */
void page_within(const page_orbit *orbit, const double values[7], double at[4]);

/* What carries a deviation from the start of the recorded segments to their end. */
void page_carried(double product[3][3]);

/* The periodic motion that the run has come to, or comes to: where it settles slowly, Newton's method
   on the map of so many periods leads to the stable motion beside it, which is run like any other.
   `page.by_newton` says whether that was so. */
capsule_stop page_motion(double tolerance);

/* Of the recorded segments from `first` on, n of them: drive's work, damper's and friction's loss. */
void page_energies(int first, int n, double out[3]);

/* Where the first whole cycle of the motion starts among the recorded segments; -1 if none does. */
int page_cycle(void);

#endif
