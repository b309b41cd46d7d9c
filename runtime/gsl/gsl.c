/*
 * The steps of a drive by integrators of GSL: see refdyn_gsl.h.
 *
 * Takes a drive with a state at t_end; gives the next states there, by GSL's evolution of y' = f(t, y),
 * y = q, qd, work_done, with the Jacobian of first_order.h. What is shown of a state is the drive's own.
 */
#include "base/arithmetic.h"

#include "refdyn_gsl.h"

#include <gsl/gsl_errno.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "../private/advance.h"
#include "../private/kinks.h"
#include "constraints/constraints.h"
#include "private/first_order.h"
#include "../private/linearise.h"
#include "../private/pass.h"
#include "../private/slope.h"

/* Weight of work_done in the error: it follows the motion and has no say in the steps. */
static const double weight_none = 1e100;

/* Short steps feel a state where the rows lose rank from further away: msbdf, whose errors the gains alone
 * hold. */
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

/* ---- What GSL calls ---- */

/* GSL tries a smaller step, unless that cannot help. */
static int tell(struct refdyn_gsl *gsl, double t, int status) {
    if (!status)
        return GSL_SUCCESS;
    gsl->cause = status;
    gsl->drive->failed_t = t;
    return status > 0 ? GSL_EFAILED : GSL_EBADFUNC;
}

static int slope(double t, const double *y, double *dydt, void *params) {
    struct refdyn_gsl *gsl = params;
    const double inside = fmin(t, gsl->drive->t_limit);
    return tell(gsl, inside, refdyn_first_order_slope(gsl->drive, inside, y, dydt));
}

static int jacobian(double t, const double *y, double *by_y, double *by_t, void *params) {
    struct refdyn_gsl *gsl = params;
    const double inside = fmin(t, gsl->drive->t_limit);
    return tell(gsl, inside, refdyn_first_order_jacobian(gsl->drive, inside, y, by_y, by_t));
}

/* ---- One step ---- */

/* The error of a method's first step of order 1 goes with its square. */
static double first_step(const struct refdyn_gsl *gsl) {
    const struct refdyn_options *options = &gsl->drive->options;
    return options->step > 0 ? options->step : sqrt(options->tol);
}

static void begin_anew(struct refdyn_gsl *gsl) {
    gsl_odeiv2_driver_reset(gsl->driver);
    gsl->step = first_step(gsl);
    refdyn_set_gains(gsl->drive, gsl->step);
}

/* The end of the last step is the begin of the next one; equal times: the drive was started or refreshed. */
static void begin(struct refdyn_gsl *gsl) {
    struct refdyn_drive *drive = gsl->drive;
    refdyn_pass_leave(drive);
    if (drive->t_begin == drive->t_end)
        begin_anew(gsl);
    memcpy(drive->state, drive->state_new, (size_t)(2 * drive->work->n + 1) * sizeof(double));
    drive->t_begin = drive->t_end = refdyn_right_of(drive, drive->t_end);
}

/* In the metric of an implicit step's matrix, else a stiff deflection would take up the change. */
static int project(struct refdyn_gsl *gsl, double t, double h) {
    struct refdyn_drive *drive = gsl->drive;
    struct refdyn_workspace *work = drive->work;
    const int n = work->n;
    double *q = drive->state_new, *qd = q + n;
    drive->statistics.tangents++;
    int status = refdyn_linear_evaluate(&drive->linear, work, t, q, qd);
    if (!status)
        status = refdyn_linear_factor(&drive->linear, work, h);
    if (status)
        return status;
    refdyn_linear_directions(&drive->linear);
    gsl_odeiv2_evolve_reset(gsl->driver->e); /* its slope is that of the state before */
    const struct refdyn_directions along = refdyn_linear_found(&drive->linear);
    return refdyn_project_along(work, &along, t, q, qd);
}

/* Row terms, projection where that is asked for, and partition at the new state. */
static int complete(struct refdyn_gsl *gsl, double t, double h) {
    struct refdyn_drive *drive = gsl->drive;
    const int n = drive->work->n;
    double *q = drive->state_new, *qd = q + n;
    int status = refdyn_row_terms(drive->work, t, q, qd);
    if (!status && drive->work->m > 0 && drive->options.stabilise == REFDYN_PROJECT)
        status = project(gsl, t, h);
    if (!status)
        status = refdyn_partition_watch(drive->work, t, q, qd);
    if (status)
        drive->failed_t = t;
    return status;
}

/* The last accepted state is the end. */
static int go_back(struct refdyn_gsl *gsl, int status) {
    struct refdyn_drive *drive = gsl->drive;
    memcpy(drive->state_new, drive->state, (size_t)(2 * drive->work->n + 1) * sizeof(double));
    drive->t_end = drive->t_begin;
    drive->cause = gsl->cause ? gsl->cause : status;
    return status;
}

static int take_step(struct refdyn_gsl *gsl, double t_stop) {
    struct refdyn_drive *drive = gsl->drive;
    gsl_odeiv2_driver *driver = gsl->driver;
    const unsigned long failed = driver->e->failed_steps;
    double t = drive->t_begin;
    gsl->cause = REFDYN_OK;
    if (drive->options.step_max > 0)
        gsl->step = fmin(gsl->step, drive->options.step_max);
    const int result = gsl_odeiv2_evolve_apply(driver->e, driver->c, driver->s, &gsl->system, &t, t_stop,
                                               &gsl->step, drive->state_new);
    drive->statistics.rejected += (long)(driver->e->failed_steps - failed);
    if (result != GSL_SUCCESS)
        return go_back(gsl, gsl->cause < 0 ? gsl->cause : REFDYN_STEP_TOO_SMALL);
    const double h = t - drive->t_begin;
    const int status = complete(gsl, refdyn_right_of(drive, t), h);
    if (status)
        return go_back(gsl, status);
    drive->t_end = t;
    refdyn_accept_step(drive, h);
    return REFDYN_OK;
}

/* Through a state where the rows lose rank: see refdyn_pass. Behind it, the method starts anew. */
static int pass(struct refdyn_gsl *gsl, double t_stop, double ahead, double *t) {
    struct refdyn_drive *drive = gsl->drive;
    const double t_end = fmin(drive->t_most > drive->t_begin ? drive->t_most : INFINITY,
                              drive->t_final > drive->t_begin ? drive->t_final : INFINITY);
    if (refdyn_slope(drive, drive->t_begin, drive->state, drive->slope))
        return 0;
    if (refdyn_pass(drive, fmin(many_steps * gsl->step, t_stop - drive->t_begin), fmin(ahead, t_end), t)) {
        begin_anew(gsl);
        return 1;
    }
    memcpy(drive->state_new, drive->state, (size_t)(2 * drive->work->n + 1) * sizeof(double));
    return 0;
}

static int advance(struct refdyn_gsl *gsl, double t_out) {
    struct refdyn_drive *drive = gsl->drive;
    begin(gsl);
    if (refdyn_step_limit_reached(drive))
        return go_back(gsl, REFDYN_TOO_MANY_STEPS);
    const double least = refdyn_step_least(drive, t_out), ahead = refdyn_break_ahead(drive, gsl->step, t_out);
    if (!(gsl->step >= least))
        return go_back(gsl, REFDYN_STEP_TOO_SMALL);
    const double t_stop = ahead < t_out - least ? ahead : t_out;
    double t_singular = INFINITY;
    if (drive->options.singular == REFDYN_PASS && pass(gsl, t_stop, ahead, &t_singular))
        return REFDYN_OK;
    const int status = take_step(gsl, fmin(t_stop, drive->t_begin + (t_singular - drive->t_begin) / 2));
    if (!status && drive->t_end == ahead)
        begin_anew(gsl);
    return status;
}

/* ---- Motions ---- */

int refdyn_gsl_init(struct refdyn_gsl *gsl, struct refdyn_drive *drive, enum refdyn_gsl_method method) {
    const struct refdyn_options *options = &drive->options;
    const int n = drive->work->n, size = 2 * n + 1;
    const gsl_odeiv2_step_type *type = method == REFDYN_MSBDF ? gsl_odeiv2_step_msbdf : gsl_odeiv2_step_bsimp;
    *gsl = (struct refdyn_gsl){.drive = drive, .method = method};
    if (!refdyn_gsl_method_name((int)method) || !drive->linear.tangent || !(options->tol > 0) ||
        (method == REFDYN_MSBDF && options->stabilise == REFDYN_PROJECT))
        return REFDYN_BAD_OPTION;
    gsl->system = (gsl_odeiv2_system){
        .function = slope, .jacobian = jacobian, .dimension = (size_t)size, .params = gsl};
    for (int j = 0; j < n; j++)
        drive->side[j] = drive->side[n + j] = drive->units[j];
    drive->side[2 * n] = weight_none;
    gsl->driver = gsl_odeiv2_driver_alloc_scaled_new(&gsl->system, type, first_step(gsl), options->tol, 0, 1,
                                                     0, drive->side);
    return gsl->driver ? REFDYN_OK : REFDYN_BAD_MEMORY;
}

int refdyn_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps) {
    struct refdyn_drive *drive = gsl->drive;
    int status = REFDYN_OK;
    if (!(isfinite(t_out) && t_out >= drive->t))
        return REFDYN_BAD_OPTION;
    for (; steps > 0 && drive->t_end < t_out && !status; steps--)
        status = advance(gsl, t_out);
    const int shown = refdyn_drive_step(drive, fmin(t_out, drive->t_end), 0);
    return status ? status : shown;
}

int refdyn_gsl_to(struct refdyn_gsl *gsl, double t_out) {
    return refdyn_gsl_step(gsl, t_out, LONG_MAX);
}

void refdyn_gsl_release(struct refdyn_gsl *gsl) {
    if (gsl->driver)
        gsl_odeiv2_driver_free(gsl->driver);
    gsl->driver = NULL;
}
