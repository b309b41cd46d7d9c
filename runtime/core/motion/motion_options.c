/*
 * Options of a motion, and the parameters with which it evaluates the model.
 *
 * In: the caller's options and parameters. Out: defaults and allowed ranges of the options; the parameters of
 * a step of h, with alpha = beta = gain_share / h, or 0 where rows are not stabilised, or the gains of the
 * rows as they are.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- Options ---- */

enum { EVENT_LOOKS_MOST = 1000 };
static const double step_default = 1e-3; /* [s], the step of the chapter's rigid manipulator */
static const double tol_default = 1e-6;  /* [rad]: a micrometre at 1 m */

struct refdyn_options refdyn_options_default(enum refdyn_method method) {
    const struct refdyn_method_definition *definition = refdyn_method_definition(method);
    const int is_fixed = !definition || definition->order_error == 0;
    return (struct refdyn_options){
        .method = method,
        .step = is_fixed ? step_default : 0,
        .tol = is_fixed ? 0 : tol_default,
        .stabilise = is_fixed ? REFDYN_BAUMGARTE : REFDYN_PROJECT,
    };
}

static int is_not_negative(double x) {
    return isfinite(x) && x >= 0;
}

static const char *wrong_option(const struct refdyn_options *options) {
    if (!options)
        return "options must not be NULL";
    if ((unsigned)options->method >= REFDYN_METHOD_COUNT)
        return "method is unknown";
    const int is_fixed = options->tol == 0;
    if (!is_fixed && !(options->tol >= DBL_EPSILON && options->tol < 1))
        return "tol must lie between the rounding of doubles and 1, in units of 1 rad and the model's "
               "length, or "
               "be 0 for fixed steps";
    if (is_fixed && options->method == REFDYN_AUTO)
        return "tol must be positive: the automatic choice takes no fixed steps";
    if (!is_fixed && refdyn_method_definition(options->method)->order_error == 0)
        return "tol must be 0: the method has fixed steps";
    if (!is_not_negative(options->tol_rates) || options->tol_rates >= 1 ||
        (is_fixed && options->tol_rates > 0))
        return is_fixed ? "tol_rates must be 0: steps are fixed"
                        : "tol_rates must lie between 0 and 1, or be 0 for none";
    if (!is_not_negative(options->step) || (is_fixed && options->step == 0))
        return is_fixed ? "step must be positive" : "step must be positive, or 0 for an automatic one";
    if (!is_not_negative(options->step_max))
        return "step_max must be positive, or 0 for none";
    if (!is_not_negative(options->length))
        return "length must be positive, or 0 for that of the model";
    if ((unsigned)options->stabilise > REFDYN_PROJECT)
        return "stabilise must be none, baumgarte or project";
    if ((unsigned)options->singular > REFDYN_PASS)
        return "singular must be stop or pass";
    if (!is_not_negative(options->gain_share))
        return "gain_share must be positive, or 0 for the gains of the rows";
    if (options->step_limit < 0)
        return "step_limit must be positive, or 0 for none";
    if (options->event_looks < 0 || options->event_looks > EVENT_LOOKS_MOST)
        return "event_looks must lie between 0 and 1000";
    return NULL;
}

int refdyn_options_validate(const struct refdyn_options *options, const char **fact) {
    const char *wrong = wrong_option(options);
    if (fact)
        *fact = wrong;
    return wrong ? REFDYN_BAD_OPTION : REFDYN_OK;
}

/* ---- Parameters ---- */

void refdyn_parameters_lay_out(struct refdyn_parameters *parameters, const struct refdyn_model *model,
                               struct layout *layout) {
    const int count = model->parameter_count + model->derived_count;
    parameters->own = layout_doubles(layout, count);
    parameters->taken = layout_doubles(layout, count + model->input_count);
}

void refdyn_parameters_enter(struct refdyn_parameters *parameters, struct refdyn_workspace *work) {
    parameters->callers = work->p;
    work->p = parameters->own;
}

void refdyn_parameters_leave(struct refdyn_parameters *parameters, struct refdyn_workspace *work) {
    work->p = parameters->callers;
}

static size_t parameter_bytes(const struct refdyn_model *model) {
    return ((size_t)model->parameter_count + (size_t)model->derived_count) * sizeof(double);
}

void refdyn_parameters_take(struct refdyn_parameters *parameters, const struct refdyn_workspace *work) {
    const size_t bytes = parameter_bytes(work->model);
    memcpy(parameters->own, parameters->callers, bytes);
    memcpy(parameters->taken, parameters->callers, bytes);
    memcpy(parameters->taken + bytes / sizeof(double), work->x,
           (size_t)work->model->input_count * sizeof(double));
}

double *refdyn_parameters_inputs(const struct refdyn_parameters *parameters,
                                 const struct refdyn_model *model) {
    return parameters->taken + parameter_bytes(model) / sizeof(double);
}

int refdyn_parameters_have_changed(const struct refdyn_parameters *parameters,
                                   const struct refdyn_workspace *work) {
    const size_t bytes = parameter_bytes(work->model);
    return memcmp(parameters->taken, work->p, bytes) != 0 ||
           memcmp(parameters->taken + bytes / sizeof(double), work->x,
                  (size_t)work->model->input_count * sizeof(double)) != 0;
}

void refdyn_parameters_set(struct refdyn_parameters *parameters, struct refdyn_workspace *work, int place,
                           double value) {
    refdyn_parameters_leave(parameters, work);
    work->p[place] = value;
    refdyn_prepare(work);
    refdyn_parameters_enter(parameters, work);
    refdyn_parameters_take(parameters, work);
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
