/*
 * Newton's iteration to the rows and to balance.
 *
 * In: a start and the fraction of the load that acts. Out: the equilibrium under it. While the load is
 * increased in steps, the first correction must not be longer than `reach`, and each later one at most half
 * as long as the previous one. Otherwise the iteration fails, because it might converge to a distant
 * equilibrium. If the load is not increased in steps, corrections are damped by the restricted natural
 * monotonicity test: a step a dq is accepted if the following correction, with the same tangent, is at most
 * (1 - a/4) times as long (Deuflhard, Newton Methods for Nonlinear Problems, 2004, sect. 3.3).
 */
#include "runtime/core/statics/statics.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* Ratio of successive corrections while the load increases, up to which Newton's iteration converges to the
 * nearby equilibrium. */
static const double contraction = 0.5;
static const double damping_least = 1.0 / 1024;
/* Rows may deviate from linearity along a longer step by this fraction of the reach. */
static const double nearly_linear = 0.1;
/* Largest number of steps onto rows that are beyond the reach. */
enum { FAR_STEPS_MOST = 2000 };
/* [rad, length] Redundant rows must hold within this distance where the independent rows hold. */
static const double rows_tol = 1e-9;

static size_t bytes_of(const struct statics *statics) {
    return (size_t)statics->balance.n * sizeof(double);
}

static void swap_places(struct balance *balance) {
    const struct place kept = balance->now;
    balance->now = balance->trial;
    balance->trial = kept;
}

/* Reads into `trial` the place of `now` moved by a fraction of a step. */
static int try_step(struct balance *balance, double damping, const double *step) {
    memcpy(balance->trial.q, balance->now.q, (size_t)balance->n * sizeof(double));
    refdyn_balance_move(balance, damping, step, balance->trial.q);
    return refdyn_balance_read(balance, &balance->trial);
}

/* ---- Onto the rows ---- */

/*
 * Computes the shortest step, in units, with u step = -phi: with x_d - P x_i = c it is x_d = w, x_i = -P^T w,
 * (1 + P P^T) w = c.
 */
static void shortest_step(struct balance *b, const struct place *residual, double *step) {
    const int rank = b->rank, left = b->count - rank;
    double *gram = b->tangent, *P = b->coupling;
    const double *unit_free = b->y;
    for (int i = 0; i < b->count; i++)
        b->y[i] = b->unit[b->free[b->column[i]]];
    for (int k = 0; k < rank; k++)
        for (int i = 0; i < left; i++)
            P[k * left + i] = b->now.P[k * left + i] * unit_free[rank + i] / unit_free[k];
    for (int k = 0; k < rank; k++)
        for (int l = 0; l < rank; l++)
            gram[k * rank + l] = (k == l) + dense_dot(P + k * left, P + l * left, left);
    refdyn_balance_meet_rows(b, residual, b->p);
    for (int k = 0; k < rank; k++)
        b->p[k] /= unit_free[k];
    refdyn_factor(gram, rank, rank);
    refdyn_factor_solve(gram, rank, rank, b->p);
    for (int k = 0; k < rank; k++)
        step[b->column[k]] = unit_free[k] * b->p[k];
    for (int i = 0; i < left; i++) {
        double sum = 0;
        for (int k = 0; k < rank; k++)
            sum -= P[k * left + i] * b->p[k];
        step[b->column[rank + i]] = unit_free[rank + i] * sum;
    }
}

/* Returns the row with the largest distance, and that distance. */
static int farthest_row(const struct balance *balance, double *distance) {
    int farthest = -1;
    *distance = 0;
    for (int a = 0; a < balance->row_count; a++) {
        const double own = refdyn_balance_distance(balance, &balance->now, a);
        if (farthest < 0 || !(own <= *distance)) {
            *distance = own;
            farthest = a;
        }
    }
    return farthest;
}

static int rows_not_met(struct balance *balance) {
    double distance;
    return refdyn_balance_fail(balance, REFDYN_NO_CONVERGENCE, farthest_row(balance, &distance), -1);
}

/* Returns whether `trial` is nearer to the rows. A step longer than the reach must also end near the place
 * predicted by linear rows, so that Newton does not continue from a solution several revolutions away.
 * Overwrites step_next. */
static int is_nearer(struct statics *statics, double damping, double length) {
    const struct balance *balance = &statics->balance;
    double *next = statics->step_next;
    if (!(refdyn_balance_length(balance, next) <= (1 - damping / 4) * length))
        return 0;
    if (damping * length <= statics->options->reach)
        return 1;
    for (int i = 0; i < balance->count; i++)
        next[i] -= (1 - damping) * statics->step[i];
    return refdyn_balance_length(balance, next) <= nearly_linear * statics->options->reach;
}

/* Takes a damped step towards the rows. *done: the step was within tol, or at rounding level and no longer
 * decreasing. *is_far: the rows are beyond the reach. */
static int step_to_rows(struct statics *statics, int *done, int *is_far) {
    struct balance *balance = &statics->balance;
    refdyn_balance_choose(balance, &balance->now);
    const int status = refdyn_balance_eliminate(balance, &balance->now);
    if (status)
        return status;
    shortest_step(balance, &balance->now, statics->step);
    const double length = refdyn_balance_length(balance, statics->step);
    *done = length <= statics->options->tol;
    *is_far = length > statics->options->reach;
    for (double damping = 1; damping >= damping_least; damping /= 2) {
        if (try_step(balance, damping, statics->step))
            continue;
        shortest_step(balance, &balance->trial, statics->step_next);
        if (*done || is_nearer(statics, damping, length)) {
            swap_places(balance);
            return REFDYN_OK;
        }
    }
    *done = length <= sqrt(DBL_EPSILON);
    return *done ? REFDYN_OK : rows_not_met(balance);
}

/* Returns whether the redundant rows are satisfied as well. */
static int all_rows_hold(struct balance *balance) {
    double distance;
    const int row = farthest_row(balance, &distance);
    return distance <= rows_tol ? REFDYN_OK : refdyn_balance_fail(balance, REFDYN_ROWS_INCONSISTENT, row, -1);
}

int refdyn_newton_meet_rows(struct statics *statics, double *q) {
    struct balance *balance = &statics->balance;
    int done = balance->row_count == 0, near_steps = 0, far_steps = 0;
    balance->rank_most = balance->row_count;
    memcpy(balance->now.q, q, bytes_of(statics));
    int status = refdyn_balance_read(balance, &balance->now);
    while (near_steps < statics->options->iterations && far_steps < FAR_STEPS_MOST && !done && !status) {
        int is_far = 0;
        status = step_to_rows(statics, &done, &is_far);
        near_steps += !is_far;
        far_steps += is_far;
    }
    if (!status)
        status = done ? all_rows_hold(balance) : rows_not_met(balance);
    if (status)
        return status;
    refdyn_balance_choose(balance, &balance->now);
    balance->rank_most = balance->rank;
    memcpy(q, balance->now.q, bytes_of(statics));
    return REFDYN_OK;
}

/* ---- To the balance ---- */

/* Returns the allowed ratio of the next correction to this one after a step with this damping. */
static double allowed_growth(const struct statics *statics, double damping) {
    return statics->is_following ? contraction : 1 - damping / 4;
}

/* Halves the step until the following correction is shorter. Leaves its end in `trial`. */
static int take_damped(struct statics *statics, double length) {
    struct balance *balance = &statics->balance;
    const double least = statics->is_following ? 1 : damping_least;
    int status = REFDYN_NO_CONVERGENCE;
    for (double damping = 1; damping >= least; damping /= 2) {
        status = try_step(balance, damping, statics->step);
        if (!status)
            status = refdyn_balance_eliminate(balance, &balance->trial);
        if (status)
            continue;
        refdyn_balance_correct(balance, &balance->trial, statics->step_next);
        if (refdyn_balance_length(balance, statics->step_next) <= allowed_growth(statics, damping) * length)
            return REFDYN_OK;
        status = REFDYN_NO_CONVERGENCE;
    }
    return status;
}

/* Records the coordinate farthest from balance, or the row that is not satisfied. */
static int not_converged(struct statics *statics, int status) {
    struct balance *balance = &statics->balance;
    int at;
    double distance;
    if (status != REFDYN_NO_CONVERGENCE)
        return status;
    const int row = farthest_row(balance, &distance);
    if (distance > rows_tol)
        return refdyn_balance_fail(balance, status, row, -1);
    refdyn_largest(balance->now.g, balance->count - balance->rank, &at);
    return refdyn_balance_fail(balance, status, -1, at < 0 ? -1 : balance->column[balance->rank + at]);
}

static int find_correction(struct statics *statics) {
    struct balance *balance = &statics->balance;
    refdyn_balance_choose(balance, &balance->now);
    int status = refdyn_balance_eliminate(balance, &balance->now);
    if (!status)
        status = refdyn_balance_find_tangent(balance);
    if (!status)
        status = refdyn_balance_factor(balance);
    if (!status)
        refdyn_balance_correct(balance, &balance->now, statics->step);
    return status;
}

/* Takes one Newton step from `now`. *done: the correction is within tol, or at rounding level and no longer
 * decreasing. */
static int newton_step(struct statics *statics, int *done) {
    struct balance *balance = &statics->balance;
    int status = find_correction(statics);
    if (status)
        return status;
    const double length = refdyn_balance_length(balance, statics->step);
    if (statics->is_first && statics->is_following && length > statics->options->reach)
        return REFDYN_NO_CONVERGENCE;
    statics->is_first = 0;
    *done = length <= statics->options->tol;
    if (*done) {
        refdyn_balance_move(balance, 1, statics->step, balance->now.q);
        return refdyn_balance_read(balance, &balance->now);
    }
    status = take_damped(statics, length);
    *done = status == REFDYN_NO_CONVERGENCE && length <= sqrt(DBL_EPSILON);
    if (!status)
        swap_places(balance);
    return *done ? REFDYN_OK : status;
}

/*
 * Checks redundant rows at an equilibrium. If one does not hold, it may have become independent on the way:
 * determines the rank again and clears *done.
 */
static int judge_rows(struct statics *statics, int *done) {
    struct balance *balance = &statics->balance;
    const int rank = balance->rank, status = all_rows_hold(balance);
    if (!status)
        return REFDYN_OK;
    balance->rank_most = balance->row_count;
    refdyn_balance_choose(balance, &balance->now);
    *done = 0;
    return balance->rank > rank ? REFDYN_OK : status;
}

int refdyn_newton_solve(struct statics *statics, double load, double *q) {
    struct balance *balance = &statics->balance;
    memcpy(balance->now.q, q, bytes_of(statics));
    balance->share = 1 - load;
    statics->is_first = 1;
    int done = 0, status = refdyn_balance_read(balance, &balance->now);
    for (int i = 0; i < statics->options->iterations && !done && !status; i++) {
        status = newton_step(statics, &done);
        statics->result->iterations++;
        if (done && !status)
            status = judge_rows(statics, &done);
    }
    if (status || !done)
        return not_converged(statics, status ? status : REFDYN_NO_CONVERGENCE);
    memcpy(q, balance->now.q, bytes_of(statics));
    statics->result->load = load;
    return REFDYN_OK;
}
