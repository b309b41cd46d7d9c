/*
 * Computes the cases of a batch on several threads and passes their records to a sink.
 *
 * Each thread has its own recorder. A lock is held once a case, to write its record.
 */
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- Computation ---- */

/* What all threads share while one structure is computed. */
struct running {
    struct batch_setup *setup;
    const struct batch_sink *sink;
    struct batch_count *count;
    const struct structure *structure;
    struct recorder *recorders; /* (threads) */
    pthread_mutex_t lock;       /* protects all members below, the sink and count */
    bool is_broken;             /* a record could not be written */
    long total;
    struct progress progress;
    char what[96]; /* text of the progress */
};

/* ---- On the threads ---- */

/* The thread's recorder. It starts with the first case, when the thread has its integrator; the lock protects
 * the program's memory. */
static struct recorder *recorder_of(struct running *running, const struct refdyn_batch_case *one) {
    struct recorder *recorder = &running->recorders[one->room];
    if (recorder->values)
        return recorder;
    pthread_mutex_lock(&running->lock);
    const struct refdyn_batch batch = runs_describe(running->setup, running->structure);
    struct record_table *table = format_allocate(1, sizeof *table);
    simulate_table_start(table, one->integrator, NULL);
    runs_recorder_start(recorder, &running->setup->kept, &running->setup->layout, table,
                        &running->structure->scene.generation.model);
    recorder->derivatives = runs_derivatives_start(recorder->kept, recorder->layout, &batch, one->integrator);
    pthread_mutex_unlock(&running->lock);
    return recorder;
}

static int see(void *context, const struct refdyn_batch_case *one, int number) {
    struct recorder *recorder = recorder_of(context, one);
    if (number == 0)
        runs_recorder_clear(recorder);
    runs_recorder_see(recorder, number);
    return 0;
}

static int is_interrupted(void *context) {
    (void)context;
    return system_interrupted != 0;
}

/* Writes where and why a case failed, in the words of `sim`. */
static void describe_failure(const struct running *running, const struct refdyn_batch_case *one,
                             const struct refdyn_batch_result *result, char reason[static REASON_LENGTH]) {
    static const char *const stages[] = {
        [REFDYN_AT_STATICS] = "equilibrium", [REFDYN_AT_START] = "start", [REFDYN_AT_STEPS] = "motion"};
    const struct refdyn_workspace *work = one->integrator->work;
    const struct refdyn_model *model = work->model;
    const struct refdyn_fault *fault = &work->fault;
    const int cause = result->stage == REFDYN_AT_STEPS ? one->integrator->cause : 0;
    char t[NUMBER_LENGTH], refused[REFUSED_LENGTH];
    int length = snprintf(reason, REASON_LENGTH, "%s at t = %s s: %s", stages[result->stage],
                          exact_text(result->t, t), refdyn_status_text(result->status));
    if (cause > 0 && cause != result->status && length < REASON_LENGTH)
        length +=
            snprintf(reason + length, (size_t)(REASON_LENGTH - length), "; %s", refdyn_status_text(cause));
    if (fault->row >= 0 && fault->row < model->m && length < REASON_LENGTH)
        length += snprintf(reason + length, (size_t)(REASON_LENGTH - length), ", constraint %s",
                           model->rows[fault->row].name);
    if (fault->coordinate >= 0 && fault->coordinate < model->n && length < REASON_LENGTH)
        length += snprintf(reason + length, (size_t)(REASON_LENGTH - length), ", %s %s",
                           fault->coordinate < refdyn_joint_count(model) ? "coordinate" : "state",
                           model->coordinates[fault->coordinate].name);
    if (result->stage == REFDYN_AT_STEPS && one->integrator->event_count > 0 && length < REASON_LENGTH)
        length += snprintf(reason + length, (size_t)(REASON_LENGTH - length), ", event %s",
                           model->events[one->integrator->event[0]].name);
    if (result->status == REFDYN_REFUSED && length < REASON_LENGTH)
        snprintf(reason + length, (size_t)(REASON_LENGTH - length), ": %s",
                 scene_refused_fact(&running->structure->scene, work, refused));
}

/* Writes which event ended the motion: the first of those at its end that may. */
static void describe_end(const struct refdyn_batch_case *one, const struct refdyn_batch_result *result,
                         char reason[static REASON_LENGTH]) {
    const struct refdyn_integrator *integrator = one->integrator;
    const struct refdyn_event *events = integrator->work->model->events;
    char t[NUMBER_LENGTH];
    int k = 0;
    while (!events[integrator->event[k]].ends)
        k++;
    snprintf(reason, REASON_LENGTH, "ended by %s at t = %s s", events[integrator->event[k]].name,
             exact_text(result->t, t));
}

static void show_progress(struct running *running) {
    const struct batch_count *count = running->count;
    if (!system_progress_is_due(&running->progress))
        return;
    const double elapsed = system_wall_seconds() - running->progress.started;
    snprintf(running->what, sizeof running->what, "%ld of %ld cases, %.0f/s, %ld failed", count->cases,
             running->total, (double)count->cases / (elapsed > 0 ? elapsed : 1), count->failed.count);
    system_progress_show(&running->progress, (double)count->cases / (double)running->total);
}

static void note(struct noted_cases *noted, long number) {
    if (noted->count == 0 || number < noted->first)
        noted->first = number;
    noted->count++;
}

/* Returns whether the model refused the values of the case before anything was computed. */
static bool is_refused_at_start(const struct refdyn_batch_result *result) {
    return result->status == REFDYN_REFUSED && result->stage != REFDYN_AT_STEPS;
}

/* Stores a record and counts its case. */
static void take_record(struct running *running, const struct case_record *record) {
    struct batch_count *count = running->count;
    running->is_broken = running->is_broken || !running->sink->take(running->sink->context, record);
    count->cases++;
    if (record->status != STATUS_DONE) {
        note(&count->failed, record->number);
        if (count->failed.first == record->number)
            snprintf(count->reason, sizeof count->reason, "%s", record->reason);
    }
    count->cases_cpu_s += record->cpu_s;
    count->steps += record->steps;
    show_progress(running);
}

static int end_case(void *context, const struct refdyn_batch_case *one,
                    const struct refdyn_batch_result *result) {
    struct running *running = context;
    struct recorder *recorder = recorder_of(running, one);
    char reason[REASON_LENGTH] = "";
    if (result->stage != REFDYN_AT_STEPS)
        runs_recorder_clear(recorder);
    const bool is_ended = result->status == REFDYN_EVENT_ENDS, has_failed = result->status && !is_ended;
    if (is_ended) {
        describe_end(one, result, reason);
        runs_recorder_end(recorder, result->t);
    }
    const bool is_refused = is_refused_at_start(result);
    if (has_failed && !is_refused) {
        describe_failure(running, one, result, reason);
        runs_recorder_fail(recorder, result->t);
    }
    if (is_refused)
        scene_refused_fact(&running->structure->scene, one->integrator->work, reason);
    if (!has_failed && recorder->derivatives)
        runs_derive(recorder->derivatives, one->number, recorder->values, reason, sizeof reason);
    const struct case_record record = {.number = one->number,
                                       .status = is_refused   ? STATUS_FAULT
                                                 : has_failed ? STATUS_NUMBERS
                                                              : STATUS_DONE,
                                       .steps = one->integrator->statistics.steps,
                                       .cpu_s = result->cpu_s,
                                       .reason = reason,
                                       .values = recorder->values};
    pthread_mutex_lock(&running->lock);
    take_record(running, &record);
    running->count->steps_alone += result->steps_alone;
    if (result->unstable)
        note(&running->count->unstable, one->number);
    if (result->is_beyond)
        note(&running->count->beyond, one->number);
    if (result->stage != REFDYN_AT_STATICS && one->integrator->start_is_far)
        note(&running->count->far, one->number);
    const bool is_broken = running->is_broken;
    pthread_mutex_unlock(&running->lock);
    return is_broken;
}

/* ---- A structure ---- */

/* Writes the numbers of the cases that the sink does not have; returns how many there are. */
static long list_open_cases(const struct running *running, const struct structure *structure, long *numbers) {
    const struct batch_sink *sink = running->sink;
    long count = 0;
    for (long i = 0; i < structure->count; i++) {
        const long number = structure->numbers[i];
        if (!sink->has(sink->context, number))
            numbers[count++] = number;
    }
    return count;
}

struct refdyn_batch runs_describe(const struct batch_setup *setup, const struct structure *structure) {
    const struct scene *scene = &structure->scene;
    const struct seen_times *times = &setup->kept.times;
    return (struct refdyn_batch){.model = scene->model,
                                 .lanes = scene->compiled.lanes,
                                 .options = setup->integration,
                                 .p = scene->work.p,
                                 .x = scene->work.x,
                                 .given = scene->given,
                                 .q = scene->state.q,
                                 .qd = scene->state.qd,
                                 .t = scene->state.t,
                                 .from_statics = structure->held != NULL,
                                 .held = structure->held,
                                 .held_count = structure->held_count,
                                 .statics = &structure->statics,
                                 .times = times->t + 1,
                                 .time_count = times->count - 1,
                                 .samples = structure->samples,
                                 .sample_count = structure->sample_count,
                                 .columns = structure->columns,
                                 .column_count = structure->column_count};
}

/* Takes the record of a case that another process has computed, and adds the CPU time of that process. */
static bool take_realised(void *context, const struct case_record *record) {
    struct running *running = context;
    running->count->cpu_started -= record->cpu_s;
    take_record(running, record);
    return !running->is_broken;
}

/* Stores the records of cases that lack a number; returns how many others remain in `numbers`. */
static long refuse_cases(struct running *running, const struct structure *structure, long *numbers,
                         long count) {
    const int width = running->setup->layout.width;
    double *values = format_allocate((size_t)width + 1, sizeof *values);
    char reason[REFUSED_LENGTH];
    long kept = 0;
    for (int i = 0; i < width; i++)
        values[i] = NAN;
    for (long i = 0; i < count && !running->is_broken; i++) {
        const struct case_record record = {
            .number = numbers[i], .status = STATUS_FAULT, .reason = reason, .values = values};
        if (sweeps_structures_refuse(structure, &running->setup->sweep.cases, numbers[i], reason))
            take_record(running, &record);
        else
            numbers[kept++] = numbers[i];
    }
    return kept;
}

static int run_cases(struct running *running, struct structure *structure, long *numbers) {
    struct refdyn_batch batch = runs_describe(running->setup, structure);
    batch.count = refuse_cases(running, structure, numbers, list_open_cases(running, structure, numbers));
    batch.numbers = numbers;
    batch.threads = running->setup->threads;
    batch.context = running;
    batch.output = see;
    batch.end = end_case;
    batch.stop = is_interrupted;
    if (options_has(&structure->options, "realise")) {
        runs_realise_cases(running->setup, structure, numbers, batch.count, take_realised, running);
        return REFDYN_OK;
    }
    return batch.count > 0 ? refdyn_batch_run(&batch, NULL) : REFDYN_OK;
}

static enum status run_structure(struct running *running, struct structure *structure) {
    const int threads = running->setup->threads;
    long *numbers = format_allocate_large((size_t)structure->count, sizeof *numbers);
    running->structure = structure;
    running->recorders =
        format_allocate_large((size_t)(threads * running->setup->lanes), sizeof *running->recorders);
    const int result = run_cases(running, structure, numbers);
    for (int i = 0; i < threads * running->setup->lanes; i++)
        runs_derivatives_release(running->recorders[i].derivatives);
    free(running->recorders);
    free(numbers);
    if (result)
        fprintf(stderr, "refdyn: %s: %s\n", structure->scene.model->name, refdyn_status_text(result));
    return result || running->is_broken ? STATUS_FAULT : STATUS_DONE;
}

void runs_time_passed(struct batch_count *count) {
    count->cpu_s = system_process_cpu_seconds() - count->cpu_started;
    count->wall_s = system_wall_seconds() - count->wall_started;
}

enum status runs_compute(struct batch_setup *setup, const struct batch_sink *sink,
                         struct batch_count *count) {
    struct running running = {
        .setup = setup, .sink = sink, .count = count, .lock = PTHREAD_MUTEX_INITIALIZER};
    enum status status = STATUS_DONE;
    *count = (struct batch_count){.cpu_started = system_process_cpu_seconds(),
                                  .wall_started = system_wall_seconds()};
    for (long number = setup->first; number < setup->end; number++)
        running.total += !sink->has(sink->context, number);
    system_progress_start(&running.progress, running.what);
    for (int i = 0; i < setup->structures.count && status == STATUS_DONE && !system_interrupted; i++)
        status = run_structure(&running, &setup->structures.list[i]);
    system_progress_end(&running.progress);
    runs_time_passed(count);
    return status == STATUS_DONE && system_interrupted ? STATUS_NUMBERS : status;
}
