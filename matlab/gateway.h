/* What the gateways share: arguments of MATLAB and Octave, checked, as the C library takes them. */
#ifndef CAPSULE_GATEWAY_H
#define CAPSULE_GATEWAY_H

#include <math.h>
#include <string.h>

#include "capsule.h"
#include "mex.h"

#define NAMED(name) #name,
static const char *const PARAMETERS[] = {CAPSULE_PARAMETERS(NAMED)};
static const char *const STATUS[] = {"done", "full", "open", "stopped", "refused"};

/* The numbers of a real matrix of doubles of so many rows and columns; of any many where one is 0. */
static const double *matrix(const mxArray *given, const char *name, size_t rows, size_t columns)
{
    if (!mxIsDouble(given) || mxIsComplex(given) || mxIsSparse(given) ||
        (rows && mxGetM(given) != rows) || (columns && mxGetN(given) != columns))
        mexErrMsgIdAndTxt("capsule:input", "%s has the wrong size or is not of real doubles", name);
    return mxGetPr(given);
}

static double number(const mxArray *given, const char *name, double low, double high)
{
    const double value = *matrix(given, name, 1, 1);
    if (!(low <= value && value <= high))
        mexErrMsgIdAndTxt("capsule:input", "%s = %g: must be from %g to %g", name, value, low, high);
    return value;
}

static int64_t periods_of(const mxArray *given)
{
    const double value = number(given, "periods", 0, 1e15);
    if (value != floor(value))
        mexErrMsgIdAndTxt("capsule:input", "periods = %g: must be a whole number", value);
    return (int64_t)value;
}

static void require(int fits, const char *name, double value, const char *allowed)
{
    if (!fits || !isfinite(value))
        mexErrMsgIdAndTxt("capsule:input", "%s = %g: must be finite%s", name, value, allowed);
}

/* Parameters one by one, in the order of the names above. */
static capsule_parameters checked(const double *values, size_t stride)
{
    capsule_parameters p;
#define TAKEN(name) p.name = *values, values += stride;
    CAPSULE_PARAMETERS(TAKEN)
#define POSITIVE(name) require(p.name > 0, #name, p.name, " and greater than 0");
    CAPSULE_POSITIVE_PARAMETERS(POSITIVE)
#define NOT_NEGATIVE(name) require(p.name >= 0, #name, p.name, " and at least 0");
    CAPSULE_NOT_NEGATIVE_PARAMETERS(NOT_NEGATIVE)
#define SHARE(name) require(p.name < 1, #name, p.name, " and below 1");
    CAPSULE_SHARE_PARAMETERS(SHARE)
#define FINITE(name) require(1, #name, p.name, "");
    CAPSULE_PARAMETERS(FINITE)
#ifdef CAPSULE_BACK_GAP
    const double room = p.CAPSULE_FRONT_GAP + p.CAPSULE_BACK_GAP;
    require(room > 0, "the sum of both gaps", room, " and greater than 0");
#endif
    return p;
}

static capsule_parameters parameters_of(const mxArray *given)
{
    double values[CAPSULE_PARAMETER_COUNT];
    if (!mxIsStruct(given) || mxGetNumberOfElements(given) != 1)
        mexErrMsgIdAndTxt("capsule:input", "p must be a struct of parameters");
    for (int i = 0; i < CAPSULE_PARAMETER_COUNT; i++) {
        const mxArray *field = mxGetField(given, 0, PARAMETERS[i]);
        if (!field)
            mexErrMsgIdAndTxt("capsule:input", "p.%s is missing", PARAMETERS[i]);
        values[i] = *matrix(field, PARAMETERS[i], 1, 1);
    }
    return checked(values, 1);
}

#endif
