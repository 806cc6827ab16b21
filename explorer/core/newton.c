/* Motions that settle slowly, found by Newton's method on the map of a few periods. */
#include <math.h>
#include <string.h>

#include "page.h"

#define NEAR 0.05 /* how near a state must be to that some periods before */
#define LONGEST 8 /* periods of a motion that is looked for */
#define TRIES 3

/* Periods after which the last states come near to each other again; 0 if they do not. */
static int nearly(void)
{
    const double *last = page.strobe[page.strobes];
    for (int m = 1; m <= LONGEST && 2 * m < page.strobes; m++) {
        double most = 0.0;
        for (int i = 0; i < 3; i++)
            most = fmax(most, fabs(last[i] - page.strobe[page.strobes - m][i]));
        if (most <= NEAR)
            return m;
    }
    return 0;
}

/* Whether deviations die away: a high power of the matrix is small. */
static int contracts(double matrix[3][3], int size)
{
    double power[3][3], most = 0.0;
    memcpy(power, matrix, sizeof power);
    for (int k = 0; k < 10; k++) {
        double square[3][3] = {{0}};
        for (int i = 0; i < size; i++)
            for (int j = 0; j < size; j++)
                for (int l = 0; l < size; l++)
                    square[i][j] += power[i][l] * power[l][j];
        memcpy(power, square, sizeof power);
    }
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++)
            most = fmax(most, fabs(power[i][j]));
    return most < 1.0;
}

/* The solution of a system of at most three equations by Cramer's rule; 0 where it is singular. */
static int solved(double a[3][3], const double b[3], int size, double out[3])
{
    double m[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, right[3] = {0};
    for (int i = 0; i < size; i++) {
        right[i] = b[i];
        for (int j = 0; j < size; j++)
            m[i][j] = a[i][j];
    }
    double cross[3][3], determinant = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            cross[j][i] = m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                          m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3];
    for (int j = 0; j < 3; j++)
        determinant += m[0][j] * cross[j][0];
    for (int i = 0; i < 3; i++)
        out[i] = (cross[i][0] * right[0] + cross[i][1] * right[1] + cross[i][2] * right[2]) /
                 determinant;
    return isfinite(out[0]) && isfinite(out[1]) && isfinite(out[2]);
}

/* One step: the state that the map of m periods, linear about the run, leaves where it is. */
static int step(int m)
{
    const capsule_state before = page.state;
    double carried[3][3], left[3][3], right[3], by[3];
    if (page_record(m) != CAPSULE_DONE)
        return 0;
    const capsule_state after = page.state;
    const double moved[3] = {after.x_r - before.x_r, after.v_r - before.v_r, after.v_c - before.v_c};
    const int size = before.v_c == 0.0 && after.v_c == 0.0 ? 2 : 3;
    page_carried(carried);
    if (!contracts(carried, size))
        return 0;
    for (int i = 0; i < 3; i++) {
        right[i] = 0.0;
        for (int j = 0; j < 3; j++) {
            right[i] += (j < size) * carried[i][j] * moved[j];
            left[i][j] = (i == j) - carried[i][j];
        }
    }
    if (!solved(left, right, size, by))
        return 0;
    for (int i = 0; i < size; i++)
        if (!(fabs(by[i]) <= 64.0 * NEAR))
            return 0;
    page.state = capsule_state_at(&page.map, after.x_r + by[0], after.v_r + by[1],
                                  size == 3 ? after.v_c + by[2] : 0.0, 0.0);
    page.state.position = after.position;
    return 1;
}

capsule_stop page_motion(double tolerance)
{
    page.by_newton = 0;
    const capsule_stop stop = page_steady(tolerance);
    if (stop != CAPSULE_DONE || page.motion.period_number || page.motion.never)
        return stop;
    const capsule_state run = page.state;
    const capsule_motion none = page.motion;
    static double states[STROBES + 1][3];
    const int strobes = page.strobes;
    memcpy(states, page.strobe, sizeof states);
    for (int k = 0; k < TRIES; k++) {
        const int m = nearly();
        if (!m || !step(m) || page_settle(STROBES) != CAPSULE_DONE)
            break;
        if (page_steady(tolerance) == CAPSULE_DONE && page.motion.period_number) {
            page.by_newton = 1;
            return CAPSULE_DONE;
        }
    }
    page.state = run;
    page.motion = none;
    page.strobes = strobes;
    memcpy(page.strobe, states, sizeof states);
    return CAPSULE_DONE;
}
