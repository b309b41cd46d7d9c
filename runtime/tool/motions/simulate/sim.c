/* `refdyn sim`: computes one motion and writes its rows and a summary; optionally estimates its error
 * (--verify) or finds its tolerance (--accuracy). */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* Factor of the tolerance in the second run of --verify. Errors scatter about the tolerance by a factor of
 * ten, mostly those of collocation, so a tenth of it would sometimes have the same error. */
static const double verify_part = 0.01;
/* Below verify_least rounding exceeds the error of the steps; the factor is then at most verify_most. */
static const double verify_least = 1e-14, verify_most = 0.1;

/* Fixed steps that take more than a second for any model with a few joints. */
static const double long_steps = 1e5;

enum { MOVES_SHOWN = 8 };

static void print_remedies(const struct options *options, const struct refdyn_options *chosen) {
    static const char *const what[] = {
        [REFDYN_NONE] = "with --stabilise none it stays off; --stabilise baumgarte would pull it in",
        [REFDYN_BAUMGARTE] = "the stabilisation (baumgarte) pulls it in",
        [REFDYN_PROJECT] =
            "with projections the motion continues from the nearest state on the programme, and "
            "only its first row is off; baumgarte would pull it in"};
    fprintf(stderr,
            "  Two remedies: solve for a consistent start with --start project,\n"
            "  or start off the programme: %s.\n  This motion runs from the start as it is%s.\n",
            chosen->gain_share > 0 && chosen->tol > 0
                ? "gains from the step (baumgarte-auto) allow no step with a local error there; gains of "
                  "the rows (baumgarte), or --step, pull it in"
                : what[chosen->stabilise],
            options_text(options, "start") ? ", as requested" : "");
}

static double farthest_move(const double *moved, int n, int *most) {
    for (int j = 0; j < n; j++)
        *most = fabs(moved[j]) > fabs(moved[*most]) ? j : *most;
    return fabs(moved[*most]);
}

/* Prints the coordinates that a projection has moved most, the farthest first. */
static void print_moves(const struct refdyn_integrator *integrator, const double *q) {
    const struct refdyn_model *model = integrator->work->model;
    double *left = format_allocate((size_t)model->n, sizeof *left);
    int most = 0;
    memcpy(left, integrator->start_moved, (size_t)model->n * sizeof *left);
    fprintf(stderr, "refdyn: warning: the start is far from the programme. The projection moves");
    for (int i = 0; i < MOVES_SHOWN && farthest_move(left, model->n, &most) > 0; i++) {
        fprintf(stderr, "%s %s by %.4g %s to %.6g", i ? "," : "", model->coordinates[most].name,
                integrator->start_moved[most], model->coordinates[most].unit,
                q[most] + integrator->start_moved[most]);
        left[most] = 0;
    }
    fputs("; choose a nearer start if another assembly is meant\n", stderr);
}

/* Reports a start off the programme: the residual of each row, and the remedies. */
static void print_start(const struct options *options, const struct motion *motion) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    static const char *const levels[] = {"position", "velocity", "acceleration"};
    const struct refdyn_workspace *work = integrator->work;
    char text[2][NUMBER_LENGTH];
    if (!integrator->start_is_off)
        return;
    if (integrator->start_is_far)
        print_moves(integrator, motion->scene->q);
    if (integrator->options.project_start) {
        fprintf(stderr,
                "refdyn: the start was off the programme (largest |phi| %.4g, |psi| %.4g) and was projected "
                "onto it\n",
                integrator->start.phi, integrator->start.psi);
        return;
    }
    fprintf(stderr, "refdyn: warning: the start is off the programme:\n");
    for (int i = 0; i < work->m; i++) {
        enum refdyn_row_level level = work->model->rows[i].level;
        if (level == REFDYN_ACCELERATION)
            continue;
        fprintf(stderr, "  %s (%s): ", work->model->rows[i].name, levels[level]);
        if (level == REFDYN_POSITION)
            fprintf(stderr, "phi = %s, ", exact_text(work->phi[i], text[0]));
        fprintf(stderr, "psi = %s\n", exact_text(work->psi[i], text[1]));
    }
    print_remedies(options, &integrator->options);
}

/* Warns of impacts whose value is beyond zero at the start: a body that has already passed its stop does not
 * hit it. */
static void print_beyond(const struct motion *motion) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    char text[NUMBER_LENGTH];
    if (model->event_count == 0)
        return;
    double *values = format_allocate((size_t)model->event_count + (size_t)model->kink_count, sizeof *values);
    model->event(work->p, work->x, integrator->t, integrator->q, integrator->qd, values);
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].is_impact && model->events[i].direction * values[i] > 0)
            fprintf(stderr,
                    "refdyn: warning: the start is beyond the event %s, whose value is %s; an impact occurs "
                    "only when "
                    "the value reaches zero from the other side\n",
                    model->events[i].name, exact_text(values[i], text));
}

/* Warns of contacts whose state says that they rest although they do not. */
static void print_free_contacts(const struct motion *motion) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    const struct refdyn_model *model = integrator->work->model;
    for (int i = 0; i < model->event_count; i++) {
        const struct refdyn_event *event = &model->events[i];
        const int k = event->contact - 1 - refdyn_programme_rows(model);
        const int place = k >= 0 ? model->changes[event->first_change].place : -1;
        if (place >= 0 && motion->values[place] != 0 && integrator->contact_mode[k] == REFDYN_CONTACT_FREE)
            fprintf(stderr, "refdyn: warning: %s is set, but the contact does not rest at the start\n",
                    model->parameters[place].name);
    }
}

/* ---- Runs ---- */

static void on_start(const struct task *task, const struct motion *motion) {
    system_target_keep_part(task->scene->result);
    print_start(task->options, motion);
    print_beyond(motion);
    print_free_contacts(motion);
    scene_print_redundant_rows(&task->scene->work);
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
        fprintf(stderr, "refdyn: what was computed until then is in %s%s\n", target->part,
                has_last ? "; its last row is the complete last state" : "");
    return true;
}

/* Reports attempts to cross a singular position, where the rows lose rank. */
static void print_refused(const struct refdyn_refused_crossing *refused) {
    char text[NUMBER_LENGTH];
    if (refused->tries == 0)
        return;
    fprintf(stderr, "refdyn: crossing the singular position was attempted %d time%s, last through t = %s s",
            refused->tries, refused->tries > 1 ? "s" : "", exact_text(refused->t, text));
    if (isfinite(refused->stretch))
        fprintf(stderr, " by a step of %.3g s", refused->stretch);
    fprintf(stderr, ": %s\n", refdyn_refusal_text(refused->why));
}

/* Prints the residuals at the start, and where its projection has ended. */
static void print_start_residuals(const struct trial *trial) {
    const struct scene *scene = trial->motion.scene;
    const struct refdyn_integrator *integrator = &trial->motion.integrator;
    if (trial->result != REFDYN_NO_CONVERGENCE && trial->result != REFDYN_ROWS_INCONSISTENT)
        return;
    scene_print_residuals(integrator->work, scene->state.t, scene->q, scene->qd, "the start");
    if (memcmp(scene->q, integrator->q, (size_t)scene->model->n * sizeof *integrator->q) != 0)
        scene_print_residuals(integrator->work, scene->state.t, integrator->q, integrator->qd,
                              "where the projection ended");
}

/* Returns whether a force of the model saturates with a rate. */
static bool has_friction(const struct refdyn_integrator *integrator) {
    return integrator->work->model->saturates;
}

static void print_failure(const struct trial *trial) {
    const struct motion *motion = &trial->motion;
    const struct refdyn_integrator *integrator = &motion->integrator;
    const struct scene *scene = motion->scene;
    char text[NUMBER_LENGTH], refused[REFUSED_LENGTH];
    if (trial->unfit)
        fprintf(stderr, "refdyn: column %s is infinite or not a number\n", trial->unfit);
    if (!trial->is_started) {
        scene_numbers_failed(scene, trial->result, scene->state.t, scene->q, scene->qd);
        print_start_residuals(trial);
    } else if (trial->result == MOTION_INTERRUPTED || trial->result == MOTION_NOT_WRITTEN)
        fprintf(stderr, "refdyn: %s at t = %s s\n",
                trial->result == MOTION_INTERRUPTED ? "interrupted" : "the rows could no longer be written",
                exact_text(integrator->t, text));
    else if (trial->result == REFDYN_REFUSED)
        simulate_events_print_refused(integrator, scene_refused_fact(scene, integrator->work, refused));
    else {
        if (integrator->cause > 0 && integrator->cause != trial->result)
            fprintf(stderr, "refdyn: at t = %s s: %s\n", exact_text(integrator->failed_t, text),
                    refdyn_status_text(integrator->cause));
        scene_numbers_failed(scene, trial->result, integrator->t, integrator->q, integrator->qd);
        simulate_events_print_failed(integrator);
        if (scene_print_condition(integrator->work, integrator->t, integrator->q, integrator->qd) &&
            integrator->options.singular == REFDYN_STOP)
            fputs("refdyn: --singular pass crosses it if a branch can be followed\n", stderr);
        print_refused(&integrator->refused);
        if (trial->result == REFDYN_SLIDES ||
            (trial->result == REFDYN_STEP_TOO_SMALL && has_friction(integrator)))
            fputs("refdyn: a force jumps, or reaches a limit, as a rate passes a value; give friction a "
                  "width of 1e-10 or more, as in rd.friction(level, rate, width)\n",
                  stderr);
        if (trial->result == REFDYN_EVENTS_ACCUMULATE)
            fputs("refdyn: impacts of rd.event never come to rest; use rd.contact\n", stderr);
        if (trial->result == REFDYN_SLIDES)
            fputs("refdyn: a relay needs two levels: write two events that set an input\n", stderr);
        if (trial->result > REFDYN_OK && !trial->unfit)
            fputs("refdyn: a smaller --step or --tol may help\n", stderr);
    }
}

static enum status stop(const struct trial *trial, struct target *target, const struct row_sink *rows) {
    const struct summary summary = {.trial = trial};
    print_failure(trial);
    if (trial->is_started)
        simulate_summary_print(&summary);
    const bool is_kept = keep_part(target, trial->is_started && !rows->is_lost, !trial->unfit);
    return is_kept && trial->result != MOTION_NOT_WRITTEN ? STATUS_NUMBERS : STATUS_FAULT;
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

/* Options of the finer run: a hundredth of the tolerance, or half the step. The largest step shrinks as well,
 * since something else may limit the steps. If iterations use another tolerance, the factor applies to that
 * one. *share is the expected ratio of the errors. */
static struct refdyn_options finer(const struct refdyn_integrator *integrator, double *share) {
    struct refdyn_options options = integrator->options;
    const int order = refdyn_method_order(integrator->method);
    if (options.tol > 0) {
        const long *steps_by = integrator->statistics.steps_by;
        if (steps_by[REFDYN_RADAU9] > 0 || steps_by[REFDYN_GAUSS12] > 0)
            options.tol = refdyn_settled_tolerance(options.tol);
        *share = fmin(fmax(verify_part, verify_least / options.tol), verify_most);
        options.tol *= *share;
        options.step_max = integrator->statistics.step_largest * pow(*share, 1.0 / order);
        if (has_friction(integrator) && refdyn_has_tangent(integrator->work->model))
            options.method = REFDYN_RADAU9; /* another method may miss the same events in both runs */
    } else {
        options.step /= 2;
        *share = pow(0.5, order);
    }
    return options;
}

/* Repeats the motion to the same end with finer steps, and estimates the error of the first run. */
static enum status verify(const struct trial *trial, const struct task *task, struct summary *summary,
                          struct estimate *estimate) {
    const struct refdyn_integrator *integrator = &trial->motion.integrator;
    double share;
    const struct refdyn_options options = finer(integrator, &share);
    struct task again = *task;
    struct trial second;
    again.until = integrator->t;
    again.has_stops = false;
    again.on_start = NULL;
    simulate_trial_run(&second, &again, &options, NULL);
    enum status status = second.result == REFDYN_OK ? STATUS_DONE : STATUS_NUMBERS;
    if (status == STATUS_DONE) {
        simulate_estimate_make(estimate, &trial->track, &second.track, share);
        summary->estimate = estimate;
        summary->cpu_total_s += second.motion.cpu_s;
    } else {
        fputs("refdyn: the finer motion of --verify:\n", stderr);
        print_failure(&second);
    }
    simulate_trial_release(&second);
    return status;
}

static enum status simulate(const struct task *task, const struct refdyn_options *integration,
                            struct row_sink *rows) {
    struct target *target = task->scene->result;
    struct trial trial;
    struct estimate estimate = {.count = 0};
    struct summary summary = {.trial = &trial};
    simulate_trial_run(&trial, task, integration, rows);
    enum status status = trial.usage;
    if (status != STATUS_DONE)
        keep_part(target, false, false);
    else if (trial.result != REFDYN_OK)
        status = stop(&trial, target, rows);
    else {
        summary.cpu_total_s = trial.motion.cpu_s;
        enum status verified = STATUS_DONE;
        if (options_has(task->options, "verify") && trial.motion.integrator.t > trial.motion.from)
            verified = verify(&trial, task, &summary, &estimate);
        status = finish(&summary, task->scene);
        status = status == STATUS_DONE ? verified : status;
    }
    simulate_estimate_release(&estimate);
    simulate_trial_release(&trial);
    return status;
}

/* ---- --accuracy ---- */

/* Copies the rows of a temporary file to the result. Returns false and reports the error if not all could be
 * written. */
static bool copy_rows(struct candidate *from, struct row_sink *to, struct target *target) {
    struct table table;
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

/* Returns whether a row has gains, or could have gains that the runtime computes from the step. */
static bool has_gains(const struct scene *scene, bool are_set_by_step) {
    const struct refdyn_model *model = scene->model;
    for (int i = 0; model->gains && i < 2 * model->m; i++)
        if (model->gains[i] >= 0 && (are_set_by_step || scene->work.p[model->gains[i]] != 0))
            return true;
    return false;
}

static void print_gains(const struct scene *scene, const struct refdyn_options *integration) {
    if (integration->stabilise == REFDYN_BAUMGARTE && scene->model->m > 0 &&
        !has_gains(scene, integration->gain_share > 0))
        fputs("refdyn: warning: no row has gains (alpha, beta), so that residuals drift under baumgarte; "
              "--stabilise project keeps them small\n",
              stderr);
}

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
    const enum status status = simulate_check_times(task->scene, options);
    if (status != STATUS_DONE)
        return status;
    print_gains(task->scene, integration);
    system_interrupt_defer(true);
    return options_number(options, "accuracy") > 0 ? search(task, integration, &rows)
                                                   : simulate(task, integration, &rows);
}

static enum status check_error_options(const struct options *options,
                                       const struct refdyn_options *integration) {
    const double tol = options_number(options, "tol");
    if (options_number(options, "accuracy") > 0 && (tol > 0 || integration->tol == 0))
        return options_usage_error(options->command,
                                   "--accuracy chooses the tolerance itself; it excludes %s",
                                   tol > 0                               ? "--tol"
                                   : options_number(options, "step") > 0 ? "--step"
                                                                         : "a method with fixed steps");
    if (options_has(options, "verify") && integration->tol > 0 &&
        integration->tol * verify_most < DBL_EPSILON)
        return options_usage_error(options->command, "--verify needs --tol %g or larger",
                                   DBL_EPSILON / verify_most);
    return STATUS_DONE;
}

static enum status run_scene(struct scene *scene, const struct options *options,
                             struct refdyn_options *integration) {
    struct inputs inputs = {.path = NULL};
    const struct task task = {.scene = scene,
                              .options = options,
                              .until = options_number(options, "until"),
                              .has_stops = options_has(options, "stop"),
                              .on_start = on_start};
    enum status status = simulate_fit(scene, options, integration);
    if (status == STATUS_DONE && options_text(options, "inputs")) {
        scene->inputs = &inputs;
        status = scene_inputs_read(&inputs, options_text(options, "inputs"), scene->model) ? STATUS_DONE
                                                                                           : STATUS_FAULT;
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
    {"verify", NULL, OPTION_FLAG, "estimate the error of the whole motion by repeating it more accurately",
     NULL, NULL},
    {"stop", "NAME<VALUE", OPTION_TEXTS,
     "end when a column of the CSV falls below a value, or with > exceeds it (repeatable)", NULL, NULL},
    {.name = NULL}};
