/* Equations of an itinerary at some unknowns, and their derivatives, row by row. */
#ifndef CAPSULE_EQUATIONS_H
#define CAPSULE_EQUATIONS_H

#include "chain.h"

enum { ANGLE = STATES, DURATION }; /* indices of the first of these unknowns */

/* Data of an evaluation. */
typedef struct {
    const capsule_itinerary *itinerary;
    capsule_constants field[CAPSULE_FIELD_COUNT];
    double omega;
    int count, columns;
    capsule_watch *watch; /* or null */
} capsule_equations;

capsule_equations capsule_equations_of(const capsule_parameters *parameters,
                                       const capsule_itinerary *itinerary, capsule_watch *watch);

/* Next `count` numbers of a block. */
static inline double *taken(double **block, size_t count)
{
    double *const begin = *block;
    *block += count;
    return begin;
}

/* True if an itinerary is as capsule.h describes it, with as many edges of pulses as its periods have. */
int capsule_itinerary_allowed(const capsule_itinerary *itinerary);

/* True if a system has its mandatory arrays. */
int capsule_system_allowed(const capsule_system *system);

/* Evaluates the equations at z: segments, guards' rows, residual and advance. Returns 1 if the watch stopped
   it; then the residual is not a number. */
int capsule_evaluate_equations(const capsule_equations *equations, const double *z, capsule_system *to);

/* Receives an equation's row of derivatives. */
typedef void capsule_row_visit(void *about, int equation, const double *by);

/* Derivatives of all equations at their last evaluation: into the system's arrays, if it has them, and to
   `visit`, which may be null. Returns 1 if the watch stopped it. */
int capsule_differentiate_equations(const capsule_equations *equations, const double *z,
                                    capsule_system *to, capsule_row_visit *visit, void *about);

/* Writes the rest of a system: the monodromy matrix, and the derivatives for which it has arrays. */
void capsule_complete_system(const capsule_equations *equations, const double *z, capsule_system *to);

/* Rows of a segment (its next start and its guard) with respect to its duration, its start with the forcing
   angle, and a parameter that moves along `direction`, which may be null. */
enum { BLOCK_STATES = STATES + 1, BLOCK_ROWS = BLOCK_STATES + 1, BLOCK_COLUMNS = BLOCK_STATES + 2 };
void capsule_segment_block(const capsule_equations *equations, int segment, const capsule_system *at,
                           const double *direction, double block[BLOCK_ROWS][BLOCK_COLUMNS]);

/* Rows of the closing equations with respect to the last end with its angle, the start, and the parameter. */
enum { CLOSING_COLUMNS = 2 * BLOCK_STATES + 1 };
void capsule_closing_block(const capsule_equations *equations, const double *direction,
                           double block[BLOCK_STATES][CLOSING_COLUMNS]);

#endif
