/*
 * The exact Jacobian of the motion as a system of first order.
 *
 * In: the emitted `tangent` at a state. Out: the derivatives of the accelerations a by positions, rates and
 * time, from (linearisation.c)
 *     [ M  -u^T ] [ da      ]   [ -K   dq - D    dqd - f_t dt ]
 *     [ u   0   ] [ dlambda ] = [ -G_q dq - G_qd dqd - g_t dt ]
 * with one factorisation and a solution for each column.
 */
#include "runtime/core/base/core.h"

#include "runtime/bindings/gsl/first_order.h"

#include <string.h>

/* column[i stride] := changes of the accelerations. */
static void fill_column(struct refdyn_linear *linear, enum refdyn_by by, int j, double *column, int stride) {
    refdyn_linear_change_by(linear, by, j);
    for (int i = 0; i < linear->n; i++)
        column[i * stride] = linear->x[i];
}

int refdyn_first_order_rates(struct refdyn_step *step, double t, const double *y, double *dydt) {
    const int status = refdyn_rates(&step->evaluation, t, y, step->side);
    memcpy(dydt, step->side, refdyn_state_bytes(step));
    return status;
}

int refdyn_first_order_jacobian(struct refdyn_step *step, double t, const double *y, double *by_y,
                                double *by_t) {
    struct refdyn_linear *linear = step->linear;
    struct refdyn_workspace *work = step->evaluation.work;
    const int n = step->n, size = 2 * n + 1;
    int status = refdyn_rates(&step->evaluation, t, y, step->side);
    if (!status)
        status = refdyn_linear_evaluate(linear, work, t, y, step->side);
    if (!status)
        status = refdyn_linear_factor_accelerations(linear, work);
    if (status)
        return status;
    memset(by_y, 0, (size_t)(size * size) * sizeof *by_y);
    memset(by_t, 0, (size_t)size * sizeof *by_t);
    for (int j = 0; j < n; j++) {
        by_y[j * size + n + j] = 1;
        fill_column(linear, REFDYN_BY_Q, j, by_y + n * size + j, size);
        fill_column(linear, REFDYN_BY_QD, j, by_y + n * size + n + j, size);
    }
    fill_column(linear, REFDYN_BY_T, 0, by_t + n, 1);
    return REFDYN_OK;
}
