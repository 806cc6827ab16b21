/* The code of one run once more, for processors with AVX2 and fused multiply-adds: these save time,
   and roundings that the error bounds count. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#pragma clang fp contract(fast)
#else
#pragma GCC target("avx2,fma,tune=skylake")
#pragma GCC optimize("fp-contract=fast")
#endif
#define search search_fused
#define depart depart_fused
#define expand expand_fused
#define examine examine_fused
#define coefficients coefficients_fused
#define polish polish_fused
#define evaluate evaluate_fused
#define carry carry_fused
#define go go_fused
#include "search.c"
#include "depart.c"
#include "expansion.c"
#include "run.c"
#ifdef __clang__
#pragma clang attribute pop
#endif
#endif
