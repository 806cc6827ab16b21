/* The number type of the code after it: one double, WIDTH of them side by side, one run in each lane, or
   with WIDE a double-double, whose 106 bits decide switches that double precision cannot.

   A `real` is a value, a `bound` measures errors (a double for each lane), an `entry` is an entry of a
   table, and a `mask` a truth value for each lane. Bounds have the compiler's own arithmetic operators,
   masks & and |; bounds are compared by gt, ge, lt, le, eq and ne. */
#ifndef CAPSULE_NUMBER_H
#define CAPSULE_NUMBER_H

#include <math.h>
#include <stdint.h>

#include "internal.h"

#ifdef __clang__ /* masks have lanes, so `|` of two is not meant as `||` */
#pragma clang diagnostic ignored "-Wunknown-warning-option"
#pragma clang diagnostic ignored "-Wbitwise-instead-of-logical"
#endif

/* `fused` and `mad` are a b + c: one rounding with FUSED, for processors with such an instruction, and two
   without. The compiler fuses nothing by itself, so runs of each kind have the same bits. */
#ifndef FUSED
#define FUSED 0
#endif
#ifndef WIDTH
#define WIDTH 1
#endif

#define TWO_PI 6.283185307179586
#define TWO_PI_REST 2.4492935982947064e-16
#define TWO_PI_LAST -5.989539619436679e-33
#define UNDERFLOW 1e-290 /* above all errors below the normal range */

#if defined(WIDE) && defined(__GNUC__)
#define inlined static inline __attribute__((unused)) /* fast enough, and compiled soon */
#elif defined(__GNUC__)
#define inlined static inline __attribute__((always_inline, unused))
#else
#define inlined static inline
#endif

#if WIDTH == 1
typedef double bound;
typedef int mask;
#define all(a) ((double)(a))
#if FUSED
#define fused(a, b, c) __builtin_fma(a, b, c)
#else
#define fused(a, b, c) ((a) * (b) + (c))
#endif
#define some(m) (m)
#define bits_of(m) (m)
#define not(m) (!(m))
#define none 0
#define gt(a, b) ((a) > (b))
#define ge(a, b) ((a) >= (b))
#define lt(a, b) ((a) < (b))
#define le(a, b) ((a) <= (b))
#define eq(a, b) ((a) == (b))
#define ne(a, b) ((a) != (b))
inlined bound pick(mask m, bound a, bound b) { return m ? a : b; }
inlined bound size_of(bound a) { return fabs(a); }
inlined bound larger(bound a, bound b) { return a > b ? a : b; }
inlined bound smaller(bound a, bound b) { return a < b ? a : b; }
#else
typedef double bound __attribute__((vector_size(8 * WIDTH)));
typedef int64_t whole_lanes __attribute__((vector_size(8 * WIDTH)));
#define all(a) ((double)(a) - (bound){0})
#ifdef __AVX__
#include <immintrin.h>
#endif
inlined bound size_of(bound a) { return (bound)((whole_lanes)a & INT64_MAX); }
#if defined(__AVX512F__) && WIDTH == 8
inlined bound fused(bound a, bound b, bound c) { return _mm512_fmadd_pd(a, b, c); }
#elif defined(__FMA__) && WIDTH == 4
inlined bound fused(bound a, bound b, bound c) { return _mm256_fmadd_pd(a, b, c); }
#else
inlined bound fused(bound a, bound b, bound c)
{
    bound sum;
    for (int l = 0; l < WIDTH; l++)
        sum[l] = __builtin_fma(a[l], b[l], c[l]);
    return sum;
}
#endif
#if defined(__AVX512DQ__) && WIDTH == 8
/* A bit for each lane: these processors compare into registers of their own. */
typedef __mmask8 mask;
#define not(m) ((mask)~(m))
#define none ((mask)0)
#define gt(a, b) _mm512_cmp_pd_mask(a, b, _CMP_GT_OQ)
#define ge(a, b) _mm512_cmp_pd_mask(a, b, _CMP_GE_OQ)
#define lt(a, b) _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ)
#define le(a, b) _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ)
#define eq(a, b) _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ)
#define ne(a, b) _mm512_cmp_pd_mask(a, b, _CMP_NEQ_UQ)
inlined bound pick(mask m, bound a, bound b) { return _mm512_mask_blend_pd(m, b, a); }
inlined bound larger(bound a, bound b) { return _mm512_max_pd(a, b); }
inlined bound smaller(bound a, bound b) { return _mm512_min_pd(a, b); }
inlined int bits_of(mask m) { return m; }
#else
typedef whole_lanes mask;
#define not(m) (~(m))
#define none ((mask){0})
#define gt(a, b) ((a) > (b))
#define ge(a, b) ((a) >= (b))
#define lt(a, b) ((a) < (b))
#define le(a, b) ((a) <= (b))
#define eq(a, b) ((a) == (b))
#define ne(a, b) ((a) != (b))
#if defined(__AVX__) && WIDTH == 4
inlined bound pick(mask m, bound a, bound b) { return _mm256_blendv_pd(b, a, (bound)m); }
inlined bound larger(bound a, bound b) { return _mm256_max_pd(a, b); }
inlined bound smaller(bound a, bound b) { return _mm256_min_pd(a, b); }
inlined int bits_of(mask m) { return _mm256_movemask_pd((bound)m); }
#else
inlined bound pick(mask m, bound a, bound b)
{
    return (bound)((m & (mask)a) | (~m & (mask)b));
}
inlined bound larger(bound a, bound b) { return pick(a > b, a, b); }
inlined bound smaller(bound a, bound b) { return pick(a < b, a, b); }
inlined int bits_of(mask m)
{
    int bits = 0;
    for (int l = 0; l < WIDTH; l++)
        bits |= (int)(m[l] & 1) << l;
    return bits;
}
#endif
#endif
inlined int some(mask m) { return bits_of(m) != 0; }
#endif

/* 1/n, of n up to 30, as the sum of two doubles. */
inlined capsule_wide_number reciprocal(int n)
{
    static const capsule_wide_number OF[] = {{0.0, 0.0},
        {1.0 / 1, 0.0}, {1.0 / 2, 0.0}, {1.0 / 3, 1.850371707708594e-17}, {1.0 / 4, 0.0},
        {1.0 / 5, -1.1102230246251566e-17}, {1.0 / 6, 9.25185853854297e-18},
        {1.0 / 7, 7.93016446160826e-18}, {1.0 / 8, 0.0}, {1.0 / 9, 6.1679056923619804e-18},
        {1.0 / 10, -5.551115123125783e-18}, {1.0 / 11, -2.523234146875356e-18},
        {1.0 / 12, 4.625929269271485e-18}, {1.0 / 13, -4.270088556250602e-18},
        {1.0 / 14, 3.96508223080413e-18}, {1.0 / 15, 9.251858538542971e-19}, {1.0 / 16, 0.0},
        {1.0 / 17, 8.163404592832033e-19}, {1.0 / 18, 3.0839528461809902e-18},
        {1.0 / 19, 2.921639538487254e-18}, {1.0 / 20, -2.7755575615628915e-18},
        {1.0 / 21, 2.64338815386942e-18}, {1.0 / 22, -1.261617073437678e-18},
        {1.0 / 23, 1.206764157201257e-18}, {1.0 / 24, 2.3129646346357427e-18},
        {1.0 / 25, -8.326672684688674e-19}, {1.0 / 26, -2.135044278125301e-18},
        {1.0 / 27, 2.05596856412066e-18}, {1.0 / 28, 1.982541115402065e-18},
        {1.0 / 29, 4.785444071660157e-19}, {1.0 / 30, 4.625929269271486e-19}};
    return OF[n];
}

#ifndef WIDE
#define UNIT 0x1p-53 /* unit roundoff */
#define ROOT_UNIT 0x1p-26
#define TERMS CAPSULE_TERMS
#define DEGREE CAPSULE_DEGREE
#define LEVELS CAPSULE_LEVELS
typedef bound real;
typedef double entry;
#define num(a) all(a)
#define wide(a) (a)
#define near_to(a) (a)
#define add(a, b) ((a) + (b))
#define sub(a, b) ((a) - (b))
#define mul(a, b) ((a) * (b))
#define mad fused
#define over(a, b) ((a) / (b))
#define part(a, n) ((a) * reciprocal(n).hi)
#define mean(a, b) (0.5 * ((a) + (b)))
#define neg(a) (-(a))
#define choose pick
#define row(e) all(e)
#else
#define UNIT 0x1p-102 /* bounds the error of a few operations below */
#define ROOT_UNIT 0x1p-51
#define TERMS CAPSULE_WIDE_TERMS
#define DEGREE (TERMS + 1) /* of a guard: v_c has a term more than x_r */
#define LEVELS 1
typedef capsule_wide_number real;
typedef real entry;
inlined real whole_sum(double a, double b)
{
    const double s = a + b, by = s - a;
    return (real){s, (a - (s - by)) + (b - by)};
}
inlined real near_sum(double a, double b) /* |a| >= |b| */
{
    const double s = a + b;
    return (real){s, b - (s - a)};
}
inlined real whole_product(double a, double b)
{
#if defined(__FMA__) || defined(__aarch64__)
    const double p = a * b;
    return (real){p, fma(a, b, -p)};
#else
    const double p = a * b, ca = 134217729.0 * a, cb = 134217729.0 * b;
    const double ah = ca - (ca - a), bh = cb - (cb - b), al = a - ah, bl = b - bh;
    return (real){p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
#endif
}
inlined real num(double a) { return (real){a, 0.0}; }
#define wide(a) num(a)
inlined double near_to(real a) { return a.hi; }
inlined real add(real a, real b)
{
    real s = whole_sum(a.hi, b.hi), t = whole_sum(a.lo, b.lo);
    s = near_sum(s.hi, s.lo + t.hi);
    return near_sum(s.hi, s.lo + t.lo);
}
inlined real neg(real a) { return (real){-a.hi, -a.lo}; }
inlined real sub(real a, real b) { return add(a, neg(b)); }
inlined real mul(real a, real b)
{
    const real p = whole_product(a.hi, b.hi);
    return near_sum(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}
inlined real mad(real a, real b, real c) { return add(mul(a, b), c); }
inlined real over(real a, real b)
{
    const double q = a.hi / b.hi;
    real r = sub(a, mul(b, num(q)));
    const double q2 = r.hi / b.hi;
    r = sub(r, mul(b, num(q2)));
    return add(near_sum(q, q2), num(r.hi / b.hi));
}
#define part(a, n) mul(a, reciprocal(n))
inlined real mean(real a, real b) /* within UNIT of the larger */
{
    const real s = whole_sum(a.hi, b.hi), t = near_sum(s.hi, s.lo + (a.lo + b.lo));
    return (real){0.5 * t.hi, 0.5 * t.lo};
}
inlined real choose(mask m, real a, real b) { return m ? a : b; }
#define row(e) (e)
#endif

#ifdef WIDE
typedef capsule_wide_table table;
#else
typedef capsule_table table;
#endif

/* A segment's constants as values, and as bounds. */
#define REAL_MEMBER(name) real name;
#define BOUND_MEMBER(name) bound name;
#define HIGH(name) .name = c->name.hi,
#if WIDTH == 1 && !defined(WIDE)
typedef capsule_constants segment;
#else
typedef struct {
    CAPSULE_SEGMENT_CONSTANTS(REAL_MEMBER)
} segment;
#endif
#ifdef WIDE
typedef struct {
    CAPSULE_SEGMENT_CONSTANTS(BOUND_MEMBER)
} segment_sizes;
inlined const segment_sizes *sizes_of(const segment *c, segment_sizes *room)
{
    *room = (segment_sizes){CAPSULE_SEGMENT_CONSTANTS(HIGH)};
    return room;
}
#else
typedef segment segment_sizes;
inlined const segment_sizes *sizes_of(const segment *c, segment_sizes *room)
{
    (void)room;
    return c;
}
#endif

/* Bounds per unit of each response: the error of x_r (rounding and remainder), and of P or v_c; the
   remainder of their forms, over s^3; the largest of each form; and second derivatives. */
enum {
    X_ERROR, SECOND_ERROR, X_TAIL, SECOND_TAIL, X_RANGE, SECOND_RANGE, X_BEND, SECOND_BEND
};

#include "capsule_formulas.h"

/* Gap to the next stop, by constants of any field. */
#if TWO_STOPS
#define room_about(c, x)                                                                           \
    ((c)->CAPSULE_FRONT_GAP - (x) < (c)->CAPSULE_BACK_GAP + (x) ? (c)->CAPSULE_FRONT_GAP - (x)     \
                                                                : (c)->CAPSULE_BACK_GAP + (x))
#else
#define room_about(c, x) ((c)->CAPSULE_FRONT_GAP - (x))
#endif

/* Plane of an impact, by the fields before and after it: one of them is in contact. */
static inline int impact_plane(int before, int after, double v_c, double v_r)
{
    const int stop = CAPSULE_STOP_COUNT == 1 ? 1 : CONTACT_OF[before - 1] + CONTACT_OF[after - 1];
    return IMPACT_PLANE[stop - 1][v_c > 0.0][v_r > 0.0];
}
/* Error of the rounded product p of a and b. */
#if WIDTH == 1
#define product_rest(a, b, p) fma(a, b, -(p))
#else
#define product_rest(a, b, p) fused(a, b, -(p))
#endif

/* Sine and cosine of an angle in [0, 2 pi], and a little more: the nearest multiple of pi/2 is
   taken off in parts, then Taylor's series on [-pi/4, pi/4]. */
#ifndef WIDE
inlined void sine_cosine(bound angle, bound rest, bound *sine, bound *cosine)
{
    static const double S[] = {-1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0,
                               1.0 / 362880.0,         -1.0 / 5040.0,      1.0 / 120.0,
                               -1.0 / 6.0};
    static const double C[] = {-1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0,
                               1.0 / 40320.0,        -1.0 / 720.0,      1.0 / 24.0};
    const bound quarters = (angle * 0.6366197723675814 + 0x1.8p52) - 0x1.8p52;
    /* The first parts have few enough bits for exact products. */
    const bound first = angle - quarters * 0x1.921fb544p0;
    const bound z0 = first - quarters * 0x1.0b4611a6p-34;
    const bound r = z0 - quarters * 0x1.8cc51701b839ap-68, z = r * r;
    bound s = all(1.0 / 355687428096000.0), c = all(1.0 / 20922789888000.0);
    for (int i = 0; i < 7; i++)
        s = fused(s, z, all(S[i]));
    for (int i = 0; i < 6; i++)
        c = fused(c, z, all(C[i]));
    s = fused(r * z, s, r);
    c = 1.0 - (0.5 * z - z * z * c);
    const mask one = eq(quarters, all(1.0)), two = eq(quarters, all(2.0)), three = eq(quarters, all(3.0));
    const mask swapped = one | three;
    const bound a = pick(swapped, c, s), b = pick(swapped, s, c);
    const bound turned_s = pick(two | three, -a, a), turned_c = pick(one | two, -b, b);
    *sine = fused(rest, turned_c, turned_s);
    *cosine = fused(-rest, turned_s, turned_c);
}
#else
inlined void sine_cosine(real angle, bound rest, real *sine, real *cosine)
{
    static const real HALF_PI = {1.5707963267948966, 6.123233995736766e-17};
    const double nearest = floor(angle.hi * 0.6366197723675814 + 0.5);
    const int quarters = nearest >= 0.0 && nearest <= 8.0 ? (int)nearest : 0; /* NaN stays one */
    real r = sub(add(angle, num(rest)), mul(HALF_PI, num(quarters)));
    r = add(r, num(1.4973849048591833e-33 * quarters));
    const real z = neg(mul(r, r));
    real s = r, c = num(1.0), s_term = r, c_term = c;
    for (int n = 1; n < 28; n += 2) {
        c_term = part(part(mul(c_term, z), n), n + 1);
        s_term = part(part(mul(s_term, z), n + 1), n + 2);
        c = add(c, c_term);
        s = add(s, s_term);
    }
    const real a = quarters & 1 ? c : s, b = quarters & 1 ? s : c;
    *sine = quarters & 2 ? neg(a) : a;
    *cosine = (quarters + 1) & 2 ? neg(b) : b;
}
#endif

/* Terms of the drive's phase in the motion: none while the drive is constant. */
inlined void phase_terms(real angle, bound rest, real *sine, real *cosine)
{
#if CAPSULE_PULSED
    (void)angle, (void)rest;
    *sine = *cosine = num(0.0);
#else
    sine_cosine(angle, rest, sine, cosine);
#endif
}

#endif
