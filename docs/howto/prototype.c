/* A user's program: the scene prototype from rest, the fields of its motion and its progression. */
#include <stdio.h>

#include "capsule.h"

int main(void)
{
    static capsule_map map;
    const capsule_parameters parameters = {
        .alpha = 4, .D = 0.2, .omega = 0.7, .delta_1 = 12.6, .delta_2 = 3.1, .zeta = 0.024,
        .beta_1 = 870, .beta_2 = 450, .gamma = 0.944, .f_plus = 1, .f_minus = 1};
    capsule_outcome open;
    size_t count;

    if (capsule_map_make(&parameters, &map) != CAPSULE_DONE)
        return 1;
    capsule_state state = capsule_state_at(&map, 0, 0, 0, 0);
    const capsule_request final_state = {.position = 1};
    if (capsule_run(&map, &state, 400, &final_state, &count, &open) != CAPSULE_DONE)
        return 1;
    const double before = state.position;

    capsule_segment segments[16];
    const capsule_request fields = {.segments = segments, .room = 16, .position = 1};
    if (capsule_run(&map, &state, 401, &fields, &count, &open) != CAPSULE_DONE)
        return 1;
    for (size_t i = 0; i < count; i++) {
        const int field = (int)segments[i].field, plane = (int)segments[i].target;
        printf("F%-2d for %.12f%s\n", field, segments[i].duration,
               plane == CAPSULE_FALL_PLANE   ? ", the pulse falls"
               : plane == CAPSULE_RISE_PLANE ? ", the pulse rises"
                                             : "");
    }
    printf("progression per period %.12f\n", state.position - before);
    return 0;
}
