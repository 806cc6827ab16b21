/* One segment in 106 bits, for what double precision leaves open. */
#define WIDE
#include "tables.h"

#include "solo.h"
