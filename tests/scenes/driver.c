/* Reads runs of a scene, each with its parameters in their order, a state and a time in the period, and
   prints where the C library takes them: alone, driver PERIODS PRECISION, or with LANES side by side.
   Each line has why the run came back, x_r, v_r, v_c, x_c at the end, and alone the fields passed, the
   planes onto which they led, and their durations. */
#include <stdio.h>
#include <stdlib.h>

#include "capsule.h"

enum { MOST = 100000, ROOM = 1 << 16 };
static capsule_map map;
static capsule_workspace workspace;
static capsule_parameters parameters[MOST];
static capsule_state states[MOST];
static capsule_segment segments[ROOM];
static int8_t stops[MOST];

static void print(int stop, const capsule_state *s)
{
    printf("%d %.17g %.17g %.17g %.17g", stop, s->x_r, s->v_r, s->v_c, s->position);
}

static void run_alone(capsule_state *state, int64_t periods, int precision)
{
    const capsule_request request = {.segments = segments, .room = ROOM, .precision = precision};
    capsule_outcome open;
    size_t written;
    print(capsule_run(&map, state, periods, &request, &written, &open), state);
    for (size_t i = 0; i < written; i++)
        printf(" %d:%d:%.17g", segments[i].field, segments[i].target, segments[i].duration);
    printf(" %d\n", open);
}

int main(int argc, char **argv)
{
    const int64_t periods = argc > 1 ? atol(argv[1]) : 1;
    const int precision = argc > 2 ? atoi(argv[2]) : 0, lanes = argc > 3 ? atoi(argv[3]) : 0;
    size_t count = 0;
    for (; count < MOST; count++) {
        double *values = (double *)&parameters[count], x[CAPSULE_STATE_COUNT], phase;
        for (int i = 0; i < CAPSULE_PARAMETER_COUNT; i++)
            if (scanf("%lf", &values[i]) != 1)
                goto read;
        if (scanf("%lf %lf %lf %lf", &x[0], &x[1], &x[2], &phase) != 4)
            return 1;
        if (capsule_map_remake(&parameters[count], &map) != CAPSULE_DONE)
            return 2;
        states[count] = capsule_state_at(&map, x[0], x[1], x[2], phase);
        if (!lanes)
            run_alone(&states[count], periods, precision);
    }
read:;
    const capsule_batch batch = {.stride = 1, .parameters = parameters, .states = states,
                                 .stops = stops, .position = 1, .lanes = lanes, .precision = precision};
    if (!lanes)
        return 0;
    if (capsule_run_many(&batch, count, periods, &workspace) != CAPSULE_DONE)
        return 4;
    for (size_t i = 0; i < count; i++) {
        print(stops[i], &states[i]);
        printf("\n");
    }
    return 0;
}
