/*
 * Keeps a motion on its programme.
 *
 * In: states, and the matrices of the steps. Out: the nearest state on the programme in a metric that suits
 * the method.
 */
#include "runtime/core/motion/motion.h"

#include <string.h>

/* Largest change of a position by a projection, in tolerances. */
static const double moved_most = 10;
/* Largest change of a velocity by a projection, relative to the largest velocity. */
static const double moved_velocities = 0.5;
/* Directions in the metric of M are computed again after a longer way than this [rad, or length]. */
static const double turned_most = 0.1;

void refdyn_programme_lay_out(struct refdyn_programme *programme, const struct refdyn_model *model,
                              struct layout *layout) {
    programme->q = layout_doubles(layout, model->n);
}

void refdyn_programme_forget(struct refdyn_programme *programme) {
    programme->choice = -1;
    programme->factored = -1;
}

void refdyn_programme_hold(struct refdyn_programme *programme, int is_held) {
    programme->is_held = is_held;
}

/* In the metric of the mass matrix of a state that is not far away. */
int refdyn_programme_align(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                           const double *state) {
    struct refdyn_workspace *work = step->evaluation.work;
    const int is_near = programme->choice == work->partition.choices &&
                        refdyn_step_largest_move(step, state, programme->q) < turned_most;
    if (is_near || (programme->is_held && programme->choice >= 0))
        return REFDYN_OK;
    const int status = refdyn_linear_mass_directions(step->linear, work, t, state);
    if (status)
        return status;
    memcpy(programme->q, state, (size_t)step->n * sizeof *state);
    programme->choice = work->partition.choices;
    programme->factored = -1;
    programme->aligned++;
    return REFDYN_OK;
}

/* In the metric of the step's matrix: with the mass matrix, a stiff deflection would absorb the change. */
static void align_with_matrix(struct refdyn_programme *programme, struct refdyn_linear *linear) {
    if (programme->factored != linear->factored)
        refdyn_linear_directions(linear);
    programme->factored = linear->factored;
    programme->choice = -1;
}

double *refdyn_programme_take_directions(struct refdyn_programme *programme, struct refdyn_linear *linear) {
    double *directions = refdyn_linear_take_directions(linear);
    programme->factored = linear->factored;
    programme->choice = -1;
    return directions;
}

int refdyn_programme_meet(struct refdyn_programme *programme, struct refdyn_step *step, double t,
                          double *state) {
    int status = REFDYN_OK;
    if (step->method->projects_by_matrix)
        align_with_matrix(programme, step->linear);
    else
        status = refdyn_programme_align(programme, step, t, state);
    const struct refdyn_directions along = refdyn_linear_found(step->linear);
    return status ? status : refdyn_project_along(step->evaluation.work, &along, t, state, state + step->n);
}

double refdyn_programme_moved_most(const struct refdyn_step *step) {
    return moved_most * step->tolerance;
}

int refdyn_programme_moves_velocities(const struct refdyn_step *step, const double *before,
                                      const double *after, double h) {
    const int n = step->n;
    const double largest = refdyn_step_largest_move(step, before + n, NULL);
    const double moved = refdyn_step_largest_move(step, after + n, before + n);
    return moved > moved_velocities * largest && moved * h > refdyn_programme_moved_most(step);
}
