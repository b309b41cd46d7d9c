/* `refdyn report`: measures error against run time of all methods; writes CSV, SVG and an HTML page. */
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/support/system/system.h"
#include "gen/base/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VARIANTS_MAX = 8, REPORT_OUTPUTS = 50 /* times at which runs are compared */ };

static const double seconds_default = 60; /* for all runs together */

struct report {
    const struct options *options;
    const char *model_name, *vary_name;
    const char *values[VARIANTS_MAX]; /* of the varied option; NULL for the model as given */
    int variant_count;
    struct study_plan plan;
    struct study studies[VARIANTS_MAX];
    int done;
    struct targets targets;
    struct target *csv, *svg, *page;
};

/* ---- The plan */

static int by_descent(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

/* Reads a list of positive numbers below `most`, and sorts it from the loosest setting on. */
static enum status read_numbers(const struct options *options, const char *name, const char *text,
                                double most, struct settings *settings) {
    for (const char **item = options_list(text); *item; item++) {
        double number;
        if (!text_to_number(*item, &number) || !(number > 0 && number < most) ||
            settings->count == SETTINGS_MAX)
            return options_usage_error(options->command,
                                       "--%s: '%s' is not a list of up to %d numbers between 0 and %g", name,
                                       text, SETTINGS_MAX, most);
        settings->list[settings->count++] = number;
    }
    settings->are_given = true;
    qsort(settings->list, (size_t)settings->count, sizeof *settings->list, by_descent);
    for (int i = 1; i < settings->count; i++)
        if (settings->list[i] == settings->list[i - 1])
            return options_usage_error(options->command, "--%s: '%s' has a number twice; give it once", name,
                                       text);
    return STATUS_DONE;
}

/* Default settings: tolerances from 1e-2 to 1e-12; steps halved from the time between outputs on. */
static void list_settings(struct study_plan *plan) {
    static const double tols[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
    if (!plan->tols.are_given) {
        plan->tols.count = sizeof tols / sizeof tols[0];
        memcpy(plan->tols.list, tols, sizeof tols);
    }
    for (int i = 0; i < HALVINGS_MAX && !plan->steps.are_given; i++)
        plan->steps.list[plan->steps.count++] = ldexp(plan->every, -i);
}

static enum status read_methods(const struct options *options, struct study_plan *plan) {
    const char *methods = options_text(options, "methods");
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        plan->methods[method] = !methods;
    for (const char **name = options_list(methods); *name; name++) {
        const int method = refdyn_method_find(*name);
        if (method < 0)
            return options_usage_error(options->command, "--methods: %s",
                                       simulate_unknown_method(options->command, *name));
        plan->methods[method] = true;
    }
    return STATUS_DONE;
}

static enum status read_plan(struct report *report) {
    const struct options *options = report->options;
    const char *steps = options_text(options, "steps"), *tols = options_text(options, "tols");
    const double until = options_number(options, "until");
    struct study_plan *plan = &report->plan;
    plan->until = until;
    enum status status = read_methods(options, plan);
    if (status == STATUS_DONE && tols)
        status = read_numbers(options, "tols", tols, 1, &plan->tols);
    if (status == STATUS_DONE && steps)
        status = read_numbers(options, "steps", steps, until, &plan->steps);
    return status;
}

static enum status read_vary(struct report *report) {
    const char *text = options_text(report->options, "vary"), *equals = strchr(text, '=');
    if (!equals || equals == text || !equals[1])
        return options_usage_error(report->options->command, "--vary: '%s' is not of the form OPTION=V1,V2",
                                   text);
    report->vary_name = format_text("%.*s", (int)(equals - text), text);
    for (int i = 0; i < report->options->setting_count; i++)
        if (strcmp(report->options->settings[i].name, report->vary_name) == 0)
            return options_usage_error(report->options->command,
                                       "--vary: --set sets %s, too; remove one of them", report->vary_name);
    for (const char **value = options_list(equals + 1); *value; value++) {
        if (report->variant_count == VARIANTS_MAX)
            return options_usage_error(report->options->command, "--vary: at most %d values are allowed",
                                       VARIANTS_MAX);
        report->values[report->variant_count++] = *value;
    }
    return options_check_list(report->options->command, "vary", equals + 1);
}

static bool has_option(const struct model *model, const char *name) {
    for (int i = 0; i < model->option_count; i++)
        if (strcmp(model->options[i].name, name) == 0)
            return true;
    return false;
}

/* Opens NAME.ending in the folder of -o. */
static struct target *open_file(struct report *report, const char *ending) {
    return system_target_open(
        &report->targets,
        format_text("%s/%s.%s", options_text(report->options, "output"), report->model_name, ending));
}

/* Opens all outputs before the runs. */
static enum status open_files(struct report *report, const struct scene *scene) {
    const char *state = options_state_path(options_text(report->options, "from"));
    scene_spare_sources(scene, &report->targets);
    if (state)
        system_targets_spare(&report->targets, state);
    if (!system_targets_make_folder(&report->targets, options_text(report->options, "output")))
        return STATUS_FAULT;
    report->csv = open_file(report, "csv");
    report->svg = report->csv ? open_file(report, "svg") : NULL;
    report->page = report->svg ? open_file(report, "html") : NULL;
    return report->page ? STATUS_DONE : STATUS_FAULT;
}

/* Reads the model once for its name and options. */
static enum status plan_report(struct report *report) {
    const char *vary = options_text(report->options, "vary");
    struct scene scene = {.is_read = false};
    enum status status = read_plan(report);
    if (status == STATUS_DONE && vary)
        status = read_vary(report);
    if (status != STATUS_DONE)
        return status;
    status = scene_read(&scene, report->options, false);
    if (status == STATUS_DONE) {
        report->model_name = format_text("%s", scene.generation.model.name);
        if (!vary)
            report->variant_count = 1;
        else if (!has_option(&scene.generation.model, report->vary_name))
            status = options_usage_error(report->options->command, "--vary: the model has no option '%s'",
                                         report->vary_name);
    }
    if (status == STATUS_DONE)
        status = open_files(report, &scene);
    scene_close(&scene);
    return status;
}

/* ---- The runs */

static enum status run_study(struct report *report, struct study *study, const struct options *options,
                             double seconds) {
    const double every = options_number(options, "every");
    struct scene scene;
    struct study_plan plan = report->plan;
    enum status status =
        scene_open(&scene, options, simulate_needs(options) | NEEDS_TANGENT | NEEDS_OPTIMISED,
                   options_state_path(options_text(options, "from")));
    if (status == STATUS_DONE)
        status = simulate_place(&scene, options);
    if (status == STATUS_DONE)
        status = simulate_check_times(&scene, options, RECORD_KEPT_MAX);
    if (status == STATUS_DONE) {
        plan.every = every > 0 ? every : (options_number(options, "until") - scene.state.t) / REPORT_OUTPUTS;
        list_settings(&plan);
        study->facts = report_page_facts(&scene, options, &plan);
        status = report_study_run(study, &plan, &scene, seconds);
    }
    scene_close(&scene);
    return status;
}

static enum status run_variant(struct report *report, int i, double seconds) {
    struct study *study = &report->studies[i];
    struct options options = *report->options;
    struct setting *settings = format_allocate((size_t)options.setting_count + 1, sizeof *settings);
    for (int j = 0; j < options.setting_count; j++)
        settings[j] = options.settings[j];
    if (report->values[i])
        settings[options.setting_count++] = (struct setting){report->vary_name, report->values[i], "--vary"};
    options.settings = settings;
    study->name =
        report->values[i] ? format_text("%s=%s", report->vary_name, report->values[i]) : report->model_name;
    report->done++;
    return run_study(report, study, &options, seconds);
}

static enum status run_all(struct report *report) {
    enum status status = STATUS_DONE;
    const double seconds = options_number(report->options, "seconds") > 0
                               ? options_number(report->options, "seconds")
                               : seconds_default;
    const double start = system_wall_seconds();
    system_interrupt_defer(true);
    for (int i = 0; i < report->variant_count && status == STATUS_DONE; i++) {
        const double left = fmax(seconds - (system_wall_seconds() - start), 0);
        status = run_variant(report, i, left / (report->variant_count - i));
    }
    return status;
}

/* ---- CSV */

/* Writes a finite number, or an empty field. */
static void put_csv_number(FILE *out, double value, bool is_there) {
    if (is_there && isfinite(value))
        fprintf(out, "%.6g", value);
    fputc(',', out);
}

static void put_csv_trial(FILE *out, const struct study *study, const struct method_run *trial,
                          const char *kind) {
    format_csv_text(out, study->name);
    fprintf(out, ",%s,%s,", kind, refdyn_method_name((int)trial->method));
    put_csv_number(out, trial->tol, trial->tol > 0);
    put_csv_number(out, trial->step, trial->step > 0);
    fprintf(out, "%s,%ld,%ld,%ld,%ld,", record_stabilise_names[trial->stabilise], trial->steps,
            trial->rejected, trial->evaluations, trial->tangents);
    put_csv_number(out, trial->error, report_is_done(trial));
    put_csv_number(out, trial->phi_max, true);
    put_csv_number(out, trial->psi_max, true);
    put_csv_number(out, trial->energy_error, !isnan(trial->energy_error));
    put_csv_number(out, trial->cpu_s, report_is_done(trial));
    format_csv_text(out, report_trial_outcome(trial));
    fputc('\n', out);
}

static bool write_csv(const struct report *report) {
    FILE *out = report->csv->file;
    fputs("variant,kind,method,tol,step,stabilise,steps,rejected,evaluations,tangents,error,phi_max,psi_max,"
          "energy_error,cpu_s,result\n",
          out);
    for (int i = 0; i < report->done; i++) {
        const struct study *study = &report->studies[i];
        for (int j = 0; j < study->reference_count; j++)
            put_csv_trial(out, study, &study->references[j], "reference");
        for (int j = 0; j < study->series_count; j++)
            for (int k = 0; k < study->series[j].count; k++)
                put_csv_trial(out, study, &study->series[j].trials[k], "run");
    }
    return system_target_finish(report->csv);
}

/* ---- The figure, the page and the findings */

static bool draw(const struct report *report, char **figure) {
    size_t size;
    FILE *out = format_stream(figure, &size);
    const char *title = format_text("%s, %g s: error against run time, one mark a tolerance or step",
                                    report->model_name, options_number(report->options, "until"));
    report_diagram_draw(out, title, report->studies, report->done);
    fclose(out);
    fwrite(*figure, 1, size, report->svg->file);
    return system_target_finish(report->svg);
}

static bool write_page(const struct report *report, const char *figure) {
    const char *title = format_text("%s: error against run time%s", report->model_name,
                                    system_interrupted ? ", interrupted" : "");
    report_page_write(report->page->file, title, report->studies, report->done, figure);
    return system_target_finish(report->page);
}

/* The width of the widest text in the column. */
static int find_width(const struct study *study, int column) {
    size_t widest = strlen(report_findings_cell(study, NULL, column));
    for (int i = 0; i < study->series_count; i++) {
        const size_t width = strlen(report_findings_cell(study, &study->series[i], column));
        widest = width > widest ? width : widest;
    }
    return (int)widest;
}

/* Prints the heads if series is NULL. */
static void print_row(const struct study *study, const struct series *series) {
    const int last = FINDING_COLUMNS - 1;
    for (int i = 0; i < last; i++)
        printf("%-*s  ", find_width(study, i), report_findings_cell(study, series, i));
    puts(report_findings_cell(study, series, last));
}

static void print_findings(const struct study *study) {
    printf("== %s\n%s", study->name, report_findings_reference(study));
    print_row(study, NULL);
    for (int i = 0; i < study->series_count; i++)
        print_row(study, &study->series[i]);
    puts(report_findings_note);
}

static enum status write_report(const struct report *report) {
    char *figure = NULL;
    const bool is_written = write_csv(report) && draw(report, &figure) && write_page(report, figure);
    free(figure);
    for (int i = 0; i < report->done; i++)
        print_findings(&report->studies[i]);
    return is_written ? STATUS_DONE : STATUS_FAULT;
}

/* After an interruption, drops the last study if it has no complete reference to compare with. */
static void forget_unfinished(struct report *report) {
    if (report->done > 0 && report->studies[report->done - 1].reference_count < REFERENCES)
        report->done--;
    fprintf(stderr, "refdyn report: interrupted%s\n",
            report->done > 0 ? "; the report has the runs so far" : " before a reference was found");
}

static void release_report(struct report *report) {
    system_targets_release(&report->targets);
    for (int i = 0; i < VARIANTS_MAX; i++)
        free(report->studies[i].facts);
}

static enum status run_report(const struct options *options) {
    struct report *report = format_allocate(1, sizeof *report);
    report->options = options;
    enum status status = plan_report(report);
    if (status == STATUS_DONE)
        status = run_all(report);
    system_interrupt_accept(); /* further signals must not keep the report from being written */
    if (system_interrupted)
        forget_unfinished(report);
    if (status == STATUS_DONE || (system_interrupted && report->done > 0))
        status = write_report(report);
    release_report(report);
    return status;
}

static const char *list_methods(const struct command *command) {
    (void)command;
    return simulate_methods(false);
}

static const struct option_rule report_rules[] = {
    {"methods", "a,b,c", OPTION_LIST, "methods to compare (default: all)", NULL, list_methods},
    {"tols", "a,b,c", OPTION_LIST,
     "tolerances of methods with adaptive steps (default: each power of ten from 1e-2 to 1e-12)", NULL, NULL},
    {"steps", "a,b,c", OPTION_LIST,
     "steps of methods with fixed steps [s] (default: from the largest stable step downward)", NULL, NULL},
    {"seconds", "S", OPTION_POSITIVE, "time for all runs together [s] (default 60)", NULL, NULL},
    {"vary", "OPTION=V1,V2", OPTION_TEXT, "repeat the study for these values of a structural option", NULL,
     NULL},
    {.name = NULL}};

const struct command report_command = {
    .name = "report",
    .run = run_report,
    .operands = "MODEL.lua",
    .options = "output! until! every from hold methods tols steps seconds vary set fold",
    .tables = {report_rules, simulate_rules, equilibria_rules, scene_rules},
    .output = "DIR",
    .purpose = "error against run time of all methods, as CSV, SVG and HTML",
    .help =
        "Every method over a range of tolerances, or of steps with each stabilisation, from a start on the "
        "programme.\n"
        "The reference is a motion on which two methods of different kinds agree, compared at fifty times by "
        "default.\n"
        "Writes NAME.csv, NAME.svg and NAME.html into the folder of -o, and prints the findings.\n"
        "Runs that exceed --seconds are stopped and listed. Times, and which runs these are, differ from "
        "call to call; all\n"
        "other results do not.\n\n"
        "  refdyn report models/manipulator.lua --from statics --until 2 -o out\n"
        "  refdyn report models/manipulator.lua --until 1 --vary n_rfe=1,2,4 --methods rk8,rodas5p -o out\n"};
