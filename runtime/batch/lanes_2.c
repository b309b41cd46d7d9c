/* Steps of 2 motions side by side: lanes_step.inc. */
#include "runtime/core/base/core.h"

#define LANES 2
#define VARIANT 2
#include "runtime/batch/lanes_step.inc"
