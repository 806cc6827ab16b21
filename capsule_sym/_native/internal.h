/* What the parts of the library share. */
#ifndef CAPSULE_INTERNAL_H
#define CAPSULE_INTERNAL_H

#include <math.h>

#include "capsule.h"

#ifndef LANES
/* The number type of the formulas here: double. */
typedef double real;
typedef double bound;
typedef capsule_constants segment;
typedef capsule_constants segment_sizes;
#define num(a) (a)
#define add(a, b) ((a) + (b))
#define sub(a, b) ((a) - (b))
#define mul(a, b) ((a) * (b))
#define mad(a, b, c) ((a) * (b) + (c))
#define over(a, b) ((a) / (b))
#define neg(a) (-(a))
#define size_of(a) fabs(a)

#include "capsule_formulas.h"
#endif

#define UNIT 0x1p-53 /* unit roundoff */
#define TWO_PI 6.283185307179586
#define TWO_PI_REST 2.4492935982947064e-16
#define TERMS CAPSULE_TERMS
#define DEGREE CAPSULE_DEGREE
#define LEAST_ROWS 8192 /* of a strobe whose rows are taken again; no segment passes half as many
                           ends of periods, unless it lasts for ever */
#define POLYNOMIAL 16 /* room for the coefficients of a guard, a multiple of four */

static inline double lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double greater(double a, double b)
{
    return a > b ? a : b;
}

typedef enum { GAP, DRIFT, UPPER, LOWER, NONE } guard_name;

/* Start of a segment. zeros: leading derivatives of each guard, from the guard itself on, that
   vanish exactly there. */
typedef struct {
    int field; /* 1 .. 6 */
    double x_r, gap, v_r, v_c, margin, angle, angle_rest, cosine, sine;
    int zeros[4];
} departure;

/* Cosine and sine of a forcing angle and its rest. */
static inline void cosine_sine(double angle, double rest, double *cosine, double *sine)
{
    const double c = cos(angle), s = sin(angle);
    *cosine = c - rest * s;
    *sine = s + rest * c;
}

/* The field that takes over at a state, given cosine and sine of its angle; 0 where double
   precision leaves it open. */
int depart(const capsule_map *map, const capsule_state *state, double cosine, double sine,
           departure *out);
#ifndef depart
int depart_fused(const capsule_map *map, const capsule_state *state, double cosine, double sine,
                 departure *out);
#endif

/* `capsule_run` by plain instructions, and by those of the processors that have lanes. */
capsule_stop go(const capsule_map *map, capsule_state *state, int64_t periods,
                const capsule_wish *wish, size_t *written, capsule_outcome *open);
capsule_stop go_fused(const capsule_map *map, capsule_state *state, int64_t periods,
                      const capsule_wish *wish, size_t *written, capsule_outcome *open);

/* Whether a run from a state may be asked for: parameters and state keep what capsule.h says, so
   that every index and every loop below is bounded. */
int allowed(const capsule_map *map, const capsule_state *state);

/* Tables of the four linear flows, by contact and drift; of each, with expansions of the whole
   reach, half of it and so on. */
void capsule_tables_make(const capsule_map *map, int levels, capsule_table *table);

/* What bounds prove of a guard on [0, 1], in units of the expansion's reach. */
typedef struct {
    enum { CLEAR, CROSSING, VAGUE } kind;
    double from; /* positive on (0, from) */
    double to;   /* CROSSING: lower and upper bound each cross zero once in (from, to] */
    double near; /* roughly where */
} finding;

/* From the Bernstein coefficients 1 to DEGREE of g(s) - first, the first value, how many leading
   derivatives of g vanish, and bounds on the error: rounding s^zeros at s, and tail s^3. `thin`
   asks for a crossing in an interval no wider than that. */
finding search(const double *form, double first, int zeros, double rounding, double tail,
               double thin);

#endif
