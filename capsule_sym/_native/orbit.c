/* Periodic orbit near a state: Newton's method on the map over its periods, with derivatives propagated
   through the switches. */
#include <math.h>
#include <string.h>

#include "chain.h"
#include "linear.h"
#include "orbit.h"

#define MOST_RUNS 12
#define ROUNDINGS 16.0     /* a correction of so many units counts as 0 */
#define STAGNANT 1e-9      /* a correction below this that no longer shrinks is rounding */
#define SAME_STATE 1e-8    /* states that repeat after a part of the periods */

void capsule_slopes_of_run(const capsule_closed_run *run, capsule_slopes *at)
{
    capsule_slopes_start(at);
    if (DRIFT_OF[run->segments[0].field - 1] == 0)
        at->state[2][2] = 0.0;
}

/* Hash of a run's sequence of switches. */
static uint64_t passage(const capsule_segment *segments, size_t count)
{
    uint64_t hash = 14695981039346656037u; /* by Fowler, Noll and Vo */
    for (size_t i = 0; i < count; i++)
        hash = (hash ^ (uint64_t)(16 * segments[i].field + segments[i].target)) * 1099511628211u;
    return hash;
}

/* Solves a x = b for some columns; true if the solution is finite. */
static int solved(double a[3][3], double *b, int columns)
{
    double order[3];
    int finite = capsule_factor(&a[0][0], 3, order);
    capsule_substitute(&a[0][0], 3, order, b, (size_t)columns);
    for (int i = 0; i < 3 * columns; i++)
        finite &= isfinite(b[i]) != 0;
    return finite;
}

/* I less the monodromy matrix. */
static void return_matrix(double slopes[4][COLUMNS_AT], double a[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a[i][j] = (i == j) - slopes[i][j];
}

/* True if the run is at its start after `part` periods, fewer than all of its own. */
static int repeats_after(const capsule_closed_run *run, int part, const double x[3], double scale)
{
    const double time = part * (run->end / run->periods);
    double there[4], most = 0.0;
    if (part == run->periods)
        return 0;
    capsule_evaluate(run->map, run->segments, run->count, 0, &time, 1, &there, NULL);
    for (int i = 0; i < 3; i++)
        most = fmax(most, fabs(there[i] - x[i]));
    return most <= SAME_STATE * scale;
}

static int repeats_sooner(const capsule_closed_run *run, const double x[3], double scale)
{
    int repeats = 0;
    for (int part = 1; part <= run->periods / part; part++) /* and the number of such parts */
        if (run->periods % part == 0)
            repeats |= repeats_after(run, part, x, scale) |
                       repeats_after(run, run->periods / part, x, scale);
    return repeats;
}

/* One run over the periods, and its derivatives at the end. */
static capsule_stop run_once(const capsule_orbit_request *request, const double x[3],
                             capsule_closed_run *run, double end[3], double slopes[4][COLUMNS_AT])
{
    const capsule_request segments = {
        .segments = request->segments, .room = request->room, .watch = request->watch};
    capsule_state state = capsule_state_at(run->map, x[0], x[1], x[2], 0.0);
    capsule_outcome open;
    capsule_slopes at;
    const capsule_stop stop =
        capsule_run(run->map, &state, run->periods, &segments, &run->count, &open);
    if (stop != CAPSULE_DONE)
        return stop;
    capsule_slopes_of_run(run, &at);
    if (capsule_differentiate(run->map, run->segments, run->count, &at, NULL, &run->end, 1,
                              (double (*)[4][COLUMNS_AT])slopes, request->watch) < run->count)
        return CAPSULE_STOPPED;
    end[0] = state.x_r, end[1] = state.v_r, end[2] = state.v_c;
    const double end_by[SLOPES] = {[PARAMETER + OMEGA_AT] = run->end_by_omega};
    for (int i = 0; i < 4; i++)
        chain_moved(slopes[i], end_by, slopes[i]);
    return CAPSULE_DONE;
}

/* Results of the closed run besides its state. */
static capsule_stop complete(const capsule_orbit_request *request, const capsule_closed_run *run,
                             double slopes[4][COLUMNS_AT], capsule_orbit *orbit)
{
    double a[3][3], metric[METRICS][SLOPES];
    return_matrix(slopes, a);
    for (int i = 0; i < 3; i++) {
        memcpy(&orbit->monodromy[3 * i], slopes[i], 3 * sizeof(double));
        memcpy(&orbit->by_parameter[PARAMETERS * i], &slopes[i][PARAMETER],
               PARAMETERS * sizeof(double));
    }
    orbit->segments = (int32_t)run->count;
    orbit->sticks = 0;
    for (size_t i = 0; i < run->count; i++)
        orbit->sticks |= DRIFT_OF[run->segments[i].field - 1] == 0;
    if (!solved(a, orbit->by_parameter, PARAMETERS))
        orbit->status = CAPSULE_TANGENTIAL;
    const capsule_stop stop = capsule_metrics(run, request, orbit, metric);
    if (stop != CAPSULE_DONE)
        orbit->status = CAPSULE_UNKNOWN;
    if (stop != CAPSULE_DONE || !request->gradients)
        return stop;
    for (int m = 0; m < METRICS; m++)
        for (int k = 0; k < PARAMETERS; k++) {
            double *gradient = &orbit->gradients[PARAMETERS * m + k];
            *gradient = metric[m][PARAMETER + k];
            for (int i = 0; i < 3; i++)
                *gradient += metric[m][i] * orbit->by_parameter[PARAMETERS * i + k];
        }
    return CAPSULE_DONE;
}

/* Sets results that are not computed to NaN. */
static void blank(capsule_orbit *orbit)
{
    memset(orbit, 0, sizeof *orbit);
    for (double *value = orbit->state; value < orbit->gradients + METRICS * PARAMETERS; value++)
        *value = NAN;
}

capsule_stop capsule_solve_orbit(const capsule_map *map, const double state[3], int periods,
                                 const capsule_orbit_request *request, capsule_orbit *orbit)
{
    if (!orbit)
        return CAPSULE_REFUSED;
    blank(orbit);
    if (!map || !state || !request || !request->segments || periods < 1)
        return CAPSULE_REFUSED;
    const double end = periods * TWO_PI / map->parameters.omega;
    capsule_closed_run run = {map, request->segments, 0, periods, end, -end / map->parameters.omega};
    double x[3] = {state[0], state[1], state[2]}, last = INFINITY;
    uint64_t first = 0;
    for (orbit->runs = 1; orbit->runs <= MOST_RUNS; orbit->runs++) {
        double a[3][3], by[3], slopes[4][COLUMNS_AT];
        const capsule_stop stop = run_once(request, x, &run, by, slopes);
        if (stop != CAPSULE_DONE)
            return stop;
        const uint64_t passed = passage(run.segments, run.count);
        if (orbit->runs == 1)
            first = passed;
        double size = 0.0, scale = 1.0;
        for (int i = 0; i < 3; i++)
            by[i] -= x[i];
        return_matrix(slopes, a);
        orbit->status = CAPSULE_TANGENTIAL;
        if (!solved(a, by, 1))
            return CAPSULE_DONE;
        for (int i = 0; i < 3; i++)
            size = fmax(size, fabs(by[i])), scale = fmax(scale, fabs(x[i]));
        orbit->correction = size;
        if (size <= ROUNDINGS * UNIT * scale || (size >= 0.5 * last && size <= STAGNANT * scale)) {
            const int same = passed == first && !repeats_sooner(&run, x, scale);
            orbit->status = same ? CAPSULE_CLOSED : CAPSULE_CHANGED;
            memcpy(orbit->state, x, sizeof x);
            return complete(request, &run, slopes, orbit);
        }
        for (int i = 0; i < 3; i++)
            x[i] += by[i];
        last = size;
    }
    orbit->status = CAPSULE_NOT_CONVERGED;
    return CAPSULE_DONE;
}
