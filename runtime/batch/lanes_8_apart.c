/* Steps of 8 motions side by side where vectors are shorter: see lanes_step.h. */
#include "base/arithmetic.h"

#define LANES 8
#define VARIANT 8_apart
#include "batch/lanes_step.h"
