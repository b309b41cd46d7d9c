/*
 * The smallest change, in the metric M, that meets the rows (theory, sect. 8.3): min dq^T M dq with u dq =
 * -residual:   dq = -M^-1 u^T (u M^-1 u^T)^-1 residual. With M = L L^T and the rows A = u L^-T
 * orthonormalised this is dq = L^-T z, z the shortest solution of A z = -residual. No product u M^-1 u^T is
 * formed, so that dependent rows are recognised at full precision.
 */
#include "runtime/core/constraints/constraints.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* Factors L L^T = M into work->reduced. Returns -1, or the coordinate without a positive pivot. */
static int factor_reduced(struct refdyn_workspace *work) {
    memcpy(work->reduced, work->M, (size_t)(work->n * work->n) * sizeof(double));
    return refdyn_factor(work->reduced, work->n, work->n);
}

/* Factors M + u^T W u, with W diagonal and of the size of M. The additional term is equal for all changes
 * that satisfy the rows, so that the smallest change is that of M even where M is singular. */
static int factor_with_rows(struct refdyn_workspace *work) {
    const int n = work->n;
    double trace = 0;
    for (int j = 0; j < n; j++)
        trace += work->M[j * n + j];
    memcpy(work->reduced, work->M, (size_t)(n * n) * sizeof(double));
    for (int a = 0; a < work->m; a++) {
        const double *row = work->u + a * n, size = refdyn_largest_coefficient(work, a);
        const double square = fmax(dense_dot(row, row, n), size * size);
        for (int i = 0; i < n && square > 0; i++)
            dense_add(work->reduced + i * n, trace / n * row[i] / square, row, n);
    }
    return refdyn_factor(work->reduced, n, n);
}

int refdyn_factor_metric(struct refdyn_workspace *work) {
    int failed = factor_reduced(work);
    if (failed >= 0)
        failed = factor_with_rows(work);
    if (failed < 0)
        return REFDYN_OK;
    if (refdyn_fault_not_finite(work))
        return REFDYN_NOT_FINITE;
    work->fault = (struct refdyn_fault){.row = -1, .coordinate = failed};
    return REFDYN_MASS_NOT_POSITIVE;
}

/* A = u L^-T for the marked rows, each divided by the length that it would have without cancellation, as is
 * its entry of `wanted`. Zero rows are unmarked. */
static void spread_rows(struct refdyn_workspace *work, int *active) {
    const int n = work->n;
    for (int a = 0; a < work->m; a++) {
        if (!active[a])
            continue;
        double *row = work->basis + a * n;
        memcpy(row, work->u + a * n, (size_t)n * sizeof *row);
        refdyn_factor_half_forward(work->reduced, n, n, row);
        const double share = refdyn_share_of_size(work, a), length = sqrt(dense_dot(row, row, n)) / share;
        active[a] = share > 0 && length > 0;
        for (int j = 0; j < n && active[a]; j++)
            row[j] /= length;
        if (active[a])
            work->wanted[a] /= length;
    }
}

/* Returns the marked row with the largest independent part; -1 if no such part exceeds rank_tol. */
static int longest_row(const struct refdyn_workspace *work, const int *active, double *length) {
    const int n = work->n;
    int longest = -1;
    *length = work->rank_tol;
    for (int a = 0; a < work->m; a++) {
        const double *row = work->basis + a * n;
        const double size = active[a] ? sqrt(dense_dot(row, row, n)) : 0;
        if (size > *length) {
            longest = a;
            *length = size;
        }
    }
    return longest;
}

/* z (n): the shortest solution of A z = wanted, by modified Gram-Schmidt with row pivoting; dependent rows
 * drop out. */
static void shortest_solution(struct refdyn_workspace *work, int *active, double *z) {
    const int n = work->n;
    double length;
    for (int j = 0; j < n; j++)
        z[j] = 0;
    for (int a = longest_row(work, active, &length); a >= 0; a = longest_row(work, active, &length)) {
        double *basis = work->basis + a * n;
        const double part = work->wanted[a] / length;
        for (int j = 0; j < n; j++)
            basis[j] /= length;
        dense_add(z, part, basis, n);
        active[a] = 0;
        for (int b = 0; b < work->m; b++) {
            double *row = work->basis + b * n;
            if (!active[b])
                continue;
            const double along = dense_dot(row, basis, n);
            dense_add(row, -along, basis, n);
            work->wanted[b] -= along * part;
        }
    }
}

void refdyn_smallest_change(struct refdyn_workspace *work, enum refdyn_row_level last, const double *residual,
                            double *change) {
    int *active = work->mark + work->n;
    for (int a = 0; a < work->m; a++) {
        active[a] = work->model->rows[a].level <= last;
        work->wanted[a] = -residual[a];
    }
    spread_rows(work, active);
    shortest_solution(work, active, change);
    refdyn_factor_half_backward(work->reduced, work->n, work->n, change);
}

double refdyn_metric_length(const struct refdyn_workspace *work, const double *change) {
    const int n = work->n;
    double sum = 0;
    for (int k = 0; k < n; k++) {
        const double *row = work->reduced + k * n, part = dense_dot(row + k, change + k, n - k);
        sum += part * part / row[k];
    }
    return sqrt(sum);
}

void refdyn_metric_unspread(const struct refdyn_workspace *work, double *z) {
    refdyn_factor_half_backward(work->reduced, work->n, work->n, z);
}
