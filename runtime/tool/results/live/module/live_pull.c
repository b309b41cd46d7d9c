/*
 * A hand that pulls a point of interest during a motion: a spring and a damper from the point to a place that
 * moves with the pointer (gen/model_file/read_pulls.c). Its inputs change at samples of time, as those of
 * `--inputs`.
 *
 * The spring is as stiff as makes the mass that the point feels swing at a chosen frequency, with a chosen
 * damping. That mass is 1 over the largest diagonal entry of C M^-1 C^T, with the Jacobian C of the point;
 * rows are ignored.
 */
#include "runtime/tool/results/live/module/live_module.h"

#include <math.h>
#include <string.h>

static const double omega = 12.6; /* 2 Hz: soft enough to be seen, stiff enough to follow a hand [rad/s] */
static const double damping_ratio = 0.7;
static const double sample_time = 0.01; /* [s] */

/* The inputs of the hand in x: stiffness and damping of each point, then the place. */
static double *hand_inputs(const struct live *live, double *x) {
    const struct refdyn_model *model = live->work.model;
    return x + model->input_count - live_model.hand_input_count;
}

static void let_go(const struct live *live, double *x) {
    memset(hand_inputs(live, x), 0, (size_t)live_model.hand_input_count * sizeof *x);
}

/* The point that the next motion pulls from a time on; -1: none. */
EXPORT(live_plan_pull) void live_plan_pull(struct live *live, int point, double from) {
    live->pull = (struct live_pull){.point = point, .from = from};
}

/* The place of the hand. */
EXPORT(live_move_hand) void live_move_hand(struct live *live, double x, double y, double z) {
    live->pull.hand[0] = x;
    live->pull.hand[1] = y;
    live->pull.hand[2] = z;
}

EXPORT(live_release_pull) void live_release_pull(struct live *live) {
    live->pull.is_released = true;
}

/* Returns the mass that the point feels at the state, 0 if it cannot move. */
static double mass_at(struct live *live, double *jacobian) {
    struct refdyn_workspace *work = &live->work;
    const int n = work->model->n;
    const double *rows = jacobian + 3 * live->pull.point * n;
    double *mass = live_get_block(live, (size_t)(n * n) * sizeof *mass), *column, mobility = 0;
    column = live_get_block(live, (size_t)n * sizeof *column);
    work->model->C(work->p, work->x, 0, live->q, live->qd, jacobian);
    if (refdyn_equations(work, 0, live->q, live->qd) != REFDYN_OK)
        return 0;
    memcpy(mass, work->M, (size_t)(n * n) * sizeof *mass);
    if (!record_factor(mass, n))
        return 0;
    for (int axis = 0; axis < 3; axis++) {
        memcpy(column, rows + axis * n, (size_t)n * sizeof *column);
        record_solve_factored(mass, n, column, 1);
        double along = 0;
        for (int j = 0; j < n; j++)
            along += rows[axis * n + j] * column[j];
        mobility = fmax(mobility, along);
    }
    return mobility > 0 ? 1 / mobility : 0;
}

void live_start_pull(struct live *live) {
    const struct refdyn_model *model = live->work.model;
    let_go(live, live->work.x);
    if (live->pull.point >= 0)
        live->pull.mass =
            mass_at(live, live_get_block(live, (size_t)(3 * model->point_count * model->n) * sizeof(double)));
}

double live_sample_pull(struct live *live, double t, double *x) {
    const struct live_pull *pull = &live->pull;
    double *inputs = hand_inputs(live, x);
    let_go(live, x);
    if (t < pull->from)
        return pull->from;
    if (pull->is_released)
        return INFINITY;
    inputs[2 * pull->point] = pull->mass * omega * omega;
    inputs[2 * pull->point + 1] = 2 * damping_ratio * pull->mass * omega;
    memcpy(inputs + 2 * live->work.model->point_count, pull->hand, sizeof pull->hand);
    return t + sample_time;
}
