/*
 * Accelerations under programme constraints, and the force that keeps the programme.
 *
 * In: M, f, u, v, k of the workspace. Out: qdd and the programme force r = M qdd - f. Generalized programme
 * motion equations (theory, sect. 8.2): (M_i + P^T M_d) qdd = f_i + P^T f_d with K qdd = k. Eliminating qdd_d
 * = P qdd_i + c, c = K_d^-1 k, leaves n - rank equations with a symmetric positive definite matrix: R qdd_i =
 * [P^T 1] (f
 * - M_d^T c),   R = M_ii + P^T M_di + M_id P + P^T M_dd P.
 *
 * This solution has an error of eps times the condition of R, because M is rounded. The emitted O(n m)
 * function, which forms no M, has an error of eps times the condition of u M^-1 u^T. The latter error, M^-1
 * u^T dlambda, is a smallest change in the metric of M; computed and removed with the partition, it leaves
 * the smaller of both errors (theory, sect. 8.2).
 */
#include "runtime/core/constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* mass_d = [M_dd M_di] and Y = M_di + M_dd P / 2 */
static void couple_mass(struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank, count = n - rank;
    const int *restrict column = work->partition.column;
    for (int a = 0; a < rank; a++) {
        const double *restrict from = work->M + column[a] * n;
        double *restrict row = work->mass_d + a * n;
        double *restrict Y = work->coupling + a * count;
        for (int b = 0; b < n; b++)
            row[b] = from[column[b]];
        for (int b = 0; b < count; b++)
            Y[b] = row[rank + b];
        for (int k = 0; k < rank; k++)
            dense_add(Y, 0.5 * row[k], work->P + k * (count + 1), count);
    }
}

/* R = M_ii + P^T Y + Y^T P, upper triangle */
static void reduce_mass(struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank, count = n - rank;
    const int *restrict column = work->partition.column;
    for (int i = 0; i < count; i++) {
        const double *restrict from = work->M + column[rank + i] * n;
        double *restrict row = work->reduced + i * count;
        for (int j = i; j < count; j++)
            row[j] = from[column[rank + j]];
        for (int k = 0; k < rank; k++) {
            const double *P = work->P + k * (count + 1), *Y = work->coupling + k * count;
            dense_add(row + i, P[i], Y + i, count - i);
            dense_add(row + i, Y[i], P + i, count - i);
        }
    }
}

/* side := f - M_d^T c in the order of the partition; then its independent part, plus P^T times the dependent
 * part. f NULL: zero. */
static void reduce_force(struct refdyn_workspace *work, const double *f) {
    const int n = work->n, rank = work->partition.rank, count = n - rank;
    for (int b = 0; b < n; b++)
        work->side[b] = f ? f[work->partition.column[b]] : 0;
    for (int k = 0; k < rank; k++)
        dense_add(work->side, -work->P[k * (count + 1) + count], work->mass_d + k * n, n);
    for (int k = 0; k < rank; k++)
        dense_add(work->side + rank, work->side[k], work->P + k * (count + 1), count);
}

/* qdd_d = P qdd_i + c, written in the order of the model. */
static void expand(const struct refdyn_workspace *work, double *qdd) {
    const int n = work->n, rank = work->partition.rank, count = n - rank;
    const int *restrict column = work->partition.column;
    for (int b = 0; b < count; b++)
        qdd[column[rank + b]] = work->side[rank + b];
    for (int k = 0; k < rank; k++) {
        const double *P = work->P + k * (count + 1);
        qdd[column[k]] = P[count] + dense_dot(P, work->side + rank, count);
    }
}

/* Returns NOT_FINITE instead of a status that infinities or NaN have caused. */
static int explain(struct refdyn_workspace *work, int status, struct refdyn_fault fault) {
    if (refdyn_fault_not_finite(work))
        return REFDYN_NOT_FINITE;
    work->fault = fault;
    return status;
}

int refdyn_solve(struct refdyn_workspace *work, enum refdyn_stabilise stabilise, double *qdd) {
    if (!refdyn_is_laid_out(work) || !qdd)
        return refdyn_missing_status(work);
    const int baumgarte = stabilise == REFDYN_BAUMGARTE;
    const int status = refdyn_partition_update(work, baumgarte ? work->k : work->v, baumgarte ? 1 : -1);
    if (status)
        return explain(work, status, work->fault);
    const int rank = work->partition.rank, count = work->n - rank;
    couple_mass(work);
    reduce_mass(work);
    reduce_force(work, work->f);
    const int failed = refdyn_factor(work->reduced, count, count);
    if (failed >= 0)
        return explain(work, REFDYN_MASS_NOT_POSITIVE,
                       (struct refdyn_fault){.row = -1, .coordinate = work->partition.column[rank + failed]});
    refdyn_factor_solve(work->reduced, count, count, work->side + rank);
    expand(work, qdd);
    if (refdyn_is_finite(qdd, work->n))
        return REFDYN_OK;
    return explain(work, REFDYN_NOT_FINITE, (struct refdyn_fault){.row = -1, .coordinate = -1});
}

/* Emitted accelerations count as near those of the partition up to this relative difference. */
static const double near = 1e-4;

/* Changes qdd by the least in the metric of M so that u qdd = sign right. */
static void meet_rows(struct refdyn_workspace *work, const double *right, double sign, double *qdd) {
    const int n = work->n, rank = work->partition.rank, count = n - rank, width = count + 1;
    double *c = work->P + count;
    for (int k = 0; k < rank; k++) {
        const int a = work->partition.row[k];
        c[k * width] = sign * right[a] - dense_dot(work->u + a * n, qdd, n);
    }
    refdyn_lu_solve_transposed(work->rows, rank, work->exchange, c, width, 1);
    reduce_force(work, NULL);
    refdyn_factor_solve(work->reduced, count, count, work->side + rank);
    expand(work, work->change);
    dense_add(qdd, 1, work->change, n);
}

/* Overwrites work->change. */
static int is_near(struct refdyn_workspace *work, const double *x, const double *y) {
    for (int j = 0; j < work->n; j++)
        work->change[j] = x[j] - y[j];
    return refdyn_is_finite(work->change, work->n) &&
           refdyn_largest(work->change, work->n, NULL) <= near * refdyn_largest(y, work->n, NULL);
}

/* Overwrites work->reduced. */
static int has_inverse(struct refdyn_workspace *work) {
    const int n = work->n;
    memcpy(work->reduced, work->M, (size_t)(n * n) * sizeof *work->M);
    return refdyn_factor(work->reduced, n, n) < 0;
}

int refdyn_refine(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                  enum refdyn_stabilise stabilise, double *qdd) {
    if (!refdyn_is_laid_out(work) || !q || !qd || !qdd)
        return 0;
    const struct refdyn_model *model = work->model;
    const int baumgarte = stabilise == REFDYN_BAUMGARTE;
    refdyn_function *emitted = work->m == 0 ? model->qdd_free : model->constrained;
    if (!emitted)
        return 1;
    work->evaluations++;
    emitted(work->p, work->x, t, q, qd, work->emitted);
    if (!is_near(work, work->emitted, qdd))
        return work->m == 0 || has_inverse(work);
    if (work->m > 0)
        meet_rows(work, baumgarte ? work->k : work->v, baumgarte ? 1 : -1, work->emitted);
    memcpy(qdd, work->emitted, (size_t)work->n * sizeof *qdd);
    return 1;
}

int refdyn_accelerate(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                      enum refdyn_stabilise stabilise, double *qdd) {
    const int status = refdyn_equations(work, t, q, qd);
    return status ? status : refdyn_solve(work, stabilise, qdd);
}

/* K_d^T lambda = (M qdd - f)_d */
void refdyn_multipliers(struct refdyn_workspace *work, const double *qdd, double *lambda) {
    if (!refdyn_is_laid_out(work) || !qdd || (!lambda && work->m > 0))
        return;
    const int n = work->n, rank = work->partition.rank;
    const int *column = work->partition.column;
    for (int k = 0; k < rank; k++)
        work->lambda[k] = dense_dot(work->M + column[k] * n, qdd, n) - work->f[column[k]];
    refdyn_lu_solve(0, work->rows, rank, work->exchange, work->lambda);
    for (int a = 0; a < work->m; a++)
        lambda[a] = 0;
    for (int k = 0; k < rank; k++)
        lambda[work->partition.row[k]] = work->lambda[k];
}

void refdyn_programme_force(const struct refdyn_workspace *work, const double *lambda, double *force) {
    if (!refdyn_is_laid_out(work) || (!lambda && work->m > 0) || !force)
        return;
    for (int j = 0; j < work->n; j++)
        force[j] = 0;
    for (int a = 0; a < work->m; a++)
        dense_add(force, lambda[a], work->u + a * work->n, work->n);
}
