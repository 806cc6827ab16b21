/* Orbits by the C library of the second model: each line on stdin has parameters and a state. For each
   the derivatives of a line come back: whether there is an orbit that drifts at angle 0, and of that
   state, monodromy, derivatives of the state by the parameters, progression and its gradient; then of
   its itinerary, solved for again, the largest residual, trace and determinant of the monodromy. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "capsule.h"

enum { ROOM = 4096, MOST = 64, SETTLED = 300, S = CAPSULE_STATE_COUNT, P = CAPSULE_PARAMETER_COUNT };
static capsule_map map;
static capsule_segment segments[ROOM];
static int32_t fields[MOST];
static double z[CAPSULE_UNKNOWNS(MOST)], workspace[CAPSULE_ITINERARY_ROOM(MOST)];
static double block[CAPSULE_EQUATIONS_ROOM(MOST)];

static void print(const double *values, int count)
{
    for (int i = 0; i < count; i++)
        printf(" %.17g", values[i]);
}

/* The orbit's itinerary from its second segment on: angle 0 lies within the last one then. With pulses a
   segment begins there, and the itinerary is that from the first one on. */
static void print_itinerary(const capsule_parameters *given, int count, int periods)
{
    const int first = CAPSULE_PULSED ? 0 : 1, n = count - first;
    const capsule_itinerary itinerary = {fields, n, periods, 0};
    const capsule_itinerary_request request = {.workspace = workspace};
    capsule_system system = capsule_equations_in(block, n);
    capsule_parameters parameters = *given;
    capsule_solution solution;
    memcpy(z, segments[first].start, sizeof segments[first].start);
    z[S] = segments[first].start_angle;
    for (int i = 0; i < n; i++) {
        fields[i] = segments[i + first].field;
        z[S + 1 + i] = segments[i + first].duration;
    }
    if (first)
        z[S + n] += segments[0].duration;
    if (capsule_solve_itinerary(&itinerary, &request, &parameters, z, &system, &solution) !=
            CAPSULE_DONE || solution.status != CAPSULE_SOLVED)
        exit(3);
    const double *m = system.monodromy;
    const double trace = m[0] + m[4] + m[8];
    const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) -
                               m[1] * (m[3] * m[8] - m[5] * m[6]) +
                               m[2] * (m[3] * m[7] - m[4] * m[6]);
    const double found[] = {solution.residual, trace, determinant};
    print(found, 3);
}

int main(int argc, char **argv)
{
    const int periods = argc > 1 ? atoi(argv[1]) : 1;
    double values[P], start[S];
    for (;;) {
        for (int i = 0; i < P + S; i++)
            if (scanf("%lf", i < P ? &values[i] : &start[i - P]) != 1)
                return 0;
        capsule_parameters parameters;
        memcpy(&parameters, values, sizeof parameters);
        if (capsule_map_make(&parameters, &map) != CAPSULE_DONE)
            return 1;
        capsule_state state = capsule_state_at(&map, start[0], start[1], start[2], 0.0);
        const capsule_request run = {.segments = NULL, .room = 0};
        size_t written;
        capsule_outcome open;
        capsule_stop stop = capsule_run(&map, &state, SETTLED, &run, &written, &open);
        const double settled[] = {state.x_r, state.v_r, state.v_c};
        capsule_orbit orbit = {.status = -1};
        const capsule_orbit_request asked = {.segments = segments, .room = ROOM, .gradients = 1};
        if (stop == CAPSULE_DONE)
            stop = capsule_solve_orbit(&map, settled, periods, &asked, &orbit);
        const int n = orbit.segments;
        const int fit = stop == CAPSULE_DONE && orbit.status == CAPSULE_CLOSED &&
                        orbit.state[2] != 0.0 && n > 2 && n < MOST &&
                        (CAPSULE_PULSED || segments[0].field == segments[n - 1].field);
        printf("%d", fit);
        if (fit) {
            print(orbit.state, S);
            print(orbit.monodromy, S * S);
            print(orbit.by_parameter, S * P);
            print(&orbit.progression, 1);
            print(orbit.gradients + P, P);
            print_itinerary(&parameters, n, periods);
        }
        printf("\n");
    }
}
