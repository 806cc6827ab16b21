/* Steps of eight runs at a time, for processors with AVX-512. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl,fma"))), apply_to = function)
#else
#pragma GCC target("avx512f,avx512dq,avx512vl,fma")
#endif
#define LANES 8
#define STEP capsule_step_8
#include "lanes.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#endif
