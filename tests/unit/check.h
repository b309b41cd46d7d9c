/* Checks of a unit test: one line for each that fails, and `N passed, N failed` at the end. */
#ifndef CHECK_H
#define CHECK_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int checks_passed, checks_failed;

static inline void check_result(int holds, const char *file, int line, const char *text) {
    if (holds) {
        checks_passed++;
        return;
    }
    checks_failed++;
    printf("%s:%d: %s\n", file, line, text);
}

static inline void check_value(double value, double expected, double tolerance, const char *file, int line,
                               const char *text) {
    if (fabs(value - expected) <= tolerance) {
        checks_passed++;
        return;
    }
    checks_failed++;
    printf("%s:%d: %s: %.17g, not %.17g (off by %.3g, %.3g is allowed)\n", file, line, text, value, expected,
           value - expected, tolerance);
}

#define CHECK(condition) check_result(!!(condition), __FILE__, __LINE__, #condition)
#define CHECK_NEAR(value, expected, tolerance) \
    check_value(value, expected, tolerance, __FILE__, __LINE__, #value)

static inline int check_summary(void) {
    printf("%d passed, %d failed\n", checks_passed, checks_failed);
    return checks_failed ? EXIT_FAILURE : EXIT_SUCCESS;
}

#endif
