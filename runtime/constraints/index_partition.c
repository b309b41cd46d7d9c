/*
 * Index partitioning: K = [K_d K_i] with a well-conditioned K_d, and its elimination.
 *
 * Takes the rows u and right side of the workspace; gives P = -K_d^-1 K_i, c = K_d^-1 k and the redundant
 * rows. Theory, sect. 8.1. Choice: Gaussian elimination with full pivoting of K, its columns scaled by
 * 1/sqrt(M_jj) (coordinates then count by their share of kinetic energy), its rows by their largest entry
 * (Wehage and Haug, J. Mech. Design 104:247-255, 1982). Watch: since K_d^-1 K = [1 -P], |[1 -P]| tells how
 * far this choice is worse conditioned than K itself, and the smallest pivot how near K_d is to being
 * singular.
 */
#include "base/arithmetic.h"

#include "constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linear/dense.h"

/* A choice is given up when its condition has grown by this factor: pivots then have lost one digit. */
static const double worse = 10;
/* Off the programme a row that depends on others on it looks independent, by about as much as coordinates
 * miss; one that was found redundant stays so below this many times that, and below the second. */
static const double misses = 10, misses_most = 1e-3;

static void swap_int(int *a, int *b) {
    const int kept = *a;
    *a = *b;
    *b = kept;
}

static void swap_doubles(double *a, double *b, int count, int stride) {
    for (int j = 0; j < count * stride; j += stride) {
        const double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

/* weight_j = 1/sqrt(M_jj); a coordinate without mass counts as one with the least mass that is not noise. */
static double weight_of(const struct refdyn_workspace *work, int j, double largest_mass) {
    const double mass = work->M[j * work->n + j], least = DBL_EPSILON * largest_mass;
    return 1 / sqrt(mass > least ? mass : least > 0 ? least : 1);
}

/* Scaled rows in the order of the model into work->rows; a row of zeros stays zeros. */
static void scale_rows(struct refdyn_workspace *work) {
    const int n = work->n, m = work->m;
    double largest_mass = 0;
    for (int j = 0; j < n; j++)
        largest_mass = fmax(largest_mass, work->M[j * n + j]);
    for (int j = 0; j < n; j++)
        work->weight[j] = weight_of(work, j, largest_mass);
    for (int a = 0; a < m; a++) {
        double *row = work->rows + a * (n + 1), size = 0;
        for (int j = 0; j < n; j++) {
            row[j] = work->u[a * n + j] * work->weight[j];
            size = fmax(size, fabs(row[j]));
        }
        for (int j = 0; j < n && size > 0; j++)
            row[j] /= size;
    }
}

/* Scaled pivot above which a row that was redundant no longer is. */
static double regained(const struct refdyn_workspace *work) {
    return work->rank_tol + fmin(misses * refdyn_distance(work, work->phi), misses_most);
}

/* Largest entry of the rows and allowed columns from k on. */
static double find_pivot(const struct refdyn_workspace *work, int k, const int *allowed, int *row,
                         int *column) {
    const int n = work->n;
    double largest = 0;
    for (int a = k; a < work->m; a++)
        for (int b = k; b < n; b++) {
            const double size = fabs(work->rows[a * (n + 1) + b]);
            if (size > largest && allowed[work->partition.column[b]]) {
                largest = size;
                *row = a;
                *column = b;
            }
        }
    return largest;
}

static void move_pivot(struct refdyn_workspace *work, int k, int row, int column) {
    const int n = work->n, stride = n + 1;
    swap_doubles(work->rows + k * stride, work->rows + row * stride, n, 1);
    swap_doubles(work->rows + k, work->rows + column, work->m, stride);
    swap_int(&work->partition.row[k], &work->partition.row[row]);
    swap_int(&work->partition.column[k], &work->partition.column[column]);
}

static void eliminate_column(struct refdyn_workspace *work, int k) {
    const int n = work->n, stride = n + 1;
    const double *pivot_row = work->rows + k * stride;
    for (int a = k + 1; a < work->m; a++) {
        double *row = work->rows + a * stride;
        const double factor = row[k] / pivot_row[k];
        row[k] = 0;
        dense_add(row + k + 1, -factor, pivot_row + k + 1, n - k - 1);
    }
}

/* Orders rows and columns by full pivoting among the allowed coordinates; returns the rank found. */
static int pivot_fully(struct refdyn_workspace *work, const int *allowed) {
    struct refdyn_partition *partition = &work->partition;
    scale_rows(work);
    for (int j = 0; j < work->n; j++)
        partition->column[j] = j;
    for (int a = 0; a < work->m; a++)
        partition->row[a] = a;
    const double later = partition->rank < 0 ? work->rank_tol : regained(work);
    int rank = 0, row = 0, column = 0;
    while (rank < work->m && rank < work->n && rank < partition->rank_most &&
           find_pivot(work, rank, allowed, &row, &column) >
               (rank < partition->rank ? work->rank_tol : later)) {
        move_pivot(work, rank, row, column);
        eliminate_column(work, rank);
        rank++;
    }
    return rank;
}

static void sort(int *list, int count) {
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && list[j - 1] > list[j]; j--)
            swap_int(&list[j - 1], &list[j]);
}

static void mark_all(int *mark, int count, int value) {
    for (int j = 0; j < count; j++)
        mark[j] = value;
}

static int is_declared(const struct refdyn_workspace *work) {
    const struct refdyn_partition *partition = &work->partition;
    if (!work->model->dependent)
        return 0;
    for (int a = 0; a < partition->rank; a++) {
        int found = 0;
        for (int b = 0; b < work->m; b++)
            found |= work->model->dependent[b] == partition->column[a];
        if (!found)
            return 0;
    }
    return 1;
}

/* Rank with the declared dependent coordinates, -1 without such a declaration. */
static int pivot_declared(struct refdyn_workspace *work) {
    if (!work->model->dependent)
        return -1;
    mark_all(work->mark, work->n, 0);
    for (int a = 0; a < work->m; a++)
        work->mark[work->model->dependent[a]] = 1;
    return pivot_fully(work, work->mark);
}

static int pivot_any(struct refdyn_workspace *work) {
    mark_all(work->mark, work->n, 1);
    return pivot_fully(work, work->mark);
}

/* Counts a change when the dependent coordinates are not those marked. */
static void count_change(struct refdyn_workspace *work, const int *before, int rank_before) {
    struct refdyn_partition *partition = &work->partition;
    int same = rank_before == partition->rank;
    for (int a = 0; a < partition->rank; a++)
        same &= before[partition->column[a]];
    partition->changes += !same;
}

/* First choice: the declared set, unless it is singular while K has a higher rank. Later: the best set. */
static void choose(struct refdyn_workspace *work) {
    struct refdyn_partition *partition = &work->partition;
    const int n = work->n, rank_before = partition->rank;
    int *before = work->mark + n; /* (m): marks of rows are not in use here */
    for (int a = 0; a < rank_before; a++)
        before[a] = partition->column[a];
    int rank = pivot_any(work);
    if (rank_before < 0 && pivot_declared(work) < rank)
        rank = pivot_any(work);
    partition->rank = rank;
    sort(partition->column + rank, n - rank);
    partition->is_declared = is_declared(work);
    if (rank_before < 0)
        return;
    mark_all(work->mark, n, 0);
    for (int a = 0; a < rank_before; a++)
        work->mark[before[a]] = 1;
    count_change(work, work->mark, rank_before);
}

/* work->weight from the order of the model into that of the partition. */
static void order_weights(struct refdyn_workspace *work) {
    for (int b = 0; b < work->n; b++)
        work->side[b] = work->weight[work->partition.column[b]];
    memcpy(work->weight, work->side, (size_t)work->n * sizeof(double));
}

/* [K_d K_i k] in the order of the partition, and the scaled size of each row. */
static void gather_rows(struct refdyn_workspace *work, const double *right, double sign) {
    const int n = work->n;
    const int *restrict column = work->partition.column;
    const double *restrict weight = work->weight;
    for (int a = 0; a < work->m; a++) {
        const int source = work->partition.row[a];
        const double *restrict from = work->u + source * n;
        double *restrict row = work->rows + a * (n + 1), size = 0;
        for (int b = 0; b < n; b++) {
            row[b] = from[column[b]];
            const double scaled = fabs(row[b]) * weight[b];
            size = scaled > size ? scaled : size;
        }
        row[n] = sign * right[source];
        work->row_size[a] = size;
    }
}

/* L U = K_d in the kept order; returns 0 when a pivot is too small to divide by. */
static int eliminate_forward(struct refdyn_workspace *work) {
    const int n = work->n, stride = n + 1;
    double smallest = 1;
    for (int k = 0; k < work->partition.rank; k++) {
        const double *restrict pivot_row = work->rows + k * stride;
        const double pivot = fabs(pivot_row[k]) * work->weight[k] / work->row_size[k];
        if (!(pivot >= smallest))
            smallest = pivot; /* NaN for a row of zeros */
        if (!(smallest > work->rank_tol / worse))
            return 0;
        const double inverse = 1 / pivot_row[k];
        for (int a = k + 1; a < work->m; a++) {
            double *restrict row = work->rows + a * stride;
            row[k] *= inverse;
            dense_add(row + k + 1, -row[k], pivot_row + k + 1, n - k);
        }
    }
    work->partition.pivot = smallest;
    return 1;
}

/* U^-1 applied to [K_i k]; P = -K_d^-1 K_i; the condition estimate. */
static void eliminate_backward(struct refdyn_workspace *work) {
    const int n = work->n, stride = n + 1, rank = work->partition.rank, free_count = n - rank;
    double square = rank;
    for (int k = rank - 1; k >= 0; k--) {
        double *restrict row = work->rows + k * stride;
        double *restrict P = work->P + k * free_count;
        for (int a = k + 1; a < rank; a++)
            dense_add(row + rank, -row[a], work->rows + a * stride + rank, free_count + 1);
        const double inverse = 1 / row[k];
        double row_square = 0;
        for (int b = 0; b < free_count; b++) {
            row[rank + b] *= inverse;
            P[b] = -row[rank + b];
            const double scaled = P[b] * work->weight[rank + b];
            row_square += scaled * scaled;
        }
        row[n] *= inverse;
        square += row_square / (work->weight[k] * work->weight[k]);
    }
    work->partition.condition = sqrt(square) / work->partition.pivot;
}

/* True when a row that was redundant at the choice no longer is. */
static int rank_has_grown(const struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank;
    if (rank >= work->partition.rank_most)
        return 0;
    const double least = regained(work);
    for (int a = rank; a < work->m; a++)
        for (int b = rank; b < n; b++)
            if (fabs(work->rows[a * (n + 1) + b]) * work->weight[b] > least * work->row_size[a])
                return 1;
    return 0;
}

/* By how much the right side of a redundant row may miss: a part of its largest term, and what coefficients
 * that were taken for 0 make of the accelerations that the forces alone give. */
static double allowed_miss(const struct refdyn_workspace *work, int a, double right) {
    const int n = work->n, stride = n + 1;
    const double *row = work->rows + a * stride;
    double term = fabs(right), acceleration = 0; /* scaled: sqrt(M_jj) qdd_j */
    for (int k = 0; k < work->partition.rank; k++)
        term = fmax(term, fabs(row[k] * work->rows[k * stride + n]));
    for (int b = 0; b < n; b++)
        acceleration = fmax(acceleration, fabs(work->f[work->partition.column[b]]) * work->weight[b]);
    return work->consistency_tol * term + regained(work) * work->row_size[a] * acceleration;
}

/* What elimination leaves of the right side of a redundant row must be 0, on the programme: between the ends
 * of a step, where the rank does not grow, states are off it. */
static int check_redundant(struct refdyn_workspace *work, const double *right) {
    const int n = work->n;
    for (int a = work->partition.rank; a < work->m && a < work->partition.rank_most; a++) {
        const int source = work->partition.row[a];
        if (!(fabs(work->rows[a * (n + 1) + n]) <= allowed_miss(work, a, right[source]))) {
            work->fault = (struct refdyn_fault){.row = source, .coordinate = -1};
            return REFDYN_ROWS_INCONSISTENT;
        }
    }
    return REFDYN_OK;
}

/* The kept choice, if it still is good enough: returns 0 when another one is needed. */
static int eliminate_kept(struct refdyn_workspace *work, const double *right, double sign, int *status) {
    gather_rows(work, right, sign);
    if (!eliminate_forward(work) || rank_has_grown(work))
        return 0;
    *status = check_redundant(work, right);
    eliminate_backward(work);
    return work->partition.condition <= worse * work->partition.condition_chosen;
}

static int eliminate_chosen(struct refdyn_workspace *work, const double *right, double sign) {
    if (refdyn_fault_not_finite(work))
        return REFDYN_NOT_FINITE;
    choose(work);
    work->partition.choices++;
    order_weights(work);
    gather_rows(work, right, sign);
    eliminate_forward(work);
    const int status = check_redundant(work, right);
    eliminate_backward(work);
    work->partition.condition_chosen = work->partition.condition;
    return status;
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

/* Redundant rows are judged beside the forces, which the row terms alone do not tell. */
int refdyn_partition_watch(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    struct refdyn_partition *partition = &work->partition;
    int status = REFDYN_OK;
    if (work->m == 0)
        return REFDYN_OK;
    if (partition->rank < work->m || !eliminate_kept(work, work->k, 1, &status)) {
        status = refdyn_equations(work, t, q, qd);
        return status ? status : refdyn_partition_update(work, work->k, 1);
    }
    record_condition(partition);
    return status;
}
