/*
 * Least squares with bounds by Levenberg and Marquardt.
 *
 * Each round factors J = Q R once. A step d minimises |R d + Q^T r|^2 + lambda |D d|^2 over the unknowns that
 * are not held at a bound, with D the norms of the columns (Marquardt 1963; More, Lecture Notes in
 * Mathematics 630:105-116, 1978). Lambda falls after steps that succeed and grows after the others.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include <lapacke.h>

#include "runtime/tool/motions/fit/fit.h"

/* First lambda, its factors after a good and a bad step, and the value beyond which steps are too small. */
static const double lambda_first = 1e-3, lambda_falls = 0.2, lambda_grows = 4, lambda_most = 1e12;
/* A step is good if chi^2 falls by at least this part of the predicted decrease. */
static const double gain_least = 1e-3;
/* The search also ends when the predicted decrease is a smaller part of chi^2: below the error of the motion.
 */
static const double decrease_part = 1e-9;
/* The search is stuck if no step decreases chi^2 although the derivatives predict a decrease by more than one
 * standard error (stuck_least) and by more than this part of chi^2 (stuck_part). */
static const double stuck_least = 1, stuck_part = 1e-6;

/* A round: the factors of J, and scratch for steps. */
struct round {
    const struct least_squares *problem;
    double *R, *c;          /* (count x count, columns first), (count): the factor, and Q^T r */
    double *D;              /* (count) largest norms of the columns so far */
    bool *is_held;          /* (count) at a bound that the step would cross */
    double *d, *tried, *r;  /* (count), (count), (rows) */
    double *matrix, *right; /* (2 count x count), (2 count) */
    bool has_moved;         /* a step was taken */
};

static double *scratch(int size) {
    return memory_scratch(&format_memory, ((size_t)size + 1) * sizeof(double));
}

static double square_of(const double *x, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += x[i] * x[i];
    return sum;
}

static bool factor(struct round *round) {
    const struct least_squares *problem = round->problem;
    const int n = problem->count, m = problem->rows;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *A = format_allocate_large((size_t)m * (size_t)(n + 1) + 1, sizeof *A);
    memcpy(A, problem->J, (size_t)m * (size_t)n * sizeof *A);
    memcpy(A + (size_t)m * (size_t)n, problem->r, (size_t)m * sizeof *A);
    /* the last column becomes Q^T r */
    const bool is_good = LAPACKE_dgeqrf(LAPACK_COL_MAJOR, m, n + 1, A, m, scratch(n + 1)) == 0;
    memset(round->R, 0, (size_t)n * (size_t)n * sizeof *round->R);
    for (int k = 0; k <= n; k++)
        for (int i = 0; i < n && i < m && (i <= k || k == n); i++)
            *(k == n ? &round->c[i] : &round->R[k * n + i]) = A[(size_t)k * (size_t)m + (size_t)i];
    free(A);
    memory_back(&format_memory, mark);
    for (int k = 0; k < n; k++)
        round->D[k] = fmax(round->D[k], sqrt(square_of(round->R + k * n, n)));
    return is_good;
}

/* Half the gradient of chi^2 by unknown k. */
static double gradient(const struct round *round, int k) {
    double sum = 0;
    for (int i = 0; i < round->problem->count; i++)
        sum += round->R[k * round->problem->count + i] * round->c[i];
    return sum;
}

static void hold_at_bounds(struct round *round) {
    const struct least_squares *problem = round->problem;
    for (int k = 0; k < problem->count; k++) {
        const double slope = gradient(round, k);
        round->is_held[k] = (problem->u[k] <= problem->lower[k] && slope > 0) ||
                            (problem->u[k] >= problem->upper[k] && slope < 0);
    }
}

/* The decrease of chi^2 that the derivatives predict for the step. */
static double predict(const struct round *round) {
    const int n = round->problem->count;
    double before = 0, after = 0;
    for (int i = 0; i < n; i++) {
        double sum = round->c[i];
        for (int k = 0; k < n; k++)
            sum += round->R[k * n + i] * round->d[k];
        before += round->c[i] * round->c[i];
        after += sum * sum;
    }
    return before - after;
}

/* Computes the step for this lambda, within the bounds. */
static bool make_step(struct round *round, double lambda) {
    const struct least_squares *problem = round->problem;
    const int n = problem->count, rows = 2 * n;
    memset(round->matrix, 0, (size_t)rows * (size_t)n * sizeof *round->matrix);
    memset(round->right, 0, (size_t)rows * sizeof *round->right);
    for (int k = 0; k < n; k++) {
        round->right[k] = -round->c[k];
        if (!round->is_held[k])
            memcpy(round->matrix + k * rows, round->R + k * n, (size_t)n * sizeof *round->matrix);
        round->matrix[k * rows + n + k] =
            round->is_held[k] || round->D[k] == 0 ? 1 : sqrt(lambda) * round->D[k];
    }
    if (LAPACKE_dgels(LAPACK_COL_MAJOR, 'N', rows, n, 1, round->matrix, rows, round->right, rows) != 0)
        return false;
    double largest = 0;
    for (int k = 0; k < n; k++)
        largest = fmax(largest, fabs(round->right[k]));
    const double part = largest > problem->step_most ? problem->step_most / largest : 1;
    for (int k = 0; k < n; k++) {
        round->tried[k] =
            fmin(fmax(problem->u[k] + part * round->right[k], problem->lower[k]), problem->upper[k]);
        round->d[k] = round->tried[k] - problem->u[k];
    }
    return isfinite(largest);
}

/* Tries steps until one is good. Sets *is_last if no further step is worth trying. */
static enum fit_outcome advance(struct round *round, struct least_squares *problem, double *lambda,
                                bool *is_last) {
    const double least = fmax(problem->decrease_least, decrease_part * problem->chi2),
                 stuck = fmax(stuck_least, stuck_part * problem->chi2);
    double most = 0; /* the largest decrease that was predicted but not reached */
    round->has_moved = false;
    for (;;) {
        if (!make_step(round, *lambda))
            return FIT_FAILED;
        const double predicted = predict(round);
        *is_last = predicted <= least;
        if (*is_last && (most > 0 || !problem->takes_last))
            return most > stuck ? FIT_STUCK : FIT_DONE;
        const enum fit_outcome outcome = problem->residuals(problem->context, round->tried, round->r, NULL);
        if (outcome == FIT_STOPPED)
            return outcome;
        const double chi2 = outcome == FIT_DONE ? square_of(round->r, problem->rows) : INFINITY,
                     decrease = problem->chi2 - chi2;
        round->has_moved = decrease >= gain_least * predicted;
        if (round->has_moved) {
            *is_last = *is_last || decrease <= least;
            memcpy(problem->u, round->tried, (size_t)problem->count * sizeof *problem->u);
            *lambda *= lambda_falls;
        }
        if (round->has_moved || *is_last)
            return FIT_DONE;
        most = fmax(most, predicted);
        *lambda *= lambda_grows;
        if (*lambda > lambda_most)
            return FIT_STUCK;
    }
}

static void allocate(struct round *round, const struct least_squares *problem) {
    const int n = problem->count;
    *round = (struct round){.problem = problem};
    round->R = scratch(n * n);
    round->c = scratch(n);
    round->D = scratch(n);
    round->is_held = memory_scratch(&format_memory, ((size_t)n + 1) * sizeof(bool));
    round->d = scratch(n);
    round->tried = scratch(n);
    round->matrix = scratch(2 * n * n);
    round->right = scratch(2 * n);
    round->r = format_allocate_large((size_t)problem->rows + 1, sizeof *round->r);
}

enum fit_outcome least_squares_solve(struct least_squares *problem) {
    const struct memory_mark mark = memory_mark(&format_memory);
    struct round round;
    double lambda = lambda_first;
    bool is_last = false;
    allocate(&round, problem);
    problem->rounds = 0;
    enum fit_outcome outcome = problem->residuals(problem->context, problem->u, problem->r, problem->J);
    problem->chi2 = outcome == FIT_DONE ? square_of(problem->r, problem->rows) : INFINITY;
    while (outcome == FIT_DONE && !is_last && problem->rounds < problem->rounds_most) {
        problem->rounds++;
        if (!factor(&round))
            outcome = FIT_FAILED;
        hold_at_bounds(&round);
        if (outcome == FIT_DONE)
            outcome = advance(&round, problem, &lambda, &is_last);
        if (outcome == FIT_DONE && round.has_moved) {
            outcome = problem->residuals(problem->context, problem->u, problem->r, problem->J);
            problem->chi2 = outcome == FIT_DONE ? square_of(problem->r, problem->rows) : INFINITY;
        }
    }
    free(round.r);
    memory_back(&format_memory, mark);
    return outcome == FIT_DONE && !is_last ? FIT_STUCK : outcome;
}
