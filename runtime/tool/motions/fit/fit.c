/* `refdyn fit`: finds values of a model from measured data, and writes FIT.json. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/fit/fit.h"
#include "runtime/tool/support/system/system.h"

/* ---- Preparation ---- */

/* Motions computed at the same time; each has a table of columns. */
static void start_tables(struct fit *fit) {
    const size_t count = (size_t)fit->table.count;
    fit->rooms_of_thread = fit->batch.lanes ? fit->batch.lanes->width : 1;
    const int rooms = fit->batch.threads * fit->rooms_of_thread;
    bool *is_wanted = format_allocate(count, sizeof *is_wanted);
    for (int k = 0; k < fit->signal_count; k++)
        is_wanted[fit->signals[k].column] = true;
    fit->tables = format_allocate((size_t)rooms, sizeof *fit->tables);
    for (int i = 0; i < rooms; i++) {
        simulate_table_start(&fit->tables[i], &fit->motion.integrator, fit->scene->compiled.spatial);
        record_table_want(&fit->tables[i], is_wanted);
    }
}

static enum status prepare(struct fit *fit) {
    struct scene *scene = fit->scene;
    enum status status = simulate_fit(scene, fit->options, &fit->integration);
    if (status == STATUS_DONE)
        status = simulate_place(scene, fit->options);
    if (status != STATUS_DONE)
        return status;
    const int result = simulate_start(&fit->motion, scene, &fit->integration, scene->state.t + 1, 0);
    if (result != REFDYN_OK)
        return scene_numbers_failed(scene, result, scene->state.t, scene->q, scene->qd);
    simulate_table_start(&fit->table, &fit->motion.integrator, scene->compiled.spatial);
    status = fit_values_find(fit);
    if (status == STATUS_DONE && options_has(fit->options, "check"))
        fit_check_add_columns(fit);
    if (status == STATUS_DONE)
        status = options_has(fit->options, "check") ? fit_data_imagine(fit) : fit_data_read(fit);
    if (status == STATUS_DONE)
        status =
            simulate_derivatives_batch(&fit->variables, scene, fit->options, &fit->integration, &fit->batch);
    if (status != STATUS_DONE)
        return status;
    fit->batch.threads = system_processors();
    fit->batch.stop = fit_is_stopped;
    start_tables(fit);
    fit_start_scale(fit);
    return STATUS_DONE;
}

/* ---- The start ---- */

/* The search cannot find values that only act together: reports them by name, and writes what is known. */
static enum status refuse_dependent(struct fit *fit, const struct fit_solution *solution,
                                    const struct fit_certainty *certainty) {
    for (int i = 0; i < certainty->group_count; i++) {
        const char *names = fit_group_text(certainty->groups[i]);
        const bool is_alone = !certainty->groups[i][1];
        format_complain(
            "refdyn: %s: %s: %s: %s\n", fit->scene->model->name, fit_option_text(fit, "vary"), names,
            is_alone ? "the measured columns do not depend on it; omit it or measure another column"
                     : "act only together on the measured columns; fix one of them or measure another "
                       "column");
    }
    fit_report_write(fit, solution, certainty);
    return STATUS_FAULT;
}

/* Evaluates the start, and refuses values that the data cannot distinguish. */
static enum status check_start(struct fit *fit, const double *from) {
    const size_t rows = (size_t)fit_residual_count(fit, false, INFINITY), count = (size_t)fit->count;
    struct fit_solution start = {.rows = (int)rows, .starts = 1};
    struct fit_certainty certainty;
    if (rows < count) {
        format_complain_line(
            fit->data[0].path, 0,
            format_text("data: %zu measurements for %zu values; must have more", rows, count));
        return STATUS_FAULT;
    }
    start.u = format_allocate(count, sizeof *start.u);
    memcpy(start.u, from, count * sizeof *from);
    start.r = format_allocate_large(rows, sizeof *start.r);
    start.J = format_allocate_large(rows * count, sizeof *start.J);
    const enum fit_outcome outcome = fit_residuals(fit, INFINITY, from, start.r, start.J, rows);
    enum status status = outcome == FIT_DONE ? STATUS_DONE : fit_report_outcome(fit, outcome);
    if (status == STATUS_DONE) {
        for (size_t i = 0; i < rows; i++)
            start.chi2 += start.r[i] * start.r[i];
        fit_certainty_find(fit, &start, &certainty);
        if (certainty.is_dependent)
            status = refuse_dependent(fit, &start, &certainty);
    }
    free(start.r);
    free(start.J);
    return status;
}

/* ---- The fit ---- */

static enum status find(struct fit *fit) {
    struct fit_solution solution = {.outcome = FIT_FAILED};
    struct fit_certainty certainty;
    double *from = format_allocate((size_t)fit->all_count, sizeof *from);
    for (int k = 0; k < fit->all_count; k++)
        from[k] = fit_unknown_of(&fit->values[k], fit->values[k].start);
    system_interrupt_defer(true);
    if (options_has(fit->options, "check"))
        return fit_check(fit, from);
    enum status status = fit_start_compare(fit, from);
    if (status == STATUS_DONE)
        status = check_start(fit, from);
    if (status != STATUS_DONE)
        return status;
    system_progress_start(&fit->progress, "fit");
    fit_search(fit, from, &solution);
    system_progress_end(&fit->progress);
    if (solution.outcome == FIT_STOPPED || !isfinite(solution.chi2))
        return fit_report_outcome(fit, solution.outcome);
    fit_certainty_find(fit, &solution, &certainty);
    fit_report_print(fit, &solution, &certainty);
    status = fit_report_write(fit, &solution, &certainty);
    free(solution.r);
    free(solution.J);
    if (solution.outcome == FIT_STUCK) {
        fprintf(
            stderr,
            "refdyn: %s: the search ended before chi2 was least: no step decreases it further; the motion "
            "may be less accurate than the data, so use a smaller --tol\n",
            fit->scene->model->name);
        return STATUS_NUMBERS;
    }
    return status;
}

static enum status run_scene(struct scene *scene, const struct options *options,
                             const struct refdyn_options *integration, void *context) {
    const struct fit_request *request = context;
    struct fit fit = {.options = options, .scene = scene, .integration = *integration, .request = *request};
    for (int i = 0; i < request->data_count; i++) /* those of FIT.lua, too */
        if (!system_targets_spare(&scene->targets, request->data[i].path))
            return STATUS_FAULT;
    enum status status = prepare(&fit);
    if (status == STATUS_DONE)
        status = find(&fit);
    simulate_release(&fit.motion);
    return status;
}

/* ---- What is asked ---- */

static bool is_fit_file(const char *path) {
    return text_ends_with(path, ".lua");
}

/* FIT.lua replaces the options and operands of the request. */
static enum status check_file(const struct options *options) {
    static const char *const replaced[] = {"vary", "noise", "held-out"};
    const char *path = options->operands[1];
    for (int i = 0; i < 3; i++)
        if (options_has(options, replaced[i]))
            return options_usage_error(options->command, "--%s is set by %s, too; remove one of them",
                                       replaced[i], path);
    if (options->operand_count > 2)
        return options_usage_error(options->command, "%s names the data; omit %s", path,
                                   options->operands[2]);
    return STATUS_DONE;
}

/* With --check there are no data yet, and --until ends the motion; otherwise the data end it. */
static enum status check_operands(const struct options *options) {
    const bool is_check = options_has(options, "check"), has_until = options_has(options, "until"),
               is_file = options->operand_count > 1 && is_fit_file(options->operands[1]);
    if (is_file && check_file(options) != STATUS_DONE)
        return STATUS_USAGE;
    if (!is_file && !options_has(options, "vary"))
        return options_usage_error(options->command, "--vary NAME,... is missing; add it or FIT.lua");
    if (!is_file && !options_has(options, "noise"))
        return options_usage_error(options->command,
                                   "--noise COLUMN=SIGMA,... is missing; add it or FIT.lua");
    if (!is_check && options->operand_count < 2)
        return options_usage_error(options->command, "DATA.csv is missing");
    if (!is_check && (has_until || options_has(options, "every")))
        return options_usage_error(options->command, "--%s needs --check; the data have their own times",
                                   has_until ? "until" : "every");
    if (is_check && options->operand_count > 1 && !is_file)
        return options_usage_error(options->command, "--check needs no data; omit %s", options->operands[1]);
    if (is_check && options_has(options, "held-out"))
        return options_usage_error(options->command, "--check needs no data; omit --held-out");
    if (is_check && !has_until)
        return options_usage_error(options->command, "--check needs --until, the end of the motion");
    return STATUS_DONE;
}

static enum status read_request(const struct options *options, struct fit_request *request) {
    *request = (struct fit_request){.path = NULL};
    return options->operand_count > 1 && is_fit_file(options->operands[1])
               ? fit_file_read(options, request)
               : fit_request_read(options, request);
}

/* Messages about values that the model refuses later name the file. */
static void set_origins(struct options *options, const struct fit_request *request) {
    struct option_origin *origin = format_allocate(1, sizeof *origin);
    *origin = (struct option_origin){"vary", "vary", request->place};
    if (!request->path)
        return;
    options->origins = origin;
    options->origin_count = 1;
}

static enum status run_fit(const struct options *given) {
    struct fit_request request;
    struct options own = *given;
    enum status status = check_operands(&own);
    if (status == STATUS_DONE)
        status = read_request(&own, &request);
    if (status != STATUS_DONE)
        return status;
    set_origins(&own, &request);
    return simulate_run_search(&own, run_scene, &request);
}

static const struct option_rule fit_rules[] = {
    {"vary", "NAME,...", OPTION_LIST,
     "the values to be found: parameters, inputs, start values; NAME=FROM:TO gives bounds", NULL, NULL},
    {"noise", "COLUMN=SIGMA,...", OPTION_LIST,
     "the measured columns, each with the standard deviation of its noise", NULL, NULL},
    {"check", NULL, OPTION_FLAG,
     "before data exist: how well these columns determine the values until --until, and which further column "
     "would help most",
     NULL, NULL},
    {"held-out", "DATA.csv,...", OPTION_LIST, "files that only judge the result", NULL, NULL},
    {.name = NULL}};

const struct command fit_command = {
    .name = "fit",
    .run = run_fit,
    .operands = "MODEL.lua FIT.lua|DATA.csv...",
    .options = "output! vary noise held-out check until every method step tol tol-rates step-max from "
               "stabilise singular start hold release way lanes parameters set",
    .tables = {fit_rules, simulate_rules, equilibria_rules, scene_rules},
    .output = "FIT.json",
    .purpose = "values of a model from measured data",
    .help =
        "DATA.csv has the time t and columns named as in `sim`; an empty field is a gap, and columns named "
        "as inputs move the model.\n"
        "FIT.lua, rd.fit { vary = ..., noise = ..., data = ... }, replaces --vary, --noise, --held-out and "
        "the "
        "data; it also knows sensors, and starts of each file.\n"
        "FIT.json has values, standard errors, correlations, and what the data do not determine.\n\n"
        "  refdyn fit models/manipulator.lua run.csv --vary E,eta,m_E=1:3 --noise column_psi=2e-4,E_xdd=0.05 "
        "-o fit.json\n"
        "  refdyn sim models/manipulator.lua --parameters fit.json --until 2 -o fitted.csv\n"};
