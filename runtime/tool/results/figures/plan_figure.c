/*
 * Draws a PLAN.json: a chart for each limit, with its column over the motion of the plan and its bounds. An
 * active limit says so in its title.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/results/figures/figures.h"

enum { COLUMNS_MOST = 3, WIDTH = 480, HEIGHT = 260 };

struct samples {
    double *values;
    long count;
};

/* Numbers of a list; 0 of them if it is none. */
static struct samples read_samples(const json_t *list) {
    struct samples samples = {.count = (long)json_array_size(list)};
    samples.values = format_allocate((size_t)samples.count + 1, sizeof *samples.values);
    for (long i = 0; i < samples.count; i++)
        samples.values[i] = json_number_value(json_array_get(list, (size_t)i));
    return samples;
}

static void add_curve(struct chart *chart, const char *name, const double *x, const double *y, long count,
                      struct stroke stroke) {
    figures_chart_add_curve(chart,
                            (struct curve){.x = x, .y = y, .count = count, .stride = 1, .stroke = stroke});
    const int key = figures_chart_key(chart, name, strlen(name)); /* may move the keys */
    chart->keys[key].stroke = stroke;
}

/* A bound is a line over the whole motion, that of a limit at the end a line over its last tenth. */
static void add_bound(struct chart *chart, const json_t *bound, bool is_at_end, struct samples t) {
    static const double last = 0.9;
    if (!json_is_number(bound))
        return;
    double *x = format_allocate(2, sizeof *x), *y = format_allocate(2, sizeof *y);
    x[1] = t.values[t.count - 1];
    x[0] = is_at_end ? t.values[0] + last * (x[1] - t.values[0]) : t.values[0];
    y[0] = y[1] = json_number_value(bound);
    add_curve(chart, "limit", x, y, 2, (struct stroke){0x333333, 1, "6 3", NULL});
}

/* Returns false if the entry is not one that `plan` writes. */
static bool make_chart(const json_t *limit, const json_t *motion, struct chart *chart) {
    const char *name = json_string_value(json_object_get(limit, "name")),
               *column = json_string_value(json_object_get(limit, "column"));
    const struct samples t = read_samples(json_object_get(motion, "t")),
                         y = read_samples(column ? json_object_get(motion, column) : NULL);
    if (!name || !column || t.count < 2 || y.count != t.count)
        return false;
    *chart = (struct chart){
        .title = format_text("%s%s", name, json_is_true(json_object_get(limit, "active")) ? ", active" : ""),
        .x_label = "t [s]",
        .y_label = figures_label("", column, json_string_value(json_object_get(limit, "unit")))};
    const bool is_at_end = strcmp(name, format_text("%s at end", column)) == 0;
    add_bound(chart, json_object_get(limit, "from"), is_at_end, t);
    add_bound(chart, json_object_get(limit, "to"), is_at_end, t);
    add_curve(chart, format_text("%s", column), t.values, y.values, t.count,
              figures_style_quantity(0, 2, 0, 1));
    return true;
}

bool figures_is_plan(const char *path) {
    json_t *root = json_load_file(path, 0, NULL);
    const bool is_plan = json_is_object(json_object_get(root, "motion"));
    json_decref(root);
    return is_plan;
}

bool figures_draw_plan(const char *path, FILE *out) {
    json_t *root = json_load_file(path, 0, NULL), *limit;
    const json_t *limits = json_object_get(root, "limits"), *motion = json_object_get(root, "motion");
    struct chart *charts = format_allocate(json_array_size(limits) + 1, sizeof *charts);
    struct key head = {.name = path};
    int count = 0;
    size_t i;
    bool is_good = true;
    json_array_foreach(limits, i, limit) {
        is_good = is_good && make_chart(limit, motion, &charts[count++]);
    }
    if (!is_good || count == 0)
        format_complain_line(
            path, 1,
            is_good ? "limits: the plan has none to draw; draw its motion by refdyn sim"
                    : "plan: limits without values in 'motion'; give a PLAN.json of refdyn plan");
    const struct figure figure = {.heads = &head,
                                  .head_count = 1,
                                  .charts = charts,
                                  .count = count,
                                  .columns = count < COLUMNS_MOST ? count : COLUMNS_MOST,
                                  .width = WIDTH,
                                  .height = HEIGHT};
    if (is_good && count > 0)
        figures_draw(out, &figure);
    json_decref(root);
    return is_good && count > 0;
}
