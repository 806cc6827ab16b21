/* Segments of one run, one after another: the successor field, the steps of its segment, and the facts
   known exactly at its end. Over the double or double-double of number.h. */
#include <string.h>

#include "internal.h"
#include "step.h"

#include "isolate.h"

/* A segment that takes more is undecided: another method reaches further there. */
#define MOST_EXPANSIONS 8192

/* A state with its exactly known facts, as in capsule_state. */
typedef struct {
    real x_r, gap, v_r, v_c, angle;
    double angle_rest;
    int bound_at;
#if TWO_STOPS
    real back; /* `gap` is to the stop in front, this to the stop behind */
#endif
} known;

#ifdef WIDE
static const segment *segment_of(const capsule_map *map, int field, segment *room)
{
    const capsule_parameters *p = &map->parameters;
#define GIVEN(name) .name = num(p->name),
    *room = (segment){CAPSULE_PARAMETERS(GIVEN)};
    field_constants(field, room);
    return room;
}

/* Near the impact surface the gap is the known quantity, elsewhere the position. */
static known known_of(const capsule_map *map, const capsule_state *s, const capsule_exact *exact)
{
    const real front = num(map->parameters.CAPSULE_FRONT_GAP);
#if TWO_STOPS
    const real behind = num(map->parameters.CAPSULE_BACK_GAP);
#endif
    if (exact->known)
        return (known){{exact->x_r[0], exact->x_r[1]}, {exact->gap[0], exact->gap[1]},
                       {exact->v_r[0], exact->v_r[1]}, {exact->v_c[0], exact->v_c[1]},
                       {exact->angle[0], exact->angle[1]}, 0.0, s->bound
#if TWO_STOPS
                       , {exact->back[0], exact->back[1]}
#endif
        };
    const int far = 2.0 * fabs(s->gap) > front.hi;
    known p = {num(s->x_r), num(s->gap), num(s->v_r), num(s->v_c),
               whole_sum(s->angle, s->angle_rest), .bound_at = s->bound};
    p.x_r = far ? p.x_r : add(front, p.gap);
#if TWO_STOPS
    const int far_behind = !far || 2.0 * fabs(s->back) > behind.hi;
    p.x_r = far_behind ? p.x_r : sub(num(s->back), behind);
    p.back = far_behind ? add(p.x_r, behind) : num(s->back);
#endif
    p.gap = far ? sub(p.x_r, front) : p.gap;
    return p;
}
#else
static const segment *segment_of(const capsule_map *map, int field, segment *room)
{
    (void)room;
    return &map->field[field - 1];
}

static known known_of(const capsule_map *map, const capsule_state *s, const capsule_exact *exact)
{
    (void)map, (void)exact;
    return (known){s->x_r, s->gap, s->v_r, s->v_c, s->angle, s->angle_rest, s->bound
#if TWO_STOPS
                   , s->back
#endif
    };
}
#endif

#if TWO_STOPS
/* Gaps of a point to its field's stop and the other one, from those in front and behind, or these from
   those: in contact behind they change places. */
static void gaps_of(int contact, real first, real second, real *own, real *other)
{
    *own = contact == 2 ? second : first;
    *other = contact == 2 ? first : second;
}
#endif

/* Start of a segment of a field. */
static point point_at(const segment *c, int field, const known *p, const capsule_context *context)
{
    const int way = DRIFT_OF[field - 1];
    const double bound_at = p->bound_at;
    point s = {.x_r = p->x_r, .gap = p->gap, .v_r = p->v_r, .v_c = p->v_c, .angle = p->angle,
               .position = num(0.0), .angle_rest = p->angle_rest};
#ifndef WIDE
    if (context && context->angle == p->angle)
        s.sine = context->sine, s.cosine = context->cosine;
    else
#else
    (void)context;
#endif
        phase_terms(p->angle, p->angle_rest, &s.sine, &s.cosine);
    int touches = near_to(p->gap) == 0.0;
#if TWO_STOPS
    gaps_of(CONTACT_OF[field - 1], p->gap, p->back, &s.gap, &s.other);
    touches |= near_to(p->back) == 0.0;
#endif
    s.margin = bound_at != 0.0 ? sub(friction_at(c, num(bound_at)), c->friction)
                               : margin_at(c, p->x_r, s.gap, p->v_r, s.cosine);
    if (touches)
        s.gap_zeros = near_to(p->v_r) == 0.0 ? 2.0 : 1.0;
    if (!way)
        s.second_zeros = bound_at;
    else if (near_to(p->v_c) == 0.0)
        s.second_zeros = bound_at == way ? 2.0 : 1.0;
    return s;
}

/* Sign of the first of a guard's derivatives that does not vanish exactly; 0 if rounding hides it. */
static int first_sign(const double *values, const double *errors, int exact)
{
    if (!(fabs(values[exact]) > errors[exact]))
        return 0;
    return values[exact] > 0.0 ? 1 : -1;
}

/* 1 if the field is the successor, all of its guards being positive just after; 0 if it is not, -1 if
   undecided. Derivatives come with a bound on their rounding error. */
static int is_successor(const segment *c, int field, const known *p)
{
    segment_sizes room;
    const segment_sizes *b = sizes_of(c, &room);
    const point s = point_at(c, field, p, NULL);
    const double way = DRIFT_OF[field - 1];
    const double x = size_of(near_to(s.x_r)), gap = size_of(near_to(s.gap));
    const double v = size_of(near_to(s.v_r));
    const real rate = v_rate(c, s.x_r, s.gap, s.v_r, s.cosine);
    const double rate_size = v_rate_size(b, x, gap, v);
    const double margin_error = MARGIN_AT_UNITS * UNIT * margin_at_size(b, x, gap, v);
    const real force_rate = pull_rate(c, s.v_r, rate, s.sine);
    const double force_error = (PULL_RATE_UNITS + V_RATE_UNITS) * UNIT *
                               pull_rate_size(b, v, rate_size);
    double side = CONTACT_OF[field - 1] == 1 ? 1.0 : -1.0, from_stop = near_to(s.gap);
#if TWO_STOPS
    if (!CONTACT_OF[field - 1] && near_to(s.other) == 0.0)
        side = 1.0, from_stop = 0.0;
#endif
    const double gaps[3] = {side * from_stop, side * near_to(s.v_r), side * near_to(rate)};
    const double gap_errors[3] = {0.0, 0.0, V_RATE_UNITS * UNIT * rate_size};
    int sign = first_sign(gaps, gap_errors, (int)s.gap_zeros), open = sign == 0;
    if (sign < 0)
        return 0;
    if (way != 0.0) {
        const double values[3] = {way * near_to(s.v_c), way * near_to(v_c_rate(c, s.margin)),
                                  way * near_to(v_c_rate(c, force_rate))};
        const double errors[3] = {0.0, margin_error / b->gamma, force_error / b->gamma};
        sign = first_sign(values, errors, (int)s.second_zeros);
        return sign < 0 ? 0 : (open || sign == 0) ? -1 : 1;
    }
    for (int turn = -1; turn <= 1; turn += 2) {
        const double first = near_to(friction_guard(c, num(turn), s.margin));
        const double values[2] = {first, turn * near_to(force_rate)};
        const double errors[2] = {margin_error, force_error}; /* a sum has its sign exactly */
        sign = first_sign(values, errors, p->bound_at == -turn);
        if (sign < 0)
            return 0;
        open |= sign == 0;
    }
    return open ? -1 : 1;
}

/* Level of the drive at an angle, 0 for the high one of pulses; at an edge the level after it. */
static int level_at(const capsule_map *map, const known *p)
{
#if CAPSULE_PULSED
    segment room;
    const segment *c = segment_of(map, FIELD_OF[0][0][1], &room);
    real fall;
    bound rest;
    edge_angle(c, &fall, &rest);
    return near_to(add(sub(p->angle, fall), wide(p->angle_rest - rest))) >= 0.0;
#else
    (void)map, (void)p;
    return 0;
#endif
}

/* Contact just after, from the gaps in front and behind (the latter 0 or more without that stop), numbered
   as for fields; -1 if the mass touches a stop with v_r = 0. */
static int contact_at(double gap, double back, double v_r)
{
    if ((gap == 0.0 || (TWO_STOPS && back == 0.0)) && v_r == 0.0)
        return -1;
    if (gap > 0.0 || (gap == 0.0 && v_r > 0.0))
        return 1;
    return TWO_STOPS && (back < 0.0 || (back == 0.0 && v_r < 0.0)) ? 2 : 0;
}

static int is_apart(int contact, double gap, double back)
{
    return contact == 0 ? gap > 0.0 || (TWO_STOPS && back < 0.0) : contact == 1 ? gap < 0.0 : back > 0.0;
}

/* Successor field of a level: the one all of whose guards are positive just after. */
static int successor_of(const capsule_map *map, const known *p, int level)
{
#if TWO_STOPS
    const double back = near_to(p->back);
#else
    const double back = INFINITY;
#endif
    const double gap = near_to(p->gap), v_r = near_to(p->v_r), v_c = near_to(p->v_c);
    const int contact = contact_at(gap, back, v_r);
    if (contact >= 0 && !p->bound_at) {
        const int rest = FIELD_OF[level][contact][1];
        segment c_room;
        segment_sizes b_room;
        const segment *c = segment_of(map, rest, &c_room);
        const point s = point_at(c, rest, p, NULL);
        int undetermined;
        const double way = direction_after(c, sizes_of(c, &b_room), &s, p->bound_at, &undetermined);
        if (!undetermined)
            return FIELD_OF[level][contact][(int)way + 1];
    }
    int found = 0;
    for (int field = 1; field <= CAPSULE_FIELD_COUNT; field++) {
        if (is_apart(CONTACT_OF[field - 1], gap, back) ||
            (v_c != 0.0 && DRIFT_OF[field - 1] != (v_c > 0.0 ? 1 : -1)) ||
            LEVEL_OF[field - 1] != level)
            continue;
        segment room;
        const int taken = is_successor(segment_of(map, field, &room), field, p);
        if (taken < 0 || (taken && found))
            return 0;
        if (taken)
            found = field;
    }
    return found;
}

#if !CAPSULE_PULSED
/* True if a sticking segment without contact is proved to last forever. */
static int rests_forever(const segment *c, const capsule_constants *k, const point *s)
{
    segment_sizes room;
    const segment_sizes *b = sizes_of(c, &room);
    /* Near resonance the response magnifies the rounding of K - omega^2. It is counted as at least 32
       units, to include roundings below and that of the centre of the motion: an error of x_r and v_r adds
       to the energy. */
    const double distance = sqrt(k->Z2), rounded = 4.0 * 0x1p-53 * (b->K + b->omega * b->omega);
    const double relative = larger(8.0 * rounded / distance, 32.0 * 0x1p-53);
    const double amplitude = b->alpha / distance;
    real x, v;
    forced(c, s->cosine, s->sine, &x, &v);
    const double roundings =
        (relative + s->angle_error) *
        (fabs(near_to(s->v_r)) + fabs(near_to(s->x_r)) + fabs(near_to(rest_centre(c))) +
         (1.0 + b->omega) * amplitude);
    const double error = s->energy_error + roundings;
    const double low = fabs(near_to(sub(sub(s->x_r, rest_centre(c)), x))) + error;
    const double high = fabs(near_to(sub(s->v_r, v))) + error;
    const double root_K = sqrt(b->K), energy = sqrt(high * high + b->K * low * low);
    const double reach = amplitude + energy / root_K;
    const double most = amplitude * sqrt(near_to(force_gain2(c))) +
                        near_to(force_per_energy(c, num(root_K))) * energy;
    const real load = load_force(c);
    return reach < room_about(b, near_to(rest_centre(c))) &&
           most < near_to(friction_guard(c, num(-1.0), load)) &&
           most < near_to(friction_guard(c, num(1.0), load));
}

/* Time for which rest is proved where it may end later: x_r is about its centre with an energy that grows by
   alpha per unit of time at most. Roundings are less than the share that is left out. */
static double rest_lasts(const segment *c, const point *s)
{
    segment_sizes room;
    const segment_sizes *b = sizes_of(c, &room);
    const double centre = near_to(rest_centre(c)), root_K = sqrt(b->K);
    const double off = s->energy_error + 0x1p-40 * (fabs(near_to(s->x_r)) + fabs(centre));
    const double energy = off + hypot(near_to(s->v_r), root_K * near_to(sub(s->x_r, rest_centre(c))));
    const real load = load_force(c);
    const double least = smaller(near_to(friction_guard(c, num(-1.0), load)),
                                 near_to(friction_guard(c, num(1.0), load))) - CAPSULE_REACTION * b->alpha;
    const double most = smaller(root_K * room_about(b, centre),
                                least / near_to(force_per_energy(c, num(root_K))));
    return (0.999 * most - energy) / b->alpha;
}

/* A state that rests forever does so at the end of a period too, whatever the instants of expansions. */
static int rests_after(const segment *c, const capsule_constants *k, const outcome *o, const point *next)
{
    point last = o->end;
    last.angle = last.sine = num(0.0), last.cosine = num(1.0);
    last.angle_rest = 0.0, last.energy_error = next->energy_error;
    return rests_forever(c, k, &last);
}
#endif

#ifndef WIDE
/* The change of x_r, v_r, and the change of v_c, by the closed form after a time. */
static void flow_from(const capsule_constants *k, const point *from, double h, double change[3])
{
    const capsule_start start = {from->x_r,    from->gap,    from->v_r, from->v_c,
                                 from->margin, from->cosine, from->sine};
    change[2] = 0.0; /* at rest it is left alone */
    capsule_flow(k, &start, h, change);
}

/* Moves a switch and its state to their place on the closed form from the segment's start. Rounding errors of
   expansions add up; the switch stays within its proved `error` of time. */
static void refine(const segment *c, const capsule_constants *k, const point *from,
                   const outcome *o, double error, point *to, double *duration)
{
    double change[3];
    flow_from(k, from, *duration, change);
    const double x_r = from->x_r + change[0], gap = from->gap + change[0], v_r = change[1];
    double at = gap; /* the gap that vanishes, if one does */
#if TWO_STOPS
    at = o->at_back ? from->other + change[0] : gap;
#endif
    const double v_c = from->v_c + change[2], pulled = pull(c, x_r, gap, v_r, to->cosine);
    const double rate = v_rate(c, x_r, gap, v_r, to->cosine);
    const double slip = c->drift != 0.0 ? v_c_rate(c, pulled - c->friction) : 0.0;
    const double value = o->at_gap ? at : c->drift != 0.0 ? v_c : pulled - friction_at(c, o->bound_at);
    const double slope = o->at_gap ? v_r : c->drift != 0.0 ? slip : pull_rate(c, v_r, rate, to->sine);
    const double by = -value / slope;
    if (!(fabs(by) <= error))
        return;
    if (!o->at_gap) { /* it is at a stop exactly there */
        to->x_r = x_r + by * v_r;
        to->gap = gap + by * v_r;
#if TWO_STOPS
        to->other = from->other + change[0] + by * v_r;
#endif
    }
    to->v_r = v_r + by * rate;
    to->v_c = c->drift != 0.0 && o->at_gap ? v_c + by * slip : 0.0;
    to->angle_rest += c->omega * by;
    phase_terms(to->angle, to->angle_rest, &to->sine, &to->cosine);
    *duration += by;
}

#if CAPSULE_PULSED
/* The same for an edge, whose time is known. */
static void refine_edge(const segment *c, const capsule_constants *k, const point *from, point *to,
                        double *duration)
{
    double change[3];
    *duration = time_to_edge(c, from);
    flow_from(k, from, *duration, change);
    to->x_r = from->x_r + change[0];
    to->gap = from->gap + change[0];
#if TWO_STOPS
    to->other = from->other + change[0];
#endif
    to->v_r = change[1];
    to->v_c = from->v_c + change[2];
}
#endif
#endif

static int field_at(const capsule_map *map, const capsule_state *state)
{
    const capsule_exact unknown = {.known = 0};
    const known p = known_of(map, state, &unknown);
    return successor_of(map, &p, level_at(map, &p));
}

static void one_step(const segment *c, const segment_sizes *b, const table *t, int drift,
                     int position, int ends, double way, double guess, const point *s, point *to,
                     outcome *o)
{
    if (!drift)
        step(c, b, t, 0, 0, 0, ends, way, guess, s, to, o);
    else if (position)
        step(c, b, t, 0, 1, 1, ends, way, guess, s, to, o);
    else
        step(c, b, t, 0, 1, 0, ends, way, guess, s, to, o);
}

/* State at the end of a run, from the last expansion. */
static void end_run(capsule_context *context, capsule_state *state, const outcome *o, int field,
                    capsule_result *p)
{
    p->advance = near_to(o->end.position);
    /* A switch within a rounding may put the state past it: then the state decides. */
    *state = (capsule_state){.x_r = near_to(o->end.x_r), .gap = near_to(o->end.gap),
                             .v_r = near_to(o->end.v_r), .v_c = near_to(o->end.v_c),
                             .position = state->position + p->advance, .period = context->periods,
                             .field = o->crossing ? 0 : field};
#if TWO_STOPS
    real gap, back;
    gaps_of(CONTACT_OF[field - 1], o->end.gap, o->end.other, &gap, &back);
    state->gap = near_to(gap), state->back = near_to(back);
#endif
    context->exact.known = 0;
}

/* State at a switch, and the successor field; nothing if that is undecided. */
static void switch_field(capsule_context *context, capsule_state *state, const outcome *o,
                         const point *at, int field, int64_t period, capsule_result *p)
{
    const int contact = CONTACT_OF[field - 1];
    const int level = o->edge ? !LEVEL_OF[field - 1] : LEVEL_OF[field - 1];
    known end = {at->x_r, at->gap, at->v_r, at->v_c, at->angle, at->angle_rest, (int)o->bound_at
#if TWO_STOPS
                 , at->other
#endif
    };
    int next_contact = o->at_gap ? !contact : contact;
#if TWO_STOPS
    next_contact += o->at_back;
    gaps_of(next_contact, at->gap, at->other, &end.gap, &end.back);
#endif
    const int following = o->undetermined ? successor_of(context->map, &end, level)
                                          : FIELD_OF[level][next_contact][(int)o->way + 1];
    if (!following)
        return; /* The switch itself is certain, but not its successor. */
    p->outcome = CAPSULE_REGULAR;
    p->switched = 1;
    p->advance = near_to(at->position);
    const double v_r = near_to(at->v_r), v_c = near_to(at->v_c);
    *state = (capsule_state){
        .x_r = near_to(at->x_r), .gap = near_to(end.gap), .v_r = v_r, .v_c = v_c,
        .angle = near_to(at->angle), .angle_rest = at->angle_rest,
        .position = state->position + p->advance, .period = period, .bound = (int)o->bound_at,
        /* Eq. (24): by the successor field if the capsule rests. */
        .plane = o->edge      ? EDGE_PLANE[level]
                 : v_c == 0.0 ? following
                              : impact_plane(p->field, following, v_c, v_r),
        .field = following};
    if (o->edge && o->passed)
        capsule_write_strobe(context->request, period, state->x_r, v_r, v_c);
    context->exact.known = 0;
    context->angle = state->angle;
    context->cosine = near_to(at->cosine), context->sine = near_to(at->sine);
#ifdef WIDE
    state->angle_rest += at->angle.lo;
    context->exact = (capsule_exact){{at->x_r.hi, at->x_r.lo}, {end.gap.hi, end.gap.lo},
                                    {at->v_r.hi, at->v_r.lo}, {at->v_c.hi, at->v_c.lo},
                                    {at->angle.hi, at->angle.lo}, .known = 1};
#endif
#if TWO_STOPS
    state->back = near_to(end.back);
#ifdef WIDE
    context->exact.back[0] = end.back.hi, context->exact.back[1] = end.back.lo;
#endif
#endif
}

/* Table of a field's flow; in 106 bits it is made when a run first needs that flow. */
static const table *table_of(capsule_context *context, int field, const segment *c)
{
    const int flow = FLOW_OF[field - 1];
#ifdef WIDE
    if (!context->wide_made[flow]) {
        bases base;
        bases_make(&base);
        table_make(&base, &context->map->field[field - 1], c, &context->wide[flow]);
        context->wide_made[flow] = 1;
    }
    return &context->wide[flow];
#else
    (void)c;
    return &context->map->table[flow];
#endif
}

static void run_segment(capsule_context *context, capsule_state *state, capsule_result *p)
{
    const capsule_map *map = context->map;
    const capsule_request *request = context->request;
    const known start = known_of(map, state, &context->exact);
    memset(p, 0, sizeof *p);
    p->outcome = CAPSULE_UNDECIDED;
    const int field = state->field ? state->field : successor_of(map, &start, level_at(map, &start));
    if (!field)
        return;
    const int way = DRIFT_OF[field - 1], drift = way != 0;
#if !CAPSULE_PULSED || !defined(WIDE)
    const capsule_constants *k = &map->field[field - 1];
#endif
    segment c_room;
    segment_sizes b_room;
    const segment *c = segment_of(map, field, &c_room);
    const segment_sizes *b = sizes_of(c, &b_room);
    const table *t = table_of(context, field, c);
#if !CAPSULE_PULSED
    const int may_rest = field == FIELD_OF[0][0][1] ? map->may_rest : 0;
#endif
    const point from = point_at(c, field, &start, context), *here = &from;
    point later[2], *next = later;
    double *guess = &context->guess[field][state->plane];
    int64_t period = state->period;
    double duration = 0.0, lost = 0.0; /* its excess from rounding of the sum */
    outcome o = {0};
    p->field = field;
    p->gap = near_to(from.gap), p->margin = near_to(from.margin);
    p->cosine = near_to(from.cosine), p->sine = near_to(from.sine);
    for (;; here = next, next = here == later ? later + 1 : later, guess = &context->guess[field][0]) {
        if (p->evaluations == MOST_EXPANSIONS) {
            p->gave_up = 1;
            return;
        }
#if !CAPSULE_PULSED
        if (may_rest) {
            const double rest = may_rest == 2               ? rest_lasts(c, here)
                                : rests_forever(c, k, here) ? INFINITY
                                                            : 0.0;
            if (k->omega * rest > (double)(context->periods - period) * TWO_PI) {
                capsule_state end = *state;
                end.period = period;
                p->duration = duration;
                capsule_rest(context, near_to(here->x_r), near_to(here->v_r), near_to(here->angle),
                             here->angle_rest, rest == INFINITY, &end, p);
                if (!p->stopped)
                    *state = end;
                return;
            }
        }
#endif
        const int ends = request->strobe || context->periods - period == 1;
        one_step(c, b, t, drift, context->position, ends, way, *guess, here, next, &o);
        if (o.open) {
            p->outcome = o.corner ? CAPSULE_CORNER : CAPSULE_UNDECIDED;
            return;
        }
        p->evaluations++;
        double spent = near_to(o.h);
        if (o.passed) {
            period++;
            if (ends && !o.edge) {
                capsule_write_strobe(request, period, near_to(o.end.x_r), near_to(o.end.v_r),
                               near_to(o.end.v_c));
                if (period == context->periods)
                    spent = near_to(o.end_h);
            }
        }
        spent -= lost;
        const double before = duration;
        duration = before + spent;
        lost = (duration - before) - spent;
        p->duration = duration;
        if (o.passed && !o.edge && period == context->periods) {
            p->outcome = CAPSULE_END;
#if !CAPSULE_PULSED
            if (may_rest == 1 && rests_after(c, k, &o, next))
                p->outcome = CAPSULE_NEVER;
#endif
            end_run(context, state, &o, field, p);
            return;
        }
        if (o.crossing)
            break;
    }
    *guess = near_to(o.h) / t->reach;
#ifndef WIDE
#if CAPSULE_PULSED
    if (p->evaluations > MOST_SUMMED && o.edge) {
        refine_edge(c, k, &from, next, &p->duration);
        o.undetermined = CAPSULE_REACTS;
    }
#endif
    if (p->evaluations > MOST_SUMMED && !o.edge) {
        refine(c, k, &from, &o, o.error * t->reach, next, &p->duration);
        o.undetermined = 1;
    }
#endif
    switch_field(context, state, &o, next, field, period, p);
}
