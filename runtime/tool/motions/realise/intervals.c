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

/* Scratch of one interval: the linear equations of its unknowns, columns one after the other. */
struct equations {
    int size, sides;
    double *matrix, *right; /* (size x size), (size x sides) */
};

/* Adds the rows of point i: `place` has the equations there. */
static void add_point(const struct realise_problem *problem, const struct realise_place *place, int i,
                      double h, struct equations *equations) {
    const int n = problem->n, m = problem->m, width = problem->width, size = equations->size;
    const int inputs = problem->scene->model->input_count;
    const double c = problem->gauss.c[i];
    for (int row = 0; row < n + m; row++) {
        const bool is_row = row >= n;
        const int at = (is_row ? row - n : row) * n;
        const double *by_q = (is_row ? place->G_q : place->K) + at,
                     *by_qd = (is_row ? place->G_qd : place->D) + at,
                     *by_qdd = (is_row ? place->u : place->M) + at;
        double *out = equations->matrix + i * width + row, *right = equations->right + i * width + row;
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

/* Solves with rows and columns of equal size. Rounding slows Newton's method and does not change its result.
 */
static int solve(struct equations *equations, double *solution) {
    const int size = equations->size, sides = equations->sides;
    double *rows = realise_scratch(size, 1), *columns = realise_scratch(size, 1), row_ratio, column_ratio,
           largest;
    lapack_int *pivots = memory_scratch(&format_memory, (size_t)size * sizeof *pivots);
    if (LAPACKE_dgeequ(LAPACK_COL_MAJOR, size, size, equations->matrix, size, rows, columns, &row_ratio,
                       &column_ratio, &largest) != 0)
        return REFDYN_MATRIX_SINGULAR;
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++)
            equations->matrix[j * size + i] *= rows[i] * columns[j];
    for (int j = 0; j < sides; j++)
        for (int i = 0; i < size; i++)
            equations->right[j * size + i] *= rows[i];
    if (LAPACKE_dgesv(LAPACK_COL_MAJOR, size, sides, equations->matrix, size, pivots, equations->right,
                      size) != 0)
        return REFDYN_MATRIX_SINGULAR;
    for (int j = 0; j < sides; j++)
        for (int i = 0; i < size; i++)
            solution[j * size + i] = equations->right[j * size + i] * columns[i];
    return REFDYN_OK;
}

/* Phi and gap from the changes of the accelerations. */
static void condense(const struct realise_motion *motion, int k, struct realise_interval *interval) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width, size = REALISE_STAGES * width;
    const double h = motion->t[k + 1] - motion->t[k];
    const double *next = motion->nodes + (size_t)(k + 1) * 2 * (size_t)n;
    realise_interval_state(motion, k, 1, problem->gauss.once[REALISE_STAGES],
                           problem->gauss.twice[REALISE_STAGES], interval->gap);
    for (int i = 0; i < 2 * n; i++)
        interval->gap[i] -= next[i];
    for (int side = 0; side <= 2 * n; side++) {
        const double *change = interval->by_state + (size_t)side * (size_t)size;
        double *out = side < 2 * n ? interval->Phi + (size_t)side * 2 * (size_t)n : interval->gap;
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
    struct equations equations = {.size = REALISE_STAGES * width, .sides = 2 * n + 1};
    equations.matrix = realise_scratch(equations.size, equations.size);
    equations.right = realise_scratch(equations.size, equations.sides);
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
                             const double *change) {
    const int size = REALISE_STAGES * motion->problem->width, sides = 2 * motion->problem->n;
    double *stage = motion->stages + (size_t)k * (size_t)size;
    for (int side = 0; side <= sides; side++) {
        const double *column = interval->by_state + (size_t)side * (size_t)size;
        const double factor = side < sides ? change[side] : 1;
        for (int i = 0; i < size; i++)
            stage[i] += factor * column[i];
    }
}
