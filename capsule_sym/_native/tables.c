/* Constants of a parameter set. */
#include "tables.h"

#include "internal.h"

#define LONG_REST 8 /* periods of rest from which on it is worth proving */

int capsule_parameters_allowed(const capsule_parameters *p)
{
#define FINITE(name) && isfinite(p->name)
#define POSITIVE(name) && p->name > 0.0
#define NOT_NEGATIVE(name) && p->name >= 0.0
#define BELOW_ONE(name) && p->name < 1.0
#if TWO_STOPS
    if (!(p->CAPSULE_FRONT_GAP + p->CAPSULE_BACK_GAP > 0.0)) /* there is room between both */
        return 0;
#endif
    return 1 CAPSULE_PARAMETERS(FINITE) CAPSULE_POSITIVE_PARAMETERS(POSITIVE)
        CAPSULE_NOT_NEGATIVE_PARAMETERS(NOT_NEGATIVE) CAPSULE_SHARE_PARAMETERS(BELOW_ONE);
}

capsule_stop capsule_map_constants(const capsule_parameters *p, capsule_map *map)
{
    if (!p || !map)
        return CAPSULE_REFUSED;
    map->parameters = *p;
    for (int field = 1; field <= CAPSULE_FIELD_COUNT; field++)
        capsule_constants_of(field, p, &map->field[field - 1]);
#if CAPSULE_PULSED
    map->may_rest = 0;
#else
    const capsule_constants *c = &map->field[FIELD_OF[0][0][1] - 1];
    const double amplitude = c->Z2 > 0.0 ? c->alpha / sqrt(c->Z2) : INFINITY;
    const double room = room_about(c, rest_centre(c));
    const double least = fmin(friction_guard(c, -1.0, load_force(c)),
                              friction_guard(c, 1.0, load_force(c)));
    map->may_rest = amplitude < room && amplitude * sqrt(force_gain2(c)) < least;
    /* Slowly growing near resonance: the energy grows by alpha per unit of time at most. */
    const double root_K = sqrt(c->K), energy = LONG_REST * TWO_PI / c->omega * c->alpha;
    const double force = energy * force_per_energy(c, root_K) + CAPSULE_REACTION * c->alpha;
    if (!map->may_rest && energy < root_K * room && force < least)
        map->may_rest = 2;
#endif
    return capsule_parameters_allowed(p) ? CAPSULE_DONE : CAPSULE_REFUSED;
}

capsule_stop capsule_map_make(const capsule_parameters *parameters, capsule_map *map)
{
    bases b;
    if (!parameters || !map)
        return CAPSULE_REFUSED;
    bases_make(&b);
    const capsule_stop made = capsule_map_constants(parameters, map);
    for (int flow = 0; flow < CAPSULE_FLOW_COUNT; flow++) {
        const capsule_constants *c = &map->field[ONE_OF_FLOW[flow] - 1];
        table_make(&b, c, c, &map->table[flow]);
    }
    return made;
}

capsule_stop capsule_map_remake(const capsule_parameters *parameters, capsule_map *map)
{
    if (!parameters || !map)
        return CAPSULE_REFUSED;
    if (capsule_same_flows(parameters, &map->parameters))
        return capsule_map_constants(parameters, map); /* no table contains the others */
    return capsule_map_make(parameters, map);
}

double capsule_force_at(const capsule_constants *c, double x_r, double gap, double v_r)
{
    return c ? force(c, x_r, gap, v_r) : NAN;
}

const char *capsule_digest(void)
{
    return CAPSULE_DIGEST;
}
