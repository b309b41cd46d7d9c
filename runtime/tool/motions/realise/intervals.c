/*
 * An interval of the motion by collocation at six Gauss points: with step h, points c and the weights a
 * (once) and b (twice) of the integrals,
 *
 *     qd_i = qd_0 + h sum_j a_ij qdd_j,   q_i = q_0 + c_i h qd_0 + h^2 sum_j b_ij qdd_j,
 *
 * and the equations hold at each point. Linearised, they give the changes of the unknowns, and with them the
 * change of the next node, in terms of the change of the node. The step of an even number of points has no
 * real pole, which a growing mode could meet.
 */
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/format/format.h"

void realise_interval_state(const struct realise_motion *motion, int k, double x, const double *once,
                            const double *twice, double *state) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width;
    const double h = motion->t[k + 1] - motion->t[k];
    const double *node = motion->nodes + (size_t)k * 2 * (size_t)n;
    const double *stage = motion->stages + (size_t)k * REALISE_STAGES * (size_t)width;
    for (int i = 0; i < n; i++) {
        state[i] = node[i] + x * h * node[n + i];
        state[n + i] = node[n + i];
        for (int j = 0; j < REALISE_STAGES; j++) {
            state[i] += h * h * twice[j] * stage[j * width + i];
            state[n + i] += h * once[j] * stage[j * width + i];
        }
    }
}

/* Scratch of one interval: the linear equations of its unknowns, columns one after the other. There are more
 * columns than rows if drives leave a choice. */
struct equations {
    int rows, columns, sides;
    double *matrix, *right; /* (rows x columns), (rows x sides) */
};

/* Adds the rows of point i: `place` has the equations there. */
static void add_point(const struct realise_problem *problem, const struct realise_place *place, int i,
                      double h, struct equations *equations) {
    const int n = problem->n, m = problem->m, width = problem->width, size = equations->rows;
    const int inputs = problem->scene->model->input_count;
    const double c = problem->gauss.c[i];
    for (int row = 0; row < n + m; row++) {
        const bool is_row = row >= n;
        const int at = (is_row ? row - n : row) * n;
        const double *by_q = (is_row ? place->G_q : place->K) + at,
                     *by_qd = (is_row ? place->G_qd : place->D) + at,
                     *by_qdd = (is_row ? place->u : place->M) + at;
        double *out = equations->matrix + i * (n + m) + row, *right = equations->right + i * (n + m) + row;
        for (int j = 0; j < REALISE_STAGES; j++)
            for (int column = 0; column < n; column++)
                out[(size_t)(j * width + column) * (size_t)size] =
                    h * problem->gauss.once[i][j] * by_qd[column] +
                    h * h * problem->gauss.twice[i][j] * by_q[column] + (i == j ? by_qdd[column] : 0);
        for (int column = 0; column < n; column++) {
            right[(size_t)column * (size_t)size] = -by_q[column];
            right[(size_t)(n + column) * (size_t)size] = -(by_qd[column] + c * h * by_q[column]);
        }
        right[(size_t)(2 * n) * (size_t)size] = -place->residual[row];
        for (int d = 0; d < problem->drives && !is_row; d++)
            out[(size_t)(i * width + n + d) * (size_t)size] = place->f_x[row * inputs + problem->input[d]];
        for (int l = 0; l < problem->loops && !is_row; l++)
            out[(size_t)(i * width + n + problem->drives + l) * (size_t)size] =
                -place->u[problem->loop[l] * n + row];
    }
}

/* Divides rows and columns by factors that make their largest entries equal. */
static bool equilibrate(struct equations *equations, double *columns) {
    const int rows = equations->rows;
    double *factors = realise_scratch(rows, 1), row_ratio, column_ratio, largest;
    if (LAPACKE_dgeequ(LAPACK_COL_MAJOR, rows, equations->columns, equations->matrix, rows, factors, columns,
                       &row_ratio, &column_ratio, &largest) != 0)
        return false;
    for (int j = 0; j < equations->columns; j++)
        for (int i = 0; i < rows; i++)
            equations->matrix[j * rows + i] *= factors[i] * columns[j];
    for (int j = 0; j < equations->sides; j++)
        for (int i = 0; i < rows; i++)
            equations->right[j * rows + i] *= factors[i];
    return true;
}

/* The solutions of as many equations as unknowns. Rounding slows Newton's method and does not change its
 * result. */
static bool solve_square(struct equations *equations, double *solution) {
    const int size = equations->rows;
    lapack_int *pivots = memory_scratch(&format_memory, (size_t)size * sizeof *pivots);
    if (LAPACKE_dgesv(LAPACK_COL_MAJOR, size, equations->sides, equations->matrix, size, pivots,
                      equations->right, size) != 0)
        return false;
    memcpy(solution, equations->right, (size_t)size * (size_t)equations->sides * sizeof *solution);
    return true;
}

/* The solutions of least norm, and after them a basis of the unknowns that change no equation: with
 * A^T = Q (R, 0)^T they are Q (R^-T b, 0) and the last columns of Q. */
static bool solve_wide(struct equations *equations, double *solution) {
    const int rows = equations->rows, columns = equations->columns, sides = equations->sides,
              all = sides + columns - rows;
    double *transposed = realise_scratch(columns, rows), *reflectors = realise_scratch(rows, 1);
    for (int j = 0; j < columns; j++)
        for (int i = 0; i < rows; i++)
            transposed[i * columns + j] = equations->matrix[j * rows + i];
    if (LAPACKE_dgeqrf(LAPACK_COL_MAJOR, columns, rows, transposed, columns, reflectors) != 0 ||
        LAPACKE_dtrtrs(LAPACK_COL_MAJOR, 'U', 'T', 'N', rows, sides, transposed, columns, equations->right,
                       rows) != 0)
        return false;
    memset(solution, 0, (size_t)columns * (size_t)all * sizeof *solution);
    for (int j = 0; j < sides; j++)
        memcpy(solution + j * columns, equations->right + j * rows, (size_t)rows * sizeof *solution);
    for (int j = sides; j < all; j++)
        solution[j * columns + rows + j - sides] = 1;
    return LAPACKE_dormqr(LAPACK_COL_MAJOR, 'L', 'N', columns, all, rows, transposed, columns, reflectors,
                          solution, columns) == 0;
}

static int solve(struct equations *equations, double *solution) {
    const int columns = equations->columns, all = equations->sides + columns - equations->rows;
    double *factors = realise_scratch(columns, 1);
    if (!equilibrate(equations, factors) ||
        !(equations->rows < columns ? solve_wide : solve_square)(equations, solution))
        return REFDYN_MATRIX_SINGULAR;
    for (int j = 0; j < all; j++)
        for (int i = 0; i < columns; i++)
            solution[j * columns + i] *= factors[i];
    return REFDYN_OK;
}

/* Phi, gap and Gamma from the changes of the accelerations. */
static void condense(const struct realise_motion *motion, int k, struct realise_interval *interval) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width, size = REALISE_STAGES * width;
    const double h = motion->t[k + 1] - motion->t[k];
    const double *next = motion->nodes + (size_t)(k + 1) * 2 * (size_t)n;
    realise_interval_state(motion, k, 1, problem->gauss.once[REALISE_STAGES],
                           problem->gauss.twice[REALISE_STAGES], interval->gap);
    for (int i = 0; i < 2 * n; i++)
        interval->gap[i] -= next[i];
    memset(interval->Gamma, 0, (size_t)(2 * n * REALISE_STAGES * problem->spare) * sizeof(double));
    for (int side = 0; side <= 2 * n + REALISE_STAGES * problem->spare; side++) {
        const double *change = interval->by_state + (size_t)side * (size_t)size;
        double *out = side < 2 * n    ? interval->Phi + (size_t)side * 2 * (size_t)n
                      : side == 2 * n ? interval->gap
                                      : interval->Gamma + (size_t)(side - 2 * n - 1) * 2 * (size_t)n;
        for (int i = 0; i < n; i++) {
            if (side < 2 * n) {
                out[i] = side == i ? 1 : side == n + i ? h : 0;
                out[n + i] = side == n + i;
            }
            for (int j = 0; j < REALISE_STAGES; j++) {
                out[i] += h * h * problem->gauss.twice[REALISE_STAGES][j] * change[j * width + i];
                out[n + i] += h * problem->gauss.once[REALISE_STAGES][j] * change[j * width + i];
            }
        }
    }
}

int realise_interval_find(struct realise_motion *motion, int k, struct realise_interval *interval) {
    struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width;
    const double h = motion->t[k + 1] - motion->t[k];
    const struct memory_mark mark = memory_mark(&format_memory);
    struct equations equations = {
        .rows = REALISE_STAGES * (n + problem->m), .columns = REALISE_STAGES * width, .sides = 2 * n + 1};
    equations.matrix = realise_scratch(equations.rows, equations.columns);
    equations.right = realise_scratch(equations.rows, equations.sides);
    double *state = realise_scratch(2, n);
    struct realise_place place = {.residual = realise_scratch(1, n + problem->m)};
    int status = REFDYN_OK;
    for (int i = 0; i < REALISE_STAGES && status == REFDYN_OK; i++) {
        const double *unknowns = motion->stages + (size_t)(k * REALISE_STAGES + i) * (size_t)width;
        realise_interval_state(motion, k, problem->gauss.c[i], problem->gauss.once[i],
                               problem->gauss.twice[i], state);
        status = realise_place_find(problem, motion->t[k] + problem->gauss.c[i] * h, state, state + n,
                                    unknowns, &place);
        if (status == REFDYN_OK)
            add_point(problem, &place, i, h, &equations);
    }
    if (status == REFDYN_OK)
        status = solve(&equations, interval->by_state);
    if (status == REFDYN_OK)
        condense(motion, k, interval);
    memory_back(&format_memory, mark);
    return status;
}

void realise_interval_change(struct realise_motion *motion, int k, const struct realise_interval *interval,
                             const double *change, const double *values) {
    const int size = REALISE_STAGES * motion->problem->width, sides = 2 * motion->problem->n,
              all = sides + 1 + REALISE_STAGES * motion->problem->spare;
    double *stage = motion->stages + (size_t)k * (size_t)size;
    for (int side = 0; side < all; side++) {
        const double *column = interval->by_state + (size_t)side * (size_t)size;
        const double factor = side < sides ? change[side] : side == sides ? 1 : values[side - sides - 1];
        for (int i = 0; i < size; i++)
            stage[i] += factor * column[i];
    }
}
