/*
 * The parameters of a motion: see motion.h.
 *
 * Takes the caller's parameters, options and a step; gives these parameters with alpha = beta = gain_share /
 * h, or 0 where rows are not stabilised, or the gains of the rows as they are.
 */
#include "runtime/core/motion/motion.h"

#include <string.h>

void refdyn_parameters_lay_out(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                               struct layout *layout) {
    parameters->own = layout_doubles(layout, model->parameter_count + model->derived_count);
}

void refdyn_parameters_enter(struct refdyn_parameters *parameters, struct refdyn_workspace *work) {
    parameters->callers = work->p;
    work->p = parameters->own;
}

void refdyn_parameters_leave(struct refdyn_parameters *parameters, struct refdyn_workspace *work) {
    work->p = parameters->callers;
}

void refdyn_parameters_take(struct refdyn_parameters *parameters, const struct refdyn_model *model) {
    const int count = model->parameter_count + model->derived_count;
    memcpy(parameters->own, parameters->callers, (size_t)count * sizeof *parameters->own);
}

void refdyn_parameters_set(struct refdyn_parameters *parameters, struct refdyn_workspace *work, int place,
                           double value) {
    refdyn_parameters_leave(parameters, work);
    work->p[place] = value;
    refdyn_prepare(work);
    refdyn_parameters_enter(parameters, work);
    refdyn_parameters_take(parameters, work->model);
}

void refdyn_parameters_set_gains(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                                 const struct refdyn_options *options, double h) {
    const int *gains = model->gains;
    if (!gains || (options->stabilise == REFDYN_BAUMGARTE && options->gain_share == 0))
        return;
    const double gain = options->stabilise == REFDYN_BAUMGARTE ? options->gain_share / h : 0;
    for (int a = 0; a < model->m; a++) {
        if (gains[2 * a] >= 0)
            parameters->own[gains[2 * a]] = 2 * gain;
        if (gains[2 * a + 1] >= 0)
            parameters->own[gains[2 * a + 1]] = gain * gain;
    }
}
