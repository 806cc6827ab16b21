/* One segment in 106 bits, for switches that double precision cannot decide. */
#define WIDE
#include "tables.h"

#include "scalar.h"

#ifndef CODE
#define CODE capsule_code_wide
#endif
const capsule_code CODE = {run_segment, field_at, 0};
