/*
 * Writes the rows of a motion, runs it once, and finds the tolerance at which a motion has the requested
 * accuracy.
 *
 * Each run is compared with the one before it. Errors fall with the tolerance, so two runs predict the
 * tolerance of the next one. Each run costs about half as much again as the one before, so that all runs
 * together cost at most about three times the one that suffices. If that one is far more accurate than
 * requested, runs at looser tolerances follow, which are compared with the finest run.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

/* ---- Rows ---- */

/* The functions of a form. They return false if they cannot write; the form or the end of its file reports
 * the error. */
struct row_form {
    /* before the first row, with the table's integrator at the start of the motion */
    bool (*begin)(struct row_sink *sink, const struct record_table *table);
    /* writes the values of the table */
    bool (*put)(struct row_sink *sink, const struct record_table *table);
    /* after the last row, also after an error */
    bool (*end)(struct row_sink *sink);
};

static bool is_written(struct row_sink *sink) {
    return !ferror(sink->file);
}

static bool begin_csv(struct row_sink *sink, const struct record_table *table) {
    simulate_table_header(table, sink->file);
    return is_written(sink);
}

static bool put_csv(struct row_sink *sink, const struct record_table *table) {
    simulate_table_row(table, sink->file);
    return is_written(sink);
}

struct row_sink simulate_row_sink_csv(FILE *file) {
    static const struct row_form form = {begin_csv, put_csv, is_written};
    return (struct row_sink){.form = &form, .file = file};
}

static bool begin_numbers(struct row_sink *sink, const struct record_table *table) {
    return table->count > 0 && is_written(sink);
}

static bool put_numbers(struct row_sink *sink, const struct record_table *table) {
    fwrite(table->values, sizeof *table->values, (size_t)table->count, sink->file);
    return is_written(sink);
}

struct row_sink simulate_row_sink_numbers(FILE *file) {
    static const struct row_form form = {begin_numbers, put_numbers, is_written};
    return (struct row_sink){.form = &form, .file = file};
}

struct facts {
    struct memory *memory;
    struct motion_fact *list;
    int count, room;
};

static void add_fact(struct facts *facts, struct motion_fact fact) {
    facts->list = memory_room(facts->memory, facts->list, facts->count, &facts->room, sizeof *facts->list);
    facts->list[facts->count++] = fact;
}

static void add_text(struct facts *facts, const char *object, const char *name, const char *text) {
    add_fact(facts, (struct motion_fact){.object = object, .name = name, .text = text});
}

static void add_number(struct facts *facts, const char *object, const char *name, double number) {
    add_fact(facts, (struct motion_fact){.object = object, .name = name, .number = number});
}

/* The value that the equations read, or the model's value if no equation reads it. */
static double value_of(const struct scene *scene, const struct parameter *parameter) {
    for (int i = 0; i < scene->model->parameter_count; i++)
        if (strcmp(scene->model->parameters[i].name, parameter->name) == 0)
            return scene->work.p[i];
    return parameter->value;
}

static void add_model(struct facts *facts, const struct scene *scene) {
    const struct model *model = &scene->generation.model;
    add_text(facts, "/", "refdyn", REFDYN_VERSION);
    add_text(facts, "/", "model", scene->model->name);
    add_text(facts, "/", "model_hash", scene->model->hash);
    add_text(facts, "/", "model_file", model->sources->list[0].path);
    for (int i = 0; i < model->sources->count; i++)
        add_text(facts, "/model_files", model->sources->list[i].path, model->sources->list[i].text);
    for (int i = 0; i < model->option_count; i++)
        add_text(facts, "/options", model->options[i].name, model->options[i].value);
    for (int i = 0; i < model->parameter_count; i++)
        add_number(facts, "/parameters", model->parameters[i].name, value_of(scene, &model->parameters[i]));
}

static void add_method(struct facts *facts, const struct task *task,
                       const struct refdyn_integrator *integrator) {
    const char *method = options_text(task->options, "method"), *from = options_text(task->options, "from");
    const struct refdyn_options *options = &integrator->options;
    add_text(facts, "/", "method", method ? method : refdyn_method_name((int)options->method));
    add_text(facts, "/", "stabilise", record_stabilise_names[options->stabilise]);
    add_number(facts, "/", options->tol > 0 ? "tol" : "step",
               options->tol > 0 ? options->tol : options->step);
    add_text(facts, "/", "from", from ? from : "initial");
    add_number(facts, "/", "until", task->until);
}

/* The forces of drives are inputs of the emitted C. In the file they have a group for themselves. */
static const struct record_part *place_drives(const struct record_table *table, const struct model *model) {
    struct record_part *parts = format_allocate((size_t)table->part_count + 1, sizeof *parts);
    for (int i = 0; i < table->part_count; i++) {
        parts[i] = table->parts[i];
        for (int d = 0; d < model->drive_count; d++)
            if (strcmp(parts[i].path,
                       format_text("/inputs/%s", model->inputs[model->drives[d].input].name)) == 0)
                parts[i].path = format_text("/drives/%s", model->drives[d].name);
    }
    return parts;
}

static bool begin_hdf5(struct row_sink *sink, const struct record_table *table) {
    struct memory memory = format_arena_start();
    struct facts facts = {.memory = &memory};
    add_model(&facts, sink->task->scene);
    add_method(&facts, sink->task, table->integrator);
    const struct motion_layout layout = {.parts = place_drives(table, &sink->task->scene->generation.model),
                                         .facts = facts.list,
                                         .names = table->names,
                                         .units = table->units,
                                         .part_count = table->part_count,
                                         .fact_count = facts.count,
                                         .width = table->count};
    sink->writer = hdf5_motion_create(sink->path, &layout);
    sink->is_lost = !sink->writer;
    memory_release(&memory);
    return sink->writer;
}

static bool put_hdf5(struct row_sink *sink, const struct record_table *table) {
    return hdf5_motion_put(sink->writer, table->values);
}

/* If writing has failed, HDF5 leaves no readable file. */
static bool end_hdf5(struct row_sink *sink) {
    sink->is_lost = !sink->writer || !hdf5_motion_finish(sink->writer);
    sink->writer = NULL;
    return !sink->is_lost;
}

struct row_sink simulate_row_sink_hdf5(const char *path, const struct task *task) {
    static const struct row_form form = {begin_hdf5, put_hdf5, end_hdf5};
    return (struct row_sink){.form = &form, .path = path, .task = task};
}

bool simulate_row_sink_begin(struct row_sink *sink, const struct record_table *table) {
    return sink->form->begin(sink, table);
}

bool simulate_row_sink_put(struct row_sink *sink, const struct record_table *table) {
    return sink->form->put(sink, table);
}

bool simulate_row_sink_end(struct row_sink *sink) {
    return sink->form->end(sink);
}

bool simulate_row_sink_copy(FILE *numbers, struct row_sink *to, struct record_table *table) {
    const size_t count = (size_t)table->count;
    bool is_good = to->form->begin(to, table);
    rewind(numbers);
    while (is_good && fread(table->values, sizeof *table->values, count, numbers) == count)
        is_good = to->form->put(to, table);
    return to->form->end(to) && is_good;
}

/* ---- One run, with positions at its outputs and limits ---- */

/* Writes a row if all its values are finite; otherwise the motion ends there. */
static void add_output(struct trial *trial, struct row_sink *rows) {
    struct record_table *table = &trial->table;
    struct refdyn_integrator *integrator = &trial->motion.integrator;
    if (rows || trial->track.table)
        record_table_fill_row(table);
    if (rows) {
        const char *unfit = record_table_not_finite(table);
        if (unfit) {
            trial->unfit = unfit;
            trial->result = REFDYN_NOT_FINITE;
            integrator->work->fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
            return;
        }
        if (!rows->form->put(rows, table))
            trial->result = RECORD_NOT_WRITTEN;
    }
    simulate_track_add(&trial->track, integrator);
}

/* Adds the last state of a motion that ended early as one more row. Restores the description of the failure.
 */
static void add_last(struct trial *trial, struct row_sink *rows) {
    struct record_table *table = &trial->table;
    struct refdyn_integrator *integrator = &trial->motion.integrator;
    const struct refdyn_fault fault = integrator->work->fault;
    const int cause = integrator->cause;
    const double failed_t = integrator->failed_t;
    if (trial->track.count == 0 || integrator->t > trial->track.t[trial->track.count - 1]) {
        const bool is_seen = refdyn_integrator_refresh(integrator) == REFDYN_OK;
        if (is_seen)
            record_table_fill_row(table);
        if (is_seen && !record_table_not_finite(table))
            rows->form->put(rows, table);
    }
    integrator->work->fault = fault;
    integrator->cause = cause;
    integrator->failed_t = failed_t;
}

static void go(struct trial *trial, struct row_sink *rows) {
    struct motion *motion = &trial->motion;
    struct progress progress;
    if (motion->record.stops)
        record_stops_hold(motion->record.stops);
    if (rows && !rows->form->begin(rows, &trial->table))
        trial->result = RECORD_NOT_WRITTEN;
    else
        add_output(trial, rows);
    system_progress_start(&progress, "motion");
    for (long i = 1;
         i < motion->record.outputs && trial->result == REFDYN_OK && !record_is_stopped(&motion->record);
         i++) {
        trial->result = simulate_to(motion, i, &progress);
        if (trial->result == REFDYN_OK && motion->integrator.t > trial->track.t[trial->track.count - 1])
            add_output(trial, rows);
    }
    system_progress_end(&progress);
    if (trial->result == REFDYN_OK)
        refdyn_energy_scale(&motion->record.energy, &motion->integrator);
    if (rows && trial->result != REFDYN_OK && trial->result != RECORD_NOT_WRITTEN && !trial->unfit)
        add_last(trial, rows);
    if (rows && !rows->form->end(rows) && trial->result == REFDYN_OK)
        trial->result = RECORD_NOT_WRITTEN;
}

static void start_limits(struct trial *trial, const struct scene *scene) {
    simulate_limits_start(&trial->limits, simulate_memory(&trial->motion), scene, &trial->motion.integrator);
    if (trial->limits.count > 0)
        trial->motion.record.limits = &trial->limits;
}

void simulate_trial_run(struct trial *trial, const struct task *task,
                        const struct refdyn_options *integration, struct row_sink *rows) {
    const char *method = options_text(task->options, "method");
    struct motion *motion = &trial->motion;
    *trial = (struct trial){.usage = STATUS_DONE};
    trial->result =
        simulate_start(motion, task->scene, integration, task->until, options_number(task->options, "every"));
    if (trial->result == REFDYN_OK && simulate_gsl_has(method))
        trial->result = simulate_by_gsl(motion, method);
    trial->is_started = trial->result == REFDYN_OK;
    if (!trial->is_started)
        return;
    if (task->has_stops) {
        trial->usage = simulate_stops_read(&trial->stops, task->options, &motion->integrator,
                                           task->scene->compiled.spatial);
        motion->record.stops = &trial->stops;
    }
    if (trial->usage != STATUS_DONE)
        return;
    if (task->on_start)
        task->on_start(task, motion);
    simulate_table_start(&trial->table, &motion->integrator, task->scene->compiled.spatial);
    if (rows)
        start_limits(trial, task->scene);
    simulate_track_start(&trial->track, task->scene->model, motion->record.outputs);
    trial->track.tol = integration->tol;
    if (task->has_estimate)
        simulate_track_keep(&trial->track, &trial->table, motion->record.outputs);
    go(trial, rows);
    record_restore(&motion->record);
}

void simulate_trial_release(struct trial *trial) {
    simulate_track_release(&trial->track);
    simulate_release(&trial->motion);
}

/* ---- The tolerance ---- */

static const double first_tol =
    10; /* first tolerance over the requested error, of which a motion's error is often a part; */
static const double first_most = 1e-4;   /* its upper bound, so that the motion is resolved */
static const double tol_most = 1e-2;     /* upper bound of tolerances that are compared with a finer run */
static const double tol_least = 1e-14;   /* below it rounding is larger */
static const double fall_least = 0.1;    /* largest factor of the tolerance from run to run */
static const double fall_most = 1e-4;    /* smallest factor, since an extrapolation may be wrong */
static const double fall_unknown = 0.01; /* factor if the runs predict nothing */
/* Growth of the cost from run to run. The series is geometric, so all runs cost at most three times the last.
 */
static const double cost_growth = 1.5;
/* Part of the requested error that an estimate may reach, because it may be too small. */
static const double allowed_part = 0.8;
/* Part of it at which the next run aims, so that it suffices. */
static const double aimed_part = 0.2;

/* A run with less than this part of the requested error is far more accurate than requested. */
static const double exact_part = 0.2;
/* Part of the requested error at which a looser run aims; bounds of the factor of its tolerance. */
static const double looser_part = 0.4, rise_least = 1.5, rise_most = 1e4;
/* A looser run is written only if it takes at most this part of the steps. */
static const double looser_steps = 0.95;

/* Bounds of the exponent by which errors fall with the tolerance; about 1 by construction. */
static const double exponent_most = 0.75, exponent_least = 0.2;
static const double exponent_likely = 1.5;

enum { FAILURES_MOST = 3, LOOSER_MOST = 3 };

static void release(struct candidate *candidate) {
    simulate_trial_release(&candidate->trial);
    simulate_estimate_release(&candidate->estimate);
    if (candidate->rows)
        fclose(candidate->rows);
    *candidate = (struct candidate){.rows = NULL};
}

static void estimate(struct candidate *judged, const struct candidate *other, double share) {
    simulate_estimate_release(&judged->estimate);
    simulate_estimate_make(&judged->estimate, &judged->trial.track, &other->trial.track, share);
    simulate_estimate_events(&judged->estimate, &judged->trial.track, &judged->trial.motion,
                             &other->trial.motion);
    judged->has_estimate = true;
}

static double error_of(const struct candidate *candidate) {
    return candidate->estimate.largest.error;
}

static bool is_good(const struct candidate *candidate, double allowed) {
    return candidate->estimate.is_trusted && error_of(candidate) <= allowed;
}

/* The factor of the tolerance for the next run. */
static double find_fall(const struct candidate *now, double accuracy, int order) {
    const double cheap = fmin(fall_least, pow(cost_growth, -order));
    if (now->trial.result != REFDYN_OK || (now->has_estimate && !now->estimate.is_trusted))
        return fall_unknown;
    if (!now->has_estimate)
        return cheap;
    const double wanted = aimed_part * accuracy / error_of(now);
    return fmax(fall_most, fmin(cheap, wanted));
}

static double tolerance_of(const struct candidate *candidate) {
    return candidate->trial.motion.integrator.options.tol;
}

static long tries_of(const struct candidate *candidate) {
    const struct refdyn_statistics *statistics = &candidate->trial.motion.integrator.statistics;
    return statistics->steps + statistics->rejected;
}

/* The exponent by which errors fall with the tolerance, from the last two differences of runs, within safe
 * bounds. */
static double find_exponent(const struct search *search, double difference) {
    if (search->difference_before == 0 || difference == 0)
        return exponent_most;
    const double seen = log(difference / search->difference_before) / log(search->fall_before);
    return fmax(exponent_least, fmin(seen, exponent_most));
}

/* Compares the last two runs. Chooses the coarser one if it is accurate enough, otherwise the finer one.
 * Returns whether the chosen one is accurate enough. */
static bool judge(struct search *search, struct candidate *before, struct candidate *now, double accuracy) {
    const double fall = tolerance_of(now) / tolerance_of(before);
    estimate(before, now, pow(fall, exponent_most));
    const double difference = before->estimate.difference;
    const double exponent = find_exponent(search, difference);
    estimate(before, now, pow(fall, exponent));
    estimate(now, before, pow(fall, -exponent));
    search->is_exhausted = search->difference_before > 0 && difference > search->difference_before;
    search->difference_before = difference;
    search->fall_before = fall;
    search->taken = is_good(before, allowed_part * accuracy) ? before : now;
    search->is_reached = is_good(search->taken, allowed_part * accuracy);
    return search->is_reached;
}

static void run(struct search *search, struct candidate *candidate, const struct task *task,
                const struct refdyn_options *integration) {
    *candidate = (struct candidate){.rows = tmpfile()};
    if (!candidate->rows)
        perror("refdyn: a temporary file");
    else {
        struct row_sink rows = simulate_row_sink_numbers(candidate->rows);
        simulate_trial_run(&candidate->trial, task, integration, &rows);
    }
    search->cpu_total_s += candidate->trial.motion.cpu_s;
}

/* The largest step of a run at tolerance `tol`, if it follows from that of another run. */
static double step_at(const struct candidate *candidate, double tol, int order) {
    return candidate->trial.motion.integrator.statistics.step_largest *
           pow(tol / tolerance_of(candidate), 1.0 / order);
}

/* Sets the next run: `fall` times the tolerance, and a bound on the step that shrinks with it, in case
 * something else limits the steps. Returns false at the smallest tolerance. */
static bool tighten(struct refdyn_options *integration, const struct candidate *now, double fall, int order) {
    const double tol = fmax(integration->tol * fall, tol_least);
    if (!(tol < integration->tol * fall_least * 2))
        return false;
    if (now->trial.result == REFDYN_OK)
        integration->step_max = step_at(now, tol, order);
    integration->tol = tol;
    integration->event_looks = record_finer_looks;
    return true;
}

/* The error of the chosen run. Compared with a coarser run, its estimate is an upper bound: it is not known
 * yet how fast errors fall. */
static double likely_error(const struct search *search, const struct candidate *finest) {
    return search->taken == finest
               ? fmin(error_of(finest), search->difference_before * pow(search->fall_before, exponent_likely))
               : error_of(search->taken);
}

/* The tolerance of the next looser run, below `most`, at which runs were too inaccurate; 0: the error of the
 * chosen run is nearly the requested one. */
static double looser_tolerance(const struct search *search, const struct candidate *finest, double accuracy,
                               double most) {
    const double tol = tolerance_of(search->taken), error = likely_error(search, finest);
    if (error >= exact_part * accuracy)
        return 0;
    const double wanted = tol * (error > 0 ? fmin(looser_part * accuracy / error, rise_most) : rise_most);
    const double next = fmin(wanted, isfinite(most) ? sqrt(tol * most) : tol_most);
    return next > rise_least * tol ? next : 0;
}

/* Is this run accurate enough, compared with the finest one? Its error is at most their difference and the
 * error of the finest one, also where both have nearly the same. */
static bool suffices(struct candidate *looser, const struct candidate *finest, double accuracy) {
    if (looser->trial.result != REFDYN_OK)
        return false;
    estimate(looser, finest, 0);
    const double difference = looser->estimate.difference, error = error_of(finest);
    if (difference > 0)
        estimate(looser, finest, error / (error + difference));
    return is_good(looser, allowed_part * accuracy);
}

/* The run that suffices may be more accurate than requested: looser runs replace it while they suffice, too.
 * Returns false if the user has interrupted one of them. */
static bool loosen(struct search *search, const struct task *task, const struct refdyn_options *integration,
                   const struct candidate *finest, double accuracy) {
    struct refdyn_options options = *integration;
    const int order = refdyn_method_order(options.method);
    double most = INFINITY;
    if (search->taken == finest) /* the run before it was too inaccurate */
        most = tolerance_of(finest) / search->fall_before;
    for (int tries = 0; tries < LOOSER_MOST; tries++) {
        struct candidate *looser = search->candidates;
        options.tol = looser_tolerance(search, finest, accuracy, most);
        if (options.tol == 0)
            return true;
        options.step_max = step_at(search->taken, options.tol, order);
        if (integration->step_max > 0)
            options.step_max = fmin(options.step_max, integration->step_max);
        options.step_limit = (long)(looser_steps * (double)tries_of(search->taken));
        while (looser == finest || looser == search->taken)
            looser++;
        release(looser);
        run(search, looser, task, &options);
        if (looser->trial.result == RECORD_INTERRUPTED) {
            search->taken = NULL;
            search->last = looser;
            return false;
        }
        if (!looser->rows || looser->trial.result == REFDYN_TOO_MANY_STEPS)
            return true;
        if (suffices(looser, finest, accuracy))
            search->taken = looser;
        else
            most = options.tol;
    }
    return true;
}

enum status simulate_search_run(struct search *search, const struct task *task,
                                const struct refdyn_options *integration) {
    struct refdyn_options options = *integration;
    struct task each = *task;
    const double accuracy = options_number(task->options, "accuracy");
    const int order = refdyn_method_order(options.method);
    int failures = 0, place = 0;
    *search = (struct search){.taken = NULL};
    const double smallest_unit = simulate_smallest_unit(task->scene->model);
    options.tol = fmax(fmin(first_tol * accuracy / smallest_unit, first_most), tol_least / fall_least);
    for (struct candidate *before = NULL;;) {
        struct candidate *now = &search->candidates[place];
        run(search, now, &each, &options);
        each.on_start = NULL; /* reported once for all runs */
        if (!now->rows || now->trial.usage != STATUS_DONE)
            return now->rows ? now->trial.usage : STATUS_FAULT;
        search->last = now;
        const bool is_run = now->trial.result == REFDYN_OK;
        if (now->trial.result == RECORD_INTERRUPTED || (!is_run && ++failures == FAILURES_MOST)) {
            search->taken = NULL;
            return STATUS_NUMBERS;
        }
        if (is_run && before && judge(search, before, now, accuracy))
            return loosen(search, &each, integration, now, accuracy) ? STATUS_DONE : STATUS_NUMBERS;
        if (search->is_exhausted || !tighten(&options, now, find_fall(now, accuracy, order), order))
            return STATUS_NUMBERS;
        before = is_run ? now : NULL;
        place = is_run ? 1 - place : place;
        search->taken = before;
        release(&search->candidates[place]);
    }
}

void simulate_search_release(struct search *search) {
    for (int i = 0; i < SEARCH_CANDIDATES; i++)
        release(&search->candidates[i]);
    search->taken = NULL;
}
