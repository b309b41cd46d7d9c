/*
 * The cases of a batch on several threads: see refdyn_batch.h.
 *
 * A counter that all threads count up is the queue; each thread has a workspace and an integrator of its own.
 */
#define _POSIX_C_SOURCE 200809L
#include "base/model_check.h"
#include "batch/motion_of_case.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct queue {
    long count;
    atomic_long next, ended;
    atomic_int is_left; /* a callback has ended the batch */
};

struct thread {
    struct queue *queue;
    struct worker worker;
    pthread_t id;
    int is_running;
};

static void *run_cases(void *argument) {
    struct thread *thread = argument;
    struct queue *queue = thread->queue;
    while (!atomic_load_explicit(&queue->is_left, memory_order_relaxed)) {
        const long index = atomic_fetch_add_explicit(&queue->next, 1, memory_order_relaxed);
        if (index >= queue->count)
            break;
        if (refdyn_worker_run(&thread->worker, index))
            atomic_fetch_add_explicit(&queue->ended, 1, memory_order_relaxed);
        else
            atomic_store_explicit(&queue->is_left, 1, memory_order_relaxed);
    }
    return NULL;
}

/* ---- What is refused ---- */

static int has_place(const struct refdyn_batch *batch, const struct refdyn_batch_column *column) {
    const struct refdyn_model *model = batch->model;
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

static int has_samples(const struct refdyn_batch *batch, const struct refdyn_batch_column *column) {
    for (long i = 0; i < batch->count && column->what == REFDYN_VARIED_SAMPLES; i++) {
        const double number = column->values[batch->numbers ? batch->numbers[i] : i];
        if (!(number >= 0 && number < batch->sample_count && number == floor(number)))
            return 0;
    }
    return 1;
}

static int are_times(const struct refdyn_batch *batch) {
    double before = batch->t;
    for (int i = 0; i < batch->time_count; before = batch->times[i++])
        if (!(batch->times[i] > before && isfinite(batch->times[i])))
            return 0;
    return batch->time_count > 0 && isfinite(batch->t);
}

static int is_valid(const struct refdyn_batch *batch) {
    if (batch->threads < 1 || batch->count < 0 || !are_times(batch))
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

static int start_workers(struct thread *threads, int count, const struct refdyn_batch *batch,
                         struct queue *queue) {
    int status = REFDYN_OK;
    for (int i = 0; i < count && !status; i++) {
        threads[i].queue = queue;
        status = refdyn_worker_start(&threads[i].worker, batch, i);
    }
    return status;
}

int refdyn_batch_run(const struct refdyn_batch *batch, long *ended) {
    struct queue queue = {.count = batch->count};
    if (ended)
        *ended = 0;
    const int status_of_model = refdyn_model_status(batch->model);
    if (status_of_model)
        return status_of_model;
    if (!is_valid(batch))
        return REFDYN_BAD_OPTION;
    struct thread *threads = calloc((size_t)batch->threads, sizeof *threads);
    int status = threads ? start_workers(threads, batch->threads, batch, &queue) : REFDYN_BAD_MEMORY;
    if (!status)
        run_threads(threads, batch->threads);
    for (int i = 0; threads && i < batch->threads; i++)
        refdyn_worker_release(&threads[i].worker);
    free(threads);
    if (ended)
        *ended = atomic_load(&queue.ended);
    return status;
}
