/* The step of all lanes. */
#ifndef CAPSULE_BATCH_H
#define CAPSULE_BATCH_H

#include "internal.h"

/* Outcome of the lanes of a step: a bit for each lane. */
typedef struct {
    int open;     /* this expansion proves nothing; a shorter one may */
    int undetermined;  /* the successor field is not certain here */
    int crossing; /* a switch ends the segment */
    int contact;  /* of the segment to come */
    int edge;     /* the switch is an edge of pulses */
#if TWO_STOPS
    int behind;   /* the contact to come is with the stop behind */
#endif
    int passed;   /* an excitation period ended within the expansion */
    double end[8][8]; /* state there, if requested: x_r, gap, v_r, v_c, x_c, the other stop's gap by lane */
} capsule_outcomes;

/* Takes one expansion's step of as many runs as there are lanes, all in the same linear flow,
   on an expansion of this level; each run is a `lane` of expansion.h, over doubles. */
typedef void capsule_lane_step(const capsule_constants *c, const capsule_table *t, int level,
                          int position, int ends, double *const *runs, capsule_outcomes *out);

capsule_lane_step capsule_step_4, capsule_step_8;

#endif
