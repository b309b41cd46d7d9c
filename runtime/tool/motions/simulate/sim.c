/* `refdyn sim`: computes one motion and writes its rows and a summary; optionally estimates its error
 * (--verify) or finds its tolerance (--accuracy). */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* Fixed steps that take more than a second for any model with a few joints. */
static const double long_steps = 1e5;

/* ---- Runs ---- */

static void on_start(const struct task *task, const struct motion *motion) {
    system_target_keep_part(task->scene->result);
    record_print_start(&motion->record, options_text(task->options, "start"), stderr);
}

/* Keeps the partial file under its name if it has rows. */
static bool keep_part(struct target *target, bool has_rows, bool has_last) {
    if (!has_rows) {
        system_target_drop_part(target);
        return true;
    }
    if (!system_target_close_part(target))
        return false;
    if (target->part)
        format_complain("refdyn: what was computed until then is in %s%s\n", target->part,
                        has_last ? "; its last row is the complete last state" : "");
    return true;
}

static void print_failure(const struct trial *trial) {
    const struct motion *motion = &trial->motion;
    const bool is_refused = trial->is_started && trial->result == REFDYN_REFUSED;
    char text[REFUSED_LENGTH];
    record_print_failure(&motion->record, trial->result, trial->is_started, trial->unfit,
                         is_refused ? scene_refused_fact(motion->scene, motion->integrator.work, text) : NULL,
                         stderr);
}

static enum status stop(const struct trial *trial, struct target *target, const struct row_sink *rows) {
    const struct summary summary = {.trial = trial};
    print_failure(trial);
    if (trial->is_started)
        simulate_summary_print(&summary);
    const bool is_kept = keep_part(target, trial->is_started && !rows->is_lost, !trial->unfit);
    return is_kept && trial->result != RECORD_NOT_WRITTEN ? STATUS_NUMBERS : STATUS_FAULT;
}

/* The complete file and the summary. */
static enum status finish(const struct summary *summary, const struct scene *scene) {
    simulate_summary_print(summary);
    enum status status = system_target_finish(scene->result) ? STATUS_DONE : STATUS_FAULT;
    if (scene->summary) {
        const enum status written = simulate_summary_write(summary, scene->summary);
        status = status == STATUS_DONE ? written : status;
    }
    return status;
}

/* ---- --verify ---- */

/* Runs the motion with finer steps. If they cannot control the errors of rates as well, as near a singular
 * state, they control those of positions alone, and the columns of rates are not kept. */
static void run_finer(struct trial *second, struct task *task, struct refdyn_options options,
                      struct summary *summary) {
    const double tol_rates = options.tol_rates;
    options.tol_rates = record_finer_rates(&options);
    simulate_trial_run(second, task, &options, NULL);
    summary->cpu_total_s += second->motion.cpu_s;
    if (second->result == REFDYN_OK || second->result == RECORD_INTERRUPTED || options.tol_rates == tol_rates)
        return;
    simulate_trial_release(second);
    options.tol_rates = tol_rates;
    task->has_estimate = false;
    simulate_trial_run(second, task, &options, NULL);
    summary->cpu_total_s += second->motion.cpu_s;
}

/* Repeats the motion to the same end with finer steps, and estimates the error of the first run. */
static enum status verify(const struct trial *trial, const struct task *task, struct summary *summary,
                          struct estimate *estimate) {
    const struct refdyn_integrator *integrator = &trial->motion.integrator;
    double share;
    const struct refdyn_options options = record_finer_options(integrator, &share);
    struct task again = *task;
    struct trial second;
    again.until = integrator->t;
    again.has_stops = false;
    again.on_start = NULL;
    run_finer(&second, &again, options, summary);
    enum status status = second.result == REFDYN_OK ? STATUS_DONE : STATUS_NUMBERS;
    if (status == STATUS_DONE) {
        simulate_estimate_make(estimate, &trial->track, &second.track, share);
        simulate_estimate_events(estimate, &trial->track, &trial->motion, &second.motion);
        summary->estimate = estimate;
    } else {
        fputs("refdyn: the finer motion of --verify:\n", stderr);
        print_failure(&second);
    }
    simulate_trial_release(&second);
    return status;
}

/* ---- --derivatives ---- */

/* Writes the rows with their derivatives, or without them if the motion has failed. */
static enum status write_rows(struct motion_derivatives *derivatives, struct trial *trial,
                              const struct task *task, const struct refdyn_options *integration,
                              FILE *numbers, struct row_sink *rows) {
    enum status status = STATUS_DONE;
    struct record_table table;
    const bool is_done = trial->usage == STATUS_DONE && trial->result == REFDYN_OK;
    if (!trial->is_started || trial->usage != STATUS_DONE)
        return STATUS_DONE;
    if (is_done)
        status = simulate_derivatives_run(derivatives, trial, task, integration);
    if (is_done && status == STATUS_DONE)
        return simulate_derivatives_write(derivatives, trial, numbers, rows) ? STATUS_DONE : STATUS_FAULT;
    simulate_table_start(&table, &trial->motion.integrator, trial->motion.scene->compiled.spatial);
    return simulate_row_sink_copy(numbers, rows, &table) ? status : STATUS_FAULT;
}

/* Runs the motion; its rows wait in a temporary file until their derivatives are known. */
static enum status run_with_derivatives(struct trial *trial, const struct task *task,
                                        const struct refdyn_options *integration, struct row_sink *rows,
                                        struct motion_derivatives *derivatives) {
    FILE *numbers = tmpfile();
    enum status status = simulate_derivatives_read(derivatives, task->scene, task->options);
    struct row_sink own = simulate_row_sink_numbers(numbers);
    *trial = (struct trial){.usage = status};
    if (status == STATUS_DONE && !numbers) {
        fprintf(stderr, "refdyn: a temporary file could not be opened: %s\n", strerror(errno));
        trial->usage = status = STATUS_FAULT;
    }
    if (status == STATUS_DONE) {
        simulate_trial_run(trial, task, integration, &own);
        status = write_rows(derivatives, trial, task, integration, numbers, rows);
    }
    if (numbers)
        fclose(numbers);
    return status;
}

static enum status simulate(const struct task *task, const struct refdyn_options *integration,
                            struct row_sink *rows) {
    struct target *target = task->scene->result;
    struct trial trial;
    struct estimate estimate = {.count = 0};
    struct motion_derivatives derivatives = {.count = 0};
    struct summary summary = {.trial = &trial, .derivatives = &derivatives};
    enum status derived = STATUS_DONE;
    if (options_text(task->options, "derivatives"))
        derived = run_with_derivatives(&trial, task, integration, rows, &derivatives);
    else
        simulate_trial_run(&trial, task, integration, rows);
    enum status status = trial.usage;
    if (status != STATUS_DONE)
        keep_part(target, false, false);
    else if (derived == STATUS_FAULT)
        keep_part(target, !rows->is_lost, false);
    else if (trial.result != REFDYN_OK)
        status = stop(&trial, target, rows);
    else {
        summary.cpu_total_s = trial.motion.cpu_s;
        enum status verified = STATUS_DONE;
        if (options_has(task->options, "verify") && trial.motion.integrator.t > trial.motion.record.from)
            verified = verify(&trial, task, &summary, &estimate);
        status = finish(&summary, task->scene);
        status = status == STATUS_DONE ? verified : status;
        status = status == STATUS_DONE ? derived : status;
    }
    simulate_estimate_release(&estimate);
    simulate_derivatives_release(&derivatives);
    simulate_trial_release(&trial);
    return status;
}

/* ---- --accuracy ---- */

/* Copies the rows of a temporary file to the result. Returns false and reports the error if not all could be
 * written. */
static bool copy_rows(struct candidate *from, struct row_sink *to, struct target *target) {
    struct record_table table;
    if (fflush(from->rows) != 0 || ferror(from->rows)) { /* errno is then from the failed write */
        fprintf(stderr, "refdyn: a temporary file could not be written: %s\n", strerror(errno));
        keep_part(target, false, false);
        return false;
    }
    if (!from->trial.is_started)
        return true;
    simulate_table_start(&table, &from->trial.motion.integrator, from->trial.motion.scene->compiled.spatial);
    const bool is_copied = simulate_row_sink_copy(from->rows, to, &table);
    if (to->is_lost)
        keep_part(target, false, false);
    return is_copied || !to->is_lost; /* the end of a text file reports its own error */
}

/* Reports the result of the search, whose best run is in the target. */
static enum status conclude(const struct search *search, const struct candidate *best,
                            const struct task *task, struct row_sink *rows) {
    struct target *target = task->scene->result;
    const struct summary summary = {.trial = &best->trial,
                                    .estimate = best->has_estimate ? &best->estimate : NULL,
                                    .accuracy = options_number(task->options, "accuracy"),
                                    .cpu_total_s = search->cpu_total_s};
    if (search->is_reached)
        return finish(&summary, task->scene);
    if (best->trial.result != REFDYN_OK)
        return stop(&best->trial, target, rows);
    simulate_summary_print(&summary);
    fprintf(stderr, "refdyn: --accuracy %g cannot be reached", summary.accuracy);
    if (best->has_estimate)
        fprintf(stderr, "; the best estimated error is %.2g", best->estimate.largest.error);
    fputs("\n", stderr);
    return keep_part(target, true, false) ? STATUS_NUMBERS : STATUS_FAULT;
}

static enum status search(const struct task *task, const struct refdyn_options *integration,
                          struct row_sink *rows) {
    struct target *target = task->scene->result;
    struct search search;
    enum status status = simulate_search_run(&search, task, integration);
    if (status == STATUS_DONE || status == STATUS_NUMBERS) {
        struct candidate *best = search.taken ? search.taken : search.last;
        status = copy_rows(best, rows, target) ? conclude(&search, best, task, rows) : STATUS_FAULT;
    } else
        keep_part(target, false, false);
    simulate_search_release(&search);
    return status;
}

/* ---- The command ---- */

static bool wants_hdf5(const struct options *options) {
    const char *output = options_text(options, "output");
    return output && format_names_hdf5(output);
}

/* After a signal the rows of the motion stay readable. */
static enum status run_task(const struct task *task, const struct refdyn_options *integration) {
    const struct options *options = task->options;
    const struct target *target = task->scene->result;
    struct row_sink rows = wants_hdf5(options) ? simulate_row_sink_hdf5(target->part, task)
                                               : simulate_row_sink_csv(target->file);
    const bool is_kept = options_has(options, "verify") || options_has(options, "derivatives") ||
                         options_number(options, "accuracy") > 0;
    const enum status status =
        simulate_check_times(task->scene, options, is_kept ? RECORD_KEPT_MAX : RECORD_OUTPUTS_MAX);
    if (status != STATUS_DONE)
        return status;
    record_print_gains(&task->scene->work, integration, stderr);
    system_interrupt_defer(true);
    return options_number(options, "accuracy") > 0 ? search(task, integration, &rows)
                                                   : simulate(task, integration, &rows);
}

static enum status check_error_options(const struct options *options,
                                       const struct refdyn_options *integration) {
    const double tol = options_number(options, "tol");
    const char *excluded = options_number(options, "accuracy") > 0             ? "--accuracy; use --tol"
                           : simulate_gsl_has(options_text(options, "method")) ? "the methods of GSL"
                                                                               : NULL;
    if (options_text(options, "derivatives") && excluded)
        return options_usage_error(options->command, "--derivatives excludes %s", excluded);
    const double lanes = options_number(options, "lanes");
    if (lanes > 0 && !options_text(options, "derivatives"))
        return options_usage_error(options->command, "--lanes needs --derivatives");
    const enum status checked = simulate_check_lanes(options);
    if (checked != STATUS_DONE)
        return checked;
    if (options_number(options, "accuracy") > 0 && (tol > 0 || integration->tol == 0))
        return options_usage_error(options->command,
                                   "--accuracy chooses the tolerance itself; it excludes %s",
                                   tol > 0                               ? "--tol"
                                   : options_number(options, "step") > 0 ? "--step"
                                                                         : "a method with fixed steps");
    if (options_has(options, "verify") && integration->tol > 0 &&
        integration->tol * record_finer_most < DBL_EPSILON)
        return options_usage_error(options->command, "--verify needs --tol %g or larger",
                                   DBL_EPSILON / record_finer_most);
    return STATUS_DONE;
}

static enum status check_drives(const struct scene *scene) {
    const struct model *model = &scene->generation.model;
    if (model->drive_count > 0)
        return STATUS_DONE;
    format_complain_line(model->file, model->place.line,
                         "drives: the model has none; --play needs those whose forces it applies");
    return STATUS_FAULT;
}

static enum status run_scene(struct scene *scene, const struct options *options,
                             struct refdyn_options *integration) {
    struct inputs inputs = {.path = NULL};
    const struct task task = {.scene = scene,
                              .options = options,
                              .until = options_number(options, "until"),
                              .has_stops = options_has(options, "stop"),
                              .has_estimate =
                                  options_has(options, "verify") || options_number(options, "accuracy") > 0,
                              .on_start = on_start};
    enum status status = simulate_fit(scene, options, integration);
    const char *play = options_text(options, "play"),
               *samples = play ? play : options_text(options, "inputs");
    if (status == STATUS_DONE && play)
        status = check_drives(scene);
    if (status == STATUS_DONE && samples) {
        scene->inputs = &inputs;
        status = scene_inputs_read(&inputs, samples, scene->model) ? STATUS_DONE : STATUS_FAULT;
        if (status == STATUS_DONE)
            scene_inputs_set(&inputs, scene->state.t, scene->work.x);
    }
    if (status == STATUS_DONE)
        status = simulate_place(scene, options);
    if (status == STATUS_DONE)
        status = run_task(&task, integration);
    scene->inputs = NULL;
    return status;
}

/* An HDF5 output must be a file, and has a group with a dataset for each course. */
static enum status check_hdf5(const struct scene *scene) {
    const struct model *model = &scene->generation.model;
    enum status status = STATUS_DONE;
    if (!scene->result->part) {
        format_complain_line(scene->result->name, 0, "output: not a regular file; HDF5 needs one");
        return STATUS_FAULT;
    }
    for (int i = 0; i < model->course_count; i++) {
        const struct course *course = &model->courses[i];
        const char *why = format_unfit_for_hdf5(course->name);
        if (why) {
            format_complain_line(
                course->place.file, course->place.line,
                format_text("courses: '%s': %s; rename the course, or write a CSV", course->name, why));
            status = STATUS_FAULT;
        }
    }
    return status;
}

/* Returns whether the work surely takes more than a second, so that it pays to wait for optimised functions:
 * many fixed steps, or the several motions of --accuracy. Any other motion changes over to them on its way.
 */
static bool is_long(const struct options *options) {
    const double step = options_number(options, "step");
    return options_number(options, "accuracy") > 0 ||
           (step > 0 && options_number(options, "until") / step > long_steps);
}

enum status simulate_run(const struct options *options) {
    struct refdyn_options integration;
    struct scene scene;
    if (wants_hdf5(options) && !HAS_HDF5)
        return options_usage_error(options->command, "-o %s: this refdyn is built without HDF5; write a CSV",
                                   options_text(options, "output"));
    enum status status = simulate_options(options, &integration);
    if (status == STATUS_DONE)
        status = check_error_options(options, &integration);
    if (status != STATUS_DONE)
        return status;
    const unsigned tangent = refdyn_method_is_implicit(integration.method) ? NEEDS_TANGENT : 0;
    const unsigned tier = is_long(options) ? NEEDS_OPTIMISED : 0;
    status = scene_open(&scene, options,
                        NEEDS_RESULT | NEEDS_POINT_RATES | simulate_needs(options) | tangent | tier,
                        options_state_path(options_text(options, "from")));
    if (status == STATUS_DONE && wants_hdf5(options))
        status = check_hdf5(&scene);
    if (status == STATUS_DONE)
        status = run_scene(&scene, options, &integration);
    scene_close(&scene);
    return status;
}

const struct option_rule simulate_sim_rules[] = {
    {"accuracy", "ERROR", OPTION_POSITIVE,
     "bound on the error of the whole motion [m, rad]; the tolerance is chosen to meet it", NULL, NULL},
    {"derivatives", "NAME,...", OPTION_LIST,
     "derivatives of all columns by these parameters, inputs and start values (NAME or NAME_d of a "
     "coordinate)",
     NULL, NULL},
    {"verify", NULL, OPTION_FLAG, "estimate the error of the whole motion by repeating it more accurately",
     NULL, NULL},
    {"stop", "NAME<VALUE", OPTION_TEXTS,
     "end when a column of the CSV falls below a value, or with > exceeds it (repeatable)", NULL, NULL},
    {.name = NULL}};
