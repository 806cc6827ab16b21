/* Four runs at a time, for processors with AVX2 or NEON. */
#include "target.h"

FOR("avx2,fma")
#define WIDTH 4
#define STEP capsule_step_4
#include "lanes.h"
FOR_ALL
