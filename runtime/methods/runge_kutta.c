/*
 * Explicit Runge-Kutta methods: the step, and its interpolant.
 *
 * Takes a state (q, qd, work) and a step h; gives the state after it, the error that the embedded formulas
 * estimate, and states between. Formulas in runge_kutta.h. The work of non-conservative and programme forces
 * is one more component of the state.
 */
#include "base/arithmetic.h"

#include "methods/runge_kutta.h"

#include <math.h>
#include <string.h>

#include "linear/dense.h"
#include "methods/step.h"

static int count_all(const struct refdyn_tableau *tableau) {
    return tableau->stages + tableau->interpolant_stages;
}

static const struct refdyn_tableau *tableau_of(const struct refdyn_step *step) {
    return step->method->table;
}

/* The rates of all stages. */
static int memory_size(const struct refdyn_method_definition *method, const struct refdyn_model *model) {
    return count_all(method->table) * refdyn_rates_size(model);
}

/* y := state + h sum_j weight_j rates_j */
static void combine(const struct refdyn_step *step, double h, const double *weights, int count, double *y) {
    const int size = 2 * step->n + 1;
    memcpy(y, step->state, (size_t)size * sizeof *y);
    refdyn_add_all(y, h, weights, count, step->memory, refdyn_rates_size(step->evaluation.work->model), size);
}

/* error := h sum_j weight_j rates_j, q and qd only */
static void estimate(const struct refdyn_step *step, double h, const double *weights, int stages,
                     double *error) {
    const int n = step->n, size = refdyn_rates_size(step->evaluation.work->model);
    memset(error, 0, (size_t)(2 * n) * sizeof *error);
    for (int j = 0; j < stages; j++)
        if (weights[j] != 0)
            dense_add(error, h * weights[j], step->memory + j * size, 2 * n);
}

/* E^2 / sqrt(E^2 + E_low^2 / 100) of each entry */
static void scale_error(struct refdyn_step *step, const double *low) {
    for (int i = 0; i < 2 * step->n; i++) {
        const double error = step->error[i], both = hypot(error, low[i] / 10);
        step->error[i] = both > 0 ? error * error / both : 0;
    }
}

/* Rates number s, at the state with these weights of the rates before it. */
static int take_stage(struct refdyn_step *step, double h, int s, const double *weights, double c) {
    const double t = refdyn_step_inside(step, step->t_begin + c * h);
    combine(step, h, weights, s, step->stage);
    int status = step->guide ? step->guide->bring(step->guide->context, t, step->stage) : REFDYN_OK;
    if (!status)
        status = refdyn_rates(&step->evaluation, t, step->stage,
                              step->memory + s * refdyn_rates_size(step->evaluation.work->model));
    if (status)
        step->failed_t = t;
    return status;
}

static int take(struct refdyn_step *step, double h) {
    const struct refdyn_tableau *tableau = tableau_of(step);
    const int size = refdyn_rates_size(step->evaluation.work->model), stages = tableau->stages;
    memcpy(step->memory, step->rates, (size_t)size * sizeof(double));
    for (int s = 1; s < stages; s++) {
        const int status = take_stage(step, h, s, tableau->a + s * stages, tableau->c[s]);
        if (status)
            return status;
    }
    combine(step, h, tableau->b, stages, step->state_new);
    if (tableau->e)
        estimate(step, h, tableau->e, stages, step->error);
    if (tableau->e_low && !step->guide) { /* not of stages that are moved: then E alone is safe */
        estimate(step, h, tableau->e_low, stages, step->side);
        scale_error(step, step->side);
    }
    if (step->method->is_last_new)
        memcpy(step->rates_new, step->memory + (stages - 1) * size, (size_t)size * sizeof(double));
    return REFDYN_OK;
}

/* The rates that only the interpolant needs, once a step. */
static int look_into(struct refdyn_step *step, const struct refdyn_tableau *tableau, double h) {
    const int all = count_all(tableau);
    for (int i = 0; i < tableau->interpolant_stages && !step->is_looked_into; i++) {
        const int status = take_stage(step, h, tableau->stages + i, tableau->interpolant_a + i * all,
                                      tableau->interpolant_c[i]);
        if (status)
            return status;
    }
    step->is_looked_into = 1;
    return REFDYN_OK;
}

static int interpolate(struct refdyn_step *step, double theta, double *state) {
    const struct refdyn_tableau *tableau = tableau_of(step);
    const int size = 2 * step->n + 1;
    const double h = step->t_end - step->t_begin;
    const int status = look_into(step, tableau, h);
    memcpy(state, step->state, (size_t)size * sizeof *state);
    for (int s = 0; s < count_all(tableau) && !status; s++) {
        double weight = 0;
        for (int k = tableau->degree - 1; k >= 0; k--)
            weight = theta * (weight + tableau->interpolant[s * tableau->degree + k]);
        dense_add(state, h * weight, step->memory + s * refdyn_rates_size(step->evaluation.work->model),
                  size);
    }
    return status;
}

void refdyn_explicit_accelerations(const struct refdyn_step *step, double theta, double *qdd) {
    const struct refdyn_tableau *tableau = tableau_of(step);
    const int n = step->n, size = refdyn_rates_size(step->evaluation.work->model);
    memset(qdd, 0, (size_t)n * sizeof *qdd);
    for (int s = 0; s < count_all(tableau); s++) {
        double weight = 0;
        for (int k = tableau->degree - 1; k >= 0; k--)
            weight = theta * weight + (k + 1) * tableau->interpolant[s * tableau->degree + k];
        dense_add(qdd, weight, step->memory + s * size + n, n);
    }
}

const struct refdyn_method_kind refdyn_explicit = {
    .controller = REFDYN_PI, .memory_size = memory_size, .take = take, .interpolate = interpolate};
