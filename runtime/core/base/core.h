/* What every file of the runtime rests on. */
#ifndef REFDYN_CORE_H
#define REFDYN_CORE_H

#include <float.h>
#include <stddef.h>
#include <stdint.h>

#include "refdyn.h"

/*
 * The arithmetic that the runtime is written for: NaN, infinities and signed zeros, each operation rounded to
 * a double by itself and in the order that is written.
 *
 * Every source file includes this before all else. It stops where a compiler tells that its flags change
 * that, and turns off what compilers change without telling. What remains, refdyn_arithmetic_is_exact finds.
 */

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

/* Does what this library was compiled to do round and order its operations as they are written? */
int refdyn_arithmetic_is_exact(void);

/* Functions that become part of each of their callers. */

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

/*
 * Laying arrays out in one piece of memory: the same list of takes counts bytes (base NULL) and hands them
 * out.
 */

struct layout {
    char *base; /* NULL: only count */
    size_t used;
};

/* Next array of count doubles, or of ints, which fill whole doubles, so that both stay aligned; NULL while
 * counting. More bytes than a size_t can count are SIZE_MAX, which no memory has. */
static inline double *layout_doubles(struct layout *layout, int count) {
    double *array = layout->base ? (double *)(void *)(layout->base + layout->used) : NULL;
    const size_t left = (SIZE_MAX - layout->used) / sizeof(double), wanted = (size_t)count;
    layout->used = wanted > left ? SIZE_MAX : layout->used + wanted * sizeof(double);
    return array;
}

static inline int *layout_ints(struct layout *layout, int count) {
    const int per_double = (int)(sizeof(double) / sizeof(int));
    return (int *)(void *)layout_doubles(layout, count / per_double + (count % per_double != 0));
}

static inline int layout_fits(const void *memory, size_t size, size_t needed) {
    return memory && needed < SIZE_MAX && (uintptr_t)memory % sizeof(double) == 0 && size >= needed;
}

/* May a model be used, and a workspace; units of its coordinates. */

/* Is it there, and of this version? Another one's fields may be read no further than interface_version. */
static inline int refdyn_model_is_readable(const struct refdyn_model *model) {
    return model && model->interface_version == REFDYN_MODEL_VERSION;
}

/* Errors: BAD_MODEL, OTHER_VERSION. */
int refdyn_model_status(const struct refdyn_model *model);
/* The same of a workspace's model; BAD_MEMORY when its arrays are not laid out. */
int refdyn_workspace_status(const struct refdyn_workspace *work);

/* Number of doubles in the result of `required`. */
int refdyn_required_count(const struct refdyn_model *model);

/* Place in p of the parameter that says whether the contact of event i rests. */
static inline int refdyn_contact_mode_place(const struct refdyn_model *model, int i) {
    return model->changes[model->events[i].first_change].place;
}
/* Change of coordinate j that counts as much as 1 rad: `length` for a translation, 0: that of the model; 1
 * for a rotation. */
double refdyn_coordinate_unit(const struct refdyn_model *model, int j, double length);

#endif
