/* Steps of 8 motions side by side: lanes_step.inc. */
#include "runtime/core/base/core.h"

/* For processors with vectors of this width; for others the compiler splits them (lanes_8_apart.c). */
#if defined(__x86_64__) && defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx512f"))), apply_to = function)
#elif defined(__x86_64__) && defined(__GNUC__)
#pragma GCC target("avx512f")
#endif

#define LANES 8
#define VARIANT 8
#include "runtime/batch/lanes_step.inc"

#if defined(__x86_64__) && defined(__clang__)
#pragma clang attribute pop
#endif
