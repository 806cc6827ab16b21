/* The same for processors with AVX2 and fused multiply-adds: same bits, faster. */
#if defined(__x86_64__) && defined(__GNUC__)
#include "target.h"

FOR("avx2,fma" TUNED)
#ifdef __clang__ /* which does not declare it */
#define __FMA__ 1
#endif
#define CODE capsule_code_wide_fused
#include "double_double.c"
FOR_ALL
#else
typedef int capsule_wide_not_fused; /* ISO C wants a declaration */
#endif
