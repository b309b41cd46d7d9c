/*
 * Rosenbrock methods on the constrained equations of motion: the step and its interpolant.
 *
 * In: a state and a step h. Out: the state after it, the error estimate of the embedded formula, and states
 * between. Each stage needs one evaluation of the accelerations and one solution with the matrix of
 * linearisation.c for g = gamma h, which is factored once a step.
 *
 * A step of h from (t, y) with J = df/dy and f_t = df/dt there, in the form without products of matrices and
 * vectors (Hairer and Wanner, Solving ODEs II, 2nd ed., IV.7):
 *     (I / (h gamma) - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_sum_i h f_t
 *     y_new = y + sum_j b_j U_j,   error = sum_j e_j U_j
 * with j < i in the sums over a and c. Between the ends of the step, 0 <= theta <= 1,
 *     y(t + theta h) = (1 - theta) y + theta (y_new + (1 - theta) (K_1 + theta (K_2 + theta (K_3 + ...))))
 *     K_k = sum_j interpolant_kj U_j
 * or Hermite's cubic if interpolant_terms is 0. The stages beyond `stages` have the same form with b = e = 0;
 * they are evaluated only when a step is interpolated. A W-method keeps its order with any matrix for J and
 * any vector for f_t, zeros included.
 */
#include "runtime/core/methods/methods.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"
#include "runtime/core/methods/step_of_one.inc"

#include "runtime/core/methods/rosenbrock_step.inc"

static const struct refdyn_rosenbrock_table *table_of(const struct refdyn_step *step) {
    return step->method->table;
}

static int memory_size(const struct refdyn_method_definition *method, const struct refdyn_model *model) {
    return all_stages_of_one(method->table) * 2 * model->n;
}

static void solve(void *context, const double *right_q, const double *right_v, double part, double *dq,
                  double *dqd) {
    const struct taking *taking = context;
    refdyn_linear_solve(taking->step->linear, right_q, right_v, part * taking->h, dq, dqd);
}

static int factor(struct refdyn_step *step, double h) {
    struct refdyn_workspace *work = step->evaluation.work;
    const int status = refdyn_linear_at_begin(step->linear, work, step->t_begin, step->state, step->rates);
    return status ? status : refdyn_linear_factor(step->linear, work, table_of(step)->gamma * h);
}

static int take(struct refdyn_step *step, double h) {
    const struct refdyn_rosenbrock_table *table = table_of(step);
    const struct arrays_of_one arrays = arrays_of(step);
    struct taking taking = {step, h};
    const struct rosenbrock_needs_of_one needs = {find_rates, solve, &taking};
    int status = factor(step, h);
    if (!status)
        status = take_rosenbrock_of_one(table, &arrays, h, &needs);
    if (status)
        return status;
    return refdyn_is_finite(step->state_new, 2 * step->n) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* Evaluates the additional stages of the interpolant, once a step. */
static int look_into(struct refdyn_step *step) {
    const struct arrays_of_one arrays = arrays_of(step);
    struct taking taking = {step, step->t_end - step->t_begin};
    const struct rosenbrock_needs_of_one needs = {find_rates, solve, &taking};
    int status = REFDYN_OK;
    if (step->is_looked_into || table_of(step)->interpolant_stages == 0)
        return REFDYN_OK;
    if (!refdyn_linear_is_at_begin(step->linear)) /* batches have taken the step */
        status = factor(step, taking.h);
    if (!status)
        status = look_into_rosenbrock_of_one(table_of(step), &arrays, taking.h, &needs);
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
    const int size = 2 * step->n, all = all_stages_of_one(table);
    if (table->interpolant_terms == 0)
        return hermite(step, theta, state);
    const int status = look_into(step);
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
