/*
 * Explicit Runge-Kutta methods: the step, and its interpolant.
 *
 * Takes a state (q, qd, work) and a step h; gives the state after it, the error that the embedded formulas
 * estimate, and states between. Formulas in runge_kutta.h. The work of non-conservative and programme forces
 * is one more component of the state.
 */
#include "base/arithmetic.h"

#include "private/runge_kutta.h"

#include <math.h>
#include <string.h>

#include "linear/dense.h"
#include "private/pass.h"
#include "private/slope.h"
#include "private/step.h"

static int count_all(const struct refdyn_tableau *tableau) {
    return tableau->stages + tableau->interpolant_stages;
}

int refdyn_runge_kutta_room(const struct refdyn_tableau *tableau, const struct refdyn_model *model) {
    return count_all(tableau) * refdyn_slope_size(model);
}

/* y := state + h sum_j weight_j slope_j */
static void combine(const struct refdyn_drive *drive, double h, const double *weights, int count, double *y) {
    const int size = 2 * drive->work->n + 1;
    memcpy(y, drive->state, (size_t)size * sizeof *y);
    refdyn_add_all(y, h, weights, count, drive->stages, refdyn_slope_size(drive->work->model), size);
}

/* error := h sum_j weight_j slope_j, q and qd only */
static void estimate(const struct refdyn_drive *drive, double h, const double *weights, int stages,
                     double *error) {
    const int n = drive->work->n, size = refdyn_slope_size(drive->work->model);
    memset(error, 0, (size_t)(2 * n) * sizeof *error);
    for (int j = 0; j < stages; j++)
        if (weights[j] != 0)
            dense_add(error, h * weights[j], drive->stages + j * size, 2 * n);
}

/* E^2 / sqrt(E^2 + E_low^2 / 100) of each entry */
static void scale_error(struct refdyn_drive *drive, const double *low) {
    for (int i = 0; i < 2 * drive->work->n; i++) {
        const double error = drive->error[i], both = hypot(error, low[i] / 10);
        drive->error[i] = both > 0 ? error * error / both : 0;
    }
}

/* Slope number s, at the state with these weights of the slopes before it. */
static int take_stage(struct refdyn_drive *drive, double h, int s, const double *weights, double c) {
    const double t = fmin(drive->t_begin + c * h, drive->t_limit);
    combine(drive, h, weights, s, drive->stage);
    int status = drive->is_passing ? refdyn_pass_meet(drive, t, drive->stage) : REFDYN_OK;
    if (!status)
        status =
            refdyn_slope(drive, t, drive->stage, drive->stages + s * refdyn_slope_size(drive->work->model));
    if (status)
        drive->failed_t = t;
    return status;
}

int refdyn_runge_kutta_step(struct refdyn_drive *drive, double h) {
    const struct refdyn_tableau *tableau = refdyn_method_facts(drive->method).tableau;
    const int size = refdyn_slope_size(drive->work->model), stages = tableau->stages;
    memcpy(drive->stages, drive->slope, (size_t)size * sizeof(double));
    drive->is_looked_into = 0;
    for (int s = 1; s < stages; s++) {
        const int status = take_stage(drive, h, s, tableau->a + s * stages, tableau->c[s]);
        if (status)
            return status;
    }
    combine(drive, h, tableau->b, stages, drive->state_new);
    if (tableau->e)
        estimate(drive, h, tableau->e, stages, drive->error);
    if (tableau->e_low && !drive->is_passing) { /* not of stages that are moved: then E alone is safe */
        estimate(drive, h, tableau->e_low, stages, drive->side);
        scale_error(drive, drive->side);
    }
    if (tableau->is_last_new)
        memcpy(drive->slope_new, drive->stages + (stages - 1) * size, (size_t)size * sizeof(double));
    return REFDYN_OK;
}

/* The slopes that only the interpolant needs, once a step. */
static int look_into(struct refdyn_drive *drive, const struct refdyn_tableau *tableau, double h) {
    const int all = count_all(tableau);
    for (int i = 0; i < tableau->interpolant_stages && !drive->is_looked_into; i++) {
        const int status = take_stage(drive, h, tableau->stages + i, tableau->interpolant_a + i * all,
                                      tableau->interpolant_c[i]);
        if (status)
            return status;
    }
    drive->is_looked_into = 1;
    return REFDYN_OK;
}

int refdyn_runge_kutta_interpolate(struct refdyn_drive *drive, double theta, double *state) {
    const struct refdyn_tableau *tableau = refdyn_method_facts(drive->method).tableau;
    const int size = 2 * drive->work->n + 1;
    const double h = drive->t_end - drive->t_begin;
    const int status = look_into(drive, tableau, h);
    memcpy(state, drive->state, (size_t)size * sizeof *state);
    for (int s = 0; s < count_all(tableau) && !status; s++) {
        double weight = 0;
        for (int k = tableau->degree - 1; k >= 0; k--)
            weight = theta * (weight + tableau->interpolant[s * tableau->degree + k]);
        dense_add(state, h * weight, drive->stages + s * refdyn_slope_size(drive->work->model), size);
    }
    return status;
}

void refdyn_runge_kutta_accelerations(const struct refdyn_drive *drive, double theta, double *qdd) {
    const struct refdyn_tableau *tableau = refdyn_method_facts(drive->method).tableau;
    const int n = drive->work->n, size = refdyn_slope_size(drive->work->model);
    memset(qdd, 0, (size_t)n * sizeof *qdd);
    for (int s = 0; s < count_all(tableau); s++) {
        double weight = 0;
        for (int k = tableau->degree - 1; k >= 0; k--)
            weight = theta * weight + (k + 1) * tableau->interpolant[s * tableau->degree + k];
        dense_add(qdd, weight, drive->stages + s * size + n, n);
    }
}
