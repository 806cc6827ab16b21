/* The certified step: one expansion of a motion, in which every switch is found or excluded by
   proof. Written once, over the numbers of number.h.

   On an expansion the time unit is its reach. x_r(s) - x_r(0) is a combination of four tabulated
   responses; P and v_c follow term by term. The same coefficients bound a guard (in Bernstein
   form) and give the states, and small durations lose no digits, because the value at the start is
   never part of the sum.

   Errors of the instant an expansion stands at obey the segment's free motion, whose energy never
   grows: |dx_r| <= e/sqrt(K), |dv_r| <= e, |dP| <= force_per_energy e, and by momentum
   (gamma + 1) |dv_c - dv_c(0)| <= 2 e. */
#include "number.h"

#define ROUNDS 60 /* of Newton's method; what takes more is left open */

/* Where an expansion stands: a segment's start, or a later instant with the error come to. */
typedef struct {
    real x_r, gap, v_r, v_c, margin, angle, cosine, sine, position;
    bound angle_rest; /* by how much the angle is more than rounded */
    bound gap_zeros;  /* derivatives that vanish at the start, of the gap */
    bound second_zeros; /* and of v_c; at rest 1 (-1) where P is f_b (-f_b) */
    bound energy_error; /* of x_r and v_r: sqrt(dv^2 + K dx^2), which the flow never enlarges */
    bound v_c_error, angle_error;
} point;

typedef struct {
    real u[4], slope;                   /* multiples of the responses; in drift v_c' reach */
    bound size[4];                      /* what the multiples add up */
    bound limit[CAPSULE_LIMITS];        /* the table's bounds by these */
    bound x_own, second_own;            /* error bounds of x_r, and of P or v_c: this expansion's */
    bound x_rounding, second_rounding;  /* and all */
} expansion;

inlined bound bound_dot(const double *t, const bound *size)
{
    return fused(all(t[1]), size[1], t[0] * size[0]) + fused(all(t[3]), size[3], t[2] * size[2]);
}

/* A combination of rows of a table. */
inlined real combined(const real *u, entry a, entry b, entry c, entry d)
{
    return add(mad(row(a), u[0], mul(row(b), u[1])), mad(row(c), u[2], mul(row(d), u[3])));
}

inlined real dot(const entry *t, const real *u)
{
    return combined(u, t[0], t[1], t[2], t[3]);
}

inlined expansion expand(const segment *c, const segment_sizes *b, const table *t, int drift,
                         const point *s)
{
    expansion e;
    const bound x = size_of(near_to(s->x_r)), gap = size_of(near_to(s->gap));
    const bound v = size_of(near_to(s->v_r)), v_c = size_of(near_to(s->v_c));
    e.u[0] = rest_force(c, s->x_r, s->gap);
    e.u[1] = s->v_r;
    forcing_terms(c, s->cosine, s->sine, &e.u[2], &e.u[3]);
    e.size[0] = rest_force_size(b, x, gap);
    e.size[1] = v;
    forcing_terms_size(b, &e.size[2], &e.size[3]);
    const bound margin_error =
        (MARGIN_AT_UNITS + 1) * UNIT * (margin_at_size(b, x, gap, v) + friction_bounds(b));
    for (int i = 0; i < CAPSULE_LIMITS; i++)
        e.limit[i] = fused(all(t->limit[1][i]), e.size[1], t->limit[0][i] * e.size[0]) +
                     fused(all(t->limit[3][i]), e.size[3], t->limit[2][i] * e.size[2]);
    e.x_own = e.limit[X_ERROR] + 2.0 * UNIT * gap + UNDERFLOW;
    e.second_own = e.limit[SECOND_ERROR] + UNDERFLOW;
    e.slope = num(0.0);
    if (drift) {
        e.slope = mul(v_c_rate(c, s->margin), num(t->reach));
        e.second_own += pick(lt(s->second_zeros, all(2.0)), margin_error * t->reach_per_gamma, all(0.0));
        e.second_rounding = e.second_own + s->v_c_error +
                            s->energy_error * t->v_c_per_energy + UNIT * v_c;
    } else {
        e.second_own += pick(eq(s->second_zeros, all(0.0)), margin_error, all(0.0));
        e.second_rounding = e.second_own + t->force_per_energy * s->energy_error;
    }
    e.x_rounding = e.x_own + s->energy_error * t->x_per_energy;
    return e;
}

/* A guard on an expansion: first + sum of its polynomial, with what it is certain within. */
typedef struct {
    real first, form[DEGREE]; /* Bernstein coefficients 1 to DEGREE of the guard less its first */
    bound zeros, rounding, tail; /* off by rounding s^zeros + tail s^3 */
    bound sign, range, bend; /* of the form; its largest coefficient, and second derivative */
} guard;

/* What is proved of it on (0, r]: positive up to `from`; if `crossing`, then zero once, and negative
   from `to` on; `near` is about where. */
typedef struct {
    mask clear, crossing;
    bound from, to, near;
} isolation;

/* From the signs of the coefficients, all of them beyond what any can be off: a guard that vanishes at
   the start is off by less, as s^zeros. With `twice` zeros may be 2. */
inlined isolation certify(const guard *g, double r, int twice)
{
    const mask begun = gt(g->zeros, all(0.0)), skipped = eq(g->zeros, all(2.0));
    const real base = choose(begun, num(0.0), g->first);
    const bound error = g->rounding + g->tail * (r * r * r);
    const mask starts = begun | gt(near_to(g->first), g->rounding);
    bound value[DEGREE];
    for (int j = 0; j < DEGREE; j++)
        value[j] = near_to(add(base, g->form[j]));
    if (twice) /* coefficient 1 of s^2 is 0 */
        value[0] = pick(skipped, all(1.0), value[0]);
    bound least = value[0];
    for (int j = 1; j < DEGREE; j++)
        least = smaller(least, value[j]);
    const mask above = starts & gt(least, error);
    if (!some(not(above)))
        return (isolation){above, none, all(r), all(r), all(r)};
    mask below = lt(value[0], all(0.0)), turned = none;
    bound index = pick(below, all(0.0), all(1.0)), nearest = size_of(value[0]);
    for (int j = 1; j < DEGREE; j++) {
        const mask before = below;
        below = lt(value[j], all(0.0));
        turned |= before & not(below);
        index += pick(below, all(0.0), all(1.0));
        nearest = smaller(nearest, size_of(value[j]));
    }
    isolation f;
    const mask proved = starts & not(turned) & gt(nearest, error);
    f.clear = proved & not(below);
    f.crossing = proved & below;
    f.from = pick(f.clear, all(r), all(0.0));
    f.to = all(r);
    f.near = (index + 0.5) * (r / DEGREE);
    return f;
}

/* The motion at s, from coefficients of s, s^2, ... of x_r(s) - x_r(0). */
typedef struct {
    real x, slope, lag; /* x_r(s) - x_r(0); its derivative, and itself, without the linear term */
    real sum, lag_sum, again; /* integrals of x and of the lag over (0, s), and of `sum` */
} motion;

inlined motion motion_at(const real *a, real s, int drift, int position)
{
    real y = a[TERMS - 1], y1 = num(0.0);
    real z = part(a[TERMS - 1], TERMS + 1), w = part(z, TERMS + 2);
    for (int n = TERMS - 1; n >= 2; n--) { /* coefficient n is a[n - 1] */
        y1 = mad(y1, s, y);
        y = mad(y, s, a[n - 1]);
        if (drift) {
            const real b = part(a[n - 1], n + 1), d = part(b, n + 2);
            z = mad(z, s, b);
            if (position)
                w = mad(w, s, d);
        }
    }
    motion m;
    const real s2 = mul(s, s), half = num(0.5), sixth = part(num(1.0), 6);
    m.lag = mul(s2, y);
    m.x = mad(s, a[0], m.lag);
    m.slope = mul(s, mad(s, y1, add(y, y)));
    m.sum = mul(s2, mad(s, z, mul(half, a[0])));
    m.lag_sum = mul(mul(s2, s), z);
    m.again = mul(mul(s2, s), mad(s, w, mul(sixth, a[0])));
    return m;
}

/* v_c(s) - v_c(0), and x_c(s) - x_c(0), by the integrals of P. */
inlined real v_c_change(const segment *c, const table *t, const expansion *e, const motion *m, real s)
{
    const real grown = v_c_rate(c, force_change(c, m->sum, mul(m->lag, row(t->per_reach))));
    return mad(num(t->reach), grown, mul(e->slope, s));
}

inlined real advance_at(const segment *c, const table *t, const expansion *e, const motion *m,
                        real v_c, real s)
{
    const real grown = v_c_rate(c, force_change(c, m->again, mul(m->lag_sum, row(t->per_reach))));
    const real begun = mul(s, mad(mul(num(0.5), s), e->slope, v_c));
    return mul(num(t->reach), mad(num(t->reach), grown, begun));
}

/* Guards of a segment: the gap's side or the sign of v_c, or f_b -+ P. */
enum { GAP, FIRST, SECOND };

/* All of a guard but its form. */
inlined guard guard_of(const segment *c, const expansion *e, const point *s, int which, int drift,
                       bound sign)
{
    const int gap = which == GAP;
    guard g;
    g.sign = sign;
    g.first = gap     ? mul(wide(sign), s->gap)
              : drift ? mul(wide(sign), s->v_c)
                      : friction_guard(c, wide(sign), s->margin);
    g.zeros = gap     ? s->gap_zeros
              : drift ? s->second_zeros
                      : larger(-sign * s->second_zeros, all(0.0));
    g.rounding = gap ? e->x_rounding : e->second_rounding;
    g.tail = gap ? e->limit[X_TAIL] : e->limit[SECOND_TAIL];
    g.range = gap ? e->limit[X_RANGE] : e->limit[SECOND_RANGE];
    g.bend = gap ? e->limit[X_BEND] : e->limit[SECOND_BEND];
    return g;
}

/* Its form: that of another with its sign turned, if there is one. */
inlined void form_of(const table *t, const expansion *e, int which, int level, int drift,
                     const guard *other, guard *g)
{
    const entry(*rows)[DEGREE] = which == GAP ? t->x_form[level] : t->second_form[level];
    const real by = wide(g->sign);
    const real u[4] = {mul(by, e->u[0]), mul(by, e->u[1]), mul(by, e->u[2]), mul(by, e->u[3])};
    const real slope = mul(mul(by, e->slope), num(t->level[level]));
    for (int j = 0; j < DEGREE; j++) {
        g->form[j] = other ? neg(other->form[j])
                           : combined(u, rows[0][j], rows[1][j], rows[2][j], rows[3][j]);
        if (drift && which != GAP)
            g->form[j] = mad(slope, part(num(j + 1.0), DEGREE), g->form[j]);
    }
}

/* Whether a guard is further from zero than it could come. */
inlined mask out_of_range(const guard *g, const expansion *e, int slipping)
{
    const bound range = g->range, rounding = g->rounding, tail = g->tail;
    const bound slope = slipping ? g->sign * near_to(e->slope) : all(0.0);
    return eq(g->zeros, all(0.0)) &
           gt(near_to(g->first) + smaller(slope, all(0.0)), (range + rounding) + tail);
}

/* What follows a switch off the lines: the drift's way, and where that stays open. `bound_at` is 1
   (-1) where P left rest at f_b (-f_b), outwards: that is a simple root of its guard. */
inlined bound direction_after(const segment *c, const segment_sizes *b, const point *s, bound bound_at,
                        mask *undetermined)
{
    const bound x = size_of(near_to(s->x_r)), gap = size_of(near_to(s->gap));
    const bound v = size_of(near_to(s->v_r)), terms = force_size(b, x, gap, v);
    const real pull = force(c, s->x_r, s->gap, s->v_r);
    const mask rests = eq(near_to(s->v_c), all(0.0)), at_bound = ne(bound_at, all(0.0));
    const bound side = pick(gt(near_to(pull), all(0.0)), all(1.0), all(-1.0));
    const bound within = near_to(friction_guard(c, wide(-side), pull));
    const mask close = le(size_of(within), 16.0 * UNIT * (terms + friction_bounds(b)));
    *undetermined = (rests & not(at_bound) & close) |
               (eq(near_to(s->gap), all(0.0)) & eq(near_to(s->v_r), all(0.0)));
    const bound at_rest = pick(at_bound, bound_at, pick(lt(within, all(0.0)), side, all(0.0)));
    return pick(rests, at_rest, pick(gt(near_to(s->v_c), all(0.0)), all(1.0), all(-1.0)));
}

/* What became of a step. */
typedef struct {
    mask open;     /* nothing is proved, neither of this expansion nor of a part of it */
    mask corner;   /* for two guards vanish together */
    mask crossing; /* a switch ends the segment */
    mask passed;   /* an excitation period ended in it */
    mask undetermined;  /* what follows the switch stays open here */
    mask at_gap;   /* the gap's guard fired */
    bound way;     /* after a switch, of the drift: 1, -1, or 0 at rest */
    bound bound_at; /* and whether P is f_b (1) or -f_b (-1) there exactly */
    bound error;   /* of a switching time */
    real h;        /* the time it took */
    real end_h;    /* until the end of the period passed */
    point end;     /* at the end of that period */
} outcome;

#if WIDTH == 1
/* What is proved on (0, r] where the signs alone do not tell, by halving (isolate.h). */
static void isolate(const guard *g, double r, isolation *f);
#endif

inlined void step(const segment *c, const segment_sizes *b, const table *t, int level, int drift,
                  int position, int ends, bound way, bound guess, const point *s, point *to,
                  outcome *out)
{
    const double side = t->contact ? 1.0 : -1.0, r = t->level[level];
    const bound zero = all(0.0), one = all(1.0);
    const expansion e = expand(c, b, t, drift, s);

    /* Which guards are clear, and which cross zero once. */
    const bound signs[3] = {all(side), drift ? way : -one, one};
    const int count = drift ? 2 : 3, last_guard = count - 1;
    isolation found[3];
    guard g[3];
    int made = -1;
    mask open = none, crossing = none;
    for (int i = 0; i < count; i++) {
        g[i] = guard_of(c, &e, s, i, drift, signs[i]);
        const mask clear = out_of_range(&g[i], &e, drift && i != GAP);
        found[i] = (isolation){clear, none, all(r), all(r), all(r)};
        if (!some(not(clear)))
            continue;
        form_of(t, &e, i, level, drift, made == FIRST && i == SECOND ? &g[FIRST] : NULL, &g[i]);
        made = i;
        const isolation f = certify(&g[i], r, WIDTH == 1 || (drift && i != GAP));
        found[i].clear = clear | f.clear;
        found[i].crossing = f.crossing & not(clear);
        found[i].from = pick(clear, found[i].from, f.from);
        found[i].near = f.near;
#if WIDTH == 1
        if (!found[i].clear && !found[i].crossing)
            isolate(&g[i], r, &found[i]);
#endif
        open |= not(found[i].clear | found[i].crossing);
        crossing |= found[i].crossing;
    }
    /* Of two friction guards that cross, C is the one with the smaller `to`, T the other one: then T is
       positive up to C's `to`. For T is 2 f_b - C or more, so more than 2 f_b there, which is more than its
       bounds are apart (below): its lower bound is positive there, and changes its sign once up to T's
       `to`. So no two `to` are equal, and in lanes, where each is r, one of them crosses at most. */
    const mask lower =
        drift ? none
              : found[SECOND].crossing &
                    (not(found[FIRST].crossing) | lt(found[SECOND].to, found[FIRST].to));
    mask is_gap, both, corner = none;
    {
        const mask by_friction = drift ? found[FIRST].crossing
                                     : found[FIRST].crossing | found[SECOND].crossing;
        const bound index = pick(lower, found[last_guard].near, found[FIRST].near);
        both = found[GAP].crossing & by_friction;
        is_gap = found[GAP].crossing & (not(by_friction) | ge(index, found[GAP].near));
    }
#if WIDTH == 1
    double horizon = r;
    for (int i = 0; i < count; i++)
        horizon = smaller(horizon, found[i].from);
    int tries = both ? 2 : 1;
#endif

    /* Newton's method for the guard that crosses first; it is held to where that is isolated. */
    real a[TERMS];
    mask active;
    const int whole = !some(crossing) && !position && !ends && level == 0
#if WIDTH == 1
                      && horizon == 1.0
#endif
        ;
    for (int n = 0; n < (whole ? 1 : TERMS); n++)
        a[n] = combined(e.u, t->x[0][n], t->x[1][n], t->x[2][n], t->x[3][n]);
    real at = wide(all(r)), last = num(0.0);
    bound steepness = one, error = zero, sign = one, zeros = zero;
    motion m;
    mask sure;
#if WIDTH == 1
again:
#endif
    sure = crossing & (WIDTH == 1 ? crossing : not(open));
    active = sure;
    sign = pick(is_gap, g[GAP].sign, pick(lower, g[last_guard].sign, g[FIRST].sign));
    zeros = pick(is_gap, g[GAP].zeros, pick(lower, g[last_guard].zeros, g[FIRST].zeros));
    const bound bend = pick(is_gap, g[GAP].bend, g[FIRST].bend);
    if (some(active)) {
        enum { MOST = TERMS + 1 };
        real p[MOST + 1]; /* sign times the guard */
        p[0] = choose(is_gap, s->gap, drift ? s->v_c : mul(wide(sign), friction_guard(c, wide(sign), s->margin)));
        const int gaps = some(is_gap), others = some(active & not(is_gap));
        for (int n = 1; n <= MOST; n++) {
            real term = num(0.0);
            if (others) {
                const int k = n - drift; /* P's or v_c's coefficient by those of x_r */
                const real low = k >= 1 && k <= TERMS ? a[k - 1] : num(0.0);
                const real high = k + 1 >= 2 && k + 1 <= TERMS ? a[k] : num(0.0);
                term = drift && n == 1 ? e.slope
                                       : mad(row(t->from_position[n - 1]), low,
                                             mul(row(t->from_rate[n - 1]), high));
            }
            const real gap_term = n <= TERMS ? a[n - 1 < TERMS ? n - 1 : 0] : num(0.0);
            p[n] = !gaps ? term : !others ? gap_term : choose(is_gap, gap_term, term);
        }
        bound low = zero, high = all(r), falling = one;
        bound start = pick(is_gap, found[GAP].near,
                           pick(lower, found[last_guard].near, found[FIRST].near));
#if WIDTH == 1
        const isolation *f = &found[is_gap ? GAP : lower ? last_guard : FIRST];
        low = f->from, high = f->to;
#endif
        start = pick(gt(guess, low) & lt(guess, high) & lt(size_of(guess - start), all(0.125)), guess, start);
        at = choose(active, wide(start), wide(all(r)));
        for (int round = 0; some(active); round++) {
            /* Even and odd parts apart: two chains of half the length. */
            const real s2 = mul(at, at);
            real even = p[MOST - 1], odd = p[MOST], even1 = num(0.0), odd1 = num(0.0);
#if TERMS % 2
#error "an even number of terms"
#endif
            for (int n = MOST - 3; n >= 0; n -= 2) {
                even1 = mad(even1, s2, even);
                odd1 = mad(odd1, s2, odd);
                even = mad(even, s2, p[n]);
                odd = mad(odd, s2, p[n + 1]);
            }
            const real value = mad(at, odd, even);
            const real rate = mad(mul(num(2.0), s2), odd1, mad(mul(num(2.0), at), even1, odd));
            /* Newton's step for the guard over s^zeros, and minus s times the guard's own slope. */
            const real fall = sub(mul(wide(zeros), value), mul(at, rate));
            const real by_much = over(mul(at, value), fall);
            const bound on = near_to(by_much), here = near_to(at);
            const mask positive = gt(sign * near_to(value), zero);
            low = pick(active & positive, here, low);
            high = pick(active & not(positive), here, high);
            const mask close = active & (le(size_of(on), ROOT_UNIT * here) |
                                         le(on * on * bend, UNIT * size_of(near_to(fall))));
            last = choose(close, by_much, last);
            falling = pick(active, sign * near_to(fall), falling);
            active &= not(close);
            if (round == ROUNDS) {
                open |= active;
                sure &= not(active);
                break;
            }
            const real next = add(at, by_much);
            const mask inside = gt(near_to(next), low) & lt(near_to(next), high);
            at = choose(active, choose(inside, next, wide(0.5 * (low + high))), at);
        }
        at = choose(sure, add(at, last), at);
        const bound here = near_to(at);
        steepness = falling / here;
        const bound reached = smaller(one, here + here), r2 = reached * reached;
        const bound rounding = pick(is_gap, g[GAP].rounding, g[FIRST].rounding) *
                               pick(gt(zeros, zero), pick(gt(zeros, one), r2, reached), one);
        const bound tail = pick(is_gap, g[GAP].tail, g[FIRST].tail);
        /* Simple: |g'| keeps half its size as far as `straight` either way, for |g''| <= bend; and
           there the bounds that were counted have their one crossing each. */
        const bound apart = tail * (r2 * reached) + 1.5 * rounding;
        const bound straight = smaller(0.5 * steepness / bend, here);
        /* Twice the rounding is 12 units of the root's own or more, for a slope's terms are counted in
           it: so it holds what the root is rounded by as well. */
        error = (rounding + rounding) / steepness;
        const mask simple = gt(steepness, zero) & gt(0.5 * steepness * straight, apart + apart);
        open |= sure & not(simple);
        sure &= simple;
    }
#if WIDTH == 1
    at = sure || crossing ? at : wide(horizon);
#endif
    if (!whole)
        m = motion_at(a, at, drift, position);
    const real changed = drift && !whole ? v_c_change(c, t, &e, &m, at) : num(0.0);
    if (some(sure & both)) {
        /* A guard that crosses once, and is still positive at the other's root, crosses later. */
        const mask other_is_gap = not(is_gap);
        const bound other_sign = drift ? way : pick(lower, one, -one);
        const real gap = mul(wide(all(side)), add(s->gap, m.x));
        const real pulled = force_change(c, m.x, mul(m.slope, row(t->per_reach)));
        const real second = drift ? mul(wide(other_sign), add(s->v_c, changed))
                                  : friction_guard(c, wide(other_sign), add(s->margin, pulled));
        const bound value = near_to(choose(other_is_gap, gap, second));
        const bound most = bound_dot(t->x_speed, e.size) + bound_dot(t->second_speed, e.size) +
                           size_of(near_to(e.slope));
        const bound near_zero =
            pick(other_is_gap, g[GAP].rounding + g[GAP].tail, g[FIRST].rounding + g[FIRST].tail) +
            error * most;
        const mask later = gt(value, near_zero);
        corner = sure & both & not(later);
        sure &= not(corner);
        open |= corner;
    }
#if WIDTH == 1
    /* Before whatever else may be: another guard that crosses once up to `to`, and is positive at this
       root before that, crosses later. Of the gap and the first friction guard it was proved above; the
       other friction guard crosses later still, where 2 f_b is more than its isolation is off by. */
    if (sure && !drift && found[FIRST].crossing && found[SECOND].crossing)
        sure = friction_bounds(b) > 3.0 * (g[FIRST].rounding + g[FIRST].tail) + ROOT_UNIT * g[FIRST].range;
    if (crossing && sure)
        for (int i = 0; i < count; i++)
            sure &= i == (is_gap ? GAP : lower ? last_guard : FIRST) || found[i].clear ||
                    found[i].from > near_to(at) + error ||
                    (found[i].crossing && near_to(at) + error <= found[i].to);
    if (crossing && !sure && --tries == 1) { /* is it the other one? */
        is_gap = !is_gap;
        corner = 0;
        goto again;
    }
    open = !sure && horizon <= 0x1p-40;
    if (!sure && crossing && !open) { /* up to where nothing happens */
        at = wide(horizon);
        m = motion_at(a, at, drift, position);
    }
    const real changed_here = drift && !whole ? v_c_change(c, t, &e, &m, at) : num(0.0);
    crossing = sure;
#else
    const real changed_here = changed;
    crossing = sure;
#endif
    out->open = open;
    out->corner = corner;
    out->error = error;

    /* The state where it ends; that of the whole expansion by the closed form. */
    const mask entire = not(crossing)
#if WIDTH == 1
                        & (horizon == 1.0) & (level == 0)
#else
                        & (level == 0 ? not(none) : none)
#endif
        ;
    real x_change = whole ? num(0.0) : m.x, speed = whole ? num(0.0) : add(a[0], m.slope);
    real v_c_by = changed_here;
    speed = mul(speed, row(t->per_reach));
    if (some(entire)) {
        x_change = choose(entire, dot(t->x_whole, e.u), x_change);
        speed = choose(entire, dot(t->v_whole, e.u), speed);
        if (drift)
            v_c_by = choose(entire, add(e.slope, dot(t->second_whole, e.u)), v_c_by);
    }
    const real h = mul(at, num(t->reach));
    out->h = h;
    /* What rounding takes from a sum of angles goes into the next one. */
    const real turned = mad(c->omega, h, wide(s->angle_rest));
    real angle = add(s->angle, turned);
    const real added = sub(angle, s->angle);
    bound rest = near_to(add(sub(s->angle, sub(angle, added)), sub(turned, added)));
    const mask passed = ge(near_to(angle), all(TWO_PI)) & not(open);
    if (some(passed)) {
#ifdef WIDE
        angle = sub(angle, (real){TWO_PI, TWO_PI_REST});
        if (angle.hi < 0.0)
            angle = num(0.0);
        rest -= TWO_PI_LAST;
#else
        const bound past = angle - TWO_PI, left = rest - TWO_PI_REST;
        const bound turned_back = larger(past + left, zero);
        rest = pick(passed, left - (turned_back - past), rest);
        angle = pick(passed, turned_back, angle);
#endif
    }
    out->passed = passed;
    to->angle = angle;
    to->angle_rest = rest;
    sine_cosine(angle, rest, &to->sine, &to->cosine);
    const mask at_gap = is_gap & crossing, at_friction = crossing & not(is_gap);
    const bound outside = drift ? zero : pick(at_friction, -sign, zero);
    to->v_r = speed;
    to->x_r = choose(at_gap, c->delta, add(s->x_r, x_change));
    to->gap = choose(at_gap, num(0.0), add(s->gap, x_change));
    to->v_c = num(0.0);
    to->position = s->position;
    if (drift) {
        to->v_c = choose(at_friction, num(0.0), add(s->v_c, v_c_by));
        if (position)
            to->position = add(s->position, advance_at(c, t, &e, &m, s->v_c, at));
    }
    if (some(crossing)) {
        out->way = direction_after(c, b, to, outside, &out->undetermined);
        out->undetermined &= crossing;
        out->way = pick(crossing, out->way, way);
    } else {
        out->undetermined = none;
        out->way = way;
    }
    out->crossing = crossing;
    out->at_gap = at_gap;
    out->bound_at = outside;
    to->gap_zeros = pick(at_gap, one, zero);
    const mask slips = crossing & eq(near_to(to->v_c), zero) & ne(out->way, zero);
    to->second_zeros = pick(slips, pick(ne(outside, zero), all(2.0), one), zero);
    to->margin = choose(crossing & ne(outside, zero), num(0.0),
                        sub(force(c, to->x_r, to->gap, to->v_r), friction_at(c, wide(out->way))));

    if (ends && some(passed)) {
        const real left = mad(num(TWO_PI), num(1.0), neg(s->angle));
        const bound rest_left = TWO_PI_REST - s->angle_rest;
        out->end_h = over(add(left, wide(rest_left)), c->omega);
        const real until = mul(out->end_h, row(t->per_reach));
        const motion z = motion_at(a, until, drift, position);
        out->end.x_r = add(s->x_r, z.x);
        out->end.gap = add(s->gap, z.x);
        out->end.v_r = mul(add(a[0], z.slope), row(t->per_reach));
        out->end.v_c = drift ? add(s->v_c, v_c_change(c, t, &e, &z, until)) : num(0.0);
        out->end.position = s->position;
        if (drift && position)
            out->end.position = add(s->position, advance_at(c, t, &e, &z, s->v_c, until));
    }

    /* Where the segment goes on, the errors that an expansion from there begins with. */
    to->energy_error = to->v_c_error = to->angle_error = zero;
    if (!some(not(crossing)))
        return;
    const bound x_size = size_of(near_to(to->x_r));
    /* The rounding of v_r is counted in its own error, 27 units or more of all that it adds up. */
    /* A forcing out of phase works on the motion for as long as the next expansion reaches. */
    const bound angle_error = s->angle_error + 4.0 * UNIT * TWO_PI;
    const bound energy = s->energy_error + bound_dot(t->v_error, e.size) +
                         t->root_K * (e.x_own + 2.0 * UNIT * x_size) +
                         angle_error * b->alpha * t->reach;
    /* That of momentum, by which the whole expansion's v_c is tabulated, is among those of v_r. */
    const bound v_c_error = s->v_c_error + e.second_own + energy * t->v_c_per_energy +
                            UNIT * size_of(near_to(to->v_c));
    to->energy_error = pick(crossing, zero, energy);
    to->v_c_error = pick(crossing, zero, v_c_error);
    to->angle_error = pick(crossing, zero, angle_error);
}
