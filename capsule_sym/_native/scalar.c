/* Segments of one run in double precision, and their evaluation. */
#include "scalar.h"

#include "evaluate.h"

#ifndef CODE
#define CODE capsule_code_plain
#endif
const capsule_code CODE = {run_segment, field_at, states_at};
