/* States of a run at any times, from its segments. At whole multiples of the reach of its flow's table the
   closed form gives the motion; in between it is expanded from there by that table, as in the map's own
   steps, at a tenth of the closed form's cost. These places do not depend on the requested times. */

/* An expansion of a segment, and the constants of its evaluation. */
typedef struct {
    const capsule_segment *of;
    double node, begins; /* reaches, and time, from the segment's start to its begin */
    const table *t;
    const segment *c;
    point begin;
    real a[TERMS], slope; /* coefficients of x_r, and v_c' reach */
    int drift, position; /* 1 if v_c varies; 1 if x_c is requested */
} interval;

static void interval_make(const capsule_map *map, const capsule_segment *s, const table *t,
                         double node, interval *p)
{
    const capsule_constants *k = p->c = &map->field[s->field - 1];
    p->of = s;
    p->drift = k->drift != 0.0;
    p->node = node;
    p->t = t;
    p->begins = node * t->reach;
    p->begin = (point){.x_r = s->start[0], .gap = s->gap, .v_r = s->start[1], .v_c = s->start[2],
                       .margin = s->margin, .cosine = s->cosine, .sine = s->sine,
                       .position = s->position};
    if (node > 0.0) {
        const capsule_start start = capsule_start_of(s);
        const double h = p->begins;
        double change[3] = {0.0, 0.0, 0.0};
        capsule_flow(k, &start, h, change);
        p->begin.x_r += change[0];
        p->begin.gap += change[0];
        p->begin.v_r = change[1];
        p->begin.v_c += change[2];
#if !CAPSULE_PULSED
        const double turned = k->omega * h, cosine = cos(turned), sine = sin(turned);
        p->begin.cosine = s->cosine * cosine - s->sine * sine;
        p->begin.sine = s->sine * cosine + s->cosine * sine;
#endif
        p->begin.margin = margin_at(k, p->begin.x_r, p->begin.gap, p->begin.v_r, p->begin.cosine);
        if (p->drift && p->position)
            p->begin.position += capsule_flow_advance(k, &start, change[0], h);
    }
    const expansion e = expand(k, k, t, p->drift, &p->begin);
    p->slope = e.slope;
    for (int n = 0; n < TERMS; n++)
        p->a[n] = combined(e.u, t->x, n);
}

static void interval_state(const interval *p, double h, double state[4])
{
    const double s = (h - p->begins) * p->t->per_reach;
    const motion m = motion_at(p->a, s, p->drift, p->position);
    state[0] = p->begin.x_r + m.x;
    state[1] = (p->a[0] + m.slope) * p->t->per_reach;
    state[2] = 0.0;
    state[3] = p->begin.position;
    if (p->drift) {
        state[2] = p->begin.v_c + v_c_change(p->c, p->t, p->slope, &m, s);
        if (p->position)
            state[3] += advance_at(p->c, p->t, p->slope, &m, p->begin.v_c, s);
    }
}

/* An excitation period in two parts. */
typedef struct {
    double period, rest, omega;
} period_parts;

/* Time elapsed since so many periods and a forcing angle. Subtracting whole periods makes no error that grows
   with them. */
static double since(const period_parts *c, int64_t periods, double angle, double time)
{
    return fma(-(double)periods, c->period, time) - ((double)periods * c->rest + angle / c->omega);
}

static int begun(const period_parts *c, const capsule_segment *s, double time)
{
    return since(c, s->start_period, s->start_angle, time) >= 0.0;
}

/* Last segment that has begun, by a search from `at` in growing steps ahead, or just before it. */
static size_t segment_of_time(const period_parts *c, const capsule_segment *segments, size_t count,
                              size_t at, double time)
{
    size_t step = 1, high = count;
    while (at > 0 && !begun(c, &segments[at], time))
        at--;
    while (count - at > step) {
        if (!begun(c, &segments[at + step], time)) {
            high = at + step;
            break;
        }
        at += step;
        step *= 2;
    }
    while (high - at > 1) {
        const size_t middle = at + (high - at) / 2;
        if (begun(c, &segments[middle], time))
            at = middle;
        else
            high = middle;
    }
    return at;
}

static size_t states_at(const capsule_map *map, const capsule_segment *segments, size_t count, int more,
                        int position, const double *times, size_t n, double (*states)[4],
                        capsule_watch *watch)
{
    const double omega = map->parameters.omega, period = TWO_PI / omega;
    const period_parts c = {period, (fma(-period, omega, TWO_PI) + TWO_PI_REST) / omega, omega};
    interval p = {.of = 0, .position = position};
    size_t at = 0;
    for (size_t i = 0; i < n && count; i++) {
        if (i % 8 == 7 && capsule_asked(watch, 8)) /* as if each were on an expansion of its own */
            return i;
        const double time = times[i];
        at = segment_of_time(&c, segments, count, at, time);
        const capsule_segment *s = &segments[at];
        if (s->field < 1 || s->field > CAPSULE_FIELD_COUNT)
            return i;
        if (more && at == count - 1 && since(&c, s->end_period, s->end_angle, time) >= 0.0)
            return i;
        double h = since(&c, s->start_period, s->start_angle, time);
        if (h >= s->duration) {
            const double end[4] = {s->end[0], s->end[1], s->end[2], s->position + s->advance};
            memcpy(states[i], end, sizeof end);
            continue;
        }
        h = h > 0.0 ? h : 0.0;
        const table *t = &map->table[FLOW_OF[s->field - 1]];
        const double node = floor(h * t->per_reach);
        if (p.of != s || p.node != node)
            interval_make(map, s, t, node, &p);
        interval_state(&p, h, states[i]);
    }
    return count ? n : 0;
}
