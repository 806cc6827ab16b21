/* Eqs. (7)-(12) integrated in C, for comparison with the exact map: the adaptive method of order 8
 * by Dormand and Prince with its dense output (tableau.h holds its coefficients), and the classical
 * Runge-Kutta method of order 4 with fixed steps. Neither contains a formula of the exact map.
 *
 * A run begins at time 0 in the given field (1 to 6) at the state z = (x_r, v_r, v_c). It writes
 * the final state to z and the fields that it enters to `word`, and returns their number. A run
 * that locks up in switches that take no time, or has no room for more, returns minus that number.
 */
#include <math.h>
#include <string.h>

#include "tableau.h"

enum { STAGES = 16, END = 12, MOST_SHORT = 50 };
static const double SHORTEST = 1e-12; /* length of a segment that counts as none */

typedef struct {
    double alpha, omega, delta, zeta, beta, gamma, f_b;
} Parameters;

typedef struct {
    const Parameters *p;
    int contact, drift;
    double spring, slip, friction; /* beta in contact; 1/gamma and its friction in drift; else 0 */
} Field;

static Field field_of(const Parameters *p, int contact, int drift)
{
    double slip = drift ? 1 / p->gamma : 0;
    return (Field){p, contact, drift, contact ? p->beta : 0, slip, drift * p->f_b * slip};
}

static int number_of(const Field *f)
{
    return 2 - f->drift + 3 * f->contact;
}

static Field field_numbered(const Parameters *p, int number)
{
    return field_of(p, number > 3, 1 - (number - 1) % 3);
}

static double force(const Field *f, const double *z)
{
    return z[0] + 2 * f->p->zeta * z[1] + f->spring * (z[0] - f->p->delta);
}

static void rate(const Field *f, double t, const double *z, double *dz)
{
    double pull = force(f, z);
    dz[2] = f->slip * pull - f->friction;
    dz[1] = f->p->alpha * cos(f->p->omega * t) - pull - dz[2];
    dz[0] = z[1];
}

static int guard_count(const Field *f)
{
    return f->drift ? 2 : 3;
}

/* Guard 0 is the gap; 1 is the capsule's velocity in drift; 1 and 2 are the bounds of friction. */
static double guard(const Field *f, int which, const double *z)
{
    if (which == 0)
        return f->contact ? z[0] - f->p->delta : f->p->delta - z[0];
    if (f->drift)
        return f->drift * z[2];
    return which == 1 ? f->p->f_b - force(f, z) : f->p->f_b + force(f, z);
}

static double guard_rate(const Field *f, int which, const double *dz)
{
    if (which == 0)
        return f->contact ? dz[0] : -dz[0];
    if (f->drift)
        return f->drift * dz[2];
    double pull = dz[0] + 2 * f->p->zeta * dz[1] + f->spring * dz[0];
    return which == 1 ? -pull : pull;
}

/* The field after guard `fired` reached zero at z. */
static Field following(const Field *f, int fired, const double *z)
{
    if (fired == 0)
        return field_of(f->p, !f->contact, f->drift);
    if (!f->drift)
        return field_of(f->p, f->contact, fired == 1 ? 1 : -1);
    double pull = force(f, z);
    return field_of(f->p, f->contact, fabs(pull) <= f->p->f_b ? 0 : pull > 0 ? 1 : -1);
}

/* One step of order 8: its stages, and the polynomial through it on request. */
typedef struct {
    const Field *field;
    double precision; /* to which roots are found, as a fraction of the step */
    double t, h, start[3], end[3], k[STAGES][3], dense[7][3];
    int has_dense;
} Step;

/* The error of the step in units of the tolerance, by the estimates of order 5 and 3. */
static double attempt(Step *s, double tolerance)
{
    double y[3], five = 0, three = 0;
    const double *z = s->start, h = s->h, (*k)[3] = s->k;
    s->has_dense = 0;
#define STAGE(i)                                                                                   \
    for (int j = 0; j < 3; j++)                                                                    \
        y[j] = z[j] + h * (A##i(k, j));                                                            \
    rate(s->field, s->t + NODES[i] * h, y, s->k[i]);
    STAGE(1) STAGE(2) STAGE(3) STAGE(4) STAGE(5) STAGE(6)
    STAGE(7) STAGE(8) STAGE(9) STAGE(10) STAGE(11)
    for (int j = 0; j < 3; j++)
        s->end[j] = z[j] + h * (A12(k, j));
    for (int j = 0; j < 3; j++) {
        double scale = tolerance * (1 + fmax(fabs(z[j]), fabs(s->end[j])));
        double e5 = (E5(k, j)) / scale, e3 = (E3(k, j)) / scale;
        five += e5 * e5;
        three += e3 * e3;
    }
    return five > 0 ? h * five / sqrt(3 * (five + 0.01 * three)) : 0;
}

static void make_dense(Step *s)
{
    double y[3];
    const double *z = s->start, h = s->h, (*k)[3] = s->k;
    STAGE(13) STAGE(14) STAGE(15)
    for (int j = 0; j < 3; j++) {
        double change = s->end[j] - z[j];
        s->dense[0][j] = change;
        s->dense[1][j] = h * k[0][j] - change;
        s->dense[2][j] = 2 * change - h * (k[END][j] + k[0][j]);
        s->dense[3][j] = h * (D0(k, j));
        s->dense[4][j] = h * (D1(k, j));
        s->dense[5][j] = h * (D2(k, j));
        s->dense[6][j] = h * (D3(k, j));
    }
    s->has_dense = 1;
}

/* The state at a fraction x of the step. */
static void inside(Step *s, double x, double *z)
{
    if (!s->has_dense)
        make_dense(s);
    for (int j = 0; j < 3; j++) {
        double sum = 0;
        for (int i = 6; i >= 0; i--)
            sum = (sum + s->dense[i][j]) * (i % 2 ? 1 - x : x);
        z[j] = s->start[j] + sum;
    }
}

static double height(Step *s, int which, int slope, double x)
{
    double z[3], dz[3];
    inside(s, x, z);
    if (!slope)
        return guard(s->field, which, z);
    rate(s->field, s->t + x * s->h, z, dz);
    return guard_rate(s->field, which, dz);
}

/* Root of a guard, or of its rate, where it changes sign from `low` to `high`: regula falsi by the
 * rule of Anderson and Bjorck, with bisection as every eighth step. */
static double root(Step *s, int which, int slope, double low, double high)
{
    double a = height(s, which, slope, low), b = height(s, which, slope, high), x = high;
    for (int i = 1; i < 100; i++) {
        double before = x;
        x = low + (high - low) * (i % 8 ? a / (a - b) : 0.5);
        if (!(x > low && x < high) || fabs(x - before) <= s->precision * high)
            break;
        double c = height(s, which, slope, x);
        if ((c < 0) == (b < 0)) {
            a *= c / b < 1 ? 1 - c / b : 0.5;
            high = x;
            b = c;
        } else {
            b *= c / a < 1 ? 1 - c / a : 0.5;
            low = x;
            a = c;
        }
    }
    return x;
}

/* Fraction of the step at which a guard first falls below zero as far as its signs tell: at the
 * step's ends, and with `interior` also at a least value between them; 2 if it does not. */
static double crossing(Step *s, int which, int interior)
{
    double low = 0, high = 1;
    if (guard(s->field, which, s->end) >= 0) {
        if (!interior || !(guard(s->field, which, s->start) > 0) ||
            !(guard_rate(s->field, which, s->k[0]) < 0) ||
            !(guard_rate(s->field, which, s->k[END]) > 0))
            return 2;
        high = root(s, which, 1, 0, 1);
        if (height(s, which, 0, high) >= 0)
            return 2;
    }
    /* A guard that starts at zero leaves it first, however soon it comes back. */
    if (!(guard(s->field, which, s->start) > 0)) {
        for (low = high / 2; low > 1e-15 && height(s, which, 0, low) <= 0; low /= 2)
            high = low;
        if (low <= 1e-15)
            return 0;
    }
    return root(s, which, 0, low, high);
}

int run_dop853(const double *values, double end, double tolerance, int interior, int number,
               double *z, char *word, int room)
{
    Parameters p;
    memcpy(&p, values, sizeof p);
    Field field = field_numbered(&p, number);
    Step s = {.field = &field, .precision = fmax(2.5e-16, 0.01 * tolerance)};
    memcpy(s.start, z, sizeof s.start);
    rate(&field, 0, s.start, s.k[0]);
    int count = 0, brief = 0;
    double next = 0.01;
    word[count++] = (char)number_of(&field);
    while (s.t < end) {
        int last = next >= end - s.t;
        s.h = last ? end - s.t : next;
        double error = attempt(&s, tolerance);
        double factor = error > 0 ? 0.9 * pow(error, -0.125) : 10;
        if (!(error < 1)) {
            next = s.h * fmax(0.2, factor);
            continue;
        }
        rate(&field, s.t + s.h, s.end, s.k[END]);
        next = s.h * fmin(10, factor);
        double first = 2;
        int fired = 0;
        for (int i = 0; i < guard_count(&field); i++) {
            double x = crossing(&s, i, interior);
            if (x < first) {
                first = x;
                fired = i;
            }
        }
        if (first > 1) {
            s.t = last ? end : s.t + s.h;
            memcpy(s.start, s.end, sizeof s.start);
            memcpy(s.k[0], s.k[END], sizeof s.k[0]);
            continue;
        }
        double here[3];
        inside(&s, first, here);
        s.t += first * s.h;
        memcpy(s.start, here, sizeof here);
        field = following(&field, fired, here);
        s.start[fired ? 2 : 0] = fired ? 0 : p.delta;
        rate(&field, s.t, s.start, s.k[0]);
        brief = first * s.h < SHORTEST ? brief + 1 : 0;
        if (brief == MOST_SHORT || count == room)
            return -count;
        word[count++] = (char)number_of(&field);
    }
    memcpy(z, s.start, sizeof s.start);
    return count;
}

/* Switches at the ends of steps, wherever a guard is found below zero. */
int run_rk4(const double *values, double end, int steps, int number, double *z, char *word,
            int room)
{
    Parameters p;
    memcpy(&p, values, sizeof p);
    Field field = field_numbered(&p, number);
    double h = end / steps, a[3], b[3], c[3], d[3], y[3];
    int count = 0;
    word[count++] = (char)number_of(&field);
    for (int i = 0; i < steps; i++) {
        double t = i * h;
        rate(&field, t, z, a);
        for (int j = 0; j < 3; j++)
            y[j] = z[j] + h / 2 * a[j];
        rate(&field, t + h / 2, y, b);
        for (int j = 0; j < 3; j++)
            y[j] = z[j] + h / 2 * b[j];
        rate(&field, t + h / 2, y, c);
        for (int j = 0; j < 3; j++)
            y[j] = z[j] + h * c[j];
        rate(&field, t + h, y, d);
        for (int j = 0; j < 3; j++)
            z[j] += h / 6 * (a[j] + 2 * b[j] + 2 * c[j] + d[j]);
        for (int k = 0; k < guard_count(&field); k++)
            if (guard(&field, k, z) < 0) {
                field = following(&field, k, z);
                if (k && !field.drift)
                    z[2] = 0;
                if (count == room)
                    return -count;
                word[count++] = (char)number_of(&field);
                break;
            }
    }
    return count;
}
