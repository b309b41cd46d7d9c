/* Where the rows of a motion go: see simulate.h. */
#include "runtime/tool/motions/simulate/simulate.h"

static bool is_written(struct row_sink *sink) {
    return !ferror(sink->file);
}

/* ---- CSV ---- */

static bool begin_csv(struct row_sink *sink, const struct table *table) {
    table_header(table, sink->file);
    return is_written(sink);
}

static bool put_csv(struct row_sink *sink, const struct table *table) {
    table_row(table, sink->file);
    return is_written(sink);
}

struct row_sink row_sink_csv(FILE *file) {
    static const struct row_form form = {begin_csv, put_csv, is_written};
    return (struct row_sink){.form = &form, .file = file};
}

/* ---- Numbers ---- */

static bool begin_numbers(struct row_sink *sink, const struct table *table) {
    return table->count > 0 && is_written(sink);
}

static bool put_numbers(struct row_sink *sink, const struct table *table) {
    fwrite(table->values, sizeof *table->values, (size_t)table->count, sink->file);
    return is_written(sink);
}

struct row_sink row_sink_numbers(FILE *file) {
    static const struct row_form form = {begin_numbers, put_numbers, is_written};
    return (struct row_sink){.form = &form, .file = file};
}

/* ---- All ---- */

bool row_sink_begin(struct row_sink *sink, const struct table *table) {
    return sink->form->begin(sink, table);
}

bool row_sink_put(struct row_sink *sink, const struct table *table) {
    return sink->form->put(sink, table);
}

bool row_sink_end(struct row_sink *sink) {
    return sink->form->end(sink);
}

bool row_sink_copy(FILE *numbers, struct row_sink *to, struct table *table) {
    const size_t count = (size_t)table->count;
    bool is_good = row_sink_begin(to, table);
    rewind(numbers);
    while (is_good && fread(table->values, sizeof *table->values, count, numbers) == count)
        is_good = row_sink_put(to, table);
    return row_sink_end(to) && is_good;
}
