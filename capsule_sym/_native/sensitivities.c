/* Derivatives of a run with respect to its start and the parameters: derivatives of its segments' closed
   forms, one after another. At a switch the time varies as well, such that the guard stays zero; propagated
   into the next segment this gives the saltation matrix. */
#include "chain.h"

#define N CAPSULE_SLOPE_COUNT
#define PHASE STATES /* among the slopes; the parameters follow */
#define OMEGA (PHASE + 1 + BY(omega) - BY_PARAMETER)

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
                 .start = capsule_start_of(s),
                 .time = ((double)s->start_period * TWO_PI + s->start_angle) / omega,
                 .at = at};
    for (int k = 0; k < N; k++)
        p.angle_by[k] = omega * at->time[k];
    p.angle_by[PHASE] += omega;
    p.angle_by[OMEGA] += p.time;
    return p;
}

/* Derivatives within the segment of the state and x_c some time after its start; at rest v_c is constant. */
static void rows_at(const passing *p, double h, double rows[ROWS][ROW])
{
    chain_rows(p->c, &p->start, h, rows);
    if (p->c->drift == 0.0)
        rows[2][2] = 1.0;
}

/* Total derivatives from those within the segment, at a time with derivatives `moved`. */
static void total(const passing *p, const double by[ROW], const double moved[N], double row[N])
{
    chain_total(by, &p->at->state[0][0], p->angle_by, moved, N, row);
}

/* Maps the derivatives across a switch: the time depends on the guard, and the state on the time. */
static void pass_switch(const passing *p, const capsule_constants *next, const capsule_segment *s,
                        capsule_slopes *to)
{
    double rows[ROWS][ROW], guard[ROW], later[N];
    const double still[N] = {0.0};
    rows_at(p, s->duration, rows);
    int same = next->contact == p->c->contact && next->drift == p->c->drift, edge = 0;
#if CAPSULE_PULSED
    edge = next->high != p->c->high;
    if (edge)
        chain_edge(p->c, s->duration, guard);
#endif
    if (same && !edge) {
        memset(later, 0, sizeof later);
    } else {
        if (!edge)
            chain_guard(p->c, next, &p->start, s->duration, s->end, rows, guard);
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
    return s->field >= 1 && s->field <= CAPSULE_FIELD_COUNT;
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
            double rows[ROWS][ROW], earlier[N];
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
