/* A periodic orbit of a given itinerary: the equations of its start and of its segments' durations, and
   Newton's method on them.

   The equations are: each segment's guard vanishes at its end; the state there is that of the start again,
   x_c apart, or its mirror image; the durations are whole periods of the forcing. Where a guard vanishes
   at the segment's start already, that root is divided out: the equations then stay regular as the
   segment shrinks to nothing, and go on beyond, to durations below zero. */
#include <math.h>
#include <string.h>

#include "chain.h"
#include "linear.h"

#define MOST_STEPS 25
#define LEAST_SCALE 0x1p-12
#define BACK 0.5      /* how far a segment may go below duration 0, over its fastest rate */
#define SOLVED 1e-13  /* largest entry of a residual that is taken for zero, over that of z */
#define ROUNDINGS 8.0 /* of the terms of each equation */
#define FINE 0x1p13   /* roundings in a step that is not looked at more closely */
#define LOST 0.01     /* condition of the equations, over what double precision resolves */
#define POWER_STEPS 12

enum { ANGLE = STATES, DURATION };
typedef enum { NEVER, IMPACT, LANDING, SLIP, IMPOSSIBLE } guard_kind;

/* A sum in two parts: long itineraries pass many turns, and their angles would lose digits to them. */
typedef struct {
    double whole, rest;
} angle_sum;

static void turn_on(angle_sum *angle, double omega, double h)
{
    const double more = omega * h, sum = angle->whole + more, part = sum - angle->whole;
    angle->rest += (angle->whole - (sum - part)) + (more - part) + fma(omega, h, -more);
    angle->whole = sum;
}

/* What an evaluation works on. */
typedef struct {
    const capsule_itinerary *itinerary;
    capsule_constants field[CAPSULE_FIELD_COUNT];
    double omega;
    int count, columns;
    capsule_watch *watch; /* or null */
} equations;

static int neighbour(const capsule_itinerary *it, int i)
{
    const int n = it->count, field = it->fields[(i + n) % n] - 1;
    if (!it->mirrored || (i >= 0 && i < n))
        return field;
    return FIELD_OF[0][1 - DRIFT_OF[field]] - 1;
}

/* The guard that ends segment i. */
static guard_kind guard_of(const capsule_itinerary *it, int i)
{
    const int field = it->fields[i] - 1, next = neighbour(it, i + 1);
    const int impact = CONTACT_OF[field] != CONTACT_OF[next];
    const int slides = DRIFT_OF[field] != DRIFT_OF[next];
    if (it->count == 1 && DRIFT_OF[field] == 0)
        return NEVER;
    if (impact == slides)
        return IMPOSSIBLE;
    return impact ? IMPACT : DRIFT_OF[field] ? LANDING : SLIP;
}

/* How many derivatives of a segment's guard, from itself on, vanish at its start. */
static int zeros_of(const capsule_itinerary *it, int i)
{
    const guard_kind guard = guard_of(it, i), before = guard_of(it, (i + it->count - 1) % it->count);
    if (guard == IMPACT)
        return before == IMPACT;
    return guard != LANDING ? 0 : before == LANDING ? 1 : before == SLIP ? 2 : 0;
}

static int allowed(const capsule_itinerary *it)
{
    if (!it || !it->fields || it->count < 1 || it->count > CAPSULE_LONGEST || it->periods < 1 ||
        (it->mirrored && it->periods % 2 == 0))
        return 0;
    for (int i = 0; i < it->count; i++)
        if (it->fields[i] < 1 || it->fields[i] > CAPSULE_FIELD_COUNT)
            return 0;
    for (int i = 0; i < it->count; i++)
        if (guard_of(it, i) == IMPOSSIBLE)
            return 0;
    return 1;
}

static double largest(const double *values, int count)
{
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fabs(values[i]) > most || isnan(values[i]) ? fabs(values[i]) : most;
    return most;
}

/* A segment of a duration from a state. A duration of 0 would leave nothing to divide by; within
   rounding the limit is the same. */
static void run_segment(const capsule_constants *c, const double state[STATES], angle_sum angle, double h,
                        capsule_segment_flow *p)
{
    const double cosine = cos(angle.whole), sine = sin(angle.whole);
    const double gap = state[0] - c->delta, margin = margin_at(c, state[0], gap, state[1]);
    const capsule_start start = {state[0], gap, state[1], state[2], margin,
                                 cosine - angle.rest * sine, sine + angle.rest * cosine};
    double change[STATES] = {0.0};
    memcpy(p->start, &start, sizeof p->start);
    p->angle = angle.whole;
    p->duration = fabs(h) > UNIT ? h : UNIT;
    capsule_flow(c, &start, p->duration, change);
    const double slid = c->drift != 0.0 ? change[2] : -state[2];
    p->moved[0] = change[0];
    p->moved[1] = slid;
    p->moved[2] = c->drift != 0.0 ? capsule_flow_advance(c, &start, change[0], p->duration) : 0.0;
    p->end[0] = state[0] + change[0];
    p->end[1] = change[1];
    p->end[2] = state[2] + slid;
    chain_rows(c, &start, p->duration, (double (*)[ROW])p->jacobian);
}

/* A guard at the end of a segment over the power `zeros` of its duration, and the row of that. */
static double divided_guard(const capsule_constants *c, const capsule_constants *next, int zeros,
                            const capsule_segment_flow *p, double row[ROW])
{
    const int impact = c->contact != next->contact, which = impact ? 0 : 2;
    const double h = p->duration;
    double rows[ROWS][ROW];
    memcpy(rows, p->jacobian, sizeof rows);
    if (zeros == 0) {
        chain_guard(c, next, p->end, rows, row);
        const double gap = p->end[0] - c->delta;
        return impact              ? gap
               : c->drift != 0.0 ? p->end[2]
                                   : force(c, p->end[0], gap, p->end[1]) - friction_at(c, next->drift);
    }
    double gained = p->moved[impact ? 0 : 1];
    memcpy(row, rows[which], ROW * sizeof *row);
    row[which] -= 1.0;
    if (zeros == 2) {
        /* The rate at the start, which the guard before makes 0 where all equations hold. */
        const double rate = v_c_rate(c, p->start[4]);
        double gradient[CAPSULE_SLOPE_COUNT], slip[ROW], start[STATES][ROW] = {{0.0}};
        for (int k = 0; k < STATES; k++)
            start[k][k] = 1.0;
        slip_gradient(c, c->drift, p->start[0], p->start[1], p->start[2], gradient);
        chain_gradient(gradient, start, slip);
        gained -= rate * h;
        for (int k = 0; k < ROW; k++)
            row[k] -= slip[k] * h;
        row[BY_TIME] -= rate;
    }
    const double power = zeros == 2 ? h * h : h;
    for (int k = 0; k < ROW; k++)
        row[k] /= power;
    row[BY_TIME] -= zeros * gained / (power * h);
    return gained / power;
}

/* The guard that ends segment i, and its row. So near to the limit that the differences in the row
   would cancel it is interpolated from durations to both sides where they do not, to an error of `least`
   times the rate to the fourth. */
static double guard_at(const equations *e, int i, const capsule_segment_flow *p, double row[ROW])
{
    static const double NODE[4] = {-2.0, -1.0, 1.0, 2.0};
    const capsule_constants *c = &e->field[e->itinerary->fields[i] - 1];
    const capsule_constants *next = &e->field[neighbour(e->itinerary, i + 1)];
    const int zeros = zeros_of(e->itinerary, i);
    const double value = divided_guard(c, next, zeros, p, row);
    const double least = fmin(pow(UNIT, 1.0 / (zeros + 4)), 1.0 / (10.0 * c->rate));
    if (!zeros || fabs(p->duration) >= least)
        return value;
    const double state[STATES] = {p->start[0], p->start[2], p->start[3]};
    memset(row, 0, ROW * sizeof *row);
    for (int node = 0; node < 4; node++) {
        capsule_segment_flow beside;
        double its[ROW], weight = 1.0;
        run_segment(c, state, (angle_sum){p->angle, 0.0}, NODE[node] * least, &beside);
        divided_guard(c, next, zeros, &beside, its);
        for (int k = 0; k < 4; k++)
            if (k != node)
                weight *= (p->duration / least - NODE[k]) / (NODE[node] - NODE[k]);
        for (int k = 0; k < ROW; k++)
            row[k] += weight * its[k];
    }
    return value;
}

/* The equations that close the orbit. The start is held to the surface of the last guard, in place of
   that component's equation: were it not, segments whose guards begin at 0 one after the other all
   round would fix their differences only. */
static void close_up(const equations *e, const double *z, angle_sum angle, double elapsed,
                     const double *end_by, capsule_system *to)
{
    const int n = e->count, columns = e->columns;
    const capsule_itinerary *it = e->itinerary;
    const double sign = it->mirrored ? -1.0 : 1.0, turn = it->mirrored ? TWO_PI / 2.0 : TWO_PI;
    const guard_kind last = guard_of(it, n - 1);
    for (int row = 0; row < STATES; row++) {
        double *by = &to->by[(n + row) * columns];
        to->residual[n + row] = to->flows[n - 1].end[row] - sign * z[row];
        memcpy(by, &end_by[row * columns], (size_t)columns * sizeof *by);
        by[row] -= sign;
        if ((row != 0 || last != IMPACT) && (row != 2 || last != LANDING))
            continue;
        memset(by, 0, (size_t)columns * sizeof *by);
        by[row] = 1.0;
        to->residual[n + row] = z[row] - (last == IMPACT ? e->field[0].delta : 0.0);
        if (last == IMPACT)
            by[columns - ROW + BY(delta)] = -1.0;
    }
    double *by = &to->by[(n + STATES) * columns];
    memset(by, 0, (size_t)columns * sizeof *by);
    for (int i = 0; i < n; i++)
        by[DURATION + i] = e->omega;
    by[columns - ROW + BY(omega)] = elapsed;
    const double periods = it->periods, turns = periods * turn;
    const double lost = fma(periods, turn, -turns) + periods * (turn / TWO_PI) * TWO_PI_REST;
    to->residual[n + STATES] = ((angle.whole - turns) - z[ANGLE]) + (angle.rest - lost);
}

/* The monodromy matrix over the segments from `first` on, all round. */
static void multiply(const capsule_constants field[CAPSULE_FIELD_COUNT], const capsule_itinerary *it,
                     const capsule_segment_flow *flows, int first, double product[STATES][STATES])
{
    const int n = it->count;
    for (int i = 0; i < STATES; i++)
        for (int k = 0; k < STATES; k++)
            product[i][k] = i == k ? (it->mirrored ? -1.0 : 1.0) : 0.0;
    for (int k = first; k < first + n; k++) {
        const int i = k % n;
        const capsule_segment_flow *p = &flows[i];
        double moved[STATES][STATES];
        for (int r = 0; r < STATES; r++)
            for (int j = 0; j < STATES; j++)
                moved[r][j] = p->jacobian[r * ROW] * product[0][j] +
                              p->jacobian[r * ROW + 1] * product[1][j] +
                              p->jacobian[r * ROW + 2] * product[2][j];
        memcpy(product, moved, sizeof moved);
        if (guard_of(it, i) == LANDING)
            chain_saltation(&field[it->fields[i] - 1], &field[neighbour(it, i + 1)], p->end, product);
    }
}

/* The equations at z; whether the watch stopped it: then the residual is not a number. */
static int evaluate(const equations *e, const double *z, capsule_system *to)
{
    const int n = e->count, columns = e->columns;
    double *angle_by = to->workspace, *moved = angle_by + columns, *advance_by = moved + columns;
    angle_sum angle = {z[ANGLE], 0.0};
    double elapsed = 0.0;
    memset(angle_by, 0, 2 * (size_t)columns * sizeof *angle_by);
    memset(to->advance_by, 0, (size_t)columns * sizeof *to->advance_by);
    memset(to->states_by, 0, (size_t)(STATES * columns) * sizeof *to->states_by);
    for (int k = 0; k < STATES; k++)
        to->states_by[k * columns + k] = 1.0;
    angle_by[ANGLE] = 1.0;
    to->advance = 0.0;
    for (int i = 0; i < n; i++) {
        const capsule_constants *c = &e->field[e->itinerary->fields[i] - 1];
        capsule_segment_flow *p = &to->flows[i];
        const double *state_by = &to->states_by[i * STATES * columns];
        double row[ROW];
        if (capsule_asked(e->watch, 4 + columns / 64)) {
            to->residual[0] = NAN;
            return 1;
        }
        run_segment(c, i ? to->flows[i - 1].end : z, angle, z[DURATION + i], p);
        moved[DURATION + i] = 1.0;
        for (int k = 0; k < STATES; k++)
            chain_total(&p->jacobian[k * ROW], state_by, angle_by, moved, columns,
                        &to->states_by[((i + 1) * STATES + k) * columns]);
        chain_total(&p->jacobian[STATES * ROW], state_by, angle_by, moved, columns, advance_by);
        for (int k = 0; k < columns; k++)
            to->advance_by[k] += advance_by[k];
        to->advance += p->moved[2];
        double *by = &to->by[i * columns];
        if (guard_of(e->itinerary, i) == NEVER) {
            to->residual[i] = angle.whole;
            memcpy(by, angle_by, (size_t)columns * sizeof *by);
        } else {
            to->residual[i] = guard_at(e, i, p, row);
            chain_total(row, state_by, angle_by, moved, columns, by);
        }
        moved[DURATION + i] = 0.0;
        turn_on(&angle, e->omega, z[DURATION + i]);
        elapsed += z[DURATION + i];
        angle_by[DURATION + i] = e->omega;
        angle_by[columns - ROW + BY(omega)] = elapsed;
    }
    close_up(e, z, angle, elapsed, &to->states_by[n * STATES * columns], to);
    multiply(e->field, e->itinerary, to->flows, 0, (double (*)[STATES])to->monodromy);
    return 0;
}

static equations equations_of(const capsule_parameters *parameters, const capsule_itinerary *it)
{
    equations e = {.itinerary = it, .omega = parameters->omega, .count = it->count,
                   .columns = CAPSULE_COLUMNS(it->count)};
    for (int f = 1; f <= CAPSULE_FIELD_COUNT; f++)
        capsule_constants_of(f, parameters, &e.field[f - 1]);
    return e;
}

capsule_stop capsule_evaluate_itinerary(const capsule_parameters *parameters,
                                        const capsule_itinerary *itinerary, const double *z,
                                        capsule_system *system)
{
    if (!parameters || !allowed(itinerary) || !z || !system || !system->flows)
        return CAPSULE_REFUSED;
    const equations e = equations_of(parameters, itinerary);
    evaluate(&e, z, system);
    return CAPSULE_DONE;
}

capsule_stop capsule_monodromy(const capsule_parameters *parameters, const capsule_itinerary *itinerary,
                               const capsule_segment_flow *flows, int first, double *monodromy)
{
    if (!parameters || !allowed(itinerary) || !flows || first < 0 || first >= itinerary->count ||
        !monodromy)
        return CAPSULE_REFUSED;
    const equations e = equations_of(parameters, itinerary);
    multiply(e.field, itinerary, flows, first, (double (*)[STATES])monodromy);
    return CAPSULE_DONE;
}

/* The next `count` numbers of a block. */
static double *taken(double **block, size_t count)
{
    double *const begin = *block;
    *block += count;
    return begin;
}

capsule_system capsule_system_in(double *block, int count)
{
    const size_t n = (size_t)count, unknowns = CAPSULE_UNKNOWNS(n), columns = CAPSULE_COLUMNS(n);
    const size_t flow = sizeof(capsule_segment_flow) / sizeof(double);
    return (capsule_system){.flows = (capsule_segment_flow *)taken(&block, n * flow),
                              .states_by = taken(&block, (n + 1) * STATES * columns),
                              .residual = taken(&block, unknowns),
                              .by = taken(&block, unknowns * columns),
                              .advance_by = taken(&block, columns),
                              .monodromy = taken(&block, STATES * STATES),
                              .workspace = block};
}

/* The search for a solution: where it stands, one step ahead, and the factored equations. */
typedef struct {
    const capsule_itinerary *itinerary;
    const capsule_itinerary_request *request;
    capsule_parameters parameters, trial_parameters;
    int count, unknowns, columns, held; /* held: -1 where the parameters stay */
    double *z, *trial, *matrix, *order, *step, *following;
    capsule_system at, ahead;
    int stopped; /* by the watch */
} search;

/* An entry of the derivative by the unknowns, among which the parameter stands for what is held. */
static double slope(const search *s, int row, int unknown)
{
    const double *by = &s->at.by[row * s->columns];
    double sum = 0.0;
    if (unknown != s->held)
        return by[unknown];
    for (int k = 0; k < CAPSULE_PARAMETER_COUNT; k++)
        sum += by[s->unknowns + k] * s->request->direction[k];
    return sum;
}

/* Condition of the equations in units of the motion's size, each over its largest term: the largest
   singular value by powers, the least by the inverse, of which it is nearly all where that matters. */
static double condition(search *s)
{
    const int m = s->unknowns;
    const double motion = largest(s->z, STATES), size = motion > 0.0 ? motion : 1.0;
    double *const row_of = s->trial, *const v = s->following, *const column = s->step;
    double norm = 0.0, inverse = 0.0;
    for (int i = 0; i < m; i++) {
        row_of[i] = 0.0, v[i] = 1.0;
        for (int j = 0; j < m; j++)
            row_of[i] = fmax(row_of[i], fabs(slope(s, i, j) * (j < STATES ? size : 1.0)));
    }
    for (int step = 0; step < POWER_STEPS; step++) {
        double sum = 0.0;
        memset(column, 0, (size_t)m * sizeof *column);
        for (int i = 0; i < m; i++) {
            double product = 0.0;
            for (int j = 0; j < m; j++)
                product += slope(s, i, j) * (j < STATES ? size : 1.0) / row_of[i] * v[j];
            for (int j = 0; j < m; j++)
                column[j] += slope(s, i, j) * (j < STATES ? size : 1.0) / row_of[i] * product;
        }
        for (int j = 0; j < m; j++)
            sum += column[j] * column[j];
        norm = sqrt(sqrt(sum));
        for (int j = 0; j < m; j++)
            v[j] = column[j] / sqrt(sum);
    }
    for (int k = 0; k < m; k++) {
        if (capsule_asked(s->request->watch, (int64_t)m * m / 1024)) {
            s->stopped = 1;
            return INFINITY;
        }
        memset(column, 0, (size_t)m * sizeof *column);
        column[k] = row_of[k];
        capsule_substitute(s->matrix, (size_t)m, s->order, column, 1);
        for (int j = 0; j < m; j++)
            inverse += column[j] / (j < STATES ? size : 1.0) * (column[j] / (j < STATES ? size : 1.0));
    }
    return norm * sqrt(inverse);
}

/* Whether each equation is solved as far as the roundings of its own terms let it. */
static int solved_to_rounding(const search *s, double tolerance)
{
    for (int i = 0; i < s->unknowns; i++) {
        double terms = 0.0;
        for (int j = 0; j < s->unknowns; j++)
            terms += fabs(s->at.by[i * s->columns + j]) * fabs(s->z[j]);
        if (!(fabs(s->at.residual[i]) <= fmax(tolerance, ROUNDINGS * UNIT * terms)))
            return 0;
    }
    return 1;
}

/* Whether the next step of Newton's method, by the same derivative, is shorter for certain. Where an
   equation is weak, as the balance of a small friction over a period, a step that solves it disturbs
   the others by more. The flow is affine in the states, so that the times alone are measured. See
   Deuflhard, Newton Methods for Nonlinear Problems, 2011, Section 3.3: the natural monotonicity test. */
static int nearer(search *s, double scale)
{
    const int m = s->unknowns, times = m - ANGLE;
    const double size = largest(s->step + ANGLE, times);
    if (!(largest(s->ahead.residual, m) < INFINITY) ||
        size <= FINE * UNIT * fmax(1.0, largest(s->z + ANGLE, times)))
        return 0;
    memcpy(s->following, s->ahead.residual, (size_t)m * sizeof *s->following);
    capsule_substitute(s->matrix, (size_t)m, s->order, s->following, 1);
    return largest(s->following + ANGLE, times) <= (1.0 - scale / 2.0) * size;
}

/* Takes a fraction of a step, if segments and parameters are allowed there; whether they are. */
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
    }
    equations e = equations_of(&s->trial_parameters, s->itinerary);
    e.watch = s->request->watch;
    for (int i = 0; i < s->count; i++)
        if (!(s->trial[DURATION + i] > -BACK / e.field[s->itinerary->fields[i] - 1].rate))
            return 0;
    s->stopped = evaluate(&e, s->trial, &s->ahead);
    return 1;
}

/* Goes on by the longest fraction of a step that comes nearer to a solution: that makes the residual
   smaller, or after which the next step is shorter. Returns 0 if none does. */
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
        return 1;
    }
    return 0;
}

static int factored(search *s)
{
    for (int i = 0; i < s->unknowns; i++)
        for (int j = 0; j < s->unknowns; j++)
            s->matrix[i * s->unknowns + j] = slope(s, i, j);
    return capsule_factor(s->matrix, (size_t)s->unknowns, s->order, s->request->watch);
}

static capsule_stop solve(search *s, capsule_solution *solution)
{
    const int m = s->unknowns;
    const equations e = equations_of(&s->parameters, s->itinerary);
    evaluate(&e, s->z, &s->at);
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
        capsule_substitute(s->matrix, (size_t)m, s->order, s->step, 1);
        const double step = largest(s->step, m);
        const double tolerance = SOLVED * fmax(1.0, largest(s->z, m));
        int solved = solution->residual <= tolerance;
        /* A solution is polished until a step's square is rounding, as far as rounding lets it. */
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

capsule_stop capsule_solve_itinerary(const capsule_itinerary *itinerary,
                                     const capsule_itinerary_request *request,
                                     capsule_parameters *parameters, double *z,
                                     capsule_system *system, capsule_solution *solution)
{
    if (!allowed(itinerary) || !request || !request->workspace || !parameters || !z || !system ||
        !system->flows || !solution || !capsule_parameters_allowed(parameters))
        return CAPSULE_REFUSED;
    const int n = itinerary->count, unknowns = CAPSULE_UNKNOWNS(n);
    if (request->direction && (request->held < 0 || request->held >= unknowns))
        return CAPSULE_REFUSED;
    double *block = request->workspace;
    search s = {.itinerary = itinerary, .request = request, .parameters = *parameters, .count = n,
                .unknowns = unknowns, .columns = CAPSULE_COLUMNS(n), .z = z,
                .held = request->direction ? request->held : -1};
    s.at = capsule_system_in(taken(&block, CAPSULE_SYSTEM_ROOM((size_t)n)), n);
    s.ahead = capsule_system_in(taken(&block, CAPSULE_SYSTEM_ROOM((size_t)n)), n);
    s.matrix = taken(&block, (size_t)unknowns * (size_t)unknowns);
    s.order = taken(&block, (size_t)unknowns);
    s.step = taken(&block, (size_t)unknowns);
    s.following = taken(&block, (size_t)unknowns);
    s.trial = taken(&block, (size_t)unknowns);
    const capsule_stop stop = solve(&s, solution);
    *parameters = s.parameters;
    if (stop != CAPSULE_DONE)
        return stop;
    const equations e = equations_of(parameters, itinerary);
    evaluate(&e, z, system);
    return stop;
}
