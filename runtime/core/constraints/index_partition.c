/*
 * Index partitioning: K = [K_d K_i] with a well-conditioned K_d, and its elimination.
 *
 * In: the rows u and the right side in the workspace. Out: P = -K_d^-1 K_i, c = K_d^-1 k and the redundant
 * rows (theory, sect. 8.1). Choice: Gaussian elimination with full pivoting of K, its columns scaled by
 * 1/sqrt(M_jj) (coordinates then count by their share of kinetic energy), its rows by their sizes, the
 * largest entry without cancellation (Wehage and Haug, J. Mech. Design 104:247-255, 1982). Watch: since
 * K_d^-1 K = [1 -P], the norm |[1 -P]| measures how much worse this choice is conditioned than K itself; the
 * smallest pivot measures how near K_d is to a singular matrix.
 */
#include "runtime/core/constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* A choice is replaced when its condition has grown by this factor: its pivots have then lost one digit. */
static const double worse = 10;
/* Rows are chosen again when the largest share of a kept row in an omitted one has grown by this factor since
 * the choice: the kept rows have then become nearly dependent. */
static const double greater = 3;
/* Off the constraint manifold a redundant row looks independent, in proportion to the residual. A redundant
 * row stays redundant up to the first factor times the residual, and up to the second value. */
static const double misses = 10, misses_most = 1e-3;

static void swap_int(int *a, int *b) {
    const int kept = *a;
    *a = *b;
    *b = kept;
}

/* Writes rows with scaled columns, divided by their sizes, into work->rows, in the order of the model. A row
 * of size 0 becomes zero. */
static void scale_rows(struct refdyn_workspace *work) {
    const int n = work->n;
    for (int a = 0; a < work->m; a++)
        for (int j = 0; j < n; j++)
            work->rows[a * n + j] =
                work->row_size[a] > 0 ? work->u[a * n + j] * work->weight[j] / work->row_size[a] : 0;
}

/* Returns the scaled pivot above which a redundant row becomes independent. */
static double regained(const struct refdyn_workspace *work) {
    return work->rank_tol + fmin(misses * refdyn_distance(work, work->phi), misses_most);
}

/* Orders rows and columns by full pivoting among the declared coordinates (m), or among all if NULL. The
 * scaled rows are the columns of K^T. Returns the rank. */
static int pivot_fully(struct refdyn_workspace *work, const int *declared) {
    struct refdyn_partition *partition = &work->partition;
    const int n = work->n;
    scale_rows(work);
    for (int j = 0; j < n; j++)
        work->scale[j] = !declared;
    for (int a = 0; declared && a < work->m; a++)
        work->scale[declared[a]] = 1;
    for (int j = 0; j < n; j++)
        partition->column[j] = j;
    for (int a = 0; a < work->m; a++)
        partition->row[a] = a;
    const int most = refdyn_eliminate(work->rows, n, work->m, work->exchange, partition->row, work->scale);
    for (int k = 0; k < most; k++)
        swap_int(&partition->column[k], &partition->column[work->exchange[k]]);
    const double later = partition->rank < 0 ? work->rank_tol : regained(work);
    int rank = 0;
    while (rank < most && rank < partition->rank_most &&
           1 > (rank < partition->rank ? work->rank_tol : later) * fabs(work->rows[rank * n + rank]))
        rank++;
    return rank;
}

int refdyn_eliminate_rows(struct refdyn_workspace *work) {
    scale_rows(work);
    for (int j = 0; j < work->n; j++)
        work->scale[j] = 1;
    for (int a = 0; a < work->m; a++)
        work->mark[a] = a;
    return refdyn_eliminate(work->rows, work->n, work->m, work->exchange, work->mark, work->scale);
}

int refdyn_rank_of_rows(struct refdyn_workspace *work, int is_off) {
    const int n = work->n, most = refdyn_eliminate_rows(work);
    const double least = is_off ? regained(work) : work->rank_tol;
    int rank = 0;
    while (rank < most && 1 > least * fabs(work->rows[rank * n + rank]))
        rank++;
    return rank;
}

static int is_listed(const int *list, int count, int value) {
    for (int i = 0; i < count; i++)
        if (list[i] == value)
            return 1;
    return 0;
}

static int is_declared(const struct refdyn_workspace *work) {
    const struct refdyn_partition *partition = &work->partition;
    for (int a = 0; a < partition->rank; a++)
        if (!work->model->dependent || !is_listed(work->model->dependent, work->m, partition->column[a]))
            return 0;
    return work->model->dependent != NULL;
}

/* The first choice is the declared set, unless it is singular while K has a higher rank; later choices are
 * the best set. */
static void choose(struct refdyn_workspace *work) {
    struct refdyn_partition *partition = &work->partition;
    const int n = work->n, rank_before = partition->rank;
    int *before = work->mark + n; /* (m): no row is marked during a choice */
    for (int a = 0; a < rank_before; a++)
        before[a] = partition->column[a];
    const int *declared = work->model->dependent;
    int rank = pivot_fully(work, NULL);
    if (rank_before < 0 && declared && pivot_fully(work, declared) < rank)
        rank = pivot_fully(work, NULL);
    partition->rank = rank;
    refdyn_sort(partition->column + rank, n - rank);
    refdyn_sort(partition->row + rank, work->m - rank);
    partition->is_declared = is_declared(work);
    if (rank_before < 0)
        return;
    int same = rank == rank_before;
    for (int a = 0; a < rank_before; a++)
        same &= is_listed(partition->column, rank, before[a]);
    partition->changes += !same;
}

/* Row a of [P c]. */
static double *row_of_P(const struct refdyn_workspace *work, int a) {
    return work->P + a * (work->n - work->partition.rank + 1);
}

/* Writes K_d^T column by column into work->rows and [-K_i k] of all rows into work->P. Returns 0 if a row has
 * outgrown its size. */
static int gather_rows(struct refdyn_workspace *work, const double *right, double sign) {
    const int n = work->n, rank = work->partition.rank;
    const int *restrict column = work->partition.column;
    int is_within = 1;
    for (int a = 0; a < work->m; a++) {
        const int source = work->partition.row[a];
        const double *restrict from = work->u + source * n;
        double *restrict P = row_of_P(work, a), largest = 0;
        for (int k = 0; k < rank && a < rank; k++)
            work->rows[a * rank + k] = from[column[k]];
        for (int b = rank; b < n; b++)
            P[b - rank] = -from[column[b]];
        P[n - rank] = sign * right[source];
        for (int j = 0; j < n; j++) {
            const double scaled = fabs(from[j]) * work->weight[j];
            largest = scaled > largest ? scaled : largest;
        }
        is_within &= largest <= worse * work->row_size[source];
    }
    return is_within;
}

/* L U = K_d^T; returns 0 when a pivot is too small to divide by. */
static int factor_dependent(struct refdyn_workspace *work) {
    const int rank = work->partition.rank;
    for (int k = 0; k < rank; k++)
        work->scale[k] = work->weight[work->partition.column[k]];
    if (refdyn_eliminate(work->rows, rank, rank, work->exchange, NULL, work->scale) < rank)
        return 0;
    double smallest = 1;
    for (int k = 0; k < rank; k++)
        smallest = fmin(smallest, work->scale[k] / (fabs(work->rows[k * rank + k]) *
                                                    work->row_size[work->partition.row[k]]));
    work->partition.pivot = smallest;
    return smallest > work->rank_tol / worse;
}

/* [P c] = K_d^-1 [-K_i k], and the remaining right side of redundant rows, which is 0 if they agree with
 * qdd_d = P qdd_i + c. */
static void solve_dependent(struct refdyn_workspace *work) {
    const int rank = work->partition.rank, width = work->n - rank + 1;
    const int *column = work->partition.column;
    refdyn_lu_solve_transposed(work->rows, rank, work->exchange, work->P, width, width);
    for (int a = rank; a < work->m; a++)
        for (int k = 0; k < rank; k++)
            dense_add(row_of_P(work, a), -work->u[work->partition.row[a] * work->n + column[k]],
                      row_of_P(work, k), width);
}

/* |[1 -P]|, scaled, over the smallest pivot. */
static void estimate_condition(struct refdyn_workspace *work) {
    const int rank = work->partition.rank;
    const int *column = work->partition.column;
    double square = rank;
    for (int k = 0; k < rank; k++) {
        const double *P = row_of_P(work, k), weight = work->weight[column[k]];
        double row_square = 0;
        for (int b = rank; b < work->n; b++) {
            const double scaled = P[b - rank] * work->weight[column[b]];
            row_square += scaled * scaled;
        }
        square += row_square / (weight * weight);
    }
    work->partition.condition = sqrt(square) / work->partition.pivot;
}

/* Returns whether a row that was redundant at the choice has become independent. */
static int rank_has_grown(const struct refdyn_workspace *work) {
    const int rank = work->partition.rank;
    if (rank >= work->partition.rank_most)
        return 0;
    const double least = regained(work);
    for (int a = rank; a < work->m; a++)
        for (int b = rank; b < work->n; b++)
            if (fabs(row_of_P(work, a)[b - rank]) * work->weight[work->partition.column[b]] >
                least * work->row_size[work->partition.row[a]])
                return 1;
    return 0;
}

/* Returns the allowed remaining right side of a redundant row: a fraction of its largest term, plus the
 * product of coefficients that were taken for 0 with the accelerations of the forces alone, or with those
 * that the kept rows prescribe. */
static double allowed_miss(const struct refdyn_workspace *work, int a, double right) {
    const int n = work->n, rank = work->partition.rank;
    const double *row = work->u + work->partition.row[a] * n;
    double term = fabs(right), acceleration = 0; /* scaled: sqrt(M_jj) qdd_j */
    for (int k = 0; k < rank; k++) {
        const int j = work->partition.column[k];
        const double prescribed = fabs(row_of_P(work, k)[n - rank]);
        term = fmax(term, fabs(row[j]) * prescribed);
        acceleration = fmax(acceleration, prescribed / work->weight[j]);
    }
    for (int j = 0; j < n; j++)
        acceleration = fmax(acceleration, fabs(work->f[j]) * work->weight[j]);
    return work->consistency_tol * term +
           regained(work) * work->row_size[work->partition.row[a]] * acceleration;
}

/* Checks that the remaining right side of each redundant row is 0. This holds on the programme only; within a
 * step, where the rank does not grow, states are off the programme. */
static int check_redundant(struct refdyn_workspace *work, const double *right) {
    const int rank = work->partition.rank;
    for (int a = rank; a < work->m && a < work->partition.rank_most; a++) {
        const int source = work->partition.row[a];
        if (!(fabs(row_of_P(work, a)[work->n - rank]) <= allowed_miss(work, a, right[source]))) {
            work->fault = (struct refdyn_fault){.row = source, .coordinate = -1};
            return REFDYN_ROWS_INCONSISTENT;
        }
    }
    return REFDYN_OK;
}

/* Eliminates with the present choice. Returns 0 if another choice is needed. */
static int eliminate_kept(struct refdyn_workspace *work, const double *right, double sign, int *status) {
    if (!gather_rows(work, right, sign) || !factor_dependent(work))
        return 0;
    solve_dependent(work);
    estimate_condition(work);
    if (rank_has_grown(work))
        return 0;
    *status = check_redundant(work, right);
    return work->partition.condition <= worse * work->partition.condition_chosen;
}

/* Returns the largest share of a kept row in an omitted one, both in units of their sizes, at least 1. The
 * omitted row is the sum of t_k times the kept rows k, K_d^T t = u_d. */
static double share_of_kept(struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank;
    const int *column = work->partition.column, *row = work->partition.row;
    double largest = 1, *t = work->lambda;
    for (int a = rank; a < work->m; a++) {
        const double size = work->row_size[row[a]];
        for (int k = 0; k < rank; k++)
            t[k] = work->u[row[a] * n + column[k]];
        refdyn_lu_solve(0, work->rows, rank, work->exchange, t);
        for (int k = 0; k < rank && size > 0; k++)
            largest = fmax(largest, fabs(t[k]) * work->row_size[row[k]] / size);
    }
    return largest;
}

static int eliminate_chosen(struct refdyn_workspace *work, const double *right, double sign) {
    if (refdyn_fault_not_finite(work))
        return REFDYN_NOT_FINITE;
    refdyn_row_sizes(work);
    choose(work);
    work->partition.choices++;
    gather_rows(work, right, sign);
    factor_dependent(work);
    solve_dependent(work);
    estimate_condition(work);
    work->partition.condition_chosen = work->partition.condition;
    work->partition.share_chosen = share_of_kept(work);
    return check_redundant(work, right);
}

static void record_condition(struct refdyn_partition *partition) {
    if (partition->rank == 0)
        return;
    partition->pivot_min = fmin(partition->pivot_min, partition->pivot);
    partition->condition_max = fmax(partition->condition_max, partition->condition);
}

int refdyn_partition_update(struct refdyn_workspace *work, const double *right, double sign) {
    struct refdyn_partition *partition = &work->partition;
    int status = REFDYN_OK;
    if (partition->rank < 0 || !eliminate_kept(work, right, sign, &status))
        status = eliminate_chosen(work, right, sign);
    record_condition(partition);
    return status;
}

void refdyn_partition_bound_rank(struct refdyn_workspace *work, int most) {
    work->partition.rank_most = most;
}

int refdyn_partition_renew(struct refdyn_workspace *work) {
    refdyn_partition_bound_rank(work, work->m);
    const int status = eliminate_chosen(work, work->k, 1);
    record_condition(&work->partition);
    refdyn_partition_bound_rank(work, work->partition.rank);
    return status;
}

/* Redundant rows are compared with the forces, which the row terms do not contain. */
int refdyn_partition_watch(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    struct refdyn_partition *partition = &work->partition;
    int status = REFDYN_OK;
    if (work->m == 0)
        return REFDYN_OK;
    if (partition->rank < work->m || !eliminate_kept(work, work->k, 1, &status)) {
        status = refdyn_equations(work, t, q, qd);
        if (!status)
            status = refdyn_partition_update(work, work->k, 1);
        if (!status && share_of_kept(work) > greater * partition->share_chosen)
            status = eliminate_chosen(work, work->k, 1);
    }
    record_condition(partition);
    return status;
}
