/* Step of WIDTH runs at a time in the same linear flow, each in its own lane. */
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__))
#define FUSED 1
#include "batch.h"
#include "step.h"

#if defined(__AVX__) && WIDTH == 4
#define TRANSPOSED 1
typedef __m256d quads; /* four numbers of a run */
inlined quads row_of(double *const *runs, int l, int i) { return _mm256_loadu_pd(runs[l] + i); }
inlined void put(double *const *runs, int some_lanes, int l, int i, quads v)
{
    if (some_lanes >> l & 1)
        _mm256_storeu_pd(runs[l] + i, v);
}
#define JOINED(a, b, halves) _mm256_permute2f128_pd(a, b, halves ? 0x31 : 0x20)
#define LOW(a, b) _mm256_unpacklo_pd(a, b)
#define HIGH_OF(a, b) _mm256_unpackhi_pd(a, b)
#elif defined(__AVX512DQ__) && WIDTH == 8
#define TRANSPOSED 1
typedef __m512d quads; /* four numbers of a run, and of that four lanes on */
inlined quads row_of(double *const *runs, int l, int i)
{
    return _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(runs[l] + i)),
                              _mm256_loadu_pd(runs[l + 4] + i), 1);
}
inlined void put(double *const *runs, int some_lanes, int l, int i, quads v)
{
    if (some_lanes >> l & 1)
        _mm256_storeu_pd(runs[l] + i, _mm512_castpd512_pd256(v));
    if (some_lanes >> (l + 4) & 1)
        _mm256_storeu_pd(runs[l + 4] + i, _mm512_extractf64x4_pd(v, 1));
}
#define JOINED(a, b, halves)                                                                       \
    _mm512_permutex2var_pd(a, halves ? _mm512_set_epi64(15, 14, 7, 6, 11, 10, 3, 2)                \
                                     : _mm512_set_epi64(13, 12, 5, 4, 9, 8, 1, 0), b)
#define LOW(a, b) _mm512_unpacklo_pd(a, b)
#define HIGH_OF(a, b) _mm512_unpackhi_pd(a, b)
#else
#define TRANSPOSED 0
#endif

#if TRANSPOSED
/* Rows of four lanes to lanes of four rows, and back. */
inlined void transpose(const quads *r, quads *v)
{
    const quads a = LOW(r[0], r[1]), b = HIGH_OF(r[0], r[1]);
    const quads c = LOW(r[2], r[3]), d = HIGH_OF(r[2], r[3]);
    v[0] = JOINED(a, c, 0);
    v[1] = JOINED(b, d, 0);
    v[2] = JOINED(a, c, 1);
    v[3] = JOINED(b, d, 1);
}
#endif

/* The numbers of each run, from rows to lanes. */
inlined void load(double *const *runs, bound *v)
{
#if TRANSPOSED
    for (int i = 0; i < CAPSULE_RUN_NUMBERS; i += 4) {
        const quads rows[4] = {row_of(runs, 0, i), row_of(runs, 1, i), row_of(runs, 2, i),
                               row_of(runs, 3, i)};
        transpose(rows, (quads *)v + i);
    }
#else
    for (int i = 0; i < CAPSULE_RUN_NUMBERS; i++)
        for (int l = 0; l < WIDTH; l++)
            v[i][l] = runs[l][i];
#endif
}

/* And back, for some lanes. */
inlined void store(const bound *v, int some_lanes, double *const *runs)
{
#if TRANSPOSED
    for (int i = 0; i < CAPSULE_RUN_NUMBERS; i += 4) {
        quads rows[4];
        transpose((const quads *)v + i, rows);
        for (int l = 0; l < 4; l++)
            put(runs, some_lanes, l, i, rows[l]);
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
#if CAPSULE_PULSED
                 .high = v[HIGH],
#endif
                 .contact = all(k->contact), .drift = way, .m = all(k->m), .kappa = all(k->kappa),
                 .sigma = all(k->sigma), .K = all(k->K)};
#if TWO_STOPS
    c.CAPSULE_OWN_STOP = t->contact == 2 ? -c.CAPSULE_BACK_GAP : c.CAPSULE_FRONT_GAP;
#endif
    c.push = push_at(&c, way), c.friction = friction_at(&c, way);
    const point s = {.x_r = v[X_R], .gap = v[FAR], .v_r = v[V_R], .v_c = v[V_C], .margin = v[MARGIN],
#if !CAPSULE_PULSED
                     .cosine = v[COSINE], .sine = v[SINE],
#endif
#if TWO_STOPS
                     .other = v[OTHER],
#endif
                     .angle = v[ANGLE], .angle_rest = v[ANGLE_REST], .position = v[POSITION],
                     .gap_zeros = v[GAP_ZEROS], .second_zeros = v[SECOND_ZEROS],
                     .energy_error = v[ENERGY_ERROR], .v_c_error = v[V_C_ERROR],
                     .angle_error = v[ANGLE_ERROR]};
    point to;
    outcome o;
    step(&c, &c, t, level, drift, position, ends, way, v[LASTED], &s, &to, &o);
    out->open = bits_of(o.open);
    out->undetermined = bits_of(o.undetermined);
    out->crossing = bits_of(o.crossing);
    out->passed = bits_of(o.passed);
    out->contact = bits_of(t->contact ? not(o.at_gap) : o.at_gap);
    out->edge = bits_of(o.edge);
    const int done = ~(out->open | out->undetermined);
    v[X_R] = to.x_r, v[FAR] = to.gap, v[V_R] = to.v_r, v[V_C] = to.v_c, v[MARGIN] = to.margin;
    v[ANGLE] = to.angle, v[ANGLE_REST] = to.angle_rest;
#if CAPSULE_PULSED
    v[HIGH] = pick(o.edge, 1.0 - v[HIGH], v[HIGH]);
#else
    v[COSINE] = to.cosine, v[SINE] = to.sine;
#endif
    v[WAY] = o.way, v[GAP_ZEROS] = to.gap_zeros, v[SECOND_ZEROS] = to.second_zeros;
    v[ENERGY_ERROR] = to.energy_error, v[V_C_ERROR] = to.v_c_error;
    v[ANGLE_ERROR] = to.angle_error, v[POSITION] = to.position, v[LASTED] = o.h * t->per_reach;
#if TWO_STOPS
    out->behind = bits_of(t->contact == 2 ? not(o.at_gap) : o.at_back);
    v[OTHER] = to.other;
#endif
    store(v, done, runs);
    if (ends && out->passed)
        for (int l = 0; l < WIDTH; l++) {
            double *end = out->end[l];
            end[0] = o.end.x_r[l], end[1] = o.end.gap[l], end[2] = o.end.v_r[l];
            end[3] = o.end.v_c[l], end[4] = o.end.position[l];
#if TWO_STOPS
            end[5] = o.end.other[l];
#endif
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
