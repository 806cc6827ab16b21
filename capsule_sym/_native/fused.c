/* One segment in double precision once more, for processors with AVX2 and fused multiply-adds: these
   save time, and roundings that the error bounds count. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#pragma clang fp contract(fast)
#else
#pragma GCC target("avx2,fma,tune=skylake")
#pragma GCC optimize("fp-contract=fast")
#endif
#define capsule_pass capsule_pass_fused
#define capsule_field_at capsule_field_fused
#include "solo.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#else
typedef int capsule_not_fused; /* ISO C wants a declaration */
#endif
