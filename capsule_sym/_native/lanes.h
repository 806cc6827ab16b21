/* The step of WIDTH runs at a time that are in the same linear flow, each in its own lane. */
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__))
CONTRACTED
#include "batch.h"
#include "step.h"

#if defined(__AVX__) && WIDTH == 4
inlined void transpose(const bound *r, bound *v)
{
    const bound a = _mm256_unpacklo_pd(r[0], r[1]), b = _mm256_unpackhi_pd(r[0], r[1]);
    const bound c = _mm256_unpacklo_pd(r[2], r[3]), d = _mm256_unpackhi_pd(r[2], r[3]);
    v[0] = _mm256_permute2f128_pd(a, c, 0x20);
    v[1] = _mm256_permute2f128_pd(b, d, 0x20);
    v[2] = _mm256_permute2f128_pd(a, c, 0x31);
    v[3] = _mm256_permute2f128_pd(b, d, 0x31);
}
#endif

/* The numbers of each run, from rows to lanes. */
inlined void load(double *const *runs, bound *v)
{
#if defined(__AVX__) && WIDTH == 4
    for (int i = 0; i < CAPSULE_RUN_NUMBERS; i += 4) {
        const bound rows[4] = {_mm256_loadu_pd(runs[0] + i), _mm256_loadu_pd(runs[1] + i),
                               _mm256_loadu_pd(runs[2] + i), _mm256_loadu_pd(runs[3] + i)};
        transpose(rows, v + i);
    }
#else
    for (int i = 0; i < CAPSULE_RUN_NUMBERS; i++)
        for (int l = 0; l < WIDTH; l++)
            v[i][l] = runs[l][i];
#endif
}

/* And back, of some lanes. */
inlined void store(const bound *v, int some_lanes, double *const *runs)
{
#if defined(__AVX__) && WIDTH == 4
    for (int i = 0; i < CAPSULE_RUN_NUMBERS; i += 4) {
        bound rows[4];
        transpose(v + i, rows);
        for (int l = 0; l < 4; l++)
            if (some_lanes >> l & 1)
                _mm256_storeu_pd(runs[l] + i, rows[l]);
    }
#else
    for (int l = 0; l < WIDTH; l++)
        if (some_lanes >> l & 1)
            for (int i = 0; i < CAPSULE_RUN_NUMBERS; i++)
                runs[l][i] = v[i][l];
#endif
}

inlined void lanes_step(const capsule_constants *k, const table *t, int level, int drift,
                        int position, int ends, double *const *runs, capsule_outcomes *out)
{
    bound v[CAPSULE_RUN_NUMBERS];
    load(runs, v);
    const bound way = v[WAY];
#define OF_FLOW(name) .name = all(k->name),
#define OF_RUN(name) .name = v[RUN_##name],
    segment c = {CAPSULE_FLOW_PARAMETERS(OF_FLOW) CAPSULE_RUN_PARAMETERS(OF_RUN)
                 .contact = all(k->contact), .drift = way, .m = all(k->m), .kappa = all(k->kappa),
                 .sigma = all(k->sigma), .K = all(k->K)};
    c.push = push_at(&c, way), c.friction = friction_at(&c, way);
    const point s = {v[X_R], v[FAR], v[V_R], v[V_C], v[MARGIN], v[ANGLE], v[COSINE], v[SINE],
                     v[POSITION], v[ANGLE_REST], v[GAP_ZEROS], v[SECOND_ZEROS], v[ENERGY_ERROR],
                     v[V_C_ERROR], v[ANGLE_ERROR]};
    point to;
    outcome o;
    step(&c, &c, t, level, drift, position, ends, way, v[LASTED], &s, &to, &o);
    out->open = bits_of(o.open);
    out->undetermined = bits_of(o.undetermined);
    out->crossing = bits_of(o.crossing);
    out->passed = bits_of(o.passed);
    out->contact = bits_of(t->contact ? not(o.at_gap) : o.at_gap);
    const int done = ~(out->open | out->undetermined);
    v[X_R] = to.x_r, v[FAR] = to.gap, v[V_R] = to.v_r, v[V_C] = to.v_c, v[MARGIN] = to.margin;
    v[ANGLE] = to.angle, v[COSINE] = to.cosine, v[SINE] = to.sine, v[ANGLE_REST] = to.angle_rest;
    v[WAY] = o.way, v[GAP_ZEROS] = to.gap_zeros, v[SECOND_ZEROS] = to.second_zeros;
    v[ENERGY_ERROR] = to.energy_error, v[V_C_ERROR] = to.v_c_error;
    v[ANGLE_ERROR] = to.angle_error, v[POSITION] = to.position, v[LASTED] = o.h * t->per_reach;
    store(v, done, runs);
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
#else
typedef int capsule_no_lanes;
#endif
