/* The step of WIDTH runs at a time that are in the same linear flow, each in its own lane. */
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__))
#ifdef __clang__
#pragma clang fp contract(fast)
#else
#pragma GCC optimize("fp-contract=fast")
#endif
#include "crew.h"
#include "step.h"

/* One number of each run. */
inlined bound load(double *const *runs, int number)
{
    bound v = {0};
    for (int l = 0; l < WIDTH; l++)
        v[l] = runs[l][number];
    return v;
}

inlined void store(double *const *runs, int kept, int number, bound v)
{
    for (int l = 0; l < WIDTH; l++)
        if (kept >> l & 1)
            runs[l][number] = v[l];
}

inlined void lanes_step(const capsule_constants *k, const table *t, int level, int drift,
                        int position, int ends, double *const *runs, capsule_outcomes *out)
{
    const bound way = load(runs, WAY), f_b = load(runs, BOUND), friction = way * f_b;
    const segment c = {load(runs, ALPHA), all(k->omega), load(runs, DELTA), all(k->zeta), all(k->beta),
                       all(k->gamma), f_b, all(k->contact), way, all(k->m), all(k->kappa),
                       friction / k->gamma, friction, all(k->sigma), all(k->K)};
    const stand s = {load(runs, X_R), load(runs, FAR), load(runs, V_R), load(runs, V_C),
                     load(runs, MARGIN), load(runs, ANGLE), load(runs, COSINE), load(runs, SINE),
                     load(runs, POSITION), load(runs, ANGLE_REST), load(runs, GAP_ZEROS),
                     load(runs, SECOND_ZEROS), load(runs, ENERGY_ERROR), load(runs, V_C_ERROR),
                     load(runs, ANGLE_ERROR)};
    stand to;
    outcome o;
    step(&c, &c, t, level, drift, position, ends, way, load(runs, LASTED), &s, &to, &o);
    out->open = bits_of(o.open);
    out->unplain = bits_of(o.unplain);
    out->crossing = bits_of(o.crossing);
    out->passed = bits_of(o.passed);
    out->contact = bits_of(t->contact ? not(o.at_gap) : o.at_gap);
    const int done = ~(out->open | out->unplain);
    const bound values[] = {[X_R] = to.x_r, [FAR] = to.gap, [V_R] = to.v_r, [V_C] = to.v_c,
                            [MARGIN] = to.margin, [ANGLE] = to.angle, [COSINE] = to.cosine,
                            [SINE] = to.sine, [ANGLE_REST] = to.angle_rest, [WAY] = o.way,
                            [GAP_ZEROS] = to.gap_zeros, [SECOND_ZEROS] = to.second_zeros,
                            [ENERGY_ERROR] = to.energy_error, [V_C_ERROR] = to.v_c_error,
                            [ANGLE_ERROR] = to.angle_error, [POSITION] = to.position,
                            [LASTED] = o.h / t->reach};
    for (int i = 0; i < (int)(sizeof values / sizeof *values); i++)
        store(runs, done, i, values[i]);
    if (ends && out->passed)
        for (int l = 0; l < WIDTH; l++) {
            double *end = out->end[l];
            end[0] = o.end.x_r[l], end[1] = o.end.gap[l], end[2] = o.end.v_r[l];
            end[3] = o.end.v_c[l], end[4] = o.end.position[l];
        }
}

void STEP(const capsule_constants *c, const capsule_table *t, int level, int position, int ends,
          double *const *runs, capsule_outcomes *out)
{
    if (c->drift == 0.0)
        lanes_step(c, t, level, 0, 0, ends, runs, out);
    else if (position)
        lanes_step(c, t, level, 1, 1, ends, runs, out);
    else
        lanes_step(c, t, level, 1, 0, ends, runs, out);
}
#endif
