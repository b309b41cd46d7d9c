/*
 * One case of a batch, from its start to its end, and samples of inputs.
 *
 * The start of a case is computed in this order: parameters and inputs; the model's initial state for them;
 * start values and rates of the batch, then of the case; its equilibrium; anchored parameters.
 */
#include "runtime/batch/batch_private.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/core/methods/methods.h"

enum { TURNS_BETWEEN_QUESTIONS = 64 }; /* steps between calls that ask whether the batch should end */

/* ---- Memory ---- */

static size_t aligned(size_t size) {
    const size_t unit = sizeof(double) * 2;
    return (size + unit - 1) / unit * unit;
}

int refdyn_worker_start(struct worker *worker, const struct refdyn_batch *batch, int room) {
    const struct refdyn_model *model = batch->model;
    *worker = (struct worker){.batch = batch, .now = {.room = room, .integrator = &worker->integrator}};
    const size_t work = aligned(refdyn_workspace_size(model)),
                 integrator = aligned(refdyn_integrator_size(model, &batch->options)),
                 start = aligned(2 * (size_t)model->n * sizeof(double)),
                 given = aligned((size_t)model->anchored_count * sizeof(int));
    worker->statics_size = batch->from_statics ? refdyn_statics_size(model) : 0;
    char *memory = malloc(work + integrator + start + given + aligned(worker->statics_size) + 1);
    worker->memory = memory;
    if (!memory)
        return REFDYN_BAD_MEMORY;
    worker->q = (double *)(void *)(memory + work + integrator);
    worker->qd = worker->q + model->n;
    worker->given = (int *)(void *)(memory + work + integrator + start);
    worker->statics = memory + work + integrator + start + given;
    const int status = refdyn_workspace_init(&worker->work, model, memory, work);
    return status ? status
                  : refdyn_integrator_init(&worker->integrator, &worker->work, &batch->options, memory + work,
                                           integrator);
}

void refdyn_worker_release(struct worker *worker) {
    free(worker->memory);
    worker->memory = NULL;
}

/* ---- The start of a case ---- */

static double value_of(const struct worker *worker, const struct refdyn_batch_column *column) {
    const struct refdyn_copies *copies = worker->batch->copies;
    return column->values[copies ? copies->number : worker->now.number];
}

/* The end of the motion: that of all cases, or its own. */
static double end_of(const struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const struct refdyn_copies *copies = batch->copies;
    const long number = worker->now.number;
    const double end =
        batch->ends ? batch->ends[copies ? copies->number : number] : batch->times[batch->time_count - 1];
    return copies ? end + copies->shifts[number].end_change : end;
}

/* The time of output number i + 1: it keeps its fraction of the motion. */
static double output_time(const struct worker *worker, int i) {
    const struct refdyn_batch *batch = worker->batch;
    const double t = batch->times[i], last = batch->times[batch->time_count - 1];
    if (worker->end == last || i == batch->time_count - 1)
        return i == batch->time_count - 1 ? worker->end : t;
    return batch->t + (t - batch->t) / (last - batch->t) * (worker->end - batch->t);
}

/* Adds the copy's change if it is of this kind. */
static void shift(const struct worker *worker, enum refdyn_varied what, double *values) {
    const struct refdyn_copies *copies = worker->batch->copies;
    if (copies && copies->shifts[worker->now.number].what == what)
        values[copies->shifts[worker->now.number].place] += copies->shifts[worker->now.number].change;
}

/* Does the start of the motion set the value that the copy changes: an anchored parameter that is not given,
 * or a coordinate that the equilibrium moves? */
static int is_shifted_late(const struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const struct refdyn_model *model = batch->model;
    const struct shift *shift = batch->copies ? &batch->copies->shifts[worker->now.number] : NULL;
    for (int j = 0; shift && shift->what == REFDYN_VARIED_PARAMETER && j < model->anchored_count; j++)
        if (model->anchored[j] == shift->place)
            return !worker->given[j];
    if (!shift || shift->what != REFDYN_VARIED_COORDINATE)
        return 0;
    int is_late = batch->from_statics;
    for (int k = 0; k < batch->held_count; k++)
        is_late &= batch->held[k] != shift->place;
    return is_late;
}

/* Does the case leave this anchored parameter to the start of its motion? */
static int is_left_to_start(const struct worker *worker, const struct refdyn_batch_column *column) {
    return column->what == REFDYN_VARIED_PARAMETER && isnan(value_of(worker, column)) &&
           refdyn_find_anchored(worker->batch->model, column->place) >= 0;
}

/* Copies the columns of one kind to their places. */
static void set_columns(const struct worker *worker, enum refdyn_varied what, double *values) {
    const struct refdyn_batch *batch = worker->batch;
    for (int i = 0; i < batch->column_count; i++)
        if (batch->columns[i].what == what && !is_left_to_start(worker, &batch->columns[i]))
            values[batch->columns[i].place] = value_of(worker, &batch->columns[i]);
}

static void set_all(double *values, int count, const double *common, const struct refdyn_name *names) {
    for (int i = 0; i < count; i++)
        values[i] = common ? common[i] : names[i].value;
}

/* Marks anchored parameters that a column sets as given. */
static void mark_given(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const struct refdyn_model *model = batch->model;
    for (int j = 0; j < model->anchored_count; j++) {
        worker->given[j] = batch->given && batch->given[j];
        for (int i = 0; i < batch->column_count; i++)
            worker->given[j] |= batch->columns[i].what == REFDYN_VARIED_PARAMETER &&
                                batch->columns[i].place == model->anchored[j] &&
                                !is_left_to_start(worker, &batch->columns[i]);
    }
}

static void set_values(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const struct refdyn_model *model = batch->model;
    struct refdyn_workspace *work = &worker->work;
    set_all(work->p, model->parameter_count, batch->p, model->parameters);
    set_all(work->x, model->input_count, batch->x, model->inputs);
    set_columns(worker, REFDYN_VARIED_PARAMETER, work->p);
    set_columns(worker, REFDYN_VARIED_INPUT, work->x);
    worker->samples = NULL;
    for (int i = 0; i < batch->column_count; i++)
        if (batch->columns[i].what == REFDYN_VARIED_SAMPLES)
            worker->samples = batch->samples + (int)value_of(worker, &batch->columns[i]);
    mark_given(worker);
    shift(worker, REFDYN_VARIED_INPUT, work->x);
    if (!is_shifted_late(worker))
        shift(worker, REFDYN_VARIED_PARAMETER, work->p);
    refdyn_prepare(work);
}

static void set_state(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const size_t bytes = (size_t)batch->model->n * sizeof(double);
    refdyn_initial_state(&worker->work, worker->q, worker->qd);
    refdyn_anchor(&worker->work, 0, worker->q, worker->qd, worker->given);
    if (batch->q)
        memcpy(worker->q, batch->q, bytes);
    if (batch->qd)
        memcpy(worker->qd, batch->qd, bytes);
    set_columns(worker, REFDYN_VARIED_COORDINATE, worker->q);
    if (!is_shifted_late(worker))
        shift(worker, REFDYN_VARIED_COORDINATE, worker->q);
}

/* Finds the equilibrium; the rates of the case are those with which it leaves the equilibrium. */
static int find_equilibrium(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const struct refdyn_statics_options defaults = refdyn_statics_default();
    struct refdyn_statics_result result;
    refdyn_enter_statics(batch->model, worker->q, worker->qd);
    const int status =
        refdyn_statics(&worker->work, batch->statics ? batch->statics : &defaults, batch->held,
                       batch->held_count, worker->q, NULL, &result, worker->statics, worker->statics_size);
    refdyn_leave_statics(batch->model, worker->q, worker->qd);
    worker->result.unstable = result.unstable;
    worker->result.is_beyond = !result.is_followed;
    return status;
}

/* Samples set all their inputs again; the change of a copy is added to them. */
static void meet_sample(struct worker *worker, double t) {
    const struct refdyn_samples *samples = worker->samples;
    const struct refdyn_copies *copies = worker->batch->copies;
    worker->next_sample = samples ? refdyn_samples_set(samples, t, worker->work.x) : INFINITY;
    for (int i = 0; samples && copies && i < samples->width; i++)
        if (samples->place[i] == copies->shifts[worker->now.number].place)
            shift(worker, REFDYN_VARIED_INPUT, worker->work.x);
}

/* The integrator has started: a copy repeats the steps of its motion. */
static void join_copies(struct worker *worker) {
    const struct refdyn_copies *copies = worker->batch->copies;
    if (copies && copies->pattern)
        refdyn_repetition_start(worker->integrator.motion, copies->pattern,
                                worker->end - copies->shifts[worker->now.number].end_change);
    worker->integrator.motion->watch = copies ? copies->watch : NULL;
    if (copies && copies->watch)
        copies->watch->note(copies->watch->context, worker->integrator.motion, NULL);
}

/* Prepares everything before the first step. */
static int begin(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    struct refdyn_integrator *integrator = &worker->integrator;
    int status = REFDYN_OK;
    set_values(worker);
    set_state(worker);
    meet_sample(worker, batch->t);
    worker->result.stage = REFDYN_AT_STATICS;
    if (batch->from_statics)
        status = find_equilibrium(worker);
    memcpy(integrator->q, worker->q, 2 * (size_t)batch->model->n * sizeof(double));
    if (status)
        return status;
    worker->result.stage = REFDYN_AT_START;
    set_columns(worker, REFDYN_VARIED_RATE, worker->qd);
    if (is_shifted_late(worker))
        shift(worker, REFDYN_VARIED_COORDINATE, worker->q);
    shift(worker, REFDYN_VARIED_RATE, worker->qd);
    refdyn_anchor(&worker->work, batch->t, worker->q, worker->qd, worker->given);
    if (is_shifted_late(worker))
        shift(worker, REFDYN_VARIED_PARAMETER, worker->work.p);
    status = refdyn_integrator_start(integrator, batch->t, worker->q, worker->qd);
    refdyn_integrator_until(integrator, worker->end);
    join_copies(worker);
    refdyn_integrator_limit(integrator, worker->next_sample);
    return status;
}

/* ---- Its motion ---- */

/* Sets the inputs of the sample that begins here. */
static int take_sample(struct worker *worker) {
    struct refdyn_integrator *integrator = &worker->integrator;
    meet_sample(worker, integrator->t);
    refdyn_integrator_limit(integrator, worker->next_sample);
    return refdyn_integrator_refresh(integrator);
}

static int is_left(const struct refdyn_batch *batch) {
    return batch->stop && batch->stop(batch->context);
}

static int see_step(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    return batch->step ? batch->step(batch->context, &worker->now) : REFDYN_OK;
}

static int show(struct worker *worker, int number) {
    const struct refdyn_batch *batch = worker->batch;
    return batch->output && batch->output(batch->context, &worker->now, number);
}

/* Copies an output into the arrays of the batch. */
static void keep(const struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    const size_t size = 2 * (size_t)batch->model->n;
    if (batch->states)
        memcpy(batch->states + (size_t)worker->now.index * size, worker->integrator.q, size * sizeof(double));
    if (batch->statuses)
        batch->statuses[worker->now.index] = worker->result.status;
}

enum turn refdyn_worker_end(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    struct refdyn_batch_result *result = &worker->result;
    result->t = worker->integrator.t;
    result->steps_alone = worker->integrator.statistics.steps - worker->steps_in_lanes;
    keep(worker);
    return batch->end && batch->end(batch->context, &worker->now, result) ? TURN_LEFT : TURN_ENDED;
}

enum turn refdyn_worker_begin(struct worker *worker, long index) {
    const struct refdyn_batch *batch = worker->batch;
    if (is_left(batch))
        return TURN_LEFT;
    worker->now.index = index;
    worker->now.number = batch->numbers ? batch->numbers[index] : index;
    worker->end = end_of(worker);
    worker->integrator.t = batch->t;
    worker->integrator.statistics =
        (struct refdyn_statistics){.steps = 0}; /* not those of the previous case */
    worker->work.fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
    worker->result = (struct refdyn_batch_result){.stage = REFDYN_AT_START};
    worker->attempt.is_over = 1;
    worker->is_new = 1;
    worker->steps_in_lanes = 0;
    worker->output = worker->turns = 0;
    worker->result.status = begin(worker);
    if (worker->result.status)
        return TURN_ENDED;
    worker->result.stage = REFDYN_AT_STEPS;
    worker->result.status = see_step(worker);
    if (worker->result.status)
        return TURN_ENDED;
    return show(worker, 0) ? TURN_LEFT : refdyn_worker_go(worker);
}

/* Returns the time that the motion is to reach next. With a callback for steps, the motion reaches the end of
 * each step before it attempts another. */
static double goal(const struct worker *worker) {
    const double t = fmin(output_time(worker, worker->output), worker->next_sample),
                 end = refdyn_step_seen_end(&worker->integrator.motion->step);
    return worker->batch->step && worker->attempt.is_over && worker->integrator.t < end ? fmin(t, end) : t;
}

/* Takes steps to the goal, or one step. Returns HALTED at a step that lanes can take. */
static int take_steps(struct worker *worker) {
    struct refdyn_integrator *integrator = &worker->integrator;
    const long most = worker->batch->step ? 1 : LONG_MAX;
    const double t = goal(worker);
    const int status = worker->batch->lanes ? refdyn_integrator_halt(integrator, t, most, &worker->attempt)
                                            : refdyn_integrator_step(integrator, t, most);
    const int seen = !status || status == REFDYN_EVENT_ENDS ? see_step(worker) : REFDYN_OK;
    return status ? status : seen;
}

/* Handles the time that was reached: a sample, an output, or both. */
static int arrive(struct worker *worker, int *left) {
    int status = REFDYN_OK;
    if (worker->integrator.t == worker->next_sample) {
        status = take_sample(worker);
        worker->is_new = 1;
    }
    if (!status && worker->integrator.t == output_time(worker, worker->output))
        *left = show(worker, ++worker->output);
    return status;
}

enum turn refdyn_worker_go(struct worker *worker) {
    const struct refdyn_batch *batch = worker->batch;
    int status = REFDYN_OK, left = 0;
    while (!status && !left && worker->output < batch->time_count) {
        if (++worker->turns % TURNS_BETWEEN_QUESTIONS == 0 && is_left(batch))
            return TURN_LEFT;
        status = take_steps(worker);
        if (status == REFDYN_HALTED)
            return TURN_HALTED;
        if (!status)
            status = arrive(worker, &left);
    }
    worker->result.status = status;
    return left ? TURN_LEFT : TURN_ENDED;
}

void refdyn_worker_judge(struct worker *worker, int taken) {
    const struct refdyn_statistics *statistics = &worker->integrator.motion->statistics;
    const long before = statistics->steps;
    refdyn_integrator_judge(&worker->integrator, &worker->attempt, taken);
    worker->steps_in_lanes += statistics->steps - before;
}

/* ---- Samples of inputs ---- */

static const double *row_of(const struct refdyn_samples *samples, int number) {
    return samples->rows + (long)number * (samples->width + 1);
}

/* Returns the number of samples at or before t, by bisection. */
static int count_until(const struct refdyn_samples *samples, double t) {
    int low = 0, high = samples->count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (*row_of(samples, middle) <= t)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

double refdyn_samples_set(const struct refdyn_samples *samples, double t, double *x) {
    if (!samples || samples->count < 1 || samples->width < 0 || !samples->rows || !samples->place || !x)
        return INFINITY;
    const int past = count_until(samples, t);
    const int next =
        past > 0 ? past
                 : 1; /* the first value is also valid before its time, so that nothing changes there */
    const double *row = row_of(samples, next - 1);
    for (int i = 0; i < samples->width; i++)
        x[samples->place[i]] = row[1 + i];
    return next < samples->count ? *row_of(samples, next) : INFINITY;
}
