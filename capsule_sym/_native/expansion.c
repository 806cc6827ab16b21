/* Expansions of a motion: certain bounds for its guards, and all digits for its states.

   x_r(s) - x_r(0) is a combination of four tabulated responses; P and v_c follow term by term.
   The same coefficients serve to bound (in a low degree) and to evaluate (in one whose error is below rounding), and small durations lose no digits, because the
   value at the start is never part of the sum.

   Errors of the instant an expansion stands at obey the segment's free motion, whose energy never
   grows: |dx_r| <= e/sqrt(K), |dv_r| <= e, |dP| <= ((1 + kappa)/sqrt(K) + 2 zeta) e, and by momentum
   (gamma + 1) |dv_c - dv_c(0)| <= 2 e. */
#include <math.h>

#include "expansion.h"

#define GUARD_TERMS (POLYNOMIAL + 4)
#define UNDERFLOW 1e-290 /* more than all that is lost below the normal range */

static inline double dot(const double *a, const double *b)
{
    return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]);
}

static double margin_error(const capsule_constants *c, const stand *from)
{
    const departure *d = &from->at;
    return 6.0 * UNIT * (margin_at_size(c, fabs(d->x_r), fabs(d->gap), fabs(d->v_r)) + c->f_b);
}

void expand(const capsule_constants *c, const capsule_table *t, const stand *from, expansion *e)
{
    const departure *d = &from->at;
    e->u[0] = rest_force(c, d->x_r, d->gap);
    e->u[1] = d->v_r;
    forcing_terms(c, d->cosine, d->sine, &e->u[2], &e->u[3]);
    e->size[0] = rest_force_size(c, fabs(d->x_r), fabs(d->gap));
    e->size[1] = fabs(d->v_r);
    forcing_terms_size(c, &e->size[2], &e->size[3]);
    e->slope = 0.0;
    e->x_rounding = dot(t->x_error, e->size) + 2.0 * UNIT * fabs(d->gap) + UNDERFLOW;
    e->second_rounding = dot(t->second_error, e->size) + UNDERFLOW;
    if (c->drift != 0.0) {
        e->slope = v_c_rate(c, d->margin) * t->reach;
        if (d->zeros[DRIFT] < 2)
            e->second_rounding += v_c_rate(c, margin_error(c, from)) * t->reach;
    } else if (!(d->zeros[UPPER] || d->zeros[LOWER])) {
        e->second_rounding += margin_error(c, from);
    }
    e->x_own = e->x_rounding;
    e->second_own = e->second_rounding;
    if (!from->later)
        return;
    e->x_rounding += from->energy_error / t->root_K;
    if (c->drift != 0.0)
        e->second_rounding += from->v_c_error + 2.0 * from->energy_error / (c->gamma + 1.0) +
                              UNIT * fabs(d->v_c);
    else
        e->second_rounding += force_per_energy(c, t->root_K) * from->energy_error;
}

void coefficients(const capsule_table *t, const expansion *e, double x[POLYNOMIAL])
{
    for (int n = 0; n < TERMS; n++)
        x[n] = (e->u[0] * t->x[0][n] + e->u[1] * t->x[1][n]) +
               (e->u[2] * t->x[2][n] + e->u[3] * t->x[3][n]);
    for (int n = TERMS; n < POLYNOMIAL; n++)
        x[n] = 0.0;
}

/* A guard's first value and the factor that its polynomial comes with. */
static double first_of(const capsule_constants *c, const departure *d, guard_name guard,
                       double *factor)
{
    switch (guard) {
    case GAP:
        *factor = c->contact != 0.0 ? 1.0 : -1.0;
        return *factor * d->gap;
    case DRIFT:
        *factor = c->drift;
        return *factor * d->v_c;
    case UPPER:
        *factor = -1.0;
        return c->f_b - d->margin;
    default:
        *factor = 1.0;
        return c->f_b + d->margin;
    }
}

finding examine(const capsule_constants *c, const capsule_table *t, const stand *from,
                const expansion *e, guard_name guard, double thin)
{
    const int zeros = from->at.zeros[guard];
    const double rounding = guard == GAP ? e->x_rounding : e->second_rounding;
    const double tail = dot(guard == GAP ? t->x_tail : t->second_tail, e->size);
    double form[DEGREE], factor;
    const double first = first_of(c, &from->at, guard, &factor);
    const double slope = guard == DRIFT ? factor * e->slope : 0.0;
    if (!zeros) { /* is the guard further from zero than it could go? */
        const double range = dot(guard == GAP ? t->x_range : t->second_range, e->size);
        if (first + lesser(slope, 0.0) > (range + rounding) + tail)
            return (finding){CLEAR, 1.0, 1.0, 1.0};
    }
    const double u[4] = {factor * e->u[0], factor * e->u[1], factor * e->u[2], factor * e->u[3]};
    const double(*rows)[DEGREE] = guard == GAP ? t->x_form : t->second_form;
    for (int j = 0; j < DEGREE; j++)
        form[j] = (u[0] * rows[0][j] + u[1] * rows[1][j]) + (u[2] * rows[2][j] + u[3] * rows[3][j]);
    if (guard == DRIFT)
        for (int j = 0; j < DEGREE; j++)
            form[j] += slope * ((j + 1) / (double)DEGREE);
    return search(form, first, zeros, rounding, tail, thin);
}

/* Value and derivative of sum a[n] s^n, n < POLYNOMIAL; four interleaved Horner schemes. */
static inline void polynomial(const double *a, double s, double *value, double *slope)
{
    const double s2 = s * s, s4 = s2 * s2;
    double p[4], d[4] = {0.0, 0.0, 0.0, 0.0};
    for (int l = 0; l < 4; l++)
        p[l] = a[POLYNOMIAL - 4 + l];
    for (int n = POLYNOMIAL - 8; n >= 0; n -= 4)
        for (int l = 0; l < 4; l++) {
            d[l] = d[l] * s4 + p[l];
            p[l] = p[l] * s4 + a[n + l];
        }
    *value = (p[0] + s * p[1]) + s2 * (p[2] + s * p[3]);
    *slope = (p[1] + s * (2.0 * p[2] + 3.0 * s * p[3])) +
             4.0 * s * s2 * ((d[0] + s * d[1]) + s2 * (d[2] + s * d[3]));
}

/* Coefficients of P or v_c, from number 1; number 1 of v_c without the margin's part. */
static inline void second_terms(const capsule_constants *c, const capsule_table *t,
                                const double x[POLYNOMIAL], double factor, double *out)
{
    if (c->drift != 0.0) {
        out[0] = 0.0;
        for (int n = 1; n <= TERMS; n++)
            out[n] = factor * (t->from_position[n] * x[n - 1] + t->from_rate[n] * x[n]);
        return;
    }
    for (int n = 0; n < TERMS; n++)
        out[n] = factor * (t->from_position[n] * x[n] + t->from_rate[n] * x[n + 1]);
}

root polish(const capsule_constants *c, const capsule_table *t, const stand *from,
            const expansion *e, const double x[POLYNOMIAL], guard_name guard, finding where,
            double guess)
{
    const int zeros = from->at.zeros[guard];
    double terms[GUARD_TERMS] = {0}, factor;
    terms[0] = first_of(c, &from->at, guard, &factor);
    if (guard == GAP)
        for (int n = 0; n < TERMS; n++)
            terms[n + 1] = factor * x[n];
    else
        second_terms(c, t, x, factor, terms + 1);
    if (guard == DRIFT)
        terms[1] = factor * e->slope;
    double low = where.from, high = where.to, value, slope;
    const double bend = dot(guard == GAP ? t->x_bend : t->second_bend, e->size);
    double s = guess > low && guess < high ? guess : 0.5 * (low + high);
    root r = {0, s, INFINITY};
    for (int n = 0; n < 200; n++) {
        polynomial(terms + zeros, s, &value, &slope);
        if (value > 0.0)
            low = s;
        else
            high = s;
        double step = -value / slope;
        if (fabs(step) <= 0x1p-26 * s) {
            r.s = s + step;
            break;
        }
        if (!(s + step > low && s + step < high))
            step = 0.5 * (low + high) - s;
        s += step;
        if (high - low <= 4.0 * UNIT * high) {
            r.s = s;
            break;
        }
    }
    /* Simple: |g'| keeps half its size as far as `far` either way, for |g''| <= bend; and there
       the bounds that were counted, at most twice `gap` apart, have their one crossing each. */
    const double *tails = guard == GAP ? t->x_tail : t->second_tail;
    double power = 1.0, reach = lesser(1.0, 2.0 * s), tail = dot(tails, e->size), gap;
    double steepness = -slope;
    for (int n = 0; n < zeros; n++) {
        steepness *= s;
        power *= reach;
    }
    const double rounding = (guard == GAP ? e->x_rounding : e->second_rounding) * power;
    const double r2 = reach * reach;
    gap = 1.5 * rounding + tail * r2 * reach;
    const double far = lesser(0.5 * steepness / bend, s);
    r.certain = steepness > 0.0 && 0.5 * steepness * far > 2.0 * gap;
    r.error = 2.0 * rounding / steepness + 4.0 * UNIT * s;
    return r;
}

void evaluate(const capsule_constants *c, const capsule_table *t, const stand *from,
              const expansion *e, const double x[POLYNOMIAL], double s, int stops, int advance,
              point *out)
{
    const departure *d = &from->at;
    const double h = s * t->reach;
    double value, slope;
    /* What rounding takes from a sum of angles goes into the next one: of hundreds of expansions of
       the same length the roundings would all be alike. */
    const double turned = c->omega * h + d->angle_rest;
    out->angle = d->angle + turned;
    const double added = out->angle - d->angle;
    out->angle_rest = (d->angle - (out->angle - added)) + (turned - added);
    out->passed = 0;
    if (out->angle >= TWO_PI) { /* an expansion is shorter than two units of angle */
        const double over = out->angle - TWO_PI, rest = out->angle_rest - TWO_PI_REST;
        out->angle = greater(over + rest, 0.0);
        out->angle_rest = rest - (out->angle - over);
        out->passed = 1;
    }
    cosine_sine(out->angle, out->angle_rest, &out->cosine, &out->sine);
    double position, v_r;
    if (x) {
        polynomial(x, s, &value, &slope);
        position = s * value;
        v_r = (value + s * slope) / t->reach;
    } else {
        position = dot(t->x_whole, e->u);
        v_r = dot(t->v_whole, e->u);
    }
    out->x_r = d->x_r + position;
    out->gap = d->gap + position;
    out->v_r = v_r;
    out->v_c = 0.0;
    out->advance = 0.0;
    out->margin = margin_at(c, out->x_r, out->gap, v_r);
    if (c->drift == 0.0)
        return;
    const int is_short = x && c->rate * h < 1.0;
    double terms[POLYNOMIAL] = {0};
    if (stops && !advance)
        return;
    if (is_short) {
        second_terms(c, t, x, 1.0, terms);
        polynomial(terms, s, &value, &slope);
        out->v_c = d->v_c + (v_c_rate(c, d->margin) * h + s * value);
    } else {
        /* As a product: the difference of the sines would cancel where the forcing is slow. */
        const double half = 0.5 * c->omega * h, swept = 2.0 * cos(d->angle + half) * sin(half);
        const double pushed = c->alpha / c->omega * swept - c->friction * h;
        out->v_c = d->v_c + (pushed - (v_r - d->v_r)) / (c->gamma + 1.0);
    }
    if (!advance)
        return;
    if (is_short) {
        for (int n = 0; n <= TERMS; n++)
            terms[n] /= n + 2;
        polynomial(terms, s, &value, &slope);
        out->advance = h * (d->v_c + 0.5 * v_c_rate(c, d->margin) * h + s * value);
    } else {
        const double swing = (d->cosine - out->cosine) / c->omega - h * d->sine;
        out->advance = h * d->v_c + (c->alpha / c->omega * swing - 0.5 * c->friction * h * h +
                                     h * d->v_r - position) /
                                        (c->gamma + 1.0);
    }
}

void carry(const capsule_constants *c, const capsule_table *t, const stand *from,
           const expansion *e, const point *at, stand *to)
{
    const double energy = from->energy_error;
    const double x_error = e->x_own + 2.0 * UNIT * fabs(at->x_r);
    const double v_error = dot(t->v_error, e->size) + 2.0 * UNIT * fabs(at->v_r);
    const double impulse = fabs(at->v_r) + fabs(from->at.v_r) +
                           (fabs(c->friction) + c->alpha) * t->reach + c->alpha / c->omega;
    /* A forcing out of phase works on the motion for as long as the next expansion reaches. */
    to->angle_error = from->angle_error + 4.0 * UNIT * TWO_PI;
    to->energy_error = energy + v_error + t->root_K * x_error +
                       to->angle_error * c->alpha * t->reach;
    to->v_c_error =
        from->v_c_error + e->second_own +
        (2.0 * to->energy_error + 8.0 * UNIT * impulse) / (c->gamma + 1.0) + UNIT * fabs(at->v_c);
    to->at = (departure){from->at.field, at->x_r,        at->gap,    at->v_r,  at->v_c, at->margin,
                         at->angle,      at->angle_rest, at->cosine, at->sine, {0}};
    to->later = 1;
}
