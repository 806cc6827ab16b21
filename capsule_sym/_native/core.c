/* The table of a scene's core: the functions of capsule.h with memory in place of the scene's structs, and
   loops over rows. */
#include "capsule_core.h"

#include <math.h>
#include <string.h>

#include "internal.h"

enum { MAP_WORK = 32 }; /* work of making a map, in expansions */

#define NUMBERS(pointer) ((const capsule_parameters *)(pointer))

static void make(const double *parameters, void *map, char how)
{
    (how == 'm' ? capsule_map_make : how == 'r' ? capsule_map_remake : capsule_map_constants)(
        NUMBERS(parameters), map);
}

#define FIELD_OF(map, number) (&((const capsule_map *)(map))->field[(number) - 1])

#if CAPSULE_PULSED
#define RESONANCE(of)
#else
#define RESONANCE(of) of(Z2) of(resonant)
#endif
#define CONSTANTS(of)                                                                              \
    CAPSULE_SEGMENT_CONSTANTS(of) of(q) of(nu) of(slow) RESONANCE(of) of(fast) of(rate)
#define COUNTED(name) +1

static void constants_of(const void *map, int field, double *constants)
{
    const capsule_constants *const c = FIELD_OF(map, field);
#define WRITTEN(name) *constants++ = c->name;
    CONSTANTS(WRITTEN)
}

static void closed_form(const void *map, int field, const double *start, double h, double *values, double *rows)
{
    const capsule_constants *const c = FIELD_OF(map, field);
    const capsule_start *const at = (const capsule_start *)start;
    values[2] = values[3] = 0.0;
    capsule_flow(c, at, h, values);
    if (c->drift != 0.0)
        values[3] = capsule_flow_advance(c, at, values[0], h);
    capsule_jacobian(c, at, h, rows);
}

static int extrema(const void *map, int field, const double *start, int quantity, int zeros,
                   double duration, capsule_extremum *found, int room)
{
    return capsule_find_extrema(FIELD_OF(map, field), (const capsule_start *)start,
                                (capsule_quantity)quantity, zeros, duration, found, room);
}

static void rooms(int count, size_t room[3])
{
    room[0] = CAPSULE_EQUATIONS_ROOM((size_t)count);
    room[1] = CAPSULE_SYSTEM_ROOM((size_t)count);
    room[2] = CAPSULE_ITINERARY_ROOM((size_t)count);
}

static int evaluate_itinerary(const void *map, const int32_t *fields, int count, int periods,
                              int mirrored, const double *z, double *block, double *advance)
{
    const capsule_itinerary itinerary = {fields, count, periods, mirrored};
    capsule_system system = capsule_system_in(block, count);
    const capsule_stop stop = capsule_evaluate_itinerary(&((const capsule_map *)map)->parameters,
                                                         &itinerary, z, &system);
    *advance = system.advance;
    return stop;
}

static int solve_itinerary(const int32_t *fields, int count, int periods, int mirrored,
                           const double *direction, int held, double *parameters, double *z,
                           double *workspace, double *block, double *advance, void *solution,
                           capsule_watch *watch)
{
    const capsule_itinerary itinerary = {fields, count, periods, mirrored};
    const capsule_itinerary_request request = {workspace, direction, held, watch};
    capsule_system system = capsule_system_in(block, count);
    const capsule_stop stop = capsule_solve_itinerary(
        &itinerary, &request, (capsule_parameters *)parameters, z, &system, solution);
    *advance = system.advance;
    return stop;
}

static void state_at(const void *map, const double start[4], void *state)
{
    *(capsule_state *)state = capsule_state_at(map, start[0], start[1], start[2], start[3]);
}

static int end_of_run(const void *map, const double start[4], int64_t periods, int precision,
                      double (*strobe)[3], void *segments, size_t room, capsule_ended *end,
                      capsule_watch *watch)
{
    const capsule_segment *const piece = segments;
    const capsule_request request = {.strobe = strobe, .segments = segments, .room = room, .precision = precision,
                                     .watch = watch};
    capsule_state state = capsule_state_at(map, start[0], start[1], start[2], start[3]);
    capsule_stop stop;
    memset(end, 0, sizeof *end);
    do {
        size_t written = 0;
        capsule_outcome open;
        stop = capsule_run(map, &state, periods, &request, &written, &open);
        end->segments += (int64_t)written;
        for (size_t i = 0; i < written; i++) {
            end->evaluations += piece[i].evaluations;
            end->wide += piece[i].wide;
        }
    } while (stop == CAPSULE_FULL && !strobe);
    end->state[0] = state.x_r, end->state[1] = state.v_r, end->state[2] = state.v_c;
    end->position = state.position, end->angle = state.angle, end->period = state.period;
    return stop;
}

static int run(const void *map, void *state, int64_t periods, double (*strobe)[3], int64_t rows,
               void *segments, size_t room, int position, int precision, size_t *written, int *open,
               capsule_watch *watch)
{
    const capsule_request request = {.strobe = strobe, .rows = rows, .segments = segments,
                                     .room = room, .position = position, .watch = watch,
                                     .precision = precision};
    capsule_outcome undecided = 0;
    const capsule_stop stop = capsule_run(map, state, periods, &request, written, &undecided);
    *open = undecided;
    return stop;
}

static size_t evaluate(const void *map, const void *segments, size_t count, int more,
                       const double *times, size_t n, double (*states)[4], capsule_watch *watch)
{
    return capsule_evaluate(map, segments, count, more, times, n, states, watch);
}

static size_t differentiate(const void *map, const void *segments, size_t count, double *switches,
                            const double *times, size_t n, double *slopes, capsule_watch *watch)
{
    capsule_slopes at;
    capsule_slopes_start(&at);
    return capsule_differentiate(map, segments, count, &at, (double (*)[CAPSULE_SLOPE_COUNT])switches,
                                 times, n, (double (*)[4][CAPSULE_COLUMN_COUNT])slopes, watch);
}

/* True if the rest of the rows is left: a watch that has stopped the work is not read again. */
static int over(capsule_watch *watch, int *stopped)
{
    return *stopped = *stopped || capsule_asked(watch, MAP_WORK);
}

/* True if a row is left: its stop is not CAPSULE_DONE, or becomes CAPSULE_STOPPED. */
static int passed_over(int8_t *stop, capsule_watch *watch, int *stopped)
{
    if (*stop == CAPSULE_DONE && over(watch, stopped))
        *stop = CAPSULE_STOPPED;
    return *stop != CAPSULE_DONE;
}

static void start_many(const double *parameters, const double (*starts)[3], const double *phases,
                       void *states, size_t count, void *map, capsule_watch *watch)
{
    capsule_state *const records = states;
    int stopped = 0;
    for (size_t i = 0; i < count; i++) {
        if (over(watch, &stopped)) {
            memset(&records[i], 0, sizeof(capsule_state));
            records[i].x_r = starts[i][0], records[i].v_r = starts[i][1];
            records[i].v_c = starts[i][2], records[i].gap = NAN;
            continue;
        }
        capsule_map_constants(NUMBERS(parameters) + i, map);
        records[i] = capsule_state_at(map, starts[i][0], starts[i][1], starts[i][2], phases[i]);
    }
}

static void run_many(const double *parameters, void *states, int8_t *stops, double (*strobe)[3],
                     void *first, size_t stride, int position, int lanes, int precision, size_t count,
                     int64_t periods, void *workspace, capsule_watch *watch)
{
    const capsule_batch batch = {stride, NUMBERS(parameters), states, stops, strobe, position,
                                 watch, lanes, precision, first};
    capsule_run_many(&batch, count, periods, workspace);
}

static void steady_many(const double *parameters, const void *states, double (*strobe)[3], int periods,
                        double tolerance, int8_t *stops, void *motions, uint8_t *switches,
                        size_t room, void *events, size_t count, void *map, capsule_watch *watch)
{
    const capsule_state *const records = states;
    const capsule_event *const passed = events;
    capsule_motion *const found = motions;
    int stopped = 0;
    capsule_outcome open;
    for (size_t i = 0; i < count; i++) {
        if (passed_over(&stops[i], watch, &stopped))
            continue;
        capsule_map_remake(NUMBERS(parameters) + i, map);
        stops[i] = (int8_t)capsule_steady(map, &records[i], strobe + i * ((size_t)periods + 1) + 1,
                                          periods, tolerance, events, room, watch, &found[i], &open);
        for (int k = 0; k < found[i].switches; k++)
            switches[i * room + (size_t)k] = (uint8_t)passed[k].field;
        stopped |= stops[i] == CAPSULE_STOPPED;
    }
}

static void orbit_many(const double *parameters, const double (*states)[3],
                       const int32_t *period_numbers, int8_t *stops, void *orbits, uint8_t *fields,
                       size_t kept, int results, void *segments, size_t room, size_t count, void *map,
                       capsule_watch *watch)
{
    const capsule_segment *const passed = segments;
    const capsule_orbit_request request = {segments, room, results & 1, results >> 1 & 1, results >> 2 & 1, watch};
    capsule_orbit *const found = orbits;
    int stopped = 0;
    for (size_t i = 0; i < count; i++) {
        if (passed_over(&stops[i], watch, &stopped))
            continue;
        capsule_map_remake(NUMBERS(parameters) + i, map);
        stops[i] = (int8_t)capsule_solve_orbit(map, states[i], period_numbers[i], &request, &found[i]);
        for (size_t k = 0; k < kept; k++)
            fields[i * kept + k] =
                (uint8_t)((int64_t)k < found[i].segments ? passed[k].field : 0);
        stopped |= stops[i] == CAPSULE_STOPPED;
    }
}

static const size_t PARAMETERS[] = CAPSULE_PARAMETERS_LAYOUT, STATE[] = CAPSULE_STATE_LAYOUT,
                    SEGMENT[] = CAPSULE_SEGMENT_LAYOUT, EVENT[] = CAPSULE_EVENT_LAYOUT,
                    MOTION[] = CAPSULE_MOTION_LAYOUT, ORBIT[] = CAPSULE_ORBIT_LAYOUT,
                    SOLUTION[] = CAPSULE_SOLUTION_LAYOUT, FLOW[] = CAPSULE_SEGMENT_FLOW_LAYOUT;

const capsule_core_table *capsule_core(void)
{
    static const capsule_core_table table = {
        CAPSULE_CORE_VERSION, CAPSULE_DIGEST,
        CAPSULE_PARAMETER_COUNT, CAPSULE_FIELD_COUNT, CAPSULE_COLUMN_COUNT, CAPSULE_SLOPE_COUNT,
        CONSTANTS(COUNTED),
        sizeof(capsule_map), sizeof(capsule_workspace), sizeof(capsule_segment), sizeof(capsule_event),
        {PARAMETERS, STATE, SEGMENT, EVENT, MOTION, ORBIT, SOLUTION, FLOW},
        capsule_lanes, capsule_widest, make, constants_of, closed_form, extrema, rooms,
        evaluate_itinerary, solve_itinerary, state_at, end_of_run, run, evaluate, differentiate,
        start_many, run_many, steady_many, orbit_many,
    };
    return &table;
}
