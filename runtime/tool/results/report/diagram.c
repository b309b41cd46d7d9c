/* The drawing of error over run time. */
#include "runtime/tool/results/report/report.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 900, HEIGHT = 480 };

/* The runs of one series that are drawn. */
struct points {
    double cpu_s[SETTINGS_MAX], error[SETTINGS_MAX];
    int count;
};

/* No error is drawn below the floor, and none of a run that has lost the motion. */
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
    const int key = chart_key(chart, name, strlen(name));
    chart->keys[key].stroke = stroke;
    chart_add_curve(
        chart,
        (struct curve){
            .x = points->cpu_s, .y = points->error, .count = points->count, .stride = 1, .stroke = stroke});
}

/* How many series of the same method, each with another stabilisation, come before. */
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
              style_method((int)series->method, line_of(study, series)));
}

/* From the quickest to the slowest run. */
static void add_floor(struct chart *chart, const struct study *study, struct points *floor) {
    floor->cpu_s[0] = INFINITY;
    for (int i = 0; i < chart->curve_count; i++)
        for (long j = 0; j < chart->curves[i].count; j++) {
            floor->cpu_s[0] = fmin(floor->cpu_s[0], chart->curves[i].x[j]);
            floor->cpu_s[1] = fmax(floor->cpu_s[1], chart->curves[i].x[j]);
        }
    floor->error[0] = floor->error[1] = study->floor;
    floor->count = 2;
    add_curve(chart, "floor", floor, style_limit());
}

/* points: one for each series, and one for the floor. */
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
    struct points *points = allocate((size_t)count * (SERIES_MAX + 1), sizeof *points);
    struct chart *charts = allocate((size_t)count, sizeof *charts);
    struct key head = {.name = title};
    struct figure figure = {
        .heads = &head, .head_count = 1, .charts = charts, .columns = 1, .width = WIDTH, .height = HEIGHT};
    for (int i = 0; i < count; i++) {
        charts[figure.count] = make_chart(&studies[i], points + i * (SERIES_MAX + 1));
        figure.count += charts[figure.count].curve_count > 0;
    }
    chart_draw_figure(out, &figure);
}
