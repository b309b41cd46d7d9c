/* Writes the runs of a batch as CSV, one row a case. */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const extremes_suffixes[] = {"_min", "_min_t", "_max", "_max_t"};

static bool has_extremes(const struct kept_item *item) {
    return strcmp(item->group, "extremes") == 0;
}

const char *runs_csv_unfit(const struct runs_layout *layout) {
    for (int i = 0; i < layout->item_count; i++)
        if (layout->items[i].axis && !has_extremes(&layout->items[i]))
            return layout->items[i].name;
    return NULL;
}

/* A varied coordinate or rate is a start value; the column with its own name has the value at the end. */
static const char *start_suffix(const struct varied *column) {
    return column->kind == VARIED_COORDINATE || column->kind == VARIED_RATE ? "_start" : "";
}

void runs_csv_header(const struct runs_layout *layout, bool has_reasons, FILE *out) {
    fputs("case", out);
    for (int i = 0; i < layout->cases.width; i++)
        fprintf(out, ",%s%s", layout->cases.columns[i].name, start_suffix(&layout->cases.columns[i]));
    fputs(",status", out);
    for (int i = 0; i < layout->item_count; i++) {
        const struct kept_item *item = &layout->items[i];
        const bool is_norm = strcmp(item->group, "norms") == 0;
        for (int k = 0; k < item->size; k++)
            fprintf(out, ",%s%s", item->name,
                    has_extremes(item) ? extremes_suffixes[k]
                    : is_norm          ? "_rms"
                                       : "");
    }
    fputs(has_reasons ? ",reason\n" : "\n", out);
}

const char *runs_csv_twice(const struct runs_layout *layout) {
    struct text_set names = {.memory = &format_memory};
    char *header;
    size_t size;
    const char *twice = NULL;
    FILE *out = format_stream(&header, &size);
    runs_csv_header(layout, true, out);
    fclose(out);
    for (char *rest = header, *name; !twice && (name = strsep(&rest, ",\n"));) {
        const int before = names.count, number = sweeps_text_set_add(&names, name);
        twice = number < before ? names.texts[number] : NULL;
    }
    free(header);
    return twice;
}

/* The field of an unknown value is empty. */
static void print_field(double value, FILE *out) {
    fputc(',', out);
    if (!isnan(value))
        format_number(out, value);
}

/* Prints quotes around a text with a comma, quotes or a line break, and doubles its quotes. */
static void print_text(const char *text, FILE *out) {
    const char *quote = strpbrk(text, ",\"\r\n") ? "\"" : "";
    fprintf(out, ",%s", quote);
    for (; *text; text++)
        fputs(*text == '"' ? "\"\"" : (const char[]){*text, '\0'}, out);
    fputs(quote, out);
}

void runs_csv_row(const struct runs_layout *layout, bool has_reasons, const struct case_record *record,
                  FILE *out) {
    fprintf(out, "%ld", record->number);
    for (int i = 0; i < layout->cases.width; i++) {
        const struct varied *column = &layout->cases.columns[i];
        const double value = column->values[record->number];
        if (column->texts)
            print_text(column->texts[(int)value], out);
        else
            print_field(value, out);
    }
    fprintf(out, ",%d", record->status);
    for (int k = 0; k < layout->width; k++)
        print_field(record->values[k], out);
    if (has_reasons)
        print_text(record->reason, out);
    fputc('\n', out);
}
