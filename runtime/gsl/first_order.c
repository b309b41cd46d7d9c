/*
 * The exact Jacobian of the motion as a system of first order.
 *
 * Takes the emitted `tangent` at a state; gives the derivatives of accelerations a by positions, rates and
 * time from (linearise.h)
 *     [ M  -u^T ] [ da      ]   [ -K   dq - D    dqd - f_t dt ]
 *     [ u   0   ] [ dlambda ] = [ -G_q dq - G_qd dqd - g_t dt ]
 * with one factorisation and a solution for each column.
 */
#include "base/arithmetic.h"

#include "private/first_order.h"

#include <string.h>

#include "../private/linearise.h"
#include "../private/slope.h"

/* Changes of the accelerations into column[i stride]. */
static void fill_column(struct refdyn_linear *linear, enum refdyn_by by, int j, double *column, int stride) {
    refdyn_linear_change_by(linear, by, j);
    for (int i = 0; i < linear->n; i++)
        column[i * stride] = linear->x[i];
}

int refdyn_first_order_slope(struct refdyn_drive *drive, double t, const double *y, double *dydt) {
    const int status = refdyn_slope(drive, t, y, drive->side);
    memcpy(dydt, drive->side, (size_t)(2 * drive->work->n + 1) * sizeof *dydt);
    return status;
}

int refdyn_first_order_jacobian(struct refdyn_drive *drive, double t, const double *y, double *by_y,
                                double *by_t) {
    struct refdyn_linear *linear = &drive->linear;
    const int n = drive->work->n, size = 2 * n + 1;
    drive->has_tangent = 0;
    drive->statistics.tangents++;
    int status = refdyn_slope(drive, t, y, drive->side);
    if (!status)
        status = refdyn_linear_evaluate(linear, drive->work, t, y, drive->side);
    if (!status)
        status = refdyn_linear_factor(linear, drive->work, 0);
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
