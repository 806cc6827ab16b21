/* Numbers of the runs of a batch, and the step of all lanes. */
#ifndef CAPSULE_BATCH_H
#define CAPSULE_BATCH_H

#include "internal.h"

/* Numbers of a run: the instant of its next expansion, and the facts known at its start. */
enum {
    X_R, FAR, V_R, V_C, MARGIN, ANGLE, ANGLE_REST,
#if CAPSULE_PULSED
    HIGH,         /* 1 if the drive is at its high level */
#else
    COSINE, SINE,
#endif
    WAY,          /* of the drift: 1, -1, or 0 at rest */
    GAP_ZEROS,    /* derivatives that vanish at the start, of the gap */
    SECOND_ZEROS, /* and of v_c; at rest 1 (-1) where Q is f_b (-f_b) */
    ENERGY_ERROR, V_C_ERROR, ANGLE_ERROR, POSITION,
    LASTED,       /* duration of the last similar segment, over its reach; after a step, of this one */
#define OF_RUN_AT(name) RUN_##name,
#if TWO_STOPS
    OTHER, /* the gap of the other stop */
#endif
    CAPSULE_RUN_PARAMETERS(OF_RUN_AT) /* fixed; in all at most CAPSULE_RUN_NUMBERS */
};

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
   on an expansion of this level. */
typedef void capsule_lane_step(const capsule_constants *c, const capsule_table *t, int level,
                          int position, int ends, double *const *runs, capsule_outcomes *out);

capsule_lane_step capsule_step_4, capsule_step_8;

#endif
