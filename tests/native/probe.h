/* Claims of the certified step about one expansion after another, lane by lane, for a judge. Included
   after the step, at each width. */
#ifndef PROBED
#define PROBED
typedef struct {
    double zeros, rounding, tail, value[30][2];
} probed_guard;
typedef struct {
    probed_guard guard[3];
    double reach, degree, open, crossing, undetermined, at_gap, way, error;
    double h[2], x_r[2], gap[2], v_r[2], v_c[2], angle[3];
    double energy_error, v_c_error, angle_error;
} probed;
typedef struct {
    double x_r, v_r, v_c, angle, gap_zeros, second_zeros, energy_error, v_c_error, angle_error;
} probe_start;
#endif

#if WIDTH == 1
#define LANE(a, l) (a)
#else
#define LANE(a, l) ((a)[l])
#endif
#ifdef WIDE
#define BOTH(to, a, l) ((to)[0] = (a).hi, (to)[1] = (a).lo)
#define PUT(a, l, number) ((a) = num(number))
#else
#define BOTH(to, a, l) ((to)[0] = LANE(a, l), (to)[1] = 0.0)
#define PUT(a, l, number) (LANE(a, l) = (number))
#endif

/* Expansions from a start in each lane until one of them switches or stays open; how many. */
int PROBE(const capsule_parameters *p, int field, int level, int steps, const probe_start *starts,
          probed *out)
{
    static capsule_map map;
    capsule_map_make(p, &map);
    const capsule_constants *k = &map.field[field - 1];
    const int drift = DRIFT_OF[field - 1] != 0;
    const bound way = all(DRIFT_OF[field - 1]);
    segment c_room;
    segment_sizes b_room;
#if WIDTH == 1
    const segment *c = segment_of(&map, field, &c_room);
#else
    const segment *c = &c_room;
    c_room = (segment){all(k->alpha), all(k->omega), all(k->delta), all(k->zeta), all(k->beta),
                       all(k->gamma), all(k->f_b), all(k->contact), way, all(k->m), all(k->kappa),
                       all(k->push), all(k->friction), all(k->sigma), all(k->K)};
#endif
    const segment_sizes *b = sizes_of(c, &b_room);
#ifdef WIDE
    static bases base;
    static table made;
    const table *t = &made;
    bases_make(&base);
    table_make(&base, k, c, &made);
#else
    const table *t = &map.table[2 * (k->contact != 0.0) + drift];
#endif
    point s, to;
    memset(&s, 0, sizeof s);
    for (int l = 0; l < WIDTH; l++) {
        const probe_start *a = &starts[l];
        PUT(s.x_r, l, a->x_r);
        PUT(s.v_r, l, a->v_r);
        PUT(s.v_c, l, a->v_c);
        PUT(s.angle, l, a->angle);
        LANE(s.gap_zeros, l) = a->gap_zeros;
        LANE(s.second_zeros, l) = a->second_zeros;
        LANE(s.energy_error, l) = a->energy_error;
        LANE(s.v_c_error, l) = a->v_c_error;
        LANE(s.angle_error, l) = a->angle_error;
    }
    s.gap = choose(s.gap_zeros > 0.0, num(0.0), sub(s.x_r, c->delta));
    sine_cosine(s.angle, s.angle_rest, &s.sine, &s.cosine);
    const mask bounded = drift ? s.second_zeros == 2.0 : s.second_zeros != 0.0;
    s.margin = choose(bounded, drift ? num(0.0) : mul(wide(s.second_zeros), c->f_b),
                      margin_at(c, s.x_r, s.gap, s.v_r, s.cosine));
    for (int i = 0; i < steps; i++, s = to) {
        const expansion e = expand(c, b, t, drift, &s);
        const bound signs[3] = {all(t->contact ? 1.0 : -1.0), drift ? way : all(-1.0), all(1.0)};
        outcome o;
        for (int j = 0; j < (drift ? 2 : 3); j++) {
            guard g = guard_of(c, &e, &s, j, drift, signs[j]);
            form_of(t, &e, j, level, drift, NULL, &g);
            for (int l = 0; l < WIDTH; l++) {
                probed_guard *seen = &out[i * WIDTH + l].guard[j];
                seen->zeros = LANE(g.zeros, l);
                seen->rounding = LANE(g.rounding, l);
                seen->tail = LANE(g.tail, l);
                const real base = choose(g.zeros > 0.0, num(0.0), g.first);
                BOTH(seen->value[0], base, l);
                for (int n = 1; n <= DEGREE; n++) {
                    const real value = add(base, g.form[n - 1]);
                    BOTH(seen->value[n], value, l);
                }
            }
        }
        step(c, b, t, level, drift, 0, 0, way, all(0.0), &s, &to, &o);
        for (int l = 0; l < WIDTH; l++) {
            probed *q = &out[i * WIDTH + l];
            q->reach = t->reach;
            q->degree = DEGREE;
            q->open = LANE(o.open, l) != 0;
            q->crossing = LANE(o.crossing, l) != 0;
            q->undetermined = LANE(o.undetermined, l) != 0;
            q->at_gap = LANE(o.at_gap, l) != 0;
            q->way = LANE(o.way, l);
            q->error = LANE(o.error, l);
            BOTH(q->h, o.h, l);
            BOTH(q->x_r, to.x_r, l);
            BOTH(q->gap, to.gap, l);
            BOTH(q->v_r, to.v_r, l);
            BOTH(q->v_c, to.v_c, l);
            BOTH(q->angle, to.angle, l);
            q->angle[2] = LANE(to.angle_rest, l);
            q->energy_error = LANE(to.energy_error, l);
            q->v_c_error = LANE(to.v_c_error, l);
            q->angle_error = LANE(to.angle_error, l);
        }
        if (some(o.open | o.crossing))
            return i + 1;
    }
    return steps;
}

#ifndef NAMED
#define JOINED(a, b) a##b
#define NAMED(a, b) JOINED(a, b)
#endif
static capsule_stop probed_run(const capsule_parameters *p, int64_t periods, int alone,
                               capsule_state *state, capsule_event *event)
{
    if (WIDTH > 1 && !alone) {
        static capsule_workspace workspace;
        capsule_parameters rows[WIDTH];
        capsule_state states[WIDTH];
        capsule_event events[WIDTH];
        int8_t stops[WIDTH];
        const capsule_batch batch = {.stride = 1, .parameters = rows, .states = states,
                                     .stops = stops, .lanes = WIDTH, .first = event ? events : NULL};
        for (int l = 0; l < WIDTH; l++)
            rows[l] = *p, states[l] = *state;
        capsule_run_many(&batch, WIDTH, periods, &workspace);
        *state = states[0];
        if (event)
            *event = events[0];
        return stops[0];
    }
    static capsule_map map;
    size_t written;
    capsule_outcome open;
    const capsule_request request = {.events = event, .room = 1,
                                     .precision = sizeof(real) / sizeof(bound) > 1
                                                      ? CAPSULE_DOUBLE_DOUBLE
                                                      : CAPSULE_AS_NEEDED};
    capsule_map_make(p, &map);
    return capsule_run(&map, state, periods, &request, &written, &open);
}

static capsule_state probed_state(const capsule_parameters *p, int field, const probe_start *a)
{
    return (capsule_state){.x_r = a->x_r, .gap = a->gap_zeros > 0.0 ? 0.0 : a->x_r - p->delta,
                           .v_r = a->v_r, .v_c = a->v_c, .angle = a->angle, .field = field};
}

/* True if a run of one period can continue for another. */
int NAMED(PROBE, _goes_on)(const capsule_parameters *p, int field, const probe_start *a)
{
    capsule_state state = probed_state(p, field, a);
    return probed_run(p, 1, 0, &state, NULL) == CAPSULE_DONE &&
           probed_run(p, 2, 0, &state, NULL) == CAPSULE_DONE;
}

/* Compares the first switch with that of a run alone: 2 to the last bit, 1 but for roundings. */
static int NAMED(PROBE, _alike)(const capsule_parameters *p, int field, const probe_start *a)
{
    capsule_state state = probed_state(p, field, a), other = state;
    capsule_event event = {0}, alone = {0};
    const int stop = probed_run(p, 1, 0, &state, &event);
    if (stop != (int)probed_run(p, 1, 1, &other, &alone))
        return 0;
    if (stop != CAPSULE_FULL) /* no switch comes */
        return 2;
    if (event.period != alone.period ||
        event.field != alone.field || event.plane != alone.plane || state.field != other.field)
        return 0;
    return memcmp(&state, &other, offsetof(capsule_state, period)) == 0 ? 2
           : fabs(event.angle - alone.angle) < 1e-9;
}

int NAMED(PROBE, _as_alone)(const capsule_parameters *p, int field, const probe_start *a)
{
    return NAMED(PROBE, _alike)(p, field, a) > 0;
}

int NAMED(PROBE, _the_same_as_alone)(const capsule_parameters *p, int field, const probe_start *a)
{
    return NAMED(PROBE, _alike)(p, field, a) > 1;
}

#if WIDTH == 1
static point probed_point(const segment *c, int field, const probe_start *a)
{
    const real gap = a->gap_zeros > 0.0 ? num(0.0) : sub(num(a->x_r), c->delta);
    const int way = DRIFT_OF[field - 1];
    const int at_bound = way ? way * (a->second_zeros == 2.0) : (int)a->second_zeros;
    const known start = {num(a->x_r), gap, num(a->v_r), num(a->v_c), num(a->angle), 0.0, at_bound};
    point s = point_at(c, field, &start, NULL);
    s.energy_error = a->energy_error, s.v_c_error = a->v_c_error, s.angle_error = a->angle_error;
    return s;
}

/* 1 if a field is the successor at a start, else 0; -1 if undecided. */
int NAMED(PROBE, _successor)(const capsule_parameters *p, int field, const probe_start *a)
{
    static capsule_map map;
    capsule_map_constants(p, &map);
    segment room;
    const segment *c = segment_of(&map, field, &room);
    const point s = probed_point(c, field, a);
    const int way = DRIFT_OF[field - 1];
    const int at_bound = way ? way * (a->second_zeros == 2.0) : (int)a->second_zeros;
    const known start = {s.x_r, s.gap, s.v_r, s.v_c, s.angle, s.angle_rest, at_bound};
    return is_successor(c, field, &start);
}

/* True if a segment of a field is claimed to rest forever. */
int NAMED(PROBE, _rests)(const capsule_parameters *p, int field, const probe_start *a)
{
    static capsule_map map;
    capsule_map_constants(p, &map);
    segment room;
    const segment *c = segment_of(&map, field, &room);
    const point s = probed_point(c, field, a);
    return rests_forever(c, &map.field[field - 1], &s);
}

/* True if one is claimed to rest for eight periods. */
int NAMED(PROBE, _lasts)(const capsule_parameters *p, int field, const probe_start *a)
{
    static capsule_map map;
    capsule_map_constants(p, &map);
    segment room;
    const segment *c = segment_of(&map, field, &room);
    const point s = probed_point(c, field, a);
    return p->omega * rest_lasts(c, &s) > 8.0 * TWO_PI;
}
#endif
#undef LANE
#undef BOTH
#undef PUT
