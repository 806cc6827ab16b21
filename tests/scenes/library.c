/* Runs by the C library of any scene. Each line of stdin has parameters in their order, a state and a time
   in the period; each line of stdout is the run's stop, then

   library alone PRECISION PERIODS MOST: what stayed open, the final state with x_c, and for each segment its
   field, plane and duration. A run has MOST segments at most.
   library lanes LANES PERIODS: field, plane and duration of its first switch, found in one of LANES lanes
   among runs from displaced states, and whether it was left to the code for one run.
   library many LANES PERIODS: the final state with x_c, of all lines side by side.
   library switches LANES PERIODS: field, plane and angle of each switch, of all lines side by side from one
   switch to the next.
   library motion LONGEST PERIODS: after so many periods the period number, 0 if the run does not repeat
   itself within LONGEST periods, and the result of the search for an orbit: its status, its
   state, and that of the run.
   library time LANES PERIODS: in one line seconds, and switches of the same runs one by one. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "capsule.h"

#ifdef __SIZEOF_FLOAT128__
__extension__ typedef __float128 wide;
#else
typedef long double wide;
#endif
#define SAME 1e-9 /* share of the state by which a motion repeats itself */
enum { PERIODS = 2048, ROOM = 65536, MOST = 4096, SWITCHES = 2048, STATE = CAPSULE_STATE_COUNT };
static capsule_map map;
static capsule_workspace workspace;
static capsule_segment segments[ROOM];
static capsule_parameters parameters[MOST];
static double starts[MOST][STATE + 1];
static capsule_state states[MOST];
static int8_t stops[MOST];

/* Reads a line; whether there was one. */
static int read(int to)
{
    double row[CAPSULE_PARAMETER_COUNT + STATE + 1];
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        if (scanf("%lf", &row[i]) != 1)
            return 0;
    memcpy(&parameters[to], row, sizeof *parameters);
    memcpy(starts[to], row + CAPSULE_PARAMETER_COUNT, sizeof *starts);
    return 1;
}

static capsule_state begun(int row, double by, double faster)
{
    const double *x = starts[row];
    return capsule_state_at(&map, x[0] + by, x[1], x[2] + faster, x[STATE]);
}

static void alone(int precision, long periods, size_t most)
{
    size_t written = 0;
    capsule_outcome open = 0;
    capsule_state state = begun(0, 0, 0);
    const capsule_request request = {.segments = segments, .room = most, .precision = precision};
    const capsule_stop stop = capsule_run(&map, &state, periods, &request, &written, &open);
    printf("%d %d %.17g %.17g %.17g %.17g", stop, open, state.x_r, state.v_r, state.v_c, state.position);
    for (size_t i = 0; i < written; i++)
        printf(" %d %d %.17g", segments[i].field, segments[i].target, segments[i].duration);
    printf("\n");
}

static void in_lanes(int lanes, long periods, int own)
{
    capsule_event first[8] = {{0}};
    const double x_r = starts[0][0], v_c = starts[0][2];
    for (int i = 0; i < lanes; i++) {
        const double off = i == own ? 0 : 0.01 * (i + 1);
        parameters[i] = parameters[0];
        states[i] = begun(0, x_r > 0.02 ? off : -off, v_c > 0 ? off : v_c < 0 ? -off : 0);
    }
    const capsule_state start = states[own];
    const capsule_batch batch = {.stride = 1, .parameters = parameters, .states = states,
                                 .stops = stops, .lanes = lanes, .first = first};
    if (capsule_run_many(&batch, (size_t)lanes, periods, &workspace) != CAPSULE_DONE)
        exit(3);
    const capsule_state *end = &states[own];
    const wide turns = 6.283185307179586476925286766559L * (wide)(end->period - start.period);
    const wide angle = turns + end->angle - start.angle + end->angle_rest - start.angle_rest;
    const double duration = (double)(angle / ((const double *)parameters)[CAPSULE_OMEGA_AT]);
    printf("%d %d %d %.17g %d\n", stops[own], first[own].field, first[own].plane, duration,
           end->plane != 0);
}

/* Reads all lines, and the runs' starts. */
static int read_all(void)
{
    int count = 0;
    for (; count < MOST && read(count); count++) {
        if (capsule_map_make(&parameters[count], &map) != CAPSULE_DONE)
            exit(4);
        states[count] = begun(count, 0, 0);
    }
    return count;
}

/* Runs that continue from switch to switch until all of them have ended. */
static void switches(int lanes, long periods)
{
    static capsule_event first[MOST], passed[MOST][SWITCHES];
    static capsule_state turned[MOST];
    static int row[MOST], number[MOST], ended[MOST];
    const int count = read_all();
    static capsule_parameters all[MOST];
    memcpy(all, parameters, sizeof all);
    memcpy(turned, states, sizeof turned);
    for (int going = count; going;) {
        int held = 0;
        for (int i = 0; i < count; i++)
            if (!number[i] || ended[i] == CAPSULE_FULL)
                parameters[held] = all[i], states[held] = turned[i], row[held++] = i;
        memset(first, 0, sizeof first);
        const capsule_batch batch = {.stride = 1, .parameters = parameters, .states = states,
                                     .stops = stops, .position = 1, .lanes = lanes, .first = first};
        if (capsule_run_many(&batch, (size_t)held, periods, &workspace) != CAPSULE_DONE)
            exit(3);
        going = 0;
        for (int k = 0; k < held; k++) {
            const int i = row[k];
            turned[i] = states[k], ended[i] = stops[k];
            if (number[i] == SWITCHES)
                exit(5);
            passed[i][number[i]++] = first[k];
            going += stops[k] == CAPSULE_FULL;
        }
    }
    for (int i = 0; i < count; i++) {
        const capsule_state *s = &turned[i];
        printf("%d -1 %.17g %.17g %.17g %.17g", ended[i], s->x_r, s->v_r, s->v_c, s->position);
        for (int k = 0; k < number[i] && passed[i][k].field; k++)
            printf(" %d %d %.17g", passed[i][k].field, passed[i][k].plane, passed[i][k].angle);
        printf("\n");
    }
}

/* All lines together; with `timed` how long they take, and their switches. */
static void many(int lanes, long periods, int timed)
{
    const int count = read_all();
    const capsule_batch batch = {.stride = 1, .parameters = parameters, .states = states,
                                 .stops = stops, .lanes = lanes, .position = !timed};
    const clock_t begin = clock();
    if (capsule_run_many(&batch, (size_t)count, periods, &workspace) != CAPSULE_DONE)
        exit(3);
    const clock_t end = clock();
    long passed = 0;
    double seconds = 0;
    for (int i = 0; i < count; i++) {
        if (!timed) {
            const capsule_state *s = &states[i];
            printf("%d %.17g %.17g %.17g %.17g\n", stops[i], s->x_r, s->v_r, s->v_c, s->position);
            continue;
        }
        size_t written;
        capsule_outcome open;
        capsule_map_make(&parameters[i], &map);
        capsule_state state = begun(i, 0, 0);
        const capsule_request request = {.segments = segments, .room = ROOM};
        const clock_t one = clock();
        capsule_run(&map, &state, periods, &request, &written, &open);
        seconds += (double)(clock() - one);
        passed += (long)written;
    }
    if (timed)
        printf("%.9g %.9g %ld\n", (double)(end - begin) / CLOCKS_PER_SEC, seconds / CLOCKS_PER_SEC,
               passed);
}

/* The periodic motion that a run comes to, and its orbit. */
static void settled(int longest, long periods)
{
    static double strobe[PERIODS + 1][3];
    size_t written = 0;
    capsule_outcome open;
    capsule_state state = begun(0, 0, 0);
    const capsule_request request = {.strobe = strobe};
    const capsule_stop stop = capsule_run(&map, &state, periods, &request, &written, &open);
    const double *end = strobe[periods];
    int number = 0;
    for (int k = stop == CAPSULE_DONE ? 1 : longest + 1; k <= longest && !number; k++) {
        double off = 0, size = 1;
        for (int i = 0; i < 3; i++) {
            off = fmax(off, fabs(end[i] - strobe[periods - k][i]));
            size = fmax(size, fabs(end[i]));
        }
        number = off < SAME * size ? k : 0;
        if (off < 1e3 * SAME * size) /* else a shorter motion that is hardly reached looks like a longer one */
            break;
    }
    capsule_orbit orbit = {.status = -1};
    const capsule_orbit_request asked = {.segments = segments, .room = ROOM};
    if (number && capsule_solve_orbit(&map, end, number, &asked, &orbit) != CAPSULE_DONE)
        orbit.status = -2;
    printf("%d %d", number, orbit.status);
    for (int i = 0; i < 3; i++)
        printf(" %.17g %.17g", orbit.state[i], end[i]);
    printf("\n");
}

int main(int argc, char **argv)
{
    if (argc < 4)
        return 2;
    const int number = atoi(argv[2]);
    const long periods = atol(argv[3]);
    if (!strcmp(argv[1], "switches")) {
        switches(number, periods);
        return 0;
    }
    if (!strcmp(argv[1], "many") || !strcmp(argv[1], "time")) {
        many(number, periods, argv[1][0] == 't');
        return 0;
    }
    for (int line = 0; read(0); line++) {
        if (capsule_map_make(&parameters[0], &map) != CAPSULE_DONE)
            printf("%d\n", CAPSULE_REFUSED);
        else if (argv[1][0] == 'a')
            alone(number, periods, (size_t)fmin(atof(argv[4]), ROOM));
        else if (!strcmp(argv[1], "motion"))
            settled(number, periods);
        else
            in_lanes(number, periods, line % number);
    }
    return 0;
}
