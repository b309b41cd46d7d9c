/* Chooses and draws the charts of a file of runs: how a number of each case depends on what varied, as a
 * curve over one quantity or a map over two; percentiles over time; the worst cases. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"

enum {
    STEPS_MOST = 60, /* of a grid; more different values are grouped into fields of equal width */
    FIELDS_LEAST = 4,
    CASES_A_FIELD = 3,
    COLOURS = 64 /* in the key */
};

/* A quantity along an axis: its value in each case, and the fields of the axis. */
struct sweep {
    const double *values; /* by row of the file */
    double correlation;   /* part of the variance of the drawn values that this quantity explains */
    char *label;
    double *steps; /* different values, ascending */
    long step_count;
    double *edges; /* (field_count + 1) */
    int field_count;
    bool is_grid; /* each step has a field */
};

/* ---- What varied ---- */

/* The label of a varied quantity. Texts that are not numbers are drawn at their indices, which the label
 * explains. */
static char *label_of(const struct varied *varied) {
    struct text label = {.memory = &format_memory};
    if (!varied->texts)
        return figures_label("", varied->name, varied->unit);
    text_add(&label, "%s: ", varied->name);
    for (int i = 0; i < varied->text_count; i++)
        text_add(&label, "%s%d %s", i ? ", " : "", i, varied->texts[i]);
    return label.data;
}

static bool are_numbers(const struct varied *varied) {
    double value;
    for (int i = 0; i < varied->text_count; i++)
        if (!text_to_number(varied->texts[i], &value))
            return false;
    return varied->texts;
}

static const double *values_of(struct runs_charts *figure, const struct varied *varied, long cases) {
    if (!are_numbers(varied))
        return varied->values;
    double *values = memory_get(&figure->memory, ((size_t)cases + 1) * sizeof *values);
    for (long row = 0; row < cases; row++)
        text_to_number(varied->texts[(int)varied->values[row]], &values[row]);
    return values;
}

static void find_steps(struct runs_charts *figure, struct sweep *sweep, long cases) {
    sweep->steps = memory_get(&figure->memory, ((size_t)cases + 1) * sizeof *sweep->steps);
    long count = 0;
    for (long row = 0; row < cases; row++)
        if (figures_can_draw(sweep->values[row]))
            sweep->steps[count++] = sweep->values[row];
    qsort(sweep->steps, (size_t)count, sizeof *sweep->steps, format_ascending);
    for (long i = 0; i < count; i++)
        if (i == 0 || sweep->steps[i] != sweep->steps[sweep->step_count - 1])
            sweep->steps[sweep->step_count++] = sweep->steps[i];
}

/* Edges midway between steps, or of equal fields. */
static void find_edges(struct runs_charts *figure, struct sweep *sweep, int fields) {
    const double *s = sweep->steps;
    const long last = sweep->step_count - 1;
    sweep->field_count = sweep->is_grid ? (int)sweep->step_count : fields;
    sweep->edges = memory_get(&figure->memory, ((size_t)sweep->field_count + 1) * sizeof *sweep->edges);
    for (int i = 0; i <= sweep->field_count; i++)
        if (!sweep->is_grid)
            sweep->edges[i] = s[0] + (s[last] - s[0]) * i / fields;
        else if (i == 0)
            sweep->edges[i] = s[0] - 0.5 * (s[1] - s[0]);
        else
            sweep->edges[i] = i <= last ? 0.5 * (s[i - 1] + s[i]) : s[last] + 0.5 * (s[last] - s[last - 1]);
}

static int field_of(const struct sweep *sweep, double value) {
    int field = 0;
    while (field + 1 < sweep->field_count && value >= sweep->edges[field + 1])
        field++;
    return field;
}

/* ---- Which of what varied is drawn ---- */

struct pair {
    double x, y;
};

static int compare_pairs(const void *a, const void *b) {
    const struct pair *p = a, *q = b;
    return (p->x > q->x) - (p->x < q->x);
}

/* Collects the cases that have both numbers, by ascending x; returns how many there are. */
static long pair_up(struct runs_charts *figure, const double *x, const double *y, struct pair **pairs) {
    const long cases = hdf5_runs_count(figure->reader);
    long count = 0;
    *pairs = memory_get(&figure->memory, ((size_t)cases + 1) * sizeof **pairs);
    for (long row = 0; row < cases; row++)
        if (figures_can_draw(x[row]) && figures_can_draw(y[row]))
            (*pairs)[count++] = (struct pair){x[row], y[row]};
    qsort(*pairs, (size_t)count, sizeof **pairs, compare_pairs);
    return count;
}

static struct pair mean_of_pairs(const struct pair *pairs, long count) {
    struct pair sum = {0, 0};
    for (long i = 0; i < count; i++) {
        sum.x += pairs[i].x / (double)count;
        sum.y += pairs[i].y / (double)count;
    }
    return sum;
}

/* The square of Pearson's correlation. */
static double along_a_line(const struct pair *pairs, long count) {
    const struct pair mean = mean_of_pairs(pairs, count);
    double xx = 0, xy = 0, yy = 0;
    for (long i = 0; i < count; i++) {
        const double x = pairs[i].x - mean.x, y = pairs[i].y - mean.y;
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    return xx > 0 && yy > 0 ? xy / xx * (xy / yy) : 0;
}

/* Pearson's correlation ratio without the part that chance causes (Kelley, Proc. Natl. Acad. Sci. 21, 1935).
 * It also detects curves that rise and fall. Groups have about sqrt(count) cases; equal x stay in one group.
 */
static double along_groups(const struct pair *pairs, long count) {
    const double mean = mean_of_pairs(pairs, count).y, enough = sqrt((double)count);
    double within = 0, all = 0;
    long groups = 0;
    for (long begin = 0, end; begin < count; begin = end, groups++) {
        for (end = begin + 1; end < count; end++)
            if (pairs[end].x != pairs[end - 1].x && (double)(end - begin) >= enough)
                break;
        const double of_group = mean_of_pairs(pairs + begin, end - begin).y;
        for (long i = begin; i < end; i++) {
            within += (pairs[i].y - of_group) * (pairs[i].y - of_group);
            all += (pairs[i].y - mean) * (pairs[i].y - mean);
        }
    }
    const double free = (double)(count - groups);
    return all > 0 && free > 0 ? 1 - within / free * (double)(count - 1) / all : 0;
}

static double correlation_of(struct runs_charts *figure, const double *x, const double *y) {
    struct pair *pairs;
    const long count = pair_up(figure, x, y, &pairs);
    return fmax(along_a_line(pairs, count), along_groups(pairs, count));
}

/* Finds the two quantities that correlate most with the values, in the order of the file; the first of equal
 * ones wins. Returns how many there are. */
static int find_sweeps(struct runs_charts *figure, const double *values, struct sweep sweeps[static 2]) {
    const struct cases *cases = &hdf5_runs_layout(figure->reader)->cases;
    int count = 0;
    for (int i = 0; i < cases->width; i++) {
        struct sweep sweep = {.values = values_of(figure, &cases->columns[i], cases->count)};
        find_steps(figure, &sweep, cases->count);
        if (sweep.step_count < 2)
            continue;
        sweep.correlation = correlation_of(figure, sweep.values, values);
        sweep.label = are_numbers(&cases->columns[i]) ? format_text("%s", cases->columns[i].name)
                                                      : label_of(&cases->columns[i]);
        if (count < 2)
            sweeps[count++] = sweep;
        else if (sweep.correlation > fmin(sweeps[0].correlation, sweeps[1].correlation)) {
            if (sweeps[0].correlation < sweeps[1].correlation)
                sweeps[0] = sweeps[1];
            sweeps[1] = sweep;
        }
    }
    return count;
}

/* ---- A curve ---- */

/* Draws over what varied, or over the numbers of the cases if sweep is NULL. */
static void add_curve(struct runs_charts *figure, struct chart *chart, const struct sweep *sweep,
                      const double *values) {
    const long cases = hdf5_runs_count(figure->reader);
    double *numbers = memory_get(&figure->memory, ((size_t)cases + 1) * sizeof *numbers);
    for (long row = 0; row < cases; row++)
        numbers[row] = (double)hdf5_runs_numbers(figure->reader)[row];
    struct pair *pairs;
    const long count = pair_up(figure, sweep ? sweep->values : numbers, values, &pairs);
    if (count > 0)
        figures_chart_add_curve(chart, (struct curve){.x = &pairs->x,
                                                      .y = &pairs->y,
                                                      .count = count,
                                                      .stride = sizeof *pairs / sizeof pairs->x,
                                                      .stroke = figures_style_quantity(0, 1, 0, 1),
                                                      .key = figures_chart_key(chart, "", 0)});
    chart->x_label = sweep ? format_text("%s", sweep->label) : format_text("case");
}

/* ---- A map ---- */

/* The cases of a field: the sum of their numbers, how many have a number, and how many there are. */
struct field {
    double sum;
    long count, cases;
};

static double mean_of(const struct field *field) {
    return field->sum / (double)field->count;
}

static struct field *fill_fields(struct runs_charts *figure, const struct sweep *x, const struct sweep *y,
                                 const double *values) {
    struct field *fields =
        memory_get(&figure->memory, (size_t)(x->field_count * y->field_count) * sizeof *fields);
    for (long row = 0; row < hdf5_runs_count(figure->reader); row++) {
        if (!figures_can_draw(x->values[row]) || !figures_can_draw(y->values[row]))
            continue;
        struct field *field =
            &fields[field_of(y, y->values[row]) * x->field_count + field_of(x, x->values[row])];
        field->cases++;
        if (figures_can_draw(values[row])) {
            field->count++;
            field->sum += values[row];
        }
    }
    return fields;
}

static void find_range(const struct field *fields, int count, double *low, double *high) {
    *low = INFINITY;
    *high = -INFINITY;
    for (int i = 0; i < count; i++)
        if (fields[i].count > 0) {
            *low = fmin(*low, mean_of(&fields[i]));
            *high = fmax(*high, mean_of(&fields[i]));
        }
}

/* From the highest value to the lowest. */
static void add_keys(struct chart *chart, double low, double high) {
    for (int i = COLOURS - 1; i >= 0; i--) {
        const double part = (double)i / (COLOURS - 1);
        char *name = format_text("%.4g", low + part * (high - low));
        const int key = figures_chart_key(chart, name, strlen(name));
        chart->keys[key].stroke = (struct stroke){figures_style_value(part), 12, "", NULL};
    }
}

static void add_cells(struct chart *chart, const struct sweep *x, const struct sweep *y,
                      const struct field *fields, double low, double high) {
    for (int i = 0; i < x->field_count * y->field_count; i++) {
        const int at_x = i % x->field_count, at_y = i / x->field_count;
        const double part = high > low ? (mean_of(&fields[i]) - low) / (high - low) : 0.5;
        if (fields[i].cases > 0)
            figures_chart_add_cell(chart,
                                   (struct cell){.left = x->edges[at_x],
                                                 .right = x->edges[at_x + 1],
                                                 .low = y->edges[at_y],
                                                 .high = y->edges[at_y + 1],
                                                 .colour = fields[i].count > 0 ? figures_style_value(part)
                                                                               : figures_style_no_value()});
    }
}

/* Explains grey cells in the title. */
static void note_failures(struct chart *chart, const struct field *fields, int count) {
    int i = 0;
    while (i < count && (fields[i].cases == 0 || fields[i].count > 0))
        i++;
    if (i == count)
        return;
    chart->title = format_text("%s (grey: no value)", chart->title);
}

/* A grid has a field for each pair of steps; otherwise fields are so large that several cases are in each. */
static void part_axes(struct runs_charts *figure, struct sweep sweeps[static 2]) {
    const double cases = (double)hdf5_runs_count(figure->reader);
    const int fields = (int)fmin(fmax(sqrt(cases / CASES_A_FIELD), FIELDS_LEAST), STEPS_MOST);
    for (int i = 0; i < 2; i++) {
        sweeps[i].is_grid = sweeps[i].step_count <= STEPS_MOST;
        find_edges(figure, &sweeps[i], fields);
    }
}

static void add_map(struct runs_charts *figure, struct chart *chart, struct sweep sweeps[static 2],
                    const double *values) {
    double low, high;
    part_axes(figure, sweeps);
    const struct field *fields = fill_fields(figure, &sweeps[0], &sweeps[1], values);
    find_range(fields, sweeps[0].field_count * sweeps[1].field_count, &low, &high);
    if (low <= high) {
        note_failures(chart, fields, sweeps[0].field_count * sweeps[1].field_count);
        add_cells(chart, &sweeps[0], &sweeps[1], fields, low, high);
        add_keys(chart, low, high);
    }
    chart->x_label = format_text("%s", sweeps[0].label);
    chart->y_label = format_text("%s", sweeps[1].label);
}

/* ---- Both ---- */

/* "largest E_x [m]". */
static char *quantity_of(const struct kept_item *item, int place) {
    return figures_label(place > 0                           ? "largest "
                         : strcmp(item->group, "final") == 0 ? "final "
                                                             : "",
                         item->name, item->unit);
}

/* A map of mean values over two quantities, or a curve over one. Extremes use the number at `place` of their
 * axis. */
static bool add_response(struct runs_charts *figure, const struct kept_item *item, int place) {
    struct sweep sweeps[2] = {{.values = NULL}, {.values = NULL}};
    const double *values = figures_read_item(figure, item, place, 1);
    if (!values)
        return false;
    const int count = find_sweeps(figure, values, sweeps);
    struct chart *chart = &figure->charts[figure->chart_count++];
    *chart = (struct chart){.title = quantity_of(item, place)};
    if (count == 2)
        add_map(figure, chart, sweeps, values);
    else {
        add_curve(figure, chart, count == 1 ? &sweeps[0] : NULL, values);
        chart->y_label = quantity_of(item, place);
    }
    if (chart->cell_count + chart->curve_count > 0)
        return true;
    figure->chart_count--;
    return true;
}

enum { RESPONSES_MOST = 6, BANDS_MOST = 6, WIDTH = 520, HEIGHT = 330 };

static const char extremes_group[] = "extremes", history_group[] = "history", final_group[] = "final";

/* ---- The charts ---- */

static bool is_in(const struct kept_item *item, const char *group) {
    return strcmp(item->group, group) == 0;
}

/* Extremes are smallest, its time, largest, its time; the largest is drawn. */
enum { PLACE_OF_LARGEST = 2, EXTREMES = 4 };

static bool add_item(struct runs_charts *figure, const struct kept_item *item) {
    if (is_in(item, history_group))
        return figures_bands_add(figure, item);
    return add_response(figure, item,
                        is_in(item, extremes_group) && item->size == EXTREMES ? PLACE_OF_LARGEST : 0);
}

/* Adds at most `most` items of a group. */
static bool add_group(struct runs_charts *figure, const char *group, int most, int *count) {
    const struct runs_layout *layout = hdf5_runs_layout(figure->reader);
    *count = 0;
    for (int i = 0; i < layout->item_count && *count < most; i++)
        if (is_in(&layout->items[i], group) && strcmp(layout->items[i].name, "t") != 0) {
            if (!add_item(figure, &layout->items[i]))
                return false;
            ++*count;
        }
    return true;
}

/* Adds extremes, or final values if there are no extremes, and histories. */
static bool add_default(struct runs_charts *figure) {
    int count;
    if (!add_group(figure, extremes_group, RESPONSES_MOST, &count))
        return false;
    if (count == 0 && !add_group(figure, final_group, RESPONSES_MOST, &count))
        return false;
    return add_group(figure, history_group, BANDS_MOST, &count);
}

static const struct kept_item *find_item(const struct runs_layout *layout, const char *name) {
    for (int i = 0; i < layout->item_count; i++) {
        const struct kept_item *item = &layout->items[i];
        const size_t length = strlen(item->group);
        if (strncmp(name, item->group, length) == 0 && name[length] == '/' &&
            strcmp(name + length + 1, item->name) == 0)
            return item;
    }
    return NULL;
}

static bool refuse_panel(const struct runs_charts *figure, const char *name, const char *fact) {
    char *text = format_text("--panel: '%s' %s", name, fact);
    format_complain_line(figure->path, 0, text);
    return false;
}

static bool add_named(struct runs_charts *figure, const char *panels) {
    bool is_good = true;
    const char **names = options_list(panels);
    for (int i = 0; is_good && names[i]; i++) {
        const char *name = names[i];
        const struct kept_item *item = find_item(hdf5_runs_layout(figure->reader), name);
        if (!item)
            is_good = refuse_panel(figure, name, "is not in the file; name a kept value as in history/E_x");
        else if (figure->chart_count == RUNS_CHARTS_MOST)
            is_good = refuse_panel(figure, name, "is one too many; a figure has at most 12 panels");
        else
            is_good = add_item(figure, item);
    }
    return is_good;
}

/* ---- The whole ---- */

static void draw(const struct runs_charts *figure, FILE *out) {
    const int count = figure->chart_count;
    const struct figure drawn = {.heads = figure->heads,
                                 .head_count = figure->head_count,
                                 .charts = figure->charts,
                                 .count = count,
                                 .columns = count > 6   ? 3
                                            : count > 1 ? 2
                                                        : 1,
                                 .width = count > 1 ? WIDTH : 3 * WIDTH / 2,
                                 .height = HEIGHT};
    figures_draw(out, &drawn);
}

static void release(struct runs_charts *figure) {
    if (figure->reader)
        hdf5_runs_close(figure->reader);
    memory_release(&figure->memory);
}

static bool make(struct runs_charts *figure, const char *panels) {
    if (!figure->reader || !figures_worst_add(figure))
        return false;
    if (!(panels ? add_named(figure, panels) : add_default(figure)))
        return false;
    if (figure->chart_count > 0)
        return true;
    format_complain_line(figure->path, 0, "no case has a number to draw");
    return false;
}

bool figures_draw_runs(const char *path, const char *panels, FILE *out) {
    struct runs_charts figure = {
        .path = path, .memory = format_arena_start(), .reader = hdf5_runs_open(path)};
    const bool is_made = make(&figure, panels);
    if (is_made)
        draw(&figure, out);
    release(&figure);
    return is_made;
}
