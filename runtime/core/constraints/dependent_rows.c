/*
 * Forces of rows that depend on each other.
 *
 * In: the rows u of the workspace and their force r = u^T lambda (n). A null vector v with u^T v = 0 may be
 * added to lambda without a change of r, so that lambda is not unique. Out: sums g . lambda, which are unique
 * if and only if g . v = 0 for each v.
 *
 * Elimination with full pivoting, P K^T = L U with U = [U_1 U_2], where the columns of K^T are the rows
 * divided by their sizes. With y = U_1^-T g_1 the sum is y . (L^-1 P r). Each row o beyond the rank
 * has the null vector e_o - U_1^-1 U_2o, which changes the sum by g_o - y . U_2o.
 */
#include "runtime/core/constraints/constraints.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* A sum counts as unique up to this part of its largest coefficient plus this multiple of the residual of the
 * rows, because off the programme dependent rows are only nearly dependent. */
static const double blur = 1e-7, misses = 100;
/* Coordinates and rates are moved by this part of the larger of 1 and their value. */
static const double nearby = 1e-6;

/* work->side := L^-1 P r */
static void reduce(struct refdyn_workspace *work, const double *force, int rank) {
    const int n = work->n;
    double *z = work->side;
    for (int j = 0; j < n; j++)
        z[j] = force[j] * work->weight[j];
    for (int k = 0; k < rank; k++) {
        const double kept = z[k];
        z[k] = z[work->exchange[k]];
        z[work->exchange[k]] = kept;
    }
    for (int k = 0; k < rank; k++)
        dense_add(z + k + 1, -z[k], work->rows + k * n + k + 1, n - k - 1);
}

void refdyn_dependence_find(struct refdyn_dependence *dependence, struct refdyn_workspace *work,
                            const double *force) {
    const int most = refdyn_eliminate_rows(work);
    const int rank = work->partition.rank < most ? work->partition.rank : most;
    *dependence = (struct refdyn_dependence){
        .work = work, .rank = rank, .blur = blur + misses * refdyn_distance(work, work->phi)};
    reduce(work, force, rank);
}

/* The sum whose coefficients g, in the order of elimination, are in work->lambda. */
static double sum_of(const struct refdyn_dependence *dependence) {
    const struct refdyn_workspace *work = dependence->work;
    const int n = work->n, rank = dependence->rank;
    double *y = work->lambda;
    const double allowed = dependence->blur * refdyn_largest(y, work->m, NULL);
    for (int k = 0; k < work->m; k++) {
        const double *column = work->rows + k * n, left = y[k] - dense_dot(y, column, k < rank ? k : rank);
        if (k >= rank && fabs(left) > allowed)
            return NAN;
        if (k < rank)
            y[k] = left * column[k];
    }
    return dense_dot(y, work->side, rank);
}

/* The coefficient of a scaled row in a sum. A row of size 0 adds nothing. */
static double coefficient(const struct refdyn_workspace *work, int row, double of_row) {
    return work->row_size[row] > 0 ? of_row / work->row_size[row] : 0;
}

/* Is the row, whose size is 0, switched off by a factor that is 0? Other rows of size 0 have a slope next to
 * the state, as a square of rates has one away from rest, and their multiplier may be infinite. */
static int is_switched_off(struct refdyn_workspace *work, int row) {
    const int n = work->n;
    double *state = work->row_state, *sizes = work->basis, largest = 0;
    memset(sizes, 0, (size_t)(work->m * n) * sizeof *sizes);
    for (int i = 1; i <= 2 * n && largest == 0 && work->model->row_sizes; i++) {
        const double kept = state[i];
        state[i] += nearby * fmax(1, fabs(kept));
        work->model->row_sizes(work->p, work->x, state[0], state + 1, state + 1 + n, sizes);
        state[i] = kept;
        largest = refdyn_largest(sizes + row * n, n, NULL);
    }
    return work->model->row_sizes && largest == 0;
}

double refdyn_dependence_multiplier(const struct refdyn_dependence *dependence, int row) {
    struct refdyn_workspace *work = dependence->work;
    if (work->row_size[row] == 0)
        return row >= refdyn_programme_rows(work->model) || is_switched_off(work, row) ? 0 : NAN;
    for (int k = 0; k < work->m; k++)
        work->lambda[k] = work->mark[k] == row ? coefficient(work, row, 1) : 0;
    return sum_of(dependence);
}

double refdyn_dependence_drive(const struct refdyn_dependence *dependence, int coordinate) {
    struct refdyn_workspace *work = dependence->work;
    for (int k = 0; k < work->m; k++) {
        const int row = work->mark[k], is_drive = work->model->rows[row].driven == coordinate + 1;
        work->lambda[k] = is_drive ? coefficient(work, row, work->u[row * work->n + coordinate]) : 0;
    }
    return sum_of(dependence);
}
