/* Claims of the step for one run about one expansion after another, in any scene, for a judge. Included
   after the step. */
#include <string.h>

typedef struct {
    double zeros, rounding, tail, value[30][2];
} probed_guard;
typedef struct {
    probed_guard guard[4];
    double reach, degree, open, crossing, undetermined, at_gap, way, error;
    double h[2], x_r[2], gap[2], v_r[2], v_c[2], angle[3];
    double energy_error, v_c_error, angle_error, edge;
} probed;
typedef struct {
    double x_r, v_r, v_c, angle, bound_at, energy_error, v_c_error, angle_error;
} probe_start;

#ifdef WIDE
#define BOTH(to, a) ((to)[0] = (a).hi, (to)[1] = (a).lo)
#else
#define BOTH(to, a) ((to)[0] = (a), (to)[1] = 0.0)
#endif

static point probed_point(const segment *c, int field, const probe_start *a)
{
    known start = {.x_r = num(a->x_r), .v_r = num(a->v_r), .v_c = num(a->v_c),
                   .angle = num(a->angle), .bound_at = (int)a->bound_at};
    start.gap = sub(start.x_r, c->CAPSULE_FRONT_GAP);
#if TWO_STOPS
    start.back = add(start.x_r, c->CAPSULE_BACK_GAP);
#endif
    point s = point_at(c, field, &start, NULL);
    s.energy_error = a->energy_error, s.v_c_error = a->v_c_error, s.angle_error = a->angle_error;
    return s;
}

static void see(const expansion *e, const segment *c, const table *t, const point *s, int drift, int way,
                probed *to)
{
    const double signs[4] = {t->contact == 1 ? 1.0 : -1.0, drift ? way : -1.0, 1.0, 1.0};
    int seen = 0;
    for (int j = 0; j < GUARDS; j++) {
        if (!watched(j, drift, t))
            continue;
        guard g = guard_of(c, e, s, j, drift, signs[j]);
        form_of(t, e, j, 0, drift, NULL, &g);
        probed_guard *q = &to->guard[seen++];
        q->zeros = g.zeros, q->rounding = g.rounding, q->tail = g.tail;
        const real base = g.zeros > 0.0 ? num(0.0) : g.first;
        BOTH(q->value[0], base);
        for (int n = 1; n <= DEGREE; n++) {
            const real value = add(base, g.form[n - 1]);
            BOTH(q->value[n], value);
        }
    }
}

/* Expansions from a start until one of them switches or stays open; how many. */
int PROBE(const capsule_parameters *p, int field, int steps, const probe_start *start, probed *out)
{
    static capsule_map map;
    if (capsule_map_make(p, &map) != CAPSULE_DONE)
        return -1;
    const int way = DRIFT_OF[field - 1], drift = way != 0;
    segment c_room;
    segment_sizes b_room;
    const segment *c = segment_of(&map, field, &c_room);
    const segment_sizes *b = sizes_of(c, &b_room);
#ifdef WIDE
    static bases base;
    static table made;
    const table *t = &made;
    bases_make(&base);
    table_make(&base, &map.field[field - 1], c, &made);
#else
    const table *t = &map.table[FLOW_OF[field - 1]];
#endif
    point s = probed_point(c, field, start), to;
    for (int i = 0; i < steps; i++, s = to) {
        const expansion e = expand(c, b, t, drift, &s);
        outcome o;
        probed *q = &out[i];
        memset(q, 0, sizeof *q);
        see(&e, c, t, &s, drift, way, q);
        step(c, b, t, 0, drift, 0, 0, way, 0.0, &s, &to, &o);
        q->reach = t->reach, q->degree = DEGREE;
        q->open = o.open, q->crossing = o.crossing, q->undetermined = o.undetermined, q->edge = o.edge;
        q->at_gap = o.at_gap, q->way = o.way, q->error = o.error;
        BOTH(q->h, o.h);
        BOTH(q->x_r, to.x_r);
        BOTH(q->gap, to.gap);
        BOTH(q->v_r, to.v_r);
        BOTH(q->v_c, to.v_c);
        BOTH(q->angle, to.angle);
        q->angle[2] = to.angle_rest;
        q->energy_error = to.energy_error, q->v_c_error = to.v_c_error, q->angle_error = to.angle_error;
        if (o.open || o.crossing)
            return i + 1;
    }
    return steps;
}

#if !CAPSULE_PULSED
/* True if a segment of a field is claimed to rest forever. */
int RESTS(const capsule_parameters *p, int field, const probe_start *start)
{
    static capsule_map map;
    capsule_map_constants(p, &map);
    segment room;
    const segment *c = segment_of(&map, field, &room);
    const point s = probed_point(c, field, start);
    return rests_forever(c, &map.field[field - 1], &s);
}
#endif
#undef BOTH
