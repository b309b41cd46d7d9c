/* What judges the emitted C. */
#ifndef REFDYN_TESTS_JUDGE_H
#define REFDYN_TESTS_JUDGE_H

#include "gen/gen.h"

/* The interpreter of the plan. The arguments are those of the emitted function; p begins with the parameters,
 * and the interpreter computes the derived values. 0 if the function exists. */
int judge_interpret(const struct generation *generation, const char *quantity, const double *p,
                    const double *x, double t, const double *q, const double *qd, double *out);

#endif
