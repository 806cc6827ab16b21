/* The gateway for many runs side by side; capsule_many.m tells what it takes and gives. */
#include "gateway.h"

void mexFunction(int results, mxArray *result[], int count, const mxArray *given[])
{
    static capsule_map map;
    if (count < 2 || count > 4 || results > 2)
        mexErrMsgIdAndTxt("capsule:input", "[y, status] = capsule_many(P, periods, states, phases)");
    const double *rows = matrix(given[0], "P", 0, CAPSULE_PARAMETER_COUNT);
    const size_t n = mxGetM(given[0]);
    const int64_t periods = periods_of(given[1]);
    const double *starts = count > 2 ? matrix(given[2], "states", n, 3) : NULL;
    const double *phases = count > 3 ? matrix(given[3], "phases", n, 1) : NULL;

    capsule_parameters *parameters = mxMalloc((n + 1) * sizeof *parameters);
    capsule_state *states = mxMalloc((n + 1) * sizeof *states);
    int8_t *stops = mxCalloc(n + 1, sizeof *stops);
    capsule_workspace *workspace = mxCalloc(1, sizeof *workspace);
    for (size_t i = 0; i < n; i++) {
        parameters[i] = checked(rows + i, n);
        const double phase = phases ? phases[i] : 0;
        if (!(0 <= phase && phase < 6.283185307179586 / parameters[i].omega))
            mexErrMsgIdAndTxt("capsule:input", "phases(%d) = %g: must be in [0, 2 pi/omega)",
                              (int)i + 1, phase);
        capsule_map_constants(parameters + i, &map);
        states[i] = capsule_state_at(&map, starts ? starts[i] : 0, starts ? starts[i + n] : 0,
                                     starts ? starts[i + 2 * n] : 0, phase);
    }
    const capsule_batch batch = {
        .stride = 1, .parameters = parameters, .states = states, .stops = stops, .position = 1};
    capsule_run_many(&batch, n, periods, workspace);

    result[0] = mxCreateDoubleMatrix(n, 4, mxREAL);
    result[1] = mxCreateDoubleMatrix(n, 1, mxREAL);
    double *y = mxGetPr(result[0]), *status = mxGetPr(result[1]);
    for (size_t i = 0; i < n; i++) {
        y[i] = states[i].x_r, y[i + n] = states[i].v_r;
        y[i + 2 * n] = states[i].v_c, y[i + 3 * n] = states[i].position;
        status[i] = stops[i];
    }
    mxFree(parameters);
    mxFree(states);
    mxFree(stops);
    mxFree(workspace);
}
