#include <math.h>
#include <stdio.h>

#include "capsule_kernels.h"

int main(void) {
    capsule_parameters p = {
        .alpha = 0.7, .omega = 0.8, .delta = 0.02, .zeta = 0.05, .beta = 1.5, .gamma = 3.3, .f_b = 1.0};
    capsule_constants c;
    capsule_constants_of(1, &p, &c); /* field F1: forward drift, no contact */

    double x_r = -0.5, v_r = 0.2, v_c = 0.1, angle = 1.0, h = 0.2, gap = x_r - p.delta;
    capsule_start start = {
        x_r, gap, v_r, v_c, x_r + 2 * p.zeta * v_r + c.kappa * gap - c.friction, cos(angle), sin(angle)};

    double change[3];
    capsule_flow(&c, &start, h, change);
    printf("%.12f %.12f %.12f\n", x_r + change[0], change[1], v_c + change[2]);
    return 0;
}
