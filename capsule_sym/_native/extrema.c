/* All extrema of a quantity inside a segment, each proved: where its rate changes sign, and that it
   keeps its sign elsewhere. The rate is expanded as the guards of the reference map are, with the
   same bounds on remainder and rounding; its sign is told by Bernstein coefficients. What double
   precision leaves open, or takes many stretches, is left to the caller. */
#include <math.h>

#include "number.h"

#define ORDER 8         /* derivatives of the rate, itself the first */
#define SIZE (ORDER + 2) /* of the polynomials that bound it */
#define REACH_OF_RATE 3.0
#define MOST_STRETCHES 512
#define SHORTEST 0x1p-40 /* of a segment */
#define FORM_UNITS 8.0   /* of the closed form, measured: below 4 */
#define FAINT 32.0       /* errors of a rate, below which its sign is not taken for granted */

/* A segment and the quantity that is looked at. */
typedef struct {
    const capsule_constants *c;
    segment_sizes sizes;
    const capsule_start *start;
    capsule_quantity quantity;
    double force, largest_x, largest_v, gap_error; /* of the closed form's error bounds */
} course;

/* The rate at a time: derivatives over factorials, bounds on their errors, and on the remainder. */
typedef struct {
    double value, rate[ORDER], error[ORDER], rest, growth; /* value: of the quantity itself */
} expansion;

static course course_of(const capsule_constants *c, const capsule_start *start,
                        capsule_quantity quantity)
{
    course f = {.c = c, .start = start, .quantity = quantity};
    const double x = fabs(start->x_r), gap = fabs(start->gap);
    segment_sizes room;
    f.sizes = *sizes_of(c, &room);
    f.force = rest_force_size(&f.sizes, x, gap);
    f.largest_x = f.largest_v = INFINITY;
    if (c->Z2 > 0.0) {
        const double detuning = fabs(c->K - c->omega * c->omega), both = c->omega + sqrt(c->K);
        f.largest_x = (2.0 * c->sigma * both + 2.0 * detuning) / c->Z2;
        f.largest_v = (4.0 * c->sigma * c->omega * c->omega + detuning * both) / c->Z2;
    }
    f.gap_error = 2.0 * gap > c->delta ? UNIT * gap : 0.0;
    return f;
}

/* Bounds on the errors of x_r and v_r after h, from the largest terms of the closed form. */
static void errors_at(const course *f, double h, double x_r, double *of_x, double *of_v)
{
    const capsule_constants *c = f->c;
    const double v = fabs(f->start->v_r), root_K = sqrt(c->K), g = fmin(h, 1.0 / c->fast);
    const double forced_x = fmin(fmin(h * h / 2.0, h / root_K), f->largest_x);
    const double forced_v = fmin(h, f->largest_v);
    const double x_terms = v * g + f->force * fmin(h * h / 2.0, 2.0 / c->K) + c->alpha * forced_x;
    const double v_terms = v + f->force * g + c->alpha * forced_v;
    const double phase = c->q >= 0.0 ? c->fast * h / (1.0 + c->sigma * h) : 1.0;
    const double units = FORM_UNITS * UNIT * (1.0 + phase + c->omega * h);
    const double carried = 2.0 * (1.0 + c->zeta) * f->gap_error;
    const double late = 2.0 * UNIT * TWO_PI * c->alpha;
    *of_x = units * x_terms + UNIT * fabs(x_r) + carried + late * forced_x + UNDERFLOW;
    *of_v = units * v_terms + root_K * carried + late * forced_v + UNDERFLOW;
}

static expansion expand(const course *f, double h)
{
    const capsule_constants *c = f->c;
    const segment_sizes *b = &f->sizes;
    const capsule_start *s = f->start;
    const double turned = c->omega * h, co = cos(turned), si = sin(turned);
    const double cosine = s->cos_theta * co - s->sin_theta * si;
    const double sine = s->sin_theta * co + s->cos_theta * si;
    const double late = 2.0 * UNIT * (TWO_PI + turned) + 8.0 * UNIT;
    double x_error = f->gap_error + UNDERFLOW, v_error = UNDERFLOW, change[3] = {0.0, 0.0, 0.0};
    double x[ORDER + 3], size[ORDER + 3], margin = s->margin;
    double x_r = s->x_r, gap = s->gap, v_r = s->v_r;
    if (h > 0.0) {
        capsule_flow(c, s, h, change);
        x_r += change[0], gap += change[0], v_r = change[1];
        margin = margin_at(c, x_r, gap, v_r);
        errors_at(f, h, x_r, &x_error, &v_error);
    }
    x[0] = x_r, x[1] = v_r;
    /* An error of the point counts as if it were so many roundings of its value. */
    size[0] = fabs(x_r) + x_error / UNIT, size[1] = fabs(v_r) + v_error / UNIT;
    x[2] = v_rate(c, x_r, gap, v_r, cosine);
    size[2] = v_rate_size(b, size[0], fabs(gap) + x_error / UNIT, size[1]);
    double drive = c->alpha;
    for (int n = 3; n < ORDER + 3; n++) {
        const double wave = n % 2 ? sine : cosine;
        drive *= c->omega;
        x[n] = -(c->K * x[n - 2]) - 2.0 * c->sigma * x[n - 1] + ((n - 1) / 2 % 2 ? -drive : drive) * wave;
        size[n] = c->K * size[n - 2] + 2.0 * c->sigma * size[n - 1] + drive;
    }
    const double per_energy = (1.0 + 8.0 * UNIT) * force_per_energy(c, sqrt(c->K));
    const int speed = f->quantity == CAPSULE_SPEED, gaps = f->quantity == CAPSULE_GAP;
    /* The remainder is the derivative of x_r's, or of the force's, whose order this is. */
    const int last = speed || gaps ? ORDER : ORDER + 1;
    const double slack = (8.0 * (ORDER + 3) + 8.0) * UNIT + late;
    const double high = fabs(x[last + 1]) + slack * size[last + 1];
    const double low = fabs(x[last]) + slack * size[last];
    double factor = (1.0 + 8.0 * UNIT) * hypot(high, sqrt(c->K) * low), inverse = 1.0;
    double forcing = c->alpha * pow(c->omega, last) * (1.0 + 32.0 * UNIT);
    expansion e = {.value = gaps ? gap : speed ? s->v_c + change[2] : margin + c->friction};
    if (!gaps)
        factor *= per_energy, forcing *= per_energy;
    if (speed)
        factor /= c->gamma, forcing /= c->gamma;
    for (int n = 0; n < ORDER; n++) {
        const double rounded = (8.0 * (n + 3) + 8.0) * UNIT + late;
        if (gaps) {
            e.rate[n] = x[n + 1];
            e.error[n] = n ? rounded * size[n + 1] : v_error;
        } else if (speed && n == 0) {
            e.rate[0] = v_c_rate(c, margin);
            e.error[0] = (force_change_size(b, x_error, v_error) +
                          MARGIN_AT_UNITS * UNIT *
                              margin_at_size(b, fabs(x_r), fabs(gap), fabs(v_r))) / c->gamma;
        } else {
            const int k = speed ? n : n + 1;
            const double by = speed ? 1.0 / c->gamma : 1.0;
            e.rate[n] = by * force_change(c, x[k], x[k + 1]);
            e.error[n] = by * rounded * force_change_size(b, size[k], size[k + 1]);
        }
        e.rate[n] *= inverse, e.error[n] = e.error[n] * inverse + UNDERFLOW;
        inverse /= n + 1;
    }
    e.rest = factor * inverse + UNDERFLOW, e.growth = forcing * inverse + UNDERFLOW;
    return e;
}

/* The Bernstein coefficients on (0, 1) of a polynomial of powers, in place; the largest size. */
static double bernstein(double *a, int count)
{
    double binomial = 1.0, largest = 0.0;
    for (int i = 1; i < count; i++) {
        binomial = binomial * (count - i) / i;
        a[i] /= binomial;
    }
    for (int k = 1; k < count; k++)
        for (int j = count - 1; j >= k; j--)
            a[j] += a[j - 1];
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i]));
    return largest;
}

/* Of a rate that is positive at first: 1 if it stays so over h, -1 if it falls all over it through
   one root, 0 if neither is shown. The first `zeros` coefficients are left out. */
static int shown(const expansion *e, double sign, int zeros, double h)
{
    const int count = SIZE - zeros;
    double lower[SIZE], upper[SIZE], slope[SIZE], power = 1.0;
    for (int i = 0; i < count; i++, power *= h) {
        const int n = i + zeros;
        const double slack = 8.0 * SIZE * UNIT;
        const double value = n < ORDER ? sign * e->rate[n] : 0.0;
        const double error = n < ORDER ? e->error[n] * (1.0 + slack) + slack * fabs(value)
                                       : (n == ORDER ? e->rest : e->growth) * (1.0 + slack);
        lower[i] = (value - error) * power, upper[i] = (value + error) * power;
        /* Of the remainder R over d^m: |R'|/d^m + m |R|/d^(m + 1), and R' is bounded by ORDER R/d. */
        slope[i] = n < ORDER ? i * (value + error) * power : (ORDER + zeros) * error * power;
    }
    const double least = bernstein(lower, count), most = bernstein(upper, count);
    const double falling = bernstein(slope + 1, count - 1);
    int positive = 1, falls = upper[count - 1] < -32.0 * UNIT * most;
    for (int i = 0; i < count; i++)
        positive &= lower[i] > 32.0 * UNIT * least;
    for (int i = 1; i < count; i++)
        falls &= slope[i] < -32.0 * UNIT * falling - UNDERFLOW;
    return positive ? 1 : falls ? -1 : 0;
}

/* The root of the rate in a bracket with one, and the quantity there. */
static void extremum_in(const course *f, double sign, double low, double high,
                        capsule_extremum *extremum)
{
    double h = 0.5 * (low + high);
    for (int round = 0; round < 80; round++) {
        const expansion e = expand(f, h);
        if (sign * e.rate[0] > 0.0)
            low = h;
        else
            high = h;
        double next = h - e.rate[0] / e.rate[1];
        if (!(next > low && next < high))
            next = 0.5 * (low + high);
        const int close = fabs(next - h) <= 2.0 * UNIT * next || next == low || next == high;
        h = next;
        if (close)
            break;
    }
    extremum->time = h;
    extremum->value = expand(f, h).value;
}

int capsule_find_extrema(const capsule_constants *c, const capsule_start *start,
                       capsule_quantity quantity, int zeros, double duration,
                       capsule_extremum *extrema, int room)
{
    if (!c || !start || !extrema || room < 0 || zeros < 0 || zeros > 1 || isnan(duration) ||
        (quantity != CAPSULE_GAP && quantity != CAPSULE_FORCE && quantity != CAPSULE_SPEED))
        return -1;
    const course f = course_of(c, start, quantity);
    double now = 0.0, ahead = REACH_OF_RATE / c->rate;
    int found = 0;
    for (int tried = 0; now < duration; tried++) {
        const expansion e = expand(&f, now);
        const int skipped = now == 0.0 ? zeros : 0;
        const double first = e.rate[skipped];
        if (!(fabs(first) > FAINT * e.error[skipped]))
            return -1;
        /* Of a later stretch it is the one that was shown of the end before, as both are proved. */
        const double sign = first > 0.0 ? 1.0 : -1.0;
        double h = fmin(fmin(ahead, REACH_OF_RATE / c->rate), duration - now);
        int how = shown(&e, sign, skipped, h);
        for (; !how; how = shown(&e, sign, skipped, h)) {
            h *= 0.5;
            if (h <= SHORTEST * duration)
                return -1;
        }
        if (how < 0) {
            if (found == room)
                return -1;
            extrema[found].kind = (int)-sign;
            extremum_in(&f, sign, now, now + h, &extrema[found++]);
        }
        if (tried == MOST_STRETCHES)
            return -1;
        now = h == duration - now ? duration : now + h;
        ahead = 4.0 * h;
    }
    return found;
}
