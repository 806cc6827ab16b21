/* How a run depends on its start and on the parameters: derivatives of its segments' closed forms,
   one after another. At a switch the time moves as well, by what keeps the guard at zero; carried
   into the next segment that is the saltation. */
#include <string.h>

#include "number.h"

#define N 11
#define PHASE 3    /* among the slopes; the parameters from 4 on */
#define OMEGA 5
#define BY_ANGLE 3 /* columns of the closed form's derivatives: state, angle, time, parameters */
#define BY_TIME 4
#define COLUMNS 12

/* A segment with its place in the derivatives. */
typedef struct {
    const capsule_constants *c;
    capsule_start start;
    double time, angle_by[N];
    const capsule_slopes *at;
} passing;

static passing passing_of(const capsule_map *map, const capsule_segment *s,
                          const capsule_slopes *at)
{
    const double omega = map->parameters.omega;
    passing p = {.c = &map->field[s->field - 1],
                 .start = {s->start[0], s->gap, s->start[1], s->start[2], s->margin, s->cosine,
                           s->sine},
                 .time = ((double)s->start_period * TWO_PI + s->start_angle) / omega,
                 .at = at};
    for (int k = 0; k < N; k++)
        p.angle_by[k] = omega * at->time[k];
    p.angle_by[PHASE] += omega;
    p.angle_by[OMEGA] += p.time;
    return p;
}

/* Derivatives within the segment of the state and x_c a time after its start; at rest v_c stays. */
static void rows_at(const passing *p, double h, double rows[4][COLUMNS])
{
    memset(rows, 0, 4 * sizeof *rows);
    capsule_jacobian(p->c, &p->start, h, &rows[0][0]);
    if (p->c->drift == 0.0)
        rows[2][2] = 1.0;
}

/* Total derivatives of what has these within the segment, at a time that has `moved`. */
static void total(const passing *p, const double by[COLUMNS], const double moved[N], double row[N])
{
    for (int k = 0; k < N; k++)
        row[k] = by[0] * p->at->state[0][k] + by[1] * p->at->state[1][k] +
                 by[2] * p->at->state[2][k] + by[BY_ANGLE] * p->angle_by[k] +
                 by[BY_TIME] * moved[k];
    for (int k = 4; k < N; k++)
        row[k] += by[k + 1];
}

/* The guard that ends a segment, as a row of derivatives like those of the state: of x_r - delta
   where contact changes, of v_c where a slip ends, else of P less the bound that it passes. */
static void guard_row(const passing *p, const capsule_constants *next, const double end[3],
                      double rows[4][COLUMNS], double guard[COLUMNS])
{
    enum { DELTA = BY_TIME + 3, ZETA, BETA, GAMMA, F_B };
    const capsule_constants *c = p->c;
    const int impact = c->contact != next->contact;
    if (impact || c->drift != 0.0) {
        memcpy(guard, rows[impact ? 0 : 2], COLUMNS * sizeof *guard);
        guard[DELTA] -= impact;
        return;
    }
    double by_delta, by_zeta, by_beta;
    for (int i = 0; i < COLUMNS; i++)
        guard[i] = force_change(c, rows[0][i], rows[1][i]);
    force_slopes(c, end[0] - c->delta, end[1], &by_delta, &by_zeta, &by_beta);
    guard[DELTA] += by_delta;
    guard[ZETA] += by_zeta;
    guard[BETA] += by_beta;
    guard[F_B] -= next->drift;
}

/* Takes the derivatives over a switch: the time follows the guard, and the state the time. */
static void pass_switch(const passing *p, const capsule_constants *next, const capsule_segment *s,
                        capsule_slopes *to)
{
    double rows[4][COLUMNS], guard[COLUMNS], later[N];
    const double still[N] = {0.0};
    rows_at(p, s->duration, rows);
    if (next->contact == p->c->contact && next->drift == p->c->drift) {
        memset(later, 0, sizeof later);
    } else {
        guard_row(p, next, s->end, rows, guard);
        total(p, guard, still, later);
        for (int k = 0; k < N; k++)
            later[k] /= -guard[BY_TIME];
    }
    for (int i = 0; i < 4; i++)
        total(p, rows[i], later, to->state[i]);
    for (int k = 0; k < N; k++) {
        to->state[3][k] += p->at->state[3][k];
        to->time[k] = p->at->time[k] + later[k];
    }
    if (next->drift == 0.0)
        memset(to->state[2], 0, sizeof to->state[2]);
}

capsule_stop capsule_slopes_start(capsule_slopes *at)
{
    if (!at)
        return CAPSULE_REFUSED;
    memset(at, 0, sizeof *at);
    for (int i = 0; i < 3; i++)
        at->state[i][i] = 1.0;
    return CAPSULE_DONE;
}

static int is_field(const capsule_segment *s)
{
    return s->field >= 1 && s->field <= 6;
}

size_t capsule_differentiate(const capsule_map *map, const capsule_segment *segments, size_t count,
                             capsule_slopes *at, double (*switches)[N], const double *times,
                             size_t n, double (*slopes)[4][N + 1],
                             capsule_watch *watch)
{
    if (!map || !segments || !at || (n && (!times || !slopes)))
        return 0;
    const double omega = map->parameters.omega;
    size_t done = 0;
    for (size_t i = 0; i < count; i++) {
        const capsule_segment *s = &segments[i];
        const int last = i + 1 == count;
        if (!is_field(s) || !(last || is_field(s + 1)) || capsule_asked(watch, 4))
            return i;
        const passing p = passing_of(map, s, at);
        const double end = ((double)s->end_period * TWO_PI + s->end_angle) / omega;
        for (; done < n && (last || times[done] < end); done++) {
            double rows[4][COLUMNS], earlier[N];
            for (int k = 0; k < N; k++)
                earlier[k] = -at->time[k];
            rows_at(&p, times[done] - p.time, rows);
            for (int row = 0; row < 4; row++) {
                total(&p, rows[row], earlier, slopes[done][row]);
                slopes[done][row][N] = rows[row][BY_TIME];
            }
            for (int k = 0; k < N; k++)
                slopes[done][3][k] += at->state[3][k];
        }
        if (last)
            break;
        capsule_slopes next;
        pass_switch(&p, &map->field[segments[i + 1].field - 1], s, &next);
        *at = next;
        if (switches)
            memcpy(switches[i], at->time, sizeof at->time);
    }
    return count;
}
