/* Instructions that not every processor of a kind has. FOR("avx2,fma") compiles for them what
   follows, up to FOR_ALL; CONTRACTED lets products and sums there be fused: that saves time, and
   roundings, which the error bounds count. */
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
#define CONTRACTED PRAGMA(clang fp contract(fast))
#else
#define CONTRACTED PRAGMA(GCC optimize("fp-contract=fast"))
#endif
#ifdef __clang__
#define TUNED
#else
#define TUNED ",tune=skylake"
#endif
