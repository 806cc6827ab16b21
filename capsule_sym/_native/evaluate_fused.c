/* The evaluation of segments once more, for processors with AVX2 and fused multiply-adds. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#pragma clang fp contract(fast)
#else
#pragma GCC target("avx2,fma,tune=skylake")
#pragma GCC optimize("fp-contract=fast")
#endif
#define capsule_states capsule_states_fused
#include "evaluate.c"
#ifdef __clang__
#pragma clang attribute pop
#endif
#else
typedef int capsule_evaluation_not_fused; /* ISO C wants a declaration */
#endif
