/* Running the map: first switch, exact advance, next segment, until the periods are over. */
#include <math.h>
#include <string.h>

#include "expansion.h"


/* A segment that takes more is left to the caller: another method looks further ahead there. */
#define MOST_EXPANSIONS 8192
#define MOST_ADDED 4 /* expansions whose roundings may add up to a switch */

typedef struct {
    const capsule_map *map;
    const capsule_wish *wish;
    int64_t periods;
    int position;
    double guess[7][11]; /* where a segment of this field from this plane ended last */
} run;

/* End of a segment. */
typedef struct {
    capsule_outcome outcome;
    guard_name guard;
    point at;
    int64_t turn;
    double duration, advance;
    int evaluations, stopped; /* by the watch, on the way */
} ending;

static double remaining(const run *r, int64_t turn, const departure *d)
{
    const double turns = (double)(r->periods - turn);
    const double rest = turns * TWO_PI_REST - d->angle_rest;
    return ((turns * TWO_PI - d->angle) + rest) / r->map->parameters.omega;
}

static void strobe(const run *r, int64_t turn, const point *p)
{
    if (r->wish->strobe) {
        double *state = r->wish->strobe[r->wish->rows ? turn % r->wish->rows : turn];
        state[0] = p->x_r;
        state[1] = p->v_r;
        state[2] = p->v_c;
    }
}

/* Whether a sticking segment without contact is proved to last for ever: x_r is the forced
   response plus a free part whose energy never grows, which bounds x_r and P for all time. */
typedef struct {
    double x, v; /* forced response */
    int for_ever;
} rest;

static rest resting(const capsule_constants *c, const stand *from)
{
    const departure *d = &from->at;
    rest q = {0.0, 0.0, 0};
    /* Rounding of K - omega^2 is felt near resonance; there the proof is not tried. */
    const double distance = sqrt(c->Z2), rounded = 4.0 * UNIT * (c->K + c->omega * c->omega);
    if (distance <= 64.0 * rounded)
        return q;
    const double relative = 4.0 * rounded / distance;
    const double amplitude = c->alpha / distance * (1.0 + relative);
    forced(c, d->cosine, d->sine, &q.x, &q.v);
    const double rounding = 32.0 * UNIT + relative + 2.0 * UNIT * d->angle;
    const double error =
        from->energy_error +
        rounding * (fabs(d->v_r) + fabs(d->x_r) + (1.0 + c->omega) * amplitude);
    const double low = fabs(d->x_r - q.x) + error, high = fabs(d->v_r - q.v) + error;
    const double inflation = 1.0 + 64.0 * UNIT + relative;
    const double energy = inflation * sqrt(high * high + c->K * low * low);
    const double reach = inflation * (amplitude + energy / sqrt(c->K));
    const double most = inflation * (amplitude * sqrt(force_gain2(c)) +
                                     force_per_energy(c, sqrt(c->K)) * energy);
    q.for_ever = reach < c->delta && most < c->f_b;
    return q;
}

/* The end of a run, or of a period, of a segment that lasts for ever. Its free part alone is
   advanced, so that no large time meets a sine. */
static void settle(const capsule_constants *c, const departure *d, rest q, double h, point *out)
{
    capsule_constants still = *c;
    double change[3];
    still.alpha = 0.0;
    const double x = d->x_r - q.x, v = d->v_r - q.v;
    const capsule_start start = {x, 0.0, v, 0.0, 0.0, 1.0, 0.0};
    capsule_flow(&still, &start, h, change);
    memset(out, 0, sizeof *out);
    forced(c, 1.0, 0.0, &out->x_r, &out->v_r);
    out->x_r += x + change[0];
    out->v_r += change[1];
    out->gap = out->x_r - c->delta;
    out->cosine = 1.0;
}

static void last_for_ever(run *r, const capsule_constants *c, const departure *d, rest q,
                          ending *end)
{
    if (r->wish->strobe) {
        int64_t turn = end->turn + 1;
        if (r->wish->rows && turn < r->periods + 1 - r->wish->rows)
            turn = r->periods + 1 - r->wish->rows;
        for (; turn < r->periods; turn++) {
            const double turns = (double)(turn - end->turn);
            settle(c, d, q, ((turns * TWO_PI - d->angle) + turns * TWO_PI_REST) / c->omega,
                   &end->at);
            strobe(r, turn, &end->at);
            if (capsule_asked(r->wish->watch, 1)) {
                end->stopped = 1;
                return;
            }
        }
    }
    const double h = remaining(r, end->turn, d);
    settle(c, d, q, h, &end->at);
    strobe(r, r->periods, &end->at);
    end->duration += h;
    end->turn = r->periods;
    end->outcome = CAPSULE_NEVER;
}

typedef struct {
    guard_name guard;
    root root;
} crossing;

/* The first of the crossings found, if it is simple and certainly before whatever else is
   possible; otherwise `open` says why not, with `clear` the time up to which nothing happens. */
static int first_crossing(double *guess, const capsule_constants *c, const capsule_table *t,
                          const stand *from, const expansion *e, const double *x,
                          const finding *found,
                          const guard_name *guards, int count, crossing *first, int *corner)
{
    *first = (crossing){NONE, {0, 0.0, 0.0}};
    *corner = 0;
    double clear = 2.0;
    for (int i = 0; i < count; i++) {
        if (found[i].kind == VAGUE)
            clear = lesser(clear, found[i].from);
        if (found[i].kind != CROSSING || found[i].from >= clear)
            continue;
        const int alike = fabs(*guess - found[i].near) < 0.125;
        crossing next = {guards[i], polish(c, t, from, e, x, guards[i], found[i],
                                           alike ? *guess : found[i].near)};
        if (!next.root.certain)
            return 0;
        if (first->guard != NONE) {
            const double ahead = first->root.s - next.root.s;
            if (fabs(ahead) <= first->root.error + next.root.error) {
                *corner = 1;
                return 0;
            }
            if (ahead < 0.0)
                continue;
        }
        *first = next;
    }
    if (first->guard == NONE || first->root.s + first->root.error >= clear)
        return 0;
    *guess = first->root.s;
    return 1;
}

static capsule_outcome tangency(guard_name guard)
{
    return guard == GAP ? CAPSULE_GRAZE : CAPSULE_SLIDING_TANGENCY;
}

/* Moves a switch and the state there to where the closed form from the segment's start has it.
   Expansions add up their roundings; the switch stays within what they prove, `error` of time. */
static void refine(const capsule_constants *c, const departure *from, guard_name guard,
                   double error, ending *end)
{
    const capsule_start start = {from->x_r,    from->gap,    from->v_r, from->v_c,
                                 from->margin, from->cosine, from->sine};
    double change[3] = {0.0, 0.0, 0.0};
    capsule_flow(c, &start, end->duration, change);
    point *p = &end->at;
    const double x_r = from->x_r + change[0], gap = from->gap + change[0], v_r = change[1];
    const double pull = force(c, x_r, gap, v_r), rate = v_rate(c, x_r, gap, v_r, p->cosine);
    const double slip = c->drift != 0.0 ? v_c_rate(c, pull - c->friction) : 0.0;
    const double value = guard == GAP     ? gap
                         : guard == DRIFT ? from->v_c + change[2]
                         : guard == UPPER ? pull - c->f_b
                                          : pull + c->f_b;
    const double slope = guard == GAP     ? v_r
                         : guard == DRIFT ? slip
                                          : force_change(c, v_r, rate);
    const double by = -value / slope;
    if (!(fabs(by) <= error))
        return;
    p->x_r = x_r + by * v_r;
    p->gap = gap + by * v_r;
    p->v_r = v_r + by * rate;
    p->v_c = from->v_c + change[2] + by * slip;
    p->angle_rest += c->omega * by;
    cosine_sine(p->angle, p->angle_rest, &p->cosine, &p->sine);
    end->duration += by;
}

/* Takes a segment from its start to its first switch or to the end of the run. */
static void locate(run *r, const departure *start, int plane, int64_t turn, ending *end)
{
    static const guard_name DRIFTING[2] = {GAP, DRIFT}, STICKING[3] = {GAP, UPPER, LOWER};
    const capsule_map *map = r->map;
    const capsule_constants *c = &map->field[start->field - 1];
    const capsule_table *t = &map->table[2 * (c->contact != 0.0) + (c->drift != 0.0)];
    const guard_name *guards = c->drift != 0.0 ? DRIFTING : STICKING;
    const int count = c->drift != 0.0 ? 2 : 3;
    const double omega = c->omega;
    stand here = {*start, 0.0, 0.0, 0.0, 0};
    double *guess = &r->guess[start->field][plane];
    end->guard = NONE;
    end->turn = turn;
    end->duration = end->advance = 0.0;
    double lost = 0.0; /* by how much the duration is too long, from rounding its sum */
    end->evaluations = end->stopped = 0;
    for (;;) {
        if (end->evaluations == MOST_EXPANSIONS) {
            end->outcome = CAPSULE_UNDECIDED;
            return;
        }
        expansion e;
        double x[POLYNOMIAL];
        finding found[3];
        crossing first = {NONE, {0, 0.0, 0.0}};
        int corner = 0, crossings = 0;
        if (start->field == 2 && map->may_rest) {
            const rest q = resting(c, &here);
            if (q.for_ever) {
                last_for_ever(r, c, &here.at, q, end);
                return;
            }
        }
        expand(c, t, &here, &e);
        double horizon = 1.0, thin = 1.0, limit = 2.0;
        if (r->periods - end->turn == 1 || omega * t->reach > TWO_PI)
            limit = remaining(r, end->turn, &here.at) / t->reach;
        for (;; thin *= 0x1p-4) {
            horizon = 1.0;
            crossings = 0;
            for (int i = 0; i < count; i++) {
                found[i] = examine(c, t, &here, &e, guards[i], thin);
                crossings += found[i].kind == CROSSING;
                if (found[i].kind != CLEAR)
                    horizon = lesser(horizon, found[i].from);
            }
            if (crossings)
                coefficients(t, &e, x);
            if (crossings && first_crossing(guess, c, t, &here, &e, x, found, guards, count, &first,
                                            &corner)) {
                horizon = first.root.s;
                break;
            }
            first.guard = NONE;
            if (!crossings || horizon > 0.0 || thin < 0x1p-40)
                break;
        }
        const int ends = limit <= horizon && !(first.guard != NONE && limit == horizon);
        if (ends) {
            horizon = greater(limit, 0.0);
            first.guard = NONE;
        } else if (corner || horizon <= 0x1p-40) {
            end->outcome = CAPSULE_UNDECIDED;
            for (int i = 0; i < count; i++)
                if (found[i].kind != CLEAR && found[i].from <= horizon)
                    end->outcome = end->outcome == CAPSULE_UNDECIDED ? tangency(guards[i])
                                                                      : CAPSULE_CORNER;
            if (corner)
                end->outcome = CAPSULE_CORNER;
            return;
        }
        const int whole = horizon == 1.0;
        if (!crossings && !whole)
            coefficients(t, &e, x);
        evaluate(c, t, &here, &e, whole ? NULL : x, horizon, first.guard == DRIFT, r->position,
                 &end->at);
        end->evaluations++;
        if (end->at.passed || ends) {
            if (r->wish->strobe && !ends) {
                point p;
                coefficients(t, &e, x);
                const double rest = TWO_PI_REST - here.at.angle_rest;
                const double at = ((TWO_PI - here.at.angle) + rest) / omega / t->reach;
                evaluate(c, t, &here, &e, x, lesser(at, horizon), 0, 0, &p);
                strobe(r, end->turn + 1, &p);
            }
            end->turn++;
        }
        const double spent = horizon * t->reach - lost, before = end->duration;
        end->duration = before + spent;
        lost = (end->duration - before) - spent;
        end->advance += end->at.advance;
        if (first.guard != NONE) {
            end->guard = first.guard;
            end->outcome = CAPSULE_REGULAR;
            if (end->evaluations > MOST_ADDED)
                refine(c, start, first.guard, first.root.error * t->reach, end);
            return;
        }
        if (ends) {
            end->turn = r->periods;
            end->at.angle = end->at.angle_rest = end->at.sine = 0.0;
            end->at.cosine = 1.0;
            strobe(r, r->periods, &end->at);
            end->outcome = CAPSULE_END;
            if (start->field == 2 && map->may_rest) {
                /* What rests for ever does so at the end too, wherever the expansions stood. */
                stand last;
                carry(c, t, &here, &e, &end->at, &last);
                if (resting(c, &last).for_ever)
                    end->outcome = CAPSULE_NEVER;
            }
            return;
        }
        stand next;
        carry(c, t, &here, &e, &end->at, &next);
        here = next;
        guess = &r->guess[start->field][0];
    }
}

/* The state at the end of a segment, with what is known exactly there. */
static void arrive(const capsule_constants *c, const ending *end, capsule_state *state)
{
    state->x_r = end->at.x_r;
    state->gap = end->at.gap;
    state->v_r = end->at.v_r;
    state->v_c = c->drift != 0.0 ? end->at.v_c : 0.0;
    state->angle = end->at.angle;
    state->angle_rest = end->at.angle_rest;
    state->position += end->advance;
    state->turn = end->turn;
    state->bound = state->plane = 0;
    if (end->guard == GAP) {
        state->x_r = c->delta;
        state->gap = 0.0;
    } else if (end->guard == DRIFT) {
        state->v_c = 0.0;
    } else if (end->guard != NONE) {
        state->bound = end->guard == UPPER ? 1 : -1;
    }
}

/* The switching plane of a state, Eq. (24): by the field to come where the capsule rests. */
static int plane_of(const capsule_state *state, int following)
{
    if (state->v_c == 0.0)
        return following;
    return IMPACT_PLANE[state->v_c > 0.0][state->v_r > 0.0];
}

capsule_stop go(const capsule_map *map, capsule_state *state, int64_t periods,
                const capsule_wish *wish, size_t *written, capsule_outcome *open)
{
    run r;
    departure d;
    memset(&r, 0, sizeof r);
    r.map = map;
    r.wish = wish;
    r.periods = periods;
    r.position = wish->position || wish->segments;
    const int64_t pause =
        wish->strobe && wish->rows ? state->turn + wish->rows / 2 : periods;
    int field = 0;
    while (state->turn < periods) {
        ending end;
        if (((wish->segments || wish->events) && *written == wish->room) || state->turn >= pause)
            return CAPSULE_FULL;
        if (!field) {
            double cosine, sine;
            cosine_sine(state->angle, state->angle_rest, &cosine, &sine);
            field = depart(map, state, cosine, sine, &d);
        }
        if (!field) {
            *open = CAPSULE_UNDECIDED;
            return CAPSULE_OPEN;
        }
        locate(&r, &d, state->plane, state->turn, &end);
        if (end.stopped)
            return CAPSULE_STOPPED;
        if (end.outcome != CAPSULE_REGULAR && end.outcome != CAPSULE_END &&
            end.outcome != CAPSULE_NEVER) {
            *open = end.outcome;
            return CAPSULE_OPEN;
        }
        const capsule_state before = *state;
        const departure from = d;
        arrive(&map->field[field - 1], &end, state);
        field = 0;
        if (end.guard != NONE) {
            field = depart(map, state, end.at.cosine, end.at.sine, &d);
            state->plane = field ? plane_of(state, field) : 0;
            if (!field) {
                /* The switch itself is certain, but not where it leads. */
                *state = before;
                *open = CAPSULE_UNDECIDED;
                return CAPSULE_OPEN;
            }
        }
        if (wish->segments) {
            capsule_segment *s = &wish->segments[(*written)++];
            *s = (capsule_segment){
                .start_turn = before.turn, .end_turn = state->turn,
                .start_angle = before.angle, .end_angle = state->angle,
                .start = {before.x_r, before.v_r, before.v_c},
                .end = {state->x_r, state->v_r, state->v_c},
                .duration = end.duration, .position = before.position, .advance = end.advance,
                .gap = from.gap, .margin = from.margin, .cosine = from.cosine, .sine = from.sine,
                .field = from.field, .source = before.plane, .target = state->plane,
                .outcome = end.outcome, .evaluations = end.evaluations};
        } else if (wish->events && end.guard != NONE) {
            wish->events[(*written)++] =
                (capsule_event){state->turn, state->angle, from.field, state->plane};
        }
        if (capsule_asked(wish->watch, 1 + end.evaluations) && state->turn < periods)
            return CAPSULE_STOPPED;
    }
    return CAPSULE_DONE;
}
