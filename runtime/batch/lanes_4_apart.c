/* Steps of 4 motions side by side for processors with shorter vectors: lanes_step.inc. */
#include "runtime/core/base/core.h"

#define LANES 4
#define VARIANT 4_apart
#include "runtime/batch/lanes_step.inc"
