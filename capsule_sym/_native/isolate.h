/* First root of a guard by halving, if the signs of its coefficients alone do not decide.

   In Bernstein form a polynomial lies between its least and its largest coefficient, and has as
   many roots in (0, 1) as its coefficients have changes of sign, or fewer by an even number. So if
   all coefficients of the lower bound are positive there is no root; and if those of both bounds
   go from positive to negative with one change, each bound crosses zero exactly once, and the
   guard is positive before the lower bound's root and negative after the upper bound's.

   A guard that vanishes at the start is divided by (s/r)^zeros, which in Bernstein form on (0, r)
   multiplies coefficient j by positive numbers and drops the first `zeros`; rounding errors of those
   guards vanish like s^zeros as well. The remainder is at most tail s^3. */

#define HALVINGS 10 /* most halvings of an interval away from the start */
#define DEEPEST 50  /* most halvings of an interval at the start */

typedef struct {
    real value[DEGREE + 1];
    double error[DEGREE + 1], from, to;
    int depth;
} piece;

/* Coefficient j of s^power in Bernstein form. */
static double weight_of(int power, int j)
{
    double weight = 1.0;
    for (int i = 0; i < power; i++)
        weight *= (j - i) / (double)(DEGREE - i);
    return weight;
}

/* Splits a piece into its two halves, the right one in place (de Casteljau). */
static void halve(piece *right, piece *left, int count)
{
    for (int i = 0; i < count; i++) {
        left->value[i] = right->value[0];
        left->error[i] = right->error[0];
        for (int j = 0; j + 1 < count - i; j++) {
            right->value[j] = mean(right->value[j], right->value[j + 1]);
            right->error[j] = 0.5 * (right->error[j] + right->error[j + 1]);
        }
        /* [count - 1 - i] keeps the last value of this row, which is the right half's. */
    }
    left->from = right->from;
    right->from = left->to = 0.5 * (right->from + right->to);
    right->depth = left->depth = right->depth + 1;
}

/* True if the signs prove one crossing: positive, then undecided, then negative; `near` is about its place
   on the piece, from 0 to 1. */
static int crosses_once(const piece *p, int count, double *near)
{
    int i = 0;
    while (i < count && near_to(p->value[i]) > p->error[i])
        i++;
    if (i == 0 || i == count)
        return 0;
    const double last = near_to(p->value[i - 1]), next = near_to(p->value[i]);
    *near = (i - 1 + last / (last - next)) / (count - 1);
    while (i < count && fabs(near_to(p->value[i])) <= p->error[i])
        i++;
    if (i == count)
        return 0;
    while (i < count && near_to(p->value[i]) < -p->error[i])
        i++;
    return i == count;
}

static void isolate(const guard *g, double r, isolation *f)
{
    piece stack[DEEPEST + 2];
    const int zeros = (int)g->zeros, count = DEGREE + 1 - zeros;
    double largest = 0.0, near = 1.0;
    piece *whole = &stack[0];
    for (int i = 0; i < count; i++) {
        const int j = i + zeros;
        const real value = j == 0 ? g->first : zeros ? g->form[j - 1] : add(g->first, g->form[j - 1]);
        whole->value[i] = over(value, num(weight_of(zeros, j)));
        largest = larger(largest, fabs(near_to(whole->value[i])));
    }
    /* At most DEEPEST halvings of DEGREE means each, and the divisions above. */
    const double means = 2.0 * (DEEPEST * DEGREE + 8) * UNIT * largest;
    const double slack = g->rounding + means;
    for (int i = 0; i < count; i++)
        whole->error[i] = slack + 1.0001 * g->tail * (r * r * r) * weight_of(3, i + zeros) /
                                      weight_of(zeros, i + zeros);
    whole->from = 0.0;
    whole->to = r;
    whole->depth = 0;
    f->crossing = f->clear = 0;
    f->off = 2.0 * means; /* the coefficients', and what is allowed for it */
    for (int top = 1; top > 0;) {
        piece *p = &stack[--top];
        int positive = 0;
        for (int i = 0; i < count; i++)
            positive += near_to(p->value[i]) > p->error[i];
        if (positive == count)
            continue;
        f->from = p->from, f->to = p->to;
        if (crosses_once(p, count, &near)) {
            f->crossing = 1;
            f->near = p->from + near * (p->to - p->from);
            return;
        }
        f->near = p->from;
        if (p->depth >= (p->from == 0.0 ? DEEPEST : HALVINGS))
            return;
        halve(p, &stack[top + 1], count);
        top += 2;
    }
    f->clear = 1;
    f->from = f->to = r;
}
