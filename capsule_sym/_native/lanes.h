/* One step of LANES runs that are in the same linear flow: what `locate` and `arrive` do, by the
   same expansions, bounds and certificates, where everything is plain. Lanes never mix, so that a
   run does not depend on its company. */
#include <math.h>

#include "crew.h"
#include "vector.h"

#define UNDERFLOW 1e-290
#define ROUNDS 12 /* of Newton's method; lanes that take more are left open */

/* Sine and cosine of angles in [0, 2 pi]: the nearest multiple of pi/2 is taken off in two parts,
   then Taylor's series on [-pi/4, pi/4]. */
inlined void sine_cosine(vec angle, vec *sine, vec *cosine)
{
    static const double S[] = {-1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0,
                               1.0 / 362880.0,         -1.0 / 5040.0,      1.0 / 120.0,
                               -1.0 / 6.0};
    static const double C[] = {-1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0,
                               1.0 / 40320.0,        -1.0 / 720.0,      1.0 / 24.0};
    const vec magic = all(0x1.8p52), shifted = mad(angle, all(0.6366197723675814), magic);
    const vec quarters = shifted - magic;
    /* The first part has few enough bits for an exact product. */
    const vec first = mad(quarters, all(-0x1.921fb544p0), angle);
    const vec r = mad(quarters, all(-0x1.0b4611a626331p-34), first), z = r * r;
    vec s = all(1.0 / 355687428096000.0), c = all(1.0 / 20922789888000.0);
    for (int i = 0; i < 7; i++)
        s = mad(s, z, all(S[i]));
    for (int i = 0; i < 6; i++)
        c = mad(c, z, all(C[i]));
    s = mad(r * z, s, r);
    c = all(1.0) - mad(-z * z, c, all(0.5) * z);
    const whole k = bits_in(shifted);
    const mask swapped = odd(k);
    *sine = turn_sign(choose(swapped, c, s), half_of(k));
    *cosine = turn_sign(choose(swapped, s, c), half_of(next_to(k)));
}

inlined vec dot(const double *t, const vec *size)
{
    return mad(all(t[0]), size[0], all(t[1]) * size[1]) +
           mad(all(t[2]), size[2], all(t[3]) * size[3]);
}

/* Coefficient i of rows of a table. */
inlined vec combined(const vec *u, const double *a, const double *b, const double *c,
                     const double *d)
{
    return mad(all(*a), u[0], mad(all(*b), u[1], mad(all(*c), u[2], all(*d) * u[3])));
}

typedef struct {
    mask clear, crossing;
    vec index; /* how many coefficients are positive: about DEGREE times the root */
} verdict;

/* Whether Bernstein coefficients 1 to DEGREE of a guard less its first value prove it positive on
   (0, 1], or to cross zero once; see search.c. `zeros` derivatives vanish at the start. */
inlined verdict judge(const vec *form, vec first, vec zeros, vec rounding, vec tail, int twice)
{
    const mask begun = above(zeros, all(0.0)), skipped = equal(zeros, all(2.0));
    const vec base = choose(begun, all(0.0), first), e0 = choose(begun, all(0.0), rounding);
    const vec e1 = choose(equal(zeros, all(1.0)), rounding, all(0.0));
    const vec e2 = choose(skipped, rounding, all(0.0));
    mask seen = no_lanes(), back = no_lanes();
    vec least = all(INFINITY), index = all(0.0);
    for (int j = 1; j <= DEGREE; j++) {
        const vec value = base + form[j - 1];
        vec error = mad(e1, all(j / (double)DEGREE), e0);
        if (twice)
            error = mad(e2, all(j * (j - 1) / (DEGREE * (DEGREE - 1.0))), error);
        if (j > 2)
            error = mad(tail, all(j * (j - 1) * (j - 2) / (DEGREE * (DEGREE - 1) * (DEGREE - 2.0))),
                        error);
        vec sure = size_of(value) - error;
        mask below = negative(value);
        if (twice && j == 1) { /* coefficient 1 of s^2 is 0 */
            sure = choose(skipped, all(1.0), sure);
            below = below & ~skipped;
        }
        least = smaller(least, sure);
        back = back | (seen & ~below);
        seen = seen | below;
        index = choose(below, index, index + all(1.0));
    }
    /* What vanishes at the start is positive at first only if its leading coefficient is. */
    const mask proved = (begun | above(first, rounding)) & above(least, all(0.0)) & ~back;
    return (verdict){proved & ~seen, proved & seen & (~begun | above(index, zeros - all(1.0))),
                     index};
}

/* The motion at s, from coefficients a of s, s^2, ... of x_r(s) - x_r(0). */
typedef struct {
    vec x, slope, bend; /* x_r(s) - x_r(0), and its derivatives in s; slope without slope(0) */
    vec lag;            /* x without its linear term: x - slope(0) s */
    vec sum, lag_sum;   /* integrals of x and of the lag over (0, s) */
    vec again;          /* integral of `sum` */
} motion;

inlined motion motion_at(const vec *a, const vec *b, vec s, int drift, int position)
{
    vec y = a[TERMS - 1], y1 = all(0.0), y2 = all(0.0), z = b[TERMS - 1];
    vec w = z * all(1.0 / (TERMS + 2));
#pragma GCC unroll 32
    for (int n = TERMS - 1; n >= 2; n--) { /* coefficient n is a[n - 1] */
        if (!drift)
            y2 = mad(y2, s, y1);
        y1 = mad(y1, s, y);
        y = mad(y, s, a[n - 1]);
        if (drift)
            z = mad(z, s, b[n - 1]);
        if (position)
            w = mad(w, s, b[n - 1] * all(1.0 / (n + 2)));
    }
    motion m;
    const vec s2 = s * s;
    m.lag = s2 * y;
    m.x = mad(s, a[0], m.lag);
    m.slope = s * mad(s, y1, y + y);
    m.bend = mad(all(2.0) * s2, y2, mad(all(4.0) * s, y1, y + y));
    m.sum = s2 * mad(s, z, all(0.5) * a[0]);
    m.lag_sum = s2 * s * z;
    m.again = s2 * s * mad(s, w, all(1.0 / 6.0) * a[0]);
    return m;
}

/* What the lanes of a step share, and where each begins. */
typedef struct {
    const capsule_constants *c; /* of the flow; alpha, delta, push and friction are the lanes' own */
    double reach, share, damper; /* P's change in x, in x's slope; in drift v_c's in their integrals */
    vec v_c, slope, advance;     /* v_c and its slope in s at the start */
    vec a[TERMS], b[TERMS];      /* coefficients of s, s^2, ... of x_r(s) - x_r(0); over n + 1 */
} lanes;

inlined vec v_c_change(const lanes *k, const motion *m, vec s)
{
    const double by = k->reach / k->c->gamma;
    return mad(k->slope, s, mad(all(k->share * by), m->sum, all(k->damper * by) * m->lag));
}

inlined vec advance_at(const lanes *k, const motion *m, vec s)
{
    const double by = k->reach / k->c->gamma;
    const vec changed = mad(all(k->share * by), m->again, all(k->damper * by) * m->lag_sum);
    return all(k->reach) * mad(s, mad(all(0.5) * s, k->slope, k->v_c), changed);
}

inlined vec force_change(const lanes *k, const motion *m)
{
    return mad(all(k->share), m->x, all(k->damper) * m->slope);
}

inlined void step(const capsule_constants *c, const capsule_table *t, int drift, int position,
                  int ends, double *const *runs, capsule_outcomes *out)
{
    const double side = c->contact != 0.0 ? 1.0 : -1.0, omega = c->omega, reach = t->reach;
    const vec zero = all(0.0), one = all(1.0), unit = all(UNIT), kappa = all(c->kappa);
    const double *from[LANES];
    vec at[8], known[8], own[8];
    lanes k;
    k.c = c;
    k.reach = reach;
    k.share = 1.0 + c->kappa;
    k.damper = 2.0 * c->zeta / reach;
    for (int part = 0; part < 3; part++) {
        for (int l = 0; l < LANES; l++)
            from[l] = runs[l] + 8 * part;
        load_rows(from, part == 0 ? at : part == 1 ? known : own);
    }
    const vec x_0 = at[X_R], gap_0 = at[FAR], v_0 = at[V_R], v_c_0 = at[V_C];
    const vec margin_0 = at[MARGIN], way_0 = known[WAY - 8];
    const vec gap_zeros = known[GAP_ZEROS - 8], second_zeros = known[SECOND_ZEROS - 8];
    const vec energy = known[ENERGY_ERROR - 8], v_c_error = known[V_C_ERROR - 8];
    const vec angle_error = known[ANGLE_ERROR - 8];
    const vec alpha = own[ALPHA - 16], delta = own[DELTA - 16], f_b = own[BOUND - 16];
    const vec friction = way_0 * f_b, push = friction * all(1.0 / c->gamma);

    /* As in `expand`. */
    const vec far = kappa * size_of(gap_0), fast = all(2.0 * c->zeta) * size_of(v_0);
    const vec u[4] = {push - all(c->m) * mad(kappa, gap_0, x_0), v_0, alpha * at[COSINE],
                      all(-omega) * alpha * at[SINE]};
    const vec size[4] = {mad(all(c->m), size_of(x_0) + far, size_of(push)), size_of(v_0), alpha,
                         all(omega) * alpha};
    const vec margin_error =
        all(6.0 * UNIT) * ((size_of(x_0) + far) + (fast + size_of(friction)) + f_b);
    const vec x_own =
        dot(t->x_error, size) + mad(all(2.0 * UNIT), size_of(gap_0), all(UNDERFLOW));
    vec second_own = dot(t->second_error, size) + all(UNDERFLOW), second_rounding;
    k.v_c = v_c_0;
    k.slope = margin_0 * all(reach / c->gamma);
    if (drift) {
        second_own += choose(above(all(2.0), second_zeros), margin_error * all(reach / c->gamma),
                             zero);
        second_rounding = second_own + v_c_error +
                          mad(energy, all(2.0 / (c->gamma + 1.0)), unit * size_of(v_c_0));
    } else {
        second_own += choose(equal(second_zeros, zero), margin_error, zero);
        second_rounding = mad(energy, all(k.share / t->root_K + 2.0 * c->zeta), second_own);
    }
    const vec x_rounding = mad(energy, all(1.0 / t->root_K), x_own);
    const vec x_tail = dot(t->x_tail, size), second_tail = dot(t->second_tail, size);

    /* As in `examine`. */
    vec form[DEGREE];
    vec w[4] = {all(side) * u[0], all(side) * u[1], all(side) * u[2], all(side) * u[3]};
    for (int j = 0; j < DEGREE; j++)
        form[j] = combined(w, &t->x_form[0][j], &t->x_form[1][j], &t->x_form[2][j],
                           &t->x_form[3][j]);
    const verdict at_gap = judge(form, all(side) * gap_0, gap_zeros, x_rounding, x_tail, 0);
    if (drift)
        for (int i = 0; i < 4; i++)
            w[i] = way_0 * u[i];
    for (int j = 0; j < DEGREE; j++)
        form[j] = combined(drift ? w : u, &t->second_form[0][j], &t->second_form[1][j],
                           &t->second_form[2][j], &t->second_form[3][j]);
    verdict first, second;
    if (drift) {
        const vec slope = way_0 * k.slope;
        for (int j = 0; j < DEGREE; j++)
            form[j] = mad(slope, all((j + 1) / (double)DEGREE), form[j]);
        first = judge(form, way_0 * v_c_0, second_zeros, second_rounding, second_tail, 1);
        second = (verdict){~no_lanes(), no_lanes(), zero};
    } else {
        second = judge(form, f_b + margin_0, -second_zeros, second_rounding, second_tail, 0);
        for (int j = 0; j < DEGREE; j++)
            form[j] = -form[j];
        first = judge(form, f_b - margin_0, second_zeros, second_rounding, second_tail, 0);
    }
    const mask by_friction = first.crossing | second.crossing;
    const mask crossing = at_gap.crossing | by_friction, both = at_gap.crossing & by_friction;
    mask open = ~(at_gap.clear | at_gap.crossing) | ~(first.clear | first.crossing) |
                ~(second.clear | second.crossing) | (first.crossing & second.crossing);
    const vec index = choose(first.crossing, first.index, second.index);
    const mask is_gap = at_gap.crossing & (~by_friction | at_least(index, at_gap.index));
    const vec sign = drift ? way_0 : choose(second.crossing, one, -one);
    const vec zeros =
        choose(is_gap, gap_zeros, drift ? second_zeros : larger(-sign * second_zeros, zero));

    /* As in `polish`; but where no lane switches, nor is asked for more, sums do. */
    mask active = crossing & ~open;
    const int expanded = bits_of(active) || position || ends;
    for (int n = 0; n < (expanded ? TERMS : 1); n++)
        k.a[n] = combined(u, &t->x[0][n], &t->x[1][n], &t->x[2][n], &t->x[3][n]);
    if (drift && expanded)
        for (int n = 0; n < TERMS; n++)
            k.b[n] = k.a[n] * all(1.0 / (n + 2));
    const vec value_0 = drift ? mad(sign, v_c_0, zero) : mad(sign, margin_0, f_b);
    const vec x_bend = dot(t->x_bend, size), second_bend = dot(t->second_bend, size);
    const vec bend = choose(is_gap, x_bend, second_bend);
    const vec guess = known[LASTED - 8] * all(1.0 / reach);
    vec s = choose(above(guess, zero) & above(one, guess), guess,
                   (choose(is_gap, at_gap.index, index) + all(0.5)) * all(1.0 / DEGREE));
    s = choose(crossing, s, one);
    vec low = zero, high = one, last = zero, fall = one;
    vec gap = zero, gap_slope = zero, second_value = zero, second_slope = zero;
    vec v_c_changed = zero;
    motion m = {zero, zero, zero, zero, zero, zero, zero};
    for (int round = 0; expanded; round++) {
        m = motion_at(k.a, k.b, s, drift, position);
        gap = all(side) * (gap_0 + m.x);
        gap_slope = all(side) * (k.a[0] + m.slope);
        if (drift) {
            v_c_changed = v_c_change(&k, &m, s);
            second_value = mad(sign, v_c_changed, value_0);
            second_slope = sign * all(reach / c->gamma) * (margin_0 + force_change(&k, &m));
        } else {
            second_value = mad(sign, force_change(&k, &m), value_0);
            second_slope = sign * mad(all(k.share), k.a[0] + m.slope, all(k.damper) * m.bend);
        }
        if (!bits_of(active))
            break;
        const vec value = choose(is_gap, gap, second_value);
        /* Newton's step for the guard over s^zeros, and minus s times the guard's own slope. */
        const vec falling = mad(zeros, value, -s * choose(is_gap, gap_slope, second_slope));
        const vec by = s * value / falling;
        const mask positive = above(value, zero);
        low = choose(active & positive, s, low);
        high = choose(active & ~positive, s, high);
        const mask near = active & (at_least(all(0x1p-26) * s, size_of(by)) |
                                    at_least(unit * size_of(falling), by * by * bend));
        last = choose(near, by, last);
        fall = choose(active, falling, fall);
        active = active & ~near;
        if (round == ROUNDS) {
            open = open | active;
            break;
        }
        const vec next = s + by;
        s = choose(active,
                   choose(above(next, low) & above(high, next), next, all(0.5) * (low + high)), s);
        if (!bits_of(active))
            break;
    }
    /* The end of the whole expansion, alike whatever the other lanes do. */
    m.x = choose(crossing, m.x, dot(t->x_whole, u));
    m.slope = choose(crossing, m.slope, mad(dot(t->v_whole, u), all(reach), -k.a[0]));
    v_c_changed = choose(crossing, v_c_changed, k.slope + dot(t->second_whole, u));
    const vec steepness = fall / s;
    const vec reached = smaller(one, s + s), r2 = reached * reached;
    const vec rounding = choose(is_gap, x_rounding, second_rounding) *
                         choose(above(zeros, zero), choose(above(zeros, one), r2, reached), one);
    const vec apart =
        mad(choose(is_gap, x_tail, second_tail), r2 * reached, all(1.5) * rounding);
    const vec straight = smaller(all(0.5) * steepness / bend, s);
    const vec error = mad(all(4.0 * UNIT), s, (rounding + rounding) / steepness);
    open = open | (crossing & ~(above(steepness, zero) &
                                above(all(0.5) * steepness * straight, apart + apart)));
    /* A guard that crosses once, and is still positive at the other's root, crosses later. */
    const vec other_error =
        choose(is_gap, second_rounding + second_tail, x_rounding + x_tail) +
        (error + size_of(last)) * (size_of(choose(is_gap, second_slope, gap_slope)) +
                                   choose(is_gap, second_bend, x_bend));
    open = open | (both & ~above(choose(is_gap, second_value, gap), other_error));

    /* As in `evaluate` and `arrive`. */
    const vec h = (s + last) * all(reach);
    vec angle = mad(all(omega), h, at[ANGLE]);
    const mask passed = at_least(angle, all(TWO_PI)) & ~open;
    angle = choose(passed, larger((angle - all(TWO_PI)) - all(TWO_PI_REST), zero), angle);
    vec sine, cosine;
    sine_cosine(angle, &sine, &cosine);
    const vec v = (k.a[0] + m.slope) * all(1.0 / reach), on = last * all(reach);
    const vec pulled = push - all(c->m) * mad(kappa, gap_0 + m.x, x_0 + m.x);
    const vec rate = mad(alpha, cosine, pulled - all(2.0 * c->sigma) * v);
    const vec moved = m.x + on * mad(all(0.5) * on, rate, v), v_r = mad(on, rate, v);
    const mask at_delta = is_gap & crossing, at_friction = crossing & ~is_gap;
    const vec x_r = choose(at_delta, delta, x_0 + moved);
    const vec far_off = choose(at_delta, zero, gap_0 + moved);
    vec v_c = zero, advance = zero;
    if (drift) {
        const vec change =
            mad(on * all(1.0 / c->gamma), margin_0 + force_change(&k, &m), v_c_changed);
        v_c = choose(at_friction, zero, v_c_0 + change);
        if (position)
            advance = mad(on, v_c_0 + change, advance_at(&k, &m, s));
    }

    /* As in `depart`: what follows a switch. */
    const vec force = mad(all(2.0 * c->zeta), v_r, mad(kappa, far_off, x_r));
    const vec terms =
        mad(all(2.0 * c->zeta), size_of(v_r), mad(kappa, size_of(far_off), size_of(x_r)));
    const mask rests = equal(v_c, zero), slips = above(size_of(force), f_b);
    const mask near = rests & at_least(all(16.0 * UNIT) * (terms + f_b),
                                       size_of(size_of(force) - f_b));
    vec way = choose(rests, choose(slips, choose(above(force, zero), one, -one), zero), way_0);
    vec bound = zero;
    mask unplain = near;
    if (!drift) {
        bound = choose(at_friction, -sign, zero);
        const vec rising = mad(all(k.share), v_r,
                               all(2.0 * c->zeta) * (alpha * cosine - bound * f_b));
        const vec unsure = all(64.0 * UNIT) * mad(all(k.share), size_of(v_r),
                                                  all(2.0 * c->zeta) * (alpha + terms + f_b));
        way = choose(at_friction, bound, way);
        unplain = (at_friction & ~above(rising * bound, unsure)) | (near & ~at_friction);
    }
    unplain = crossing & ~open & (unplain | (at_delta & equal(v_r, zero)));
    way = choose(crossing, way, way_0);
    const mask at_bound = ~equal(bound, zero) & crossing;

    out->open = bits_of(open);
    out->unplain = bits_of(unplain);
    out->crossing = bits_of(crossing);
    out->passed = bits_of(passed);
    out->contact = bits_of(c->contact != 0.0 ? ~at_delta : at_delta);
    if (ends && out->passed) {
        const vec b = ((all(TWO_PI) - at[ANGLE]) + all(TWO_PI_REST)) * all(1.0 / (omega * reach));
        const motion e = motion_at(k.a, k.b, b, drift, position);
        double *to[LANES];
        vec end[8] = {x_0 + e.x, gap_0 + e.x, (k.a[0] + e.slope) * all(1.0 / reach), zero,
                      known[POSITION - 8], zero, zero, zero};
        if (drift)
            end[3] = v_c_0 + v_c_change(&k, &e, b);
        if (drift && position)
            end[4] += advance_at(&k, &e, b);
        for (int l = 0; l < LANES; l++)
            to[l] = out->end[l];
        store_rows(to, end, -1);
    }

    /* As in `carry`, where the segment goes on. */
    const vec impulse = (size_of(v_r) + size_of(v_0)) +
                        mad(size_of(friction) + alpha, all(reach), alpha * all(1.0 / omega));
    const vec next_angle = angle_error + all(4.0 * UNIT * TWO_PI);
    const vec next_energy = energy + mad(next_angle * alpha, all(reach),
                                         mad(all(2.0 * UNIT), size_of(v_r), dot(t->v_error, size))) +
                            all(t->root_K) * mad(all(2.0 * UNIT), size_of(x_r), x_own);
    const vec next_v_c = v_c_error + second_own + unit * size_of(v_c) +
                         mad(all(8.0 * UNIT), impulse, next_energy + next_energy) *
                             all(1.0 / (c->gamma + 1.0));
    double *to[LANES];
    vec moment[8], next[8];
    moment[X_R] = x_r;
    moment[FAR] = far_off;
    moment[V_R] = v_r;
    moment[V_C] = v_c;
    moment[MARGIN] = choose(at_bound, zero, force - way * f_b);
    moment[ANGLE] = angle;
    moment[COSINE] = cosine;
    moment[SINE] = sine;
    next[WAY - 8] = way;
    next[GAP_ZEROS - 8] = choose(at_delta, one, zero);
    next[SECOND_ZEROS - 8] =
        choose(crossing & rests & ~equal(way, zero), choose(at_bound, all(2.0), one), zero);
    next[ENERGY_ERROR - 8] = choose(crossing, zero, next_energy);
    next[V_C_ERROR - 8] = choose(crossing, zero, next_v_c);
    next[ANGLE_ERROR - 8] = choose(crossing, zero, next_angle);
    next[POSITION - 8] = known[POSITION - 8] + advance;
    next[LASTED - 8] = h;
    const int done = ~(out->open | out->unplain);
    store_rows(runs, moment, done);
    for (int l = 0; l < LANES; l++)
        to[l] = runs[l] + 8;
    store_rows(to, next, done);
}

void STEP(const capsule_constants *c, const capsule_table *t, int position, int ends,
          double *const *runs, capsule_outcomes *out)
{
    if (c->drift == 0.0)
        step(c, t, 0, 0, ends, runs, out);
    else if (position)
        step(c, t, 1, 1, ends, runs, out);
    else
        step(c, t, 1, 0, ends, runs, out);
}
