/*
 * Numbers of one motion, or of several side by side, in the same statements.
 *
 * Each file that includes this defines LANES, how many motions there are, and NAMED(name), which makes its
 * names its own. An entry of all motions is one `lane`: a vector of LANES doubles, and for one motion a
 * double. No motion looks at another one, and each gets the bits that it gets alone.
 *
 * Functions with lanes among their arguments are INLINE: behind a call of others gcc leaves the upper halves
 * of wide registers in use, and processors take a hundred cycles to go on with code that knows but the lower.
 */
#ifndef REFDYN_LANE_H
#define REFDYN_LANE_H

#include "base/inline.h"

#include <math.h>

#if LANES == 1
typedef double NAMED(lane);
typedef int NAMED(mask);
#else
typedef double NAMED(lane) __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double))));
typedef long long NAMED(mask)
    __attribute__((vector_size(LANES * sizeof(long long)), aligned(sizeof(long long))));
#endif
#define LANE NAMED(lane)
#define MASK NAMED(mask)

/* The value of motion number `lane`. */
#if LANES == 1
#define OF_LANE(value, lane) (*((lane) + &(value)))
#else
#define OF_LANE(value, lane) ((value)[lane])
#endif

INLINE LANE NAMED(every)(double x) {
#if LANES == 1
    return x;
#else
    return (LANE){0} + x;
#endif
}

/* where ? a : b, of each motion */
INLINE LANE NAMED(select)(MASK where, LANE a, LANE b) {
#if LANES == 1
    return where ? a : b;
#else
    return (LANE)(((MASK)a & where) | ((MASK)b & ~where));
#endif
}

INLINE LANE NAMED(root)(LANE x) {
    for (int lane = 0; lane < LANES; lane++)
        OF_LANE(x, lane) = sqrt(OF_LANE(x, lane));
    return x;
}

INLINE LANE NAMED(size)(LANE x) {
#if LANES == 1
    return fabs(x);
#else
    return (LANE)((MASK)x & 0x7fffffffffffffff); /* without its sign */
#endif
}

INLINE int NAMED(any)(MASK where) {
    int any = 0;
    for (int lane = 0; lane < LANES; lane++)
        any |= OF_LANE(where, lane) != 0;
    return any;
}

/* The larger one; a NaN counts as larger than all. */
INLINE LANE NAMED(larger)(LANE a, LANE b) {
    return NAMED(select)((a >= b) | (a != a), a, b);
}

#endif
