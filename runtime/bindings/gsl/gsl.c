/*
 * The steps of a motion by integrators of GSL.
 *
 * In: an integrator with a state at t_end. Out: the next states there, by GSL's evolution of y' = f(t, y),
 * y = (q, qd, work_done), with the Jacobian of first_order.h. Residuals, energy and power of a state come
 * from the integrator.
 */
#include "runtime/core/base/core.h"

#include "refdyn_gsl.h"

#include <gsl/gsl_errno.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/motion/motion.h"
#include "runtime/bindings/gsl/first_order.h"

/* Error level of work_done, so large that work does not influence the steps. */
static const double weight_none = 1e100;

/* Number of steps of msbdf over which a state where the rows lose rank is noticeable, because only the gains
 * bound its errors. */
static const double many_steps = 16;

static const char *const names[REFDYN_GSL_METHOD_COUNT] = {
    [REFDYN_MSBDF] = "msbdf", [REFDYN_BSIMP] = "bsimp"};

const char *refdyn_gsl_method_name(int method) {
    return method >= 0 && method < REFDYN_GSL_METHOD_COUNT ? names[method] : NULL;
}

int refdyn_gsl_method_find(const char *name) {
    for (int method = 0; name && method < REFDYN_GSL_METHOD_COUNT; method++)
        if (strcmp(name, names[method]) == 0)
            return method;
    return -1;
}

static struct refdyn_motion *motion_of(const struct refdyn_gsl *gsl) {
    return gsl->integrator->motion;
}

/* ---- Callbacks of GSL ---- */

/* Returns the status for GSL: it tries a smaller step, unless that cannot help. */
static int tell(struct refdyn_gsl *gsl, double t, int status) {
    if (!status)
        return GSL_SUCCESS;
    gsl->cause = status;
    refdyn_motion_failed(motion_of(gsl), status, t);
    return status > 0 ? GSL_EFAILED : GSL_EBADFUNC;
}

static int rates(double t, const double *y, double *dydt, void *params) {
    struct refdyn_gsl *gsl = params;
    struct refdyn_step *step = &motion_of(gsl)->step;
    const double inside = refdyn_step_inside(step, t);
    return tell(gsl, inside, refdyn_first_order_rates(step, inside, y, dydt));
}

static int jacobian(double t, const double *y, double *by_y, double *by_t, void *params) {
    struct refdyn_gsl *gsl = params;
    struct refdyn_step *step = &motion_of(gsl)->step;
    const double inside = refdyn_step_inside(step, t);
    return tell(gsl, inside, refdyn_first_order_jacobian(step, inside, y, by_y, by_t));
}

/* ---- One step ---- */

/* Returns the length of the first step; a first step of order 1 has an error proportional to its square. */
static double first_step(const struct refdyn_gsl *gsl) {
    const struct refdyn_options *options = &gsl->integrator->options;
    return options->step > 0 ? options->step : sqrt(options->tol);
}

static void begin_anew(struct refdyn_gsl *gsl) {
    struct refdyn_motion *motion = motion_of(gsl);
    gsl_odeiv2_driver_reset(gsl->driver);
    gsl->step = first_step(gsl);
    refdyn_parameters_set_gains(&motion->parameters, motion->work->model, &motion->options, gsl->step);
}

/* Makes the end of the last step the start of the next one; equal times: the motion was started or refreshed.
 */
static void begin(struct refdyn_gsl *gsl) {
    struct refdyn_motion *motion = motion_of(gsl);
    struct refdyn_step *step = &motion->step;
    refdyn_special_step_end(motion);
    if (step->t_begin == step->t_end)
        begin_anew(gsl);
    refdyn_step_next(step, refdyn_time_events_right_of(&motion->time_events, step->t_end));
}

/* Projects in the metric of an implicit step's matrix; in that of M, stiff deflections would absorb the
 * change. */
static int project(struct refdyn_gsl *gsl, double t, double h) {
    struct refdyn_step *step = &motion_of(gsl)->step;
    struct refdyn_workspace *work = step->evaluation.work;
    double *state = step->state_new;
    int status = refdyn_rates(&step->evaluation, t, state, step->side);
    if (!status)
        status = refdyn_linear_evaluate(step->linear, work, t, state, step->side);
    if (!status)
        status = refdyn_linear_factor(step->linear, work, h);
    if (status)
        return status;
    refdyn_linear_directions(step->linear);
    gsl_odeiv2_evolve_reset(gsl->driver->e); /* its rates belong to the state before */
    const struct refdyn_directions along = refdyn_linear_found(step->linear);
    return refdyn_project_along(work, &along, t, state, state + step->n);
}

/* Computes row terms and partition at the new state, after projection if requested. */
static int complete(struct refdyn_gsl *gsl, double t, double h) {
    struct refdyn_motion *motion = motion_of(gsl);
    struct refdyn_workspace *work = motion->work;
    double *q = motion->step.state_new, *qd = q + work->n;
    int status = refdyn_row_terms(work, t, q, qd);
    if (!status && work->m > 0 && motion->options.stabilise == REFDYN_PROJECT)
        status = project(gsl, t, h);
    if (!status)
        status = refdyn_partition_watch(work, t, q, qd);
    if (status)
        refdyn_motion_failed(motion, status, t);
    return status;
}

/* Returns to the last accepted state. */
static int go_back(struct refdyn_gsl *gsl, int status) {
    struct refdyn_motion *motion = motion_of(gsl);
    refdyn_step_give_up(&motion->step);
    refdyn_motion_failed(motion, gsl->cause ? gsl->cause : status, motion->failure.t);
    return status;
}

static int take_step(struct refdyn_gsl *gsl, double t_stop) {
    struct refdyn_motion *motion = motion_of(gsl);
    struct refdyn_step *step = &motion->step;
    gsl_odeiv2_driver *driver = gsl->driver;
    const unsigned long failed = driver->e->failed_steps;
    double t = step->t_begin;
    gsl->cause = REFDYN_OK;
    if (motion->options.step_max > 0)
        gsl->step = fmin(gsl->step, motion->options.step_max);
    const int result = gsl_odeiv2_evolve_apply(driver->e, driver->c, driver->s, &gsl->system, &t, t_stop,
                                               &gsl->step, step->state_new);
    refdyn_statistics_rejected(&motion->statistics, (long)(driver->e->failed_steps - failed));
    if (result != GSL_SUCCESS)
        return go_back(gsl, gsl->cause < 0 ? gsl->cause : REFDYN_STEP_TOO_SMALL);
    const double h = t - step->t_begin;
    refdyn_step_end(step, t);
    refdyn_rows_look_at_end(motion);
    const int status = complete(gsl, refdyn_rows_side_of(motion, t), h);
    if (status)
        return go_back(gsl, status);
    refdyn_statistics_step(&motion->statistics, motion->work, h);
    return REFDYN_OK;
}

/* Continues after a jump of the rows at the end of the last step. */
static int take_new_rows(struct refdyn_gsl *gsl) {
    struct refdyn_motion *motion = motion_of(gsl);
    struct refdyn_step *step = &motion->step;
    const int status = refdyn_rows_take_new(motion);
    memcpy(step->state_new, step->state, refdyn_state_bytes(step));
    if (status)
        refdyn_motion_failed(motion, status, step->t_begin);
    return status;
}

/* Through a state where the rows lose rank, if one lies within many steps; the method starts again after it.
 */
static int pass(struct refdyn_gsl *gsl, double t_stop, struct refdyn_ahead *ahead) {
    struct refdyn_motion *motion = motion_of(gsl);
    struct refdyn_step *step = &motion->step;
    if (motion->options.singular != REFDYN_PASS ||
        refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates))
        return 0;
    ahead->h = fmin(many_steps * gsl->step, t_stop - step->t_begin);
    ahead->bound = refdyn_motion_bound(motion);
    ahead->remaining = refdyn_crossing_find(motion, ahead);
    if (isfinite(ahead->remaining) && refdyn_crossing_step(motion, ahead, &ahead->remaining)) {
        begin_anew(gsl);
        return 1;
    }
    refdyn_step_give_up(step);
    return 0;
}

static int advance(struct refdyn_gsl *gsl, double t_out) {
    struct refdyn_motion *motion = motion_of(gsl);
    struct refdyn_step *step = &motion->step;
    begin(gsl);
    int status = motion->rows_change ? take_new_rows(gsl) : REFDYN_OK;
    if (status)
        return go_back(gsl, status);
    if (refdyn_step_limit_reached(motion))
        return go_back(gsl, REFDYN_TOO_MANY_STEPS);
    const double least = refdyn_control_least(step->t_begin, t_out);
    struct refdyn_ahead ahead = {
        .t_out = t_out, .least = least, .h = gsl->step, .remaining = INFINITY, .seen = refdyn_obstacles_seen};
    const double t_event = refdyn_time_events_find(motion, &ahead);
    if (!(gsl->step >= least))
        return go_back(gsl, REFDYN_STEP_TOO_SMALL);
    const double t_stop = t_event < t_out - least ? t_event : t_out;
    if (pass(gsl, t_stop, &ahead))
        return REFDYN_OK;
    status = take_step(gsl, fmin(t_stop, step->t_begin + refdyn_ahead_longest(motion, &ahead)));
    if (!status && step->t_end == t_event)
        begin_anew(gsl);
    return status;
}

/* ---- Motions ---- */

/* Returns whether refdyn_gsl_init has succeeded. */
static int has_driver(const struct refdyn_gsl *gsl) {
    return gsl && gsl->seal == REFDYN_SEAL && gsl->driver;
}

int refdyn_gsl_init(struct refdyn_gsl *gsl, struct refdyn_integrator *integrator,
                    enum refdyn_gsl_method method) {
    if (!gsl)
        return REFDYN_BAD_MEMORY;
    *gsl = (struct refdyn_gsl){.seal = REFDYN_SEAL, .integrator = integrator, .method = method};
    if (!refdyn_integrator_is_laid_out(integrator))
        return REFDYN_NOT_STARTED;
    const struct refdyn_options *options = &integrator->options;
    struct refdyn_step *step = &integrator->motion->step;
    const int n = step->n, size = 2 * n + 1;
    const gsl_odeiv2_step_type *type = method == REFDYN_MSBDF ? gsl_odeiv2_step_msbdf : gsl_odeiv2_step_bsimp;
    if (!refdyn_gsl_method_name((int)method) || !step->linear->tangent || !(options->tol > 0) ||
        (method == REFDYN_MSBDF && options->stabilise == REFDYN_PROJECT))
        return REFDYN_BAD_OPTION;
    gsl->system = (gsl_odeiv2_system){
        .function = rates, .jacobian = jacobian, .dimension = (size_t)size, .params = gsl};
    for (int j = 0; j < n; j++)
        step->side[j] = step->side[n + j] = step->units[j];
    for (int j = step->joints; j < n; j++)
        step->side[j] = weight_none; /* the integral of a state, which has no meaning */
    step->side[2 * n] = weight_none;
    gsl->driver = gsl_odeiv2_driver_alloc_scaled_new(&gsl->system, type, first_step(gsl), options->tol, 0, 1,
                                                     0, step->side);
    return gsl->driver ? REFDYN_OK : REFDYN_BAD_MEMORY;
}

int refdyn_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps) {
    if (!has_driver(gsl))
        return REFDYN_NOT_STARTED;
    struct refdyn_integrator *integrator = gsl->integrator;
    int status = refdyn_integrator_status(integrator);
    if (status)
        return status;
    struct refdyn_motion *motion = integrator->motion;
    if (!(isfinite(t_out) && t_out >= integrator->t))
        return REFDYN_BAD_TIME;
    status = refdyn_integrator_notice(integrator);
    if (status)
        return status;
    refdyn_parameters_enter(&motion->parameters, motion->work);
    for (; steps > 0 && t_out - motion->step.t_end > refdyn_motion_resolution(motion, t_out) && !status;
         steps--)
        status = advance(gsl, t_out);
    refdyn_parameters_leave(&motion->parameters, motion->work);
    const int shown = refdyn_integrator_step(integrator, t_out, 0);
    return status ? status : shown;
}

int refdyn_gsl_to(struct refdyn_gsl *gsl, double t_out) {
    return refdyn_gsl_step(gsl, t_out, LONG_MAX);
}

void refdyn_gsl_release(struct refdyn_gsl *gsl) {
    if (!has_driver(gsl))
        return;
    gsl_odeiv2_driver_free(gsl->driver);
    gsl->driver = NULL;
}
