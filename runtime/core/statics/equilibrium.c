/*
 * Equilibria: Q(q, qd = 0) + u^T lambda = 0 and phi(q) = 0 over the coordinates that are not held and the
 * rows that hold (theory, sect. 8.7).
 *
 * In: a start q0, which is moved onto the rows first. Out: q, lambda, the forces that hold the other
 * coordinates, and the stability of the equilibrium. The load increases along F(q, s) = Q(q) - (1 - s) Q(q0),
 * F + u^T lambda = 0,   s from 0 to 1, with Newton's iteration and the exact tangent at each s. A load step
 * is halved when the iteration might converge to a distant equilibrium. If the load cannot be increased to 1,
 * the path has a limit point. The options then choose between the path past it (limit_points.c) and damped
 * Newton for the whole load, which finds some equilibrium (Deuflhard, Newton Methods for Nonlinear Problems,
 * 2004, sect. 3.3, 5.1). downhill.c finds a stable one. Lengths are in units of 1 rad and `length`.
 */
#include "runtime/core/base/core.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"
#include "runtime/core/statics/statics.h"

/* [rad, length] Newton's last correction; the remaining error is about its square */
static const double tol_default = 1e-12;
/* [rad, length] over this much sine and cosine are still nearly straight */
static const double reach_default = 0.5;
/* a large load may change the stiffness within a small fraction of it */
static const double load_least_default = 1e-12;
enum { ITERATIONS_DEFAULT = 50 };

static size_t lay_out(struct statics *statics, const struct refdyn_model *model, char *base) {
    struct layout layout = {base, 0};
    refdyn_balance_lay_out(&statics->balance, model, &layout);
    statics->step = layout_doubles(&layout, model->n);
    statics->step_next = layout_doubles(&layout, model->n);
    statics->q_begin = layout_doubles(&layout, model->n);
    statics->q_start = layout_doubles(&layout, model->n);
    statics->force = layout_doubles(&layout, model->n);
    refdyn_limit_points_lay_out(statics, model, &layout);
    statics->carrying = refdyn_carrying_lay_out(model, &layout);
    return layout.used;
}

size_t refdyn_statics_size(const struct refdyn_model *model) {
    struct statics statics;
    return refdyn_model_status(model) ? 0 : lay_out(&statics, model, NULL);
}

struct refdyn_statics_options refdyn_statics_default(void) {
    return (struct refdyn_statics_options){
        .tol = tol_default,
        .reach = reach_default,
        .iterations = ITERATIONS_DEFAULT,
        .load_step = 1,
        .load_least = load_least_default,
    };
}

static const char *wrong_option(const struct refdyn_statics_options *options) {
    if (!options)
        return "options must not be NULL";
    if (!(isfinite(options->tol) && options->tol > 0))
        return "tol must be positive";
    if (!(isfinite(options->length) && options->length >= 0))
        return "length must be positive, or 0 for that of the model";
    if (!(options->reach > 0))
        return "reach must be positive";
    if (options->iterations < 1)
        return "iterations must be positive";
    if (!(options->load_step > 0 && options->load_step <= 1))
        return "load_step must lie above 0 and at most at 1";
    if (!(options->load_least > 0 && options->load_least <= options->load_step))
        return "load_least must lie above 0 and at most at load_step";
    if (!isfinite(options->t))
        return "t must be finite";
    if ((unsigned)options->way > REFDYN_DOWNHILL)
        return "way must be one of those of refdyn_statics_way";
    if (options->row_count < 0 || (options->row_count > 0 && !options->rows))
        return "row_count must be that of rows";
    return NULL;
}

int refdyn_statics_validate(const struct refdyn_statics_options *options, const char **fact) {
    const char *wrong = wrong_option(options);
    if (fact)
        *fact = wrong;
    return wrong ? REFDYN_BAD_OPTION : REFDYN_OK;
}

/* Returns whether each of these is a coordinate. */
static int are_coordinates(const int *held, int held_count, int n) {
    if (held_count < 0 || (held_count > 0 && !held))
        return 0;
    for (int i = 0; i < held_count; i++)
        if (held[i] < 0 || held[i] >= n)
            return 0;
    return 1;
}

/* Returns whether these are position rows without repetition. */
static int are_position_rows(const struct refdyn_model *model, const int *rows, int row_count) {
    for (int i = 0; i < row_count; i++) {
        if (rows[i] < 0 || rows[i] >= model->m || model->rows[rows[i]].level != REFDYN_POSITION)
            return 0;
        for (int k = 0; k < i; k++)
            if (rows[k] == rows[i])
                return 0;
    }
    return 1;
}

/* Increases the load from 0 to 1; q keeps the last equilibrium. */
static int raise_load(struct statics *statics, double *q) {
    enum { TRIED_MOST = 20000 /* steps of the load; a start that needs more is too far away */ };
    double load = 0, step = statics->options->load_step;
    for (int tried = 0; load < 1; tried++) {
        if (tried == TRIED_MOST)
            return REFDYN_NO_CONVERGENCE;
        const double load_next = load + step < 1 ? load + step : 1;
        const int status = refdyn_newton_solve(statics, load_next, q);
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

/* Applies the whole load at once from the start; any equilibrium is accepted. */
static int jump(struct statics *statics, double *q) {
    statics->is_following = 0;
    const int status = refdyn_newton_solve(statics, 1, statics->q_start);
    if (!status) {
        memcpy(q, statics->q_start, (size_t)statics->balance.n * sizeof *q);
        statics->result->is_followed = 0;
    }
    return status;
}

/* Starts again and follows the path past limit points. */
static int pass(struct statics *statics, double *q) {
    memcpy(q, statics->q_start, (size_t)statics->balance.n * sizeof *q);
    return refdyn_limit_points_pass(statics, q);
}

static int follow_load(struct statics *statics, double *q) {
    const int is_along_path = statics->options->way == REFDYN_ALONG_PATH;
    memcpy(statics->q_start, q, (size_t)statics->balance.n * sizeof *q);
    statics->is_following = 1;
    const int status = raise_load(statics, q);
    const struct refdyn_fault fault = statics->balance.work->fault;
    if (is_along_path && (status == REFDYN_NO_CONVERGENCE || status == REFDYN_TANGENT_SINGULAR))
        return pass(statics, q);
    if (status != REFDYN_NO_CONVERGENCE)
        return status;
    if (!jump(statics, q))
        return REFDYN_OK;
    statics->balance.work->fault = fault;
    return status;
}

static int find_equilibrium(struct statics *statics, double *q) {
    return statics->options->way == REFDYN_DOWNHILL ? refdyn_downhill_go(statics, q)
                                                    : follow_load(statics, q);
}

static void list_free(struct balance *balance, const int *held, int held_count, double length) {
    for (int j = 0; j < balance->n; j++) {
        int is_held = 0;
        for (int i = 0; i < held_count; i++)
            is_held |= held[i] == j;
        if (!is_held)
            balance->free[balance->count++] = j;
        balance->unit[j] = refdyn_coordinate_unit(balance->work->model, j, length);
    }
}

/* Returns Q + u^T lambda of coordinate j. */
static double force_on(const struct balance *balance, int j) {
    const struct refdyn_workspace *work = balance->work;
    double sum = balance->now.Q[j];
    for (int a = 0; a < balance->row_count; a++)
        sum += work->u[balance->rows[a] * balance->n + j] * balance->now.lambda[a];
    return sum;
}

/* Writes residuals and holding forces under the whole load at the end, also after a failure. */
static void report(struct statics *statics, const double *q, double *hold_force) {
    struct balance *balance = &statics->balance;
    struct refdyn_statics_result *result = statics->result;
    memcpy(balance->now.q, q, (size_t)balance->n * sizeof *q);
    balance->share = 0;
    if (refdyn_balance_read(balance, &balance->now) || refdyn_balance_eliminate(balance, &balance->now))
        return;
    for (int j = 0; j < balance->n; j++)
        statics->force[j] = force_on(balance, j);
    for (int j = 0; hold_force && j < balance->n; j++)
        hold_force[j] = 0 - statics->force[j]; /* no -0 */
    for (int i = 0; i < balance->count; i++) {
        const int j = balance->free[i];
        result->residual = fmax(result->residual, fabs(statics->force[j]));
        if (hold_force)
            hold_force[j] = 0;
    }
    for (int a = 0; a < balance->row_count; a++)
        result->phi = fmax(result->phi, fabs(balance->now.phi[a]));
    result->force = statics->force;
    result->lambda = balance->now.lambda;
}

/* Moves the start onto the rows and reads the load there. */
static int start(struct statics *statics, double *q) {
    struct balance *balance = &statics->balance;
    int status = refdyn_newton_meet_rows(statics, q);
    if (status)
        return status;
    memcpy(balance->now.q, q, (size_t)balance->n * sizeof *q);
    status = refdyn_balance_read(balance, &balance->now);
    memcpy(balance->Q_start, balance->now.Q, (size_t)balance->n * sizeof *q);
    return status;
}

static int solve(struct statics *statics, double *q, double *hold_force) {
    struct refdyn_workspace *work = statics->balance.work;
    int status = start(statics, q);
    if (status)
        return status;
    status = find_equilibrium(statics, q);
    const struct refdyn_fault fault = work->fault;
    report(statics, q, hold_force);
    if (!status)
        refdyn_stability_judge(&statics->balance, statics->result);
    work->fault = fault;
    return status;
}

/* Finds an equilibrium with contacts: tries sets of contacts that carry, one after the other. */
static int solve_on_contacts(struct statics *statics, double *q, double *hold_force) {
    const size_t bytes = (size_t)statics->balance.n * sizeof *q;
    double *begin = statics->q_begin;
    int status;
    memcpy(begin, q, bytes);
    do {
        statics->balance.rank = statics->balance.rank_most = 0;
        memset(statics->balance.size, 0, (size_t)statics->balance.work->model->m * sizeof(double));
        *statics->result = (struct refdyn_statics_result){.is_followed = 1, .unstable_coordinate = -1};
        status = solve(statics, q, hold_force);
    } while (refdyn_carrying_next(statics, begin, q, &status));
    refdyn_carrying_report(statics, q, status);
    return status;
}

void refdyn_enter_statics(const struct refdyn_model *model, double *q, const double *qd) {
    if (!refdyn_model_is_readable(model) || !q || !qd)
        return;
    for (int j = refdyn_joint_count(model); j < model->n; j++)
        q[j] = qd[j];
}

void refdyn_leave_statics(const struct refdyn_model *model, double *q, double *qd) {
    if (!refdyn_model_is_readable(model) || !q || !qd)
        return;
    memset(qd, 0, (size_t)model->n * sizeof *qd);
    for (int j = refdyn_joint_count(model); j < model->n; j++) {
        qd[j] = q[j];
        q[j] = 0;
    }
}

static int has_functions(const struct refdyn_model *model, int row_count) {
    return model->Q && (row_count > 0 ? refdyn_has_tangent(model) : model->Q_q != NULL);
}

int refdyn_statics(struct refdyn_workspace *work, const struct refdyn_statics_options *options,
                   const int *held, int held_count, double *q, double *hold_force,
                   struct refdyn_statics_result *result, void *memory, size_t size) {
    struct statics statics = {.options = options, .result = result};
    if (!result || !q)
        return refdyn_missing_status(work);
    *result = (struct refdyn_statics_result){.is_followed = 1, .unstable_coordinate = -1};
    int status = refdyn_workspace_status(work);
    if (status)
        return status;
    if (wrong_option(options) || !are_coordinates(held, held_count, work->n) ||
        !are_position_rows(work->model, options->rows, options->row_count))
        return REFDYN_BAD_OPTION;
    if (!has_functions(work->model, options->row_count))
        return REFDYN_FUNCTION_MISSING;
    status = layout_status(memory, size, refdyn_statics_size(work->model));
    if (!status)
        status = refdyn_check_parameters(work);
    if (status)
        return status;
    memset(memory, 0, refdyn_statics_size(work->model));
    lay_out(&statics, work->model, memory);
    struct balance *balance = &statics.balance;
    balance->work = work;
    balance->t = options->t;
    balance->rows = options->rows;
    balance->row_count = options->row_count;
    balance->ask = options->ask;
    balance->context = options->context;
    list_free(balance, held, held_count, options->length);
    return refdyn_carrying_begin(&statics) ? solve_on_contacts(&statics, q, hold_force)
                                           : solve(&statics, q, hold_force);
}
