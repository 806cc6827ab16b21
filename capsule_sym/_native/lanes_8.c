/* Eight runs at a time, for processors with AVX-512; with CAPSULE_ANY_WIDTH for those with AVX2, so
   that tests of this width run there. */
#include "target.h"

#if CAPSULE_ANY_WIDTH
FOR("avx2,fma")
#else
FOR("avx512f,avx512dq,avx512vl,fma")
#endif
#define WIDTH 8
#define STEP capsule_step_8
#include "lanes.h"
FOR_ALL
