/* The certified step: one expansion of a motion, in which every switch is found or excluded by proof.
   `bound_guards` proves which guards are clear and where the others cross zero; `locate` finds the first of
   these roots, or the time up to which none exists; `land` computes the state there and the successor.
   Written once, over the numbers of number.h. */
#include "expansion.h"

#define ROUNDS 60 /* of Newton's method; after them the root is undecided */

/* Direction of the drift after a switch off the lines, and the lanes where it is undecided. `bound_at` is 1
   (-1) if Q left rest at f_b (-f_b), outwards: that is a simple root of its guard. */
inlined bound direction_after(const segment *c, const segment_sizes *b, const point *s, bound bound_at,
                        mask *undetermined)
{
    const bound x = size_of(near_to(s->x_r)), gap = size_of(near_to(s->gap));
    const bound v = size_of(near_to(s->v_r)), terms = pull_size(b, x, gap, v);
    const real pulled = pull(c, s->x_r, s->gap, s->v_r, s->cosine);
    const mask rests = eq(near_to(s->v_c), all(0.0)), at_bound = ne(bound_at, all(0.0));
    const bound side = pick(gt(near_to(pulled), all(0.0)), all(1.0), all(-1.0));
    const bound within = near_to(friction_guard(c, wide(-side), pulled));
    const mask close = le(size_of(within), 16.0 * UNIT * (terms + friction_bounds(b)));
    *undetermined = (rests & not(at_bound) & close) |
               (eq(near_to(s->gap), all(0.0)) & eq(near_to(s->v_r), all(0.0)));
    const bound at_rest = pick(at_bound, bound_at, pick(lt(within, all(0.0)), side, all(0.0)));
    return pick(rests, at_rest, pick(gt(near_to(s->v_c), all(0.0)), all(1.0), all(-1.0)));
}

/* Outcome of a step. */
typedef struct {
    mask open;     /* nothing is proved for this expansion or a part of it */
    mask corner;   /* two guards vanish together */
    mask crossing; /* a switch ends the segment */
    mask passed;   /* an excitation period ended in it */
    mask undetermined;  /* the successor field is not certain here */
    mask edge;     /* the switch is an edge of pulses */
    mask at_gap;   /* the gap's guard fired */
#if TWO_STOPS
    mask at_back;  /* that of the stop behind, without contact */
#endif
    bound way;     /* after a switch, of the drift: 1, -1, or 0 at rest */
    bound bound_at; /* 1 (-1) if Q is exactly f_b (-f_b) there */
    bound error;   /* of a switching time */
    real h;        /* its duration */
    real end_h;    /* until the end of the period passed */
    point end;     /* at the end of that period */
} outcome;

#if WIDTH == 1
/* Proved facts on (0, r] by halving, if the signs alone do not decide (isolate.h). */
static void isolate(const guard *g, double r, isolation *f);
#endif

/* Proved facts about the guards on (0, r], and the guard that crosses first according to its isolation. */
typedef struct {
    guard g[GUARDS];
    isolation found[GUARDS];
    mask open, crossing;
    mask is_gap; /* the gap's guard; else the second friction guard if `lower`, else the first other one */
    mask lower, both; /* `both`: the gap's guard crosses, and another one */
#if TWO_STOPS
    mask back; /* GAP is the guard of the stop behind, and BACK the other one */
    real gap;  /* that of GAP */
#endif
} certificate;

#if TWO_STOPS
#define gap_of(p, s) ((p)->gap)
#define stops_apart(c) ((c)->CAPSULE_FRONT_GAP + (c)->CAPSULE_BACK_GAP)

inlined isolation isolation_of(mask m, const isolation *a, const isolation *b)
{
    return (isolation){(m & a->clear) | (not(m) & b->clear), (m & a->crossing) | (not(m) & b->crossing),
                       pick(m, a->from, b->from), pick(m, a->to, b->to), pick(m, a->near, b->near),
                       pick(m, a->off, b->off)};
}

/* Makes GAP the one of both stops' guards that crosses first, which is the one with the smaller `to`, and
   BACK the other one. The other one, T, is positive up to the `to` of the first one, C: C is negative
   there, so T = delta_1 + delta_2 - C is more than the stops' distance, which is more than the distance of
   T's bounds (`others_are_later`). So its lower bound is positive there, and changes its sign once up to
   T's `to`. Both are not negative at once, so no two `to` are equal, and in lanes, where each is r, one of
   them crosses at most. */
inlined void order_stops(const point *s, certificate *p)
{
    guard *g = p->g;
    const isolation front = p->found[GAP], behind = p->found[BACK];
    p->back = behind.crossing & (not(front.crossing) | lt(behind.to, front.to));
    p->gap = choose(p->back, s->other, s->gap);
    p->found[GAP] = isolation_of(p->back, &behind, &front);
    p->found[BACK] = isolation_of(p->back, &front, &behind);
    const bound signs[2] = {g[GAP].sign, g[BACK].sign}, zeros[2] = {g[GAP].zeros, g[BACK].zeros};
    const real first[2] = {g[GAP].first, g[BACK].first};
    g[GAP].first = choose(p->back, first[1], first[0]), g[BACK].first = choose(p->back, first[0], first[1]);
    g[GAP].sign = pick(p->back, signs[1], signs[0]), g[BACK].sign = pick(p->back, signs[0], signs[1]);
    g[GAP].zeros = pick(p->back, zeros[1], zeros[0]), g[BACK].zeros = pick(p->back, zeros[0], zeros[1]);
}
#else
#define gap_of(p, s) ((s)->gap)
#endif

/* Guards that are clear, and guards that cross zero once. */
inlined void bound_guards(const segment *c, const table *t, const expansion *e, int level, int drift,
                          bound way, const point *s, certificate *p)
{
    const double side = t->contact == 1 ? 1.0 : -1.0, r = t->level[level];
    const bound one = all(1.0), signs[] = {all(side), drift ? way : -one, one, one};
    const int last_guard = drift ? FIRST : SECOND;
    guard *g = p->g;
    isolation *found = p->found;
    int made = 0; /* forms, a bit each */
    p->open = p->crossing = none;
    for (int i = 0; i < GUARDS; i++) {
        found[i] = (isolation){not(none), none, all(r), all(r), all(r), all(0.0)};
        if (!watched(i, drift, t))
            continue;
        const int slips = drift && i == FIRST;
        g[i] = guard_of(c, e, s, i, drift, signs[i]);
        const mask clear = out_of_range(&g[i], e, slips);
        found[i] = (isolation){clear, none, all(r), all(r), all(r), all(0.0)};
        if (!some(not(clear)))
            continue;
        const int mirror = i == SECOND ? FIRST : GAP; /* whose form is this one's with its sign reversed */
        const int known = i > FIRST && made >> mirror & 1;
        form_of(t, e, i, level, drift, known ? &g[mirror] : NULL, &g[i]);
        made |= 1 << i;
        const isolation f = certify(&g[i], r, WIDTH == 1 || slips);
        found[i].clear = clear | f.clear;
        found[i].crossing = f.crossing & not(clear);
        found[i].from = pick(clear, found[i].from, f.from);
        found[i].near = f.near;
#if WIDTH == 1
        if (!found[i].clear && !found[i].crossing)
            isolate(&g[i], r, &found[i]);
#endif
        p->open |= not(found[i].clear | found[i].crossing);
        p->crossing |= found[i].crossing;
    }
#if TWO_STOPS
    if (!t->contact)
        order_stops(s, p);
    else
        p->back = none, p->gap = s->gap;
#endif
    /* Of two friction guards that cross, C is the one with the smaller `to`, T the other one: then T is
       positive up to C's `to`. C is negative there, so T = 2 f_b - C is more than 2 f_b, which is more than
       the distance of T's bounds (`others_are_later`). So its lower bound is positive there, and changes
       its sign once up to T's `to`. Both are not negative at once, so no two `to` are equal, and in lanes,
       where each is r, one of them crosses at most. */
    p->lower = drift ? none
                     : found[SECOND].crossing &
                           (not(found[FIRST].crossing) | lt(found[SECOND].to, found[FIRST].to));
    const mask by_friction =
        drift ? found[FIRST].crossing : found[FIRST].crossing | found[SECOND].crossing;
    const bound near = pick(p->lower, found[last_guard].near, found[FIRST].near);
    p->both = found[GAP].crossing & by_friction;
    p->is_gap = found[GAP].crossing & (not(by_friction) | ge(near, found[GAP].near));
}

/* Length of an expansion: to a switch, to an edge of the drive, or as far as nothing happens. */
typedef struct {
    real at;
    bound error, sign, zeros; /* the error of a switch; of its guard the sign, and zeros at the start */
    mask sure, corner;        /* a switch is proved to be first; two guards vanish together */
    mask edge;                /* an edge comes first */
    motion m;
    real v_c_by;
} location;

enum { MOST = TERMS + 1 }; /* the degree of a guard: v_c has a term more than x_r */
#if TERMS % 2
#error "an even number of terms"
#endif

/* Coefficients of the guard in question, times its sign. */
inlined void guard_terms(const segment *c, const table *t, const expansion *e, const real *a, int drift,
                         bound sign, mask is_gap, mask active, const point *s, real gap, real *p)
{
    const real margin = mul(wide(sign), friction_guard(c, wide(sign), s->margin));
    p[0] = choose(is_gap, gap, drift ? s->v_c : margin);
    const int gaps = some(is_gap), others = some(active & not(is_gap));
    for (int n = 1; n <= MOST; n++) {
        real term = num(0.0);
        if (others) {
            const int k = n - BEHIND(drift); /* Q's or v_c's coefficient by those of x_r */
            const real low = k >= 1 && k <= TERMS ? a[k - 1] : num(0.0);
            const real high = k + 1 >= 2 && k + 1 <= TERMS ? a[k] : num(0.0);
            term = drift && n == 1 ? e->slope
                                   : mad(row(t->from_position[n - 1]), low,
                                         mul(row(t->from_rate[n - 1]), high));
#if CAPSULE_REACTION
            if (!drift && n <= TERMS)
                term = sub(term, mad(row(t->reaction[0][n - 1]), e->u[2],
                                     mul(row(t->reaction[1][n - 1]), e->u[3])));
#endif
        }
        const real gap_term = n <= TERMS ? a[n - 1 < TERMS ? n - 1 : 0] : num(0.0);
        p[n] = !gaps ? term : !others ? gap_term : choose(is_gap, gap_term, term);
    }
}

/* Root of these coefficients in (low, high) by Newton's method, and the guard's slope there. Lanes that do
   not converge become inactive and undecided. */
inlined bound newton(const real *p, bound low, bound high, bound bend, location *f, mask *open)
{
    bound falling = all(1.0);
    real at = f->at, last = num(0.0);
    mask active = f->sure;
    for (int round = 0; some(active); round++) {
        /* Even and odd parts apart: two chains of half the length. */
        const real s2 = mul(at, at);
        real even = p[MOST - 1], odd = p[MOST], even1 = num(0.0), odd1 = num(0.0);
        for (int n = MOST - 3; n >= 0; n -= 2) {
            even1 = mad(even1, s2, even);
            odd1 = mad(odd1, s2, odd);
            even = mad(even, s2, p[n]);
            odd = mad(odd, s2, p[n + 1]);
        }
        const real value = mad(at, odd, even);
        const real rate = mad(mul(num(2.0), s2), odd1, mad(mul(num(2.0), at), even1, odd));
        /* Newton's step for the guard over s^zeros, and minus s times the guard's own slope. */
        const real fall = sub(mul(wide(f->zeros), value), mul(at, rate));
        const real by_much = over(mul(at, value), fall);
        const bound on = near_to(by_much), here = near_to(at);
        const mask positive = gt(f->sign * near_to(value), all(0.0));
        low = pick(active & positive, here, low);
        high = pick(active & not(positive), here, high);
        const mask close = active & (le(size_of(on), ROOT_UNIT * here) |
                                     le(on * on * bend, UNIT * size_of(near_to(fall))));
        last = choose(close, by_much, last);
        falling = pick(active, f->sign * near_to(fall), falling);
        active &= not(close);
        if (round == ROUNDS) {
            *open |= active;
            f->sure &= not(active);
            break;
        }
        const real next = add(at, by_much);
        const mask inside = gt(near_to(next), low) & lt(near_to(next), high);
        at = choose(active, choose(inside, next, wide(0.5 * (low + high))), at);
    }
    f->at = choose(f->sure, add(at, last), at);
    return falling;
}

/* Root of the guard that crosses first, if it is proved to be simple. */
inlined void find_root(const segment *c, const table *t, const expansion *e, const real *a, int level,
                       int drift, bound guess, const point *s, certificate *p, location *f)
{
    const guard *g = p->g;
    const isolation *found = p->found;
    const mask is_gap = p->is_gap, lower = p->lower;
    const int last_guard = drift ? FIRST : SECOND;
    const bound zero = all(0.0), one = all(1.0), r = all(t->level[level]);
    f->sure = p->crossing & (WIDTH == 1 ? p->crossing : not(p->open));
    f->sign = pick(is_gap, g[GAP].sign, pick(lower, g[last_guard].sign, g[FIRST].sign));
    f->zeros = pick(is_gap, g[GAP].zeros, pick(lower, g[last_guard].zeros, g[FIRST].zeros));
    if (!some(f->sure))
        return;
    const bound bend = pick(is_gap, g[GAP].bend, g[FIRST].bend);
    real terms[MOST + 1];
    guard_terms(c, t, e, a, drift, f->sign, is_gap, f->sure, s, gap_of(p, s), terms);
    bound low = zero, high = r;
    bound start =
        pick(is_gap, found[GAP].near, pick(lower, found[last_guard].near, found[FIRST].near));
#if WIDTH == 1
    const isolation *held = &found[is_gap ? GAP : lower ? last_guard : FIRST];
    low = held->from, high = held->to;
#endif
    start = pick(gt(guess, low) & lt(guess, high) & lt(size_of(guess - start), all(0.125)), guess, start);
    f->at = choose(f->sure, wide(start), wide(r));
    const bound falling = newton(terms, low, high, bend, f, &p->open);
    const bound here = near_to(f->at), steepness = falling / here;
    const bound reached = smaller(one, here + here), r2 = reached * reached;
    const bound rounding = pick(is_gap, g[GAP].rounding, g[FIRST].rounding) *
                           pick(gt(f->zeros, zero), pick(gt(f->zeros, one), r2, reached), one);
    const bound tail = pick(is_gap, g[GAP].tail, g[FIRST].tail);
    /* Simple: |g'| keeps half its size up to `straight` on both sides, since |g''| <= bend; and the bounds
       above have one crossing each there. */
    const bound apart = tail * (r2 * reached) + 1.5 * rounding;
    const bound straight = smaller(0.5 * steepness / bend, here);
    /* Twice the rounding is at least 12 units of the root's own, since it includes a slope's terms: so it
       covers the rounding of the root as well. */
    f->error = (rounding + rounding) / steepness;
    const mask simple = gt(steepness, zero) & gt(0.5 * steepness * straight, apart + apart);
    p->open |= f->sure & not(simple);
    f->sure &= simple;
}

/* True if a guard that crosses zero once is proved to be positive up to a time, from its change up to
   `error` before it: the polynomial below the guard, which crosses once, is still positive. That polynomial
   is below the form by rounding + tail + off at most, and the form differs from the guard by the rounding
   and a tail, which its value has once more. If the guard begins at zero, all of these shrink with it. The
   guard's first value is added last: at a friction bound it is exactly 0, where the rounded Q and the
   rounded bound differ. */
inlined mask still_positive(const table *t, const expansion *e, const guard *g, bound off, mask is_gap,
                            real change, bound until, bound error)
{
    const bound zero = all(0.0), one = all(1.0);
    const real value = add(g->first, mul(wide(g->sign), change));
    const bound begun = pick(gt(g->zeros, zero), pick(gt(g->zeros, one), until * until, until), one);
    const bound most = pick(is_gap, bound_dot(t->x_speed, e->size),
                            bound_dot(t->second_speed, e->size) + size_of(near_to(e->slope)));
    const bound near_zero = begun * (3.0 * g->rounding + off) +
                            3.0 * g->tail * (until * until * until) + error * most;
    return gt(near_to(value), near_zero);
}

/* Change of a guard's quantity, without its sign, with the motion. */
inlined real change_of(const segment *c, const table *t, const expansion *e, int which, int drift,
                       const location *f)
{
    if (which == GAP || which == BACK)
        return f->m.x;
    return drift ? f->v_c_by : pull_change(c, t, e, &f->m, f->at);
}

#if CAPSULE_PULSED
/* Angle at which the drive's level ends, exactly: a share of 2 pi, or all of it. */
inlined void edge_angle(const segment *c, real *angle, bound *rest)
{
    const mask falls = gt(near_to(c->high), all(0.0));
    const real share = high_share(c);
#ifdef WIDE
    const real turn = {TWO_PI, TWO_PI_REST};
    *angle = falls ? mul(share, turn) : turn;
    *rest = falls ? TWO_PI_LAST * share.hi : TWO_PI_LAST;
#else
    const bound whole = share * TWO_PI;
    *angle = pick(falls, whole, all(TWO_PI));
    *rest = pick(falls, product_rest(share, all(TWO_PI), whole) + share * TWO_PI_REST, all(TWO_PI_REST));
#endif
}

/* Time until then. */
inlined real time_to_edge(const segment *c, const point *s)
{
    real angle;
    bound rest;
    edge_angle(c, &angle, &rest);
    const real h = over(add(sub(angle, s->angle), wide(rest - s->angle_rest)), c->omega);
    return choose(gt(near_to(h), all(0.0)), h, num(0.0));
}

inlined void find_motion(const segment *c, const table *t, const expansion *e, const real *a, int drift,
                         int position, location *f);

/* Lanes in which an edge of the drive comes first: before the switch proved to be the first, by more than
   both errors in time; or, if every guard is positive up to the edge, whatever is proved beyond it. A first
   switch nearer to the edge is undecided, and so is an edge that may be beyond the expansion, up to which
   the guards are proved. */
inlined void find_edge(const segment *c, const table *t, const expansion *e, const real *a, int level,
                       int drift, int position, real until, bound error, mask near_edge,
                       certificate *p, location *f)
{
    const bound at = near_to(until);
    const bound later = near_to(sub(f->at, until)), off = f->error + error;
    const mask after = f->sure & gt(later, off), unclear = near_edge & f->sure & le(size_of(later), off);
    mask first = near_edge & (after | not(f->sure));
    f->edge = none;
    f->corner |= unclear;
    p->open |= unclear;
    f->sure &= not(unclear);
    const mask beyond = first & gt(at + error, all(t->level[level])) & ge(near_to(f->at) + error, at);
    p->open |= beyond;
    first &= not(beyond);
    if (!some(first))
        return;
    location there = *f;
    there.at = until;
    find_motion(c, t, e, a, drift, position, &there);
    for (int i = 0; i < GUARDS; i++) {
        const isolation *g = &p->found[i];
        mask positive = after | g->clear | lt(at + error, g->from);
        if (some(first & not(positive)))
            positive |= g->crossing & lt(at + error, g->to) &
                        still_positive(t, e, &p->g[i], g->off, i == GAP || i == BACK ? not(none) : none,
                                       change_of(c, t, e, i, drift, &there), at + error, error);
        first &= positive;
    }
    p->open &= not(first);
    f->corner &= not(first);
    f->sure &= not(first);
    f->edge = first;
    f->at = choose(first, until, f->at);
#define THERE(name) f->name = choose(first, there.name, f->name);
    THERE(m.x) THERE(m.slope) THERE(m.lag) THERE(m.sum) THERE(m.lag_sum) THERE(m.again) THERE(v_c_by)
#undef THERE
}
#endif

/* True if the other one of the gap's and the friction guard, of those that cross, crosses later than f. */
inlined mask rival_is_later(const segment *c, const table *t, const expansion *e, int drift,
                            const certificate *p, const location *f)
{
    const int last_guard = drift ? FIRST : SECOND;
    const mask gap = not(p->is_gap);
    const guard *a = &p->g[GAP], *first = &p->g[FIRST], *last = &p->g[last_guard];
#define OF(select, name) select(gap, a->name, select(p->lower, last->name, first->name))
    const guard g = {.first = OF(choose, first), .zeros = OF(pick, zeros), .rounding = OF(pick, rounding),
                     .tail = OF(pick, tail), .sign = OF(pick, sign)};
#undef OF
    const isolation *found = p->found;
    const bound off = pick(gap, found[GAP].off, pick(p->lower, found[last_guard].off, found[FIRST].off));
    const real change = choose(gap, f->m.x, change_of(c, t, e, FIRST, drift, f));
    return still_positive(t, e, &g, off, gap, change, near_to(f->at) + f->error, f->error);
}

#if WIDTH == 1
/* Time up to which certainly nothing happens, on an expansion up to r. */
inlined double horizon_of(const certificate *p, double r)
{
    double horizon = r;
    for (int i = 0; i < GUARDS; i++)
        horizon = smaller(horizon, p->found[i].from);
    return horizon;
}

/* True if a root is before all other candidates: every other guard that crosses once up to `to`, and is
   positive at this root before that, crosses later. For the gap and the first friction guard
   `rival_is_later` proves it. The other friction guard crosses later still (`bound_guards`) if 2 f_b is
   more than the distance of its isolation's bounds, and so does the guard of the other stop. */
inlined mask others_are_later(const segment_sizes *b, int drift, const certificate *p, const location *f)
{
    const guard *g = p->g;
    const isolation *found = p->found;
    const int last_guard = drift ? FIRST : SECOND;
    mask later = 1;
    if (!drift && found[FIRST].crossing && found[SECOND].crossing) {
        const double apart = 3.0 * (g[FIRST].rounding + g[FIRST].tail) +
                             2.0 * larger(found[FIRST].off, found[SECOND].off);
        later = friction_bounds(b) > apart;
    }
#if TWO_STOPS
    if (found[GAP].crossing && found[BACK].crossing) {
        const double apart =
            3.0 * (g[GAP].rounding + g[GAP].tail) + 2.0 * larger(found[GAP].off, found[BACK].off);
        later &= stops_apart(b) > apart;
    }
#endif
    for (int i = 0; i < GUARDS; i++)
        later &= i == (p->is_gap ? GAP : p->lower ? last_guard : FIRST) || found[i].clear ||
                 found[i].from > near_to(f->at) + f->error ||
                 (found[i].crossing && near_to(f->at) + f->error < found[i].to);
    return later;
}
#endif

/* Motion at the end of an expansion. */
inlined void find_motion(const segment *c, const table *t, const expansion *e, const real *a, int drift,
                         int position, location *f)
{
    f->m = motion_at(a, f->at, drift, position);
    f->v_c_by = drift ? v_c_change(c, t, e->slope, &f->m, f->at) : num(0.0);
}

/* Newton's method for the guard that crosses first, or for the other one if that is not certain; and the
   motion there. With `whole` nothing crosses, and only the end of the expansion is requested. */
inlined void locate(const segment *c, const segment_sizes *b, const table *t, const expansion *e,
                    const real *a, int level, int drift, int position, int whole, bound guess,
                    const point *s, certificate *p, location *f)
{
    f->at = wide(all(t->level[level]));
    f->error = all(0.0);
#if WIDTH == 1
    const double horizon = horizon_of(p, t->level[level]);
    int tries = p->both ? 2 : 1;
again:
#endif
    f->corner = none;
    find_root(c, t, e, a, level, drift, guess, s, p, f);
#if WIDTH == 1
    f->at = f->sure || p->crossing ? f->at : wide(horizon);
#endif
    if (whole)
        f->m.x = f->m.slope = f->v_c_by = num(0.0);
    else
        find_motion(c, t, e, a, drift, position, f);
    const mask rivals = f->sure & p->both;
    if (some(rivals)) {
        f->corner = rivals & not(rival_is_later(c, t, e, drift, p, f));
        f->sure &= not(f->corner);
        p->open |= f->corner;
    }
#if WIDTH == 1
    if (f->sure)
        f->sure = others_are_later(b, drift, p, f);
    if (p->crossing && !f->sure && --tries == 1) { /* is it the other one? */
        p->is_gap = !p->is_gap;
        goto again;
    }
    p->open = !f->sure && horizon <= 0x1p-40;
    if (!f->sure && p->crossing && !p->open) { /* up to the time before which nothing happens */
        f->at = wide(horizon);
        find_motion(c, t, e, a, drift, position, f);
    }
#else
    (void)b;
#endif
}

/* Angle after a time, within a turn; true if a period ended, which with pulses is at an edge. */
inlined mask turn(const segment *c, const point *s, real h, mask open, mask edge, point *to)
{
    /* The rounding error of a sum of angles is added to the next sum. */
    const real turned = mad(c->omega, h, wide(s->angle_rest));
    real angle = add(s->angle, turned);
    const real added = sub(angle, s->angle);
    bound rest = near_to(add(sub(s->angle, sub(angle, added)), sub(turned, added)));
    mask passed = none;
#if CAPSULE_PULSED
    (void)open;
    if (some(edge)) {
        real end;
        bound end_rest;
        edge_angle(c, &end, &end_rest);
        const mask falls = gt(near_to(c->high), all(0.0));
        angle = choose(edge, choose(falls, end, num(0.0)), angle);
        rest = pick(edge, pick(falls, end_rest, all(0.0)), rest);
        passed = edge & not(falls);
    }
#else
    (void)edge;
    passed = ge(near_to(angle), all(TWO_PI)) & not(open);
    if (some(passed)) {
#ifdef WIDE
        angle = sub(angle, (real){TWO_PI, TWO_PI_REST});
        if (angle.hi < 0.0)
            angle = num(0.0);
        rest -= TWO_PI_LAST;
#else
        const bound past = angle - TWO_PI, left = rest - TWO_PI_REST;
        const bound turned_back = larger(past + left, all(0.0));
        rest = pick(passed, left - (turned_back - past), rest);
        angle = pick(passed, turned_back, angle);
#endif
    }
#endif
    to->angle = angle;
    to->angle_rest = rest;
    phase_terms(angle, rest, &to->sine, &to->cosine);
    return passed;
}

/* State at the end of an expansion, and the successor after a switch. The end of a whole expansion is
   computed by the closed form. */
inlined void land(const segment *c, const segment_sizes *b, const table *t, const expansion *e,
                  const real *a, int drift, int position, mask entire, bound way, const point *s,
                  const certificate *p, const location *f, point *to, outcome *out)
{
    const mask crossing = f->sure;
    real x_change = f->m.x, speed = add(a[0], f->m.slope);
    real v_c_by = f->v_c_by;
    speed = mul(speed, row(t->per_reach));
    if (some(entire)) {
        x_change = choose(entire, dot(t->x_whole, e->u), x_change);
        speed = choose(entire, dot(t->v_whole, e->u), speed);
        if (drift)
            v_c_by = choose(entire, add(e->slope, dot(t->second_whole, e->u)), v_c_by);
    }
    out->h = mul(f->at, num(t->reach));
#if CAPSULE_PULSED
    out->edge = f->edge;
#else
    out->edge = none;
#endif
    out->passed = turn(c, s, out->h, p->open, out->edge, to);
    const mask at_gap = p->is_gap & crossing, at_friction = crossing & not(p->is_gap);
    const bound zero = all(0.0), one = all(1.0);
    const bound outside = drift ? zero : pick(at_friction, -f->sign, zero);
#if TWO_STOPS
    out->at_back = t->contact ? none : at_gap & p->back;
    const real stop = choose(out->at_back, neg(c->CAPSULE_BACK_GAP), c->CAPSULE_OWN_STOP);
#else
    const real stop = c->CAPSULE_OWN_STOP;
#endif
    to->v_r = speed;
    to->x_r = choose(at_gap, stop, add(s->x_r, x_change));
    to->gap = choose(at_gap, num(0.0), add(s->gap, x_change));
    to->v_c = num(0.0);
    to->position = s->position;
    if (drift) {
        to->v_c = choose(at_friction, num(0.0), add(s->v_c, v_c_by));
        if (position)
            to->position = add(s->position, advance_at(c, t, e->slope, &f->m, s->v_c, f->at));
    }
    mask moved = crossing;
#if CAPSULE_PULSED && CAPSULE_REACTS
    /* At an edge Q jumps to its value at the other level, and rest may break. */
    segment other = *c;
    segment_sizes other_sizes = *b;
    other.high = choose(out->edge, sub(num(1.0), c->high), c->high);
    other_sizes.high = pick(out->edge, all(1.0) - b->high, b->high);
    moved |= out->edge;
    c = &other, b = &other_sizes;
#endif
    if (some(moved)) {
        out->way = direction_after(c, b, to, outside, &out->undetermined);
        out->undetermined &= moved;
        out->way = pick(moved, out->way, way);
    } else {
        out->undetermined = none;
        out->way = way;
    }
    out->crossing = crossing | out->edge;
    out->at_gap = at_gap;
    out->bound_at = outside;
    to->gap_zeros = pick(at_gap, one, zero);
    const mask slips = moved & eq(near_to(to->v_c), zero) & ne(out->way, zero);
    to->second_zeros = pick(slips, pick(ne(outside, zero), all(2.0), one), zero);
    to->margin = choose(crossing & ne(outside, zero), num(0.0),
                        sub(pull(c, to->x_r, to->gap, to->v_r, to->cosine),
                            friction_at(c, wide(out->way))));
#if TWO_STOPS
    /* For the successor field: at one stop the gap to the other is the distance of both. */
    const real apart = add(c->CAPSULE_FRONT_GAP, c->CAPSULE_BACK_GAP);
    to->other = add(s->other, x_change);
    if (t->contact == 2) {
        to->gap = choose(at_gap, neg(apart), to->gap);
        to->other = choose(at_gap, num(0.0), to->other);
    } else {
        to->other = choose(at_gap, choose(out->at_back, neg(apart), apart), to->other);
    }
#endif
}

/* State at the end of a period that an expansion passes. */
inlined void end_of_period(const segment *c, const table *t, const expansion *e, const real *a, int drift,
                           int position, const point *s, outcome *out)
{
    const real left = mad(num(TWO_PI), num(1.0), neg(s->angle));
    const bound rest_left = TWO_PI_REST - s->angle_rest;
    out->end_h = over(add(left, wide(rest_left)), c->omega);
    const real until = mul(out->end_h, row(t->per_reach));
    const motion z = motion_at(a, until, drift, position);
    out->end.x_r = add(s->x_r, z.x);
    out->end.gap = add(s->gap, z.x);
#if TWO_STOPS
    out->end.other = add(s->other, z.x);
#endif
    out->end.v_r = mul(add(a[0], z.slope), row(t->per_reach));
    out->end.v_c = drift ? add(s->v_c, v_c_change(c, t, e->slope, &z, until)) : num(0.0);
    out->end.position = s->position;
    if (drift && position)
        out->end.position = add(s->position, advance_at(c, t, e->slope, &z, s->v_c, until));
}

/* Initial errors of an expansion that continues the segment. */
inlined void propagate_errors(const table *t, const expansion *e,
                              const point *s, mask crossing, point *to)
{
    const bound zero = all(0.0);
    to->energy_error = to->v_c_error = to->angle_error = zero;
    if (!some(not(crossing)))
        return;
    const bound x_size = size_of(near_to(to->x_r));
    /* The rounding of v_r is counted in its own error, which is at least 27 units of all its terms. */
    /* A forcing out of phase works on the motion for the length of the next expansion. */
    const bound angle_error = s->angle_error + 4.0 * UNIT * TWO_PI;
    bound energy = s->energy_error + bound_dot(t->v_error, e->size) +
                   t->root_K * (e->x_own + 2.0 * UNIT * x_size);
#if !CAPSULE_PULSED
    energy += angle_error * e->size[2] * t->reach;
#endif
    /* That of momentum, by which v_c at the end is tabulated, is part of v_r's error. */
    const bound v_c_error = s->v_c_error + e->second_own + energy * t->v_c_per_energy +
                            UNIT * size_of(near_to(to->v_c));
    to->energy_error = pick(crossing, zero, energy);
    to->v_c_error = pick(crossing, zero, v_c_error);
    to->angle_error = pick(crossing, zero, angle_error);
}

inlined void step(const segment *c, const segment_sizes *b, const table *t, int level, int drift,
                  int position, int ends, bound way, bound guess, const point *s, point *to,
                  outcome *out)
{
    const expansion e = expand(c, b, t, drift, s);
    certificate p;
    location f;
    real a[TERMS];
    bound_guards(c, t, &e, level, drift, way, s, &p);
    mask entire = level == 0 ? not(none) : none;
#if WIDTH == 1
    entire &= horizon_of(&p, t->level[level]) == 1.0;
#endif
#if CAPSULE_PULSED
    const real until = mul(time_to_edge(c, s), row(t->per_reach));
    const bound edge_error = (s->angle_error + 8.0 * UNIT * TWO_PI) / near_to(c->omega) *
                                 near_to(row(t->per_reach)) + 4.0 * UNIT * near_to(until);
    const mask near_edge = le(near_to(until), all(t->level[level]) + edge_error);
#else
    const mask near_edge = none;
#endif
    const int whole = !some(p.crossing | near_edge) && !position && !ends && level == 0 && some(entire);
    for (int n = 0; n < (whole ? 1 : TERMS); n++)
        a[n] = combined(e.u, t->x, n);
    locate(c, b, t, &e, a, level, drift, position, whole, guess, s, &p, &f);
#if CAPSULE_PULSED
    find_edge(c, t, &e, a, level, drift, position, until, edge_error, near_edge, &p, &f);
    entire &= not(f.edge);
#endif
    land(c, b, t, &e, a, drift, position, entire & not(f.sure), way, s, &p, &f, to, out);
    out->open = p.open;
    out->corner = f.corner;
    out->error = f.error;
#if CAPSULE_PULSED
    if (ends && some(out->passed))
        out->end = *to;
#else
    if (ends && some(out->passed))
        end_of_period(c, t, &e, a, drift, position, s, out);
#endif
    propagate_errors(t, &e, s, out->crossing, to);
}
