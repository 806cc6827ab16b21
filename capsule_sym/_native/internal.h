/* Declarations shared by the parts of the library. */
#ifndef CAPSULE_INTERNAL_H
#define CAPSULE_INTERNAL_H

#include "capsule.h"

#define LEAST_ROWS 8192 /* of a strobe whose rows are taken again; no segment passes half as many
                           ends of periods, unless it lasts for ever */

#define TWO_STOPS (CAPSULE_STOP_COUNT == 2)

/* Expansions whose rounding errors may add up at a switch: more with tables economized by rates, in which the
   error of v_r is smaller. */
#if CAPSULE_REACTION
#define MOST_SUMMED 6
#else
#define MOST_SUMMED 4
#endif

/* Offset of the second guard's powers of s from those of x_r: v_c is the integral of P, which contains x_r
   and v_r. If the drive reacts, v_c contains v_r alone, by momentum. */
#define BEHIND(drift) (CAPSULE_REACTION ? 0 : (drift))

/* A state in 106 bits, if these decided the switch that led to it. */
typedef struct {
    double x_r[2], gap[2], v_r[2], v_c[2], angle[2];
#if TWO_STOPS
    double back[2];
#endif
    int known;
} capsule_exact;

/* A double-double, and the tables for them: a run makes one when 106 bits first need its flow. */
typedef struct {
    double hi, lo;
} capsule_wide_number;
#define CAPSULE_WIDE_TERMS 28
typedef CAPSULE_TABLE_OF(capsule_wide_number, CAPSULE_WIDE_TERMS, CAPSULE_WIDE_TERMS + 1, 1)
    capsule_wide_table;

/* Result of a segment, and the rest of its record besides the states. */
typedef struct {
    capsule_outcome outcome;
    double duration, advance;
    double gap, margin, cosine, sine; /* at its start */
    int field, switched, evaluations;
    int gave_up; /* given up after very many expansions: another method looks further ahead */
    int stopped; /* by the watch, on the way */
} capsule_result;

/* Data of a run between its segments. */
typedef struct {
    const capsule_map *map;
    const capsule_request *request;
    int64_t periods;
    int position;
    /* Last end of a segment of this field, in its expansion: by the plane from which it came, if it ended in
       the first one, else at 0. */
    double guess[CAPSULE_FIELD_COUNT + 1][CAPSULE_PLANE_COUNT + 1];
    capsule_exact exact;
    double angle, cosine, sine; /* of the last switch */
    capsule_wide_table *wide;   /* by contact and drift */
    int wide_made[CAPSULE_FLOW_COUNT];
} capsule_context;

/* Functions compiled for double precision, for 106 bits, and for fused multiply-adds in both. */
typedef struct {
    /* Advances a run over its present segment, and finds the successor field. Keeps the state if that is
           not decided. */
    void (*run_segment)(capsule_context *context, capsule_state *state, capsule_result *p);
    /* Successor field at a state; 0 if this precision cannot decide. */
    int (*field_at)(const capsule_map *map, const capsule_state *state);
    /* Values of `capsule_evaluate`, x_c only with `position`; null in 106 bits. */
    size_t (*states_at)(const capsule_map *map, const capsule_segment *segments, size_t count,
                        int more, int position, const double *times, size_t n, double (*states)[4],
                        capsule_watch *watch);
} capsule_code;
extern const capsule_code capsule_code_plain, capsule_code_fused, capsule_code_wide,
    capsule_code_wide_fused;

/* Functions for this processor. */
const capsule_code *capsule_code_here(int wide);

/* True if maps at two parameter sets have the same tables. */
static inline int capsule_same_flows(const capsule_parameters *p, const capsule_parameters *q)
{
#define EQUAL(name) && p->name == q->name
    return 1 CAPSULE_FLOW_PARAMETERS(EQUAL);
}

/* Start of the closed form of a recorded segment. */
static inline capsule_start capsule_start_of(const capsule_segment *s)
{
    return (capsule_start){s->start[0], s->gap, s->start[1], s->start[2], s->margin, s->cosine, s->sine};
}

/* True if these are parameters of a map. */
int capsule_parameters_allowed(const capsule_parameters *parameters);

/* True if a run from a state is allowed: parameters and state satisfy the conditions of capsule.h, so every
   index and every loop below is bounded. */
int capsule_allowed(const capsule_map *map, const capsule_state *state);

/* Advances a segment without contact that is proved to rest up to the end of the run, or forever: the states
   at the ends of all periods follow. */
void capsule_rest(capsule_context *context, double x_r, double v_r, double angle, double angle_rest,
                  int forever, capsule_state *state, capsule_result *p);

/* Writes a state to the strobe's row of a period. */
void capsule_write_strobe(const capsule_request *request, int64_t period, double x_r, double v_r, double v_c);

#endif
