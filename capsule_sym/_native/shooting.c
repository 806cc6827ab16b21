/* Newton's method on the equations of an itinerary. */
#include <math.h>
#include <string.h>

#include "blocks.h"
#include "internal.h"

#define MOST_STEPS 25
#define LEAST_SCALE 0x1p-12
#define BACK 0.5      /* least duration of a segment is minus this, over its fastest rate */
#define SOLVED 1e-13  /* largest entry of a residual that counts as zero, over that of z */
#define ROUNDINGS 8.0 /* of the terms of each equation */
#define FINE 0x1p13   /* roundings in a step that needs no closer check */
#define LOST 0.01     /* condition of the equations, over what double precision resolves */
#define POWER_STEPS 12

enum { BLOCK_NUMBERS = sizeof(capsule_block) / sizeof(double) };
typedef char blocks_fit[BLOCK_NUMBERS + OWN * BLOCK_RIGHT_SIDES == 215 ? 1 : -1]; /* as capsule.h has it */

static double largest(const double *values, int count)
{
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fabs(values[i]) > most || isnan(values[i]) ? fabs(values[i]) : most;
    return most;
}

/* Search for a solution: the present iterate, a trial step, and the factored equations. */
typedef struct {
    const capsule_itinerary *itinerary;
    const capsule_itinerary_request *request;
    capsule_parameters parameters, trial_parameters;
    int count, unknowns, held; /* held: -1 for fixed parameters */
    double *z, *trial, *step, *following, *terms;
    double (*columns)[BLOCK_RIGHT_SIDES]; /* of an inverse */
    capsule_blocks blocks;
    capsule_equations equations, trial_equations; /* at these parameters */
    capsule_system at, ahead;
    double size; /* of the motion */
    int stopped; /* by the watch */
} search;

/* Largest term of an equation, if each unknown changes by its size. */
static void largest_term(void *about, int equation, const double *by)
{
    search *const s = about;
    double along = 0.0, most = 0.0;
    for (int k = 0; s->held >= 0 && k < CAPSULE_PARAMETER_COUNT; k++)
        along += by[s->unknowns + k] * s->request->direction[k];
    for (int j = 0; j < s->unknowns; j++)
        most = fmax(most, fabs(j == s->held ? along : by[j]) * (j < STATES ? s->size : 1.0));
    s->terms[equation] = most;
}

/* Sum of an equation's terms. */
static void sum_of_terms(void *about, int equation, const double *by)
{
    search *const s = about;
    s->terms[equation] = 0.0;
    for (int j = 0; j < s->unknowns; j++)
        s->terms[equation] += fabs(by[j]) * fabs(s->z[j]);
}

/* Passes each equation's terms to a function. */
static void find_terms(search *s, capsule_row_visit *visit)
{
    s->stopped |= capsule_differentiate_equations(&s->equations, s->z, &s->at, visit, s);
}

/* Largest singular value of the equations, each over its largest term, by power iteration. */
static double norm(search *s)
{
    double *const v = s->following, *const product = s->trial, *const column = s->step, sum = 0.0;
    for (int j = 0; j < s->unknowns; j++)
        v[j] = 1.0;
    for (int step = 0; step < POWER_STEPS; step++) {
        for (int j = 0; j < STATES; j++)
            v[j] *= s->size;
        capsule_blocks_product(&s->blocks, v, product);
        for (int i = 0; i < s->unknowns; i++)
            product[i] /= s->terms[i] * s->terms[i];
        capsule_blocks_transposed(&s->blocks, product, column);
        sum = 0.0;
        for (int j = 0; j < s->unknowns; j++) {
            column[j] *= j < STATES ? s->size : 1.0;
            sum += column[j] * column[j];
        }
        for (int j = 0; j < s->unknowns; j++)
            v[j] = column[j] / sqrt(sum);
    }
    return sqrt(sqrt(sum));
}

/* Condition of the equations in units of the motion's size, each over its largest term: the largest
   singular value times that of the inverse. If the condition is large, the least singular value dominates
   the inverse. */
static double condition(search *s)
{
    const int m = s->unknowns;
    const double motion = largest(s->z, STATES);
    double inverse = 0.0;
    s->size = motion > 0.0 ? motion : 1.0;
    find_terms(s, largest_term);
    for (int k = 0; k < m; k += BLOCK_RIGHT_SIDES) {
        if (s->stopped || capsule_asked(s->request->watch, m))
            return s->stopped = 1, INFINITY;
        memset(s->columns, 0, (size_t)m * sizeof *s->columns);
        for (int j = 0; j < BLOCK_RIGHT_SIDES && k + j < m; j++)
            s->columns[k + j][j] = s->terms[k + j];
        capsule_blocks_solve_many(&s->blocks, s->columns[0], k < s->count ? k : s->count);
        for (int i = 0; i < m; i++)
            for (int j = 0; j < BLOCK_RIGHT_SIDES; j++) {
                const double entry = s->columns[i][j] / (i < STATES ? s->size : 1.0);
                inverse += entry * entry;
            }
    }
    return norm(s) * sqrt(inverse);
}

/* True if each equation is solved as far as the roundings of its own terms allow. */
static int solved_to_rounding(search *s, double tolerance)
{
    find_terms(s, sum_of_terms);
    for (int i = 0; i < s->unknowns; i++)
        if (!(fabs(s->at.residual[i]) <= fmax(tolerance, ROUNDINGS * UNIT * s->terms[i])))
            return 0;
    return 1;
}

/* True if the next Newton step, with the same derivative, is certainly shorter. In a weak equation, such as
   the balance of a small friction over a period, a step that solves it changes the others by more. The flow
   is affine in the states, so only the times are measured. See Deuflhard, Newton Methods for Nonlinear
   Problems, 2011, Section 3.3: the natural monotonicity test. */
static int nearer(search *s, double scale)
{
    const int m = s->unknowns, times = m - ANGLE;
    const double size = largest(s->step + ANGLE, times);
    if (!(largest(s->ahead.residual, m) < INFINITY) ||
        size <= FINE * UNIT * fmax(1.0, largest(s->z + ANGLE, times)))
        return 0;
    memcpy(s->following, s->ahead.residual, (size_t)m * sizeof *s->following);
    capsule_blocks_solve(&s->blocks, s->following, 0);
    return largest(s->following + ANGLE, times) <= (1.0 - scale / 2.0) * size;
}

/* Tries a fraction of a step; true if segments and parameters are allowed there. */
static int tried(search *s, double scale)
{
    const int held = s->held;
    s->trial_parameters = s->parameters;
    for (int j = 0; j < s->unknowns; j++)
        s->trial[j] = s->z[j] - (j == held ? 0.0 : scale * s->step[j]);
    if (held >= 0) {
        double values[CAPSULE_PARAMETER_COUNT];
        memcpy(values, &s->parameters, sizeof values);
        for (int k = 0; k < CAPSULE_PARAMETER_COUNT; k++)
            values[k] -= scale * s->step[held] * s->request->direction[k];
        memcpy(&s->trial_parameters, values, sizeof values);
        if (!capsule_parameters_allowed(&s->trial_parameters))
            return 0;
        s->trial_equations = capsule_equations_of(&s->trial_parameters, s->itinerary, s->request->watch);
    }
    for (int i = 0; i < s->count; i++)
        if (!(s->trial[DURATION + i] > -BACK / s->trial_equations.field[s->itinerary->fields[i] - 1].rate))
            return 0;
    s->stopped = capsule_evaluate_equations(&s->trial_equations, s->trial, &s->ahead);
    return 1;
}

/* Takes the longest fraction of a step that comes nearer to a solution: it reduces the residual, or the
   next step is shorter. Returns 0 if none does. */
static int go_on(search *s, double least)
{
    const double norm = largest(s->at.residual, s->unknowns);
    for (double scale = 1.0; scale >= least && !s->stopped; scale /= 2.0) {
        if (!tried(s, scale) ||
            (!(largest(s->ahead.residual, s->unknowns) < norm) && !nearer(s, scale)))
            continue;
        const capsule_system before = s->at;
        s->at = s->ahead, s->ahead = before;
        memcpy(s->z, s->trial, (size_t)s->unknowns * sizeof *s->z);
        s->parameters = s->trial_parameters;
        s->equations = s->trial_equations;
        return 1;
    }
    return 0;
}

static int factored(search *s)
{
    capsule_blocks_fill(&s->blocks, &s->equations, &s->at, s->held < 0 ? NULL : s->request->direction);
    return capsule_blocks_factor(&s->blocks, s->request->watch);
}

static capsule_stop solve(search *s, capsule_solution *solution)
{
    const int m = s->unknowns;
    s->equations = s->trial_equations =
        capsule_equations_of(&s->parameters, s->itinerary, s->request->watch);
    s->stopped = capsule_evaluate_equations(&s->equations, s->z, &s->at);
    if (s->stopped)
        return CAPSULE_STOPPED;
    *solution = (capsule_solution){largest(s->at.residual, m), CAPSULE_NOT_FINITE, 0};
    if (!(solution->residual < INFINITY))
        return CAPSULE_DONE;
    for (solution->steps = 1; solution->steps <= MOST_STEPS; solution->steps++) {
        if (capsule_asked(s->request->watch, 8 * s->count))
            return CAPSULE_STOPPED;
        solution->status = CAPSULE_SINGULAR;
        const int regular = factored(s);
        if (regular <= 0)
            return regular ? CAPSULE_STOPPED : CAPSULE_DONE;
        memcpy(s->step, s->at.residual, (size_t)m * sizeof *s->step);
        capsule_blocks_solve(&s->blocks, s->step, 0);
        const double step = largest(s->step, m);
        const double tolerance = SOLVED * fmax(1.0, largest(s->z, m));
        int solved = solution->residual <= tolerance;
        /* A solution is polished until a step's square is rounding, or as far as rounding allows. */
        const int better = go_on(s, solved ? 1.0 : LEAST_SCALE);
        if (s->stopped)
            return CAPSULE_STOPPED;
        const double size = fmax(1.0, largest(s->z, m));
        solution->residual = largest(s->at.residual, m);
        solved |= !better && solved_to_rounding(s, tolerance);
        if (solved && (!better || step <= sqrt(UNIT) * size || solution->steps == MOST_STEPS)) {
            const int again = better ? factored(s) : 1;
            const int precise = again > 0 && condition(s) * UNIT <= LOST;
            if (again < 0 || s->stopped)
                return CAPSULE_STOPPED;
            if (again)
                solution->status = precise ? CAPSULE_SOLVED : CAPSULE_IMPRECISE;
            return CAPSULE_DONE;
        }
        if (!better)
            break;
    }
    solution->status = CAPSULE_UNSOLVED;
    return CAPSULE_DONE;
}

/* System at the last iterate. */
static void write_system(search *s, capsule_system *system)
{
    const size_t n = (size_t)s->count;
    memcpy(system->flows, s->at.flows, n * sizeof *system->flows);
    memcpy(system->residual, s->at.residual, (size_t)s->unknowns * sizeof *system->residual);
    memcpy(system->workspace, s->at.workspace, n * ROW * sizeof *system->workspace);
    system->advance = s->at.advance;
    s->equations.watch = NULL;
    capsule_complete_system(&s->equations, s->z, system);
}

capsule_stop capsule_solve_itinerary(const capsule_itinerary *itinerary,
                                     const capsule_itinerary_request *request,
                                     capsule_parameters *parameters, double *z,
                                     capsule_system *system, capsule_solution *solution)
{
    if (!capsule_itinerary_allowed(itinerary) || !request || !request->workspace || !parameters || !z ||
        !capsule_system_allowed(system) || !solution || !capsule_parameters_allowed(parameters))
        return CAPSULE_REFUSED;
    const int n = itinerary->count, unknowns = CAPSULE_UNKNOWNS(n);
    if (request->direction && (request->held < 0 || request->held >= unknowns))
        return CAPSULE_REFUSED;
    double *block = request->workspace;
    search s = {.itinerary = itinerary, .request = request, .parameters = *parameters, .count = n,
                .unknowns = unknowns, .z = z, .held = request->direction ? request->held : -1};
    s.at = capsule_equations_in(taken(&block, CAPSULE_EQUATIONS_ROOM((size_t)n)), n);
    s.ahead = capsule_equations_in(taken(&block, CAPSULE_EQUATIONS_ROOM((size_t)n)), n);
    s.step = taken(&block, (size_t)unknowns);
    s.following = taken(&block, (size_t)unknowns);
    s.trial = taken(&block, (size_t)unknowns);
    s.terms = taken(&block, (size_t)unknowns);
    s.columns = (double(*)[BLOCK_RIGHT_SIDES])taken(&block, (size_t)unknowns * BLOCK_RIGHT_SIDES);
    s.blocks.count = n, s.blocks.held = s.held;
    s.blocks.segments = (capsule_block *)taken(&block, (size_t)n * BLOCK_NUMBERS);
    s.blocks.kept = (double(*)[OWN * BLOCK_RIGHT_SIDES])block;
    const capsule_stop stop = solve(&s, solution);
    *parameters = s.parameters;
    if (stop != CAPSULE_DONE)
        return stop;
    write_system(&s, system);
    return stop;
}
