/* Four runs at a time, for processors with AVX2 or NEON. */
#if defined(__x86_64__) && defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#elif defined(__x86_64__)
#pragma GCC target("avx2,fma")
#endif
#define WIDTH 4
#define STEP capsule_step_4
#include "lanes.h"
#if defined(__x86_64__) && defined(__clang__)
#pragma clang attribute pop
#endif
