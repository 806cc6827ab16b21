/* One expansion of a motion, its guards and their error bounds. Written once, over the numbers of
   number.h.

   On an expansion the time unit is its reach. x_r(s) - x_r(0) is a combination of tabulated
   responses; Q and v_c follow term by term. The same coefficients bound a guard (in Bernstein
   form) and give the states, and small durations lose no digits, because the value at the start is
   never part of the sum.

   Errors of the instant an expansion stands at obey the segment's free motion, whose energy never
   grows: |dx_r| <= e/sqrt(K), |dv_r| <= e, |dP| <= force_per_energy e, and by momentum
   (gamma + 1) |dv_c - dv_c(0)| <= 2 e. */
#include "number.h"

/* Instant of an expansion: a segment's start, or a later instant with its accumulated error. */
typedef struct {
    real x_r, gap, v_r, v_c, margin, angle, cosine, sine, position;
    bound angle_rest; /* rounding error of the angle */
    bound gap_zeros;  /* derivatives that vanish at the start, of the gap */
    bound second_zeros; /* and of v_c; at rest 1 (-1) where Q is f_b (-f_b) */
    bound energy_error; /* of x_r and v_r: sqrt(dv^2 + K dx^2), which the flow never enlarges */
    bound v_c_error, angle_error;
#if TWO_STOPS
    real other; /* gap to the other stop: the one behind, or in contact behind the one in front */
#endif
} point;

#define RESPONSES CAPSULE_RESPONSE_COUNT

typedef struct {
    real u[RESPONSES], slope;           /* multiples of the responses; in drift v_c' reach */
    bound size[RESPONSES];                      /* sum of the multiples' sizes */
    bound limit[CAPSULE_LIMITS];        /* the table's bounds by these */
    bound x_own, second_own;            /* error bounds of x_r, and of Q or v_c: this expansion's */
    bound x_rounding, second_rounding;  /* and all */
} expansion;

inlined bound bound_dot(const double *t, const bound *size)
{
#if CAPSULE_PULSED
    return fused(all(t[1]), size[1], t[0] * size[0]);
#else
    return fused(all(t[1]), size[1], t[0] * size[0]) + fused(all(t[3]), size[3], t[2] * size[2]);
#endif
}

/* Combinations of a table's entries for two responses, and for all of them; in column n of its rows. */
inlined real combined_two(const real *u, entry a, entry b)
{
    return mad(row(a), u[0], mul(row(b), u[1]));
}

#if CAPSULE_PULSED
#define combined(u, t, n) combined_two(u, (t)[0][n], (t)[1][n])
#else
#define combined(u, t, n)                                                                          \
    add(combined_two(u, (t)[0][n], (t)[1][n]), combined_two((u) + 2, (t)[2][n], (t)[3][n]))
#endif

inlined real dot(const entry *t, const real *u)
{
#if CAPSULE_PULSED
    return combined_two(u, t[0], t[1]);
#else
    return add(combined_two(u, t[0], t[1]), combined_two(u + 2, t[2], t[3]));
#endif
}

inlined expansion expand(const segment *c, const segment_sizes *b, const table *t, int drift,
                         const point *s)
{
    expansion e;
    const bound x = size_of(near_to(s->x_r)), gap = size_of(near_to(s->gap));
    const bound v = size_of(near_to(s->v_r)), v_c = size_of(near_to(s->v_c));
    e.u[0] = rest_force(c, s->x_r, s->gap);
    e.u[1] = s->v_r;
#if !CAPSULE_PULSED
    forcing_terms(c, s->cosine, s->sine, &e.u[2], &e.u[3]);
#endif
    e.size[0] = rest_force_size(b, x, gap);
    e.size[1] = v;
#if !CAPSULE_PULSED
    forcing_terms_size(b, &e.size[2], &e.size[3]);
#endif
    const bound margin_error =
        (MARGIN_AT_UNITS + 1) * UNIT * (margin_at_size(b, x, gap, v) + friction_bounds(b));
    for (int i = 0; i < CAPSULE_LIMITS; i++)
#if CAPSULE_PULSED
        e.limit[i] = fused(all(t->limit[1][i]), e.size[1], t->limit[0][i] * e.size[0]);
#else
        e.limit[i] = fused(all(t->limit[1][i]), e.size[1], t->limit[0][i] * e.size[0]) +
                     fused(all(t->limit[3][i]), e.size[3], t->limit[2][i] * e.size[2]);
#endif
    e.x_own = e.limit[X_ERROR] + 2.0 * UNIT * gap + UNDERFLOW;
#if TWO_STOPS
    if (!t->contact)
        e.x_own += 2.0 * UNIT * size_of(near_to(s->other));
#endif
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
        if (CAPSULE_REACTION) /* Q has the drive itself, at an angle that is off */
            e.second_rounding += b->alpha * s->angle_error;
    }
    e.x_rounding = e.x_own + s->energy_error * t->x_per_energy;
    return e;
}

/* A guard on an expansion: first + its polynomial's sum, with its uncertainty. */
typedef struct {
    real first, form[DEGREE]; /* Bernstein coefficients 1 to DEGREE of the guard less its first */
    bound zeros, rounding, tail; /* error at most rounding s^zeros + tail s^3 */
    bound sign, range, bend; /* of the form; its largest coefficient, and second derivative */
} guard;

/* Proved facts about it on (0, r]: positive up to `from`. If `crossing`, two polynomials below and above it
   cross zero once each in (from, to), and it is negative at `to`; `near` is about the root. Their distance
   from its form is its uncertainty plus `off`. */
typedef struct {
    mask clear, crossing;
    bound from, to, near, off;
} isolation;

/* Isolation from the signs of the coefficients, all of them larger than any error: the error of a guard that
   vanishes at the start shrinks as s^zeros. With `twice` zeros may be 2. */
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
        return (isolation){above, none, all(r), all(r), all(r), all(0.0)};
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
    f.off = all(0.0);
    return f;
}

/* The motion at s, from coefficients of s, s^2, ... of x_r(s) - x_r(0). */
typedef struct {
    real x, slope, lag; /* x_r(s) - x_r(0); its derivative, and itself, without the linear term */
#if CAPSULE_REACTION
    real bend, bend_slope; /* x without its linear and quadratic terms, and its derivative */
#else
    real sum, lag_sum, again; /* integrals of x and of the lag over (0, s), and of `sum` */
#endif
} motion;

#if CAPSULE_REACTION
inlined motion motion_at(const real *a, real s, int drift, int position)
{
    real y = a[TERMS - 1], y1 = num(0.0), bend = y;
    (void)drift, (void)position;
    for (int n = TERMS - 1; n >= 2; n--) { /* coefficient n is a[n - 1] */
        bend = y;
        y1 = mad(y1, s, y);
        y = mad(y, s, a[n - 1]);
    }
    motion m;
    const real s2 = mul(s, s);
    m.lag = mul(s2, y);
    m.x = mad(s, a[0], m.lag);
    m.slope = mul(s, mad(s, y1, add(y, y)));
    m.bend = mul(mul(s2, s), bend);
    m.bend_slope = mul(s2, add(y1, add(bend, bend)));
    return m;
}

/* v_c(s) - v_c(0), and x_c(s) - x_c(0): (gamma + 1) v_c + v_r does not contain the drive, so v_c gains what
   v_r loses, apart from terms linear in time. */
inlined real v_c_change(const segment *c, const table *t, real slope, const motion *m, real s)
{
    const real lost = over(mul(m->bend_slope, row(t->per_reach)), add(c->gamma, num(1.0)));
    return sub(mul(slope, s), lost);
}

inlined real advance_at(const segment *c, const table *t, real slope, const motion *m,
                        real v_c, real s)
{
    const real begun = mul(s, mad(mul(num(0.5), s), slope, v_c));
    return sub(mul(num(t->reach), begun), over(m->bend, add(c->gamma, num(1.0))));
}

/* Q(s) - Q(0) at rest. */
inlined real pull_change(const segment *c, const table *t, const expansion *e, const motion *m, real s)
{
    real cosine = row(t->reaction[0][TERMS - 1]), sine = row(t->reaction[1][TERMS - 1]);
    for (int n = TERMS - 2; n >= 0; n--) {
        cosine = mad(cosine, s, row(t->reaction[0][n]));
        sine = mad(sine, s, row(t->reaction[1][n]));
    }
    const real reaction = mul(s, mad(e->u[2], cosine, mul(e->u[3], sine)));
    return sub(force_change(c, m->x, mul(m->slope, row(t->per_reach))), reaction);
}
#else
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

/* v_c(s) - v_c(0), and x_c(s) - x_c(0), by the integrals of P, which is Q. */
inlined real v_c_change(const segment *c, const table *t, real slope, const motion *m, real s)
{
    const real grown = v_c_rate(c, force_change(c, m->sum, mul(m->lag, row(t->per_reach))));
    return mad(num(t->reach), grown, mul(slope, s));
}

inlined real advance_at(const segment *c, const table *t, real slope, const motion *m,
                        real v_c, real s)
{
    const real grown = v_c_rate(c, force_change(c, m->again, mul(m->lag_sum, row(t->per_reach))));
    const real begun = mul(s, mad(mul(num(0.5), s), slope, v_c));
    return mul(num(t->reach), mad(num(t->reach), grown, begun));
}

/* Q(s) - Q(0) at rest. */
inlined real pull_change(const segment *c, const table *t, const expansion *e, const motion *m, real s)
{
    (void)e, (void)s;
    return force_change(c, m->x, mul(m->slope, row(t->per_reach)));
}
#endif

/* Guards of a segment: the gap's side; the sign of v_c, or f_b -+ Q; and between two stops the gap
   behind. */
enum { GAP, FIRST, SECOND, BACK, GUARDS = BACK + TWO_STOPS };

/* True if a segment has a guard. */
#define watched(which, drift, t) (!((which) == SECOND && (drift)) && !((which) == BACK && (t)->contact))

/* A guard without its form. */
inlined guard guard_of(const segment *c, const expansion *e, const point *s, int which, int drift,
                       bound sign)
{
    const int gap = which == GAP || which == BACK;
#if TWO_STOPS
    const real at = which == BACK ? s->other : s->gap; /* of both one is 0 at most */
    const bound gap_zeros = pick(eq(near_to(at), all(0.0)), s->gap_zeros, all(0.0));
#else
    const real at = s->gap;
    const bound gap_zeros = s->gap_zeros;
#endif
    guard g;
    g.sign = sign;
    g.first = gap     ? mul(wide(sign), at)
              : drift ? mul(wide(sign), s->v_c)
                      : friction_guard(c, wide(sign), s->margin);
    g.zeros = gap     ? gap_zeros
              : drift ? s->second_zeros
                      : larger(-sign * s->second_zeros, all(0.0));
    g.rounding = gap ? e->x_rounding : e->second_rounding;
    g.tail = gap ? e->limit[X_TAIL] : e->limit[SECOND_TAIL];
    g.range = gap ? e->limit[X_RANGE] : e->limit[SECOND_RANGE];
    g.bend = gap ? e->limit[X_BEND] : e->limit[SECOND_BEND];
    return g;
}

/* Its form: that of another guard with its sign reversed, if there is one. */
inlined void form_of(const table *t, const expansion *e, int which, int level, int drift,
                     const guard *other, guard *g)
{
    const int gap = which == GAP || which == BACK;
    const entry(*rows)[DEGREE] = gap ? t->x_form[level] : t->second_form[level];
    const real by = wide(g->sign);
    real u[RESPONSES];
    for (int k = 0; k < RESPONSES; k++)
        u[k] = mul(by, e->u[k]);
    const real slope = mul(mul(by, e->slope), num(t->level[level]));
    for (int j = 0; j < DEGREE; j++) {
        g->form[j] = other ? neg(other->form[j])
                           : combined(u, rows, j);
        if (drift && !gap)
            g->form[j] = mad(slope, part(num(j + 1.0), DEGREE), g->form[j]);
    }
}

/* True if a guard is further from zero than the motion can bring it. */
inlined mask out_of_range(const guard *g, const expansion *e, int slipping)
{
    const bound range = g->range, rounding = g->rounding, tail = g->tail;
    const bound slope = slipping ? g->sign * near_to(e->slope) : all(0.0);
    return eq(g->zeros, all(0.0)) &
           gt(near_to(g->first) + smaller(slope, all(0.0)), (range + rounding) + tail);
}
