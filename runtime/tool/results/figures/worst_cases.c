/* The worst cases of a batch, in words: see figures.h. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    long row; /* -1: none */
};

static bool begins_number(const char *text) {
    return isdigit((unsigned char)text[*text == '-']);
}

/* "at t = 0.25 s" as "at t = ... s", in heap memory. */
static char *without_numbers(const char *text) {
    char *kept = allocate_large(3 * strlen(text) + 1, 1), *end = kept;
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

/* Smallest and largest value, each with its time behind it. */
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

/* Those of which smallest and largest are kept. */
static int find_items(const struct runs_layout *layout, struct worst *worst) {
    int count = 0;
    for (int i = 0; i < layout->item_count && count < EXTREMES_MOST; i++)
        if (strcmp(layout->items[i].group, "extremes") == 0 && layout->items[i].size == EXTREMES)
            worst[count++] = (struct worst){.item = &layout->items[i], .row = -1};
    return count;
}

/* ---- In words ---- */

/* The most frequent one, which is taken off the list; -1: none is left. */
static int next_reason(const struct reasons *reasons) {
    int next = -1;
    for (int i = 0; i < reasons->count; i++)
        if (reasons->counts[i] > 0 && (next < 0 || reasons->counts[i] > reasons->counts[next]))
            next = i;
    return next;
}

static void tell_reasons(struct runs_charts *figure, struct reasons *reasons) {
    const long cases = hdf5_runs_count(figure->reader);
    runs_charts_add_head(figure, text_format("%s: %ld case%s, %ld failed", figure->path, cases,
                                             cases == 1 ? "" : "s", reasons->failed));
    for (int i = 0, which; i < REASONS_MOST && (which = next_reason(reasons)) >= 0; i++) {
        const char *text = reasons->texts[which];
        runs_charts_add_head(figure, text_format("%ld failed: %s", reasons->counts[which],
                                                 *text ? text : "no reason is told"));
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
    FILE *out = text_stream(&text, &size);
    fprintf(out, "largest |%s|: %.4g%s%s at t = %.4g s in ", worst->item->name, fabs(worst->value),
            unit && *unit ? " " : "", unit ? unit : "", worst->t);
    print_case(out, figure, worst->row);
    fclose(out);
    runs_charts_add_head(figure, text_format("%s", text));
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
