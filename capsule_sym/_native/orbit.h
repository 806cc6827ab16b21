/* Declarations shared by the parts that compute a periodic orbit and its metrics. */
#ifndef CAPSULE_ORBIT_H
#define CAPSULE_ORBIT_H

#include "capsule.h"

/* Columns of derivatives: x_r, v_r, v_c and phase at the start, the parameters, and the rate. */
enum {
    SLOPES = CAPSULE_SLOPE_COUNT, RATE = SLOPES, COLUMNS_AT = CAPSULE_COLUMN_COUNT,
    PARAMETER = CAPSULE_STATE_COUNT + 1, PARAMETERS = CAPSULE_PARAMETER_COUNT,
    METRICS = CAPSULE_METRIC_COUNT, OMEGA_AT = CAPSULE_OMEGA_AT
};

/* A run over whole excitation periods from forcing angle 0. The time of its end depends on omega. */
typedef struct {
    const capsule_map *map;
    const capsule_segment *segments;
    size_t count;
    int periods;
    double end, end_by_omega;
} capsule_closed_run;

/* Derivatives at the start of the run; those with respect to v_c are 0 for a capsule at rest. */
void capsule_slopes_of_run(const capsule_closed_run *run, capsule_slopes *at);

/* Place of the largest size of a quantity: the segment, and the time after its start, or its end. */
typedef struct {
    double size, after; /* size of a gap: 0 if it never closes; with two stops the force of its spring */
    double x_r, gap, v_r;
    size_t segment;
    int at_end;
} capsule_peak;

/* A segment that needs more panels or stretches is undecided: it is very slow compared with its flow. */
#define MOST_STRETCHES (1 << 20)

/* Finds the largest size of the force along the run, or of the gap in contact, to rounding. The watch may be
   null. */
capsule_stop capsule_find_peak(const capsule_closed_run *run, capsule_quantity quantity,
                               capsule_watch *watch, capsule_peak *peak);

/* Writes the requested metrics. If requested, `slopes` receives their derivatives with respect to the start
   and the parameters, in the order of the record. */
capsule_stop capsule_metrics(const capsule_closed_run *run, const capsule_orbit_request *request,
                             capsule_orbit *orbit, double slopes[METRICS][SLOPES]);

#endif
