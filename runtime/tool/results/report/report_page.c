/* What a report draws and writes about its studies: the figure of error over run time, and the HTML page. */
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

/* ---- The figure ---- */

enum { WIDTH = 900, HEIGHT = 480 };

/* The drawn runs of one series. */
struct points {
    double cpu_s[SETTINGS_MAX], error[SETTINGS_MAX];
    int count;
};

/* Errors below the floor are drawn at the floor; runs that have lost the motion are omitted. */
static void take_points(struct points *points, const struct study *study, const struct series *series) {
    for (int i = 0; i < series->count; i++) {
        const struct method_run *trial = &series->trials[i];
        const double error = report_is_settled(study, trial) ? fmax(trial->error, study->floor) : 0;
        if (error > 0) {
            points->cpu_s[points->count] = trial->cpu_s;
            points->error[points->count++] = error;
        }
    }
}

static void add_curve(struct chart *chart, const char *name, const struct points *points,
                      struct stroke stroke) {
    const int key = figures_chart_key(chart, name, strlen(name));
    chart->keys[key].stroke = stroke;
    figures_chart_add_curve(
        chart,
        (struct curve){
            .x = points->cpu_s, .y = points->error, .count = points->count, .stride = 1, .stroke = stroke});
}

/* The number of earlier series of the same method, which have other stabilisations. */
static int line_of(const struct study *study, const struct series *series) {
    int before = 0;
    for (const struct series *other = study->series; other < series; other++)
        before += other->method == series->method;
    return before;
}

static void add_series(struct chart *chart, const struct study *study, const struct series *series,
                       struct points *points) {
    take_points(points, study, series);
    if (points->count == 0)
        return;
    add_curve(chart, report_series_name(study, series), points,
              figures_style_method((int)series->method, line_of(study, series)));
}

/* Draws the floor from the quickest to the slowest run. */
static void add_floor(struct chart *chart, const struct study *study, struct points *floor) {
    floor->cpu_s[0] = INFINITY;
    for (int i = 0; i < chart->curve_count; i++)
        for (long j = 0; j < chart->curves[i].count; j++) {
            floor->cpu_s[0] = fmin(floor->cpu_s[0], chart->curves[i].x[j]);
            floor->cpu_s[1] = fmax(floor->cpu_s[1], chart->curves[i].x[j]);
        }
    floor->error[0] = floor->error[1] = study->floor;
    floor->count = 2;
    add_curve(chart, "floor", floor, figures_style_limit());
}

/* points: one item for each series, and one for the floor. */
static struct chart make_chart(const struct study *study, struct points *points) {
    struct chart chart = {.title = study->name,
                          .x_label = "CPU time of the integration [s]",
                          .y_label = study->has_points ? "largest position error of the points [m]"
                                                       : "largest error of a coordinate [m, rad]",
                          .is_x_logarithmic = true,
                          .is_y_logarithmic = true};
    for (int i = 0; i < study->series_count; i++)
        add_series(&chart, study, &study->series[i], &points[i]);
    if (chart.curve_count > 0 && study->floor > 0)
        add_floor(&chart, study, &points[study->series_count]);
    return chart;
}

void report_diagram_draw(FILE *out, const char *title, const struct study *studies, int count) {
    struct points *points = format_allocate((size_t)count * (SERIES_MAX + 1), sizeof *points);
    struct chart *charts = format_allocate((size_t)count, sizeof *charts);
    struct key head = {.name = title};
    struct figure figure = {
        .heads = &head, .head_count = 1, .charts = charts, .columns = 1, .width = WIDTH, .height = HEIGHT};
    for (int i = 0; i < count; i++) {
        charts[figure.count] = make_chart(&studies[i], points + i * (SERIES_MAX + 1));
        figure.count += charts[figure.count].curve_count > 0;
    }
    figures_draw(out, &figure);
}

/* ---- The page ---- */

static const char head[] =
    "<meta charset=\"utf-8\">\n<style>\n"
    "body { font: 15px/1.45 sans-serif; max-width: 62em; margin: 2em auto; padding: 0 1em; color: #222 }\n"
    "table { border-collapse: collapse; margin: 0.6em 0 }\n"
    "th, td { padding: 0.15em 0.8em 0.15em 0; border-bottom: 1px solid #ddd; text-align: right }\n"
    "th:first-child, td:first-child, td:last-child { text-align: left }\n"
    "svg { width: 100%; height: auto }\n</style>\n";

/* ---- Pieces */

static void put_cell(FILE *out, const char *text) {
    fputs("<td>", out);
    format_xml_text(out, text);
    fputs("</td>", out);
}

static void put_value(FILE *out, const char *format, double value) {
    fputs("<td>", out);
    if (isfinite(value))
        fprintf(out, format, value);
    fputs("</td>", out);
}

static void put_exact(FILE *out, double value) {
    char text[NUMBER_LENGTH];
    put_cell(out, exact_text(value, text));
}

static void put_row_of_texts(FILE *out, const char *name, const char *value) {
    fputs("<tr>", out);
    put_cell(out, name);
    put_cell(out, value);
    fputs("</tr>\n", out);
}

/* ---- Facts */

static const char *start_text(const struct options *options) {
    const char *from = options_text(options, "from");
    if (options_state_path(from))
        return "a given state";
    return from && strcmp(from, "statics") == 0 ? "the static equilibrium" : "the model's initial state";
}

static void put_motion(FILE *out, const struct scene *scene, const struct options *options,
                       const struct study_plan *plan) {
    const struct refdyn_model *model = scene->model;
    fputs("<table>\n", out);
    put_row_of_texts(out, "model", model->name);
    put_row_of_texts(out, "hash of its C", model->hash);
    put_row_of_texts(
        out, "size",
        format_text("coordinates %d, constraint rows %d, points %d", model->n, model->m, model->point_count));
    put_row_of_texts(out, "motion",
                     format_text("t = %g to %g s from %s, made consistent; states compared every %g s",
                                 scene->state.t, plan->until, start_text(options), plan->every));
    for (int i = 0; i < scene->generation.model.option_count; i++) {
        const struct model_option *option = &scene->generation.model.options[i];
        put_row_of_texts(out, option->name, option->value);
    }
    fputs("</table>\n", out);
}

static void put_named(FILE *out, const char *title, const struct refdyn_name *names, const double *values,
                      const double *rates, int count) {
    if (count == 0)
        return;
    fprintf(out, "<details><summary>%s</summary>\n<table>\n", title);
    for (int i = 0; i < count; i++) {
        fputs("<tr>", out);
        put_cell(out, names[i].name);
        put_exact(out, values[i]);
        if (rates)
            put_exact(out, rates[i]);
        put_cell(out, names[i].unit ? names[i].unit : "");
        fputs("</tr>\n", out);
    }
    fputs("</table>\n</details>\n", out);
}

char *report_page_facts(const struct scene *scene, const struct options *options,
                        const struct study_plan *plan) {
    const struct refdyn_model *model = scene->model;
    char *text;
    size_t size;
    FILE *out = format_stream(&text, &size);
    put_motion(out, scene, options, plan);
    put_named(out, "Parameters", model->parameters, scene->work.p, NULL, model->parameter_count);
    put_named(out, "Inputs", model->inputs, scene->work.x, NULL, model->input_count);
    put_named(out, "Start: coordinates and rates", model->coordinates, scene->q, scene->qd, model->n);
    fclose(out);
    return text;
}

/* ---- Runs */

static void put_error(FILE *out, const struct study *study, const struct method_run *trial) {
    if (trial->error < study->floor)
        fprintf(out, "<td>below %.1e</td>", study->floor);
    else
        put_value(out, "%.2e", trial->error);
}

static void put_trial(FILE *out, const struct study *study, const char *name,
                      const struct method_run *trial) {
    fputs("<tr>", out);
    put_cell(out, name);
    put_cell(out, report_trial_setting(trial));
    fprintf(out, "<td>%ld</td><td>%ld</td><td>%ld</td><td>%ld</td>", trial->steps, trial->rejected,
            trial->evaluations, trial->tangents);
    put_error(out, study, trial);
    put_value(out, "%.1e", trial->phi_max);
    put_value(out, "%.1e", trial->psi_max);
    put_value(out, "%.1e", trial->energy_error);
    put_value(out, "%.3g", report_is_done(trial) ? trial->cpu_s : NAN);
    put_cell(out, report_trial_outcome(trial));
    fputs("</tr>\n", out);
}

static void put_trials(FILE *out, const struct study *study) {
    fprintf(out,
            "<table>\n<tr><th>method</th><th>setting</th><th>steps</th><th>rejected</th><th>evaluations</th>"
            "<th>tangents</th><th>error [%s]</th><th>phi</th><th>psi</th><th>energy</th><th>CPU [s]</th>"
            "<th></th></tr>\n",
            report_study_unit(study));
    for (int i = 0; i < study->series_count; i++) {
        const struct series *series = &study->series[i];
        for (int j = 0; j < series->count; j++)
            put_trial(out, study, report_series_name(study, series), &series->trials[j]);
    }
    fputs("</table>\n", out);
}

/* The row of a series, or the heads if series is NULL. */
static void put_findings_row(FILE *out, const struct study *study, const struct series *series) {
    const char *kind = series ? "td" : "th";
    fputs("<tr>", out);
    for (int i = 0; i < FINDING_COLUMNS; i++) {
        fprintf(out, "<%s>", kind);
        format_xml_text(out, report_findings_cell(study, series, i));
        fprintf(out, "</%s>", kind);
    }
    fputs("</tr>\n", out);
}

static void put_findings(FILE *out, const struct study *study) {
    fputs("<table>\n", out);
    put_findings_row(out, study, NULL);
    for (int i = 0; i < study->series_count; i++)
        put_findings_row(out, study, &study->series[i]);
    fputs("</table>\n", out);
}

static void put_study(FILE *out, const struct study *study) {
    fputs("<h2>", out);
    format_xml_text(out, study->name);
    fprintf(out, "</h2>\n%s<h3>Findings</h3>\n<p>", study->facts);
    format_xml_text(out, report_findings_reference(study));
    fputs("</p>\n", out);
    put_findings(out, study);
    fprintf(out, "<p>%s</p>\n<h3>All runs</h3>\n", report_findings_note);
    put_trials(out, study);
}

void report_page_write(FILE *out, const char *title, const struct study *studies, int count,
                       const char *figure) {
    const char *drawing = strstr(figure, "<svg"); /* after the prologue of the SVG file */
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n", out);
    fprintf(out, "%s<title>", head);
    format_xml_text(out, title);
    fputs("</title>\n</head>\n<body>\n<h1>", out);
    format_xml_text(out, title);
    fprintf(out, "</h1>\n%s\n", drawing ? drawing : "");
    for (int i = 0; i < count; i++)
        put_study(out, &studies[i]);
    fputs("</body>\n</html>\n", out);
}
