/*
 * Rosenbrock methods on the constrained equations of motion: the step and its interpolant.
 *
 * Takes a state and a step h; gives the state after it, the error that the embedded formula estimates, and
 * states between. Each stage is one evaluation of the accelerations and one solution with the matrix of
 * linearise.h, g = gamma h, which is factored once a step. Formulas in rosenbrock.h.
 */
#include "base/arithmetic.h"

#include "private/rosenbrock.h"

#include <math.h>
#include <string.h>

#include "private/advance.h"
#include "linear/dense.h"
#include "private/linearise.h"
#include "private/slope.h"
#include "private/step.h"

static int count_all(const struct refdyn_rosenbrock_table *table) {
    return table->stages + table->interpolant_stages;
}

int refdyn_rosenbrock_room(const struct refdyn_rosenbrock_table *table, int n) {
    return count_all(table) * 2 * n;
}

/* y := state + sum_j weight_j U_j, q and qd */
static void combine(const struct refdyn_drive *drive, const double *weights, int count, double *y) {
    const int size = 2 * drive->work->n;
    memcpy(y, drive->state, (size_t)size * sizeof *y);
    refdyn_add_all(y, 1, weights, count, drive->stages, size, size);
}

/* Slope of stage i, whose point is drive->stage. */
static int stage_slope(struct refdyn_drive *drive, const struct refdyn_rosenbrock_table *table, int i,
                       double h) {
    const double t = fmin(drive->t_begin + table->alpha[i] * h, drive->t_limit);
    const int status = refdyn_slope(drive, t, drive->stage, drive->side);
    if (status)
        drive->failed_t = t;
    return status;
}

static int take_stage(struct refdyn_drive *drive, const struct refdyn_rosenbrock_table *table, int i,
                      double h) {
    const int n = drive->work->n, size = 2 * n;
    double *right = drive->side, *U = drive->stages + i * size;
    if (i == 0) {
        memcpy(right, drive->slope, (size_t)size * sizeof *right);
    } else {
        combine(drive, table->a + i * count_all(table), i, drive->stage);
        const int status = stage_slope(drive, table, i, h);
        if (status)
            return status;
    }
    refdyn_add_all(right, 1 / h, table->c + i * count_all(table), i, drive->stages, size, size);
    drive->statistics.solutions++;
    refdyn_linear_solve(&drive->linear, right, right + n, table->gamma_sum[i] * h, U, U + n);
    return REFDYN_OK;
}

int refdyn_rosenbrock_step(struct refdyn_drive *drive, double h) {
    const struct refdyn_rosenbrock_table *table = refdyn_method_facts(drive->method).rosenbrock;
    const int size = 2 * drive->work->n;
    drive->is_looked_into = 0;
    drive->statistics.factorisations++;
    int status = refdyn_linear_factor(&drive->linear, drive->work, table->gamma * h);
    drive->failed_t = drive->t_begin;
    for (int i = 0; i < table->stages && !status; i++)
        status = take_stage(drive, table, i, h);
    if (status)
        return status;
    combine(drive, table->b, table->stages, drive->state_new);
    memset(drive->error, 0, (size_t)size * sizeof(double));
    refdyn_add_all(drive->error, 1, table->e, table->stages, drive->stages, size, size);
    return refdyn_is_finite(drive->state_new, size) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* The stages that only the interpolant needs, once a step. */
static int look_into(struct refdyn_drive *drive, const struct refdyn_rosenbrock_table *table) {
    const double h = drive->t_end - drive->t_begin;
    int status = REFDYN_OK;
    for (int i = table->stages; i < count_all(table) && !status && !drive->is_looked_into; i++)
        status = take_stage(drive, table, i, h);
    drive->is_looked_into = !status;
    return status;
}

/* y_0 (1 + 2 theta) (1 - theta)^2 + h f_0 theta (1 - theta)^2 and the same from the end. */
void refdyn_hermite(const struct refdyn_drive *drive, const double *slope_end, double theta, double *state) {
    const double left = (1 - theta) * (1 - theta), right = theta * theta, h = drive->t_end - drive->t_begin;
    for (int i = 0; i < 2 * drive->work->n; i++)
        state[i] = left * ((1 + 2 * theta) * drive->state[i] + theta * h * drive->slope[i]) +
                   right * ((3 - 2 * theta) * drive->state_new[i] - (1 - theta) * h * slope_end[i]);
}

static int hermite(struct refdyn_drive *drive, double theta, double *state) {
    const double *slope_end = drive->slope_new;
    if (drive->t_end >= drive->t_limit) { /* at a break, on its left side */
        const int status = refdyn_slope(drive, drive->t_limit, drive->state_new, drive->side);
        if (status)
            return status;
        slope_end = drive->side;
    }
    refdyn_hermite(drive, slope_end, theta, state);
    return REFDYN_OK;
}

/* (1 - theta) y + theta (y_new + (1 - theta) (K_1 + theta (K_2 + ...))) */
int refdyn_rosenbrock_interpolate(struct refdyn_drive *drive, double theta, double *state) {
    const struct refdyn_rosenbrock_table *table = refdyn_method_facts(drive->method).rosenbrock;
    const int size = 2 * drive->work->n, all = count_all(table);
    if (table->interpolant_terms == 0)
        return hermite(drive, theta, state);
    const int status = look_into(drive, table);
    for (int i = 0; i < size; i++)
        state[i] = (1 - theta) * drive->state[i] + theta * drive->state_new[i];
    double power = theta * (1 - theta);
    for (int k = 0; k < table->interpolant_terms; k++, power *= theta)
        for (int j = 0; j < all; j++)
            dense_add(state, power * table->interpolant[k * all + j], drive->stages + j * size, size);
    return status;
}
