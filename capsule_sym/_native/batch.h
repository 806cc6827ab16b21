/* The numbers of the runs of a batch, and the step that lanes of them take together. */
#ifndef CAPSULE_BATCH_H
#define CAPSULE_BATCH_H

#include "internal.h"

/* Numbers of a run: where its next expansion stands and what is known of its start there. */
enum {
    X_R, FAR, V_R, V_C, MARGIN, ANGLE, ANGLE_REST,
#if CAPSULE_PULSED
    HIGH,         /* whether the drive is at its high level */
#else
    COSINE, SINE,
#endif
    WAY,          /* of the drift: 1, -1, or 0 at rest */
    GAP_ZEROS,    /* derivatives that vanish at the start, of the gap */
    SECOND_ZEROS, /* and of v_c; at rest 1 (-1) where P is f_b (-f_b) */
    ENERGY_ERROR, V_C_ERROR, ANGLE_ERROR, POSITION,
    LASTED,       /* what the last segment like this took, over its reach; after a step, this one */
#define OF_RUN_AT(name) RUN_##name,
#if TWO_STOPS
    OTHER, /* the gap of the other stop */
#endif
    CAPSULE_RUN_PARAMETERS(OF_RUN_AT) /* fixed; in all at most CAPSULE_RUN_NUMBERS */
};

/* What became of the lanes of a step: bits by lane. */
typedef struct {
    int open;     /* this expansion proves nothing; a shorter one may */
    int undetermined;  /* what follows the switch stays open here */
    int crossing; /* a switch ends the segment */
    int contact;  /* of the segment to come */
    int edge;     /* the switch is an edge of pulses */
#if TWO_STOPS
    int behind;   /* whether the contact to come is with the stop behind */
#endif
    int passed;   /* an excitation period ended within the expansion */
    double end[8][8]; /* there, if asked for: x_r, gap, v_r, v_c, x_c, the other stop's gap by lane */
} capsule_outcomes;

/* Takes one expansion's step of as many runs as there are lanes, all in the same linear flow,
   on an expansion of this level. */
typedef void capsule_lane_step(const capsule_constants *c, const capsule_table *t, int level,
                          int position, int ends, double *const *runs, capsule_outcomes *out);

capsule_lane_step capsule_step_4, capsule_step_8;

#endif
