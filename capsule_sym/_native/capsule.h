/* The exact map of the capsule system in C99: segments chained from switch to switch, each switch proved
   to be the first event of its segment. No allocation, no global state, no dependency but libm. Every
   function may be called from several threads on separate data.

   All quantities are dimensionless, named as in the paper (Guo & Liu, Physica D, 2019, doi
   10.1016/j.physd.2019.04.008). A time is a number of whole excitation periods and a forcing angle in [0, 2
   pi), so that no error grows with the number of periods.

   Pointers must not be null unless stated. Other invalid arguments are refused, and nothing is computed:
   the result is CAPSULE_REFUSED or a number as stated. The caller must guarantee conditions that no
   function can check: arrays of the given lengths, segments that `capsule_run` wrote, maps that were made,
   memory that was zeroed if required. The closed forms of capsule_kernels.h check nothing. */
#ifndef CAPSULE_H
#define CAPSULE_H

#include <stddef.h>
#include <stdint.h>

#include "capsule_core.h"
#include "capsule_interface.h"
#include "capsule_kernels.h"

/* A shared library exports the functions declared here, and no others. */
#if defined(CAPSULE_EXPORTS) && defined(__GNUC__)
#pragma GCC visibility push(default)
#endif

#define CAPSULE_TERMS 14 /* coefficients from which a state is evaluated */
#define CAPSULE_DEGREE 8 /* of the polynomials that bound a guard from below and above */
#define CAPSULE_REACH 1.4 /* length of an expansion is at most this over the fastest rate of its flow, */
#define CAPSULE_GROWTH 1.6 /* and at most this over the growth rate of its terms in absolute value */

#define CAPSULE_LIMITS 8
#define CAPSULE_LEVELS 4 /* lengths of expansions side by side, each half of the one before */

/* True if Q varies with the drive within a segment: otherwise Q - P is constant there. */
#define CAPSULE_REACTION (CAPSULE_REACTS && !CAPSULE_PULSED)
#if CAPSULE_REACTION
#define CAPSULE_REACTION_OF(number, terms)                                                         \
    number reaction[2][terms]; /* of the drive in Q at rest, by its cosine and sine at the start */
#else
#define CAPSULE_REACTION_OF(number, terms)
#endif

/* Shared data of the expansions of one linear flow, for motions composed of the responses to a unit force
   and a unit velocity and, unless the drive is constant, to its cosine and sine. The time unit is `reach`. */
#define CAPSULE_TABLE_OF(number, terms, degree, levels)                                            \
    struct {                                                                                       \
        double reach, root_K, level[levels]; /* level: 1, 1/2, ... */                              \
        double x_per_energy, v_c_per_energy, force_per_energy; /* bounds by that of free motion */ \
        double reach_per_gamma;                                                                    \
        int contact;                                                                               \
        number per_reach;                                                                          \
        /* A row, or a number, for each response. */                                               \
        number x_whole[CAPSULE_RESPONSE_COUNT]; /* x_r(1) - x_r(0) */                              \
        number v_whole[CAPSULE_RESPONSE_COUNT], second_whole[CAPSULE_RESPONSE_COUNT]; /* v_r(1) */ \
        number x[CAPSULE_RESPONSE_COUNT][terms]; /* coefficients of s, s^2, ... of x_r(s) - x_r(0) */ \
        /* Bernstein coefficients on (0, level), from 1: of x_r, and of Q - Q(0), which is in drift \
           v_c - v_c(0) - margin s. */                                                             \
        number x_form[levels][CAPSULE_RESPONSE_COUNT][degree];                                     \
        number second_form[levels][CAPSULE_RESPONSE_COUNT][degree];                                \
        number from_position[terms + 1], from_rate[terms + 1]; /* x to Q or v_c, by term */        \
        CAPSULE_REACTION_OF(number, terms)                                                         \
        double limit[CAPSULE_RESPONSE_COUNT][CAPSULE_LIMITS]; /* bounds per unit, see tables.h */  \
        double v_error[CAPSULE_RESPONSE_COUNT]; /* of v_r */                                       \
        double x_speed[CAPSULE_RESPONSE_COUNT], second_speed[CAPSULE_RESPONSE_COUNT]; /* in s */   \
    }
typedef CAPSULE_TABLE_OF(double, CAPSULE_TERMS, CAPSULE_DEGREE, CAPSULE_LEVELS) capsule_table;

/* Constants of all fields at one parameter set; read-only once made. */
typedef struct {
    capsule_parameters parameters;
    capsule_constants field[CAPSULE_FIELD_COUNT];
    capsule_table table[CAPSULE_FLOW_COUNT]; /* by contact and drift */
    int may_rest; /* 1 if the forcing alone leaves a capsule without contact at rest, 2 if for some periods */
} capsule_map;

#define CAPSULE_WORK 8192

/* Checks a watch; true to stop. A null watch never stops. */
static inline int capsule_over(const capsule_watch *watch)
{
    return watch && ((watch->most && watch->done >= watch->most) ||
                     (watch->ask && watch->ask(watch->about)));
}

/* Counts work of about so many expansions, and checks the watch now and then; true to stop. */
static inline int capsule_asked(capsule_watch *watch, int64_t work)
{
    if (!watch || (watch->work += work) < CAPSULE_WORK)
        return 0;
    watch->done += watch->work;
    watch->work = 0;
    return capsule_over(watch);
}

/* Results of a run besides the final state; null pointers are skipped, at no cost. */
typedef struct {
    double (*strobe)[3]; /* the state at the end of period k in row k, k = 1 .. periods */
    int64_t rows;        /* 0 if strobe has periods + 1 rows. Else its number of rows, at least 8192:
                            row k % rows has period k, and the run pauses when half of them are new */
    capsule_segment *segments;
    capsule_event *events; /* not written if segments are */
    size_t room;   /* of segments or events; the run pauses when it is used up */
    int position;  /* 1 to integrate x_c, as segments always do */
    capsule_watch *watch; /* or null */
    int precision; /* a capsule_precision */
} capsule_request;

#define CAPSULE_PERIODS ((int64_t)1 << 53) /* most periods of a run */

/* Makes the map at a parameter set. All parameters are finite, those of CAPSULE_POSITIVE_PARAMETERS > 0,
   those of CAPSULE_NOT_NEGATIVE_PARAMETERS >= 0, those of CAPSULE_SHARE_PARAMETERS < 1, and two stops do
   not touch. Otherwise it returns CAPSULE_REFUSED, and so do runs on the map. `capsule_map_remake` takes a
   map made before, or zeroed memory, and keeps the parts that do not change. A share so near to 0 or 1
   that a pulse or a pause is shorter than the rounding of an angle (1e-300, say) is accepted, but runs
   that begin to slip there return CAPSULE_OPEN. */
capsule_stop capsule_map_make(const capsule_parameters *parameters, capsule_map *map);
capsule_stop capsule_map_remake(const capsule_parameters *parameters, capsule_map *map);

/* Makes only the constants of a map: enough for `capsule_state_at`, and not for runs, which do not check
   it. */
capsule_stop capsule_map_constants(const capsule_parameters *parameters, capsule_map *map);

/* State at a time in [0, 2 pi/omega), on exactly those surfaces that its numbers satisfy. Without a map its
   gap is not a number, and runs refuse it. */
capsule_state capsule_state_at(const capsule_map *map, double x_r, double v_r, double v_c,
                               double phase);

/* Number of runs that this processor takes side by side: 8 (AVX-512), 4 (AVX2, or ARM 64) or 1. The last
   bits of results differ between these numbers. */
int capsule_lanes(void);

/* Most runs side by side that may be requested: a larger number only in builds for tests of all widths. */
int capsule_widest(void);

/* Continues from `state` to the end of excitation period `periods` (forcing angle 0), and writes the final
   state to `state`, rounded to double precision. The extra digits of a switch decided in 106 bits are kept
   within a call only: a run that pauses resumes from a rounded start, as a run in double precision does
   after each switch. `written` counts segments or events. If the result is CAPSULE_OPEN, `open` is the
   outcome that was not decided, and the state is the start of that segment. */
capsule_stop capsule_run(const capsule_map *map, capsule_state *state, int64_t periods,
                         const capsule_request *request, size_t *written, capsule_outcome *open);

/* Many runs, side by side. */
typedef struct {
    size_t stride; /* at least 1; row distance of the runs, for sharing among threads */
    const capsule_parameters *parameters; /* of each run */
    capsule_state *states;                /* start states, replaced by final states */
    int8_t *stops;                        /* result of each, a capsule_stop */
    double (*strobe)[3];                  /* periods + 1 rows a run, or null; as in a request */
    int position;                         /* 1 to integrate x_c */
    capsule_watch *watch;                 /* or null; runs that it stops can be resumed */
    int lanes;                            /* 8, 4 or 1; 0 for as many as the processor has */
    int precision;                        /* a capsule_precision, for runs outside the lanes */
    capsule_event *first; /* or null: receives each run's first switch, at which the run pauses with
                             CAPSULE_FULL; `plane` of its state is 0 if lanes found it */
} capsule_batch;

#define CAPSULE_BATCH_SIZE 128  /* active runs */
#define CAPSULE_RUN_NUMBERS                                                                        \
    ((16 + CAPSULE_STOP_COUNT - CAPSULE_PULSED + CAPSULE_RUN_PARAMETER_COUNT + 3) / 4 * 4)

/* Workspace of `capsule_run_many`, some 100 kB: zero before the first call; the tables of the last
   flows are kept for the next. */
typedef struct {
    capsule_map map;
    struct {
        double number[CAPSULE_RUN_NUMBERS], begun[CAPSULE_RUN_NUMBERS]; /* present and at its start */
        double guess[CAPSULE_FIELD_COUNT][5]; /* by field and number of earlier expansions */
        size_t row;
        int64_t period, begun_period;
        int field, key, expansions; /* of the present segment; the key of its guess */
    } run[CAPSULE_BATCH_SIZE];
    int16_t queue[CAPSULE_FLOW_COUNT * (CAPSULE_LEVELS + 1)][CAPSULE_BATCH_SIZE], idle[CAPSULE_BATCH_SIZE];
    int waiting[CAPSULE_FLOW_COUNT * (CAPSULE_LEVELS + 1)], idle_count;
} capsule_workspace;

/* Advances the runs among `count` rows to the end of period `periods`, as `capsule_run` does for one. It is
   fastest if neighbouring runs share CAPSULE_FLOW_PARAMETERS. CAPSULE_DONE means that each run has its
   result in `stops`. */
capsule_stop capsule_run_many(const capsule_batch *batch, size_t count, int64_t periods, capsule_workspace *workspace);

/* Finds the periodic motion of a run at the end of a period, from its states at the ends of the last
   `count` periods: the least period number, of at most count/2 periods, after which the last states repeat
   within `tolerance`, and the next switches exactly in field and plane. `events` receives those of one
   period of the motion, from the end of the run on, and needs room for those of two. A motion that decays
   through infinitely many switches, as off rest at alpha = delta = 0, has no period number. CAPSULE_FULL
   means too little room, CAPSULE_OPEN that a switch was not decided. `watch` may be null. */
capsule_stop capsule_steady(const capsule_map *map, const capsule_state *state,
                            double (*states)[3], int count, double tolerance,
                            capsule_event *events, size_t room, capsule_watch *watch,
                            capsule_motion *motion, capsule_outcome *open);

/* Evaluates the states (x_r, v_r, v_c, x_c) of a run at times, from its segments in their order. Times are
   absolute, 2 pi/omega for each period plus the angle over omega; ascending times are fastest, since a
   step back passes each segment between. Before the first segment the state is its start, after the last
   its end. If `more` segments follow in another call, evaluation ends at the first time at or after the
   last one's end. Returns the number of times evaluated: less than n also if `watch` (may be null) stops
   it, or at an invalid field; 0 if refused. */
size_t capsule_evaluate(const capsule_map *map, const capsule_segment *segments, size_t count,
                        int more, const double *times, size_t n, double (*states)[4],
                        capsule_watch *watch);

/* Derivatives of a run at fixed times, counted from its start: of the state and x_c there, and of the time
   of the last switch before, with respect to the start's x_r, v_r, v_c and phase, and to the parameters. */
typedef struct {
    double state[4][CAPSULE_SLOPE_COUNT];
    double time[CAPSULE_SLOPE_COUNT];
} capsule_slopes;

/* Derivatives at the start of a run. */
capsule_stop capsule_slopes_start(capsule_slopes *at);

/* Propagates derivatives through the segments of a run in their order, from the start of the first to that of
   the last, in `at`. `switches` (may be null), a row for each segment but the last, receives the derivatives
   of their end times; `slopes` those of (x_r, v_r, v_c, x_c) at `n` ascending absolute times, as for
   `capsule_evaluate`, with the rate of change in the last column. After a tangential switch they are infinite
   or not a number; at two simultaneous switches they are those of the side that the run takes. Returns the
   number of segments passed: less than `count` if `watch` (may be null) stops it, or at an invalid field; 0 if
   refused. */
size_t capsule_differentiate(const capsule_map *map, const capsule_segment *segments, size_t count,
                             capsule_slopes *at, double (*switches)[CAPSULE_SLOPE_COUNT],
                             const double *times, size_t n,
                             double (*slopes)[4][CAPSULE_COLUMN_COUNT], capsule_watch *watch);

/* Requested results of an orbit besides its state, monodromy matrix and progression. */
typedef struct {
    capsule_segment *segments; /* receives the segments of one period of the motion, from angle 0 on */
    size_t room;               /* largest number of segments */
    int energies, forces, gradients; /* 1 if requested */
    capsule_watch *watch;            /* or null */
} capsule_orbit_request;

/* Solves for the periodic motion of so many excitation periods near a state (x_r, v_r, v_c) at forcing
   angle 0 by Newton's method, and computes its metrics. Returns CAPSULE_DONE with the outcome in
   `orbit->status`, or the reason for which its run ended early. CAPSULE_OPEN also means a segment so slow,
   compared with its flow, that its integrals or peaks would take too long. */
capsule_stop capsule_solve_orbit(const capsule_map *map, const double state[3], int periods,
                                 const capsule_orbit_request *request, capsule_orbit *orbit);

/* Adds to `energies` the drive's work, and the losses in damper and friction, in segments of a run. */
capsule_stop capsule_add_energies(const capsule_map *map, const capsule_segment *segments, size_t count,
                                  capsule_watch *watch, double energies[3]);

/* Itinerary of a periodic motion: fields, from 1 on, of its segments in cyclic order, over so many
   excitation periods. A single guard, or an edge of the drive, ends each segment; an edge may also end
   rest. Without pulses a single field is a sticking one. If `mirrored`, it is the itinerary of the first
   half of a motion that is its own mirror image, over an odd number of periods. The images of these
   segments are its second half. With one stop such a motion has no contact. */
typedef struct {
    const int32_t *fields;
    int count, periods, mirrored;
} capsule_itinerary;

#define CAPSULE_LONGEST 4096 /* most segments of an itinerary */

/* Unknowns of an itinerary of so many segments: state and forcing angle at the start of the first, and the
   durations; columns of derivatives with respect to these and to the parameters. */
#define CAPSULE_UNKNOWNS(count) (CAPSULE_STATE_COUNT + 1 + (count))
#define CAPSULE_COLUMNS(count) (CAPSULE_UNKNOWNS(count) + CAPSULE_PARAMETER_COUNT)

/* Equations of an itinerary at some unknowns, in arrays of the caller: each segment's guard at its end,
   divided by the duration once for each zero of the guard at the start (the forcing angle at the start of a
   segment that never ends); the state at the end less that at the start, or less its mirror image if
   mirrored; and the durations less the excitation periods, as angles. */
typedef struct {
    capsule_segment_flow *flows; /* of the segments */
    double *states_by;    /* of each start, and of the end: 3 rows of columns each; or null */
    double *residual;     /* of each equation */
    double *by;           /* a row of columns for each; or null */
    double *advance_by;   /* a row; or null */
    double *monodromy;    /* matrix over the itinerary, row by row */
    double *workspace;    /* CAPSULE_COLUMN_COUNT numbers for each segment, and 9 rows */
    double advance;       /* of x_c */
} capsule_system;

/* Number of doubles in these arrays together, without derivatives and with them. */
#define CAPSULE_EQUATIONS_ROOM(count)                                                              \
    ((count) * (sizeof(capsule_segment_flow) / sizeof(double) + CAPSULE_COLUMN_COUNT) +            \
     CAPSULE_UNKNOWNS(count) + CAPSULE_STATE_COUNT * CAPSULE_STATE_COUNT + 9 * CAPSULE_COLUMNS(count))
#define CAPSULE_SYSTEM_ROOM(count)                                                                 \
    (CAPSULE_EQUATIONS_ROOM(count) +                                                               \
     (((count) + 1) * CAPSULE_STATE_COUNT + CAPSULE_UNKNOWNS(count) + 1) * CAPSULE_COLUMNS(count))

/* Arrays for an itinerary of so many segments, laid out one after another in a block of that size. */
capsule_system capsule_equations_in(double *block, int count);
capsule_system capsule_system_in(double *block, int count);

/* Evaluates the equations of an itinerary at unknowns z. The residual is not a number if z or the
   parameters are infinite or not numbers, or if a duration is below -1/rate of its field's constants. */
capsule_stop capsule_evaluate_itinerary(const capsule_parameters *parameters,
                                        const capsule_itinerary *itinerary, const double *z,
                                        capsule_system *system);

/* Options for the solution of an itinerary's equations. */
typedef struct {
    double *workspace;       /* of CAPSULE_ITINERARY_ROOM(count) */
    const double *direction; /* or null: direction in which the parameters move, while an unknown is held */
    int held;                /* index of that unknown, from 0 */
    capsule_watch *watch;    /* or null */
} capsule_itinerary_request;
#define CAPSULE_ITINERARY_ROOM(count)                                                              \
    (2 * CAPSULE_EQUATIONS_ROOM(count) + 12 * CAPSULE_UNKNOWNS(count) + 215 * (count))

/* Solves the equations of an itinerary near z by damped Newton steps, for fixed parameters, or for
   parameters that move along a direction while one unknown is fixed: a segment of duration 0 is a
   bifurcation. `z`, `parameters` and `system` receive the last iterate, except the system if the watch
   stopped it. */
capsule_stop capsule_solve_itinerary(const capsule_itinerary *itinerary,
                                     const capsule_itinerary_request *request,
                                     capsule_parameters *parameters, double *z,
                                     capsule_system *system, capsule_solution *solution);

/* Finds all interior extrema of a quantity in a segment of a duration, in the order of time: the rate is
   proved to keep its sign between two of them. `zeros` is 1 if the rate vanishes at the start, as that of
   the speed does where a slip begins, else 0. Returns their number, or -1 if double precision cannot
   decide, if there are more than `room`, if it takes long, or if arguments are refused. */
int capsule_find_extrema(const capsule_constants *c, const capsule_start *start,
                       capsule_quantity quantity, int zeros, double duration,
                       capsule_extremum *extrema, int room);

/* Interaction force P at a state; not a number without constants. */
double capsule_force_at(const capsule_constants *c, double x_r, double gap, double v_r);

/* Digest of the generator's inputs from which the kernels were made. */
const char *capsule_digest(void);

#if defined(CAPSULE_EXPORTS) && defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
