/* A motion about one instant, as polynomials in s = h/reach for 0 <= s <= 1. */
#ifndef CAPSULE_EXPANSION_H
#define CAPSULE_EXPANSION_H

#include "internal.h"

/* Where an expansion stands: a segment's start, or a later instant with the error come to. */
typedef struct {
    departure at;
    double energy_error; /* of x_r and v_r: sqrt(dv^2 + K dx^2), which the flow never enlarges */
    double v_c_error, angle_error;
    int later; /* whether there is any such error */
} stand;

typedef struct {
    double u[4], size[4];                 /* multiples of the responses, and what they add up */
    double slope;                         /* in drift, margin reach/gamma */
    double x_rounding, second_rounding;   /* error bounds of x_r, and of P or v_c */
    double x_own, second_own;             /* of these, what this expansion adds */
} expansion;

typedef struct {
    double x_r, gap, v_r, v_c, margin, cosine, sine, angle, angle_rest, advance;
    int passed; /* ends of an excitation period passed */
} point;

void expand(const capsule_constants *c, const capsule_table *t, const stand *from, expansion *e);

/* What is proved of a guard on [0, 1]. */
finding examine(const capsule_constants *c, const capsule_table *t, const stand *from,
                const expansion *e, guard_name guard, double thin);

typedef struct {
    int certain;  /* whether the crossing is simple for certain */
    double s;
    double error; /* bound on the error of the root */
} root;

/* Coefficients of s, s^2, ... of x_r(s) - x_r(0). */
void coefficients(const capsule_table *t, const expansion *e, double x[POLYNOMIAL]);

/* The root in an interval of a finding of kind CROSSING, sought from `guess`. */
root polish(const capsule_constants *c, const capsule_table *t, const stand *from,
            const expansion *e, const double x[POLYNOMIAL], guard_name guard, finding where,
            double guess);

/* The motion at s, from its coefficients, or with x null at s = 1. v_c only if it does not vanish
   there, and x_c's advance only if asked for. */
void evaluate(const capsule_constants *c, const capsule_table *t, const stand *from,
              const expansion *e, const double x[POLYNOMIAL], double s, int stops, int advance,
              point *out);

/* Error bounds at a later instant of the same segment. */
void carry(const capsule_constants *c, const capsule_table *t, const stand *from,
           const expansion *e, const point *at, stand *to);

#endif
