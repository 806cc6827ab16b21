/* All extrema of a quantity inside a segment, each proved: its rate changes sign there and keeps its sign
   elsewhere. The rate is expanded like the guards of the reference map, with the same bounds on remainder
   and rounding; Bernstein coefficients decide its sign. Segments that double precision cannot decide, or
   that take many stretches, are returned undecided.

   The same search finds the largest size along a run. It skips stretches that stay below the largest size
   so far, and it needs no bounds on rounding. */
#include <math.h>

#include "number.h"
#include "orbit.h"

#define ORDER 8          /* derivatives of the rate, itself the first */
#define SIZE (ORDER + 2) /* of the polynomials that bound it */
#define REACH_OF_RATE 3.0 /* of the first stretch that is tried, over the fastest rate */
#define MOST_PROVED (1 << 16) /* most stretches, some 30 ms */
#define MOST_ROUNDS 80
#define SMALL 1e-9     /* a step of Newton's method, beside the time */
#define NOTHING 1e-270 /* a smaller quantity counts as 0 */
#define SHORTEST 0x1p-40 /* of a segment */
#define FORM_UNITS 8.0   /* of the closed form, measured: below 4 */
#define FAINT 32.0       /* errors of a rate, below which its sign is uncertain */

/* A segment and the quantity whose extrema are searched. */
typedef struct {
    const capsule_constants *c;
    const capsule_start *start;
    capsule_quantity quantity;
    double rounding; /* 1 where its bounds count, 0 of a peak */
    double force, largest_x, largest_v, gap_error; /* of the closed form's error bounds */
    double amplitude; /* of the relative acceleration by a drive that varies within a segment */
} course;

/* The rate at a time: derivatives over factorials, bounds on their errors, and on the remainder. */
typedef struct {
    double value, rate[ORDER], error[ORDER], rest, growth; /* value: of the quantity itself */
    double x_r, gap, v_r;
} expansion;

/* A search through a segment: for its extrema, or for a size larger than the peak's. */
typedef struct {
    course of;
    double duration;
    int zeros, most; /* stretches at the most */
    capsule_extremum *extrema;
    int room, found;
    capsule_peak *peak; /* or null */
    size_t segment;     /* its number */
    capsule_watch *watch;
} search;

static course course_of(const capsule_constants *c, const capsule_start *start,
                        capsule_quantity quantity, double rounding)
{
    course f = {.c = c, .start = start, .quantity = quantity, .rounding = rounding};
    const double x = fabs(start->x_r), gap = fabs(start->gap);
    f.force = rest_force_size(c, x, gap);
    f.largest_x = f.largest_v = INFINITY;
#if !CAPSULE_PULSED
    double rate;
    forcing_terms_size(c, &f.amplitude, &rate);
    if (c->Z2 > 0.0) {
        const double detuning = fabs(c->K - c->omega * c->omega), both = c->omega + sqrt(c->K);
        f.largest_x = (2.0 * c->sigma * both + 2.0 * detuning) / c->Z2;
        f.largest_v = (4.0 * c->sigma * c->omega * c->omega + detuning * both) / c->Z2;
    }
#endif
    f.gap_error = 2.0 * gap > fabs(c->CAPSULE_OWN_STOP) ? UNIT * gap : 0.0;
    return f;
}

/* Bounds on the errors of x_r and v_r after h, from the largest terms of the closed form. */
static void errors_at(const course *f, double h, double x_r, double *of_x, double *of_v)
{
    const capsule_constants *c = f->c;
    const double v = fabs(f->start->v_r), root_K = sqrt(c->K), g = fmin(h, 1.0 / c->fast);
    const double forced_x = fmin(fmin(h * h / 2.0, h / root_K), f->largest_x);
    const double forced_v = fmin(h, f->largest_v);
    const double x_terms = v * g + f->force * fmin(h * h / 2.0, 2.0 / c->K) + f->amplitude * forced_x;
    const double v_terms = v + f->force * g + f->amplitude * forced_v;
    const double phase = c->q >= 0.0 ? c->fast * h / (1.0 + c->sigma * h) : 1.0;
    const double units = FORM_UNITS * UNIT * (1.0 + phase + c->omega * h);
    const double carried = 2.0 * f->gap_error;
    const double late = 2.0 * UNIT * TWO_PI * f->amplitude;
    *of_x = units * x_terms + UNIT * fabs(x_r) + carried + late * forced_x + UNDERFLOW;
    *of_v = units * v_terms + root_K * carried + late * forced_v + UNDERFLOW;
}

static expansion expand(const course *f, double h)
{
    const capsule_constants *c = f->c;
    const capsule_start *s = f->start;
#if CAPSULE_PULSED
    const double turned = 0.0, cosine = 0.0, sine = 0.0;
#else
    const double turned = c->omega * h, co = cos(turned), si = sin(turned);
    const double cosine = s->cos_theta * co - s->sin_theta * si;
    const double sine = s->sin_theta * co + s->cos_theta * si;
#endif
    const double late = 2.0 * UNIT * (TWO_PI + turned) + 8.0 * UNIT;
    double x_error = f->gap_error + UNDERFLOW, v_error = UNDERFLOW, change[3] = {0.0, 0.0, 0.0};
    double x[ORDER + 3], size[ORDER + 3], margin = s->margin;
    double x_r = s->x_r, gap = s->gap, v_r = s->v_r;
    if (h > 0.0) {
        capsule_flow(c, s, h, change);
        x_r += change[0], gap += change[0], v_r = change[1];
        margin = margin_at(c, x_r, gap, v_r, cosine);
        errors_at(f, h, x_r, &x_error, &v_error);
    }
    x[0] = x_r, x[1] = v_r;
    /* An error of the point counts as a number of roundings of its value. */
    size[0] = fabs(x_r) + x_error / UNIT, size[1] = fabs(v_r) + v_error / UNIT;
    x[2] = v_rate(c, x_r, gap, v_r, cosine);
    size[2] = v_rate_size(c, size[0], fabs(gap) + x_error / UNIT, size[1]);
    double drive = f->amplitude;
    for (int n = 3; n < ORDER + 3; n++) {
        const double wave = n % 2 ? sine : cosine;
        drive *= c->omega;
        x[n] = -(c->K * x[n - 2]) - 2.0 * c->sigma * x[n - 1] + ((n - 1) / 2 % 2 ? -drive : drive) * wave;
        size[n] = c->K * size[n - 2] + 2.0 * c->sigma * size[n - 1] + drive;
    }
    const double per_energy = (1.0 + 8.0 * UNIT) * force_per_energy(c, sqrt(c->K));
    const int speed = f->quantity == CAPSULE_SPEED, gaps = f->quantity == CAPSULE_GAP;
    /* The remainder is the derivative of x_r's, or of the force's, whose order this is; of v_r' by
       momentum, where the drive is in the force that moves the capsule. */
    const int momentum = CAPSULE_REACTION && speed;
    const int pull = CAPSULE_REACTION && f->quantity == CAPSULE_PULL;
    const int last = (speed && !momentum) || gaps ? ORDER : ORDER + 1;
    const double slack = f->rounding * ((8.0 * (ORDER + 3) + 8.0) * UNIT + late);
    const double high = fabs(x[last + 1]) + slack * size[last + 1];
    const double low = fabs(x[last]) + slack * size[last];
    double factor = (1.0 + 8.0 * UNIT) * hypot(high, sqrt(c->K) * low), inverse = 1.0;
    double forcing = f->amplitude * pow(c->omega, last) * (1.0 + 32.0 * UNIT);
    const double force_ = CAPSULE_REACTS && f->quantity == CAPSULE_FORCE ? force(c, x_r, gap, v_r)
                                                                         : margin + c->friction;
    expansion e = {.value = gaps ? gap : speed ? s->v_c + change[2] : force_,
                   .x_r = x_r, .gap = gap, .v_r = v_r};
    const double of_drive = pull ? forcing : 0.0;
    if (!gaps && !momentum)
        factor *= per_energy, forcing *= per_energy;
    if (pull) /* Q = P - u, and a derivative of u is bounded as that of what the drive accelerates by */
        factor += of_drive;
    if (speed)
        factor /= momentum ? c->gamma + 1.0 : c->gamma, forcing /= momentum ? c->gamma + 1.0 : c->gamma;
    for (int n = 0; n < ORDER; n++) {
        const double rounded = (8.0 * (n + 3) + 8.0) * UNIT + late;
        if (gaps) {
            e.rate[n] = x[n + 1];
            e.error[n] = n ? rounded * size[n + 1] : v_error;
        } else if (speed && n == 0) {
            e.rate[0] = v_c_rate(c, margin);
            e.error[0] = (force_change_size(c, x_error, v_error) +
                          MARGIN_AT_UNITS * UNIT *
                              margin_at_size(c, fabs(x_r), fabs(gap), fabs(v_r))) / c->gamma;
        } else if (momentum) {
            e.rate[n] = -x[n + 2] / (c->gamma + 1.0);
            e.error[n] = rounded * size[n + 2] / (c->gamma + 1.0);
        } else if (pull) { /* v_r' = -m Q and a constant, where the drive pushes the capsule back */
            e.rate[n] = -x[n + 3] / c->m;
            e.error[n] = rounded * size[n + 3] / c->m;
        } else {
            const int k = speed ? n : n + 1;
            const double by = speed ? 1.0 / c->gamma : 1.0;
            e.rate[n] = by * force_change(c, x[k], x[k + 1]);
            e.error[n] = by * rounded * force_change_size(c, size[k], size[k + 1]);
        }
        e.rate[n] *= inverse, e.error[n] = f->rounding * e.error[n] * inverse + UNDERFLOW;
        inverse /= n + 1;
    }
    e.rest = factor * inverse + UNDERFLOW, e.growth = forcing * inverse + UNDERFLOW;
    return e;
}

/* One over the binomial coefficients of the degrees that occur. */
static const double SHARE[3][SIZE] = {
    {1.0, 1.0 / 7.0, 1.0 / 21.0, 1.0 / 35.0, 1.0 / 35.0, 1.0 / 21.0, 1.0 / 7.0, 1.0},
    {1.0, 1.0 / 8.0, 1.0 / 28.0, 1.0 / 56.0, 1.0 / 70.0, 1.0 / 56.0, 1.0 / 28.0, 1.0 / 8.0, 1.0},
    {1.0, 1.0 / 9.0, 1.0 / 36.0, 1.0 / 84.0, 1.0 / 126.0, 1.0 / 126.0, 1.0 / 84.0, 1.0 / 36.0,
     1.0 / 9.0, 1.0},
};

/* Replaces a polynomial's powers by its Bernstein coefficients on (0, 1); returns the largest size. */
static double bernstein(double *a, int count)
{
    const double *const share = SHARE[count - ORDER];
    double largest = 0.0;
    for (int i = 1; i < count; i++)
        a[i] *= share[i];
    for (int k = 1; k < count; k++)
        for (int j = count - 1; j >= k; j--)
            a[j] += a[j - 1];
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i]));
    return largest;
}

/* Proved sign of a rate that is positive at first: 1 if it stays so over h, -1 if it decreases all over h
   through one root, else 0. The first `zeros` coefficients are skipped. */
static int shown(const expansion *e, double sign, int zeros, double h)
{
    const int count = SIZE - zeros;
    double lower[SIZE], slope[SIZE], power = 1.0, end = 0.0, terms = 0.0;
    for (int i = 0; i < count; i++, power *= h) {
        const int n = i + zeros;
        const double slack = 8.0 * SIZE * UNIT;
        const double value = n < ORDER ? sign * e->rate[n] : 0.0;
        const double error = n < ORDER ? e->error[n] * (1.0 + slack) + slack * fabs(value)
                                       : (n == ORDER ? e->rest : e->growth) * (1.0 + slack);
        lower[i] = (value - error) * power;
        end += (value + error) * power, terms += (fabs(value) + error) * power;
        /* Of the remainder R over d^m: |R'|/d^m + m |R|/d^(m + 1), and R' is bounded by ORDER R/d. */
        slope[i] = n < ORDER ? i * (value + error) * power : (ORDER + zeros) * error * power;
    }
    const double least = bernstein(lower, count);
    int positive = 1, falls = end < -32.0 * UNIT * terms;
    for (int i = 0; i < count; i++)
        positive &= lower[i] > 32.0 * UNIT * least;
    if (positive || !falls)
        return positive;
    const double falling = bernstein(slope + 1, count - 1);
    for (int i = 1; i < count; i++)
        falls &= slope[i] < -32.0 * UNIT * falling - UNDERFLOW;
    return -falls;
}

/* Root of the rate over h after an expansion, by Newton's method: first on the polynomial, at almost no cost,
   then on the closed form, until rounding keeps steps from getting shorter. */
static double root_after(const course *f, const expansion *begin, double now, double sign, double h)
{
    double at = now + 0.5 * h;
    for (int closed_form = 0; closed_form < 2; closed_form++) {
        double low = now, high = now + h, last = INFINITY;
        for (int round = 0; round < MOST_ROUNDS; round++) {
            double rate = 0.0, slope = 0.0;
            if (closed_form) {
                const expansion e = expand(f, at);
                rate = e.rate[0], slope = e.rate[1];
            } else {
                for (int n = ORDER - 1; n >= 0; n--) {
                    slope = slope * (at - now) + rate;
                    rate = rate * (at - now) + begin->rate[n];
                }
            }
            if (sign * rate > 0.0)
                low = at;
            else
                high = at;
            const double step = rate / slope, next = at - step;
            if (fabs(step) <= 2.0 * UNIT * at || (last <= SMALL * at && fabs(step) >= 0.5 * last))
                break;
            last = fabs(step);
            at = next > low && next < high ? next : 0.5 * (low + high);
        }
    }
    return at;
}

/* Records an extremum; true if there is room. For a peak only a larger one is recorded. */
static int note(search *s, int kind, double h)
{
    const expansion e = expand(&s->of, h);
    if (s->peak) {
        if (fabs(e.value) >= s->peak->size)
            *s->peak = (capsule_peak){fabs(e.value), h, e.x_r, e.gap, e.v_r, s->segment, 0};
        return 1;
    }
    if (s->found == s->room)
        return 0;
    s->extrema[s->found++] = (capsule_extremum){kind, h, e.value};
    return 1;
}

/* True if the quantity's size stays below the peak's over h except for rounding, by the coefficients of its
   polynomial. */
static int below(const expansion *e, const capsule_peak *peak, double h)
{
    double a[ORDER + 1] = {e->value}, power = h;
    for (int n = 0; n < ORDER; n++, power *= h)
        a[n + 1] = e->rate[n] * power / (n + 1);
    const double left = (e->rest + e->growth * h) * power / (ORDER + 1);
    return bernstein(a, ORDER + 1) + left <= peak->size * (1.0 + 4.0 * UNIT) + NOTHING;
}

/* As `shown`, except that the search for a peak also passes smaller sizes, and the shortest stretches. */
static int passed(const search *s, const expansion *e, double sign, int zeros, double h)
{
    if (s->peak && (h <= SHORTEST * s->duration || below(e, s->peak, h)))
        return 1;
    return shown(e, sign, zeros, h);
}

/* Searches the segment, stretch by stretch, each up to twice as long as the one before. */
static capsule_stop look(search *s)
{
    const course *f = &s->of;
    double now = 0.0, ahead = REACH_OF_RATE / f->c->rate;
    for (int tried = 0; now < s->duration; tried++) {
        if (tried == s->most)
            return CAPSULE_OPEN;
        if (capsule_asked(s->watch, 1))
            return CAPSULE_STOPPED;
        const expansion e = expand(f, now);
        const int skipped = now == 0.0 ? s->zeros : 0;
        const int faint = !(fabs(e.rate[skipped]) > FAINT * e.error[skipped]);
        if (faint && !s->peak)
            return CAPSULE_OPEN;
        /* Of a later stretch it is the one that was shown of the end before, as both are proved. */
        const double sign = (faint ? -e.rate[1] : e.rate[skipped]) > 0.0 ? 1.0 : -1.0;
        double h = fmin(ahead, s->duration - now);
        int how = passed(s, &e, sign, skipped, h);
        for (; !how; how = passed(s, &e, sign, skipped, h)) {
            h *= 0.5;
            if (h <= SHORTEST * s->duration && !s->peak)
                return CAPSULE_OPEN;
        }
        if (how < 0 && !note(s, (int)-sign, faint ? now : root_after(f, &e, now, sign, h)))
            return CAPSULE_OPEN;
        now = h == s->duration - now ? s->duration : now + h;
        ahead = 2.0 * h;
    }
    return CAPSULE_DONE;
}

int capsule_find_extrema(const capsule_constants *c, const capsule_start *start,
                       capsule_quantity quantity, int zeros, double duration,
                       capsule_extremum *extrema, int room)
{
    if (!c || !start || !extrema || room < 0 || zeros < 0 || zeros > 1 || isnan(duration) ||
        (quantity != CAPSULE_GAP && quantity != CAPSULE_FORCE && quantity != CAPSULE_SPEED &&
         quantity != CAPSULE_PULL))
        return -1;
    search s = {.of = course_of(c, start, quantity, 1.0), .duration = duration, .zeros = zeros,
                .most = MOST_PROVED, .extrema = extrema, .room = room};
    return look(&s) == CAPSULE_DONE ? s.found : -1;
}

/* Weights for comparing sizes: gaps of two stops count by their springs' forces. */
static double weight_of(const capsule_constants *c, capsule_quantity quantity)
{
    return TWO_STOPS && quantity == CAPSULE_GAP ? c->kappa : 1.0;
}

capsule_stop capsule_find_peak(const capsule_closed_run *run, capsule_quantity quantity,
                               capsule_watch *watch, capsule_peak *peak)
{
    *peak = (capsule_peak){0};
    for (size_t i = 0; i < run->count; i++) {
        const capsule_segment *s = &run->segments[i];
        const capsule_constants *c = &run->map->field[s->field - 1];
        const double gap = s->end[0] - c->CAPSULE_OWN_STOP;
        const double value = quantity == CAPSULE_FORCE ? force(c, s->end[0], gap, s->end[1]) : gap;
        /* No extremum is needed at the end of the run: one there is found in a segment. */
        const double size =
            fabs(value) * weight_of(c, quantity) * (s->target ? 1.0 : 1.0 - 16.0 * UNIT);
        if (size > peak->size && (quantity == CAPSULE_FORCE || c->contact != 0.0))
            *peak = (capsule_peak){size, s->duration, s->end[0], gap, s->end[1], i, 1};
    }
    for (size_t i = 0; i < run->count; i++) {
        const capsule_segment *at = &run->segments[i];
        const capsule_constants *c = &run->map->field[at->field - 1];
        const capsule_start start = capsule_start_of(at);
        const double weight = weight_of(c, quantity);
        if ((quantity == CAPSULE_GAP && c->contact == 0.0) || weight == 0.0)
            continue;
        capsule_peak here = *peak;
        here.size /= weight;
        search s = {.of = course_of(c, &start, quantity, 0.0), .duration = at->duration,
                    .most = MOST_STRETCHES, .peak = &here, .segment = i, .watch = watch};
        const capsule_stop stop = look(&s);
        *peak = here;
        peak->size *= weight;
        if (stop != CAPSULE_DONE)
            return stop;
    }
    return CAPSULE_DONE;
}
