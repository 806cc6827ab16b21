/* One segment in 106 bits, for what double precision leaves open. */
#define WIDE
#include "tables.h"

#include "scalar.h"

#ifndef CODE
#define CODE capsule_code_wide
#endif
const capsule_code CODE = {run_segment, field_at, 0};
