/* Steps of 4 motions side by side where vectors are shorter: see lanes_step.inc. */
#include "runtime/core/base/core.h"

#define LANES 4
#define VARIANT 4_apart
#include "runtime/batch/lanes_step.inc"
