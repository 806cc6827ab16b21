/* What a periodic motion is worth, its multipliers, and the bifurcations next to it. */
#include <math.h>
#include <string.h>

#include "page.h"

#define NODES 16

/* Gauss-Legendre nodes and weights on (0, 1), by Newton's method on the Legendre polynomial. */
static double node[NODES], weight[NODES];
static void make_nodes(void)
{
    for (int i = 0; i < NODES && node[NODES - 1] == 0.0; i++) {
        double x = cos(3.141592653589793 * (NODES - i - 0.25) / (NODES + 0.5)), slope = 1.0;
        for (int k = 0; k < 8; k++) {
            double p = 1.0, last = 0.0;
            for (int n = 1; n <= NODES; n++) {
                const double next = ((2 * n - 1) * x * p - (n - 1) * last) / n;
                last = p;
                p = next;
            }
            slope = NODES * (x * p - last) / (x * x - 1.0);
            x -= p / slope;
        }
        node[i] = (1.0 + x) / 2.0;
        weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
}

/* The rule has no error above rounding on panels of 12 over twice the segment's fastest rate. */
void page_energies(int first, int n, double out[3])
{
    make_nodes();
    memset(out, 0, 3 * sizeof *out);
    for (int i = first; i < first + n; i++) {
        const capsule_segment *s = &page.segments[i];
        const capsule_constants *c = &page.map.field[s->field - 1];
        const capsule_start from = {s->start[0], s->gap, s->start[1], s->start[2],
                                    s->margin, s->cosine, s->sine};
        const int panels = 1 + (int)(c->rate * s->duration / 6.0);
        const double h = s->duration / panels;
        for (int k = 0; k < panels * NODES; k++) {
            const double time = h * (k / NODES + node[k % NODES]), w = h * weight[k % NODES];
            double change[3] = {0.0, 0.0, 0.0};
            capsule_flow(c, &from, time, change);
            const double v_r = change[1], v_c = c->drift != 0.0 ? from.v_c + change[2] : 0.0;
            const double drive = c->alpha * cos(s->start_angle + c->omega * time);
            out[0] += w * drive * (v_r + v_c);
            out[1] += w * 2.0 * c->zeta * v_r * v_r;
            out[2] += w * c->f_b * fabs(v_c);
        }
    }
}

int page_cycle(void)
{
    for (size_t i = 1; i < page.count; i++)
        if (page.segments[i - 1].target)
            return i + (size_t)page.motion.switches <= page.count ? (int)i : -1;
    return -1;
}

static page_orbit orbit;

/* The orbit of the recorded motion: whether it closed, its monodromy, x_c's advance, residual, the
   first segment's number among the recorded ones, energies over the motion's period, switches. */
EXPORT(closed) int closed(void)
{
    const int first = page_cycle();
    if (first < 0 ||
        !page_orbit_from(page.segments + first, page.motion.switches, page.motion.period_number, &orbit))
        return 0;
    double energies[3];
    page_energies(first, page.motion.switches, energies);
    const int done = page_close(&orbit, given, -1);
    memcpy(numbers, orbit.monodromy, sizeof orbit.monodromy);
    numbers[9] = orbit.advance;
    numbers[10] = orbit.residual;
    numbers[11] = first;
    memcpy(numbers + 12, energies, sizeof energies);
    numbers[15] = page.motion.switches;
    return done ? 1 : -1;
}

/* The orbit that `closed` left, followed to other parameters: its monodromy; 0 where it is lost. */
EXPORT(follow) int follow(void)
{
    const int done = page_close(&orbit, given, -1);
    memcpy(numbers, orbit.monodromy, sizeof orbit.monodromy);
    return done;
}

/* The bifurcation at which segment `zero` of the orbit that `closed` left has the duration 0, by the
   parameter `free`. What is found: its value, the state, P, the fields about it, residual, steps. */
EXPORT(bifurcation) int bifurcation(int zero, int free)
{
    page_orbit event = orbit;
    double values[7];
    memcpy(values, given, sizeof values);
    event.zero = zero;
    event.h[zero] = 0.0;
    if (!page_close(&event, values, free))
        return 0;
    const int n = event.n;
    const double row[] = {values[free], event.event[0], event.event[1], event.event[2],
                          event.event_force, event.field[(zero + n - 1) % n], event.field[zero],
                          event.field[(zero + 1) % n], event.residual, event.steps};
    memcpy(numbers, row, sizeof row);
    return 1;
}

/* The orbit that `closed` left, or the one found last along its branch, with a part of its start held:
   0 to 2 the state, 3 the angle. So a branch is followed through its folds, where no parameter could
   be held. The monodromy, and the value of the parameter `free`; 0, and the orbit as it was, where it
   is lost. */
EXPORT(along) int along(int pin, double at, int free)
{
    page_orbit next = orbit;
    double values[7];
    memcpy(values, given, sizeof values);
    next.pin = pin, next.pinned = at;
    if (!page_close(&next, values, free))
        return 0;
    memcpy(given, values, sizeof values);
    next.pin = -1;
    orbit = next;
    memcpy(numbers, orbit.monodromy, sizeof orbit.monodromy);
    numbers[9] = values[free];
    return 1;
}

/* State and angle at the start of the orbit. */
EXPORT(orbit_start) void orbit_start(void)
{
    memcpy(numbers, orbit.start, sizeof orbit.start);
    numbers[3] = orbit.angle;
}

/* State and angle in the middle of the orbit's first segment, where no guard is near. */
EXPORT(orbit_within) void orbit_within(void)
{
    double at[4];
    page_within(&orbit, given, at);
    memcpy(numbers, at, sizeof at);
}

/* Durations of the orbit's segments. */
EXPORT(durations) int durations(void)
{
    memcpy(numbers, orbit.h, (size_t)orbit.n * sizeof(double));
    return orbit.n;
}
