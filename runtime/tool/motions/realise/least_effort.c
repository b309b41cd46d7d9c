/*
 * The least effort of a motion with more drives than rows: the changes of the linearised motion that minimise
 *
 *     J = sum over intervals k and Gauss points i of h_k b_i |W (tau + dtau)|^2 / E
 *         + a^2 |distance of the first node from rest|^2 + e^2 |residuals of the end|^2
 *
 * where E is the effort of the first guess. The start cannot be fixed: modes that grow and do not depend on
 * the additional drives fix it, at a distance from rest that decays with the time before the programme.
 *
 * The minimum satisfies linear equations of three kinds of unknowns: the changes x of the nodes, the free
 * values s of the intervals, and the multipliers l of the equations of the intervals. They are in the order
 *
 *     start, x_0, s_0, l_1, x_1, s_1, l_2, ..., x_N, end,
 *
 * in which the equations couple neighbours only. Each residual r of a weight w has a multiplier p with
 * r - p/w^2 = 0, which keeps the large weights out of the matrix. Band elimination with row exchanges solves
 * the equations: the conditions of growing modes are at the end, those of decaying ones at the start.
 */
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"

/* Weights of distances from rest at the start [1/rad, 1/m, s/rad, s/m] and of residuals at the end. */
static const double weight_of_start = 1e5, weight_of_end = 1e6;
/* Rows whose rates by time alone are smaller do not move [m/s, rad/s]. */
static const double rest_tol = 1e-9;

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

/* Residuals of the end: of its rates, which rows leave free, and of the forces of coordinates without a
 * drive.
 */
struct end {
    int count;
    double *by_state; /* (count x 2 n) one row after the other */
    double *residual; /* (count) */
};

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

/* The rates and accelerations (n each) that the end comes close to: 0 if the programme rests, else those of
 * `last` (3 n). */
static bool choose_end(struct realise_problem *problem, double t, const double *end, const double *last,
                       double *rates, double *accelerations) {
    struct refdyn_workspace *work = &problem->scene->work;
    const int n = problem->n;
    bool is_rest = true;
    memset(rates, 0, (size_t)n * sizeof *rates);
    if (refdyn_equations(work, t, end, rates) != REFDYN_OK)
        return false;
    for (int i = 0; i < problem->m; i++)
        is_rest = is_rest && fabs(work->psi[i]) < rest_tol;
    for (int i = 0; i < n; i++) {
        rates[i] = is_rest ? 0 : last[n + i];
        accelerations[i] = is_rest ? 0 : last[2 * n + i];
    }
    return true;
}

/* Residuals: the differences of the end's rates from the wanted ones in the directions that rows leave free.
 * The directions are those at `last`, so that they are the same for all motions. */
static bool put_rates(struct realise_problem *problem, double t, const double *last, const double *end,
                      const double *rates, struct end *out) {
    const int n = problem->n, m = problem->m;
    if (refdyn_equations(&problem->scene->work, t, last, rates) != REFDYN_OK)
        return false;
    const double *N = orthogonal_to(problem->scene->work.u, m, n);
    for (int c = 0; c < n - m; c++, out->count++)
        for (int j = 0; j < n; j++) {
            out->by_state[out->count * 2 * n + n + j] = N[c * n + j];
            out->residual[out->count] += N[c * n + j] * (end[n + j] - rates[j]);
        }
    return true;
}

/* Forces that drives and loops cannot balance, at the wanted accelerations, as shares of the largest
 * stiffness. */
static void put_forces_of_end(const struct realise_problem *problem, const struct realise_place *place,
                              struct end *out) {
    const int n = problem->n, balanced = problem->drives + problem->loops,
              inputs = problem->scene->model->input_count;
    double *rows = realise_scratch(balanced, n), stiffness = 0;
    for (int j = 0; j < n; j++) {
        for (int d = 0; d < problem->drives; d++)
            rows[d * n + j] = place->f_x[j * inputs + problem->input[d]];
        for (int l = 0; l < problem->loops; l++)
            rows[(problem->drives + l) * n + j] = place->u[problem->loop[l] * n + j];
    }
    for (int i = 0; i < n * n; i++)
        stiffness = fmax(stiffness, fabs(place->K[i]));
    const double *Z = orthogonal_to(rows, balanced, n), unit = stiffness > 0 ? 1 / stiffness : 1;
    for (int c = 0; c < n - balanced; c++, out->count++)
        for (int i = 0; i < n; i++) {
            out->residual[out->count] += Z[c * n + i] * unit * place->residual[i];
            for (int j = 0; j < n; j++) /* the rates of the end do not count */
                out->by_state[out->count * 2 * n + j] += Z[c * n + i] * unit * place->K[i * n + j];
        }
}

/* Finds the residuals, and their derivatives by the last node. */
static bool find_end(const struct realise_motion *motion, const double *last, struct end *out) {
    struct realise_problem *problem = motion->problem;
    const int n = problem->n, width = problem->width;
    const double t = motion->t[motion->count], *end = motion->nodes + motion->count * 2 * n,
                 *stage = motion->stages + (motion->count * REALISE_STAGES - 1) * width;
    double *rates = realise_scratch(n, 1), *unknowns = realise_scratch(width, 1);
    struct realise_place place = {.residual = realise_scratch(n + problem->m, 1)};
    *out = (struct end){.by_state = realise_scratch(2 * n, 2 * n), .residual = realise_scratch(2 * n, 1)};
    memcpy(unknowns, stage, (size_t)width * sizeof *unknowns);
    if (!choose_end(problem, t, end, last, rates, unknowns) ||
        !put_rates(problem, t, last, end, rates, out) ||
        realise_place_find(problem, t, end, rates, unknowns, &place) != REFDYN_OK)
        return false;
    if (problem->drives + problem->loops < n)
        put_forces_of_end(problem, &place, out);
    return true;
}

double realise_merit(const struct realise_motion *motion, const struct realise_goal *goal) {
    const int size = 2 * motion->problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    struct end end;
    double sum = realise_effort(motion) / goal->effort_unit;
    for (int i = 0; i < size; i++)
        sum += pow(weight_of_start * (motion->nodes[i] - goal->rest[i]) / goal->unit[i], 2);
    if (!find_end(motion, goal->last, &end))
        sum = INFINITY;
    for (int i = 0; i < end.count; i++)
        sum += pow(weight_of_end * end.residual[i], 2);
    memory_back(&format_memory, mark);
    return sum;
}

bool realise_end_find(const struct realise_motion *motion, const struct realise_goal *goal,
                      double *residuals) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct end end;
    const bool is_found = find_end(motion, goal->last, &end);
    memcpy(residuals, end.residual, (size_t)end.count * sizeof *residuals);
    memory_back(&format_memory, mark);
    return is_found;
}

/* ---- The conditions of the minimum ---- */

/* A symmetric band matrix in the form of LAPACK's dgbsv, the right side, and where the unknowns are. */
struct conditions {
    int size, band, first, block; /* first: place of x_0; block: unknowns from one node to the next */
    double *matrix; /* (3 band + 1) x size: room for exchanges, upper band, diagonal, lower band */
    double *right;
};

static void put_one(struct conditions *conditions, int row, int column, double value) {
    const int band = conditions->band;
    conditions->matrix[(size_t)column * (size_t)(3 * band + 1) + (size_t)(2 * band + row - column)] += value;
}

static void put_both(struct conditions *conditions, int row, int column, double value) {
    put_one(conditions, row, column, value);
    if (row != column)
        put_one(conditions, column, row, value);
}

/* A residual `row` x + side of weight w with multiplier p, of the node at `at`: row x + side - p/w^2 = 0. */
static void put_residual(struct conditions *conditions, int p, int at, const double *row, int size,
                         double side, double weight) {
    for (int j = 0; j < size; j++)
        if (row[j] != 0)
            put_both(conditions, p, at + j, row[j]);
    if (isfinite(weight))
        put_one(conditions, p, p, -1 / (weight * weight));
    conditions->right[p] = -side;
}

/* The distances of the first node from rest, and the rows there. */
static void put_start(struct conditions *conditions, const struct realise_ends *ends,
                      const struct realise_step *step, const double *node, int size) {
    const struct realise_goal *goal = step->goal;
    double *row = realise_scratch(size, 1);
    for (int i = 0; i < size; i++) {
        memset(row, 0, (size_t)size * sizeof *row);
        row[i] = ends->scale[i] / goal->unit[i];
        put_residual(conditions, i, conditions->first, row, size,
                     step->is_projection ? 0 : (node[i] - goal->rest[i]) / goal->unit[i], weight_of_start);
    }
    for (int i = 0; i < ends->count; i++) {
        for (int j = 0; j < size; j++)
            row[j] = ends->rows[j * ends->count + i] * ends->scale[j];
        put_residual(conditions, size + i, conditions->first, row, size, -ends->sides[i], INFINITY);
    }
}

static bool put_end(struct conditions *conditions, const struct realise_motion *motion,
                    const struct realise_ends *ends, const struct realise_step *step) {
    const int size = 2 * motion->problem->n, at = conditions->first + motion->count * conditions->block;
    struct end end;
    if (!find_end(motion, step->goal->last, &end))
        return false;
    for (int i = 0; i < end.count; i++) {
        double *row = end.by_state + i * size;
        for (int j = 0; j < size; j++)
            row[j] *= ends->scale[j];
        put_residual(conditions, at + size + i, at, row, size,
                     end.residual[i] - (step->is_projection ? step->aim[i] : 0), weight_of_end);
    }
    conditions->size = at + size + end.count;
    return true;
}

/* The derivative of the force of drive d at Gauss point i by x and s, times its weight in the effort. The
 * force itself, or that of its change, is added to these values. */
static double find_force(const struct realise_motion *motion, int k, const struct realise_interval *interval,
                         const struct realise_step *step, const double *scale, int i, int d, double *row) {
    const struct realise_problem *problem = motion->problem;
    const int size = 2 * problem->n, free = REALISE_STAGES * problem->spare, width = problem->width,
              stride = REALISE_STAGES * width, at = i * width + problem->n + d;
    const double factor =
        problem->weights[d] * sqrt((motion->t[k + 1] - motion->t[k]) *
                                   problem->gauss.once[REALISE_STAGES][i] / step->goal->effort_unit);
    for (int j = 0; j < size; j++)
        row[j] = factor * interval->by_state[j * stride + at] * scale[j];
    for (int j = 0; j < free; j++)
        row[size + j] = factor * interval->by_state[(size + 1 + j) * stride + at];
    return factor * ((step->is_projection ? 0 : motion->stages[k * stride + at]) +
                     interval->by_state[size * stride + at]);
}

/* The effort of interval k, the damping, and its equation with the next node. */
static void put_interval(struct conditions *conditions, const struct realise_motion *motion, int k,
                         const struct realise_interval *interval, const struct realise_step *step,
                         const double *scale) {
    const struct realise_problem *problem = motion->problem;
    const int size = 2 * problem->n, free = REALISE_STAGES * problem->spare, all = size + free,
              at = conditions->first + k * conditions->block, multipliers = at + all,
              next = at + conditions->block;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *row = realise_scratch(all, 1);
    for (int i = 0; i < REALISE_STAGES; i++)
        for (int d = 0; d < problem->drives; d++) {
            const double side = find_force(motion, k, interval, step, scale, i, d, row);
            for (int a = 0; a < all; a++) {
                for (int b = 0; b < all; b++)
                    put_one(conditions, at + a, at + b, row[a] * row[b]);
                conditions->right[at + a] -= row[a] * side;
            }
        }
    for (int i = 0; i < size; i++) {
        put_one(conditions, at + i, at + i, step->damping * (motion->t[k + 1] - motion->t[k]));
        for (int j = 0; j < size; j++)
            put_both(conditions, multipliers + i, at + j, interval->Phi[j * size + i] * scale[j] / scale[i]);
        for (int j = 0; j < free; j++)
            put_both(conditions, multipliers + i, at + size + j, interval->Gamma[j * size + i] / scale[i]);
        put_both(conditions, multipliers + i, next + i, -1);
        conditions->right[multipliers + i] = -interval->gap[i] / scale[i];
    }
    memory_back(&format_memory, mark);
}

static struct conditions start_conditions(const struct realise_motion *motion, int rows) {
    const int size = 2 * motion->problem->n, free = REALISE_STAGES * motion->problem->spare,
              first = size + rows, block = 2 * size + free, most = first + motion->count * block + 2 * size,
              band = (first + size > block ? first + size : block) - 1;
    return (struct conditions){.band = band,
                               .first = first,
                               .block = block,
                               .matrix = realise_scratch(3 * band + 1, most),
                               .right = realise_scratch(most, 1)};
}

bool realise_effort_solve(const struct realise_motion *motion, const struct realise_interval *intervals,
                          const struct realise_step *step, const struct realise_ends *ends, double *changes,
                          double *values) {
    const int size = 2 * motion->problem->n, free = REALISE_STAGES * motion->problem->spare;
    const struct memory_mark mark = memory_mark(&format_memory);
    struct conditions conditions = start_conditions(motion, ends->count);
    put_start(&conditions, ends, step, motion->nodes, size);
    for (int k = 0; k < motion->count; k++)
        put_interval(&conditions, motion, k, &intervals[k], step, ends->scale);
    bool is_solved = put_end(&conditions, motion, ends, step);
    lapack_int *pivots = memory_scratch(&format_memory, (size_t)(conditions.size + 1) * sizeof *pivots);
    is_solved = is_solved && LAPACKE_dgbsv(LAPACK_COL_MAJOR, conditions.size, conditions.band,
                                           conditions.band, 1, conditions.matrix, 3 * conditions.band + 1,
                                           pivots, conditions.right, conditions.size) == 0;
    for (int i = 0; i < size; i++) /* the residuals that this step predicts */
        step->aim[i] = (step->is_projection ? step->aim[i] : 0) +
                       conditions.right[conditions.first + motion->count * conditions.block + size + i] /
                           (weight_of_end * weight_of_end);
    for (int k = 0; k <= motion->count; k++) {
        const double *x = conditions.right + conditions.first + k * conditions.block;
        for (int i = 0; i < size; i++)
            changes[k * size + i] = x[i] * ends->scale[i];
        for (int i = 0; i < free && k < motion->count; i++)
            values[k * free + i] = x[size + i];
    }
    memory_back(&format_memory, mark);
    return is_solved;
}
