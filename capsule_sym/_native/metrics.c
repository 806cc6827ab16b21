/* Metrics of a periodic orbit: progression, work and losses, peak forces; and their derivatives.

   The damper's loss is an integral of products of closed forms, entire functions of known exponential type:
   Gauss-Legendre quadrature on panels short compared with that type has no error above rounding. It is a
   sum of squares, and the friction loss a sum of distances, so their sum loses no digits. Over a closed
   orbit it equals the drive's work, by the energy balance. */
#include <math.h>
#include <string.h>

#include "chain.h"
#include "orbit.h"

/* Rules of n nodes, symmetric, for panels h of functions of exponential type lambda. Their error on
   e^(lambda t) is (lambda h)^(2n) (n!)^4/((2n + 1) (2n)!^3) of the integral: below 2e-18 up to the
   reach of each. */
enum { MOST_NODES = 16, RULES = 4 };
static const struct {
    int half; /* of the nodes */
    double reach, pair[MOST_NODES / 2][2]; /* node on (0, 1), and weight */
} RULE[RULES] = {
    {4, 2.0, {{0.1834346424956498, 0.362683783378362}, {0.525532409916329, 0.31370664587788727},
               {0.7966664774136267, 0.22238103445337448},
               {0.9602898564975363, 0.10122853629037626}}},
    {5, 4.0, {{0.14887433898163122, 0.29552422471475287}, {0.4333953941292472, 0.26926671930999635},
               {0.6794095682990244, 0.21908636251598204}, {0.8650633666889845, 0.1494513491505806},
               {0.9739065285171717, 0.06667134430868814}}},
    {6, 7.0, {{0.1252334085114689, 0.24914704581340277}, {0.3678314989981802, 0.2334925365383548},
               {0.5873179542866175, 0.20316742672306592}, {0.7699026741943047, 0.16007832854334622},
               {0.9041172563704749, 0.10693932599531843},
               {0.9815606342467192, 0.04717533638651183}}},
    {8, 12.0, {{0.09501250983763744, 0.1894506104550685}, {0.2816035507792589, 0.18260341504492358},
                {0.45801677765722737, 0.16915651939500254},
                {0.6178762444026438, 0.14959598881657674}, {0.755404408355003, 0.12462897125553388},
                {0.8656312023878318, 0.09515851168249279},
                {0.9445750230732326, 0.062253523938647894},
                {0.9894009349916499, 0.027152459411754096}}}};

enum { VELOCITY, PROGRESSION, WORK, DAMPER, FRICTION, PEAK_FORCE, PEAKS = METRICS - PEAK_FORCE };

/* Quantities of the peak metrics: the force between the bodies, and the second spring's force by the gap. */
static const capsule_quantity PEAKED[PEAKS] = {CAPSULE_FORCE, CAPSULE_GAP};

/* Adds the damper's loss in a segment, the drive's work if requested, and the integral of the loss's
   derivatives at fixed times: those with respect to its ends cancel from segment to segment. */
static capsule_stop add_loss(const capsule_closed_run *run, const capsule_segment *s, double start,
                             const capsule_orbit_request *request, capsule_slopes *at, double *loss,
                             double *work, double slopes[SLOPES])
{
    const capsule_constants *c = &run->map->field[s->field - 1];
    const double type = 2.0 * c->rate * s->duration;
    int rule = 0;
    while (rule < RULES - 1 && type > RULE[rule].reach)
        rule++;
    const double panels = fmax(1.0, ceil(type / RULE[rule].reach));
    const double width = 0.5 * s->duration / panels;
    const int half = RULE[rule].half, nodes = 2 * half;
    if (!(panels <= MOST_STRETCHES))
        return CAPSULE_OPEN;
    for (double panel = 0.0; panel < panels; panel++) {
        double times[MOST_NODES], states[MOST_NODES][4], by[MOST_NODES][4][COLUMNS_AT];
        const double centre = start + (2.0 * panel + 1.0) * width;
        for (int i = 0; i < half; i++) {
            times[half - 1 - i] = centre - width * RULE[rule].pair[i][0];
            times[half + i] = centre + width * RULE[rule].pair[i][0];
        }
        if (capsule_code_here(0)->states_at(run->map, s, 1, 0, 0, times, (size_t)nodes, states,
                                            request->watch) < (size_t)nodes)
            return CAPSULE_STOPPED;
        if (request->gradients && !capsule_differentiate(run->map, s, 1, at, NULL, times,
                                                         (size_t)nodes, by, request->watch))
            return CAPSULE_STOPPED;
        for (int n = 0; n < nodes; n++) {
            const double v_r = states[n][1];
            double gradient[SLOPES], row[SLOPES];
            const double weight = width * RULE[rule].pair[n < half ? half - 1 - n : n - half][1];
            *loss += weight * damper_power(c, v_r);
            if (work) {
                const double angle = s->start_angle + c->omega * (times[n] - start);
                *work += weight * drive_power(c, cos(angle), v_r, states[n][2]);
            }
            if (!request->gradients)
                continue;
            damper_power_gradient(c, v_r, gradient);
            chain_gradient(gradient, by[n][0], COLUMNS_AT, SLOPES, row);
            for (int k = 0; k < SLOPES; k++)
                slopes[k] += weight * row[k];
        }
    }
    return CAPSULE_DONE;
}

/* Derivatives of a peak in this segment; a peak at the segment's end moves with it. */
static void add_peak(const capsule_closed_run *run, const capsule_segment *s, double start,
                     capsule_quantity quantity, const capsule_peak *peak, capsule_slopes *at,
                     const double ends[SLOPES], double slopes[SLOPES])
{
    const capsule_constants *c = &run->map->field[s->field - 1];
    const double time = start + peak->after, still[SLOPES] = {0.0};
    double by[4][COLUMNS_AT], rows[STATES][SLOPES], gradient[SLOPES];
    capsule_differentiate(run->map, s, 1, at, NULL, &time, 1, &by, NULL);
    for (int row = 0; row < STATES; row++)
        chain_moved(by[row], peak->at_end ? ends : still, rows[row]);
    if (quantity == CAPSULE_FORCE)
        force_gradient(c, peak->gap, peak->v_r, gradient);
    else
        contact_gradient(c, peak->gap, gradient);
    chain_gradient(gradient, rows[0], SLOPES, SLOPES, slopes);
    if ((quantity == CAPSULE_FORCE ? force(c, peak->x_r, peak->gap, peak->v_r) : peak->gap) < 0.0)
        for (int k = 0; k < SLOPES; k++)
            slopes[k] = -slopes[k];
}

/* Derivatives of x_c at a segment's end, and of its time. */
static void pass_segment(const capsule_closed_run *run, size_t i, capsule_slopes *at,
                         double advance_by[SLOPES])
{
    const capsule_segment *s = &run->segments[i];
    if (i + 1 < run->count) {
        capsule_differentiate(run->map, s, 2, at, NULL, NULL, 0, NULL, NULL);
        memcpy(advance_by, at->state[3], sizeof at->state[3]);
        return;
    }
    double by[4][COLUMNS_AT];
    capsule_differentiate(run->map, s, 1, at, NULL, &run->end, 1, &by, NULL);
    memset(at->time, 0, sizeof at->time);
    at->time[PARAMETER + OMEGA_AT] = run->end_by_omega;
    chain_moved(by[STATES], at->time, advance_by);
}

capsule_stop capsule_metrics(const capsule_closed_run *run, const capsule_orbit_request *request,
                             capsule_orbit *orbit, double slopes[METRICS][SLOPES])
{
    const capsule_parameters *p = &run->map->parameters;
    const double lift = lift_force(run->map->field), per_period = 1.0 / run->periods, per_turn = p->omega / TWO_PI;
    double by[SLOPES], slip[SLOPES] = {0.0}; /* of friction by parameters, and times the advance */
    double advance = 0.0, loss = 0.0, lost = 0.0, before[SLOPES] = {0.0};
    capsule_peak peak[PEAKS];
    capsule_slopes at;
    capsule_stop stop = CAPSULE_DONE;
    for (int k = 0; request->forces && k < PEAKS && !stop; k++)
        stop = capsule_find_peak(run, PEAKED[k], request->watch, &peak[k]);
    if (stop != CAPSULE_DONE)
        return stop;
    memset(slopes, 0, METRICS * sizeof *slopes);
    capsule_slopes_of_run(run, &at);
    for (size_t i = 0; i < run->count; i++) {
        const capsule_segment *s = &run->segments[i];
        const double start = ((double)s->start_period * TWO_PI + s->start_angle) / p->omega;
        const double way = DRIFT_OF[s->field - 1];
        const double friction = loss_at(&run->map->field[s->field - 1], way);
        advance += s->advance;
        loss_gradient(&run->map->field[s->field - 1], way, by);
        for (int k = PARAMETER; k < SLOPES; k++)
            slip[k] += by[k] * s->advance;
        lost += friction * s->advance;
        if (request->energies)
            stop = add_loss(run, s, start, request, &at, &loss, NULL, slopes[DAMPER]);
        if (stop != CAPSULE_DONE)
            return stop;
        if (!request->gradients)
            continue;
        capsule_slopes here = at;
        double after[SLOPES];
        pass_segment(run, i, &at, after);
        for (int k = 0; k < SLOPES; k++)
            slopes[FRICTION][k] += friction * (after[k] - before[k]);
        memcpy(before, after, sizeof before);
        for (int k = 0; request->forces && k < PEAKS; k++)
            if (peak[k].size != 0.0 && peak[k].segment == i)
                add_peak(run, s, start, PEAKED[k], &peak[k], &here, at.time, slopes[PEAK_FORCE + k]);
    }
    orbit->progression = advance * per_period;
    orbit->velocity = orbit->progression * per_turn;
    if (request->energies) {
        orbit->damper_loss = loss * per_period;
        orbit->friction_loss = lost * per_period;
        orbit->work = orbit->damper_loss + orbit->friction_loss + lift * orbit->progression;
    }
    if (request->forces) {
        orbit->peak_force = peak[0].size;
        const int field = run->segments[peak[1].segment].field;
        orbit->peak_contact =
            TWO_STOPS ? peak[1].size : force(&run->map->field[field - 1], 0.0, peak[1].size, 0.0);
    }
    if (!request->gradients)
        return CAPSULE_DONE;
    const capsule_segment *last = &run->segments[run->count - 1];
    const double power = damper_power(&run->map->field[last->field - 1], last->end[1]);
    slopes[DAMPER][PARAMETER + OMEGA_AT] += power * run->end_by_omega;
    for (int k = 0; k < SLOPES; k++) {
        slopes[PROGRESSION][k] = before[k] * per_period;
        slopes[VELOCITY][k] = slopes[PROGRESSION][k] * per_turn;
        slopes[DAMPER][k] *= per_period;
        slopes[FRICTION][k] *= per_period;
    }
    slopes[VELOCITY][PARAMETER + OMEGA_AT] += orbit->progression / TWO_PI;
    for (int k = PARAMETER; k < SLOPES; k++)
        slopes[FRICTION][k] += slip[k] * per_period;
    lift_force_gradient(run->map->field, by);
    for (int k = 0; k < SLOPES; k++)
        slopes[WORK][k] = slopes[DAMPER][k] + slopes[FRICTION][k] + lift * slopes[PROGRESSION][k] +
                          by[k] * orbit->progression;
    for (int m = WORK; m < METRICS; m++)
        if (m < PEAK_FORCE ? !request->energies : !request->forces)
            for (int k = 0; k < SLOPES; k++)
                slopes[m][k] = NAN;
    return CAPSULE_DONE;
}

capsule_stop capsule_add_energies(const capsule_map *map, const capsule_segment *segments, size_t count,
                                  capsule_watch *watch, double energies[3])
{
    const capsule_closed_run run = {.map = map, .segments = segments, .count = count};
    const capsule_orbit_request request = {.watch = watch};
    capsule_stop stop = CAPSULE_DONE;
    if (!map || !segments || !energies)
        return CAPSULE_REFUSED;
    for (size_t i = 0; i < count && stop == CAPSULE_DONE; i++) {
        const capsule_segment *s = &segments[i];
        if (s->field < 1 || s->field > CAPSULE_FIELD_COUNT)
            return CAPSULE_REFUSED;
        const capsule_constants *c = &map->field[s->field - 1];
        const double start = ((double)s->start_period * TWO_PI + s->start_angle) / c->omega;
        energies[2] += loss_at(c, DRIFT_OF[s->field - 1]) * s->advance;
        stop = add_loss(&run, s, start, &request, NULL, &energies[1], &energies[0], NULL);
    }
    return stop;
}
