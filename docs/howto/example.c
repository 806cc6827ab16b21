/* A user's program: the case study at alpha = 0.7 from rest, its switches and its progression. */
#include <stdio.h>

#include "capsule.h"

int main(void)
{
    static const char *const MODE[] = {"NC-FD", "NC-S", "NC-BD", "C-FD", "C-S", "C-BD"};
    static capsule_map map; /* some 20 kB: not on a small stack */
    const capsule_parameters parameters = {
        .alpha = 0.7, .omega = 0.8, .delta = 0.02, .zeta = 0.05, .beta = 1.5, .gamma = 3.3, .f_b = 1};
    capsule_outcome open;
    size_t count;

    capsule_map_make(&parameters, &map);
    capsule_state state = capsule_state_at(&map, 0, 0, 0, 0);
    const capsule_request final_state = {.position = 1};
    if (capsule_run(&map, &state, 100, &final_state, &count, &open) != CAPSULE_DONE)
        return 1;
    const double before = state.position;

    capsule_event events[16];
    const capsule_request switches = {.events = events, .room = 16, .position = 1};
    if (capsule_run(&map, &state, 101, &switches, &count, &open) != CAPSULE_DONE)
        return 1;
    printf("one period of the steady motion:\n");
    for (size_t i = 0; i < count; i++)
        printf("  %-5s until angle %.15f, plane %d\n", MODE[events[i].field - 1], events[i].angle,
               (int)events[i].plane);
    printf("progression per period %.15f\n", state.position - before);
    return 0;
}
