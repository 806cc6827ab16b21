/* The same once more, for processors with AVX2 and fused multiply-adds: same bits, sooner. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#define __FMA__ 1
#else
#pragma GCC target("avx2,fma,tune=skylake")
#endif
#define capsule_pass_wide capsule_pass_wide_fused
#include "wide.c"
#ifdef __clang__
#pragma clang attribute pop
#endif
#else
typedef int capsule_wide_not_fused; /* ISO C wants a declaration */
#endif
