/* What a report says about its studies: the reference in sentences; order, stability and CPU time of each
 * method as cells of a table; the figure of error over run time; the HTML page. */
#include <math.h>
#include <string.h>

#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/support/format/format.h"

/* ---- Findings ---- */

/* Errors at which methods are compared. */
static const double levels[LEVEL_COUNT] = {1e-3, 1e-6, 1e-9};

enum { SLOPE_RUNS = 3 };                /* any two points are on a line */
static const double clear_of_floor = 3; /* errors above this multiple of the floor belong to the method, */
static const double clear_of_rounding =
    30; /* as do errors above this multiple of the least error of a series that has reached rounding */
static const double gain_least =
    0.7; /* ratio to the error at the setting before; it is 0.5 for order 1 and half the step */
static const double plateau_slope = 0.05; /* log steps over log 1/tol: below half of the 1/8 of order 8 */

/* The unit of errors. */
static const char *study_unit(const struct study *study) {
    return study->has_points ? "m" : "m or rad";
}

/* "rk4", or "rk4, baumgarte" if the method has several stabilisations. */
static const char *series_name(const struct study *study, const struct series *series) {
    int same = 0;
    for (int i = 0; i < study->series_count; i++)
        same += study->series[i].method == series->method;
    return format_text("%s%s%s", refdyn_method_name((int)series->method), same > 1 ? ", " : "",
                       same > 1 ? record_stabilise_names[series->stabilise] : "");
}

/* "tolerance 1e-06" or "step 0.001 s". */
static const char *trial_setting(const struct method_run *trial) {
    return trial->tol > 0 ? format_text("tolerance %.3g", trial->tol)
                          : format_text("step %.3g s", trial->step);
}

const char *report_trial_outcome(const struct method_run *trial) {
    if (report_is_done(trial))
        return "done";
    if (trial->result == RECORD_TOO_SLOW)
        return format_text("stopped: too slow, about %.2g s expected but only %.2g s left", trial->cpu_s,
                           trial->cpu_limit_s);
    const bool has_cause = trial->cause > 0 && trial->cause != trial->result;
    return format_text("stopped at t = %.6g s: %s%s%s", trial->stopped_t, refdyn_status_text(trial->result),
                       has_cause ? ", after: " : "", has_cause ? refdyn_status_text(trial->cause) : "");
}

static double setting_of(const struct method_run *trial) {
    return trial->tol > 0 ? trial->tol : trial->step;
}

/* ---- The reference */

static const char *kind_of(enum refdyn_method method) {
    if (!refdyn_method_is_implicit(method))
        return "explicit";
    return method == REFDYN_GAUSS12 || method == REFDYN_RADAU9 ? "collocation" : "Rosenbrock";
}

const char *report_findings_reference(const struct study *study) {
    const struct method_run *a = &study->references[0], *b = &study->references[1];
    const char *kind = kind_of(a->method), *unit = study_unit(study);
    const bool is_found = report_has_reference(study);
    struct text text = {.memory = &format_memory};
    text_add(&text, "%s %s at tolerance %g and %s at tolerance %g ",
             is_found ? "Reference:" : "No reference:", refdyn_method_name((int)a->method), a->tol,
             refdyn_method_name((int)b->method), b->tol);
    if (is_found)
        text_add(&text, "agree to %.2g %s at %ld times; ", study->floor, unit, study->outputs);
    else
        text_add(&text, "differ by %.2g %s on a way of %.2g; ", study->floor, unit, study->way);
    text_add(&text, "errors are distances from the first, and errors below %.2g %s are not claimed.\n",
             study->floor, unit);
    if (strcmp(kind, kind_of(b->method)) == 0)
        text_add(
            &text,
            "Both methods of the reference are %s methods, which makes it weaker: no method of another kind "
            "completed the motion.\n",
            kind);
    return text.data;
}

/* ---- The order that errors show */

static double least_error(const struct study *study, const struct series *series) {
    double least = INFINITY;
    for (int i = 0; i < series->count; i++)
        if (report_is_settled(study, &series->trials[i]))
            least = fmin(least, series->trials[i].error);
    return least;
}

/* Errors above this floor are errors of the formula: larger than what the reference can resolve, and than
 * rounding. A series has reached rounding if a smaller step or tolerance gained nothing near its least error.
 */
static double floor_of(const struct study *study, const struct series *series) {
    const double rounding = clear_of_rounding * least_error(study, series);
    double before = INFINITY;
    bool is_met = false;
    for (int i = 0; i < series->count; i++)
        if (report_is_settled(study, &series->trials[i])) {
            is_met = is_met || (before < rounding && series->trials[i].error > gain_least * before);
            before = series->trials[i].error;
        }
    return fmax(clear_of_floor * study->floor, is_met ? rounding : 0);
}

/* Least-squares slope of log error over log setting, above the floor. */
static const char *tell_slope(const struct study *study, const struct series *series) {
    const double floor = floor_of(study, series);
    double x = 0, y = 0, xx = 0, xy = 0;
    int n = 0;
    for (int i = 0; i < series->count; i++) {
        const struct method_run *trial = &series->trials[i];
        if (!report_is_settled(study, trial) || !(trial->error > floor))
            continue;
        const double u = log(setting_of(trial)), v = log(trial->error);
        x += u;
        y += v;
        xx += u * u;
        xy += u * v;
        n++;
    }
    if (n < SLOPE_RUNS)
        return "-";
    return format_text("%s^%.2f (%d runs)", series->is_fixed ? "step" : "tolerance",
                       (n * xy - x * y) / (n * xx - x * x), n);
}

static const char *tell_least_error(const struct study *study, const struct series *series) {
    const double least = least_error(study, series);
    return least <= study->floor ? "floor" : isfinite(least) ? format_text("%.1e", least) : "-";
}

/* ---- What rules the step */

/* The first run near the motion after a larger step that failed or left it; 0 if there is none. */
static int edge_of_steps(const struct study *study, const struct series *series) {
    for (int i = 1; i < series->count; i++)
        if (report_is_settled(study, &series->trials[i]) && !report_is_settled(study, &series->trials[i - 1]))
            return i;
    return 0;
}

/* While a tighter tolerance hardly needs more steps, stability limits them instead of the error. Returns the
 * last such run, 0 if there is none. */
static int end_of_plateau(const struct series *series) {
    int last = 0;
    for (int i = 1; i < series->count && last == i - 1; i++) {
        const struct method_run *now = &series->trials[i], *before = now - 1;
        const double more = log((double)now->steps / (double)before->steps);
        if (report_is_done(now) && report_is_done(before) &&
            more < plateau_slope * log(before->tol / now->tol))
            last = i;
    }
    return last;
}

static double mean_step(const struct study *study, const struct method_run *trial) {
    return (study->references[0].stopped_t - study->from) / (double)trial->steps;
}

/* For fixed steps the largest stable one. For tolerances those at which stability limits the steps, which
 * does not happen with the automatic choice and implicit methods. */
static const char *tell_stability(const struct study *study, const struct series *series) {
    const int edge = series->is_fixed ? edge_of_steps(study, series) : 0;
    if (edge > 0)
        return format_text("step %.3g s, not %.3g s", series->trials[edge].step,
                           series->trials[edge - 1].step);
    const bool has_limit =
        !series->is_fixed && series->method != REFDYN_AUTO && !refdyn_method_is_implicit(series->method);
    const int last = has_limit ? end_of_plateau(series) : 0;
    if (last > 0)
        return format_text("step %.2g s at tolerances from %g to %g", mean_step(study, &series->trials[last]),
                           series->trials[0].tol, series->trials[last].tol);
    return "-";
}

/* ---- What ended early */

/* Adds the first run from `first` on that ended early, for lack of time if is_slow, otherwise for another
 * reason, and how many further runs did. */
static void put_stops(struct text *text, const struct series *series, int first, bool is_slow) {
    const struct method_run *stopped = NULL;
    int more = -1;
    for (int i = first; i < series->count; i++) {
        const struct method_run *trial = &series->trials[i];
        if (report_is_done(trial) || (trial->result == RECORD_TOO_SLOW) != is_slow)
            continue;
        stopped = stopped ? stopped : trial;
        more++;
    }
    if (!stopped)
        return;
    text_add(text, "%s%s: %s", text->length > 0 ? "; " : "", trial_setting(stopped),
             is_slow ? "too slow" : report_trial_outcome(stopped));
    if (more > 0)
        text_add(text, "; and %d more", more);
}

/* The column of stability already has the steps beyond its limit. */
static const char *tell_stops(const struct study *study, const struct series *series) {
    struct text text = {.memory = &format_memory};
    put_stops(&text, series, series->is_fixed ? edge_of_steps(study, series) : 0, false);
    put_stops(&text, series, 0, true);
    return text.data ? text.data : "";
}

/* ---- CPU times */

/* CPU time of the quickest run with at most this error, INFINITY if there is none. */
static double quickest(const struct series *series, double level) {
    double cpu_s = INFINITY;
    for (int i = 0; i < series->count; i++)
        if (report_is_done(&series->trials[i]) && series->trials[i].error <= level)
            cpu_s = fmin(cpu_s, series->trials[i].cpu_s);
    return cpu_s;
}

/* CPU time, and in brackets its ratio to the quickest method except auto. */
static const char *tell_time(const struct study *study, const struct series *series, double level) {
    const double cpu_s = level >= study->floor ? quickest(series, level) : INFINITY;
    double best = INFINITY;
    for (int i = 0; i < study->series_count; i++)
        if (study->series[i].method != REFDYN_AUTO)
            best = fmin(best, quickest(&study->series[i], level));
    if (!isfinite(cpu_s))
        return "-";
    return isfinite(best) ? format_text("%.3g (%.2f)", cpu_s, cpu_s / best) : format_text("%.3g", cpu_s);
}

/* ---- The table */

const char report_findings_note[] =
    "CPU times are for the integration on one core, the shortest of repeated runs; brackets "
    "compare with the quickest method except auto. They differ from call to call. All else is the same on "
    "every machine, for the runs that there was time for.";

const char *report_findings_cell(const struct study *study, const struct series *series, int column) {
    static const struct {
        const char *head;
        const char *(*tell)(const struct study *study, const struct series *series);
    } told[] = {{"method", series_name},
                {"error proportional to", tell_slope},
                {"least error", tell_least_error},
                {"limit of stability", tell_stability},
                {"ended early", tell_stops}};
    const int level = column - 1, place = column == 0 ? 0 : column - LEVEL_COUNT;
    if (level < 0 || level >= LEVEL_COUNT)
        return series ? told[place].tell(study, series) : told[place].head;
    return series ? tell_time(study, series, levels[level])
                  : format_text("CPU s for %g %s", levels[level], study_unit(study));
}

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
    add_curve(chart, series_name(study, series), points,
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
    "<meta charset=\"utf-8\">\n<meta name=\"generator\" content=\"refdyn " REFDYN_VERSION "\">\n<style>\n"
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
    put_row_of_texts(out, "size",
                     format_text("coordinates %d, constraint rows %d, points %d", refdyn_joint_count(model),
                                 model->m, model->point_count));
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
    const int joints = refdyn_joint_count(model);
    put_named(out, "Start: coordinates and rates", model->coordinates, scene->q, scene->qd, joints);
    put_named(out, "Start: states", model->coordinates + joints, scene->qd + joints, NULL, model->n - joints);
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
    put_cell(out, trial_setting(trial));
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
            study_unit(study));
    for (int i = 0; i < study->series_count; i++) {
        const struct series *series = &study->series[i];
        for (int j = 0; j < series->count; j++)
            put_trial(out, study, series_name(study, series), &series->trials[j]);
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
