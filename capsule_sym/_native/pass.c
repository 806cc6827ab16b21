/* One segment in double precision. */
#include "solo.h"
