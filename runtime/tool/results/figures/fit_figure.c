/*
 * Draws a FIT.json. A row of charts for each column of each file: data over the model with a band of two
 * standard deviations of the noise; residuals; their autocorrelation with the band in which 95 % of the
 * values of white noise are, +-1.96/sqrt(N) (Box and Jenkins, Time Series Analysis, 1976, sect. 2.1.6).
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/results/figures/figures.h"

enum { CHARTS_OF_ROW = 3, LAGS_MOST = 50, LAG_PARTS = 4 /* at least this many rows for each lag */ };
static const double deviations = 2, white_95 = 1.96;
static const char point_mark[] = "m-1.4 0a1.4 1.4 0 1 0 2.8 0a1.4 1.4 0 1 0-2.8 0z";

/* A column of a file. */
struct series {
    const char *name, *file, *unit;
    int every;
    double noise;
    long count;
    double *t, *data, *model;
};

/* ---- Reading ---- */

static double *read_numbers(const json_t *list, long *count) {
    *count = (long)json_array_size(list);
    double *numbers = format_allocate((size_t)*count + 1, sizeof *numbers);
    for (long i = 0; i < *count; i++)
        numbers[i] = json_number_value(json_array_get(list, (size_t)i));
    return numbers;
}

/* Returns false if the entry is not one that `fit` writes. */
static bool read_series(const json_t *column, struct series *series) {
    const json_t *unit = json_object_get(column, "unit");
    long data, model;
    series->unit = unit ? format_text("%s", json_string_value(unit)) : NULL;
    series->noise = json_number_value(json_object_get(column, "noise"));
    series->t = read_numbers(json_object_get(column, "t"), &series->count);
    series->data = read_numbers(json_object_get(column, "data"), &data);
    series->model = read_numbers(json_object_get(column, "model"), &model);
    return series->noise > 0 && series->count > 1 && series->count == data && data == model;
}

/* ---- Charts ---- */

static struct stroke data_stroke(void) {
    return (struct stroke){0x333333, 0, "", point_mark};
}

static double *filled(long count, double value) {
    double *values = format_allocate((size_t)count + 1, sizeof *values);
    for (long i = 0; i < count; i++)
        values[i] = value;
    return values;
}

static void add_key(struct chart *chart, const char *name, struct stroke stroke) {
    const int key = figures_chart_key(chart, name, strlen(name)); /* may move the keys */
    chart->keys[key].stroke = stroke;
}

/* The band of `half` on both sides of `middle`, and its key. */
static void add_band(struct chart *chart, const double *x, const double *middle, double half, long count,
                     const char *name) {
    double *low = filled(count, 0), *high = filled(count, 0);
    for (long i = 0; i < count; i++) {
        low[i] = middle[i] - half;
        high[i] = middle[i] + half;
    }
    const struct stroke stroke = figures_style_band(0);
    figures_chart_add_band(
        chart, (struct band){.x = x, .low = low, .high = high, .count = count, .colour = stroke.colour});
    add_key(chart, name, stroke);
}

static void add_curve(struct chart *chart, const double *x, const double *y, long count, struct stroke stroke,
                      const char *name) {
    figures_chart_add_curve(chart,
                            (struct curve){.x = x, .y = y, .count = count, .stride = 1, .stroke = stroke});
    add_key(chart, name, stroke);
}

static struct chart make_data_chart(const struct series *series, const char *place) {
    struct chart chart = {.title = format_text("%s%s", series->name, place),
                          .x_label = "t [s]",
                          .y_label = figures_label("", series->name, series->unit)};
    add_band(&chart, series->t, series->model, deviations * series->noise, series->count, "2 sigma");
    add_curve(&chart, series->t, series->model, series->count, figures_style_quantity(0, 2, 0, 1), "model");
    add_curve(&chart, series->t, series->data, series->count, data_stroke(), "data");
    return chart;
}

static double *residuals_of(const struct series *series) {
    double *residuals = filled(series->count, 0);
    for (long i = 0; i < series->count; i++)
        residuals[i] = series->data[i] - series->model[i];
    return residuals;
}

static struct chart make_residual_chart(const struct series *series, const double *residuals,
                                        const char *place) {
    struct chart chart = {.title = format_text("Residuals of %s%s", series->name, place),
                          .x_label = "t [s]",
                          .y_label = figures_label("data - model, ", series->name, series->unit)};
    add_band(&chart, series->t, filled(series->count, 0), deviations * series->noise, series->count,
             "2 sigma");
    add_curve(&chart, series->t, residuals, series->count, data_stroke(), "residual");
    return chart;
}

/* r_k = sum e_i e_(i+k) / sum e_i^2 of the residuals e without their mean. */
static double autocorrelation(const double *residuals, long count, long lag) {
    double mean = 0, all = 0, shifted = 0;
    for (long i = 0; i < count; i++)
        mean += residuals[i] / (double)count;
    for (long i = 0; i < count; i++) {
        all += (residuals[i] - mean) * (residuals[i] - mean);
        shifted += i + lag < count ? (residuals[i] - mean) * (residuals[i + lag] - mean) : 0;
    }
    return all > 0 ? shifted / all : 0;
}

static struct chart make_lag_chart(const struct series *series, const double *residuals, const char *place) {
    const long most = series->count / LAG_PARTS, count = most > LAGS_MOST ? LAGS_MOST : most > 2 ? most : 2;
    struct chart chart = {.title = format_text("Autocorrelation of residuals%s", place),
                          .x_label =
                              series->every > 1 ? format_text("lag [%d rows]", series->every) : "lag [rows]",
                          .y_label = "autocorrelation [1]"};
    double *lags = filled(count, 0), *values = filled(count, 0);
    for (long i = 0; i < count; i++) {
        lags[i] = (double)(i + 1);
        values[i] = autocorrelation(residuals, series->count, i + 1);
    }
    struct stroke stroke = figures_style_quantity(0, 2, 0, 1);
    stroke.mark = point_mark;
    add_band(&chart, lags, filled(count, 0), white_95 / sqrt((double)series->count), count, "95 %");
    add_curve(&chart, lags, values, count, stroke, "residual");
    return chart;
}

/* ---- The figure ---- */

struct fit_figure {
    struct series *series;
    int count, room;
};

static bool add_file(struct fit_figure *figure, const json_t *file, int every) {
    const char *name = json_string_value(json_object_get(file, "file")), *column;
    json_t *columns = json_object_get(file, "columns"), *values;
    if (!name || !json_is_object(columns))
        return false;
    json_object_foreach(columns, column, values) {
        figure->series =
            memory_room(&format_memory, figure->series, figure->count, &figure->room, sizeof *figure->series);
        struct series *series = &figure->series[figure->count++];
        *series = (struct series){
            .name = format_text("%s", column), .file = format_text("%s", name), .every = every};
        if (!read_series(values, series))
            return false;
    }
    return true;
}

static bool read_fit(struct fit_figure *figure, const char *path) {
    json_error_t error = {.line = 1};
    char *text = format_read_file(path, "fit");
    if (!text)
        return false;
    json_t *root = json_loads(text, JSON_REJECT_DUPLICATES, &error),
           *series = json_object_get(root, "series"), *files = json_object_get(series, "files"), *file;
    const int every = (int)json_integer_value(json_object_get(series, "every"));
    size_t i;
    bool is_good = every > 0 && json_is_array(files);
    json_array_foreach(files, i, file) {
        is_good = is_good && add_file(figure, file, every);
    }
    is_good = is_good && figure->count > 0;
    if (!is_good)
        format_complain_line(path, root ? 1 : error.line,
                             format_text("fit: %s; give a FIT.json of refdyn fit",
                                         root ? "no object 'series' with files" : error.text));
    json_decref(root);
    return is_good;
}

bool figures_draw_fit(const char *path, FILE *out) {
    enum { WIDTH = 480, HEIGHT = 260 };
    struct fit_figure fit = {.count = 0};
    if (!read_fit(&fit, path))
        return false;
    struct chart *charts = format_allocate((size_t)(CHARTS_OF_ROW * fit.count), sizeof *charts);
    struct key head = {.name = path};
    for (int i = 0; i < fit.count; i++) {
        const struct series *series = &fit.series[i];
        const double *residuals = residuals_of(series);
        const bool are_several = strcmp(series->file, fit.series[fit.count - 1].file) != 0 ||
                                 strcmp(series->file, fit.series[0].file) != 0;
        const char *place = are_several ? format_text(", %s", series->file) : "";
        charts[CHARTS_OF_ROW * i] = make_data_chart(series, place);
        charts[CHARTS_OF_ROW * i + 1] = make_residual_chart(series, residuals, place);
        charts[CHARTS_OF_ROW * i + 2] = make_lag_chart(series, residuals, place);
    }
    const struct figure figure = {.heads = &head,
                                  .head_count = 1,
                                  .charts = charts,
                                  .count = CHARTS_OF_ROW * fit.count,
                                  .columns = CHARTS_OF_ROW,
                                  .width = WIDTH,
                                  .height = HEIGHT};
    figures_draw(out, &figure);
    return true;
}
