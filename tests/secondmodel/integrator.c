/* An integrator of its own for the second model: it knows the two bodies' equations of motion and the
   law of friction, and shares no formula with the package.

       v_r' + v_c' = alpha cos(omega tau) - s - P,        P = x_r + 2 zeta v_r + beta (x_r - delta)+
       gamma v_c'  = P - f_plus forward, P + f_minus backward, 0 at rest while -f_minus <= P <= f_plus

   Taylor series of order 20 of each linear piece, in long double; events where a condition changes its
   sign, found by looking at 32 places of each step and halving. Prints the final state, the smallest
   rate at which a condition changed its sign, the modes passed: 1 forward, 2 rest, 3 backward,
   three more in contact, and the capsule's way. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef long double real;
enum { ORDER = 20, LOOKS = 32 };
typedef struct { real alpha, omega, delta, zeta, beta, gamma, s, f_plus, f_minus; } scene;
typedef struct { real x, v, c; } state;

static real pull(const scene *p, int contact, real x, real v)
{
    return x + 2 * p->zeta * v + (contact ? p->beta * (x - p->delta) : 0);
}

/* Coefficients of x and v_c in powers of the time since t. */
typedef struct { real x[ORDER + 2], c[ORDER + 1]; } series;

static series expanded(const scene *p, int contact, int way, state z, real t)
{
    series s = {{z.x, z.v}, {z.c}};
    real drive = p->alpha;
    for (int n = 0; n < ORDER; drive *= p->omega / ++n) {
        const real phase = p->omega * t + n * 1.570796326794896619231321691639751442L;
        real force = s.x[n] + 2 * p->zeta * (n + 1) * s.x[n + 1] + (contact ? p->beta * s.x[n] : 0);
        if (n == 0 && contact)
            force -= p->beta * p->delta;
        const real friction = n ? 0 : way > 0 ? p->f_plus : way < 0 ? -p->f_minus : 0;
        const real slip = way ? (force - friction) / p->gamma : 0;
        const real rate = drive * cosl(phase) - (n == 0 ? p->s : 0) - force - slip;
        s.x[n + 2] = rate / ((real)(n + 1) * (n + 2));
        if (n + 1 <= ORDER)
            s.c[n + 1] = slip / (n + 1);
    }
    return s;
}

static state at(const series *s, real h)
{
    state z = {s->x[ORDER + 1], (ORDER + 1) * s->x[ORDER + 1], s->c[ORDER]};
    for (int n = ORDER; n >= 0; n--) {
        z.x = z.x * h + s->x[n];
        if (n)
            z.v = z.v * h + n * s->x[n];
        if (n < ORDER)
            z.c = z.c * h + s->c[n];
    }
    return z;
}

/* The capsule's way. */
static real moved(const series *s, real h)
{
    real way = 0;
    for (int n = ORDER; n >= 0; n--)
        way = way * h + s->c[n] / (n + 1);
    return way * h;
}

/* What stays positive while a mode lasts. */
static real least(const scene *p, int contact, int way, state z)
{
    const real side = contact ? z.x - p->delta : p->delta - z.x, f = pull(p, contact, z.x, z.v);
    const real own = way ? way * z.c : fminl(p->f_plus - f, p->f_minus + f);
    return fminl(side, own);
}

int main(int argc, char **argv)
{
    const long periods = argc > 1 ? atol(argv[1]) : 1;
    double given[9], start[3];
    for (;;) {
        for (int i = 0; i < 9; i++)
            if (scanf("%lf", &given[i]) != 1)
                return 0;
        if (scanf("%lf %lf %lf", &start[0], &start[1], &start[2]) != 3)
            return 1;
        const scene p = {given[0], given[1], given[2], given[3], given[4],
                         given[5], given[6], given[7], given[8]};
        state z = {start[0], start[1], start[2]};
        int contact = z.x > p.delta;
        real f = pull(&p, contact, z.x, z.v), t = 0, steepest = 1e9L, advance = 0;
        int way = z.c > 0 ? 1 : z.c < 0 ? -1 : f > p.f_plus ? 1 : f < -p.f_minus ? -1 : 0;
        const real end = periods * 6.283185307179586476925286766559005768L / p.omega;
        char modes[4096];
        int count = 0;
        modes[count++] = (char)('0' + 3 * contact + (way > 0 ? 1 : way < 0 ? 3 : 2));
        while (t < end && count < 4000) {
            const real h = fminl(0.125L, end - t);
            const series s = expanded(&p, contact, way, z, t);
            real low = 0, high = 0;
            for (int i = 1; i <= LOOKS; i++) {
                const real here = h * i / LOOKS;
                if (least(&p, contact, way, at(&s, here)) < 0) {
                    high = here;
                    break;
                }
                low = here;
            }
            if (high == 0) {
                z = at(&s, h);
                advance += moved(&s, h);
                t += h;
                continue;
            }
            for (int i = 0; i < 90; i++) {
                const real middle = (low + high) / 2;
                if (least(&p, contact, way, at(&s, middle)) < 0)
                    high = middle;
                else
                    low = middle;
            }
            const real width = 1e-6L;
            const state beyond = at(&s, high + width);
            steepest = fminl(steepest, -least(&p, contact, way, beyond) / width);
            z = at(&s, high);
            advance += moved(&s, high);
            t += high;
            const real side = contact ? z.x - p.delta : p.delta - z.x;
            f = pull(&p, contact, z.x, z.v);
            const real own = way ? way * z.c : fminl(p.f_plus - f, p.f_minus + f);
            if (fabsl(side) < fabsl(own)) {
                contact = !contact;
                z.x = p.delta;
            } else if (way == 0) {
                way = f > 0 ? 1 : -1;
            } else {
                z.c = 0;
                way = f > p.f_plus ? 1 : f < -p.f_minus ? -1 : 0;
            }
            modes[count++] = (char)('0' + 3 * contact + (way > 0 ? 1 : way < 0 ? 3 : 2));
        }
        modes[count] = 0;
        printf("%.18Lg %.18Lg %.18Lg %.3Lg %s %.18Lg\n", z.x, z.v, z.c, steepest, modes, advance);
    }
}
