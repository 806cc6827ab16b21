/* Eight runs at a time, for processors with AVX-512; with CAPSULE_ANY_WIDTH for those with AVX2, so
   that tests of this width run there. */
#if defined(__x86_64__) && defined(__clang__) && CAPSULE_ANY_WIDTH
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#elif defined(__x86_64__) && defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl,fma"))), apply_to = function)
#elif defined(__x86_64__) && CAPSULE_ANY_WIDTH
#pragma GCC target("avx2,fma")
#elif defined(__x86_64__)
#pragma GCC target("avx512f,avx512dq,avx512vl,fma")
#endif
#define WIDTH 8
#define STEP capsule_step_8
#include "lanes.h"
#if defined(__x86_64__) && defined(__clang__)
#pragma clang attribute pop
#endif
