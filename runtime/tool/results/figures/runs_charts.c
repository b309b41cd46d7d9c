/* Parts of the figure of a file of runs: reads its numbers, draws percentiles over time, and describes the
 * worst cases. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>
#include <stdlib.h>
#include <ctype.h>

/* Adds a head; `text` is in heap memory and belongs to the figure. */
static void add_head(struct runs_charts *figure, char *text) {
    figure->heads = memory_room(&figure->memory, figure->heads, figure->head_count, &figure->head_room,
                                sizeof *figure->heads);
    figure->heads[figure->head_count++] = (struct key){.name = text};
}

char *figures_label(const char *lead, const char *name, const char *unit) {
    return unit && *unit ? format_text("%s%s [%s]", lead, name, unit) : format_text("%s%s", lead, name);
}

bool figures_can_draw(double value) {
    const double largest = 1e150;
    return fabs(value) <= largest;
}

double *figures_read_item(struct runs_charts *figure, const struct kept_item *item, int place, int count) {
    const long cases = hdf5_runs_count(figure->reader);
    const size_t part = (size_t)count;
    double *values = memory_get(&figure->memory, ((size_t)cases * part + 1) * sizeof *values);
    for (long row = 0; row < cases; row++) {
        struct case_record record;
        if (!hdf5_runs_get(figure->reader, row, &record))
            return NULL;
        memcpy(values + (size_t)row * part, record.values + item->offset + place, part * sizeof *values);
    }
    return values;
}

/* ---- Percentiles over time ---- */

enum {
    PERCENTILES = 5,
    MEDIAN = 2,
    BANDS = 2,
    NUMBERS_MOST = 1 << 22 /* bound on the numbers of all cases that are in memory at a time */
};

static const double parts[PERCENTILES] = {0.05, 0.25, 0.5, 0.75, 0.95};
static const char *const names[BANDS] = {"5 to 95 %", "25 to 75 %"};

/* Interpolates between neighbours, like numpy's default; NaN without values. */
static double percentile(const double *sorted, long count, double part) {
    const double at = part * (double)(count - 1);
    const long below = (long)at;
    if (count == 0)
        return NAN;
    if (below + 1 >= count)
        return sorted[count - 1];
    return sorted[below] + (at - (double)below) * (sorted[below + 1] - sorted[below]);
}

/* Percentiles at one time: value `k` of `stride` of each case. Values that cannot be drawn do not count. */
static void find_percentiles(const double *values, long cases, int stride, int k, double *sorted,
                             double found[static PERCENTILES]) {
    long count = 0;
    for (long row = 0; row < cases; row++)
        if (figures_can_draw(values[row * stride + k]))
            sorted[count++] = values[row * stride + k];
    qsort(sorted, (size_t)count, sizeof *sorted, format_ascending);
    for (int i = 0; i < PERCENTILES; i++)
        found[i] = percentile(sorted, count, parts[i]);
}

/* Fills courses (PERCENTILES x size), for as many times at once as NUMBERS_MOST allows. */
static bool fill(struct runs_charts *figure, const struct kept_item *item, double *courses) {
    const long cases = hdf5_runs_count(figure->reader);
    const int most = cases > 0 && NUMBERS_MOST / cases > 1 ? (int)(NUMBERS_MOST / cases) : 1;
    double *sorted = memory_get(&figure->memory, ((size_t)cases + 1) * sizeof *sorted);
    for (int first = 0; first < item->size; first += most) {
        const int count = item->size - first < most ? item->size - first : most;
        struct runs_charts part = {.reader = figure->reader, .memory = format_arena_start()};
        const double *values = figures_read_item(&part, item, first, count);
        for (int k = 0; k < count && values; k++) {
            double found[PERCENTILES];
            find_percentiles(values, cases, count, k, sorted, found);
            for (int i = 0; i < PERCENTILES; i++)
                courses[i * item->size + first + k] = found[i];
        }
        memory_release(&part.memory);
        if (!values)
            return false;
    }
    return true;
}

static const struct kept_axis *find_axis(const struct runs_layout *layout, const char *path) {
    for (int i = 0; i < layout->axis_count; i++)
        if (path && strcmp(layout->axes[i].path, path) == 0)
            return &layout->axes[i];
    return NULL;
}

/* Moves the times with a value, and these values, to the front; returns how many there are. */
static long keep_finite(double *x, double *courses, int size) {
    long kept = 0;
    for (int i = 0; i < size; i++) {
        if (!isfinite(courses[MEDIAN * size + i]))
            continue;
        x[kept] = x[i];
        for (int k = 0; k < PERCENTILES; k++)
            courses[k * size + kept] = courses[k * size + i];
        kept++;
    }
    return kept;
}

static void add_key(struct chart *chart, const char *name, struct stroke stroke) {
    const int key = figures_chart_key(chart, name, strlen(name)); /* this call may move the list of keys */
    chart->keys[key].stroke = stroke;
}

static void add_courses(struct chart *chart, const double *x, const double *courses, int size, long count) {
    for (int i = 0; i < BANDS; i++) {
        const struct stroke stroke = figures_style_band(i);
        figures_chart_add_band(chart, (struct band){.x = x,
                                                    .low = courses + i * size,
                                                    .high = courses + (PERCENTILES - 1 - i) * size,
                                                    .count = count,
                                                    .colour = stroke.colour});
        add_key(chart, names[i], stroke);
    }
    const struct stroke median = figures_style_quantity(0, 1, 0, 1);
    figures_chart_add_curve(chart, (struct curve){.x = x,
                                                  .y = courses + MEDIAN * size,
                                                  .count = count,
                                                  .stride = 1,
                                                  .stroke = median,
                                                  .key = BANDS});
    add_key(chart, "median", median);
}

bool figures_bands_add(struct runs_charts *figure, const struct kept_item *item) {
    const struct kept_axis *axis = find_axis(hdf5_runs_layout(figure->reader), item->axis);
    const size_t size = (size_t)item->size;
    double *x = memory_get(&figure->memory, (size + 1) * sizeof *x);
    double *courses = memory_get(&figure->memory, (PERCENTILES * size + 1) * sizeof *courses);
    for (int i = 0; i < item->size; i++)
        x[i] = axis && axis->values ? axis->values[i] : i;
    if (!fill(figure, item, courses))
        return false;
    const long count = keep_finite(x, courses, item->size);
    if (count < 2)
        return true;
    struct chart *chart = &figure->charts[figure->chart_count++];
    *chart = (struct chart){.title = format_text("%s over time, percentiles of the cases", item->name),
                            .x_label = figures_label("", "t", axis ? axis->unit : NULL),
                            .y_label = figures_label("", item->name, item->unit)};
    add_courses(chart, x, courses, item->size, count);
    return true;
}

/* ---- The worst cases ---- */

enum { REASONS_MOST = 3, EXTREMES_MOST = 4, COLUMNS_MOST = 4, LARGEST = 2, EXTREMES = 4, KINDS_MOST = 64 };

/* Reasons of failed cases without their numbers, which differ from case to case. */
struct reasons {
    char *texts[KINDS_MOST];
    long counts[KINDS_MOST];
    int count;
    long failed;
};

/* The case with the largest absolute value of an extreme. */
struct worst {
    const struct kept_item *item;
    double value, t;
    long row; /* -1 if there is none */
};

static bool begins_number(const char *text) {
    return isdigit((unsigned char)text[*text == '-']);
}

/* "at t = 0.25 s" as "at t = ... s", in heap memory. */
static char *without_numbers(const char *text) {
    char *kept = format_allocate_large(3 * strlen(text) + 1, 1), *end = kept;
    while (*text)
        if (begins_number(text)) {
            text += strspn(text, "0123456789.eE+-");
            end = strcpy(end, "...") + 3;
        } else
            *end++ = *text++;
    *end = '\0';
    return kept;
}

static void add_reason(struct reasons *reasons, const char *reason) {
    char *text = without_numbers(reason);
    int i = 0;
    reasons->failed++;
    while (i < reasons->count && strcmp(reasons->texts[i], text) != 0)
        i++;
    if (i < reasons->count || i == KINDS_MOST)
        free(text);
    else
        reasons->texts[reasons->count++] = text;
    if (i < KINDS_MOST)
        reasons->counts[i]++;
}

/* Extremes are the smallest value, its time, the largest value, its time. */
static void look(struct worst *worst, const struct case_record *record, long row) {
    for (int k = 0; k <= LARGEST; k += LARGEST) {
        const double value = record->values[worst->item->offset + k];
        if (isfinite(value) && (worst->row < 0 || fabs(value) > fabs(worst->value))) {
            worst->value = value;
            worst->t = record->values[worst->item->offset + k + 1];
            worst->row = row;
        }
    }
}

/* Lists the items with smallest and largest values; returns how many there are. */
static int find_items(const struct runs_layout *layout, struct worst *worst) {
    int count = 0;
    for (int i = 0; i < layout->item_count && count < EXTREMES_MOST; i++)
        if (strcmp(layout->items[i].group, "extremes") == 0 && layout->items[i].size == EXTREMES)
            worst[count++] = (struct worst){.item = &layout->items[i], .row = -1};
    return count;
}

/* ---- In words ---- */

/* The most frequent remaining reason, -1 if none is left. */
static int next_reason(const struct reasons *reasons) {
    int next = -1;
    for (int i = 0; i < reasons->count; i++)
        if (reasons->counts[i] > 0 && (next < 0 || reasons->counts[i] > reasons->counts[next]))
            next = i;
    return next;
}

static void tell_reasons(struct runs_charts *figure, struct reasons *reasons) {
    const long cases = hdf5_runs_count(figure->reader);
    add_head(figure, format_text("%s: %ld case%s, %ld failed", figure->path, cases, cases == 1 ? "" : "s",
                                 reasons->failed));
    for (int i = 0, which; i < REASONS_MOST && (which = next_reason(reasons)) >= 0; i++) {
        const char *text = reasons->texts[which];
        add_head(figure,
                 format_text("%ld failed: %s", reasons->counts[which], *text ? text : "no reason recorded"));
        reasons->counts[which] = 0;
    }
    for (int i = 0; i < reasons->count; i++)
        free(reasons->texts[i]);
}

/* "case 17 (m_E = 3, program = none)". */
static void print_case(FILE *out, const struct runs_charts *figure, long row) {
    const struct cases *cases = &hdf5_runs_layout(figure->reader)->cases;
    fprintf(out, "case %ld", hdf5_runs_numbers(figure->reader)[row]);
    for (int i = 0; i < cases->width && i < COLUMNS_MOST; i++) {
        const struct varied *varied = &cases->columns[i];
        fprintf(out, "%s%s = ", i ? ", " : " (", varied->name);
        if (varied->texts)
            fputs(varied->texts[(int)varied->values[row]], out);
        else
            fprintf(out, "%.4g", varied->values[row]);
    }
    if (cases->width > COLUMNS_MOST)
        fputs(", ...", out);
    fputs(cases->width > 0 ? ")" : "", out);
}

static void tell_worst(struct runs_charts *figure, const struct worst *worst) {
    const char *unit = worst->item->unit;
    char *text;
    size_t size;
    if (worst->row < 0)
        return;
    FILE *out = format_stream(&text, &size);
    fprintf(out, "largest |%s|: %.4g%s%s at t = %.4g s in ", worst->item->name, fabs(worst->value),
            unit && *unit ? " " : "", unit ? unit : "", worst->t);
    print_case(out, figure, worst->row);
    fclose(out);
    add_head(figure, format_text("%s", text));
    free(text);
}

bool figures_worst_add(struct runs_charts *figure) {
    struct worst worst[EXTREMES_MOST];
    struct reasons reasons = {.count = 0};
    const int count = find_items(hdf5_runs_layout(figure->reader), worst);
    bool is_good = true;
    for (long row = 0; row < hdf5_runs_count(figure->reader) && is_good; row++) {
        struct case_record record;
        is_good = hdf5_runs_get(figure->reader, row, &record);
        if (is_good && record.status != 0)
            add_reason(&reasons, record.reason);
        for (int i = 0; i < count && is_good; i++)
            look(&worst[i], &record, row);
    }
    tell_reasons(figure, &reasons);
    for (int i = 0; i < count; i++)
        tell_worst(figure, &worst[i]);
    return is_good;
}
