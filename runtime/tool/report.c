/* `refdyn report`: error against run time of RK4, for each stabilisation, as CSV and SVG. */
#include "gnuplot.h"
#include "output.h"
#include "study.h"
#include "timing.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { VARIANTS_MAX = 8, WIDTH = 900, HEIGHT = 620 };

static const double budget_seconds = 80; /* of all runs together, when the steps are chosen here */

struct report {
    const struct options *options;
    char *model_name, *vary_name;
    char *values[VARIANTS_MAX]; /* of the varied option; NULL: the model as it is given */
    int variant_count;
    double steps[STEPS_MAX];
    int step_count; /* 0: chosen */
    struct study studies[VARIANTS_MAX];
    int done;
};

/* ---- What is asked for */

static enum status read_steps(struct report *report) {
    const char *at = report->options->steps;
    while (at && *at) {
        char *end;
        double step = strtod(at, &end);
        if (end == at || !isfinite(step) || step <= 0 || (*end && *end != ',') ||
            report->step_count == STEPS_MAX)
            return usage_error(report->options->command,
                               "--steps: '%s' is no list of up to %d positive numbers",
                               report->options->steps, STEPS_MAX);
        report->steps[report->step_count++] = step;
        at = end + (*end == ',');
    }
    return STATUS_DONE;
}

static enum status read_vary(struct report *report) {
    const char *text = report->options->vary, *equals = strchr(text, '=');
    if (!equals || equals == text || !equals[1])
        return usage_error(report->options->command, "--vary: '%s' is not of the form OPTION=V1,V2", text);
    report->vary_name = text_format("%.*s", (int)(equals - text), text);
    for (const char *at = equals + 1; *at;) {
        size_t length = strcspn(at, ",");
        if (report->variant_count == VARIANTS_MAX)
            return usage_error(report->options->command, "--vary: more than %d values", VARIANTS_MAX);
        report->values[report->variant_count++] = text_format("%.*s", (int)length, at);
        at += length + (at[length] == ',');
    }
    return STATUS_DONE;
}

static const struct option *find_option(const struct model *model, const char *name) {
    for (int i = 0; i < model->option_count; i++)
        if (strcmp(model->options[i].name, name) == 0)
            return &model->options[i];
    return NULL;
}

/* By default a model with flexible links is compared with its rigid form. */
static void vary_flexibility(struct report *report, const struct model *model) {
    const struct option *option = find_option(model, "n_rfe");
    if (!option || strcmp(option->value, "1") == 0) {
        report->variant_count = 1;
        return;
    }
    report->vary_name = text_format("n_rfe");
    report->values[report->variant_count++] = text_format("1");
    report->values[report->variant_count++] = text_format("%s", option->value);
}

/* Reads the model once for its name and options. */
static enum status plan_report(struct report *report) {
    struct scene scene = {.is_read = false};
    enum status status = read_steps(report);
    if (status == STATUS_DONE && report->options->vary)
        status = read_vary(report);
    if (status != STATUS_DONE)
        return status;
    status = scene_read(&scene, report->options);
    if (status == STATUS_DONE) {
        report->model_name = text_format("%s", scene.generation.model.name);
        if (!report->options->vary)
            vary_flexibility(report, &scene.generation.model);
        else if (!find_option(&scene.generation.model, report->vary_name))
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
    unsigned needs = NEEDS_MOTION | NEEDS_POINTS;
    if (options->from && strcmp(options->from, "statics") == 0)
        needs |= NEEDS_STATICS;
    enum status status = scene_open(&scene, options, needs, motion_state_path(options));
    if (status == STATUS_DONE)
        status = motion_place(&scene, options);
    if (status == STATUS_DONE && options->until <= scene.state.t)
        status = usage_error(options->command, "--until %g: the motion starts at t = %g", options->until,
                             scene.state.t);
    if (status == STATUS_DONE) {
        const double *steps = report->step_count ? report->steps : NULL;
        status = study_run(study, &scene, options, steps, report->step_count, seconds);
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
    double start = wall_seconds();
    motion_catch_interrupt();
    for (int i = 0; i < report->variant_count && status == STATUS_DONE; i++) {
        double left = budget_seconds - (wall_seconds() - start);
        status = run_variant(report, i, left / (report->variant_count - i));
    }
    return status;
}

/* ---- CSV and SVG */

static void put_trial(FILE *out, const struct study *study, const struct trial *trial, const char *kind) {
    const double values[] = {trial->cpu_s, trial->phi_max, trial->psi_max, trial->energy_error};
    fprintf(out, "%s,rk4,%s,%s,", study->name, stabilise_names[trial->stabilise], kind);
    fprintf(out, "%.6g,%ld,%ld,", trial->step, trial->steps, trial->evaluations);
    if (trial->track)
        fprintf(out, "%.6g", trial->error);
    for (int i = 0; i < 4; i++)
        fprintf(out, ",%.6g", values[i]);
    if (trial->result == REFDYN_OK)
        fputs(",done\n", out);
    else
        fprintf(out, ",\"stopped at t = %.6g s: %s\"\n", trial->stopped_t, refdyn_status_text(trial->result));
}

static bool write_csv(const struct report *report, const char *path) {
    struct output output;
    if (!output_open(&output, path))
        return false;
    fputs("variant,method,stabilise,kind,step_s,steps,evaluations,error,cpu_s,phi_max,psi_max,energy_error,"
          "outcome\n",
          output.file);
    for (int i = 0; i < report->done; i++) {
        const struct study *study = &report->studies[i];
        for (int j = 0; j < study->count; j++)
            put_trial(output.file, study, &study->trials[j], "trial");
        put_trial(output.file, study, &study->reference, "reference");
    }
    return output_close(&output);
}

/* A named block of `cpu_s,error` lines for each study and stabilisation. */
static int put_block(FILE *script, const struct study *study, int i, int stabilise) {
    int count = 0;
    fprintf(script, "$data_%d_%d << END\n", i, stabilise);
    for (int j = 0; j < study->count; j++) {
        const struct trial *trial = &study->trials[j];
        if ((int)trial->stabilise != stabilise || !trial->track || !(trial->error > 0) ||
            !isfinite(trial->error))
            continue;
        fprintf(script, "%.9g,%.9g\n", trial->cpu_s, trial->error);
        count++;
    }
    fputs("END\n", script);
    return count;
}

static void put_style(FILE *script) {
    fputs("set logscale xy\nset format x '1e%T'\nset format y '1e%T'\nset key outside bottom center "
          "horizontal\n"
          "set xlabel 'CPU time of the integration [s]'\nset lmargin 11\n",
          script);
}

static bool write_svg(const struct report *report, const char *path) {
    struct gnuplot gnuplot;
    bool counts[VARIANTS_MAX][STABILISE_COUNT];
    if (!gnuplot_open(&gnuplot, WIDTH, HEIGHT))
        return false;
    FILE *script = gnuplot.script;
    for (int i = 0; i < report->done; i++)
        for (int s = 0; s < STABILISE_COUNT; s++)
            counts[i][s] = put_block(script, &report->studies[i], i, s) > 0;
    put_style(script);
    char *title = text_format("%s, %g s: error against run time of RK4, one mark a step size",
                              report->model_name, report->options->until);
    fputs("set title ", script);
    gnuplot_quote(script, title);
    free(title);
    fprintf(script, "\nset ylabel '%s'\nplot ",
            report->studies[0].stride == 3 ? "largest position error of the points [m]"
                                           : "largest error of a coordinate [m, rad]");
    for (int i = 0; i < report->done; i++)
        for (int s = 0; s < STABILISE_COUNT; s++) {
            if (!counts[i][s])
                continue;
            fprintf(script,
                    "$data_%d_%d using 1:2 with linespoints linewidth 1.6 linecolor '%s' dashtype %s "
                    "pointtype %d "
                    "pointsize 0.7 title ",
                    i, s, plot_colours[s], plot_dashes[i % DASH_COUNT], 5 + 2 * (i % 5));
            char *name = text_format("%s, %s", report->studies[i].name, stabilise_names[s]);
            gnuplot_quote(script, name);
            free(name);
            fputs(", ", script);
        }
    fputs("NaN notitle\n", script);
    return gnuplot_draw(&gnuplot, path);
}

static void print_failures(const struct report *report) {
    for (int i = 0; i < report->done; i++)
        for (int j = 0; j < report->studies[i].count; j++) {
            const struct trial *trial = &report->studies[i].trials[j];
            if (trial->result != REFDYN_OK && trial->result != MOTION_INTERRUPTED)
                fprintf(stderr, "refdyn report: %s, %s, step %.4g s: stopped at t = %.4g s: %s\n",
                        report->studies[i].name, stabilise_names[trial->stabilise], trial->step,
                        trial->stopped_t, refdyn_status_text(trial->result));
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
    bool is_written = write_csv(report, csv) && write_svg(report, svg);
    free(svg);
    free(csv);
    print_failures(report);
    return is_written ? STATUS_DONE : STATUS_FAULT;
}

static void release_report(struct report *report) {
    for (int i = 0; i < report->done; i++) {
        study_release(&report->studies[i]);
        free((char *)report->studies[i].name);
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
    if (status == STATUS_DONE && motion_interrupted) {
        fputs("refdyn report: interrupted\n", stderr);
        status = STATUS_NUMBERS;
    }
    if (status == STATUS_DONE)
        status = write_report(report);
    release_report(report);
    return status;
}
