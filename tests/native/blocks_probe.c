/* One step of Newton's method on an itinerary by blocks, and the matrix that it is a step with. */
#include <stdlib.h>

#include "blocks.h"

int probe(const double *values, const capsule_itinerary *itinerary, const double *z, int held,
          const double *direction, const double *given, double *matrix, double *residual, double *step,
          double *product, double *transposed, double *inverse)
{
    const int n = itinerary->count, m = n + DURATION, columns = CAPSULE_COLUMNS(n);
    const capsule_parameters *parameters = (const capsule_parameters *)values;
    double *const room = malloc(CAPSULE_SYSTEM_ROOM((size_t)n) * sizeof *room);
    capsule_system system = capsule_system_in(room, n);
    capsule_blocks blocks = {.count = n, .held = held};
    int regular = -1;
    blocks.segments = malloc((size_t)n * sizeof *blocks.segments);
    blocks.kept = malloc((size_t)n * sizeof *blocks.kept);
    if (capsule_evaluate_itinerary(parameters, itinerary, z, &system) == CAPSULE_DONE) {
        const capsule_equations equations = capsule_equations_of(parameters, itinerary, NULL);
        capsule_blocks_fill(&blocks, &equations, &system, held < 0 ? NULL : direction);
        regular = capsule_blocks_factor(&blocks, NULL);
        for (int i = 0; i < m; i++) {
            residual[i] = step[i] = system.residual[i];
            for (int j = 0; j < m; j++)
                matrix[i * m + j] = system.by[i * columns + j];
            for (int k = 0; held >= 0 && k < CAPSULE_PARAMETER_COUNT; k++)
                matrix[i * m + held] = (k ? matrix[i * m + held] : 0.0) +
                                       system.by[i * columns + m + k] * direction[k];
        }
        capsule_blocks_solve(&blocks, step, 0);
        capsule_blocks_product(&blocks, given, product);
        capsule_blocks_transposed(&blocks, given, transposed);
        /* Columns of the inverse: of the last guards and what closes the orbit. */
        for (int i = 0; i < m * BLOCK_RIGHT_SIDES; i++)
            inverse[i] = i / BLOCK_RIGHT_SIDES + BLOCK_RIGHT_SIDES - m == i % BLOCK_RIGHT_SIDES;
        capsule_blocks_solve_many(&blocks, inverse, n - 4);
    }
    free(blocks.segments), free(blocks.kept), free(room);
    return regular;
}
