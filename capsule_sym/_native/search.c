/* The first root of a guard, from polynomials that bound it from below and above.

   In Bernstein form a polynomial lies between its least and its largest coefficient, and has as
   many roots in (0, 1) as its coefficients have changes of sign, or fewer by an even number. So if
   all coefficients of the lower bound are positive there is no root; and if those of both bounds
   go from positive to negative with one change, each bound crosses zero exactly once, and the
   guard is positive before the lower bound's root and negative after the upper bound's.

   A guard that vanishes at the start is divided by s^zeros, which in Bernstein form multiplies
   coefficient j by positive numbers and drops the first `zeros`; rounding errors of those guards
   vanish like s^zeros as well. The remainder is at most tail s^3. */
#include <math.h>

#include "internal.h"

/* 1, s, s^2 and s^3 in Bernstein form. */
#define W0(j) 1.0
#define W1(j) ((j) / 8.0)
#define W2(j) ((j) * ((j)-1) / 56.0)
#define W3(j) ((j) * ((j)-1) * ((j)-2) / 336.0)
#define ROW(W) {W(1), W(2), W(3), W(4), W(5), W(6), W(7), W(8)}
static const double WEIGHT[4][DEGREE] = {ROW(W0), ROW(W1), ROW(W2), ROW(W3)};

#define HALVINGS 10      /* an interval away from the start is left open after so many */
#define DEEPEST 50       /* an interval at the start is */
#define STACK (DEEPEST + 2)

typedef struct {
    double lower[DEGREE + 1], upper[DEGREE + 1], from, to;
    int depth;
} piece;

/* Whether the signs prove one crossing: positive, then open, then negative; `near` is about where
   on [0, 1]. */
static int crosses_once(const double *lower, const double *upper, int count, double *near)
{
    int i = 0;
    while (i < count && lower[i] > 0.0)
        i++;
    if (i == 0)
        return 0;
    if (i < count)
        *near = (i - 1 + lower[i - 1] / (lower[i - 1] - lower[i])) / (count - 1);
    while (i < count && lower[i] <= 0.0 && upper[i] >= 0.0)
        i++;
    if (i == count)
        return 0;
    while (i < count && upper[i] < 0.0)
        i++;
    return i == count;
}

/* Splits a form into those of its two halves, the right one in place (de Casteljau). */
static void halve(double *form, double *left, int count)
{
    for (int i = 0; i < count; i++) {
        left[i] = form[0];
        for (int j = 0; j + 1 < count - i; j++)
            form[j] = 0.5 * (form[j] + form[j + 1]);
        /* form[count - 1 - i] keeps the last value of this row, which is the right half's. */
    }
}

static finding bisect(const double *form, double first, int zeros, double rounding, double tail,
                      double thin)
{
    piece stack[STACK];
    const int count = DEGREE + 1 - zeros;
    double largest = 0.0, near = 1.0;
    piece *whole = &stack[0];
    for (int i = 0; i < count; i++) {
        const int j = i + zeros;
        const double weight = j == 0 ? 1.0 : WEIGHT[zeros][j - 1];
        whole->lower[i] = (j == 0 ? first : zeros ? form[j - 1] : first + form[j - 1]) / weight;
        largest = greater(largest, fabs(whole->lower[i]));
    }
    /* At most DEEPEST halvings of DEGREE means each, and the divisions above. */
    const double slack = rounding + 2.0 * (DEEPEST * DEGREE + 8) * UNIT * largest;
    for (int i = 0; i < count; i++) {
        const int j = i + zeros;
        const double error =
            j == 0 ? slack : slack + 1.0001 * tail * WEIGHT[3][j - 1] / WEIGHT[zeros][j - 1];
        whole->upper[i] = whole->lower[i] + error;
        whole->lower[i] -= error;
    }
    whole->from = 0.0;
    whole->to = 1.0;
    whole->depth = 0;
    for (int top = 1; top > 0;) {
        piece *p = &stack[--top];
        int positive = 0;
        for (int i = 0; i < count; i++)
            positive += p->lower[i] > 0.0;
        if (positive == count)
            continue;
        if (p->to - p->from <= thin && crosses_once(p->lower, p->upper, count, &near))
            return (finding){CROSSING, p->from, p->to, p->from + near * (p->to - p->from)};
        if (p->depth >= (p->from == 0.0 ? DEEPEST : HALVINGS))
            return (finding){VAGUE, p->from, p->to, p->from};
        piece *left = &stack[top + 1];
        halve(p->lower, left->lower, count);
        halve(p->upper, left->upper, count);
        left->from = p->from;
        p->from = left->to = 0.5 * (p->from + p->to);
        p->depth = left->depth = p->depth + 1;
        top += 2;
    }
    return (finding){CLEAR, 1.0, 1.0, 1.0};
}

finding search(const double *form, double first, int zeros, double rounding, double tail,
               double thin)
{
    const double *weight = WEIGHT[zeros];
    const double base = zeros ? 0.0 : first;
    int positive = 0;
    for (int j = 0; j < DEGREE; j++)
        positive += form[j] > rounding * weight[j] + tail * WEIGHT[3][j] - base;
    const int skipped = zeros == 2; /* coefficient 1 of s^2 is 0 */
    const int begins = zeros || first > rounding;
    if (begins && positive == DEGREE - skipped)
        return (finding){CLEAR, 1.0, 1.0, 1.0};
    if (begins && thin >= 1.0) {
        double lower[DEGREE], upper[DEGREE], near = 1.0;
        for (int j = 0; j < DEGREE; j++) {
            const double error = rounding * weight[j] + tail * WEIGHT[3][j];
            lower[j] = base + form[j] - error;
            upper[j] = base + form[j] + error;
        }
        if (crosses_once(lower + skipped, upper + skipped, DEGREE - skipped, &near))
            return (finding){CROSSING, 0.0, 1.0, near};
    }
    return bisect(form, first, zeros, rounding, tail, thin);
}
