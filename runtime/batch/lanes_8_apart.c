/* Steps of 8 motions side by side for processors with shorter vectors: lanes_step.inc. */
#include "runtime/core/base/core.h"

#define LANES 8
#define VARIANT 8_apart
#include "runtime/batch/lanes_step.inc"
