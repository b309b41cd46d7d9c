/*
 * Checks that compiled code computes as it is written.
 *
 * Each check uses values that the compiler does not know. Its result differs if the compiler uses the
 * optimisation in the comment.
 */
#include "runtime/core/base/arithmetic.h"

#include <math.h>

/* Not (a + b) - b = a: the sum is rounded to a double first. */
static int keeps_order(void) {
    const volatile double small = 1, large = 0x1p53;
    const double a = small, b = large;
    return (a + b) - b == 0;
}

/* Not a (1/10) for a / 10. */
static int divides(void) {
    const volatile double three = 3;
    return three / 10.0 == 0.3;
}

/* a^2 = 1 + 2^-26 + 2^-54 is rounded before it is added to. */
static int rounds_products(void) {
    const volatile double factor = 1 + 0x1p-27, minus = -(1 + 0x1p-26);
    const double a = factor, b = minus;
    return a * a + b == 0;
}

/* Not a + 0 = a: -0 + 0 = 0. */
static int keeps_signs_of_zeros(void) {
    const volatile double zero = -0.0;
    return 1 / (zero + 0.0) > 0;
}

static int knows_infinities(void) {
    const volatile double large = DBL_MAX;
    const double infinite = large * 2, undefined = infinite - infinite;
    return !isfinite(infinite) && isnan(undefined) && undefined != undefined && !(undefined <= large);
}

int refdyn_arithmetic_is_exact(void) {
    return keeps_order() && divides() && rounds_products() && keeps_signs_of_zeros() && knows_infinities();
}
