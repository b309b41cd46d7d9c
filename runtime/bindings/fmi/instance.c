/* One instance of an FMU: messages, memory, the start of the motion, evaluation of its state, checks of modes
 * and lengths for both versions of FMI, saved states. */
#include "runtime/bindings/fmi/fmi.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/core/base/core.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/motion/motion.h"

enum { TEXT_LENGTH = 1000, NAMED_MOST = 8 };
static const double default_gain = 10; /* alpha = beta [1/s] in Model Exchange for a row without gains */

/* ---- Messages ---- */

/* Listeners read a message as a format of printf: replaces characters that would act as one. */
static void make_plain(char *text) {
    for (; *text; text++)
        if (*text == '%')
            *text = '_';
}

static const char *category_of(enum fmu_status status) {
    return status == FMU_OK        ? "logAll"
           : status == FMU_WARNING ? "logStatusWarning"
           : status == FMU_DISCARD ? "logStatusDiscard"
           : status == FMU_ERROR   ? "logStatusError"
                                   : "logStatusFatal";
}

static void listen(const struct fmu_listener *listener, enum fmu_status status, char *text) {
    make_plain(text);
    if (listener->tell)
        listener->tell(listener, status, category_of(status), text);
}

enum fmu_status fmu_tell(struct fmu_instance *instance, enum fmu_status status, const char *format, ...) {
    char text[TEXT_LENGTH];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (status != FMU_OK || instance->is_logging)
        listen(&instance->listener, status, text);
    if (status >= FMU_ERROR)
        instance->mode = FMU_FAILED;
    return status;
}

/* Appends to the text. */
static void add_text(char *text, const char *format, ...) {
    const size_t length = strlen(text);
    va_list list;
    va_start(list, format);
    vsnprintf(text + length, TEXT_LENGTH - length, format, list);
    va_end(list);
}

/* Appends "q = 0.1 0.2, qd = 0.3 0.4"; of many coordinates only the first ones. */
static void add_state(char *text, const struct fmu_instance *instance) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const int n = instance->work.n, shown = n < NAMED_MOST ? n : NAMED_MOST;
    add_text(text, "; q =");
    for (int i = 0; i < shown; i++)
        add_text(text, " %.6g", integrator->q[i]);
    add_text(text, "%s, qd =", shown < n ? " ..." : "");
    for (int i = 0; i < shown; i++)
        add_text(text, " %.6g", integrator->qd[i]);
    add_text(text, "%s", shown < n ? " ..." : "");
}

static void add_refused(char *text, const struct refdyn_workspace *work) {
    const struct refdyn_requirement *requirement = &work->model->requirements[work->refused];
    double x[REFDYN_REQUIREMENT_NUMBERS];
    refdyn_refused_numbers(work, x);
    add_text(text, ": %s: ", requirement->subject);
    add_text(text, requirement->fact, x[0], x[1], x[2], x[3], x[4], x[5]);
}

enum fmu_status fmu_tell_failure(struct fmu_instance *instance, int status) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const struct refdyn_model *model = instance->work.model;
    const struct refdyn_fault *fault = &instance->work.fault;
    char text[TEXT_LENGTH] = "";
    add_text(text, "t = %.9g s: %s", integrator->t, refdyn_status_text(status));
    if (integrator->cause && integrator->cause != status)
        add_text(text, " (at %.9g s: %s)", integrator->failed_t, refdyn_status_text(integrator->cause));
    if (model->m > 0 && fault->row >= 0 && fault->row < model->m)
        add_text(text, ", row %s", model->rows[fault->row].name);
    if (fault->coordinate >= 0 && fault->coordinate < model->n)
        add_text(text, ", coordinate %s", model->coordinates[fault->coordinate].name);
    if (status == REFDYN_EVENTS_ACCUMULATE || status == REFDYN_EVENT_NOT_MET || status == REFDYN_REFUSED)
        for (int i = 0; i < integrator->event_count; i++)
            add_text(text, ", event %s", model->events[integrator->event[i]].name);
    if (status == REFDYN_REFUSED)
        add_refused(text, &instance->work);
    if (integrator->q)
        add_state(text, instance);
    return fmu_tell(instance, FMU_ERROR, "%s", text);
}

void fmu_tell_contacts(struct fmu_instance *instance) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const struct refdyn_model *model = instance->work.model;
    for (int k = 0; k < integrator->contact_count; k++) {
        const int is_free = integrator->contact_mode[k] == REFDYN_CONTACT_FREE;
        const double since = is_free ? NAN : integrator->contact_since[k], known = instance->since[k];
        const char *name = model->rows[model->m - integrator->contact_count + k].name;
        instance->since[k] = since;
        if (isfinite(since) && !(since == known))
            fmu_tell(instance, FMU_OK, "t = %.9g s: contact %s rests from %.12g s on", integrator->t, name,
                     since);
        else if (!isfinite(since) && isfinite(known))
            fmu_tell(instance, FMU_OK, "t = %.9g s: contact %s lets go", integrator->contact_left[k], name);
    }
}

int fmu_allows(struct fmu_instance *instance, unsigned modes, const char *function) {
    static const char *const names[] = {"is instantiated",  "initialises", "is in event mode", "integrates",
                                        "is between steps", "has ended",   "has failed"};
    if (modes & 1u << instance->mode)
        return 1;
    char text[TEXT_LENGTH];
    snprintf(text, sizeof text, "%s is not allowed while the instance %s", function, names[instance->mode]);
    listen(&instance->listener, FMU_ERROR, text);
    return 0;
}

/* ---- Memory ---- */

/* The only list of arrays that follow workspace and integrator in the block; returns their bytes. */
static size_t lay_out(struct fmu_instance *instance, char *base) {
    const struct refdyn_model *model = refdyn_fmu.model;
    const struct refdyn_spatial *spatial = refdyn_fmu.spatial;
    const int n = model->n, rows = 3 * model->point_count, angular = spatial ? 6 * spatial->count : 0;
    const int derivatives = n * (2 * n + model->input_count);
    struct layout layout = {base, instance->work_size + instance->integrator_size};
    instance->start = layout_doubles(&layout, 2 * n);
    instance->rates = layout_doubles(&layout, 2 * n + 1 + model->m);
    instance->r = layout_doubles(&layout, rows);
    instance->rd = layout_doubles(&layout, rows);
    instance->rdd = layout_doubles(&layout, rows);
    instance->C = layout_doubles(&layout, rows * n);
    instance->energy = layout_doubles(&layout, 3);
    instance->force = layout_doubles(&layout, n);
    instance->lambda = layout_doubles(&layout, model->m);
    instance->course = layout_doubles(&layout, model->course_count);
    instance->drift = layout_doubles(&layout, angular);
    instance->J = layout_doubles(&layout, angular * n);
    instance->d_qdd = layout_doubles(&layout, derivatives);
    instance->d_force = layout_doubles(&layout, model->m > 0 ? derivatives : 0);
    instance->zeros = layout_doubles(&layout, fmu_count_indicators(model));
    instance->left_at = layout_doubles(&layout, model->event_count);
    instance->left_rate = layout_doubles(&layout, model->event_count);
    instance->since = layout_doubles(&layout, fmu_count_contacts(model));
    instance->scratch = layout_doubles(&layout, 6 * n + 1 + model->m + 2 * model->input_count + rows +
                                                    model->course_count + fmu_count_indicators(model));
    instance->is_start_set = layout_ints(&layout, 2 * n);
    instance->given = layout_ints(&layout, model->anchored_count);
    return layout.used;
}

/* Rounds up to a multiple of the strictest alignment. */
static size_t rounded_up(size_t size) {
    const size_t unit = 64;
    return (size + unit - 1) / unit * unit;
}

static struct refdyn_options options_of(int is_exchange) {
    struct refdyn_options options = refdyn_fmu.options;
    if (is_exchange) { /* no step is taken: the method with the least memory */
        options = refdyn_options_default(REFDYN_RK54);
        options.stabilise = REFDYN_BAUMGARTE;
    }
    options.balance = 0;
    options.project_start = 1;
    return options;
}

struct fmu_instance *fmu_open(const struct fmu_listener *listener, int is_exchange, int is_logging) {
    struct fmu_instance *instance = calloc(1, sizeof *instance);
    if (instance) {
        instance->listener = *listener;
        instance->is_exchange = is_exchange;
        instance->is_logging = is_logging;
        instance->options = options_of(is_exchange);
        instance->work_size = rounded_up(refdyn_workspace_size(refdyn_fmu.model));
        instance->integrator_size = rounded_up(refdyn_integrator_size(refdyn_fmu.model, &instance->options));
        instance->block_size = lay_out(instance, NULL);
        instance->block = calloc(1, instance->block_size);
    }
    if (instance && instance->block && fmu_reset(instance) == FMU_OK)
        return instance;
    if (!instance || !instance->block)
        listen(listener, FMU_ERROR, (char[]){"out of memory"});
    fmu_close(instance);
    return NULL;
}

void fmu_close(struct fmu_instance *instance) {
    if (!instance)
        return;
    free(instance->block);
    free(instance);
}

/* ---- The start ---- */

enum fmu_status fmu_reset(struct fmu_instance *instance) {
    const struct refdyn_model *model = refdyn_fmu.model;
    memset(instance->block, 0, instance->block_size);
    lay_out(instance, instance->block);
    instance->options = options_of(instance->is_exchange);
    instance->mode = FMU_INSTANTIATED;
    instance->t_first = refdyn_fmu.t_start;
    instance->t_stop = INFINITY;
    instance->is_started = instance->has_events_due = 0;
    instance->integrator = (struct refdyn_integrator){.work = &instance->work};
    fmu_invalidate(instance);
    const int status = refdyn_workspace_init(&instance->work, model, instance->block, instance->work_size);
    if (status)
        return fmu_tell(instance, FMU_ERROR, "%s", refdyn_status_text(status));
    memcpy(instance->work.p, refdyn_fmu.parameters, (size_t)model->parameter_count * sizeof(double));
    memcpy(instance->work.x, refdyn_fmu.inputs, (size_t)model->input_count * sizeof(double));
    memcpy(instance->given, refdyn_fmu.given, (size_t)model->anchored_count * sizeof(int));
    refdyn_prepare(&instance->work);
    return FMU_OK;
}

enum fmu_status fmu_set_experiment(struct fmu_instance *instance, double tolerance, double t_first,
                                   double t_stop) {
    if (!isfinite(t_first) || !(t_stop > t_first))
        return fmu_tell(instance, FMU_ERROR,
                        "the experiment is from %g s to %g s; the stop time must be after the start time",
                        t_first, t_stop);
    const int has_tolerance = tolerance != 0 && !instance->is_exchange && instance->options.tol > 0;
    if (has_tolerance && !(tolerance >= DBL_EPSILON && tolerance < 1))
        return fmu_tell(instance, FMU_ERROR, "tolerance: value %g; must be from %.2g to 1", tolerance,
                        DBL_EPSILON);
    if (has_tolerance)
        instance->options.tol = tolerance;
    instance->t_first = t_first;
    instance->t_stop = t_stop;
    instance->is_stale = 1;
    return FMU_OK;
}

/* The start: values that were set, otherwise exported values, otherwise those that the model computes from
 * parameters. */
static void place_start(struct fmu_instance *instance, double *state) {
    const int n = instance->work.n;
    refdyn_prepare(&instance->work);
    if (refdyn_fmu.start)
        memcpy(state, refdyn_fmu.start, (size_t)(2 * n) * sizeof *state);
    else
        refdyn_initial_state(&instance->work, state, state + n);
    for (int i = 0; i < 2 * n; i++)
        if (instance->is_start_set[i])
            state[i] = instance->start[i];
    refdyn_anchor(&instance->work, instance->t_first, state, state + n, instance->given);
}

/* Returns the coordinate that the projection has moved farthest. */
static int farthest_moved(const struct refdyn_integrator *integrator) {
    int farthest = 0;
    for (int j = 0; j < integrator->work->n; j++)
        if (fabs(integrator->start_moved[j]) > fabs(integrator->start_moved[farthest]))
            farthest = j;
    return farthest;
}

static void warn_of_start(struct fmu_instance *instance) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const int moved = farthest_moved(integrator);
    if (instance->work.m > 0 && integrator->start_is_off)
        fmu_tell(instance, FMU_WARNING,
                 "t = %.9g s: the start was off the rows (largest phi %.3g, largest psi %.3g); it was "
                 "projected onto them",
                 integrator->t, integrator->start.phi, integrator->start.psi);
    if (integrator->start_is_far)
        fmu_tell(instance, FMU_WARNING,
                 "t = %.9g s: the start is far from the rows: projection moved %s by %.4g %s; another state "
                 "may be "
                 "nearer",
                 integrator->t, instance->work.model->coordinates[moved].name, integrator->start_moved[moved],
                 instance->work.model->coordinates[moved].unit);
}

/* Rows without gains would drift with the importer's errors. In p, Baumgarte's alpha and beta are stored as 2
 * alpha and beta^2. */
static void place_gains(struct fmu_instance *instance) {
    const struct refdyn_model *model = instance->work.model;
    double *p = instance->integrator.motion->parameters.own;
    for (int i = 0; i < model->m && model->gains; i++) {
        const int rate = model->gains[2 * i], position = model->gains[2 * i + 1];
        if ((rate >= 0 && p[rate] != 0) || (position >= 0 && p[position] != 0))
            continue;
        if (rate >= 0)
            p[rate] = 2 * default_gain;
        if (position >= 0)
            p[position] = default_gain * default_gain;
    }
}

static enum fmu_status start(struct fmu_instance *instance) {
    const int n = instance->work.n;
    double *state = instance->scratch;
    place_start(instance, state);
    int status = refdyn_integrator_init(&instance->integrator, &instance->work, &instance->options,
                                        instance->block + instance->work_size, instance->integrator_size);
    if (!status)
        status = refdyn_integrator_start(&instance->integrator, instance->t_first, state, state + n);
    if (status)
        return fmu_tell_failure(instance, status);
    refdyn_integrator_until(&instance->integrator, instance->t_stop);
    if (instance->is_exchange)
        place_gains(instance);
    warn_of_start(instance);
    instance->t_from = instance->integrator.t_right;
    instance->t_to = instance->t_next = INFINITY;
    instance->t_seen = instance->t_first;
    for (int i = 0; i < instance->work.model->event_count; i++)
        instance->left_at[i] = -INFINITY;
    for (int k = 0; k < instance->integrator.contact_count; k++)
        instance->since[k] = NAN;
    fmu_tell_contacts(instance);
    instance->is_started = 1;
    instance->is_stale = instance->has_new_values = 0;
    instance->has_events_due = 1;
    instance->filled = 0;
    return FMU_OK;
}

/* ---- States ---- */

void fmu_invalidate(struct fmu_instance *instance) {
    instance->is_stale = 1;
    instance->filled = 0;
}

const double *fmu_motion_parameters(const struct fmu_instance *instance) {
    return instance->integrator.motion->parameters.own;
}

/* Computes the rates of the importer's state, on the present side of time events. */
static int find_rates(struct fmu_instance *instance) {
    struct refdyn_integrator *integrator = &instance->integrator;
    struct refdyn_workspace *work = &instance->work;
    struct refdyn_motion *motion = integrator->motion;
    const int n = work->n;
    integrator->t_right = fmin(fmax(integrator->t, instance->t_from), instance->t_to);
    place_gains(instance);
    refdyn_parameters_enter(&motion->parameters, work);
    int status = refdyn_row_terms(work, integrator->t_right, integrator->q, integrator->qd);
    if (!status)
        status = refdyn_rates(&motion->step.evaluation, integrator->t_right, integrator->q, instance->rates);
    refdyn_parameters_leave(&motion->parameters, work);
    memcpy(integrator->qdd, instance->rates + n, (size_t)n * sizeof(double));
    memcpy(integrator->lambda, instance->rates + 2 * n + 1, (size_t)work->m * sizeof(double));
    return status;
}

enum fmu_status fmu_evaluate(struct fmu_instance *instance) {
    if (!instance->is_stale)
        return FMU_OK;
    if (instance->mode <= FMU_INITIALISING)
        return start(instance);
    instance->filled = 0;
    if (instance->has_new_values) {
        const int renewed = refdyn_integrator_refresh(&instance->integrator);
        if (renewed)
            return fmu_tell_failure(instance, renewed);
        instance->has_new_values = 0;
    }
    const int status = instance->is_exchange ? find_rates(instance) : REFDYN_OK;
    instance->is_stale = status != REFDYN_OK;
    if (status > 0 && instance->is_exchange) /* a shorter step of the importer may succeed */
        return fmu_tell(instance, FMU_DISCARD, "t = %.9g s: %s", instance->integrator.t,
                        refdyn_status_text(status));
    return status ? fmu_tell_failure(instance, status) : FMU_OK;
}

/* ---- Checks of modes and lengths ---- */

struct fmu_instance *fmu_enter(struct fmu_instance *instance, unsigned modes, const char *function) {
    return instance && fmu_allows(instance, modes, function) ? instance : NULL;
}

struct fmu_instance *fmu_enter_exchange(struct fmu_instance *instance, unsigned modes, const char *function) {
    if (!fmu_enter(instance, modes, function))
        return NULL;
    if (instance->is_exchange)
        return instance;
    fmu_tell(instance, FMU_ERROR, "%s belongs to Model Exchange", function);
    return NULL;
}

struct fmu_instance *fmu_enter_steps(struct fmu_instance *instance, unsigned modes, const char *function) {
    if (!fmu_enter(instance, modes, function))
        return NULL;
    if (!instance->is_exchange)
        return instance;
    fmu_tell(instance, FMU_ERROR, "%s belongs to Co-Simulation", function);
    return NULL;
}

int fmu_has_length(struct fmu_instance *instance, size_t count, int wanted) {
    if (count == (size_t)wanted)
        return 1;
    fmu_tell(instance, FMU_ERROR, "an array of %lu numbers; must have %d", (unsigned long)count, wanted);
    return 0;
}

enum fmu_status fmu_leave_initialisation(struct fmu_instance *instance) {
    const enum fmu_status status = fmu_evaluate(instance);
    if (status == FMU_OK)
        instance->mode = instance->is_exchange ? FMU_EVENT_MODE : FMU_STEP_MODE;
    return status;
}

enum fmu_status fmu_get_states(struct fmu_instance *instance, double *states) {
    const enum fmu_status status = instance->mode == FMU_INITIALISING ? fmu_evaluate(instance) : FMU_OK;
    const int joints = refdyn_joint_count(instance->work.model);
    if (status == FMU_OK)
        memcpy(states, instance->integrator.q, (size_t)joints * sizeof *states);
    if (status == FMU_OK)
        memcpy(states + joints, instance->integrator.qd, (size_t)instance->work.n * sizeof *states);
    return status;
}

enum fmu_status fmu_refuse(struct fmu_instance *instance, const char *function) {
    if (fmu_enter(instance, FMU_ALIVE, function))
        fmu_tell(instance, FMU_ERROR, "%s: this FMU does not support it", function);
    return FMU_ERROR;
}

enum fmu_status fmu_refuse_type(struct fmu_instance *instance, size_t count, const char *function) {
    if (!fmu_enter(instance, FMU_ALIVE, function))
        return FMU_ERROR;
    return count == 0
               ? FMU_OK
               : fmu_tell(instance, FMU_ERROR, "%s: all variables of this FMU are real numbers", function);
}

/* ---- Saved states: copies of an instance's struct and its block ---- */

struct fmu_saved {
    struct fmu_instance instance; /* the copy; its pointers lead to the instance's block */
    const struct fmu_instance *of;
    char *block;
};

/* Pointers of the state must lead to the instance's memory. An instance that was opened in the memory of a
 * closed one may use its saved states. */
static int fits(const struct fmu_saved *saved, const struct fmu_instance *instance) {
    return saved && saved->of == instance && saved->instance.block == instance->block &&
           saved->instance.block_size == instance->block_size &&
           saved->instance.is_exchange == instance->is_exchange;
}

enum fmu_status fmu_save(struct fmu_instance *instance, struct fmu_saved **saved) {
    struct fmu_saved *copy = *saved ? *saved : calloc(1, sizeof *copy);
    if (copy && !copy->block)
        copy->block = malloc(instance->block_size);
    if (!copy || !copy->block) {
        free(copy);
        *saved = NULL;
        return fmu_tell(instance, FMU_ERROR, "out of memory");
    }
    copy->of = instance;
    copy->instance = *instance;
    memcpy(copy->block, instance->block, instance->block_size);
    *saved = copy;
    return FMU_OK;
}

enum fmu_status fmu_restore(struct fmu_instance *instance, const struct fmu_saved *saved) {
    if (!fits(saved, instance))
        return fmu_tell(instance, FMU_ERROR, "the state does not belong to this instance");
    const struct fmu_listener listener = instance->listener;
    const int is_logging = instance->is_logging;
    *instance = saved->instance;
    instance->listener = listener;
    instance->is_logging = is_logging;
    memcpy(instance->block, saved->block, instance->block_size);
    return FMU_OK;
}

void fmu_forget(struct fmu_saved *saved) {
    if (saved)
        free(saved->block);
    free(saved);
}
