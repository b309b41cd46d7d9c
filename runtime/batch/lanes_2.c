/* Steps of 2 motions side by side: see lanes_step.h. */
#include "base/arithmetic.h"

#define LANES 2
#define VARIANT 2
#include "batch/lanes_step.h"
