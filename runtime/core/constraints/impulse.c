/*
 * Jumps of rates by an impulse.
 *
 * An impulse p along a gradient g acts with impulses mu of the rows u that hold before and after it. It
 * changes the rates by dqd with
 *     M dqd = g^T p + u^T mu,   u dqd = 0,   g dqd = change
 * (Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 8). With M = L L^T and the
 * rows u L^-T orthonormalised, and r the part of g L^-T orthogonal to them, dqd = L^-T r change / (r . r).
 *
 * Where the rows themselves jump, M dqd = u^T mu and u dqd = change. This is solved row after row: the part
 * of a row that is orthogonal to the rows before it takes up the change that these leave open.
 */
#include "runtime/core/constraints/constraints.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

double refdyn_leave_rest(const struct refdyn_workspace *work, int count, double *x) {
    const int n = work->n;
    const double before = sqrt(dense_dot(x, x, n));
    for (int pass = 0; pass < 2; pass++) /* twice against rounding */
        for (int k = 0; k < count; k++) {
            const double *along = work->basis + k * n;
            dense_add(x, -dense_dot(x, along, n), along, n);
        }
    return before > 0 ? sqrt(dense_dot(x, x, n)) / before : 0;
}

/* Removes from row a, in the metric M, its components along the first `count` vectors of the basis, and
 * appends it with length 1. Returns the length before that; 0 if the row depends on those before it. */
static double spread_row(struct refdyn_workspace *work, int a, int count) {
    const int n = work->n;
    double *row = work->basis + count * n;
    memcpy(row, work->u + a * n, (size_t)n * sizeof *row);
    refdyn_factor_half_forward(work->reduced, n, n, row);
    const double share = refdyn_share_of_size(work, a);
    if (!(refdyn_leave_rest(work, count, row) * share > work->rank_tol))
        return 0;
    const double length = sqrt(dense_dot(row, row, n));
    for (int j = 0; j < n; j++)
        row[j] /= length;
    return length;
}

int refdyn_spread_programme(struct refdyn_workspace *work, enum refdyn_row_level last) {
    const int rows = refdyn_programme_rows(work->model);
    int count = 0;
    for (int a = 0; a < rows; a++)
        count += work->model->rows[a].level <= last && spread_row(work, a, count) > 0;
    return count;
}

int refdyn_impulse(struct refdyn_workspace *work, const double *gradient, double change, double *jump) {
    const int n = work->n, status = refdyn_factor_metric(work);
    if (status)
        return status;
    const int count = refdyn_spread_programme(work, REFDYN_VELOCITY);
    memcpy(jump, gradient, (size_t)n * sizeof *jump);
    refdyn_factor_half_forward(work->reduced, n, n, jump);
    if (!(refdyn_leave_rest(work, count, jump) > work->rank_tol))
        return REFDYN_EVENT_NOT_MET;
    const double scale = change / dense_dot(jump, jump, n);
    for (int j = 0; j < n; j++)
        jump[j] *= scale;
    refdyn_factor_half_backward(work->reduced, n, n, jump);
    return REFDYN_OK;
}

/* Returns u_a L^-T . z for row a and z = L^T dqd. */
static double along_row(const struct refdyn_workspace *work, int a, const double *z, double *room) {
    memcpy(room, work->u + a * work->n, (size_t)work->n * sizeof *room);
    refdyn_factor_half_forward(work->reduced, work->n, work->n, room);
    return dense_dot(room, z, work->n);
}

int refdyn_impulse_of_rows(struct refdyn_workspace *work, const double *change, double *jump) {
    const int n = work->n, status = refdyn_factor_metric(work);
    int count = 0;
    if (status)
        return status;
    memset(jump, 0, (size_t)n * sizeof *jump);
    for (int a = 0; a < work->m; a++) {
        if (work->model->rows[a].level == REFDYN_ACCELERATION)
            continue;
        const double own = change[a] - along_row(work, a, jump, work->change);
        const double length = spread_row(work, a, count);
        if (length > 0)
            dense_add(jump, own / length, work->basis + count++ * n, n);
    }
    refdyn_factor_half_backward(work->reduced, n, n, jump);
    return REFDYN_OK;
}
