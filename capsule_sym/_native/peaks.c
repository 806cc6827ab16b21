/* The largest forces along an orbit. A force is a combination of x_r and v_r, whose derivatives follow
   from the equation of motion. With y any derivative of x_r, sqrt(y'^2 + K y^2) never grows faster
   than the forcing's derivative: that bounds what Taylor's polynomial of a force leaves out. So a
   stretch is passed if the force stays below what is known there, or is monotone, or turns once. */
#include <math.h>

#include "number.h"
#include "orbit.h"

#define SHORTEST 0x1p-40 /* of a segment: the force changes by no more than rounding there */
#define SHRINK 0.5

/* What is measured of a force in a segment, in terms of x_r and v_r. */
typedef struct {
    const capsule_constants *c;
    capsule_start start;
    capsule_force force;
    double by_x, by_v, remainder; /* its coefficients, and its size by the energy of a derivative */
} course;

/* The force at a time, its first three derivatives, and the energy of the fourth. */
typedef struct {
    double x_r, gap, v_r, value, rate, second, third, energy;
} jet;

/* Of the second spring, how far it is compressed: a force of 0 has its largest place too. */
static double force_of(const capsule_constants *c, capsule_force force_, double x_r, double gap,
                       double v_r)
{
    return force_ == BETWEEN ? force(c, x_r, gap, v_r) : c->contact * gap;
}

static course course_of(const capsule_constants *c, const capsule_segment *s, capsule_force force_)
{
    course f = {.c = c, .force = force_,
                .start = {s->start[0], s->gap, s->start[1], s->start[2], s->margin, s->cosine,
                          s->sine}};
    f.by_x = force_ == BETWEEN ? force_change(c, 1.0, 0.0) : c->contact;
    f.by_v = force_ == BETWEEN ? force_change(c, 0.0, 1.0) : 0.0;
    f.remainder = fabs(f.by_v) + fabs(f.by_x) / sqrt(c->K);
    return f;
}

static jet jet_at(const course *f, double h)
{
    const capsule_constants *c = f->c;
    const double turned = c->omega * h, co = cos(turned), si = sin(turned);
    const double cosine = f->start.cos_theta * co - f->start.sin_theta * si;
    const double sine = f->start.sin_theta * co + f->start.cos_theta * si;
    double change[3];
    capsule_flow(c, &f->start, h, change);
    const double x = f->start.x_r + change[0], gap = f->start.gap + change[0], v = change[1];
    const double x2 = v_rate(c, x, gap, v, cosine), x3 = v_second(c, v, x2, sine);
    /* The next two by the same equation, with the forcing's next derivatives. */
    const double x4 = v_second(c, x2, x3, c->omega * cosine);
    const double x5 = v_second(c, x3, x4, -c->omega * c->omega * sine);
    return (jet){x, gap, v, force_of(c, f->force, x, gap, v),
                 f->by_x * v + f->by_v * x2, f->by_x * x2 + f->by_v * x3,
                 f->by_x * x3 + f->by_v * x4, sqrt(x5 * x5 + c->K * x4 * x4)};
}

/* The time in a bracket at which the force turns; its rate has opposite signs at the ends. */
static double turn_of(const course *f, double low, double high, int rises)
{
    double h = 0.5 * (low + high);
    for (int i = 0; i < 80; i++) {
        const jet at = jet_at(f, h);
        if ((at.rate > 0.0) == rises)
            low = h;
        else
            high = h;
        double next = h - at.rate / at.second;
        if (!(next > low && next < high))
            next = 0.5 * (low + high);
        if (fabs(next - h) <= 4.0 * UNIT * next || next == low || next == high)
            return next;
        h = next;
    }
    return h;
}

/* The largest size that Bernstein coefficients of the force's cubic have on (0, h). */
static double bound_of(const jet *at, double h)
{
    const double first = at->rate * h, second = at->second * h * h, third = at->third * h * h * h;
    double most = fabs(at->value);
    most = fmax(most, fabs(at->value + first / 3.0));
    most = fmax(most, fabs(at->value + first * (2.0 / 3.0) + second / 6.0));
    return fmax(most, fabs(at->value + first + second / 2.0 + third / 6.0));
}

/* Whether the coefficients all exceed a bound, with one sign. */
static int one_sign(double a, double b, double c, double bound)
{
    return (a > bound && b > bound && c > bound) || (a < -bound && b < -bound && c < -bound);
}

static void keep(capsule_peak *peak, const course *f, size_t segment, double h)
{
    const jet at = jet_at(f, h);
    if (fabs(at.value) >= peak->size)
        *peak = (capsule_peak){fabs(at.value), h, at.x_r, at.gap, at.v_r, segment, 0};
}

/* Looks through a segment for a force larger than the peak so far. */
static capsule_stop look(const course *f, size_t segment, double duration, capsule_watch *watch,
                         capsule_peak *peak)
{
    const double drive = f->c->alpha * pow(f->c->omega, 4.0);
    double now = 0.0, ahead = duration;
    jet at = jet_at(f, 0.0);
    for (int tried = 0; now < duration; tried++) {
        if (capsule_asked(watch, 1))
            return CAPSULE_STOPPED;
        if (tried == MOST_STRETCHES)
            return CAPSULE_OPEN;
        const double h = fmin(ahead, duration - now);
        const double fourth = f->remainder * (at.energy + drive * h), left = fourth * h * h;
        const double turns = at.second + at.third * h;
        const int below = bound_of(&at, h) + left * h * h / 24.0 <= peak->size;
        const int monotone = one_sign(at.rate, at.rate + at.second * h / 2.0,
                                      at.rate + at.second * h + at.third * h * h / 2.0,
                                      left * h / 6.0);
        const int bends = one_sign(at.second, turns, turns, left / 2.0);
        if (!below && !monotone && !bends && h > SHORTEST * duration) {
            ahead = SHRINK * h;
            continue;
        }
        const double end = now + h >= duration ? duration : now + h;
        const jet then = jet_at(f, end);
        if (!below && (at.rate > 0.0) != (then.rate > 0.0))
            keep(peak, f, segment, turn_of(f, now, end, at.rate > 0.0));
        now = end, at = then, ahead = 2.0 * h;
    }
    return CAPSULE_DONE;
}

capsule_stop capsule_find_peak(const capsule_closed_run *run, capsule_force force_,
                               capsule_watch *watch, capsule_peak *peak)
{
    *peak = (capsule_peak){0};
    for (size_t i = 0; i < run->count; i++) {
        const capsule_segment *s = &run->segments[i];
        const capsule_constants *c = &run->map->field[s->field - 1];
        const double gap = s->end[0] - c->delta;
        /* Where the run ends nothing need happen: what turns there is found in a segment. */
        const double size = fabs(force_of(c, force_, s->end[0], gap, s->end[1])) *
                            (s->target ? 1.0 : 1.0 - 8.0 * UNIT);
        if (size > peak->size)
            *peak = (capsule_peak){size, s->duration, s->end[0], gap, s->end[1], i, 1};
    }
    for (size_t i = 0; i < run->count; i++) {
        const capsule_segment *s = &run->segments[i];
        const capsule_constants *c = &run->map->field[s->field - 1];
        if (force_ == CONTACT && c->contact == 0.0)
            continue;
        const course f = course_of(c, s, force_);
        const capsule_stop stop = look(&f, i, s->duration, watch, peak);
        if (stop != CAPSULE_DONE)
            return stop;
    }
    return CAPSULE_DONE;
}

void capsule_peak_slopes(const capsule_constants *c, capsule_force force_, const capsule_peak *peak,
                         double by[2][SLOPES], double slopes[SLOPES])
{
    const int between = force_ == BETWEEN;
    const double side = force_of(c, force_, peak->x_r, peak->gap, peak->v_r) < 0.0 ? -1.0 : 1.0;
    double of[SLOPES];
    if (between)
        force_gradient(c, peak->gap, peak->v_r, of);
    else
        contact_gradient(c, peak->gap, of);
    for (int k = 0; k < SLOPES; k++)
        slopes[k] = side * (of[0] * by[0][k] + of[1] * by[1][k]);
    for (int k = PARAMETER; k < SLOPES; k++)
        slopes[k] += side * of[k];
}
