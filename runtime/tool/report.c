/* `refdyn report`: error against run time of all methods, as CSV, SVG and a page. */
#include "diagram.h"
#include "findings.h"
#include "output.h"
#include "text.h"
#include "page.h"
#include "timing.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { VARIANTS_MAX = 8, REPORT_OUTPUTS = 50 /* times at which runs are compared */ };

static const double seconds_default = 60; /* of all runs together */

struct report {
    const struct options *options;
    char *model_name, *vary_name;
    char *values[VARIANTS_MAX]; /* of the varied option; NULL: the model as it is given */
    int variant_count;
    struct study_plan plan;
    struct study studies[VARIANTS_MAX];
    int done;
};

/* ---- What is asked for */

static int by_descent(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

/* Item number `index` of a list "a,b,c" whose form is checked; NULL behind the last one. */
static char *list_item(const char *list, int index) {
    for (; index > 0 && list; index--)
        list = strchr(list, ',') ? strchr(list, ',') + 1 : NULL;
    return list ? text_format("%.*s", (int)strcspn(list, ","), list) : NULL;
}

/* A list of positive numbers below `most`, sorted from the loosest setting on. */
static enum status read_numbers(const struct options *options, const char *name, const char *text,
                                double most, double numbers[static SETTINGS_MAX], int *count) {
    char *item;
    for (int i = 0; (item = list_item(text, i)); i++) {
        double number = 0;
        const bool is_good = number_of_text(item, &number) && number > 0 && number < most && i < SETTINGS_MAX;
        free(item);
        if (!is_good)
            return usage_error(options->command, "--%s: '%s' is no list of up to %d numbers between 0 and %g",
                               name, text, SETTINGS_MAX, most);
        numbers[(*count)++] = number;
    }
    qsort(numbers, (size_t)*count, sizeof *numbers, by_descent);
    for (int i = 1; i < *count; i++)
        if (numbers[i] == numbers[i - 1])
            return usage_error(options->command, "--%s: '%s' has one number twice", name, text);
    return STATUS_DONE;
}

/* From 1e-2 to 1e-12. */
static void list_tolerances(struct study_plan *plan) {
    static const double tols[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
    plan->tol_count = sizeof tols / sizeof tols[0];
    memcpy(plan->tols, tols, sizeof tols);
}

static enum status read_methods(const struct options *options, struct study_plan *plan) {
    char known[METHODS_LENGTH];
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        plan->methods[method] = !options->methods;
    char *name;
    for (int i = 0; options->methods && (name = list_item(options->methods, i)); i++) {
        const int method = refdyn_method_find(name);
        free(name);
        if (method < 0)
            return usage_error(options->command, "--methods: '%s' is no list of %s", options->methods,
                               known_methods(known, false));
        plan->methods[method] = true;
    }
    return STATUS_DONE;
}

static enum status read_plan(struct report *report) {
    const struct options *options = report->options;
    struct study_plan *plan = &report->plan;
    plan->until = options->until;
    plan->are_tols_given = options->tols;
    enum status status = read_methods(options, plan);
    if (status == STATUS_DONE && options->tols)
        status = read_numbers(options, "tols", options->tols, 1, plan->tols, &plan->tol_count);
    else
        list_tolerances(plan);
    if (status == STATUS_DONE && options->steps)
        status =
            read_numbers(options, "steps", options->steps, options->until, plan->steps, &plan->step_count);
    return status;
}

static enum status read_vary(struct report *report) {
    const char *text = report->options->vary, *equals = strchr(text, '=');
    if (!equals || equals == text || !equals[1])
        return usage_error(report->options->command, "--vary: '%s' is not of the form OPTION=V1,V2", text);
    report->vary_name = text_format("%.*s", (int)(equals - text), text);
    for (int i = 0; i < report->options->setting_count; i++)
        if (strcmp(report->options->settings[i].name, report->vary_name) == 0)
            return usage_error(report->options->command, "--vary: --set gives a value to %s, too",
                               report->vary_name);
    char *value;
    for (int i = 0; (value = list_item(equals + 1, i)); i++) {
        if (i == VARIANTS_MAX) {
            free(value);
            return usage_error(report->options->command, "--vary: more than %d values", VARIANTS_MAX);
        }
        report->values[report->variant_count++] = value;
    }
    return check_list(report->options->command, "vary", equals + 1);
}

static bool has_option(const struct model *model, const char *name) {
    for (int i = 0; i < model->option_count; i++)
        if (strcmp(model->options[i].name, name) == 0)
            return true;
    return false;
}

/* Reads the model once for its name and options. */
static enum status plan_report(struct report *report) {
    struct scene scene = {.is_read = false};
    enum status status = read_plan(report);
    if (status == STATUS_DONE && report->options->vary)
        status = read_vary(report);
    if (status != STATUS_DONE)
        return status;
    status = scene_read_again(&scene, report->options);
    if (status == STATUS_DONE) {
        report->model_name = text_format("%s", scene.generation.model.name);
        if (!report->options->vary)
            report->variant_count = 1;
        else if (!has_option(&scene.generation.model, report->vary_name))
            status = usage_error(report->options->command, "--vary: the model has no option '%s'",
                                 report->vary_name);
    }
    scene_close(&scene);
    return status;
}

/* ---- The runs */

static enum status run_study(struct report *report, struct study *study, const struct options *options,
                             double seconds) {
    struct scene scene;
    struct study_plan plan = report->plan;
    unsigned needs = NEEDS_MOTION | NEEDS_POINTS | NEEDS_TANGENT | NEEDS_DIAGONAL;
    if (options->from && strcmp(options->from, "statics") == 0)
        needs |= NEEDS_STATICS;
    enum status status = scene_open(&scene, options, needs, motion_state_path(options));
    if (status == STATUS_DONE)
        status = motion_place(&scene, options);
    if (status == STATUS_DONE)
        status = motion_check_times(&scene, options);
    if (status == STATUS_DONE) {
        plan.every = options->every > 0 ? options->every : (options->until - scene.state.t) / REPORT_OUTPUTS;
        study->facts = page_facts(&scene, options, &plan);
        status = study_run(study, &plan, &scene, seconds);
    }
    scene_close(&scene);
    return status;
}

static enum status run_variant(struct report *report, int i, double seconds) {
    struct study *study = &report->studies[i];
    struct options options = *report->options;
    struct assignment *settings = allocate((size_t)options.setting_count + 1, sizeof *settings);
    for (int j = 0; j < options.setting_count; j++)
        settings[j] = options.settings[j];
    if (report->values[i])
        settings[options.setting_count++] = (struct assignment){report->vary_name, report->values[i]};
    options.settings = settings;
    study->name = report->values[i] ? text_format("%s=%s", report->vary_name, report->values[i])
                                    : text_format("%s", report->model_name);
    report->done++;
    enum status status = run_study(report, study, &options, seconds);
    free(settings);
    return status;
}

static enum status run_all(struct report *report) {
    enum status status = STATUS_DONE;
    const double seconds = report->options->seconds > 0 ? report->options->seconds : seconds_default;
    const double start = wall_seconds();
    motion_catch_interrupt();
    for (int i = 0; i < report->variant_count && status == STATUS_DONE; i++) {
        const double left = fmax(seconds - (wall_seconds() - start), 0);
        status = run_variant(report, i, left / (report->variant_count - i));
    }
    return status;
}

/* ---- CSV */

/* A number, or nothing where there is none. */
static void put_csv_number(FILE *out, double value, bool is_there) {
    if (is_there)
        fprintf(out, "%.6g", value);
    fputc(',', out);
}

static void put_csv_trial(FILE *out, const struct study *study, const struct trial *trial, const char *kind) {
    char *outcome = trial_outcome(trial);
    fprintf(out, "%s,%s,%s,", study->name, kind, refdyn_method_name((int)trial->method));
    put_csv_number(out, trial->tol, trial->tol > 0);
    put_csv_number(out, trial->step, trial->step > 0);
    fprintf(out, "%s,%ld,%ld,%ld,%ld,", stabilise_names[trial->stabilise], trial->steps, trial->rejected,
            trial->evaluations, trial->tangents);
    put_csv_number(out, trial->error, is_done(trial));
    put_csv_number(out, trial->phi_max, true);
    put_csv_number(out, trial->psi_max, true);
    put_csv_number(out, trial->energy_error, true);
    put_csv_number(out, trial->cpu_s, is_done(trial));
    fprintf(out, strchr(outcome, ',') ? "\"%s\"\n" : "%s\n", outcome);
    free(outcome);
}

static bool write_csv(const struct report *report, const char *path) {
    struct output output;
    if (!output_open(&output, path))
        return false;
    fputs("variant,kind,method,tol,step,stabilise,steps,rejected,evaluations,tangents,error,phi_max,psi_max,"
          "energy_error,cpu_s,result\n",
          output.file);
    for (int i = 0; i < report->done; i++) {
        const struct study *study = &report->studies[i];
        for (int j = 0; j < REFERENCES; j++)
            put_csv_trial(output.file, study, &study->references[j], "reference");
        for (int j = 0; j < study->series_count; j++)
            for (int k = 0; k < study->series[j].count; k++)
                put_csv_trial(output.file, study, &study->series[j].trials[k], "run");
    }
    return output_close(&output);
}

/* ---- The page, and what is said */

static bool write_page(const struct report *report, const char *path, const char *svg) {
    struct output output;
    char *figure = file_text(svg);
    const bool is_open = figure && output_open(&output, path);
    if (is_open) {
        char *title = text_format("%s: error against run time", report->model_name);
        page_write(output.file, title, report->studies, report->done, figure);
        free(title);
    }
    free(figure);
    return is_open && output_close(&output);
}

static void print_findings(const struct report *report) {
    for (int i = 0; i < report->done; i++) {
        const struct study *study = &report->studies[i];
        char *lasting = findings_lasting(study), *times = findings_times(study);
        printf("== %s\n%s%s", study->name, lasting, times);
        free(times);
        free(lasting);
    }
}

static enum status write_report(const struct report *report) {
    const char *folder = report->options->output;
    if (mkdir(folder, 0777) != 0 && errno != EEXIST) {
        fprintf(stderr, "refdyn: %s: cannot be made: %s\n", folder, strerror(errno));
        return STATUS_FAULT;
    }
    char *csv = text_format("%s/%s.csv", folder, report->model_name);
    char *svg = text_format("%s/%s.svg", folder, report->model_name);
    char *page = text_format("%s/%s.html", folder, report->model_name);
    char *title = text_format("%s, %g s: error against run time, one mark a tolerance or step",
                              report->model_name, report->options->until);
    const bool is_written = write_csv(report, csv) &&
                            diagram_draw(svg, title, report->studies, report->done) &&
                            write_page(report, page, svg);
    free(title);
    free(page);
    free(svg);
    free(csv);
    print_findings(report);
    return is_written ? STATUS_DONE : STATUS_FAULT;
}

static void release_report(struct report *report) {
    for (int i = 0; i < report->done; i++) {
        free(report->studies[i].facts);
        free(report->studies[i].name);
    }
    for (int i = 0; i < report->variant_count; i++)
        free(report->values[i]);
    free(report->vary_name);
    free(report->model_name);
    free(report);
}

enum status run_report(const struct options *options) {
    struct report *report = allocate(1, sizeof *report);
    report->options = options;
    enum status status = plan_report(report);
    if (status == STATUS_DONE)
        status = run_all(report);
    if (motion_interrupted) {
        fputs("refdyn report: interrupted\n", stderr);
        status = STATUS_NUMBERS;
    }
    if (status == STATUS_DONE)
        status = write_report(report);
    release_report(report);
    return status;
}
