/* Decides whether lanes can take the next step of a motion, and keeps track of its factors. */
#include "runtime/core/base/core.h"

#include "runtime/batch/batch_private.h"

#include "runtime/core/methods/methods.h"

int refdyn_lanes_have_kind(const struct lanes *lanes, const struct refdyn_method_kind *kind) {
    return kind == &refdyn_explicit ||
           (lanes->has_tangent && (kind == &refdyn_rosenbrock || kind == &refdyn_collocation));
}

int refdyn_lanes_can_take(const struct lanes *lanes, const struct refdyn_motion *motion) {
    const struct refdyn_workspace *work = motion->work;
    const struct refdyn_method_kind *kind = motion->step.method->kind;
    const int meets_friction = kind == &refdyn_collocation && work->model->saturates;
    return refdyn_lanes_have_kind(lanes, kind) && !meets_friction &&
           (work->m == 0 || work->partition.rank == work->m);
}

int refdyn_lanes_can_meet(const struct lanes *lanes, const struct lane_step *one) {
    const struct refdyn_model *model = lanes->model->model;
    return one->attempt->t_new < one->motion->step.t_limit &&
           (model->m == 0 || (lanes->model->row_terms && model->row_terms));
}

int refdyn_lanes_align(struct lanes *lanes, struct lane_step *one, int lane) {
    struct refdyn_motion *motion = one->motion;
    refdyn_parameters_enter(&motion->parameters, motion->work);
    one->is_met = !refdyn_programme_align(&motion->programme, &motion->step, one->attempt->t_new,
                                          motion->step.state_new);
    refdyn_parameters_leave(&motion->parameters, motion->work);
    const int is_other = one->is_met && lanes->aligned[lane] != motion->programme.aligned;
    if (is_other)
        lanes->aligned[lane] = motion->programme.aligned;
    return is_other;
}

void refdyn_lanes_forget(struct lanes *lanes, struct refdyn_motion *motion, int lane) {
    if (lanes->has_factors[lane])
        refdyn_linear_drop_factors(&motion->linear);
    lanes->has_factors[lane] = 0;
    lanes->aligned[lane] = -1;
}
