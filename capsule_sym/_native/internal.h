/* What the parts of the library share. */
#ifndef CAPSULE_INTERNAL_H
#define CAPSULE_INTERNAL_H

#include "capsule.h"

#define LEAST_ROWS 8192 /* of a strobe whose rows are taken again; no segment passes half as many
                           ends of periods, unless it lasts for ever */

#define TWO_STOPS (CAPSULE_STOP_COUNT == 2)

/* Expansions whose roundings may add up to a switch: more where tables are economized by rates, whose v_r
   is off by less. */
#if CAPSULE_REACTION
#define MOST_SUMMED 6
#else
#define MOST_SUMMED 4
#endif

/* How many powers of s the second guard's coefficients are behind those of x_r: v_c is the integral of P,
   which has x_r and v_r. If the drive reacts, v_c has v_r alone, by momentum. */
#define BEHIND(drift) (CAPSULE_REACTION ? 0 : (drift))

/* A state in 106 bits, where these decided the switch that led to it. */
typedef struct {
    double x_r[2], gap[2], v_r[2], v_c[2], angle[2];
#if TWO_STOPS
    double back[2];
#endif
    int known;
} capsule_exact;

/* A double-double, and the tables for them: a run makes one where 106 bits first meet its flow. */
typedef struct {
    double hi, lo;
} capsule_wide_number;
#define CAPSULE_WIDE_TERMS 28
typedef CAPSULE_TABLE_OF(capsule_wide_number, CAPSULE_WIDE_TERMS, CAPSULE_WIDE_TERMS + 1, 1)
    capsule_wide_table;

/* How a segment passed, and what its record has besides the states. */
typedef struct {
    capsule_outcome outcome;
    double duration, advance;
    double gap, margin, cosine, sine; /* at its start */
    int field, switched, evaluations;
    int gave_up; /* given up after very many expansions: another method looks further ahead */
    int stopped; /* by the watch, on the way */
} capsule_result;

/* What a run keeps between its segments. */
typedef struct {
    const capsule_map *map;
    const capsule_request *request;
    int64_t periods;
    int position;
    double guess[CAPSULE_FIELD_COUNT + 1][CAPSULE_PLANE_COUNT + 1]; /* where a segment of this field from this plane ended last */
    capsule_exact exact;
    double angle, cosine, sine; /* of the last switch */
    capsule_wide_table *wide;   /* by contact and drift */
    int wide_made[CAPSULE_FLOW_COUNT];
} capsule_context;

/* What is compiled for double precision, for 106 bits, and for fused multiply-adds in both. */
typedef struct {
    /* Takes a run over its present segment, and finds the field that follows. Leaves the state alone
       where that stays open. */
    void (*run_segment)(capsule_context *context, capsule_state *state, capsule_result *p);
    /* The field that takes over at a state; 0 where this precision leaves it open. */
    int (*field_at)(const capsule_map *map, const capsule_state *state);
    /* What `capsule_evaluate` gives, x_c only with `position`; null in 106 bits. */
    size_t (*states_at)(const capsule_map *map, const capsule_segment *segments, size_t count,
                        int more, int position, const double *times, size_t n, double (*states)[4],
                        capsule_watch *watch);
} capsule_code;
extern const capsule_code capsule_code_plain, capsule_code_fused, capsule_code_wide,
    capsule_code_wide_fused;

/* Which of them is for this processor. */
const capsule_code *capsule_code_here(int wide);

/* Whether maps at two parameter sets have the same tables. */
static inline int capsule_same_flows(const capsule_parameters *p, const capsule_parameters *q)
{
#define EQUAL(name) && p->name == q->name
    return 1 CAPSULE_FLOW_PARAMETERS(EQUAL);
}

/* Where the closed form of a recorded segment starts. */
static inline capsule_start capsule_start_of(const capsule_segment *s)
{
    return (capsule_start){s->start[0], s->gap, s->start[1], s->start[2], s->margin, s->cosine, s->sine};
}

/* Whether these are parameters of a map. */
int capsule_parameters_allowed(const capsule_parameters *parameters);

/* Whether a run from a state may be asked for: parameters and state keep what capsule.h says, so
   that every index and every loop below is bounded. */
int capsule_allowed(const capsule_map *map, const capsule_state *state);

/* Whether a resting segment without contact is proved to last for ever: x_r is the forced response
   plus a free part whose energy never grows. Then the states at the ends of all periods follow. */
void capsule_rest(capsule_context *context, double x_r, double v_r, double angle, double angle_rest,
                  capsule_state *state, capsule_result *p);

/* Writes a state to the strobe's row of a period. */
void capsule_write_strobe(const capsule_request *request, int64_t period, double x_r, double v_r, double v_c);

#endif
