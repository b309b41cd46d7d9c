/*
 * The cases of a batch on several threads.
 *
 * The queue is a counter that all threads increment. Each case has its own workspace and integrator. A thread
 * computes as many cases at a time as there are lanes. Each case halts at a step that lanes can take; then
 * the steps of all halted cases are taken together.
 */
#define _POSIX_C_SOURCE 200809L
#include "runtime/core/base/core.h"
#include "runtime/batch/batch_private.h"
#include "refdyn_batch.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct queue {
    long count;
    atomic_long next, ended;
    atomic_int is_left; /* a callback has ended the batch */
};

enum { LANES_MOST = 8 };

struct thread {
    struct queue *queue;
    struct worker workers[LANES_MOST];
    struct lanes lanes; /* without lanes there is one worker */
    int width;
    double clock; /* processor time already assigned to cases [s] */
    pthread_t id;
    int is_running;
};

/* ---- Processor time ---- */

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Processor time of the thread since the last call. Reading the clock takes a microsecond, as long as a short
 * step, so it is read only where cases begin and end, and where one computes alone. */
static double time_passed(struct thread *thread) {
    const double now = seconds(), passed = now - thread->clock;
    thread->clock = now;
    return passed;
}

/* The cases in lanes have computed side by side and get equal shares. */
static void share_time(struct thread *thread) {
    int count = 0;
    for (int i = 0; i < thread->width; i++)
        count += thread->workers[i].is_busy;
    const double share = time_passed(thread) / count;
    for (int i = 0; i < thread->width; i++)
        if (thread->workers[i].is_busy)
            thread->workers[i].result.cpu_s += share;
}

/* ---- On a thread ---- */

static int has_cases(struct queue *queue) {
    return !atomic_load_explicit(&queue->is_left, memory_order_relaxed) &&
           atomic_load_explicit(&queue->next, memory_order_relaxed) < queue->count;
}

/* Takes the next case from the queue; -1: none. */
static long next_case(struct queue *queue) {
    const long index = atomic_fetch_add_explicit(&queue->next, 1, memory_order_relaxed);
    return index < queue->count ? index : -1;
}

static void judge(struct thread *thread, struct worker *worker, int taken) {
    if (taken == REFDYN_LEFT_TO_MOTION)
        refdyn_lanes_forget(&thread->lanes, worker->integrator.motion, (int)(worker - thread->workers));
    refdyn_worker_judge(worker, taken);
}

/* Returns whether the case has halted at a step that lanes can take. */
static int waits_for_lanes(const struct thread *thread, const struct worker *worker, enum turn turn) {
    return turn == TURN_HALTED && refdyn_lanes_can_take(&thread->lanes, worker->integrator.motion);
}

/* The motion takes steps that lanes cannot take itself. It continues alone until its next step can be taken
 * in lanes, so that its numbers stay in the caches; the time is its own. */
static enum turn go_alone(struct thread *thread, struct worker *worker, enum turn turn) {
    while (turn == TURN_HALTED && !waits_for_lanes(thread, worker, turn)) {
        judge(thread, worker, REFDYN_LEFT_TO_MOTION);
        turn = refdyn_worker_go(worker);
    }
    worker->result.cpu_s += time_passed(thread);
    return turn;
}

static enum turn go_on(struct thread *thread, struct worker *worker) {
    const enum turn turn = refdyn_worker_go(worker);
    if (waits_for_lanes(thread, worker, turn))
        return turn;
    share_time(thread);
    return turn == TURN_HALTED ? go_alone(thread, worker, turn) : turn;
}

/* Returns whether a worker has memory. The first one always has; the others allocate it with their first
 * case, never while a motion continues alone. A lane without memory stays idle. */
static int is_ready(const struct thread *thread, struct worker *worker) {
    const struct worker *first = thread->workers;
    const int lane = (int)(worker - first);
    return worker->memory || refdyn_worker_start(worker, first->batch, first->now.room + lane) == REFDYN_OK;
}

/* The time since the previous case was spent in a callback and belongs to no case. */
static enum turn begin_next(struct thread *thread, struct worker *worker) {
    struct queue *queue = thread->queue;
    const long index = has_cases(queue) && is_ready(thread, worker) ? next_case(queue) : -1;
    worker->is_busy = index >= 0;
    if (index < 0)
        return TURN_LEFT;
    time_passed(thread);
    return go_alone(thread, worker, refdyn_worker_begin(worker, index));
}

static enum turn end_case(struct thread *thread, struct worker *worker) {
    const enum turn turn = refdyn_worker_end(worker);
    if (turn == TURN_ENDED)
        atomic_fetch_add_explicit(&thread->queue->ended, 1, memory_order_relaxed);
    return turn;
}

/* Computes cases on this worker until one halts. Returns 0 if no cases remain. */
static int bring_to_halt(struct thread *thread, struct worker *worker) {
    enum turn turn = worker->is_busy ? go_on(thread, worker) : begin_next(thread, worker);
    while (turn == TURN_ENDED) {
        turn = end_case(thread, worker);
        if (turn == TURN_ENDED)
            turn = begin_next(thread, worker);
    }
    if (turn == TURN_LEFT && worker->is_busy)
        atomic_store_explicit(&thread->queue->is_left, 1, memory_order_relaxed);
    return turn == TURN_HALTED;
}

static struct lane_step step_of(struct worker *worker) {
    struct refdyn_attempt *attempt = &worker->attempt;
    struct refdyn_motion *motion = worker->integrator.motion;
    const struct lane_step step = {.motion = motion,
                                   .attempt = attempt,
                                   .x = worker->work.x,
                                   .is_new = worker->is_new,
                                   .needs_stages = attempt->ahead.t_out < attempt->t_new ||
                                                   motion->state_events.count > 0 || worker->batch->step};
    worker->is_new = 0;
    return step;
}

/* Takes the steps of all waiting cases that use one method, side by side. */
static void take_steps_of(struct thread *thread, const struct refdyn_method_definition *method, int *waits) {
    struct lane_step steps[LANES_MOST] = {{.motion = NULL}};
    for (int i = 0; i < thread->width; i++)
        if (waits[i] && thread->workers[i].integrator.motion->step.method == method)
            steps[i] = step_of(&thread->workers[i]);
    refdyn_lanes_take(&thread->lanes, steps);
    for (int i = 0; i < thread->width; i++)
        if (steps[i].motion) {
            judge(thread, &thread->workers[i], steps[i].status);
            waits[i] = 0;
        }
}

/* Takes the steps of all halted cases, method by method. */
static void take_steps(struct thread *thread, int *waits) {
    for (int i = 0; i < thread->width; i++)
        if (waits[i])
            take_steps_of(thread, thread->workers[i].integrator.motion->step.method, waits);
}

static void *run_cases(void *argument) {
    struct thread *thread = argument;
    int waits[LANES_MOST], count;
    do {
        count = 0;
        for (int i = 0; i < thread->width; i++) {
            waits[i] = bring_to_halt(thread, &thread->workers[i]);
            count += waits[i];
        }
        if (atomic_load_explicit(&thread->queue->is_left, memory_order_relaxed))
            break;
        take_steps(thread, waits);
    } while (count > 0);
    return NULL;
}

/* ---- Checks of the batch ---- */

static int has_place(const struct refdyn_batch *batch, const struct refdyn_batch_column *column) {
    const struct refdyn_model *model = batch->model;
    if (!column->values && batch->count > 0)
        return 0;
    switch (column->what) {
    case REFDYN_VARIED_PARAMETER:
        return column->place >= 0 && column->place < model->parameter_count;
    case REFDYN_VARIED_INPUT:
        return column->place >= 0 && column->place < model->input_count;
    case REFDYN_VARIED_COORDINATE:
    case REFDYN_VARIED_RATE:
        return column->place >= 0 && column->place < model->n;
    case REFDYN_VARIED_SAMPLES:
        return 1;
    }
    return 0;
}

/* Returns whether all samples have values, for inputs of the model. */
static int are_samples(const struct refdyn_batch *batch) {
    for (int i = 0; i < batch->sample_count; i++) {
        const struct refdyn_samples *samples = &batch->samples[i];
        if (!batch->samples || samples->count < 1 || !samples->rows || samples->width < 0 ||
            (samples->width > 0 && !samples->place))
            return 0;
        for (int k = 0; k < samples->width; k++)
            if (samples->place[k] < 0 || samples->place[k] >= batch->model->input_count)
                return 0;
    }
    return 1;
}

static int has_samples(const struct refdyn_batch *batch, const struct refdyn_batch_column *column) {
    if (column->what == REFDYN_VARIED_SAMPLES && !are_samples(batch))
        return 0;
    for (long i = 0; i < batch->count && column->what == REFDYN_VARIED_SAMPLES; i++) {
        const long one = batch->copies ? batch->copies->number : batch->numbers ? batch->numbers[i] : i;
        const double number = column->values[one];
        if (!(number >= 0 && number < batch->sample_count && number == floor(number)))
            return 0;
    }
    return 1;
}

static int are_times(const struct refdyn_batch *batch) {
    double before = batch->t;
    if (batch->time_count < 1 || !batch->times)
        return 0;
    for (int i = 0; i < batch->time_count; before = batch->times[i++])
        if (!(batch->times[i] > before && isfinite(batch->times[i])))
            return 0;
    for (long i = 0; batch->ends && i < batch->count && !batch->copies; i++) {
        const double end = batch->ends[batch->numbers ? batch->numbers[i] : i];
        if (!(end > batch->t && isfinite(end)))
            return 0;
    }
    return isfinite(batch->t);
}

static int is_valid(const struct refdyn_batch *batch) {
    if (batch->threads < 1 || batch->count < 0 || !are_times(batch))
        return 0;
    if (batch->lanes && batch->lanes->interface_version == REFDYN_LANES_VERSION &&
        batch->lanes->model != batch->model)
        return 0;
    if (batch->column_count > 0 && !batch->columns)
        return 0;
    for (long i = 0; batch->numbers && i < batch->count; i++)
        if (batch->numbers[i] < 0)
            return 0;
    for (int i = 0; i < batch->column_count; i++)
        if (!has_place(batch, &batch->columns[i]) || !has_samples(batch, &batch->columns[i]))
            return 0;
    return 1;
}

/* ---- Threads ---- */

/* The caller's thread is the first of them. */
static void run_threads(struct thread *threads, int count) {
    for (int i = 1; i < count; i++)
        threads[i].is_running = pthread_create(&threads[i].id, NULL, run_cases, &threads[i]) == 0;
    run_cases(&threads[0]);
    for (int i = 1; i < count; i++)
        if (threads[i].is_running)
            pthread_join(threads[i].id, NULL);
}

static int start_thread(struct thread *thread, int number, const struct refdyn_batch *batch,
                        struct queue *queue) {
    int status = REFDYN_OK;
    thread->queue = queue;
    if (batch->lanes)
        status = refdyn_lanes_start(&thread->lanes, batch->lanes);
    if (status)
        return status;
    thread->width = batch->lanes ? batch->lanes->width : 1;
    return refdyn_worker_start(&thread->workers[0], batch, number * thread->width);
}

static void release_thread(struct thread *thread) {
    for (int i = 0; i < thread->width; i++)
        refdyn_worker_release(&thread->workers[i]);
    refdyn_lanes_release(&thread->lanes);
}

int refdyn_batch_widest(void) {
    return refdyn_lanes_widest();
}

int refdyn_batch_run(const struct refdyn_batch *batch, long *ended) {
    struct queue queue = {0};
    if (ended)
        *ended = 0;
    int status = batch ? refdyn_model_status(batch->model) : REFDYN_BAD_MEMORY;
    if (status)
        return status;
    queue.count = batch->count;
    if (!is_valid(batch))
        return REFDYN_BAD_OPTION;
    /* a thread without a case would compute nothing */
    const int count = batch->threads <= batch->count ? batch->threads
                      : batch->count > 1             ? (int)batch->count
                                                     : 1;
    struct thread *threads = calloc((size_t)count, sizeof *threads);
    status = threads ? REFDYN_OK : REFDYN_BAD_MEMORY;
    for (int i = 0; i < count && !status; i++)
        status = start_thread(&threads[i], i, batch, &queue);
    if (!status)
        run_threads(threads, count);
    for (int i = 0; threads && i < count; i++)
        release_thread(&threads[i]);
    free(threads);
    if (ended)
        *ended = atomic_load(&queue.ended);
    return status;
}
