/* Independent integrator for all scenes, from the equations of motion and the laws of friction and
   contact, as `pieces.h` has them, and shares no formula with the package. After an event the one field
   follows whose own solution stays in its region. The status shows a switch that 113 bits do not decide.

   integrator STOPS PULSED EPS PERIODS MOST CHECKED: each line of stdin has the 13 numbers of `scene` in
   order, x_r, v_r, v_c and the time in the period at the start; a run ends at the end of a period, of PERIODS that
   is no whole number within one; each line of stdout is a run as JSON, as
   `__init__.py` reads it. A number of many digits is a pair of doubles to be added up. A run has MOST
   segments at most. CHECKED is 1 for the balance of energy, and for `unit`: the errors of the final state
   (x_r, v_r, v_c, x_c) if each segment's end is rounded in units of its largest terms. */
#include "pieces.h"

/* Propagation of errors of one segment: the map of (x_r, v_r, v_c, x_c, t) from its start to that of the next,
   and the columns by which rounding at its end enters, each in units of its size. */
typedef struct { double by[5][5], rounding[5][5]; } passage;

typedef struct {
    field f;
    char event;
    real duration, gap_in_time;
    double slope, size;
    state end;
    passage errors;
} segment;

static segment run[ROOM];

/* The largest terms of x_r, v_r, v_c, x_c over a segment. */
typedef struct { double x, gap, v, c, y; } sizes;

static void grow(sizes *m, field f, const real *z)
{
    m->x = fmax(m->x, fmax((double)size_of(z[0]), (double)size_of(stop(f))));
    m->gap = fmax(m->gap, (double)size_of(z[0] - stop(f)));
    m->v = fmax(m->v, (double)size_of(z[1]));
    m->c = fmax(m->c, (double)size_of(z[2]));
    m->y = fmax(m->y, (double)size_of(z[3]));
}
static void complete(sizes *m, field f, double h)
{
    const double rate = 1 / (double)longest(f), lasting = fmin(h, 1 / rate);
    const double force = fmax(fabs(p.alpha), pulsed ? fabs(p.alpha_low) : 0) + fabs(p.s) +
                         fmax(p.f_plus, p.f_minus) / p.gamma + m->x;
    m->v = fmax(m->v, fmax(rate * m->gap, force * lasting));
    m->x = fmax(m->x, m->v * lasting);
    m->c = fmax(m->c, (m->v + fmax(p.f_plus, p.f_minus) * h + force * h) / (1 + p.gamma));
    m->y = fmax(m->y, m->c * h);
}

/* `columns` are the flow's, by x_r, v_r, v_c and t at the start; `rates` the state's, `by` the guard's. */
static void pass(passage *e, field f, char event, const series *columns, const series *s, const guard *g,
                 real u, real step, double h, const sizes *m)
{
    double by[5][5] = {{0}}, rates[4], along[5] = {0}, gradient[5] = {0}, slow = 1;
    const real *parts[4] = {s->x, s->v, s->c, s->y};
    for (int i = 0; i < 4; i++)
        rates[i] = (double)(slope(parts[i], u) / step);
    const int timed = event == 'E' || event == 'R' || event == 'D';
    for (int j = 0; j < 4; j++) {
        const series *c = &columns[j];
        const real *entries[4] = {c->x, c->v, c->c, c->y};
        for (int i = 0; i < 4; i++)
            by[i][j < 3 ? j : 4] = (double)value(entries[i], u);
        guard own[4];
        const int n = guards(f, c, 0, own);
        for (int i = 0; i < n; i++)
            if (own[i].event == event)
                along[j < 3 ? j : 4] = (double)value(own[i].g, u);
    }
    by[3][3] = 1, by[4][4] = 1;
    if (!timed) {
        slow = (double)(slope(g->g, u) / step);
        const int out = (event == 'F') == (f.contact != NONE) ? 1 : -1; /* of x_r, towards the event */
        const int sign = event == 'U' ? -1 : 1;
        if (event == 'F' || event == 'B')
            gradient[0] = out;
        else if (event == 'V')
            gradient[2] = f.way;
        else {
            gradient[0] = sign * (1 + (double)stiffness(f));
            gradient[1] = sign * 2 * p.zeta;
        }
    }
    /* A rate that is off by a rounding shifts the phase of the motion by so much. */
    const double grown = 1 + fmax(1 / (double)longest(f), p.omega) * h;
    const double size[5] = {grown * m->x, grown * m->v, grown * m->c, grown * m->y, h + (double)period};
    for (int j = 0; j < 5; j++) {
        const double later = timed ? (j == 4 ? -1 : 0) : -along[j] / slow;
        const double own = j == 4 ? 1 : timed ? 0 : -gradient[j] / slow;
        for (int i = 0; i < 5; i++) {
            const double rate = i < 4 ? rates[i] : 1;
            e->by[i][j] = by[i][j] + rate * later;
            /* The time of an edge is exact, the duration until then is rounded. */
            e->rounding[i][j] = i == 4 && timed ? 0 : ((i == j && j < 4) + rate * own) * size[j];
        }
    }
}

/* Integral over a step of the product of two polynomials, in shares of it. */
static real product(const real *a, const real *b)
{
    real sum = 0;
    for (int i = 0; i <= ORDER; i++)
        for (int k = 0; k <= ORDER; k++)
            sum += a[i] * b[k] / (i + k + 1);
    return sum;
}

static real energy(const real *z)
{
    const real front = z[0] > p.delta_1 ? z[0] - p.delta_1 : 0;
    const real back = stops == 2 && -z[0] > p.delta_2 ? -z[0] - p.delta_2 : 0;
    return ((z[1] + z[2]) * (z[1] + z[2]) + p.gamma * z[2] * z[2] + z[0] * z[0] +
            p.beta_1 * front * front + p.beta_2 * back * back) / 2 + p.s * (z[0] + z[3]);
}

static real supplied; /* by the drive, less damping and friction */

static void supply(field f, series *s, real u, real step)
{
    series part = *s;
    real *all[5] = {part.x, part.v, part.c, part.y, part.u}, power = 1;
    for (int k = 0; k <= ORDER; k++, power *= u)
        for (int i = 0; i < 5; i++)
            all[i][k] *= power;
    const real friction = f.way > 0 ? p.f_plus : f.way < 0 ? p.f_minus : 0;
    const real work = product(part.u, part.v) + (reacts ? 0 : product(part.u, part.c));
    supplied += u * step * (work - 2 * (real)p.zeta * product(part.v, part.v));
    supplied -= friction * f.way * (value(part.y, 1) - part.y[0]);
}

/* One segment from z at t; the time that is left to the end of the run and to the drive's edge. */
static enum status leg(field f, real *z, real *t, real left, real edge, int checked, segment *to)
{
    const real most = longest(f), total = edge < left ? edge : left;
    const char last = edge <= left ? (f.level ? 'R' : 'D') : 'E';
    state columns[4] = {{{1}}, {{0, 1}}, {{0, 0, 1}}, {{0}}};
    real gone = 0;
    int resting[4] = {0};
    sizes m = {0};
    static series s, by[4];
    guard g[4], first[4];
    grow(&m, f, z);
    for (;;) {
        real step = most < total - gone ? most : total - gone, u = 1, next = 2;
        int n, ends = 0, which = -1;
        for (int tries = 0;; tries++) {
            ends = step == total - gone;
            expand(f, z, *t + gone, step, 1, 1, &s);
            n = guards(f, &s, 1, g);
            memcpy(first, g, sizeof g);
            int clear = 1;
            for (int i = 0; i < n; i++) {
                if (gone == 0)
                    resting[i] = !deflate(g[i].g, terms(f, &g[i], &s));
                if (resting[i])
                    continue;
                if (!(g[i].g[0] > 0))
                    return NO_FIELD;
                if (size_of(value(g[i].g, 1)) <= (ends ? MEET : CLEAR) * largest(g[i].g))
                    clear = 0;
            }
            if (clear)
                break;
            if (ends || tries > 40)
                return CORNER;
            step *= (real)0.9;
        }
        for (int i = 0; i < n; i++) {
            if (resting[i])
                continue;
            const real root = first_root(g[i].g);
            if (root == -2)
                return UNDECIDED;
            if (root < 0)
                continue;
            if (root < u) {
                next = u, u = root, which = i;
            } else if (root < next)
                next = root;
        }
        if (which >= 0 && next - u < MEET)
            return CORNER;
        if (checked) {
            for (int j = 0; j < 4; j++)
                expand(f, columns[j].z, *t + gone, step, 0, j == 3 ? 2 : 0, &by[j]);
            supply(f, &s, u, step);
        }
        state here = {{value(s.x, u), value(s.v, u), value(s.c, u), value(s.y, u)}};
        memcpy(z, here.z, sizeof here.z);
        grow(&m, f, z);
        if (which >= 0 || ends) {
            const char event = which >= 0 ? g[which].event : last;
            const guard *own = which >= 0 ? &first[which] : NULL;
            to->duration = which >= 0 ? gone + u * step : total;
            to->gap_in_time = (next - u) * step;
            complete(&m, f, (double)to->duration);
            to->slope = own ? (double)(slope(own->g, u) / step) : 0;
            const double force = fmax(fmax(m.x, (double)stiffness(f) * m.gap), 2 * p.zeta * m.v);
            to->size = event == 'V' ? m.c : event == 'F' || event == 'B' ? m.x
                       : fmax(fmax(force, fmax(p.f_plus, p.f_minus)), reacts * p.alpha);
            if (checked)
                pass(&to->errors, f, event, by, &s, own, u, step, (double)to->duration, &m);
            to->event = event;
            if (event == 'V')
                z[2] = 0;
            if (event == 'F')
                z[0] = p.delta_1;
            if (event == 'B')
                z[0] = -(real)p.delta_2;
            memcpy(to->end.z, z, sizeof to->end.z);
            return DONE;
        }
        if (checked)
            for (int j = 0; j < 4; j++) {
                const state moved = {{value(by[j].x, 1), value(by[j].v, 1), value(by[j].c, 1),
                                      value(by[j].y, 1)}};
                columns[j] = moved;
            }
        gone += step;
    }
}

static void print(real a)
{
    const double high = (double)a;
    printf("[%.17g, %.17g]", high, (double)(a - high));
}

/* Sum over all segments of what their roundings come to at the end, in units of 2^-53. */
static void print_units(int count)
{
    double to[5][5] = {{0}}, unit[5] = {0};
    for (int i = 0; i < 5; i++)
        to[i][i] = 1;
    for (int k = count - 1; k >= 0; k--) {
        double back[5][5];
        for (int i = 0; i < 5; i++)
            for (int j = 0; j < 5; j++) {
                double own = 0;
                back[i][j] = 0;
                for (int l = 0; l < 5; l++) {
                    own += to[i][l] * run[k].errors.rounding[l][j];
                    back[i][j] += to[i][l] * run[k].errors.by[l][j];
                }
                unit[i] += fabs(own);
            }
        memcpy(to, back, sizeof to);
    }
    for (int i = 0; i < 4; i++)
        printf("%s%.6g", i ? ", " : "", unit[i]);
}

int main(int argc, char **argv)
{
    if (argc != 7)
        return 2;
    stops = atoi(argv[1]), pulsed = atoi(argv[2]), reacts = atoi(argv[3]);
    const double periods = atof(argv[4]);
    const long most = fmin(atof(argv[5]), ROOM);
    const int checked = atoi(argv[6]);
    double row[17];
    for (;;) {
        for (int i = 0; i < 17; i++)
            if (scanf("%lf", &row[i]) != 1)
                return i != 0;
        memcpy(&p, row, sizeof p);
        real z[4] = {row[13], row[14], row[15], 0}, t = row[16];
        const real began = energy(z);
        period = 2 * decimal(PI) / p.omega;
        supplied = 0;
        long turns = 0;
        int count = 0;
        field f = {pulsed && t >= p.D * period, 0, 0};
        enum status status = next_field(f.level, z, t, &f) ? DONE : NO_FIELD;
        while (status == DONE && turns < periods && count < most) {
            segment *to = &run[count];
            const real edge = !pulsed ? 1e30 : (f.level ? period : p.D * period) - t;
            to->f = f;
            status = leg(f, z, &t, ((real)periods - turns) * period - t, edge, checked, to);
            if (status != DONE)
                break;
            count++;
            const char event = to->event;
            t = event == 'D' ? p.D * period : t + to->duration;
            if (event == 'R' || event == 'E') {
                turns = event == 'E' ? (long)ceil(periods) : turns + 1;
                t = 0;
            }
            while (t >= period)
                t -= period, turns++;
            if (turns < periods && !next_field(event == 'D' ? 1 : event == 'R' ? 0 : f.level, z, t, &f))
                status = NO_FIELD;
        }
        if (status == DONE && turns < periods)
            status = AT_MOST;
        printf("{\"status\": \"%s\", \"state\": [", STATUS[status]);
        for (int i = 0; i < 4; i++) {
            printf("%s", i ? ", " : "");
            print(z[i]);
        }
        printf("], \"turns\": %ld, \"time\": ", turns);
        print(t);
        printf(", \"next\": %d", number(f));
        if (checked) {
            printf(", \"energy\": %.3g, \"unit\": [", (double)(energy(z) - began - supplied));
            print_units(count);
            printf("]");
        }
        printf(", \"segments\": [");
        for (int i = 0; i < count; i++) {
            printf("%s[%d, \"%c\", ", i ? ", " : "", number(run[i].f), run[i].event);
            print(run[i].duration);
            printf(", %.6g, %.6g, %.6g]", run[i].slope, run[i].size, (double)run[i].gap_in_time);
        }
        printf("]}\n");
    }
}
