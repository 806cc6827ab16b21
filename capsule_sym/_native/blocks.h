/* The linear equations of Newton's method on an itinerary, solved segment by segment.

   Their unknowns are the start with its forcing angle, the durations, and the change of a parameter; the
   state and angle where each segment begins are added to them, so that a segment's rows hold its own
   unknowns, the next one's start and the parameter alone. */
#ifndef CAPSULE_BLOCKS_H
#define CAPSULE_BLOCKS_H

#include "equations.h"

enum {
    OWN = 1 + BLOCK_STATES,              /* duration and start of a segment */
    BORDER = BLOCK_STATES + 1,           /* start of the first one, and the parameter */
    CARRIED = BORDER,                    /* rows carried to the next segment */
    WINDOW_ROWS = BLOCK_ROWS + CARRIED,  /* all in which a segment's own unknowns occur */
    WINDOW_COLUMNS = OWN + BLOCK_STATES + BORDER,
    BLOCK_ENDS = BLOCK_STATES + BORDER,  /* unknowns that are left at the end */
    BLOCK_RIGHT_SIDES = 8,               /* number solved at a time */
};

/* Rows of a segment, and the result of their elimination with the rows carried to it. */
typedef struct {
    double rows[BLOCK_ROWS][BLOCK_COLUMNS];
    double window[WINDOW_ROWS][WINDOW_COLUMNS], order[OWN];
} capsule_block;

typedef struct {
    int count, held; /* the fixed unknown, in whose place the parameter moves; -1 for a fixed parameter */
    capsule_block *segments;
    double (*kept)[OWN * BLOCK_RIGHT_SIDES]; /* for each segment */
    double closing[BLOCK_STATES][CLOSING_COLUMNS];
    double end[BLOCK_ENDS][BLOCK_ENDS], order[BLOCK_ENDS];
} capsule_blocks;

/* Takes the rows from equations that were evaluated. */
void capsule_blocks_fill(capsule_blocks *blocks, const capsule_equations *equations,
                         const capsule_system *at, const double *direction);

/* Eliminates the unknowns. Returns 0 if a pivot is 0, and -1 if the watch (may be null) stops it. */
int capsule_blocks_factor(capsule_blocks *blocks, capsule_watch *watch);

/* Solves for one right side, or for BLOCK_RIGHT_SIDES of them as columns, in place. Those of guards before
   segment `first` are 0. */
void capsule_blocks_solve(const capsule_blocks *blocks, double *right, int first);
void capsule_blocks_solve_many(const capsule_blocks *blocks, double *right, int first);

/* The product with the matrix, and with its transpose. */
void capsule_blocks_product(const capsule_blocks *blocks, const double *z, double *product);
void capsule_blocks_transposed(const capsule_blocks *blocks, const double *residual, double *product);

#endif
