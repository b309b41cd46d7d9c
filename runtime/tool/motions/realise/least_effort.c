/*
 * The least effort of a motion with more drives than rows: the changes of the linearised motion that minimise
 *
 *     J = sum over intervals k and Gauss points i of h_k b_i |W (tau + dtau)|^2
 *
 * from a fixed first node to an end at rest. The recursion runs backward through the intervals. The least J
 * of all later ones is |R x + rho|^2 with a triangular R: an orthogonal factor eliminates the free values of
 * each interval as a function of its node (the square root form of the Riccati recursion: M. Morf and T.
 * Kailath, IEEE Trans. Automat. Contr. 20:487-497, 1975). The forward sweep follows this feedback.
 *
 * The first node can only stay if the drives act on all degrees of freedom. Otherwise some growing modes do
 * not depend on the free values, and R has no bound.
 */
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"

/* Weight of the rates at the end, relative to the root of the effort [s/rad, s/m]. */
static const double weight_of_end = 1e6;
/* Rows whose rates by time alone are smaller do not move [m/s, rad/s]. */
static const double rest_tol = 1e-9;

/* The effort from a node on: |R x + rho|^2 for the change x of the node, divided by its scale. */
struct effort {
    double *R, *rho; /* (2 n x 2 n) columns one after the other; (2 n) */
};

/* The free values of an interval: S s + by_node x + constant = 0. */
struct feedback {
    double *S, *by_node, *constant; /* (free x free) upper triangle, (free x 2 n), (free) */
};

double realise_effort(const struct realise_motion *motion) {
    const struct realise_problem *problem = motion->problem;
    double sum = 0;
    for (int k = 0; k < motion->count; k++)
        for (int i = 0; i < REALISE_STAGES; i++)
            for (int d = 0; d < problem->drives; d++) {
                const double tau = motion->stages[(k * REALISE_STAGES + i) * problem->width + problem->n + d];
                sum += (motion->t[k + 1] - motion->t[k]) * problem->gauss.once[REALISE_STAGES][i] *
                       pow(problem->weights[d] * tau, 2);
            }
    return sum;
}

/* ---- The end ---- */

/* Columns (n x (n - count)) that are orthogonal to the rows (count x n, one row after the other). */
static double *orthogonal_to(const double *rows, int count, int n) {
    double *A = realise_scratch(n, n), *Q = realise_scratch(n, n), *reflectors = realise_scratch(n, 1);
    memcpy(A, rows, (size_t)(n * count) * sizeof *A);
    LAPACKE_dgeqrf(LAPACK_COL_MAJOR, n, count, A, n, reflectors);
    for (int i = 0; i < n; i++)
        Q[i * n + i] = 1;
    LAPACKE_dormqr(LAPACK_COL_MAJOR, 'L', 'N', n, n, count, A, n, reflectors, Q, n);
    return Q + count * n;
}

/* The effort after the end: the differences of the rates that rows leave free from those of `last`, or from 0
 * if the programme rests. */
static bool put_end(const struct realise_motion *motion, const double *last, const double *scale,
                    struct effort *effort) {
    struct refdyn_workspace *work = &motion->problem->scene->work;
    const int n = motion->problem->n, m = motion->problem->m;
    const double *end = motion->nodes + motion->count * 2 * n, size = sqrt(realise_effort(motion)),
                 weight = weight_of_end * (size > 0 ? size : 1);
    double *rates = realise_scratch(n, 1);
    bool is_rest = true;
    if (refdyn_equations(work, motion->t[motion->count], end, rates) != REFDYN_OK)
        return false;
    for (int i = 0; i < m; i++)
        is_rest = is_rest && fabs(work->psi[i]) < rest_tol;
    const double *N = orthogonal_to(work->u, m, n);
    for (int c = 0; c < n - m; c++)
        for (int j = 0; j < n; j++) {
            const double factor = weight * N[c * n + j];
            effort->R[(n + j) * 2 * n + c] = factor * scale[n + j];
            effort->rho[c] += factor * (end[n + j] - (is_rest ? 0 : last[n + j]));
        }
    return true;
}

/* ---- The recursion ---- */

/* Rows of the effort after interval k: columns of its free values, columns of its node, the constant. */
static void put_later(const struct realise_interval *interval, const double *scale, int n, int free, int rows,
                      const struct effort *later, double *A) {
    const int size = 2 * n;
    for (int column = 0; column <= free + size; column++) {
        const int node = column - free;
        const double *from = column < free ? interval->Gamma + column * size
                             : node < size ? interval->Phi + node * size
                                           : interval->gap;
        const double factor = column >= free && node < size ? scale[node] : 1;
        double *out = A + column * rows;
        for (int j = 0; j < size; j++)
            for (int i = 0; i < size; i++)
                out[i] += later->R[j * size + i] * from[j] / scale[j] * factor;
        for (int i = 0; i < size && node == size; i++)
            out[i] += later->rho[i];
    }
}

/* Rows of the forces in interval k, or of their changes. */
static void put_forces(const struct realise_motion *motion, int k, const struct realise_interval *interval,
                       const struct realise_step *step, const double *scale, int free, int rows, double *A) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, size = 2 * n, width = problem->width, stride = REALISE_STAGES * width;
    for (int i = 0; i < REALISE_STAGES; i++)
        for (int d = 0; d < problem->drives; d++) {
            const int row = size + i * problem->drives + d, at = i * width + n + d;
            const double factor = problem->weights[d] * sqrt((motion->t[k + 1] - motion->t[k]) *
                                                             problem->gauss.once[REALISE_STAGES][i]);
            for (int j = 0; j < free; j++)
                A[j * rows + row] = factor * interval->by_state[(size + 1 + j) * stride + at];
            for (int j = 0; j < size; j++)
                A[(free + j) * rows + row] = factor * interval->by_state[j * stride + at] * scale[j];
            A[(free + size) * rows + row] =
                factor * ((step->is_projection ? 0 : motion->stages[k * stride + at]) +
                          interval->by_state[size * stride + at]);
        }
}

/* Eliminates the free values of interval k; the effort is then that from its node on. */
static void eliminate(const struct realise_motion *motion, int k, const struct realise_interval *interval,
                      const struct realise_step *step, const double *scale, struct effort *effort,
                      struct feedback *feedback) {
    const struct realise_problem *problem = motion->problem;
    const int n = problem->n, size = 2 * n, free = REALISE_STAGES * problem->spare,
              forces = size + REALISE_STAGES * problem->drives, rows = forces + size,
              columns = free + size + 1;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *A = realise_scratch(rows, columns), *reflectors = realise_scratch(columns, 1);
    put_later(interval, scale, n, free, rows, effort, A);
    put_forces(motion, k, interval, step, scale, free, rows, A);
    for (int i = 0; i < size; i++)
        A[(free + i) * rows + forces + i] = sqrt(step->damping * (motion->t[k + 1] - motion->t[k]));
    LAPACKE_dgeqrf(LAPACK_COL_MAJOR, rows, columns, A, rows, reflectors);
    for (int j = 0; j < columns; j++) {
        double *out = j < free          ? feedback->S + j * free
                      : j < free + size ? feedback->by_node + (j - free) * free
                                        : feedback->constant;
        for (int i = 0; i < free && i <= j; i++)
            out[i] = A[j * rows + i];
        out = j < free + size ? effort->R + (j - free) * size : effort->rho;
        for (int i = 0; i < size && j >= free; i++)
            out[i] = free + i <= j ? A[j * rows + free + i] : 0;
    }
    memory_back(&format_memory, mark);
}

/* s = -S^-1 (by_node x + constant). False if S is singular. */
static bool find_values(const struct feedback *feedback, const double *x, int size, int free,
                        double *values) {
    for (int i = free - 1; i >= 0; i--) {
        values[i] = -feedback->constant[i];
        for (int j = 0; j < size; j++)
            values[i] -= feedback->by_node[j * free + i] * x[j];
        for (int j = i + 1; j < free; j++)
            values[i] -= feedback->S[j * free + i] * values[j];
        if (feedback->S[i * free + i] == 0)
            return false;
        values[i] /= feedback->S[i * free + i];
    }
    return true;
}

bool realise_effort_solve(const struct realise_motion *motion, const struct realise_interval *intervals,
                          const struct realise_step *step, const double *last, const double *scale,
                          double *changes, double *values) {
    const int size = 2 * motion->problem->n, free = REALISE_STAGES * motion->problem->spare;
    const struct memory_mark mark = memory_mark(&format_memory);
    struct effort effort = {realise_scratch(size, size), realise_scratch(size, 1)};
    struct feedback *feedback = memory_scratch(&format_memory, (size_t)motion->count * sizeof *feedback);
    double *x = realise_scratch(size, 1);
    bool is_solved = put_end(motion, last, scale, &effort);
    for (int k = motion->count - 1; k >= 0; k--) {
        feedback[k] = (struct feedback){realise_scratch(free, free), realise_scratch(free, size),
                                        realise_scratch(free, 1)};
        eliminate(motion, k, &intervals[k], step, scale, &effort, &feedback[k]);
    }
    memset(changes, 0, (size_t)size * sizeof *changes);
    for (int k = 0; k < motion->count; k++) {
        const double *change = changes + k * size;
        double *next = changes + (k + 1) * size, *s = values + k * free;
        for (int i = 0; i < size; i++)
            x[i] = change[i] / scale[i];
        is_solved = find_values(&feedback[k], x, size, free, s) && is_solved;
        for (int i = 0; i < size; i++) {
            next[i] = intervals[k].gap[i];
            for (int j = 0; j < size; j++)
                next[i] += intervals[k].Phi[j * size + i] * change[j];
            for (int j = 0; j < free; j++)
                next[i] += intervals[k].Gamma[j * size + i] * s[j];
        }
    }
    memory_back(&format_memory, mark);
    return is_solved;
}
