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

/* ---- Numbers of a case ---- */

/* The last outputs of a value with bounds. */
struct limit_track {
    double t[2], value[2]; /* the last but one, the last */
    int count;             /* of outputs so far, at most 2 */
};

/* Fills the numbers that a batch keeps of one case from the states of its motion. A recorder belongs to one
 * thread and one structure, and records one case after another. */
struct recorder {
    const struct kept *kept;
    const struct runs_layout *layout;
    struct record_table table;
    int *places;                 /* (item_count) columns of the table, -1 if this structure has none */
    struct record_bound *bounds; /* (item_count) of limits */
    struct limit_track *tracks;  /* (item_count) the last outputs of limits */
    double *values;              /* (layout->width) of the case */
    double *before;              /* (item_count) squares at the previous output, for norms */
    double t_before;
    bool keeps_ends_alone;
    struct case_derivatives *derivatives; /* NULL: none are kept */
};

static const struct bound *find_bound(const struct model *read, const char *name) {
    for (int i = 0; i < read->bound_count; i++)
        if (strcmp(read->bounds[i].name, name) == 0)
            return &read->bounds[i];
    return NULL;
}

/* Looks up the items' columns in the table, and selects the blocks that it must compute. */
static void find_places(struct recorder *recorder, const struct model *read) {
    const struct kept *kept = recorder->kept;
    struct record_table *table = &recorder->table;
    bool *wanted = format_allocate((size_t)table->count, sizeof *wanted);
    for (int i = 0; i < recorder->layout->item_count; i++) {
        const struct bound *bound = kept->kinds[i] == KEPT_LIMIT ? find_bound(read, kept->columns[i]) : NULL;
        const char *column = bound ? bound->column : kept->columns[i];
        if (bound)
            recorder->bounds[i] = (struct record_bound){bound->name, bound->column, bound->from, bound->to};
        recorder->places[i] =
            kept->kinds[i] == KEPT_LIMIT && !bound ? -1 : text_index(column, table->names, table->count);
        if (recorder->places[i] >= 0)
            wanted[recorder->places[i]] = true;
    }
    record_table_want(table, wanted);
}

static void recorder_start(struct recorder *recorder, const struct kept *kept,
                           const struct runs_layout *layout, struct refdyn_integrator *integrator,
                           const struct model *read) {
    *recorder = (struct recorder){.kept = kept, .layout = layout};
    simulate_table_start(&recorder->table, integrator, NULL);
    recorder->places = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->places);
    recorder->before = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->before);
    recorder->values = format_allocate((size_t)layout->width + 1, sizeof *recorder->values);
    recorder->bounds = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->bounds);
    recorder->tracks = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->tracks);
    find_places(recorder, read);
    recorder->keeps_ends_alone = true;
    for (int i = 0; i < layout->item_count; i++)
        recorder->keeps_ends_alone &= kept->kinds[i] == KEPT_FINAL || kept->kinds[i] == KEPT_DERIVATIVE;
}

/* Begins a case: all its values are unknown (NaN). */
static void recorder_clear(struct recorder *recorder) {
    for (int i = 0; i < recorder->layout->width; i++)
        recorder->values[i] = NAN;
    for (int i = 0; i < recorder->layout->item_count; i++)
        recorder->tracks[i].count = 0;
}

/* extremes: smallest value, its time, largest value, its time. A NaN stays. */
static void widen(double *extremes, double value, double t, bool is_first) {
    if (is_first || !(value >= extremes[0])) {
        extremes[0] = value;
        extremes[1] = t;
    }
    if (is_first || !(value <= extremes[2])) {
        extremes[2] = value;
        extremes[3] = t;
    }
}

/* Root mean square: integrates x^2 by the trapezoidal rule, and at the end divides by the time and takes the
 * root. */
static void add_square(struct recorder *recorder, int item, double value, double t, bool is_first,
                       bool is_last) {
    double *sum = recorder->values + recorder->layout->items[item].offset;
    const double square = value * value;
    *sum = is_first ? 0 : *sum + (t - recorder->t_before) * (square + recorder->before[item]) / 2;
    recorder->before[item] = square;
    if (is_last && t > recorder->kept->times.t[0])
        *sum = sqrt(*sum / (t - recorder->kept->times.t[0]));
}

/* The vertex of the parabola through three outputs, if the middle one is the largest or the smallest. Where
 * one of the two slopes is far steeper than the other, the value may jump, and the output itself counts. */
static bool vertex(const struct limit_track *track, double t, double value, double *t_vertex,
                   double *vertex) {
    const double steepest = 0.1, h0 = track->t[1] - track->t[0], h1 = t - track->t[1];
    const double s0 = (track->value[1] - track->value[0]) / h0, s1 = (value - track->value[1]) / h1;
    const double curvature = (s1 - s0) / (h0 + h1), slope = (s0 * h1 + s1 * h0) / (h0 + h1);
    const double away = -slope / (2 * curvature);
    *t_vertex = track->t[1] + away;
    *vertex = track->value[1] + away * (slope + away * curvature);
    return track->count == 2 && s0 * s1 < 0 && fabs(s0) > steepest * fabs(s1) &&
           fabs(s1) > steepest * fabs(s0);
}

/* Adds an output to a limit: extremes by parabolas through three outputs, times beyond it by straight lines.
 */
static void add_to_limit(struct recorder *recorder, int item, double value, double t) {
    double *to = recorder->values + recorder->layout->items[item].offset, t_vertex, at_vertex;
    struct limit_track *track = &recorder->tracks[item];
    const struct record_bound *bound = &recorder->bounds[item];
    widen(to, value, t, track->count == 0);
    if (track->count == 2 && vertex(track, t, value, &t_vertex, &at_vertex))
        widen(to, at_vertex, t_vertex, false);
    const bool is_out = record_is_beyond(bound, value);
    if (track->count == 0)
        to[5] = 0;
    if (track->count == 0 && is_out)
        to[4] = t;
    if (track->count > 0) {
        const double t0 = track->t[1], v0 = track->value[1],
                     bound_near = fmax(v0, value) > bound->to ? bound->to : bound->from;
        const bool was_out = record_is_beyond(bound, v0);
        const double crossing =
            is_out == was_out ? t : fmin(fmax(t0 + (t - t0) * (bound_near - v0) / (value - v0), t0), t);
        if (!was_out && is_out && isnan(to[4]))
            to[4] = crossing;
        if (was_out || is_out)
            to[5] += is_out == was_out ? t - t0 : was_out ? crossing - t0 : t - crossing;
    }
    *track = (struct limit_track){.t = {track->t[1], t},
                                  .value = {track->value[1], value},
                                  .count = track->count < 2 ? track->count + 1 : 2};
}

static void record(struct recorder *recorder, int item, double value, int number) {
    const struct seen_times *times = &recorder->kept->times;
    double *to = recorder->values + recorder->layout->items[item].offset;
    const int output = times->output[number], at = times->at[number];
    switch (recorder->kept->kinds[item]) {
    case KEPT_FINAL:
        *to = value;
        break;
    case KEPT_AT:
        if (at >= 0)
            to[at] = value;
        break;
    case KEPT_EXTREMES:
        if (output >= 0)
            widen(to, value, times->t[number], number == 0);
        break;
    case KEPT_NORM:
        if (output >= 0)
            add_square(recorder, item, value, times->t[number], number == 0, number == times->count - 1);
        break;
    case KEPT_HISTORY:
        if (output >= 0)
            to[output] = value;
        break;
    case KEPT_LIMIT:
        if (output >= 0)
            add_to_limit(recorder, item, value, times->t[number]);
        break;
    case KEPT_DERIVATIVE: /* runs_derive */
        break;
    }
}

/* Records the integrator's state at the time `number` of seen_times. */
static void recorder_see(struct recorder *recorder, int number) {
    const struct seen_times *times = &recorder->kept->times;
    if (recorder->keeps_ends_alone && number < times->count - 1)
        return;
    record_table_fill(&recorder->table);
    for (int i = 0; i < recorder->layout->item_count; i++)
        if (recorder->places[i] >= 0)
            record(recorder, i, recorder->table.values[recorder->places[i]], number);
    if (times->output[number] >= 0)
        recorder->t_before = times->t[number];
}

/* Records the state at which an event has ended the case, between two recorded times. */
static void record_end(struct recorder *recorder, int item, double value, double t) {
    double *to = recorder->values + recorder->layout->items[item].offset;
    const enum kept_kind kind = recorder->kept->kinds[item];
    if (kind == KEPT_FINAL)
        *to = value;
    else if (kind == KEPT_EXTREMES)
        widen(to, value, t, false);
    else if (kind == KEPT_NORM)
        add_square(recorder, item, value, t, false, true);
    else if (kind == KEPT_LIMIT)
        add_to_limit(recorder, item, value, t);
}

/* Records the end of a case that an event has ended at t, and completes extremes and norms. */
static void recorder_end(struct recorder *recorder, double t) {
    record_table_fill(&recorder->table);
    for (int i = 0; i < recorder->layout->item_count; i++)
        if (recorder->places[i] >= 0)
            record_end(recorder, i, recorder->table.values[recorder->places[i]], t);
}

/* Marks as unknown what a case that failed at t has of its end and of its whole motion. */
static void recorder_fail(struct recorder *recorder, double t) {
    for (int i = 0; i < recorder->layout->item_count; i++) {
        const struct kept_item *item = &recorder->layout->items[i];
        const enum kept_kind kind = recorder->kept->kinds[i];
        if (kind == KEPT_AT || kind == KEPT_HISTORY)
            continue;
        for (int k = 0; k < item->size; k++)
            recorder->values[item->offset + k] = NAN;
        if (kind == KEPT_FINAL && strcmp(item->name, "t") == 0)
            recorder->values[item->offset] = t;
    }
}

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
    recorder_start(recorder, &running->setup->kept, &running->setup->layout, one->integrator,
                   &running->structure->scene.generation.model);
    recorder->derivatives = runs_derivatives_start(recorder->kept, recorder->layout, &batch, one->integrator);
    pthread_mutex_unlock(&running->lock);
    return recorder;
}

static int see(void *context, const struct refdyn_batch_case *one, int number) {
    struct recorder *recorder = recorder_of(context, one);
    if (number == 0)
        recorder_clear(recorder);
    recorder_see(recorder, number);
    return 0;
}

static int is_interrupted(void *context) {
    (void)context;
    return system_interrupted != 0;
}

enum { REASON_LENGTH = 512 };

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
             running->total, (double)count->cases / (elapsed > 0 ? elapsed : 1), count->failed);
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

static int end_case(void *context, const struct refdyn_batch_case *one,
                    const struct refdyn_batch_result *result) {
    struct running *running = context;
    struct recorder *recorder = recorder_of(running, one);
    char reason[REASON_LENGTH] = "";
    if (result->stage != REFDYN_AT_STEPS)
        recorder_clear(recorder);
    const bool is_ended = result->status == REFDYN_EVENT_ENDS, has_failed = result->status && !is_ended;
    if (is_ended) {
        describe_end(one, result, reason);
        recorder_end(recorder, result->t);
    }
    const bool is_refused = is_refused_at_start(result);
    if (has_failed && !is_refused) {
        describe_failure(running, one, result, reason);
        recorder_fail(recorder, result->t);
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
    running->is_broken = running->is_broken || !running->sink->take(running->sink->context, &record);
    running->count->cases++;
    running->count->failed += has_failed;
    running->count->cases_cpu_s += result->cpu_s;
    running->count->steps += one->integrator->statistics.steps;
    running->count->steps_alone += result->steps_alone;
    if (result->unstable)
        note(&running->count->unstable, one->number);
    if (result->is_beyond)
        note(&running->count->beyond, one->number);
    if (result->stage != REFDYN_AT_STATICS && one->integrator->start_is_far)
        note(&running->count->far, one->number);
    show_progress(running);
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

static int run_cases(struct running *running, struct structure *structure, long *numbers) {
    struct refdyn_batch batch = runs_describe(running->setup, structure);
    batch.count = list_open_cases(running, structure, numbers);
    batch.numbers = numbers;
    batch.threads = running->setup->threads;
    batch.context = running;
    batch.output = see;
    batch.end = end_case;
    batch.stop = is_interrupted;
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
