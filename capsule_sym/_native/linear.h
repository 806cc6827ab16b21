/* Systems of linear equations by elimination with row exchanges. */
#ifndef CAPSULE_LINEAR_H
#define CAPSULE_LINEAR_H

#include <stddef.h>

/* Factors a square matrix in place, row by row; `order` receives the rows that are exchanged. Returns 0
   if a pivot is 0. */
int capsule_factor(double *matrix, size_t size, double *order);

/* Solves the factored system for right sides that are the columns of `right`, in place. */
void capsule_substitute(const double *matrix, size_t size, const double *order, double *right,
                        size_t columns);

#endif
