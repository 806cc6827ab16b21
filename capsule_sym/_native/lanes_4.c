/* Steps of four runs at a time, for processors with AVX2. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC target("avx2,fma")
#endif
#define LANES 4
#define STEP capsule_step_4
#include "lanes.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#endif
