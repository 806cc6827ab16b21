/* Constants of a parameter set. */
#include "tables.h"

#include "internal.h"

void capsule_map_constants(const capsule_parameters *p, capsule_map *map)
{
    map->parameters = *p;
    for (int field = 1; field <= 6; field++)
        capsule_constants_of(field, p->alpha, p->omega, p->delta, p->zeta, p->beta, p->gamma,
                             p->f_b, &map->field[field - 1]);
    const capsule_constants *c = &map->field[FIELD_OF[0][1] - 1];
    const double amplitude = c->Z2 > 0.0 ? c->alpha / sqrt(c->Z2) : INFINITY;
    map->may_rest = amplitude < c->delta && amplitude * sqrt(force_gain2(c)) < c->f_b;
}

void capsule_map_make(const capsule_parameters *parameters, capsule_map *map)
{
    bases b;
    bases_make(&b);
    capsule_map_constants(parameters, map);
    for (int flow = 0; flow < 4; flow++) {
        const capsule_constants *c = &map->field[ONE_OF_FLOW[flow] - 1];
        table_make(&b, c, c, &map->table[flow]);
    }
}

void capsule_map_remake(const capsule_parameters *parameters, capsule_map *map)
{
    const capsule_parameters *p = parameters, *old = &map->parameters;
    if (p->omega == old->omega && p->zeta == old->zeta && p->beta == old->beta &&
        p->gamma == old->gamma)
        capsule_map_constants(parameters, map); /* alpha, delta and f_b are in no table */
    else
        capsule_map_make(parameters, map);
}

double capsule_margin_at(const capsule_constants *c, double x_r, double gap, double v_r)
{
    return margin_at(c, x_r, gap, v_r);
}

const char *capsule_digest(void)
{
    return CAPSULE_DIGEST;
}
