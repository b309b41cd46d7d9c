/*
 * Explicit Runge-Kutta methods: slopes and the step.
 *
 * Takes a state (q, qd, work) and a step h; gives the state after it and the error that the embedded formula
 * estimates. The work of non-conservative and programme forces is one more component of the state, with the
 * slope qd . Q_nonconservative + r . qd; nothing is computed for it unless options.balance asks.
 */
#include "runge_kutta.h"

#include <math.h>
#include <string.h>

#include "dense.h"

static const struct refdyn_tableau *const tableaus[REFDYN_METHOD_COUNT] = {
    [REFDYN_RK4] = &refdyn_rk4,
    [REFDYN_RK54] = &refdyn_rk54,
};

const struct refdyn_tableau *refdyn_tableau_of(enum refdyn_method method) {
    return tableaus[method];
}

const char *refdyn_method_name(int method) {
    return method >= 0 && method < REFDYN_METHOD_COUNT ? tableaus[method]->name : NULL;
}

int refdyn_method_find(const char *name) {
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        if (strcmp(name, tableaus[method]->name) == 0)
            return method;
    return -1;
}

/* qd . Q_nonconservative + r . qd */
static double power(const struct refdyn_drive *drive, double t, const double *q, const double *qd,
                    const double *qdd) {
    struct refdyn_workspace *work = drive->work;
    double of_forces = 0;
    if (work->model->power)
        work->model->power(work->p, work->x, t, q, qd, &of_forces);
    return of_forces + refdyn_programme_power(work, qdd, qd);
}

int refdyn_slope_evaluated(const struct refdyn_drive *drive, double t, const double *state, double *slope) {
    const int n = drive->work->n;
    const int status = refdyn_solve(drive->work, drive->options.stabilise, slope + n);
    if (status)
        return status;
    memcpy(slope, state + n, (size_t)n * sizeof *slope);
    slope[2 * n] = drive->options.balance ? power(drive, t, state, state + n, slope + n) : 0;
    return REFDYN_OK;
}

int refdyn_slope(const struct refdyn_drive *drive, double t, const double *state, double *slope) {
    const int status = refdyn_equations(drive->work, t, state, state + drive->work->n);
    return status ? status : refdyn_slope_evaluated(drive, t, state, slope);
}

/* y := state + h sum_j weight_j slope_j */
static void combine(const struct refdyn_drive *drive, double h, const double *weights, int stages,
                    double *y) {
    const int size = 2 * drive->work->n + 1;
    memcpy(y, drive->state, (size_t)size * sizeof *y);
    for (int j = 0; j < stages; j++)
        if (weights[j] != 0)
            dense_add(y, h * weights[j], drive->slopes + j * size, size);
}

/* error := h sum_j e_j slope_j, q and qd only */
static void estimate(struct refdyn_drive *drive, double h, const struct refdyn_tableau *tableau) {
    const int n = drive->work->n, size = 2 * n + 1;
    for (int i = 0; i < 2 * n; i++)
        drive->error[i] = 0;
    for (int j = 0; j < tableau->stages; j++)
        if (tableau->e[j] != 0)
            dense_add(drive->error, h * tableau->e[j], drive->slopes + j * size, 2 * n);
}

int refdyn_runge_kutta_step(struct refdyn_drive *drive, double h) {
    const struct refdyn_tableau *tableau = refdyn_tableau_of(drive->options.method);
    const int size = 2 * drive->work->n + 1;
    for (int s = 1; s < tableau->stages; s++) {
        const double t = fmin(drive->t + tableau->c[s] * h, drive->t_limit);
        combine(drive, h, tableau->a + s * tableau->stages, s, drive->stage);
        const int status = refdyn_slope(drive, t, drive->stage, drive->slopes + s * size);
        if (status) {
            drive->failed_t = t;
            return status;
        }
    }
    combine(drive, h, tableau->b, tableau->stages, drive->state_new);
    if (tableau->order_error)
        estimate(drive, h, tableau);
    return REFDYN_OK;
}
