/* The exact map of the capsule system in C99: segments chained switch by switch, each switch
   certified to be the first. No allocation, no global state, nothing but libm; every function is
   safe to call from several threads on data of their own.

   All quantities are dimensionless, named as in the paper (Guo & Liu, Physica D, 2019,
   doi 10.1016/j.physd.2019.04.008). A time is a number of whole excitation periods and a forcing
   angle in [0, 2 pi), so that no error grows with the number of periods.

   A pointer may be null only where that is said. What else is not allowed is refused, and nothing is
   computed: a capsule_stop is CAPSULE_REFUSED then, a number as is said. The caller owes what no
   function can check: arrays of the lengths that are given, segments that `capsule_run` wrote, maps
   that were made, memory that was zeroed where that is asked for. The closed forms of
   capsule_kernels.h check nothing. */
#ifndef CAPSULE_H
#define CAPSULE_H

#include <stddef.h>
#include <stdint.h>

#include "capsule_interface.h"
#include "capsule_kernels.h"

/* What is declared here, a shared library of it shows; nothing else. */
#if defined(CAPSULE_EXPORTS) && defined(__GNUC__)
#pragma GCC visibility push(default)
#endif

#define CAPSULE_TERMS 14 /* coefficients that a state is evaluated from */
#define CAPSULE_DEGREE 8 /* of the polynomials that bound a guard from below and above */
#define CAPSULE_REACH 1.4 /* length of an expansion, over the fastest rate of the segment */
#define CAPSULE_GROWTH 1.6 /* and at most, over the rate at which its terms grow without signs */

#define CAPSULE_LIMITS 8
#define CAPSULE_LEVELS 4 /* lengths of expansions side by side, each half of the one before */

/* Whether Q changes by the drive within a segment: Q - P is constant there where the drive is. */
#define CAPSULE_REACTION (CAPSULE_REACTS && !CAPSULE_PULSED)
#if CAPSULE_REACTION
#define CAPSULE_REACTION_OF(number, terms)                                                         \
    number reaction[2][terms]; /* of the drive in Q at rest, by its cosine and sine at the start */
#else
#define CAPSULE_REACTION_OF(number, terms)
#endif

/* What expansions of one linear flow have in common, for motions made of the responses to a unit
   force and a unit velocity, and, of a drive that is not constant, to its cosine and sine. The time unit is `reach`. */
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
    int may_rest;           /* whether the forcing alone leaves a capsule without contact at rest */
} capsule_map;

/* Stops work that takes long: at a limit of work, which no clock moves, or when `ask` says so. Both
   are looked at after every CAPSULE_WORK expansions or so, which take milliseconds. `ask`, or null, is
   called in the thread that works, and lets it go on by 0; once it has stopped it, it must do so again.
   To go on after the limit, raise it: by more than one segment takes, for a stopped segment begins
   anew, and one that rests for ever counts 1 for each row of `strobe`. Each thread has a watch of its
   own, whose `done` and `work` are 0 at first. */
typedef struct {
    int (*ask)(void *about);
    void *about;
    int64_t most; /* expansions in all, rounded up to CAPSULE_WORK; 0 for no limit */
    int64_t done; /* of them, when it was last looked at */
    int64_t work; /* since then */
} capsule_watch;

#define CAPSULE_WORK 8192

/* Looks at a watch; whether to stop. A null watch never says so. */
static inline int capsule_over(const capsule_watch *watch)
{
    return watch && ((watch->most && watch->done >= watch->most) ||
                     (watch->ask && watch->ask(watch->about)));
}

/* Counts work of about so many expansions, and looks at the watch now and then; whether to stop. */
static inline int capsule_asked(capsule_watch *watch, int64_t work)
{
    if (!watch || (watch->work += work) < CAPSULE_WORK)
        return 0;
    watch->done += watch->work;
    watch->work = 0;
    return capsule_over(watch);
}

/* What a run writes besides the final state; a null pointer is neither written nor paid for. */
typedef struct {
    double (*strobe)[3]; /* the state at the end of period k in row k, k = 1 .. periods */
    int64_t rows;        /* of strobe, if they are too few for that, else 0: row k % rows then;
                            at least 8192, and the run pauses when half of them are new */
    capsule_segment *segments;
    capsule_event *events;
    size_t room;   /* of segments or events; the run pauses when it is used up */
    int position;  /* whether x_c is followed */
    capsule_watch *watch; /* or null */
    int precision; /* a capsule_precision */
} capsule_request;

#define CAPSULE_PERIODS ((int64_t)1 << 53) /* that a run may have, at most */

/* The map at a parameter set. All are finite, those of CAPSULE_POSITIVE_PARAMETERS > 0, those of
   CAPSULE_NOT_NEGATIVE_PARAMETERS >= 0, those of CAPSULE_SHARE_PARAMETERS < 1, and there is room
   between two stops; otherwise it gives CAPSULE_REFUSED, and so does what runs on it. A map that was
   made before, or is zero, may be made anew; what does not change is kept. A share so near to 0 or 1 that
   a pulse or a pause is shorter than the rounding of an angle (1e-300, say) is taken, but runs that
   begin to slip there come back with CAPSULE_OPEN. */
capsule_stop capsule_map_make(const capsule_parameters *parameters, capsule_map *map);
capsule_stop capsule_map_remake(const capsule_parameters *parameters, capsule_map *map);

/* Only as much of a map as `capsule_state_at` needs; nothing may run on it. */
capsule_stop capsule_map_constants(const capsule_parameters *parameters, capsule_map *map);

/* A state off every surface but those it lies on exactly, at a time in [0, 2 pi/omega). Without a
   map its gap is not a number, and no run takes it on. */
capsule_state capsule_state_at(const capsule_map *map, double x_r, double v_r, double v_c,
                               double phase);

/* How many runs this processor takes side by side: 8 (AVX-512), 4 (AVX2) or 1. Their last bits
   differ. */
int capsule_lanes(void);

/* How many it may be asked to take: more than those only in a build for tests of all widths. */
int capsule_widest(void);

/* Goes on from `state` until the end of excitation period `periods` (forcing angle 0), and leaves
   in `state` where it came to, rounded to double precision: what 106 bits knew of a switch is kept
   within a call only, and a run that pauses goes on from a start off by a rounding, as one in double
   precision does after each switch. `written` counts segments or events; `open` tells, where the run
   stops at CAPSULE_OPEN, what stayed open; the state is then the start of that segment. */
capsule_stop capsule_run(const capsule_map *map, capsule_state *state, int64_t periods,
                         const capsule_request *request, size_t *written, capsule_outcome *open);

/* Many runs, side by side. */
typedef struct {
    size_t stride; /* at least 1; every so many rows is one: threads share them out like cards */
    const capsule_parameters *parameters; /* of each run */
    capsule_state *states;                /* where each starts, and where it came to */
    int8_t *stops;                        /* why each came back, a capsule_stop */
    double (*strobe)[3];                  /* periods + 1 rows a run, or null; as in a request */
    int position;                         /* whether x_c is followed */
    capsule_watch *watch;                 /* or null; runs that it stops can go on, too */
    int lanes;                            /* 8, 4 or 1; 0 for as many as the processor has */
    int precision;                        /* a capsule_precision, of what runs alone */
    capsule_event *first; /* or null: receives each run's first switch, where the run pauses with
                             CAPSULE_FULL; of its state `plane` is 0 if lanes found it */
} capsule_batch;

#define CAPSULE_BATCH_SIZE 128  /* runs in hand at a time */
#define CAPSULE_RUN_NUMBERS                                                                        \
    ((16 + CAPSULE_STOP_COUNT - CAPSULE_PULSED + CAPSULE_RUN_PARAMETER_COUNT + 3) / 4 * 4)

/* Workspace of `capsule_run_many`, some 100 kB: zero before the first call; the tables of the last
   flows are kept for the next. */
typedef struct {
    capsule_map map;
    struct {
        double number[CAPSULE_RUN_NUMBERS], begun[CAPSULE_RUN_NUMBERS]; /* now; at its start */
        double guess[CAPSULE_FIELD_COUNT][5]; /* by field, and how many expansions came before */
        size_t row;
        int64_t period, begun_period;
        int field, key, expansions; /* of the present segment; the key of its guess */
    } run[CAPSULE_BATCH_SIZE];
    int16_t queue[CAPSULE_FLOW_COUNT * (CAPSULE_LEVELS + 1)][CAPSULE_BATCH_SIZE], idle[CAPSULE_BATCH_SIZE];
    int waiting[CAPSULE_FLOW_COUNT * (CAPSULE_LEVELS + 1)], idle_count;
} capsule_workspace;

/* Takes the runs among `count` rows to the end of period `periods`, as `capsule_run` does one;
   fastest where neighbouring runs share CAPSULE_FLOW_PARAMETERS. CAPSULE_DONE says that each run has
   its stop. */
capsule_stop capsule_run_many(const capsule_batch *batch, size_t count, int64_t periods, capsule_workspace *workspace);

/* Finds the periodic motion that a run is in at the end of a period, from its states at the ends
   of the last `count` periods: the least period number, of at most count/2 periods, after which the
   last of them repeat within `tolerance`, and the next switches exactly in field and plane.
   `events` holds those of one period of the motion, from the end of the run on; there must be
   room for those of two. No period number is found of a motion that dies away through ever more switches,
   as off rest at alpha = delta = 0. CAPSULE_FULL says that there is not, CAPSULE_OPEN that a switch stayed
   open on the way. `watch` may be null. */
capsule_stop capsule_steady(const capsule_map *map, const capsule_state *state,
                            double (*states)[3], int count, double tolerance,
                            capsule_event *events, size_t room, capsule_watch *watch,
                            capsule_motion *motion, capsule_outcome *open);

/* The states (x_r, v_r, v_c, x_c) of a run at times, from its segments in their order. Times are
   absolute, 2 pi/omega for each period plus the angle over omega; a time before the one it follows
   costs a step for each segment between. Before the first segment and after the last the state is
   that of its start or end; with `more` to follow, a time from the last one's end on ends it all.
   Returns for how many times there is a state now: less than n also where `watch`, which may be
   null, stops it, and at a field that there is not; 0 where it is refused. */
size_t capsule_evaluate(const capsule_map *map, const capsule_segment *segments, size_t count,
                        int more, const double *times, size_t n, double (*states)[4],
                        capsule_watch *watch);

/* Derivatives of a run at times that stay, counted from its start: of the state and x_c there, and
   of the time of the last switch before, by the start's x_r, v_r, v_c and phase of the forcing, and
   by the parameters. */
typedef struct {
    double state[4][CAPSULE_SLOPE_COUNT];
    double time[CAPSULE_SLOPE_COUNT];
} capsule_slopes;

/* The derivatives where a run begins. */
capsule_stop capsule_slopes_start(capsule_slopes *at);

/* Carries derivatives through the segments of a run in their order, from the start of the first to
   that of the last, and leaves them in `at`. `switches`, a row for each segment but the last, or
   null, receives the derivatives of their ends' times; `slopes` those of (x_r, v_r, v_c, x_c) at `n`
   times in ascending order, each with the rate of change at last. Where a switch is tangential they
   are infinite or not a number from then on; where two happen at once they are those of the side that
   the run takes. Returns how many segments were passed: less than `count` where `watch`, which may be null, stops it, and at a field
   that there is not; 0 where it is refused. */
size_t capsule_differentiate(const capsule_map *map, const capsule_segment *segments, size_t count,
                             capsule_slopes *at, double (*switches)[CAPSULE_SLOPE_COUNT],
                             const double *times, size_t n,
                             double (*slopes)[4][CAPSULE_COLUMN_COUNT], capsule_watch *watch);

/* What is computed of an orbit besides its state, monodromy matrix and progression. */
typedef struct {
    capsule_segment *segments; /* receives those of one period of the motion, from angle 0 on */
    size_t room;               /* of them */
    int energies, forces, gradients; /* whether these are asked for */
    capsule_watch *watch;            /* or null */
} capsule_orbit_request;

/* Closes the periodic motion of so many excitation periods near a state (x_r, v_r, v_c) at forcing
   angle 0 by Newton's method, and computes its metrics. Returns CAPSULE_DONE with what became of it in
   `orbit->status`, or why its run came back; CAPSULE_OPEN also at a segment that is very slow beside
   its flow, so that its integrals or peaks would take too long. */
capsule_stop capsule_solve_orbit(const capsule_map *map, const double state[3], int periods,
                                 const capsule_orbit_request *request, capsule_orbit *orbit);

/* Adds to `energies` the drive's work, the damper's and the friction's loss in segments of a run. */
capsule_stop capsule_add_energies(const capsule_map *map, const capsule_segment *segments, size_t count,
                                  capsule_watch *watch, double energies[3]);

/* The itinerary of a periodic motion: the fields, from 1 on, of its segments in cyclic order, over so many
   excitation periods. One guard alone takes each field over to the next, or an edge of the drive, which may
   end rest too; without pulses a single field is a sticking one. If `mirrored`, it is that of the first half
   of a motion that is its own mirror image, over an odd number of periods, and with one stop without
   contact: the images of the segments follow. */
typedef struct {
    const int32_t *fields;
    int count, periods, mirrored;
} capsule_itinerary;

#define CAPSULE_LONGEST 4096 /* segments of an itinerary that is solved */

/* Unknowns of an itinerary of so many segments: state and forcing angle where the first begins, and the
   segments' durations; columns of derivatives by these and by the parameters. */
#define CAPSULE_UNKNOWNS(count) (CAPSULE_STATE_COUNT + 1 + (count))
#define CAPSULE_COLUMNS(count) (CAPSULE_UNKNOWNS(count) + CAPSULE_PARAMETER_COUNT)

/* The equations of an itinerary at some unknowns, in arrays of the caller. They are each segment's guard
   at its end, divided by the duration as often as the guard vanishes at the start already; the state at
   the end less that at the start; and the durations less the excitation periods, as angles. */
typedef struct {
    capsule_segment_flow *flows; /* of the segments */
    double *states_by;    /* where each begins, and the end: 3 rows of columns each; or null */
    double *residual;     /* of each equation */
    double *by;           /* a row of columns for each; or null */
    double *advance_by;   /* a row; or null */
    double *monodromy;    /* matrix over the itinerary, row by row */
    double *workspace;    /* CAPSULE_COLUMN_COUNT numbers for each segment, and 9 rows */
    double advance;       /* of x_c */
} capsule_system;

/* How many doubles these arrays take together, without derivatives and with them. */
#define CAPSULE_EQUATIONS_ROOM(count)                                                              \
    ((count) * (sizeof(capsule_segment_flow) / sizeof(double) + CAPSULE_COLUMN_COUNT) +            \
     CAPSULE_UNKNOWNS(count) + CAPSULE_STATE_COUNT * CAPSULE_STATE_COUNT + 9 * CAPSULE_COLUMNS(count))
#define CAPSULE_SYSTEM_ROOM(count)                                                                 \
    (CAPSULE_EQUATIONS_ROOM(count) +                                                               \
     (((count) + 1) * CAPSULE_STATE_COUNT + CAPSULE_UNKNOWNS(count) + 1) * CAPSULE_COLUMNS(count))

/* The arrays for an itinerary of so many segments, laid out one after another in a block of that room. */
capsule_system capsule_equations_in(double *block, int count);
capsule_system capsule_system_in(double *block, int count);

/* Evaluates the equations of an itinerary at unknowns z. The residual is not a number where z or the
   parameters are not, or are infinite, and where a duration is below -1/rate of its field's constants. */
capsule_stop capsule_evaluate_itinerary(const capsule_parameters *parameters,
                                        const capsule_itinerary *itinerary, const double *z,
                                        capsule_system *system);

/* The monodromy matrix over the segments from `first` on, all round. */
capsule_stop capsule_monodromy(const capsule_parameters *parameters, const capsule_itinerary *itinerary,
                               const capsule_segment_flow *flows, int first, double *monodromy);

/* How an itinerary is to be solved. */
typedef struct {
    double *workspace;       /* of CAPSULE_ITINERARY_ROOM(count) */
    const double *direction; /* or null: how the parameters move, in place of the unknown that is held */
    int held;                /* that unknown, from 0 */
    capsule_watch *watch;    /* or null */
} capsule_itinerary_request;
#define CAPSULE_ITINERARY_ROOM(count)                                                              \
    (2 * CAPSULE_EQUATIONS_ROOM(count) + 12 * CAPSULE_UNKNOWNS(count) + 215 * (count))

/* Solves the equations of an itinerary near z by damped steps of Newton's method, for parameters that
   stay, or that move along a direction while an unknown keeps its value: a segment of duration 0 is
   a bifurcation. `z`, `parameters` and `system` receive where the search ended, but for the system where
   the watch stopped it. */
capsule_stop capsule_solve_itinerary(const capsule_itinerary *itinerary,
                                     const capsule_itinerary_request *request,
                                     capsule_parameters *parameters, double *z,
                                     capsule_system *system, capsule_solution *solution);

/* An interior extremum: 1 for a minimum, -1 for a maximum; how long after the start; its value. */
typedef struct {
    int kind;
    double time, value;
} capsule_extremum;

/* Finds all interior extrema of a quantity in a segment of a duration, in the order of time: between
   two of them its rate is proved to keep its sign. The first `zeros` derivatives of the rate, itself
   included, vanish at the start: 0, or 1 of the speed where a slip begins. Returns how many there
   are, -1 where double precision leaves that open, there are more than `room`, it takes long, or it is
   refused. */
int capsule_find_extrema(const capsule_constants *c, const capsule_start *start,
                       capsule_quantity quantity, int zeros, double duration,
                       capsule_extremum *extrema, int room);

/* The interaction force P at a state; not a number without constants. */
double capsule_force_at(const capsule_constants *c, double x_r, double gap, double v_r);

/* Digest of the generator's inputs that the kernels were made from. */
const char *capsule_digest(void);

#if defined(CAPSULE_EXPORTS) && defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
