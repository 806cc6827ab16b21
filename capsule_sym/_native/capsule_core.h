/* The core of a scene as a table of functions, for a program of any scene: Python's binding. A program
   for one scene includes capsule.h, which describes the functions.

   A shared library of a scene exports `capsule_core`. Structs of the scene are memory of the sizes in the
   table. A `start` of a closed form is x_r, gap, v_r, v_c, margin, cosine and sine. */
#ifndef CAPSULE_CORE_H
#define CAPSULE_CORE_H

#include <stddef.h>
#include <stdint.h>

/* Stops long work, at a limit of work (which is independent of clocks) or on request of `ask`. Both are
   checked after about every CAPSULE_WORK expansions, which take milliseconds. `ask` (may be null) is
   called in the working thread and returns 0 to continue. After another number it must not return 0 until
   the call has ended. To resume after the limit, raise it by more than one segment takes, since a stopped
   segment starts again. A segment that rests up to the end counts 1 for each row of `strobe`. Each thread has
   its own watch, whose `done` and `work` are 0 at first. */
typedef struct {
    int (*ask)(void *about);
    void *about;
    int64_t most; /* expansions in all, rounded up to CAPSULE_WORK; 0 for no limit */
    int64_t done; /* of them, at the last check */
    int64_t work; /* since then */
} capsule_watch;

/* An interior extremum: 1 for a minimum, -1 for a maximum; its time after the start; its value. */
typedef struct {
    int kind;
    double time, value;
} capsule_extremum;

/* End of a run of which nothing else is kept. */
typedef struct {
    double state[3], position, angle; /* x_r, v_r, v_c; x_c */
    int64_t period;
    int64_t segments, evaluations, wide; /* their numbers; segments decided in 106 bits */
} capsule_ended;

#define CAPSULE_CORE_VERSION 1 /* of the table */

typedef struct {
    int version; /* comes first in every version */
    const char *digest; /* of the generator's inputs from which the kernels were made */
    int parameters, fields, columns, slopes, constants; /* counts */
    size_t map, workspace, segment, event; /* sizes of memory */
    /* Offsets of the fields and the size of capsule_parameters, capsule_state, capsule_segment,
       capsule_event, capsule_motion, capsule_orbit, capsule_solution and capsule_segment_flow. */
    const size_t *layouts[8];

    int (*lanes)(void);
    int (*widest)(void);
    /* A map: from nothing, from one made before or zeroed memory, or its constants alone. */
    void (*make)(const double *parameters, void *map, char how); /* 'm', 'r' or 'c' */

    /* Constants of a field, in the order of the kernels' own. */
    void (*constants_of)(const void *map, int field, double *constants);
    /* The changes of x_r and v_c, v_r, and x_c's advance, in the order (x_r, v_r, v_c, x_c), and a row of
       derivatives for each; at rest the last two values are 0, and the last two rows are not written. */
    void (*closed_form)(const void *map, int field, const double *start, double h, double *values, double *rows);
    int (*extrema)(const void *map, int field, const double *start, int quantity, int zeros,
                   double duration, capsule_extremum *found, int room);

    /* Numbers of a block for the system of an itinerary: of its equations, of the whole with its
       derivatives, and of the workspace of a solution. */
    void (*rooms)(int count, size_t room[3]);
    /* The system lies in `block`: segments, residual, monodromy; behind the equations' numbers the
       derivatives of states, of the residual, of the advance. */
    int (*evaluate_itinerary)(const void *map, const int32_t *fields, int count, int periods,
                              int mirrored, const double *z, double *block, double *advance);
    int (*solve_itinerary)(const int32_t *fields, int count, int periods, int mirrored,
                           const double *direction, int held, double *parameters, double *z,
                           double *workspace, double *block, double *advance, void *solution,
                           capsule_watch *watch);

    void (*state_at)(const void *map, const double start[4], void *state);
    /* Runs to the end of period `periods` in pieces of `room` segments, which are counted. With `strobe`,
       of periods + 1 rows, there is one piece, which is kept. */
    int (*end_of_run)(const void *map, const double start[4], int64_t periods, int precision,
                      double (*strobe)[3], void *segments, size_t room, capsule_ended *end,
                      capsule_watch *watch);
    int (*run)(const void *map, void *state, int64_t periods, double (*strobe)[3], int64_t rows,
               void *segments, size_t room, int position, int precision, size_t *written, int *open,
               capsule_watch *watch);
    size_t (*evaluate)(const void *map, const void *segments, size_t count, int more,
                       const double *times, size_t n, double (*states)[4], capsule_watch *watch);
    size_t (*differentiate)(const void *map, const void *segments, size_t count, double *switches,
                            const double *times, size_t n, double *slopes, capsule_watch *watch);

    /* The following take arrays with a row for each of `count` runs. */
    void (*start_many)(const double *parameters, const double (*starts)[3], const double *phases,
                       void *states, size_t count, void *map, capsule_watch *watch);
    void (*run_many)(const double *parameters, void *states, int8_t *stops, double (*strobe)[3],
                     void *first, size_t stride, int position, int lanes, int precision, size_t count,
                     int64_t periods, void *workspace, capsule_watch *watch);
    void (*steady_many)(const double *parameters, const void *states, double (*strobe)[3],
                        int periods, double tolerance, int8_t *stops, void *motions,
                        uint8_t *switches, size_t room, void *events, size_t count, void *map,
                        capsule_watch *watch);
    /* `results` is the sum of 1 for energies, 2 for forces and 4 for gradients. */
    void (*orbit_many)(const double *parameters, const double (*states)[3],
                       const int32_t *period_numbers, int8_t *stops, void *orbits, uint8_t *fields,
                       size_t kept, int results, void *segments, size_t room, size_t count, void *map,
                       capsule_watch *watch);
} capsule_core_table;

/* Table of the scene for which the library was compiled. */
#if defined(_WIN32) && defined(CAPSULE_EXPORTS)
__declspec(dllexport)
#elif defined(__GNUC__)
__attribute__((visibility("default")))
#endif
const capsule_core_table *capsule_core(void);

#endif
