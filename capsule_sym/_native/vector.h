/* Vectors of LANES doubles, one lane a run, and masks of lanes. Sums and products, and masks' &, |
   and ~, are the compiler's own operators. */
#include <stdint.h>

#include <immintrin.h>

#define inlined static inline __attribute__((always_inline))

#if LANES == 8

typedef __m512d vec;
typedef __mmask8 mask;

inlined vec all(double value) { return _mm512_set1_pd(value); }
inlined vec mad(vec a, vec b, vec c) { return _mm512_fmadd_pd(a, b, c); }
inlined vec choose(mask m, vec a, vec b) { return _mm512_mask_blend_pd(m, b, a); }
inlined vec size_of(vec a) { return _mm512_abs_pd(a); }
inlined vec larger(vec a, vec b) { return _mm512_max_pd(a, b); }
inlined vec smaller(vec a, vec b) { return _mm512_min_pd(a, b); }
inlined mask above(vec a, vec b) { return _mm512_cmp_pd_mask(a, b, _CMP_GT_OQ); }
inlined mask at_least(vec a, vec b) { return _mm512_cmp_pd_mask(a, b, _CMP_GE_OQ); }
inlined mask equal(vec a, vec b) { return _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ); }
inlined mask negative(vec a) { return _mm512_movepi64_mask(_mm512_castpd_si512(a)); }
inlined mask no_lanes(void) { return 0; }
inlined int bits_of(mask m) { return m; }

/* The sign of each lane turned where the integer in the lowest bits of `by` is odd. */
inlined vec turn_sign(vec a, __m512i by)
{
    return _mm512_xor_pd(a, _mm512_castsi512_pd(_mm512_slli_epi64(by, 63)));
}
typedef __m512i whole;
inlined whole bits_in(vec a) { return _mm512_castpd_si512(a); }
inlined whole half_of(whole a) { return _mm512_srli_epi64(a, 1); }
inlined whole next_to(whole a) { return _mm512_add_epi64(a, _mm512_set1_epi64(1)); }
inlined mask odd(whole a) { return _mm512_test_epi64_mask(a, _mm512_set1_epi64(1)); }

/* Eight numbers of eight runs, from rows to lanes or back. */
inlined void transpose(vec r[8])
{
    vec s[8];
    for (int i = 0; i < 8; i += 2) {
        s[i] = _mm512_unpacklo_pd(r[i], r[i + 1]);
        s[i + 1] = _mm512_unpackhi_pd(r[i], r[i + 1]);
    }
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 8; j += 4) {
            r[j + i] = _mm512_shuffle_f64x2(s[j + i], s[j + 2 + i], 0x88);
            r[j + 2 + i] = _mm512_shuffle_f64x2(s[j + i], s[j + 2 + i], 0xdd);
        }
    for (int i = 0; i < 4; i++) {
        s[i] = _mm512_shuffle_f64x2(r[i], r[i + 4], 0x88);
        s[i + 4] = _mm512_shuffle_f64x2(r[i], r[i + 4], 0xdd);
    }
    for (int i = 0; i < 8; i++)
        r[i] = s[i];
}

inlined void load_rows(const double *const row[LANES], vec out[8])
{
    for (int l = 0; l < 8; l++)
        out[l] = _mm512_loadu_pd(row[l]);
    transpose(out);
}

inlined void store_rows(double *const row[LANES], vec in[8], int kept)
{
    transpose(in);
    for (int l = 0; l < 8; l++)
        if (kept >> l & 1)
            _mm512_storeu_pd(row[l], in[l]);
}

#else

typedef __m256d vec;
typedef int64_t mask __attribute__((vector_size(32)));

inlined vec all(double value) { return _mm256_set1_pd(value); }
inlined vec mad(vec a, vec b, vec c) { return _mm256_fmadd_pd(a, b, c); }
inlined vec choose(mask m, vec a, vec b) { return _mm256_blendv_pd(b, a, (vec)m); }
inlined vec size_of(vec a) { return _mm256_andnot_pd(all(-0.0), a); }
inlined vec larger(vec a, vec b) { return _mm256_max_pd(a, b); }
inlined vec smaller(vec a, vec b) { return _mm256_min_pd(a, b); }
inlined mask above(vec a, vec b) { return (mask)_mm256_cmp_pd(a, b, _CMP_GT_OQ); }
inlined mask at_least(vec a, vec b) { return (mask)_mm256_cmp_pd(a, b, _CMP_GE_OQ); }
inlined mask equal(vec a, vec b) { return (mask)_mm256_cmp_pd(a, b, _CMP_EQ_OQ); }
inlined mask negative(vec a) { return above(all(0.0), a); }
inlined mask no_lanes(void) { return (mask){0}; }
inlined int bits_of(mask m) { return _mm256_movemask_pd((vec)m); }

typedef __m256i whole;
inlined vec turn_sign(vec a, whole by)
{
    return _mm256_xor_pd(a, _mm256_castsi256_pd(_mm256_slli_epi64(by, 63)));
}
inlined whole bits_in(vec a) { return _mm256_castpd_si256(a); }
inlined whole half_of(whole a) { return _mm256_srli_epi64(a, 1); }
inlined whole next_to(whole a) { return _mm256_add_epi64(a, _mm256_set1_epi64x(1)); }
inlined mask odd(whole a)
{
    return (mask)_mm256_sub_epi64(_mm256_setzero_si256(),
                                  _mm256_and_si256(a, _mm256_set1_epi64x(1)));
}

inlined void transpose(vec r[4])
{
    const vec a = _mm256_unpacklo_pd(r[0], r[1]), b = _mm256_unpackhi_pd(r[0], r[1]);
    const vec c = _mm256_unpacklo_pd(r[2], r[3]), d = _mm256_unpackhi_pd(r[2], r[3]);
    r[0] = _mm256_permute2f128_pd(a, c, 0x20);
    r[1] = _mm256_permute2f128_pd(b, d, 0x20);
    r[2] = _mm256_permute2f128_pd(a, c, 0x31);
    r[3] = _mm256_permute2f128_pd(b, d, 0x31);
}

inlined void load_rows(const double *const row[LANES], vec out[8])
{
    for (int half = 0; half < 8; half += 4) {
        for (int l = 0; l < 4; l++)
            out[half + l] = _mm256_loadu_pd(row[l] + half);
        transpose(out + half);
    }
}

inlined void store_rows(double *const row[LANES], vec in[8], int kept)
{
    for (int half = 0; half < 8; half += 4) {
        transpose(in + half);
        for (int l = 0; l < 4; l++)
            if (kept >> l & 1)
                _mm256_storeu_pd(row[l] + half, in[half + l]);
    }
}

#endif
