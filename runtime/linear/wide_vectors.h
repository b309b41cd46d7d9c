/*
 * Functions that are compiled twice, for wide vectors and for any processor.
 *
 * COMPILE(result, name, parameters, arguments) makes refdyn_NAME of the INLINE function NAME: on x86-64 its
 * version for wide vectors runs where the processor has them. No operation is fused or reordered, so results
 * do not depend on it.
 */
#ifndef REFDYN_WIDE_VECTORS_H
#define REFDYN_WIDE_VECTORS_H

#include "base/inline.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define HAS_WIDE 1
#define WIDE __attribute__((target("avx2")))
#endif
#if defined(__GNUC__) && !defined(__clang__)
#define VECTORISED __attribute__((optimize("O3")))
#else
#define VECTORISED
#endif

#ifdef HAS_WIDE
#define COMPILE(result, name, parameters, arguments)       \
    WIDE VECTORISED static result wide_##name parameters { \
        return name arguments;                             \
    }                                                      \
    VECTORISED result refdyn_##name parameters {           \
        if (__builtin_cpu_supports("avx2"))                \
            return wide_##name arguments;                  \
        return name arguments;                             \
    }
#else
#define COMPILE(result, name, parameters, arguments) \
    VECTORISED result refdyn_##name parameters {     \
        return name arguments;                       \
    }
#endif

#endif
