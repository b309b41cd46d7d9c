/*
 * Rosenbrock methods on the constrained equations of motion: the step and its interpolant.
 *
 * Takes a state and a step h; gives the state after it, the error that the embedded formula estimates, and
 * states between. Each stage is one evaluation of the accelerations and one solution with the matrix of
 * linearisation.h, g = gamma h, which is factored once a step. Formulas in rosenbrock.h.
 */
#include "base/arithmetic.h"

#include "methods/rosenbrock.h"

#include <math.h>
#include <string.h>

#include "linear/dense.h"
#include "methods/step.h"

static int count_all(const struct refdyn_rosenbrock_table *table) {
    return table->stages + table->interpolant_stages;
}

static const struct refdyn_rosenbrock_table *table_of(const struct refdyn_step *step) {
    return step->method->table;
}

/* The increments U_i (2 n) of all stages. */
static int memory_size(const struct refdyn_method_definition *method, const struct refdyn_model *model) {
    return count_all(method->table) * 2 * model->n;
}

/* y := state + sum_j weight_j U_j, q and qd */
static void combine(const struct refdyn_step *step, const double *weights, int count, double *y) {
    const int size = 2 * step->n;
    memcpy(y, step->state, (size_t)size * sizeof *y);
    refdyn_add_all(y, 1, weights, count, step->memory, size, size);
}

/* Rates of stage i, whose point is step->stage. */
static int stage_rates(struct refdyn_step *step, const struct refdyn_rosenbrock_table *table, int i,
                       double h) {
    const double t = refdyn_step_inside(step, step->t_begin + table->alpha[i] * h);
    const int status = refdyn_rates(&step->evaluation, t, step->stage, step->side);
    if (status)
        step->failed_t = t;
    return status;
}

static int take_stage(struct refdyn_step *step, const struct refdyn_rosenbrock_table *table, int i,
                      double h) {
    const int n = step->n, size = 2 * n;
    double *right = step->side, *U = step->memory + i * size;
    if (i == 0) {
        memcpy(right, step->rates, (size_t)size * sizeof *right);
    } else {
        combine(step, table->a + i * count_all(table), i, step->stage);
        const int status = stage_rates(step, table, i, h);
        if (status)
            return status;
    }
    refdyn_add_all(right, 1 / h, table->c + i * count_all(table), i, step->memory, size, size);
    refdyn_linear_solve(step->linear, right, right + n, table->gamma_sum[i] * h, U, U + n);
    return REFDYN_OK;
}

static int take(struct refdyn_step *step, double h) {
    const struct refdyn_rosenbrock_table *table = table_of(step);
    const int size = 2 * step->n;
    struct refdyn_workspace *work = step->evaluation.work;
    int status = refdyn_linear_at_begin(step->linear, work, step->t_begin, step->state, step->rates);
    if (!status)
        status = refdyn_linear_factor(step->linear, work, table->gamma * h);
    for (int i = 0; i < table->stages && !status; i++)
        status = take_stage(step, table, i, h);
    if (status)
        return status;
    combine(step, table->b, table->stages, step->state_new);
    memset(step->error, 0, (size_t)size * sizeof(double));
    refdyn_add_all(step->error, 1, table->e, table->stages, step->memory, size, size);
    return refdyn_is_finite(step->state_new, size) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* The stages that only the interpolant needs, once a step. */
static int look_into(struct refdyn_step *step, const struct refdyn_rosenbrock_table *table) {
    const double h = step->t_end - step->t_begin;
    int status = REFDYN_OK;
    for (int i = table->stages; i < count_all(table) && !status && !step->is_looked_into; i++)
        status = take_stage(step, table, i, h);
    step->is_looked_into = !status;
    return status;
}

static int hermite(struct refdyn_step *step, double theta, double *state) {
    const double *rates_end = step->rates_new;
    if (step->t_end >= step->t_limit) { /* at a time event, on its left side */
        const int status = refdyn_rates(&step->evaluation, step->t_limit, step->state_new, step->side);
        if (status)
            return status;
        rates_end = step->side;
    }
    refdyn_step_hermite(step, rates_end, theta, state);
    return REFDYN_OK;
}

/* (1 - theta) y + theta (y_new + (1 - theta) (K_1 + theta (K_2 + ...))) */
static int interpolate(struct refdyn_step *step, double theta, double *state) {
    const struct refdyn_rosenbrock_table *table = table_of(step);
    const int size = 2 * step->n, all = count_all(table);
    if (table->interpolant_terms == 0)
        return hermite(step, theta, state);
    const int status = look_into(step, table);
    for (int i = 0; i < size; i++)
        state[i] = (1 - theta) * step->state[i] + theta * step->state_new[i];
    double power = theta * (1 - theta);
    for (int k = 0; k < table->interpolant_terms; k++, power *= theta)
        for (int j = 0; j < all; j++)
            dense_add(state, power * table->interpolant[k * all + j], step->memory + j * size, size);
    return status;
}

const struct refdyn_method_kind refdyn_rosenbrock = {
    .controller = REFDYN_PREDICTIVE,
    .is_implicit = 1,
    .begins_by_tangent = 1,
    .leaves_out_work = 1,
    .memory_size = memory_size,
    .take = take,
    .interpolate = interpolate,
};
