/* The motion as a system of first order, y' = f(t, y) with y = (q, qd, work_done) (2 n + 1), for integrators
 * that require this form: f, and its exact derivative. */
#ifndef REFDYN_FIRST_ORDER_H
#define REFDYN_FIRST_ORDER_H

#include "runtime/core/methods/methods.h"

/* dydt := f(t, y). Overwrites the step's `side`. Errors: those of refdyn_accelerate. */
int refdyn_first_order_rates(struct refdyn_step *step, double t, const double *y, double *dydt);
/* df/dy (row-major) and df/dt (2 n + 1) at (t, y). The row of work_done is 0. The motion needs memory for a
 * tangent, that of an implicit method. Errors: NOT_FINITE, MATRIX_SINGULAR. */
int refdyn_first_order_jacobian(struct refdyn_step *step, double t, const double *y, double *by_y,
                                double *by_t);

#endif
