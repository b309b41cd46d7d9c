/*
 * Equilibria: Q(q, qd = 0, t = 0) = 0 over the coordinates that are not held (theory, sect. 8.7).
 *
 * Takes a start q0; gives q with Q = 0 and the forces that hold the others. The load is followed along
 *     F(q, s) = Q(q) - (1 - s) Q(q0) = 0,   s from 0 to 1,
 * each by Newton with the exact tangent dQ/dq; a load step is halved when its first correction is longer than
 * `reach` or a later one not half as long as the one before, since Newton might then end far away. A load
 * that cannot be followed to its end has a limit point before it; then any equilibrium is looked for by
 * Newton for the whole load, damped by the restricted natural monotonicity test: a step a dq is taken when
 * the correction that follows it, with the same tangent, is at most (1 - a/4) times as long (Deuflhard,
 * Newton Methods for Nonlinear Problems, 2004, sect. 3.3, 5.1). Lengths are in 1 rad and `length`.
 */
#include "base/arithmetic.h"

#include "base/model_check.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linear/dense.h"
#include "linear/elimination.h"
#include "base/layout.h"

/* [rad, length] Newton's last correction; the error that is left is about its square */
static const double tol_default = 1e-12;
static const double length_default = 1; /* [m] */
/* [rad, length] over this much sine and cosine are still nearly straight */
static const double reach_default = 0.5;
/* the stiffness may change over a small part of a large load */
static const double load_least_default = 1e-12;
/* of corrections while the load is followed: what is surely in Newton's reach */
static const double contraction = 0.5;
static const double damping_least = 1.0 / 1024;
enum { ITERATIONS_DEFAULT = 50 };

struct statics {
    struct refdyn_workspace *work;
    const struct refdyn_statics_options *options;
    struct refdyn_statics_result *result;
    int n, count;
    int is_first;      /* the next Newton step is the first of its load */
    int is_following;  /* load by load without damping; else one jump with it */
    double share;      /* 1 - s: share of the load Q(q0) that is held back */
    double *q;         /* (n) */
    double *q_trial;   /* (n) */
    double *q_start;   /* (n) q0 */
    double *qd;        /* (n) zeros */
    double *Q;         /* (n) generalized forces */
    double *Q_start;   /* (n) at q0 */
    double *tangent;   /* (n x n) dQ_i/dq_j, then its factors in the first count x count */
    double *scale;     /* (n) 1 over the largest entry of each row */
    double *step;      /* (n) Newton correction of the coordinates not held */
    double *step_next; /* (n) the one that follows it */
    double *unit;      /* (n) what 1 rad weighs against */
    int *free;         /* (count) coordinates not held */
    int *order;        /* (count) row exchanges */
};

static size_t lay_out(struct statics *statics, int n, char *base) {
    struct layout layout = {base, 0};
    statics->q = layout_doubles(&layout, n);
    statics->q_trial = layout_doubles(&layout, n);
    statics->q_start = layout_doubles(&layout, n);
    statics->qd = layout_doubles(&layout, n);
    statics->Q = layout_doubles(&layout, n);
    statics->Q_start = layout_doubles(&layout, n);
    statics->tangent = layout_doubles(&layout, n * n);
    statics->scale = layout_doubles(&layout, n);
    statics->step = layout_doubles(&layout, n);
    statics->step_next = layout_doubles(&layout, n);
    statics->unit = layout_doubles(&layout, n);
    statics->free = layout_ints(&layout, n);
    statics->order = layout_ints(&layout, n);
    return layout.used;
}

size_t refdyn_statics_size(const struct refdyn_model *model) {
    struct statics statics;
    return refdyn_model_status(model) ? 0 : lay_out(&statics, model->n, NULL);
}

struct refdyn_statics_options refdyn_statics_default(void) {
    return (struct refdyn_statics_options){
        .tol = tol_default,
        .length = length_default,
        .reach = reach_default,
        .iterations = ITERATIONS_DEFAULT,
        .load_step = 1,
        .load_least = load_least_default,
    };
}

static const char *wrong_option(const struct refdyn_statics_options *options) {
    if (!(isfinite(options->tol) && options->tol > 0))
        return "tol must be positive";
    if (!(isfinite(options->length) && options->length > 0))
        return "length must be positive";
    if (!(options->reach > 0))
        return "reach must be positive";
    if (options->iterations < 1)
        return "iterations must be positive";
    if (!(options->load_step > 0 && options->load_step <= 1))
        return "load_step must lie above 0 and at most at 1";
    if (!(options->load_least > 0 && options->load_least <= options->load_step))
        return "load_least must lie above 0 and at most at load_step";
    return NULL;
}

int refdyn_statics_validate(const struct refdyn_statics_options *options, const char **fact) {
    const char *wrong = wrong_option(options);
    if (fact)
        *fact = wrong;
    return wrong ? REFDYN_BAD_OPTION : REFDYN_OK;
}

/* Is each of these a coordinate? */
static int are_coordinates(const int *held, int held_count, int n) {
    for (int i = 0; i < held_count; i++)
        if (held[i] < 0 || held[i] >= n)
            return 0;
    return 1;
}

static int fail_at(struct refdyn_workspace *work, int status, int coordinate) {
    work->fault = (struct refdyn_fault){.row = -1, .coordinate = coordinate};
    return status;
}

static int evaluate_forces(struct statics *statics, const double *q) {
    struct refdyn_workspace *work = statics->work;
    work->model->Q(work->p, work->x, 0, q, statics->qd, statics->Q);
    for (int j = 0; j < statics->n; j++)
        if (!isfinite(statics->Q[j]))
            return fail_at(work, REFDYN_NOT_FINITE, j);
    return REFDYN_OK;
}

/* F of the coordinates not held */
static double out_of_balance(const struct statics *statics, int i) {
    const int j = statics->free[i];
    return statics->Q[j] - statics->share * statics->Q_start[j];
}

/* The tangent of the coordinates not held, moved to the front; error: NOT_FINITE. */
static int evaluate_tangent(struct statics *statics) {
    struct refdyn_workspace *work = statics->work;
    const int n = statics->n, count = statics->count;
    work->model->Q_q(work->p, work->x, 0, statics->q, statics->qd, statics->tangent);
    for (int i = 0; i < count; i++) {
        const double *row = statics->tangent + statics->free[i] * n;
        if (!refdyn_is_finite(row, n))
            return fail_at(work, REFDYN_NOT_FINITE, statics->free[i]);
        for (int j = 0; j < count; j++)
            statics->tangent[i * count + j] = row[statics->free[j]];
    }
    return REFDYN_OK;
}

/* A coordinate whose row and column are 0 and that carries no load stays: its equation becomes dq = 0. */
static void leave_free_ones(struct statics *statics) {
    const int count = statics->count;
    for (int i = 0; i < count; i++) {
        double largest = fabs(out_of_balance(statics, i));
        for (int j = 0; j < count; j++)
            largest = fmax(
                largest, fmax(fabs(statics->tangent[i * count + j]), fabs(statics->tangent[j * count + i])));
        if (largest == 0)
            statics->tangent[i * count + i] = 1;
    }
}

/*
 * L U of the tangent; not symmetric in general (follower forces). A column without a pivot above the rounding
 * of its row's largest entry is a coordinate that nothing holds.
 */
static int factor_tangent(struct statics *statics) {
    const int count = statics->count;
    const double *A = statics->tangent;
    int failed = refdyn_lu_factor(0, statics->tangent, count, statics->order, statics->scale);
    for (int k = failed < 0 ? count - 1 : failed - 1; k >= 0; k--)
        if (!(statics->scale[k] > count * DBL_EPSILON * fabs(A[k * count + k]))) /* the inverse pivot */
            failed = k;
    return failed < 0 ? REFDYN_OK : fail_at(statics->work, REFDYN_TANGENT_SINGULAR, statics->free[failed]);
}

/* step := -tangent^-1 F */
static void find_step(const struct statics *statics, double *step) {
    for (int i = 0; i < statics->count; i++)
        step[i] = -out_of_balance(statics, i);
    refdyn_lu_solve(0, statics->tangent, statics->count, statics->order, step);
}

/* Largest entry of a step, in units of 1 rad and `length`. */
static double length_of(const struct statics *statics, const double *step) {
    double largest = 0;
    for (int i = 0; i < statics->count; i++) {
        const double size = fabs(step[i]) / statics->unit[statics->free[i]];
        if (!(size <= largest))
            largest = size;
    }
    return largest;
}

static void move(const struct statics *statics, double damping, const double *step, double *q) {
    for (int i = 0; i < statics->count; i++)
        q[statics->free[i]] += damping * step[i];
}

/* How much longer the next correction may be after a step with this damping. */
static double allowed_growth(const struct statics *statics, double damping) {
    return statics->is_following ? contraction : 1 - damping / 4;
}

/* Halves the step until the correction after it is shorter; that is left in step_next, q_trial is where it
 * ends. */
static int take_damped(struct statics *statics, double length, double *length_next) {
    const double least = statics->is_following ? 1 : damping_least;
    int status = REFDYN_NO_CONVERGENCE;
    for (double damping = 1; damping >= least; damping /= 2) {
        memcpy(statics->q_trial, statics->q, (size_t)statics->n * sizeof(double));
        move(statics, damping, statics->step, statics->q_trial);
        status = evaluate_forces(statics, statics->q_trial);
        if (status)
            continue;
        find_step(statics, statics->step_next);
        *length_next = length_of(statics, statics->step_next);
        if (*length_next <= allowed_growth(statics, damping) * length)
            return REFDYN_OK;
        status = REFDYN_NO_CONVERGENCE;
    }
    return status;
}

static int not_converged(struct statics *statics, int status) {
    int at;
    for (int i = 0; i < statics->count; i++)
        statics->step_next[i] = out_of_balance(statics, i);
    refdyn_largest(statics->step_next, statics->count, &at);
    return status == REFDYN_NO_CONVERGENCE ? fail_at(statics->work, status, statics->free[at]) : status;
}

/* One Newton step from statics->q; *done when the correction is within tol, or at rounding level and no
 * longer falling. */
static int newton_step(struct statics *statics, int *done) {
    int status = evaluate_tangent(statics);
    if (status)
        return status;
    leave_free_ones(statics);
    status = factor_tangent(statics);
    if (status)
        return status;
    find_step(statics, statics->step);
    const double length = length_of(statics, statics->step);
    double length_next;
    if (statics->is_first && statics->is_following && length > statics->options->reach)
        return REFDYN_NO_CONVERGENCE;
    statics->is_first = 0;
    if (length <= statics->options->tol) {
        move(statics, 1, statics->step, statics->q);
        *done = 1;
        return evaluate_forces(statics, statics->q);
    }
    status = take_damped(statics, length, &length_next);
    if (status == REFDYN_NO_CONVERGENCE && length <= sqrt(DBL_EPSILON)) {
        *done = 1;
        return evaluate_forces(statics, statics->q);
    }
    if (!status)
        memcpy(statics->q, statics->q_trial, (size_t)statics->n * sizeof(double));
    return status;
}

/* Newton under a share of the load, from q on, which becomes the equilibrium when there is one. */
static int solve_load(struct statics *statics, double load, double *q) {
    const size_t bytes = (size_t)statics->n * sizeof(double);
    memcpy(statics->q, q, bytes);
    statics->share = 1 - load;
    statics->is_first = 1;
    int done = 0, status = evaluate_forces(statics, statics->q);
    for (int i = 0; i < statics->options->iterations && !done && !status; i++) {
        status = newton_step(statics, &done);
        statics->result->iterations++;
    }
    if (status || !done)
        return not_converged(statics, status ? status : REFDYN_NO_CONVERGENCE);
    memcpy(q, statics->q, bytes);
    statics->result->load = load;
    return REFDYN_OK;
}

/* Raises the load from 0 to 1; q keeps the last equilibrium. */
static int raise_load(struct statics *statics, double *q) {
    double load = 0, step = statics->options->load_step;
    while (load < 1) {
        const double load_next = load + step < 1 ? load + step : 1;
        const int status = solve_load(statics, load_next, q);
        if (status) {
            step /= 2;
            if (step < statics->options->load_least)
                return status;
            continue;
        }
        load = load_next;
        statics->result->loads++;
        step *= 2;
    }
    return REFDYN_OK;
}

/* Follows the load; where that ends early, looks for any equilibrium from the start. */
static int find_equilibrium(struct statics *statics, double *q) {
    const size_t bytes = (size_t)statics->n * sizeof(double);
    memcpy(statics->q_start, q, bytes);
    statics->is_following = 1;
    const int status = raise_load(statics, q);
    if (status != REFDYN_NO_CONVERGENCE)
        return status;
    const struct refdyn_fault fault = statics->work->fault;
    statics->is_following = 0; /* the whole load at once, wherever that leads */
    if (!solve_load(statics, 1, statics->q_start)) {
        memcpy(q, statics->q_start, bytes);
        statics->result->is_followed = 0;
        return REFDYN_OK;
    }
    statics->work->fault = fault;
    return status;
}

static void list_free(struct statics *statics, const int *held, int held_count) {
    for (int j = 0; j < statics->n; j++) {
        int is_held = 0;
        for (int i = 0; i < held_count; i++)
            is_held |= held[i] == j;
        if (!is_held)
            statics->free[statics->count++] = j;
        statics->unit[j] = refdyn_coordinate_unit(statics->work->model, j, statics->options->length);
        statics->qd[j] = 0;
    }
}

/* Residual and holding forces at the end of the way, also when it was cut short. */
static void report(struct statics *statics, const double *q, double *hold_force) {
    if (evaluate_forces(statics, q))
        return;
    double largest = 0;
    for (int j = 0; hold_force && j < statics->n; j++)
        hold_force[j] = 0 - statics->Q[j]; /* no -0 */
    for (int i = 0; i < statics->count; i++) {
        const int j = statics->free[i];
        largest = fmax(largest, fabs(statics->Q[j]));
        if (hold_force)
            hold_force[j] = 0;
    }
    statics->result->residual = largest;
}

int refdyn_statics(struct refdyn_workspace *work, const struct refdyn_statics_options *options,
                   const int *held, int held_count, double *q, double *hold_force,
                   struct refdyn_statics_result *result, void *memory, size_t size) {
    struct statics statics = {.work = work, .options = options, .result = result, .n = work->n};
    *result = (struct refdyn_statics_result){.is_followed = 1};
    int status = refdyn_workspace_status(work);
    if (status)
        return status;
    if (wrong_option(options) || !are_coordinates(held, held_count, work->n))
        return REFDYN_BAD_OPTION;
    if (!work->model->Q || !work->model->Q_q)
        return REFDYN_FUNCTION_MISSING;
    if (!layout_fits(memory, size, refdyn_statics_size(work->model)))
        return REFDYN_BAD_MEMORY;
    lay_out(&statics, work->n, memory);
    list_free(&statics, held, held_count);
    status = evaluate_forces(&statics, q);
    if (status)
        return status;
    memcpy(statics.Q_start, statics.Q, (size_t)work->n * sizeof(double));
    status = find_equilibrium(&statics, q);
    const struct refdyn_fault fault = work->fault;
    report(&statics, q, hold_force);
    work->fault = fault;
    return status;
}
