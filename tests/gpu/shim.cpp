// Stand-in for a card: the device source as host code, where a loop replaces the launch.
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <utility>

#define __global__
#define __shared__ static
#define __launch_bounds__(...)
#define __noinline__ __attribute__((noinline))
#define __syncthreads() /* thread 0 of a block comes first */
static struct {
    unsigned x;
} threadIdx, blockIdx;

#include "device.inc"

// Blocks, and the threads of a block after its first, in reverse order.
extern "C" {
int shim_backwards;
}

template <class... A, size_t... I>
static void each(void (*kernel)(A...), int64_t count, void **given, std::index_sequence<I...>)
{
    const int64_t blocks = (count + BLOCK - 1) / BLOCK;
    for (int64_t block = 0; block < blocks; block++) {
        blockIdx.x = (unsigned)(shim_backwards ? blocks - 1 - block : block);
        for (unsigned thread = 0; thread < BLOCK; thread++) {
            threadIdx.x = shim_backwards && thread ? BLOCK - thread : thread;
            kernel(*(A *)given[I]...);
        }
    }
}

template <class... A> static void launch(void (*kernel)(A...), int64_t count, void **given)
{
    each(kernel, count, given, std::index_sequence_for<A...>());
}

#define LAUNCH(name)                                                                                \
    extern "C" void launch_##name(int64_t count, void **given) { launch(name, count, given); }
#ifdef TABLES
LAUNCH(capsule_tables)
#elif defined(ORBITS)
LAUNCH(capsule_motions)
LAUNCH(capsule_orbits)
#else
LAUNCH(capsule_sizes)
LAUNCH(capsule_starts)
LAUNCH(capsule_runs)
#endif
