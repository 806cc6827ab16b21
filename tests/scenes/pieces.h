/* Linear pieces of the motion in any scene, from the equations of motion of both bodies alone:

       P = x_r + 2 zeta v_r + beta_1 (x_r - delta_1)+ - beta_2 (-x_r - delta_2)+,    Q = P - eps u
       v_r' = u - s - P - v_c'
       gamma v_c' = Q - f_plus forward, Q + f_minus backward, 0 at rest while -f_minus <= Q <= f_plus
       u = alpha cos(omega tau), or alpha for frac(omega tau / 2 pi) < D, else alpha_low

   Each is a Taylor polynomial in numbers of 113 bits, over steps so short that its remainder is below
   their rounding. The first root of a guard within a step is isolated by Descartes' rule on the Bernstein
   coefficients, so that no crossing is missed or invented. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __SIZEOF_FLOAT128__
typedef __float128 real;
#else
typedef long double real; /* of 113 bits on most processors that have no __float128 */
#endif
enum { ORDER = 34, ROOM = 65536, SPLITS = 400 };
enum { NONE, FRONT, BACK };
#ifndef SHORTER
#define SHORTER 1 /* divides all steps, to compare runs */
#endif
#define ZERO ((real)1e-27)  /* a coefficient this small beside the largest is a zero */
#define CLEAR ((real)1e-20) /* a step must not end with a guard below this share of its size */
#define MEET ((real)1e-24)  /* two events so close, in shares of a step, are a corner */
#define NOISE ((real)1e-30)

typedef struct {
    double alpha, omega, zeta, gamma, delta_1, beta_1, delta_2, beta_2;
    double s, f_plus, f_minus, alpha_low, D;
} scene;
static int stops, pulsed, reacts;
static scene p;
static real period;

typedef struct { int level, contact, way; } field;
typedef struct { real z[4]; } state; /* x_r, v_r, v_c, x_c */
typedef struct { real x[ORDER + 1], v[ORDER + 1], c[ORDER + 1], y[ORDER + 1], u[ORDER + 1]; } series;
typedef struct { char event; real g[ORDER + 1]; } guard;
enum status { DONE, AT_MOST, NO_FIELD, CORNER, UNDECIDED };
static const char *const STATUS[] = {"done", "most", "no field", "corner", "undecided"};

static real size_of(real a) { return a < 0 ? -a : a; }
static real larger(real a, real b) { return a > b ? a : b; }

static const char PI[] = "3.141592653589793238462643383279502884";

static real decimal(const char *text)
{
    real value = 0, unit = 1;
    for (int point = 0; *text; text++)
        if (*text == '.')
            point = 1;
        else {
            value = value * 10 + (*text - '0');
            unit *= point ? 10 : 1;
        }
    return value / unit;
}

/* Cosine and sine of an angle from -8 to 8, by their series at a 16th of it. */
static void turn(real angle, real *cosine, real *sine)
{
    const real a = angle / 16;
    real term = 1, even = 0, odd = 0; /* cos - 1 and sin */
    for (int n = 1; n < 40; n++) {
        term *= a / n;
        if (n % 2)
            odd += n % 4 == 1 ? term : -term;
        else
            even += n % 4 == 2 ? -term : term;
    }
    for (int i = 0; i < 4; i++) { /* cos 2a - 1 = 2 (cos a - 1)(cos a + 1) */
        const real doubled = 2 * odd * (1 + even);
        even = 2 * even * (even + 2);
        odd = doubled;
    }
    *cosine = 1 + even;
    *sine = odd;
}

static real stiffness(field f)
{
    return f.contact == FRONT ? p.beta_1 : f.contact == BACK ? p.beta_2 : 0;
}
static real stop(field f)
{
    return f.contact == FRONT ? p.delta_1 : f.contact == BACK ? -(real)p.delta_2 : 0;
}
static int number(field f)
{
    return 3 * ((1 + stops) * f.level + f.contact) + (f.way > 0 ? 1 : f.way < 0 ? 3 : 2);
}

/* The longest step: over it coefficient number k is at most a constant over k!. */
static real longest(field f)
{
    const double share = f.way ? 1 + 1 / p.gamma : 1, damping = 2 * share * p.zeta;
    const double rate =
        (damping + sqrt(damping * damping + 4 * share * (1 + (double)stiffness(f)))) / 2;
    return 1 / (SHORTER * (pulsed ? rate : fmax(rate, p.omega)));
}

/* Coefficients in powers of time over `step`, from the equations of motion. `constant` is 0 for differences
   of two solutions, `drive` 0 without drive, and 2 for its derivative by time. */
static void expand(field f, const real *z, real t, real step, int constant, int drive, series *s)
{
    const real kappa = stiffness(f), damping = 2 * (real)p.zeta, gamma = p.gamma, omega = p.omega;
    const real friction = f.way > 0 ? p.f_plus : f.way < 0 ? -(real)p.f_minus : 0;
    real cosine = 0, sine = 0;
    if (drive && !pulsed) {
        turn(omega * t, &cosine, &sine);
        const real turned = drive == 2 ? -omega * sine : cosine;
        sine = (drive == 2 ? omega * cosine : sine) * p.alpha;
        cosine = turned * p.alpha;
    } else if (drive == 1)
        cosine = f.level ? p.alpha_low : p.alpha;
    s->x[0] = z[0], s->v[0] = z[1], s->c[0] = z[2], s->y[0] = z[3];
    for (int k = 0; k < ORDER; k++) {
        const real one = k == 0 ? constant : 0, scale = step / (k + 1);
        const real force = s->x[k] + damping * s->v[k] + kappa * (s->x[k] - one * stop(f));
        const real q = force - (reacts ? cosine : 0);
        const real rate = f.way ? (q - one * friction) / gamma : 0;
        s->u[k] = cosine;
        s->x[k + 1] = scale * s->v[k];
        s->v[k + 1] = scale * (cosine - one * p.s - force - rate);
        s->c[k + 1] = scale * rate;
        s->y[k + 1] = scale * s->c[k];
        const real next = pulsed ? 0 : -scale * omega * sine;
        sine = scale * omega * cosine;
        cosine = next;
    }
    s->u[ORDER] = cosine;
}

static real value(const real *a, real u)
{
    real sum = a[ORDER];
    for (int k = ORDER - 1; k >= 0; k--)
        sum = sum * u + a[k];
    return sum;
}
static real slope(const real *a, real u)
{
    real sum = ORDER * a[ORDER];
    for (int k = ORDER - 1; k > 0; k--)
        sum = sum * u + k * a[k];
    return sum;
}

/* Functions that are positive within a field; `constant` as in `expand`. */
static int guards(field f, const series *s, int constant, guard *g)
{
    const real kappa = stiffness(f), damping = 2 * (real)p.zeta;
    guard *first = g;
    for (int side = FRONT; side <= stops; side++) {
        if (f.contact && f.contact != side)
            continue;
        const int sign = (side == FRONT) == (f.contact == side) ? 1 : -1;
        const real at = side == FRONT ? p.delta_1 : -(real)p.delta_2;
        g->event = side == FRONT ? 'F' : 'B';
        for (int k = 0; k <= ORDER; k++)
            g->g[k] = sign * (s->x[k] - (k ? 0 : constant * at));
        g++;
    }
    if (f.way) {
        g->event = 'V';
        for (int k = 0; k <= ORDER; k++)
            g->g[k] = f.way * s->c[k];
        return (int)(g + 1 - first);
    }
    g[0].event = 'U', g[1].event = 'L';
    for (int k = 0; k <= ORDER; k++) {
        const real gap = s->x[k] - (k ? 0 : constant * stop(f));
        const real q = s->x[k] + damping * s->v[k] + kappa * gap - (reacts ? s->u[k] : 0);
        g[0].g[k] = (k ? 0 : constant * (real)p.f_plus) - q;
        g[1].g[k] = (k ? 0 : constant * (real)p.f_minus) + q;
    }
    return (int)(g + 2 - first);
}

static real largest(const real *a)
{
    real most = 0;
    for (int k = 0; k <= ORDER; k++)
        most = larger(most, size_of(a[k]));
    return most;
}

/* Divides out the root at 0; 0 if nothing is left. `scale` is the size of the guard's terms. */
static int deflate(real *a, real scale)
{
    int first = 0;
    while (first <= ORDER && size_of(a[first]) <= ZERO * scale)
        first++;
    for (int k = 0; k <= ORDER; k++)
        a[k] = k + first <= ORDER ? a[k + first] : 0;
    return first <= ORDER;
}

/* Size of the terms that a guard adds up. */
static real terms(field f, const guard *g, const series *s)
{
    const real x = larger(largest(s->x), size_of(stop(f)));
    if (g->event == 'V')
        return larger(largest(s->c), 1e-6);
    if (g->event == 'F' || g->event == 'B')
        return larger(x, 1e-6);
    const real kappa = stiffness(f);
    return larger(larger(x * (1 + kappa), 2 * p.zeta * largest(s->v)), larger(p.f_plus, p.f_minus));
}

/* The way and contact of the one field whose own solution stays in its region; 0 if there is not one. */
static int next_field(int level, const real *z, real t, field *found)
{
    int count = 0;
    for (int contact = NONE; contact <= stops; contact++)
        for (int way = -1; way <= 1; way++) {
            const field f = {level, contact, way};
            if (z[2] != 0 && way != (z[2] > 0 ? 1 : -1))
                continue;
            series s;
            guard g[4];
            expand(f, z, t, longest(f), 1, 1, &s);
            const int n = guards(f, &s, 1, g);
            int stays = 1;
            for (int i = 0; i < n && stays; i++) {
                const int closed = g[i].event == 'V' ? 0 : g[i].event == 'U' || g[i].event == 'L' ||
                                                              contact != NONE;
                const int left = deflate(g[i].g, terms(f, &g[i], &s));
                stays = left ? g[i].g[0] > 0 : closed;
            }
            if (stays) {
                *found = f;
                count++;
            }
        }
    return count == 1;
}

/* The first root in (0, 1) of a polynomial that is positive at 0; -1 for none, -2 where undecided. */
static real first_root(const real *a)
{
    static real held[SPLITS][ORDER + 1];
    static real ends[SPLITS][2];
    real sum = 0, most = largest(a);
    for (int k = 1; k <= ORDER; k++)
        sum += size_of(a[k]);
    if (a[0] > sum)
        return -1;
    real binomial = 1;
    for (int k = 0; k <= ORDER; k++) {
        held[0][k] = a[k] / binomial;
        binomial = binomial * (ORDER - k) / (k + 1);
    }
    for (int first = 0; first < ORDER; first++)
        for (int j = ORDER; j > first; j--)
            held[0][j] += held[0][j - 1];
    ends[0][0] = 0, ends[0][1] = 1;
    for (int todo = 1, splits = 0; todo > 0;) {
        real *b = held[--todo], low = ends[todo][0], high = ends[todo][1];
        int changes = 0, sign = 0;
        for (int k = 0; k <= ORDER; k++)
            if (b[k] != 0) {
                const int own = b[k] > 0 ? 1 : -1;
                changes += sign && own != sign;
                sign = own;
            }
        if (changes == 1) {
            real u = (low + high) / 2;
            for (int i = 0; i < 400; i++) {
                const real height = value(a, u), steep = slope(a, u);
                if (height > 0)
                    low = u;
                else
                    high = u;
                real next = steep ? u - height / steep : low;
                if (!(low < next && next < high))
                    next = (low + high) / 2;
                if (size_of(next - u) <= (real)1e-33 * u || height == 0)
                    return u;
                u = next;
            }
            return u;
        }
        if (!changes)
            continue;
        if (++splits > SPLITS - 4)
            return -2;
        real row[ORDER + 1], left[ORDER + 1], right[ORDER + 1];
        memcpy(row, b, sizeof row);
        for (int n = ORDER; n >= 0; n--) {
            left[ORDER - n] = row[0], right[n] = row[n];
            for (int k = 0; k < n; k++)
                row[k] = (row[k] + row[k + 1]) / 2;
        }
        if (size_of(left[ORDER]) <= NOISE * most)
            return -2;
        const real middle = (low + high) / 2;
        memcpy(held[todo], right, sizeof right);
        ends[todo][0] = middle, ends[todo][1] = high;
        memcpy(held[todo + 1], left, sizeof left);
        ends[todo + 1][0] = low, ends[todo + 1][1] = middle;
        todo += 2;
    }
    return -1;
}
