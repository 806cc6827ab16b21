/* The field that takes over at a state: the one all of whose guards are positive just after.

   A guard's sign just after is that of its first derivative that does not vanish. Derivatives
   come with a bound on their rounding error, and what it leaves open is never guessed. */
#include <math.h>

#include "internal.h"

static departure start_of(const capsule_constants *c, const capsule_state *s, int field,
                          double cosine, double sine)
{
    const double margin = s->bound ? s->bound * c->f_b - c->friction
                                   : margin_at(c, s->x_r, s->gap, s->v_r);
    return (departure){field,    s->x_r,        s->gap, s->v_r, s->v_c, margin,
                       s->angle, s->angle_rest, cosine, sine,   {0}};
}

/* Leading zeros and the sign of what follows; 0 where rounding leaves it open. */
static int first_sign(const double *values, const double *errors, int exact, int *zeros)
{
    *zeros = exact;
    if (fabs(values[exact]) <= errors[exact])
        return 0;
    return values[exact] > 0.0 ? 1 : -1;
}

/* 1 if the field takes over, 0 if it does not, -1 where that is open. */
static int takes_over(const capsule_constants *c, const capsule_state *s, departure *d)
{
    double value[4], error[4];
    int sign, open = 0, exact;
    const double x = fabs(d->x_r), gap = fabs(d->gap), v = fabs(d->v_r);
    const double rate = v_rate(c, d->x_r, d->gap, d->v_r, d->cosine);
    const double rate_size = v_rate_size(c, x, gap, v);
    const double derivatives[2] = {rate, v_second(c, d->v_r, rate, d->sine)};
    const double sizes[2] = {rate_size, v_second_size(c, v, rate_size)};
    const double force_rate = force_change(c, d->v_r, rate);
    const double force_rate_size = force_change_size(c, v, rate_size);
    const double side = c->contact != 0.0 ? 1.0 : -1.0;
    const double turned = 2.0 * UNIT * d->angle; /* error of the angle */
    const double margin_error = 6.0 * UNIT * margin_at_size(c, x, gap, v);

    value[0] = side * d->gap, value[1] = side * d->v_r;
    error[0] = error[1] = 0.0;
    for (int n = 2; n < 4; n++) {
        value[n] = side * derivatives[n - 2];
        error[n] = ((8 * n + 8) * UNIT + turned) * sizes[n - 2];
    }
    exact = d->gap == 0.0 ? 1 + (d->v_r == 0.0) : 0;
    sign = first_sign(value, error, exact, &d->zeros[GAP]);
    if (sign < 0)
        return 0;
    open |= sign == 0;
    if (c->drift != 0.0) {
        value[0] = c->drift * d->v_c, value[1] = c->drift * v_c_rate(c, d->margin);
        value[2] = c->drift * v_c_rate(c, force_rate);
        error[0] = 0.0, error[1] = v_c_rate(c, margin_error);
        error[2] = (24.0 * UNIT + turned) * v_c_rate(c, force_rate_size);
        exact = d->v_c == 0.0 ? 1 + (s->bound == c->drift) : 0;
        sign = first_sign(value, error, exact, &d->zeros[DRIFT]);
        return sign < 0 ? 0 : (open || sign == 0) ? -1 : 1;
    }
    for (int guard = UPPER; guard <= LOWER; guard++) {
        const double way = guard == UPPER ? -1.0 : 1.0;
        value[0] = c->f_b + way * d->margin, value[1] = way * force_rate;
        error[0] = margin_error + 2.0 * UNIT * fabs(value[0]);
        error[1] = (24.0 * UNIT + turned) * force_rate_size;
        exact = s->bound == (guard == UPPER ? 1 : -1);
        sign = first_sign(value, error, exact, &d->zeros[guard]);
        if (sign < 0)
            return 0;
        open |= sign == 0;
    }
    return open ? -1 : 1;
}

/* Starts off the lines need no jets: one sign decides, and every other guard is off zero. */
static int plain(const capsule_map *map, const capsule_state *s, double cosine, double sine,
                 departure *out)
{
    if (s->v_c != 0.0) {
        if (s->gap == 0.0 && s->v_r == 0.0)
            return 0;
        const int contact = s->gap > 0.0 || (s->gap == 0.0 && s->v_r > 0.0);
        const int field = FIELD_OF[contact][s->v_c > 0.0 ? 2 : 0];
        *out = start_of(&map->field[field - 1], s, field, cosine, sine);
        out->zeros[GAP] = s->gap == 0.0;
        return field;
    }
    if (s->gap == 0.0 && (s->v_r == 0.0 || s->bound))
        return 0;
    const int contact = s->gap > 0.0 || (s->gap == 0.0 && s->v_r > 0.0);
    const capsule_constants *c = &map->field[FIELD_OF[contact][1] - 1];
    const double terms = force_size(c, fabs(s->x_r), fabs(s->gap), fabs(s->v_r));
    const double pull = force(c, s->x_r, s->gap, s->v_r);
    int drift = 0;
    if (s->bound) {
        /* At P = +-f_b the capsule stays at rest if P turns inward. There v_r' is the same at
           rest as drifting, hence P' too. */
        const double rate = force_change(c, s->v_r, c->alpha * cosine - s->bound * c->f_b);
        /* x_r and v_r miss P = +-f_b by their own rounding, which a jet would add up again. */
        const double error =
            64.0 * UNIT * force_change_size(c, fabs(s->v_r), c->alpha + terms + c->f_b);
        if (fabs(rate) <= error)
            return 0;
        drift = rate * s->bound > 0.0 ? s->bound : 0;
    } else {
        const double error = 16.0 * UNIT * (terms + c->f_b);
        if (fabs(fabs(pull) - c->f_b) <= error)
            return 0;
        drift = pull > c->f_b ? 1 : pull < -c->f_b ? -1 : 0;
    }
    const int field = FIELD_OF[contact][drift + 1];
    *out = start_of(&map->field[field - 1], s, field, cosine, sine);
    if (drift)
        out->zeros[DRIFT] = 1 + (s->bound != 0);
    else if (s->bound)
        out->zeros[s->bound > 0 ? UPPER : LOWER] = 1;
    out->zeros[GAP] = s->gap == 0.0;
    return field;
}

int depart(const capsule_map *map, const capsule_state *s, double cosine, double sine,
           departure *out)
{
    if (plain(map, s, cosine, sine, out))
        return out->field;
    int found = 0;
    for (int field = 1; field <= 6; field++) {
        const capsule_constants *c = &map->field[field - 1];
        if ((s->gap != 0.0 && c->contact != (s->gap > 0.0)) ||
            (s->v_c != 0.0 && c->drift != (s->v_c > 0.0 ? 1.0 : -1.0)))
            continue;
        departure d = start_of(c, s, field, cosine, sine);
        const int taken = takes_over(c, s, &d);
        if (taken < 0 || (taken && found))
            return 0;
        if (taken) {
            *out = d;
            found = field;
        }
    }
    return found;
}
