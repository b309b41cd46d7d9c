/* Steps of 4 motions side by side where vectors are shorter: see lanes_step.h. */
#include "base/arithmetic.h"

#define LANES 4
#define VARIANT 4_apart
#include "batch/lanes_step.h"
