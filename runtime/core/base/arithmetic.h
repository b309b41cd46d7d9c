/*
 * Requirements of the runtime on arithmetic; this header needs no C library.
 *
 * The runtime relies on NaN, infinities and signed zeros, and on each operation being rounded to a double by
 * itself, in the order that is written. Compilation stops where predefined macros show that the compiler's
 * flags change this. Pragmas turn off what compilers change silently; refdyn_arithmetic_is_exact finds the
 * rest at run time.
 */
#ifndef REFDYN_ARITHMETIC_H
#define REFDYN_ARITHMETIC_H

#include <float.h>

#ifdef __FAST_MATH__
#error "The runtime of refdyn needs exact arithmetic: compile it without -ffast-math and -Ofast."
#endif
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "The runtime of refdyn needs infinities and NaN: compile it without -ffinite-math-only."
#endif
#if defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || defined(__NO_SIGNED_ZEROS__)
#error "The runtime of refdyn needs operations as they are written: compile it without \
-funsafe-math-optimizations, -fassociative-math, -freciprocal-math and -fno-signed-zeros."
#endif
#if FLT_EVAL_METHOD < 0 || FLT_EVAL_METHOD == 2
#error "The runtime of refdyn needs each operation rounded to a double: compile it with -msse2 -mfpmath=sse."
#endif
_Static_assert(
    sizeof 0.1 == sizeof(double),
    "The runtime of refdyn needs constants as doubles: compile it without -fsingle-precision-constant.");

/* A product and a sum are two roundings, also where a processor has both in one operation. */
#if defined(__clang__)
#pragma float_control(precise, on)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__) && defined(__FP_FAST_FMA)
#pragma GCC optimize("fp-contract=off")
#endif

/* 1 where this compiled library rounds and orders its operations as they are written, otherwise 0. */
int refdyn_arithmetic_is_exact(void);

#endif
