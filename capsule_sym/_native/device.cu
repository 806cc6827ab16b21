/* Many runs on a graphics card, a thread for each: the scalar step of one run, compiled as CUDA C++ by NVRTC
   where it runs. A run that double precision does not decide, or whose segment takes very many expansions, is
   handed back at the start of that segment. Fused multiply-adds are those of number.h: the compiler makes no
   others (--fmad=false). With TABLES it is the code that makes tables, which has none, as in the core: so runs
   have the bits of a core with fused multiply-adds. With ORBITS it is the code of the motions at their ends. */
#define CAPSULE_DEVICE 1
#ifndef TABLES
#define FUSED 1
#endif
#ifndef MOST_EXPANSIONS
#define MOST_EXPANSIONS 256 /* of a segment: one that takes more would hold up its neighbours */
#endif
#ifndef RESIDENT
#define RESIDENT 2 /* blocks of a multiprocessor, by which the compiler limits registers */
#endif

#define response kernels_response /* a type there, a function of the tables */
#include "capsule_kernels.c"
#undef response
#undef TERMS
#include "tables.c"
#include "scalar.h"
#include "evaluate.h"
#include "run.c"

/* Number of the present run. */
static int64_t present(void)
{
    return (int64_t)blockIdx.x * BLOCK + threadIdx.x;
}

/* Tables of a run. A block has those of its first run in shared memory; a run of another flow reads its own. */
static capsule_table *tables_here(const int32_t *flow, capsule_table *tables, int64_t count)
{
    __shared__ capsule_table shared[CAPSULE_FLOW_COUNT];
    const int64_t i = present(), first = i - threadIdx.x;
    if (threadIdx.x == 0)
        memcpy(shared, tables + (int64_t)flow[first] * CAPSULE_FLOW_COUNT, sizeof shared);
    __syncthreads();
    return i >= count || flow[i] == flow[first] ? shared : tables + (int64_t)flow[i] * CAPSULE_FLOW_COUNT;
}

#ifdef TABLES
/* Tables of sets of flow parameters, a thread for each. */
extern "C" __global__ void capsule_tables(const capsule_parameters *sets, capsule_table *tables, int64_t count)
{
    const int64_t i = present();
    if (i >= count)
        return;
    capsule_map map;
    map.table = tables + i * CAPSULE_FLOW_COUNT;
    capsule_map_make(&sets[i], &map);
}
#elif defined(ORBITS)
#include "sensitivities.c"
namespace orbits { /* of names that steps have too */
#include "orbit.h"
#include "steady.c"
#include "linear.c"
#include "extrema.c"
#include "metrics.c"
#include "orbit.c"
}

/* A watch that ends a run's work after so many expansions. */
static capsule_watch watch_of(int64_t most)
{
    capsule_watch watch;
    memset(&watch, 0, sizeof watch);
    watch.most = most;
    return watch;
}

/* Periodic motions at the ends of runs, by the states at the ends of their last periods; see capsule_steady.
   `switches` receives the fields before the switches of a period. A motion that takes `most` expansions, or more
   room than there is, is left to the core, as one that is not decided. */
extern "C" __global__ void __launch_bounds__(BLOCK, RESIDENT)
capsule_motions(const capsule_parameters *rows, const int32_t *flow, capsule_table *tables,
                const capsule_state *states, double (*strobe)[3], int64_t last, double tolerance,
                capsule_event *events, int64_t room, int64_t most, int8_t *stops, capsule_motion *motions,
                uint8_t *switches, int64_t count)
{
    const int64_t i = present();
    capsule_map map;
    map.table = tables_here(flow, tables, count);
    if (i >= count)
        return;
    capsule_map_constants(&rows[i], &map);
    capsule_watch watch = watch_of(most);
    capsule_outcome open;
    events += i * room;
    stops[i] = (int8_t)orbits::capsule_steady(&map, &states[i], strobe + i * (last + 1) + 1, (int)last,
                                              tolerance, events, (size_t)room, &watch, &motions[i], &open);
    for (int k = 0; k < motions[i].switches && k < room; k++)
        switches[i * room + k] = (uint8_t)events[k].field;
}

/* Periodic motions near states, and their metrics; see capsule_solve_orbit. `fields` receives those of the
   segments. Gradients are left to the core. */
extern "C" __global__ void __launch_bounds__(BLOCK, RESIDENT)
capsule_orbits(const capsule_parameters *rows, const int32_t *flow, capsule_table *tables,
               const double (*states)[3], const int32_t *periods, int8_t energies, int8_t forces,
               capsule_segment *segments, int64_t room, int64_t most, int8_t *stops, capsule_orbit *found,
               uint8_t *fields, int64_t count)
{
    const int64_t i = present();
    capsule_map map;
    map.table = tables_here(flow, tables, count);
    if (i >= count)
        return;
    capsule_map_constants(&rows[i], &map);
    capsule_watch watch = watch_of(most);
    segments += i * room;
    const capsule_orbit_request request = {.segments = segments, .room = (size_t)room, .energies = energies,
                                           .forces = forces, .watch = &watch};
    stops[i] = (int8_t)orbits::capsule_solve_orbit(&map, states[i], periods[i], &request, &found[i]);
    for (int k = 0; k < found[i].segments && k < room; k++)
        fields[i * room + k] = (uint8_t)segments[k].field;
}
#else
/* Bytes of a run's context, and of the tables of a set of flow parameters. */
extern "C" __global__ void capsule_sizes(int64_t *sizes)
{
    sizes[0] = sizeof(capsule_context);
    sizes[1] = CAPSULE_FLOW_COUNT * sizeof(capsule_table);
}

/* States at the starts (x_r, v_r, v_c, phase) of runs. */
extern "C" __global__ void capsule_starts(const capsule_parameters *rows, const double (*starts)[4],
                                          capsule_state *states, int64_t count)
{
    const int64_t i = present();
    if (i >= count)
        return;
    capsule_map map;
    map.table = NULL;
    capsule_map_constants(&rows[i], &map);
    states[i] = capsule_state_at(&map, starts[i][0], starts[i][1], starts[i][2], starts[i][3]);
}

/* Advances runs to the end of a period, those whose stop is CAPSULE_STOPPED, by `most` expansions or a
   segment more. `contexts` keep what runs carry from switch to switch, so that a launch may end after any of
   them without a trace; with `begins` they are made. */
extern "C" __global__ void __launch_bounds__(BLOCK, RESIDENT)
capsule_runs(const capsule_parameters *rows, const int32_t *flow, capsule_table *tables,
             capsule_state *states, capsule_context *contexts, int8_t *stops, double (*strobe)[3],
             int64_t periods, int32_t position, int32_t begins, int64_t most, int64_t count)
{
    const int64_t i = present();
    capsule_map map;
    map.table = tables_here(flow, tables, count);
    if (i >= count || stops[i] != CAPSULE_STOPPED)
        return;
    capsule_map_constants(&rows[i], &map);
    capsule_request request;
    memset(&request, 0, sizeof request);
    request.strobe = strobe ? strobe + i * (periods + 1) : NULL;
    capsule_context context;
    if (begins) {
        memset(&context, 0, sizeof context);
        context.angle = -1.0;
    } else {
        context = contexts[i];
    }
    context.map = &map, context.request = &request;
    context.periods = periods, context.position = position;
    capsule_state state = states[i];
    int stop = state.period < periods ? CAPSULE_STOPPED : CAPSULE_DONE;
    if (!capsule_allowed(&map, &state))
        stop = CAPSULE_REFUSED;
    for (int64_t done = 0; stop == CAPSULE_STOPPED && done < most;) {
        const capsule_state before = state;
        capsule_result p;
        run_segment(&context, &state, &p);
        done += 1 + p.evaluations;
        if (p.outcome != CAPSULE_REGULAR && p.outcome != CAPSULE_END && p.outcome != CAPSULE_NEVER) {
            state = before;
            stop = CAPSULE_OPEN;
        } else if (state.period >= periods) {
            stop = CAPSULE_DONE;
        }
    }
    states[i] = state, contexts[i] = context;
    stops[i] = (int8_t)stop;
}
#endif
