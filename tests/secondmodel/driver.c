/* Reads runs, and prints where the C library takes each, alone and in a batch: the final state and the
   fields. */
#include <stdio.h>
#include <stdlib.h>

#include "capsule.h"

enum { MOST = 512, ROOM = 4096 };
static capsule_map map;
static capsule_workspace workspace;
static capsule_parameters parameters[MOST];
static capsule_state states[MOST];
static capsule_segment segments[ROOM];
static int8_t stops[MOST];

int main(int argc, char **argv)
{
    const int64_t periods = argc > 1 ? atol(argv[1]) : 1;
    size_t count = 0, written;
    double x[CAPSULE_STATE_COUNT];
    for (; count < MOST; count++) {
        double *values = (double *)&parameters[count];
        for (int i = 0; i < CAPSULE_PARAMETER_COUNT; i++)
            if (scanf("%lf", &values[i]) != 1)
                goto read;
        if (scanf("%lf %lf %lf", &x[0], &x[1], &x[2]) != 3)
            return 1;
        if (capsule_map_make(&parameters[count], &map) != CAPSULE_DONE)
            return 2;
        capsule_state state = states[count] = capsule_state_at(&map, x[0], x[1], x[2], 0.0);
        capsule_outcome open;
        const capsule_request request = {.segments = segments, .room = ROOM};
        const capsule_stop stop = capsule_run(&map, &state, periods, &request, &written, &open);
        printf("%d %.17g %.17g %.17g ", stop, state.x_r, state.v_r, state.v_c);
        for (size_t i = 0; i < written; i++)
            printf("%d", segments[i].field);
        double times[8], rows[8][4];
        for (int i = 0; i < 8; i++)
            times[i] = (i + 0.5) / 8 * periods * 6.283185307179586 / parameters[count].omega;
        if (capsule_evaluate(&map, segments, written, 0, times, 8, rows, NULL) != 8)
            return 3;
        printf("\n");
    }
read:;
    const capsule_batch batch = {
        .stride = 1, .parameters = parameters, .states = states, .stops = stops};
    if (capsule_run_many(&batch, count, periods, &workspace) != CAPSULE_DONE)
        return 4;
    for (size_t i = 0; i < count; i++)
        printf("%d %.17g %.17g %.17g\n", stops[i], states[i].x_r, states[i].v_r, states[i].v_c);
    return 0;
}
