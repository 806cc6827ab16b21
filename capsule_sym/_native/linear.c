/* Systems of linear equations. */
#include "linear.h"

#include <math.h>

static void exchange(double *one, double *other, size_t count)
{
    for (size_t j = 0; j < count && one != other; j++) {
        const double kept = one[j];
        one[j] = other[j], other[j] = kept;
    }
}

int capsule_factor(double *a, size_t size, double *order)
{
    int regular = 1;
    for (size_t k = 0; k < size; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < size; i++)
            if (fabs(a[i * size + k]) > fabs(a[best * size + k]))
                best = i;
        order[k] = (double)best;
        exchange(&a[k * size + k], &a[best * size + k], size - k);
        const double pivot = a[k * size + k];
        regular &= pivot != 0.0;
        for (size_t i = k + 1; i < size; i++) {
            const double factor = a[i * size + k] / pivot;
            a[i * size + k] = factor;
            for (size_t j = k + 1; j < size && factor != 0.0; j++)
                a[i * size + j] -= factor * a[k * size + j];
        }
    }
    return regular;
}

void capsule_substitute(const double *a, size_t size, const double *order, double *b, size_t columns)
{
    for (size_t k = 0; k < size; k++) {
        exchange(&b[k * columns], &b[(size_t)order[k] * columns], columns);
        for (size_t i = k + 1; i < size; i++)
            for (size_t j = 0; j < columns; j++)
                b[i * columns + j] -= a[i * size + k] * b[k * columns + j];
    }
    for (size_t i = size; i-- > 0;)
        for (size_t j = 0; j < columns; j++) {
            for (size_t k = i + 1; k < size; k++)
                b[i * columns + j] -= a[i * size + k] * b[k * columns + j];
            b[i * columns + j] /= a[i * size + i];
        }
}
