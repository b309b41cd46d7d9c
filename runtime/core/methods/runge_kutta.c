/*
 * Explicit Runge-Kutta methods: the step, and its interpolant.
 *
 * In: a state (q, qd, work) and a step h. Out: the state after it, the error estimate of the embedded
 * formulas, and states between. The work of non-conservative and programme forces is a component of the
 * state.
 *
 * Butcher tableau: Y_s = y + h sum_j a_sj f(t + c_j h, Y_j), y_new = y + h sum_s b_s f_s.
 * Between the ends of the step, 0 <= theta <= 1 (Hairer, Norsett and Wanner, Solving ODEs I, 2nd ed., II.6),
 *     y(t + theta h) = y + h sum_s w_s(theta) f_s,   w_s(theta) = sum_k interpolant_sk theta^(k + 1)
 * over `all` = stages + interpolant_stages rates; those beyond `stages` are evaluated only when a step is
 * interpolated.
 *
 * With two embedded formulas, E = h |sum e_s f_s| and E_low = h |sum e_low_s f_s| are combined to the error
 * E^2 / sqrt(E^2 + E_low^2 / 100). For rk8 this decreases with h^8, E with h^6 and E_low with h^4 (II.10).
 */
#include "runtime/core/methods/methods.h"

#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"
#include "runtime/core/methods/step_of_one.inc"

#include "runtime/core/methods/runge_kutta_step.inc"

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

static int take(struct refdyn_step *step, double h) {
    const struct refdyn_tableau *tableau = tableau_of(step);
    const struct arrays_of_one arrays = arrays_of(step);
    struct taking taking = {step, h};
    /* with projected stages only the first of the two error estimates is reliable */
    const int has_low = !step->guide;
    const int status = take_explicit_of_one(tableau, &arrays, h, has_low, find_rates, &taking);
    if (!status && step->method->is_last_new)
        memcpy(step->rates_new, step->memory + (tableau->stages - 1) * arrays.rates_size,
               (size_t)arrays.rates_size * sizeof(double));
    return status;
}

/* Evaluates the additional stages of the interpolant, once a step. */
static int look_into(struct refdyn_step *step, const struct refdyn_tableau *tableau, double h) {
    const struct arrays_of_one arrays = arrays_of(step);
    struct taking taking = {step, h};
    for (int i = 0; i < tableau->interpolant_stages && !step->is_looked_into; i++) {
        const int s = tableau->stages + i;
        combine_rates_of_one(&arrays, h, tableau->interpolant_a + i * count_all(tableau), s, step->stage);
        const int status =
            find_rates(&taking, tableau->interpolant_c[i], step->stage, step->memory + s * arrays.rates_size);
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
