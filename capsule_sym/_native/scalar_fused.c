/* The same for processors with AVX2 and fused multiply-adds. */
#if defined(__x86_64__) && defined(__GNUC__)
#include "target.h"

FOR("avx2,fma" TUNED)
#define FUSED 1
#define CODE capsule_code_fused
#include "scalar.c"
FOR_ALL
#else
typedef int capsule_not_fused; /* ISO C wants a declaration */
#endif
