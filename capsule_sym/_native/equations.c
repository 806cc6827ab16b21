/* The equations of a periodic orbit of a given itinerary, of its start and of its segments' durations.

   The equations are: each segment's guard vanishes at its end; the state there equals that at the start,
   x_c apart, or its mirror image; the durations are whole periods of the forcing. A root of the guard at
   the segment's start is divided out. The equations then stay regular as the segment shrinks to duration 0,
   and continue to durations below zero. */
#include "equations.h"

#include <math.h>

typedef enum { NEVER, IMPACT, LANDING, SLIP, EDGE, IMPOSSIBLE } guard_kind;

/* A sum in two parts: the angles of long itineraries pass many turns and would lose digits. */
typedef struct {
    double whole, rest;
} angle_sum;

static void turn_on(angle_sum *angle, double omega, double h)
{
    const double more = omega * h, sum = angle->whole + more, part = sum - angle->whole;
    angle->rest += (angle->whole - (sum - part)) + (more - part) + fma(omega, h, -more);
    angle->whole = sum;
}

static int neighbour(const capsule_itinerary *it, int i)
{
    const int n = it->count, field = it->fields[(i + n) % n] - 1;
    if (!it->mirrored || (i >= 0 && i < n))
        return field;
    const int contact = CONTACT_OF[field]; /* in front, its mirror image has it behind */
    const int level = CAPSULE_PULSED - LEVEL_OF[field]; /* the other one of pulses */
    return FIELD_OF[level][TWO_STOPS && contact ? 3 - contact : 0][1 - DRIFT_OF[field]] - 1;
}

/* Guard that ends segment i. */
static guard_kind guard_of(const capsule_itinerary *it, int i)
{
    const int field = it->fields[i] - 1, next = neighbour(it, i + 1);
    const int impact = CONTACT_OF[field] != CONTACT_OF[next];
    const int slides = DRIFT_OF[field] != DRIFT_OF[next], edge = LEVEL_OF[field] != LEVEL_OF[next];
    if (impact && CONTACT_OF[field] && CONTACT_OF[next])
        return IMPOSSIBLE; /* from one stop to the other */
    if (it->count == 1 && DRIFT_OF[field] == 0 && !CAPSULE_PULSED)
        return NEVER;
    if (impact + slides + edge != 1 && !(edge && !impact && DRIFT_OF[field] == 0)) /* an edge may end rest */
        return IMPOSSIBLE;
    return edge ? EDGE : impact ? IMPACT : DRIFT_OF[field] ? LANDING : SLIP;
}

/* Number of derivatives of a segment's guard, itself included, that vanish at its start. */
static int zeros_of(const capsule_itinerary *it, int i)
{
    const guard_kind guard = guard_of(it, i), before = guard_of(it, (i + it->count - 1) % it->count);
    if (guard == IMPACT) /* of the same stop */
        return before == IMPACT && (CONTACT_OF[it->fields[i] - 1] != 0 ||
                                    CONTACT_OF[neighbour(it, i - 1)] == CONTACT_OF[neighbour(it, i + 1)]);
    if (guard != LANDING)
        return 0;
    return before == SLIP ? 2 : before == LANDING || (before == EDGE && !DRIFT_OF[neighbour(it, i - 1)]);
}

int capsule_itinerary_allowed(const capsule_itinerary *it)
{
    if (!it || !it->fields || it->count < 1 || it->count > CAPSULE_LONGEST || it->periods < 1 ||
        (it->mirrored && it->periods % 2 == 0))
        return 0;
    for (int i = 0; i < it->count; i++)
        if (it->fields[i] < 1 || it->fields[i] > CAPSULE_FIELD_COUNT)
            return 0;
    int edges = 0;
    for (int i = 0; i < it->count; i++) {
        if (guard_of(it, i) == IMPOSSIBLE)
            return 0;
        edges += guard_of(it, i) == EDGE;
    }
    return !CAPSULE_PULSED || edges == (it->mirrored ? 1 : 2) * it->periods;
}

int capsule_system_allowed(const capsule_system *system)
{
    return system && system->flows && system->residual && system->monodromy && system->workspace;
}

/* Closed form of a segment of a duration from a state. A duration of 0 is replaced by a tiny one, to divide
   by: within rounding the limit is the same. */
static void run_segment(const capsule_constants *c, const double state[STATES], angle_sum angle, double h,
                        capsule_segment_flow *p)
{
    const double cosine = cos(angle.whole), sine = sin(angle.whole);
    const double gap = state[0] - c->CAPSULE_OWN_STOP, turned = cosine - angle.rest * sine;
    const double margin = margin_at(c, state[0], gap, state[1], turned);
    const capsule_start start = {state[0], gap, state[1], state[2], margin, turned,
                                 sine + angle.rest * cosine};
    double change[STATES] = {0.0};
    memcpy(p->start, &start, sizeof p->start);
    p->angle = angle.whole;
    p->duration = fabs(h) <= UNIT ? UNIT : h;
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

/* Start of a segment's closed form. */
static capsule_start start_of(const capsule_segment_flow *p)
{
    capsule_start start;
    memcpy(&start, p->start, sizeof start);
    return start;
}

/* Guard at the end of a segment over the power `zeros` of its duration, and its row. */
static double divided_guard(const capsule_constants *c, const capsule_constants *next, int zeros,
                            const capsule_segment_flow *p, double row[ROW])
{
    const int impact = c->contact != next->contact, which = impact ? 0 : 2;
    const double h = p->duration;
    double rows[ROWS][ROW];
    memcpy(rows, p->jacobian, sizeof rows);
    if (zeros == 0) {
        const capsule_start start = start_of(p);
        double cosine = 0.0, sine = 0.0;
        chain_guard(c, next, &start, h, p->end, rows, row);
        if (CAPSULE_REACTION)
            chain_turn(c, &start, h, &cosine, &sine);
        const double gap = p->end[0] - (c->contact != 0.0 ? c : next)->CAPSULE_OWN_STOP;
        return impact              ? gap
               : c->drift != 0.0 ? p->end[2]
                                   : pull(c, p->end[0], gap, p->end[1], cosine) - friction_at(c, next->drift);
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
        slip_gradient(c, c->drift, p->start[0], p->start[1], p->start[2], p->start[5], p->start[6],
                      gradient);
        chain_gradient(gradient, &start[0][0], ROW, ROW, slip);
        if (CAPSULE_REACTION)
            slip[BY_ANGLE] += gradient[STATES];
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

/* Guard that ends segment i, and its row. So near to the limit that differences in the row would cancel, it
   is interpolated from durations on both sides, to an error of `least` times the rate to the fourth. */
static double guard_at(const capsule_equations *e, int i, const capsule_segment_flow *p, double row[ROW])
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

#if CAPSULE_PULSED
/* Angle at the end of a segment beyond the edge there, after so many whole turns, and its row. */
static double edge_guard(const capsule_constants *c, angle_sum angle, int turns, double h, double row[ROW])
{
    const double share = c->high > 0.0 ? high_share(c) : 1.0;
    const double whole = turns * TWO_PI, part = share * TWO_PI;
    const double lost = fma(turns, TWO_PI, -whole) + fma(share, TWO_PI, -part) + (turns + share) * TWO_PI_REST;
    chain_edge(c, h, row);
    turn_on(&angle, c->omega, h);
    return ((angle.whole - whole) - part) + (angle.rest - lost);
}
#endif

/* Field in contact with the stop at which the first segment begins. */
static const capsule_constants *touched_first(const capsule_equations *e)
{
    const capsule_constants *before = &e->field[neighbour(e->itinerary, -1)];
    return before->contact != 0.0 ? before : &e->field[e->itinerary->fields[0] - 1];
}

/* Gradient of the last guard, if this component of the start is held to its surface in place of its closing
   equation; else 0. Otherwise a cycle of segments whose guards all begin at 0 would determine only the
   differences of the unknowns. */
static int pin_gradient(const capsule_equations *e, int row, double gradient[CAPSULE_SLOPE_COUNT])
{
    const guard_kind last = guard_of(e->itinerary, e->count - 1);
    if (row == 0 && last == IMPACT)
        gap_gradient(touched_first(e), gradient);
    else if (row == 2 && last == LANDING)
        speed_gradient(e->field, gradient);
    else
        return 0;
    return 1;
}

/* Closing equations: the state at the end and the angle passed, less their required values. */
static void close_up(const capsule_equations *e, const double *z, angle_sum angle, capsule_system *to)
{
    const int n = e->count;
    const capsule_itinerary *it = e->itinerary;
    const double sign = it->mirrored ? -1.0 : 1.0, turn = it->mirrored ? TWO_PI / 2.0 : TWO_PI;
    for (int row = 0; row < STATES; row++)
        to->residual[n + row] = to->flows[n - 1].end[row] - sign * z[row];
    const guard_kind last = guard_of(it, n - 1);
    if (last == IMPACT)
        to->residual[n] = z[0] - touched_first(e)->CAPSULE_OWN_STOP;
    else if (last == LANDING)
        to->residual[n + 2] = z[2];
    const double periods = it->periods, turns = periods * turn;
    const double lost = fma(periods, turn, -turns) + periods * (turn / TWO_PI) * TWO_PI_REST;
    to->residual[n + STATES] = ((angle.whole - turns) - z[ANGLE]) + (angle.rest - lost);
}

/* Maps deviations across the landing that ends a segment. */
static void landed(const capsule_constants *c, const capsule_constants *next, const capsule_segment_flow *p,
                   double deviation[STATES][STATES])
{
    const capsule_start start = start_of(p);
    chain_saltation(c, next, &start, p->duration, p->end, deviation);
}

/* Monodromy matrix over one whole cycle of the segments. */
static void multiply(const capsule_constants field[CAPSULE_FIELD_COUNT], const capsule_itinerary *it,
                     const capsule_segment_flow *flows, double product[STATES][STATES])
{
    for (int i = 0; i < STATES; i++)
        for (int k = 0; k < STATES; k++)
            product[i][k] = i == k ? (it->mirrored ? -1.0 : 1.0) : 0.0;
    for (int i = 0; i < it->count; i++) {
        const capsule_segment_flow *p = &flows[i];
        double moved[STATES][STATES];
        for (int r = 0; r < STATES; r++)
            for (int j = 0; j < STATES; j++)
                moved[r][j] = p->jacobian[r * ROW] * product[0][j] +
                              p->jacobian[r * ROW + 1] * product[1][j] +
                              p->jacobian[r * ROW + 2] * product[2][j];
        memcpy(product, moved, sizeof moved);
        if (guard_of(it, i) == LANDING)
            landed(&field[it->fields[i] - 1], &field[neighbour(it, i + 1)], p, product);
    }
}

/* Rows of the guards, which an evaluation stores for the derivatives. */
static double *guard_row(const capsule_system *to, int segment)
{
    return to->workspace + (ptrdiff_t)segment * ROW;
}

/* Duration if the closed form accepts it; not a number far below 0, and if it is infinite. */
static double duration_of(const capsule_constants *c, double h)
{
    return h >= -1.0 / c->rate && c->rate * h < INFINITY ? h : NAN;
}

int capsule_evaluate_equations(const capsule_equations *e, const double *z, capsule_system *to)
{
    angle_sum angle = {z[ANGLE], 0.0};
#if CAPSULE_PULSED
    int rises = 0; /* on the way */
#endif
    to->advance = 0.0;
    for (int i = 0; i < e->count; i++) {
        capsule_segment_flow *p = &to->flows[i];
        if (capsule_asked(e->watch, 4)) {
            to->residual[0] = NAN;
            return 1;
        }
        const capsule_constants *c = &e->field[e->itinerary->fields[i] - 1];
        run_segment(c, i ? to->flows[i - 1].end : z, angle, duration_of(c, z[DURATION + i]), p);
        to->advance += p->moved[2];
        if (guard_of(e->itinerary, i) == NEVER) {
            double *const row = memset(guard_row(to, i), 0, ROW * sizeof *row);
            to->residual[i] = angle.whole;
            row[BY_ANGLE] = 1.0;
#if CAPSULE_PULSED
        } else if (guard_of(e->itinerary, i) == EDGE) {
            to->residual[i] = edge_guard(c, angle, rises, z[DURATION + i], guard_row(to, i));
            rises += c->high == 0.0;
#endif
        } else {
            to->residual[i] = guard_at(e, i, p, guard_row(to, i));
        }
        turn_on(&angle, e->omega, z[DURATION + i]);
    }
    close_up(e, z, angle, to);
    return 0;
}

/* Derivative of a closing equation with respect to its own component of the start, if none is pinned. */
static double by_start(const capsule_equations *e, int row)
{
    return row < STATES && e->itinerary->mirrored ? 1.0 : -1.0;
}

/* Derivatives of a closing equation, from those of the end. */
static void closing_row(const capsule_equations *e, int row, const double *end_by, double *by)
{
    double gradient[CAPSULE_SLOPE_COUNT];
    if (!pin_gradient(e, row, gradient)) {
        memcpy(by, end_by, (size_t)e->columns * sizeof *by);
        by[row] += by_start(e, row);
        return;
    }
    memset(by, 0, (size_t)e->columns * sizeof *by);
    memcpy(by, gradient, STATES * sizeof *by);
    memcpy(by + e->columns - CAPSULE_PARAMETER_COUNT, gradient + STATES + 1,
           CAPSULE_PARAMETER_COUNT * sizeof *by);
}

int capsule_differentiate_equations(const capsule_equations *e, const double *z, capsule_system *to,
                                    capsule_row_visit *visit, void *about)
{
    const int n = e->count, columns = e->columns;
    const size_t row = (size_t)columns, state = STATES * row;
    double *const rows = guard_row(to, n), *const angle_by = rows + 2 * state;
    double *const moved = angle_by + row, *const passing = moved + row;
    double *state_by = to->states_by ? to->states_by : rows, elapsed = 0.0;
    memset(angle_by, 0, 2 * row * sizeof *angle_by);
    memset(state_by, 0, state * sizeof *state_by);
    if (to->advance_by)
        memset(to->advance_by, 0, row * sizeof *to->advance_by);
    for (int k = 0; k < STATES; k++)
        state_by[k * columns + k] = 1.0;
    angle_by[ANGLE] = 1.0;
    for (int i = 0; i < n; i++) {
        const capsule_segment_flow *p = &to->flows[i];
        double *const by = to->by ? to->by + (size_t)i * row : passing;
        double *const end_by = to->states_by ? state_by + state : rows + (i % 2 ? 0 : state);
        if (capsule_asked(e->watch, columns / 64))
            return 1;
        moved[DURATION + i] = 1.0;
        for (int k = 0; k < STATES; k++)
            chain_total(&p->jacobian[k * ROW], state_by, angle_by, moved, columns, &end_by[k * columns]);
        if (to->advance_by) {
            chain_total(&p->jacobian[STATES * ROW], state_by, angle_by, moved, columns, by);
            for (int k = 0; k < columns; k++)
                to->advance_by[k] += by[k];
        }
        chain_total(guard_row(to, i), state_by, angle_by, moved, columns, by);
        if (visit)
            visit(about, i, by);
        state_by = end_by;
        moved[DURATION + i] = 0.0;
        elapsed += z[DURATION + i];
        angle_by[DURATION + i] = e->omega;
        angle_by[columns - ROW + BY(omega)] = elapsed;
    }
    for (int k = 0; k < BLOCK_STATES; k++) {
        double *const by = to->by ? to->by + (size_t)(n + k) * row : passing;
        closing_row(e, k, k < STATES ? &state_by[k * columns] : angle_by, by);
        if (visit)
            visit(about, n + k, by);
    }
    return 0;
}

void capsule_complete_system(const capsule_equations *e, const double *z, capsule_system *to)
{
    multiply(e->field, e->itinerary, to->flows, (double (*)[STATES])to->monodromy);
    if (to->by || to->states_by || to->advance_by)
        capsule_differentiate_equations(e, z, to, NULL, NULL);
}

void capsule_segment_block(const capsule_equations *e, int i, const capsule_system *at,
                           const double *direction, double block[BLOCK_ROWS][BLOCK_COLUMNS])
{
    const capsule_segment_flow *p = &at->flows[i];
    double angle[ROW] = {[BY_ANGLE] = 1.0, [BY_TIME] = e->omega, [BY(omega)] = p->duration};
    for (int r = 0; r < BLOCK_ROWS; r++) {
        const double *row = r < STATES ? &p->jacobian[r * ROW] : r == STATES ? angle : guard_row(at, i);
        block[r][0] = row[BY_TIME];
        memcpy(&block[r][1], row, BLOCK_STATES * sizeof *row);
        block[r][1 + BLOCK_STATES] = 0.0;
        for (int k = 0; direction && k < CAPSULE_PARAMETER_COUNT; k++)
            block[r][1 + BLOCK_STATES] += row[BY_PARAMETER + k] * direction[k];
    }
}

void capsule_closing_block(const capsule_equations *e, const double *direction,
                           double block[BLOCK_STATES][CLOSING_COLUMNS])
{
    memset(block, 0, BLOCK_STATES * sizeof *block);
    for (int row = 0; row < BLOCK_STATES; row++) {
        double gradient[CAPSULE_SLOPE_COUNT];
        if (!pin_gradient(e, row, gradient)) {
            block[row][row] = 1.0;
            block[row][BLOCK_STATES + row] = by_start(e, row);
            continue;
        }
        memcpy(&block[row][BLOCK_STATES], gradient, STATES * sizeof *gradient);
        for (int k = 0; direction && k < CAPSULE_PARAMETER_COUNT; k++)
            block[row][CLOSING_COLUMNS - 1] += gradient[STATES + 1 + k] * direction[k];
    }
}

capsule_equations capsule_equations_of(const capsule_parameters *parameters, const capsule_itinerary *it,
                                       capsule_watch *watch)
{
    capsule_equations e = {.itinerary = it, .omega = parameters->omega, .count = it->count,
                           .columns = CAPSULE_COLUMNS(it->count), .watch = watch};
    for (int f = 1; f <= CAPSULE_FIELD_COUNT; f++)
        capsule_constants_of(f, parameters, &e.field[f - 1]);
    return e;
}

capsule_stop capsule_evaluate_itinerary(const capsule_parameters *parameters,
                                        const capsule_itinerary *itinerary, const double *z,
                                        capsule_system *system)
{
    if (!parameters || !capsule_itinerary_allowed(itinerary) || !z || !capsule_system_allowed(system))
        return CAPSULE_REFUSED;
    const capsule_equations e = capsule_equations_of(parameters, itinerary, NULL);
    capsule_evaluate_equations(&e, z, system);
    capsule_complete_system(&e, z, system);
    return CAPSULE_DONE;
}

capsule_system capsule_equations_in(double *block, int count)
{
    const size_t n = (size_t)count, flow = sizeof(capsule_segment_flow) / sizeof(double);
    return (capsule_system){.flows = (capsule_segment_flow *)taken(&block, n * flow),
                            .residual = taken(&block, CAPSULE_UNKNOWNS(n)),
                            .monodromy = taken(&block, STATES * STATES),
                            .workspace = block};
}

capsule_system capsule_system_in(double *block, int count)
{
    const size_t n = (size_t)count, columns = CAPSULE_COLUMNS(n);
    capsule_system system = capsule_equations_in(block, count);
    block += CAPSULE_EQUATIONS_ROOM(n);
    system.states_by = taken(&block, (n + 1) * STATES * columns);
    system.by = taken(&block, CAPSULE_UNKNOWNS(n) * columns);
    system.advance_by = block;
    return system;
}
