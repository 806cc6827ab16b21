/* The gateway for one run; capsule_simulate.m tells what it takes and gives. */
#include "gateway.h"

enum { GROWTH = 4096 }; /* segments that are made room for at first */

/* A column of doubles of a table. */
static double *column(mxArray *table, const char *name, size_t rows, size_t columns)
{
    mxArray *made = mxCreateDoubleMatrix(rows, columns, mxREAL);
    mxSetField(table, 0, name, made);
    return mxGetPr(made);
}

static mxArray *table_of(const capsule_segment *segments, size_t count, double omega)
{
    const char *const names[] = {"field",  "source", "target", "outcome",  "time", "duration",
                                 "start",  "end",    "x_c",    "advance"};
    mxArray *table = mxCreateStructMatrix(1, 1, 10, (const char **)names);
    double *column_of[10];
    for (int k = 0; k < 10; k++)
        column_of[k] = column(table, names[k], count, k == 6 || k == 7 ? 3 : 1);
    for (size_t i = 0; i < count; i++) {
        const capsule_segment *s = segments + i;
        const double time = (6.283185307179586 * (double)s->start_period + s->start_angle) / omega;
        const double values[] = {s->field, s->source, s->target, s->outcome, time, s->duration};
        for (int k = 0; k < 6; k++)
            column_of[k][i] = values[k];
        for (int k = 0; k < 3; k++) {
            column_of[6][i + k * count] = s->start[k];
            column_of[7][i + k * count] = s->end[k];
        }
        column_of[8][i] = s->position;
        column_of[9][i] = s->advance;
    }
    return table;
}

void mexFunction(int results, mxArray *result[], int count, const mxArray *given[])
{
    static capsule_map map;
    if (count < 2 || count > 5 || results > 1)
        mexErrMsgIdAndTxt("capsule:input", "r = capsule_simulate(p, periods, state, phase, times)");
    const capsule_parameters parameters = parameters_of(given[0]);
    const int64_t periods = periods_of(given[1]);
    const double rest[3] = {0, 0, 0};
    const double *start = count > 2 ? matrix(given[2], "state", 1, 3) : rest;
    const double period = 6.283185307179586 / parameters.omega;
    const double phase = count > 3 ? number(given[3], "phase", 0, period) : 0;

    capsule_map_make(&parameters, &map);
    capsule_state state = capsule_state_at(&map, start[0], start[1], start[2], phase);
    size_t room = GROWTH, held = 0, written = 0;
    capsule_segment *segments = mxMalloc(room * sizeof *segments);
    capsule_outcome open;
    capsule_stop stop;
    do {
        if (held == room) {
            room *= 2;
            segments = mxRealloc(segments, room * sizeof *segments);
        }
        const capsule_request request = {
            .segments = segments + held, .room = room - held, .position = 1};
        stop = capsule_run(&map, &state, periods, &request, &written, &open);
        held += stop == CAPSULE_REFUSED ? 0 : written;
    } while (stop == CAPSULE_FULL);
    if (stop == CAPSULE_REFUSED)
        mexErrMsgIdAndTxt("capsule:input", "no run from this state");

    const char *const names[] = {"status", "period", "final", "segments", "y"};
    result[0] = mxCreateStructMatrix(1, 1, 5, (const char **)names);
    mxSetField(result[0], 0, "status", mxCreateString(STATUS[stop]));
    *column(result[0], "period", 1, 1) = (double)state.period;
    double *final = column(result[0], "final", 1, 4);
    final[0] = state.x_r, final[1] = state.v_r, final[2] = state.v_c, final[3] = state.position;
    mxSetField(result[0], 0, "segments", table_of(segments, held, parameters.omega));
    if (count > 4) {
        const double *times = matrix(given[4], "times", 0, 0);
        const size_t n = mxGetNumberOfElements(given[4]);
        double (*states)[4] = mxMalloc((n + 1) * sizeof *states);
        const size_t done =
            held ? capsule_evaluate(&map, segments, held, 0, times, n, states, NULL) : 0;
        double *y = column(result[0], "y", done, 4);
        for (size_t i = 0; i < done; i++)
            for (int k = 0; k < 4; k++)
                y[i + k * done] = states[i][k];
        mxFree(states);
    }
    mxFree(segments);
}
