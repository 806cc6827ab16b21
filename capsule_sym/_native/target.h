/* Instructions that only some processors of a kind have. FOR("avx2,fma") compiles the code after it for
   them, up to FOR_ALL. */
#define PRAGMA(text) _Pragma(#text)
#if !(defined(__x86_64__) && defined(__GNUC__))
#define FOR(features)
#define FOR_ALL
#elif defined(__clang__)
#define FOR(features) \
    PRAGMA(clang attribute push(__attribute__((target(features))), apply_to = function))
#define FOR_ALL PRAGMA(clang attribute pop)
#else
#define FOR(features) PRAGMA(GCC target(features))
#define FOR_ALL
#endif
#ifdef __clang__
#define TUNED
#else
#define TUNED ",tune=skylake"
#endif
