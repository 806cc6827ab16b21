/* Periodic orbits closed exactly, and bifurcations as orbits with a segment of zero duration: there
   the segment's guard, with the root that it has at its start divided out, is the event's equation. */
#include <string.h>

#include "page.h"

#include "number.h"

#define UNKNOWNS (LONGEST_ITINERARY + 5) /* x_r, v_r, v_c, theta, durations, and one parameter */
#define STEPS 30

typedef enum { GAP, REST, BOUND, NONE } guard_kind;

/* A value with its derivatives by the unknowns. */
typedef struct {
    double at, by[UNKNOWNS];
} dual;

static capsule_constants fields[6];
static double matrix[UNKNOWNS][UNKNOWNS + 1];

static int contact_of(int field) { return CONTACT_OF[field - 1]; }
static int drift_of(int field) { return DRIFT_OF[field - 1]; }

/* Which guard ends a segment of field f that g follows. */
static guard_kind guard_between(int f, int g)
{
    if (contact_of(f) != contact_of(g))
        return GAP;
    return drift_of(f) ? REST : drift_of(g) ? BOUND : NONE;
}

static void make_fields(const double p[7])
{
    for (int f = 1; f <= 6; f++)
        capsule_constants_of(f, (const capsule_parameters *)p, &fields[f - 1]);
}

static segment segment_of(int f) { return fields[f - 1]; }

static int next_of(const page_orbit *o, int i) { return o->field[(i + 1) % o->n]; }
static int before_of(const page_orbit *o, int i) { return o->field[(i + o->n - 1) % o->n]; }

/* The event's equation where segment `zero` begins: at state and angle `s`. */
static double event_at(const page_orbit *o, const double s[4])
{
    const int i = o->zero, f = o->field[i], before = before_of(o, i);
    const guard_kind came = guard_between(before, f), goes = guard_between(f, next_of(o, i));
    const segment c = segment_of(f);
    const double gap = s[0] - c.delta;
    if (goes == GAP)
        return came == GAP ? s[1] : gap;
    if (goes == BOUND)
        return force(&c, s[0], gap, s[1]) - drift_of(next_of(o, i)) * c.f_b;
    if (came == BOUND)
        return force_change(&c, s[1], v_rate(&c, s[0], gap, s[1], cos(s[3])));
    return came == REST ? margin_at(&c, s[0], gap, s[1]) : s[2];
}

/* Its row of the system: derivatives by differences, which decide how fast Newton's method converges
   but not where to. */
static void event_row(const page_orbit *o, const dual state[3], const dual *angle, double values[7],
                      int free, int unknowns, double *line)
{
    double s[4] = {state[0].at, state[1].at, state[2].at, angle->at};
    memset(line, 0, (size_t)unknowns * sizeof *line);
    line[unknowns] = -event_at(o, s);
    for (int k = 0; k < 4; k++) {
        const double keep = s[k], step = 1e-5 * (1.0 + fabs(keep));
        const dual *d = k < 3 ? &state[k] : angle;
        s[k] = keep + step;
        const double high = event_at(o, s);
        s[k] = keep - step;
        const double slope = (high - event_at(o, s)) / (2.0 * step);
        s[k] = keep;
        for (int j = 0; j < unknowns; j++)
            line[j] += slope * d->by[j];
    }
    if (free >= 0) {
        const double keep = values[free], step = 1e-6 * (1e-3 + keep);
        values[free] = keep + step;
        make_fields(values);
        const double high = event_at(o, s);
        values[free] = keep - step;
        make_fields(values);
        line[unknowns - 1] += (high - event_at(o, s)) / (2.0 * step);
        values[free] = keep;
        make_fields(values);
    }
}

/* A segment's guard at its end, in the system's row. */
static void guard_row(int f, int g, const dual end[3], int free, int unknowns, double *line)
{
    const segment c = segment_of(f);
    const guard_kind kind = guard_between(f, g);
    const double gap = end[0].at - c.delta;
    const double by_x = kind == GAP ? 1.0 : kind == BOUND ? 1.0 + c.kappa : 0.0;
    const double by_v = kind == BOUND ? 2.0 * c.zeta : 0.0, by_c = kind == REST ? 1.0 : 0.0;
    const double value = kind == GAP    ? gap
                         : kind == REST ? end[2].at
                                        : force(&c, end[0].at, gap, end[1].at) - drift_of(g) * c.f_b;
    for (int j = 0; j < unknowns; j++)
        line[j] = by_x * end[0].by[j] + by_v * end[1].by[j] + by_c * end[2].by[j];
    line[unknowns] = -value;
    if (free < 0)
        return;
    double *const last = &line[unknowns - 1];
    if (kind == GAP && free == 2)
        *last -= 1.0;
    if (kind == BOUND)
        *last += free == 2   ? -c.kappa
                 : free == 3 ? 2.0 * end[1].at
                 : free == 4 ? (c.contact != 0.0 ? gap : 0.0)
                 : free == 6 ? -(double)drift_of(g)
                             : 0.0;
}

/* Gaussian elimination with pivots; the solution stands in the last column. 0 where singular. */
static int solve(int n)
{
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(matrix[i][k]) > fabs(matrix[pivot][k]))
                pivot = i;
        if (!(fabs(matrix[pivot][k]) > 1e-300))
            return 0;
        for (int j = k; j <= n && pivot != k; j++) {
            const double swap = matrix[k][j];
            matrix[k][j] = matrix[pivot][j];
            matrix[pivot][j] = swap;
        }
        for (int i = k + 1; i < n; i++) {
            const double by = matrix[i][k] / matrix[k][k];
            for (int j = k; j <= n && by != 0.0; j++)
                matrix[i][j] -= by * matrix[k][j];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            matrix[k][n] -= matrix[k][j] * matrix[j][n];
        matrix[k][n] /= matrix[k][k];
    }
    return 1;
}

/* Carries state and derivatives over one segment; its own Jacobian is left in `rows`. */
static void carry(int f, double h, int column, int free, int unknowns, const dual *angle,
                  dual state[3], double rows[4][12], double *advance)
{
    const capsule_constants *c = &fields[f - 1];
    const double x = state[0].at, v = state[1].at, gap = x - c->delta;
    const capsule_start from = {x, gap, v, state[2].at, capsule_margin_at(c, x, gap, v),
                                cos(angle->at), sin(angle->at)};
    double change[3] = {0.0, 0.0, 0.0};
    memset(rows, 0, 4 * 12 * sizeof(double));
    capsule_flow(c, &from, h, change);
    capsule_jacobian(c, &from, h, &rows[0][0]);
    if (c->drift == 0.0)
        memset(rows[2], 0, 2 * sizeof rows[2]);
    else
        *advance += capsule_flow_advance(c, &from, change[0], h);
    dual end[3];
    end[0].at = x + change[0];
    end[1].at = change[1];
    end[2].at = c->drift != 0.0 ? state[2].at + change[2] : 0.0;
    for (int r = 0; r < 3; r++) {
        for (int j = 0; j < unknowns; j++)
            end[r].by[j] = rows[r][0] * state[0].by[j] + rows[r][1] * state[1].by[j] +
                           rows[r][2] * state[2].by[j] + rows[r][3] * angle->by[j];
        end[r].by[column] += rows[r][4];
        if (free >= 0)
            end[r].by[unknowns - 1] += rows[r][5 + free];
    }
    memcpy(state, end, 3 * sizeof *end);
}

/* The saltation matrix where the capsule comes to rest, times the product so far. */
static void salt(int f, int g, double x, double v, double cosine, double product[3][3])
{
    double rate[2], slip[2];
    for (int k = 0; k < 2; k++) {
        const segment c = segment_of(k ? g : f);
        const double gap = x - c.delta;
        rate[k] = v_rate(&c, x, gap, v, cosine);
        slip[k] = c.drift != 0.0 ? v_c_rate(&c, margin_at(&c, x, gap, v)) : 0.0;
    }
    for (int j = 0; j < 3; j++) {
        const double by = product[2][j] / slip[0];
        product[1][j] += (rate[1] - rate[0]) * by;
        product[2][j] = slip[1] * by;
    }
}

void page_carried(double product[3][3])
{
    memset(product, 0, 9 * sizeof(double));
    for (int r = 0; r < 3; r++)
        product[r][r] = 1.0;
    make_fields(given);
    for (size_t i = 0; i < page.count; i++) {
        const capsule_segment *s = &page.segments[i];
        const capsule_constants *c = &fields[s->field - 1];
        const capsule_start from = {s->start[0], s->gap, s->start[1], s->start[2],
                                    s->margin, s->cosine, s->sine};
        double rows[4][12], moved[3][3];
        memset(rows, 0, sizeof rows);
        capsule_jacobian(c, &from, s->duration, &rows[0][0]);
        for (int r = 0; r < 3; r++)
            for (int j = 0; j < 3; j++)
                moved[r][j] = r == 2 && c->drift == 0.0
                                  ? 0.0
                                  : rows[r][0] * product[0][j] + rows[r][1] * product[1][j] +
                                        rows[r][2] * product[2][j];
        memcpy(product, moved, sizeof moved);
        const int next = i + 1 < page.count ? page.segments[i + 1].field : 0;
        if (s->target && next && guard_between(s->field, next) == REST)
            salt(s->field, next, s->end[0], s->end[1], cos(s->end_angle), product);
    }
}

static int system_of(page_orbit *o, double values[7], int free)
{
    const int n = o->n, unknowns = n + 4 + (free >= 0), event = o->zero;
    static dual state[3], angle;
    double rows[4][12], product[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, elapsed = 0.0;
    memset(state, 0, sizeof state);
    memset(&angle, 0, sizeof angle);
    for (int r = 0; r < 3; r++)
        state[r].at = o->start[r], state[r].by[r] = 1.0;
    angle.at = o->angle, angle.by[3] = 1.0;
    o->advance = 0.0;
    make_fields(values);
    const double omega = values[1];
    for (int i = 0; i < n; i++) {
        const int f = o->field[i], g = next_of(o, i);
        if (i == event) {
            const segment c = segment_of(f);
            event_row(o, state, &angle, values, free, unknowns, matrix[i]);
            for (int r = 0; r < 3; r++)
                o->event[r] = state[r].at;
            o->event_force = force(&c, state[0].at, state[0].at - c.delta, state[1].at);
        }
        carry(f, o->h[i], 4 + i, free, unknowns, &angle, state, rows, &o->advance);
        if (i != event)
            guard_row(f, g, state, free, unknowns, matrix[i]);
        elapsed += o->h[i];
        angle.at = o->angle + omega * elapsed;
        angle.by[4 + i] = omega;
        if (free == 1)
            angle.by[unknowns - 1] = elapsed;
        double moved[3][3];
        for (int r = 0; r < 3; r++)
            for (int j = 0; j < 3; j++)
                moved[r][j] = rows[r][0] * product[0][j] + rows[r][1] * product[1][j] +
                              rows[r][2] * product[2][j];
        memcpy(product, moved, sizeof product);
        if (guard_between(f, g) == REST)
            salt(f, g, state[0].at, state[1].at, cos(angle.at), product);
    }
    memcpy(o->monodromy, product, sizeof product);
    for (int r = 0; r < 3; r++) {
        memcpy(matrix[n + r], state[r].by, (size_t)unknowns * sizeof(double));
        matrix[n + r][r] -= 1.0;
        matrix[n + r][unknowns] = o->start[r] - state[r].at;
    }
    double *const time = matrix[n + 3];
    memset(time, 0, (size_t)unknowns * sizeof(double));
    for (int i = 0; i < n; i++)
        time[4 + i] = omega;
    if (free == 1)
        time[unknowns - 1] = elapsed;
    time[unknowns] = o->period_number * TWO_PI - omega * elapsed;
    if (event >= 0) {
        double *const nothing = matrix[n + 4];
        memset(nothing, 0, (size_t)unknowns * sizeof(double));
        nothing[4 + event] = 1.0;
        nothing[unknowns] = -o->h[event];
    }
    if (o->pin >= 0) {
        double *const held = matrix[n + 4];
        memset(held, 0, (size_t)unknowns * sizeof(double));
        held[o->pin] = 1.0;
        held[unknowns] = o->pinned - (o->pin < 3 ? o->start[o->pin] : o->angle);
    }
    o->residual = 0.0;
    for (int i = 0; i < unknowns; i++)
        o->residual = fmax(o->residual, fabs(matrix[i][unknowns]));
    return unknowns;
}

int page_close(page_orbit *o, double values[7], int free)
{
    double last = INFINITY;
    if ((free >= 0) != (o->zero >= 0 || o->pin >= 0))
        return 0;
    for (o->steps = 1; o->steps <= STEPS; o->steps++) {
        const int unknowns = system_of(o, values, free);
        if (!isfinite(o->residual) || !solve(unknowns))
            return 0;
        double most = 0.0;
        for (int j = 0; j < unknowns; j++)
            most = fmax(most, fabs(matrix[j][unknowns]));
        if (!isfinite(most) || most > 1e6)
            return 0;
        for (int r = 0; r < 3; r++)
            o->start[r] += matrix[r][unknowns];
        o->angle += matrix[3][unknowns];
        for (int i = 0; i < o->n; i++)
            o->h[i] += matrix[4 + i][unknowns];
        if (free >= 0)
            values[free] += matrix[unknowns - 1][unknowns];
        /* As far as rounding lets it go: the steps no longer shrink. */
        if (most <= 1e-15 || (most <= 1e-9 && most >= 0.5 * last))
            break;
        last = most;
    }
    if (o->steps > STEPS)
        return 0;
    system_of(o, values, free);
    for (int i = 0; i < o->n; i++)
        if (i != o->zero && !(o->h[i] > 0.0))
            return 0;
    return o->residual <= 1e-10;
}

void page_within(const page_orbit *o, const double values[7], double at[4])
{
    make_fields(values);
    const capsule_constants *c = &fields[o->field[0] - 1];
    const double gap = o->start[0] - c->delta, h = o->h[0] / 2.0;
    const capsule_start from = {o->start[0], gap, o->start[1], o->start[2],
                                capsule_margin_at(c, o->start[0], gap, o->start[1]),
                                cos(o->angle), sin(o->angle)};
    double change[3] = {0.0, 0.0, 0.0};
    capsule_flow(c, &from, h, change);
    at[0] = o->start[0] + change[0];
    at[1] = change[1];
    at[2] = c->drift != 0.0 ? o->start[2] + change[2] : 0.0;
    at[3] = o->angle + c->omega * h;
}

void page_linearize(page_orbit *o, double values[7])
{
    system_of(o, values, -1);
}

int page_orbit_from(const capsule_segment *s, int n, int period_number, page_orbit *o)
{
    int first = 0;
    if (n < 2 || n > LONGEST_ITINERARY)
        return 0;
    while (first < n && drift_of(s[first].field))
        first++;
    first %= n;
    memset(o, 0, sizeof *o);
    o->n = n, o->period_number = period_number, o->zero = o->pin = -1;
    for (int i = 0; i < n; i++) {
        const capsule_segment *from = &s[(first + i) % n];
        o->field[i] = from->field;
        o->h[i] = from->duration;
    }
    for (int i = 0; i < n; i++)
        if (guard_between(o->field[i], next_of(o, i)) == NONE)
            return 0;
    memcpy(o->start, s[first].start, sizeof o->start);
    o->angle = s[first].start_angle;
    return 1;
}
