/*
 * Explicit Runge-Kutta methods: tables, slopes and the step.
 *
 * Takes a state (q, qd, work) and a step h; gives the state after it and the error that the embedded formula
 * estimates. rk4: Kutta, Z. Math. Phys. 46:435-453, 1901. rk54: Dormand and Prince, J. Comput. Appl. Math.
 * 6:19-26, 1980, RK5(4)7M. The work of non-conservative and programme forces is one more component of the
 * state, with the slope qd . Q_nonconservative + r . qd; nothing is computed for it unless options.balance
 * asks.
 */
#include "runge_kutta.h"

#include <math.h>
#include <string.h>

#include "dense.h"

static const double rk4_a[4 * 4] = {
    0,       0,       0, 0, /* */
    1.0 / 2, 0,       0, 0, /* */
    0,       1.0 / 2, 0, 0, /* */
    0,       0,       1, 0,
};
static const double rk4_b[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
static const double rk4_c[4] = {0, 1.0 / 2, 1.0 / 2, 1};

/* clang-format off */
static const double rk54_a[7 * 7] = {
    0, 0, 0, 0, 0, 0, 0,
    1.0 / 5, 0, 0, 0, 0, 0, 0,
    3.0 / 40, 9.0 / 40, 0, 0, 0, 0, 0,
    44.0 / 45, -56.0 / 15, 32.0 / 9, 0, 0, 0, 0,
    19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729, 0, 0, 0,
    9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656, 0, 0,
    35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0,
};
static const double rk54_b[7] = {
    35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0,
};
static const double rk54_e[7] = {
    35.0 / 384 - 5179.0 / 57600, 0, 500.0 / 1113 - 7571.0 / 16695, 125.0 / 192 - 393.0 / 640,
    -2187.0 / 6784 + 92097.0 / 339200, 11.0 / 84 - 187.0 / 2100, -1.0 / 40,
};
/* clang-format on */
static const double rk54_c[7] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};

static const struct refdyn_tableau tableaus[REFDYN_METHOD_COUNT] = {
    [REFDYN_RK4] = {.name = "rk4", .stages = 4, .order = 4, .a = rk4_a, .b = rk4_b, .c = rk4_c},
    [REFDYN_RK54] = {.name = "rk54",
                     .stages = 7,
                     .order = 5,
                     .order_error = 4,
                     .is_last_new = 1,
                     .a = rk54_a,
                     .b = rk54_b,
                     .c = rk54_c,
                     .e = rk54_e},
};

const struct refdyn_tableau *refdyn_tableau_of(enum refdyn_method method) {
    return &tableaus[method];
}

const char *refdyn_method_name(int method) {
    return method >= 0 && method < REFDYN_METHOD_COUNT ? tableaus[method].name : NULL;
}

int refdyn_method_find(const char *name) {
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        if (strcmp(name, tableaus[method].name) == 0)
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
