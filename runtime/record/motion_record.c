/* One motion from its start to its end, output by output, with samples of inputs, conditions and events. */
#include "runtime/record/record.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A multiple of the time between outputs that is this near to the end is the end, as a part of that time. */
static const double end_slack = 1e-9;
/* Rounding of the times of outputs and events, relative to them. */
static const double rounding = 64 * DBL_EPSILON;

enum {
    DEFAULT_OUTPUTS = 200,
    STEPS_PER_LOOK = 64 /* steps between questions to the watch */
};

double record_distance(double span, double every) {
    return every > 0 ? every : span / DEFAULT_OUTPUTS;
}

long record_count_outputs(double span, double every) {
    return (long)fmax(ceil(span / every - end_slack), 1) + 1;
}

/* The number of parameters, derived ones included, and inputs; *parameters without inputs. */
static size_t count_values(const struct refdyn_model *model, size_t *parameters) {
    *parameters = (size_t)model->parameter_count + (size_t)model->derived_count;
    return *parameters + (size_t)model->input_count;
}

static void keep_values(struct record_motion *motion, struct record_memory memory) {
    const struct refdyn_workspace *work = motion->work;
    size_t parameters;
    const size_t count = count_values(work->model, &parameters);
    if (work->model->change_count == 0)
        return;
    motion->values = memory.get(memory.context, count * sizeof *motion->values);
    memcpy(motion->values, work->p, parameters * sizeof *work->p);
    memcpy(motion->values + parameters, work->x, (count - parameters) * sizeof *work->x);
}

void record_restore(const struct record_motion *motion) {
    if (!motion->values) /* no event sets a value */
        return;
    struct refdyn_workspace *work = motion->work;
    size_t parameters;
    const size_t count = count_values(work->model, &parameters);
    memcpy(work->p, motion->values, parameters * sizeof *work->p);
    memcpy(work->x, motion->values + parameters, (count - parameters) * sizeof *work->x);
}

void record_print_between(const struct record_motion *motion, FILE *out) {
    if (!isnan(motion->t_between))
        fprintf(
            out,
            "inputs       change between rows, first at t = %.9g s; to repeat the motion by --inputs, choose "
            "an --every with rows at these times\n",
            motion->t_between);
}

/* Sets the inputs of the sample at t. */
static void set_sample(struct record_motion *motion, double t) {
    motion->next_sample =
        motion->samples ? refdyn_samples_set(motion->samples, t, motion->work->x) : INFINITY;
}

int record_start(struct record_motion *motion, struct record_memory memory) {
    struct refdyn_integrator *integrator = motion->integrator;
    const double span = motion->until - motion->from;
    motion->every = record_distance(span, motion->every);
    motion->outputs = isfinite(span) ? record_count_outputs(span, motion->every) : 0;
    motion->t_between = NAN;
    record_events_start(&motion->events, memory, motion->work->model);
    set_sample(motion, motion->from);
    keep_values(motion, memory);
    const int status = refdyn_integrator_start(integrator, motion->from, motion->q, motion->qd);
    refdyn_integrator_until(integrator, motion->until);
    refdyn_integrator_limit(integrator, motion->next_sample);
    return status == REFDYN_OK && integrator->options.balance
               ? refdyn_energy_start(&motion->energy, integrator)
               : status;
}

bool record_is_stopped(const struct record_motion *motion) {
    return motion->events.has_ended || (motion->stops && motion->stops->reached);
}

/* Sets the inputs of the sample at the integrator's time and evaluates the state again. */
static int take_sample(struct record_motion *motion) {
    struct refdyn_integrator *integrator = motion->integrator;
    set_sample(motion, integrator->t);
    refdyn_integrator_limit(integrator, motion->next_sample);
    const int status = refdyn_integrator_refresh(integrator);
    if (status == REFDYN_OK && motion->stops)
        record_stops_hold(motion->stops);
    return status;
}

/* Time of output number i, 0 to outputs - 1: a multiple of `every`, or the end. */
static double output_time(const struct record_motion *motion, long i) {
    return i >= motion->outputs - 1 ? motion->until : motion->from + (double)i * motion->every;
}

static bool sets_input(const struct refdyn_model *model, const struct refdyn_event *event) {
    bool sets = false;
    for (int k = event->first_change; k < event->first_change + event->change_count; k++)
        sets |= model->changes[k].what == REFDYN_CHANGED_INPUT;
    return sets;
}

static void note_inputs(struct record_motion *motion) {
    const struct refdyn_integrator *integrator = motion->integrator;
    const struct refdyn_model *model = motion->work->model;
    const double t = integrator->t, row = output_time(motion, lround((t - motion->from) / motion->every));
    if (!isnan(motion->t_between) || fabs(t - row) <= rounding * (fabs(t) + motion->every))
        return;
    for (int k = 0; k < integrator->event_count; k++)
        if (sets_input(model, &model->events[integrator->event[k]]))
            motion->t_between = t;
}

/* After steps from `before`: looks for a condition that was reached on the way, and otherwise records the
 * events at which they have stopped. */
static int look_back(struct record_motion *motion, double before, int status) {
    const struct refdyn_integrator *integrator = motion->integrator;
    const double t = integrator->t;
    int stopped = REFDYN_OK;
    if (motion->stops && (status == REFDYN_OK || status == REFDYN_EVENT_ENDS))
        stopped = record_stops_meet(motion->stops, before);
    const bool has_ended_step = integrator->t >= integrator->t_end || record_is_stopped(motion);
    if (motion->limits && has_ended_step && stopped == REFDYN_OK &&
        (status == REFDYN_OK || status == REFDYN_EVENT_ENDS))
        stopped = record_limits_pass(motion->limits);
    if (motion->integral && has_ended_step && stopped == REFDYN_OK &&
        (status == REFDYN_OK || status == REFDYN_EVENT_ENDS))
        stopped = record_integral_pass(motion->integral);
    if (stopped != REFDYN_OK || integrator->t < t)
        return stopped;
    if (motion->outputs > 0)
        note_inputs(motion);
    return record_events_take(&motion->events, integrator, status);
}

/* Takes some steps towards `goal`; with conditions or limits, only to the end of the next step. */
static int go_on(struct record_motion *motion, double goal) {
    struct refdyn_integrator *integrator = motion->integrator;
    const double before = integrator->t, sample = motion->next_sample;
    double bound = fmin(goal, sample);
    const bool is_watched = motion->stops || motion->limits || motion->integral;
    if (is_watched && before < integrator->t_end)
        bound = fmin(bound, integrator->t_end);
    const long steps = is_watched ? 1 : STEPS_PER_LOOK;
    int status = motion->step ? motion->step(motion->stepper, bound, steps)
                              : refdyn_integrator_step(integrator, bound, steps);
    status = look_back(motion, before, status);
    if (status == REFDYN_OK && integrator->t == sample && !record_is_stopped(motion))
        status = take_sample(motion);
    return status;
}

int record_advance(struct record_motion *motion, double goal, const struct record_watch *watch) {
    int status = REFDYN_OK;
    while (status == REFDYN_OK && motion->integrator->t < goal && !record_is_stopped(motion)) {
        status = go_on(motion, goal);
        if (status == REFDYN_OK)
            status = watch->ask(watch->context, motion);
    }
    return status;
}

int record_to(struct record_motion *motion, long i, const struct record_watch *watch) {
    const int status = record_advance(motion, output_time(motion, i), watch);
    return status == REFDYN_OK ? refdyn_energy_add(&motion->energy, motion->integrator) : status;
}
