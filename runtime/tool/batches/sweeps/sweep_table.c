/* Tables of cases, which were made elsewhere: see sweeps.h. */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

struct table_reading {
    struct csv csv;
    struct case_names names;
    struct messages messages;
    struct case_table table;
    struct text_set *sets; /* (width) of columns of texts */
    int room;              /* rows */
};

/* The columns, of texts where the name is an option's or that of files; any column may be one where options
 * vary. */
static bool read_columns(struct table_reading *reading, struct cases *cases) {
    struct memory *memory = reading->names.memory;
    const struct place header = {.file = reading->csv.path, .line = 1};
    const int width = reading->csv.count;
    bool options_vary = false;
    reading->table = (struct case_table){.width = width};
    reading->table.columns = memory_get(memory, (size_t)width * sizeof *reading->table.columns);
    reading->sets = memory_get(memory, (size_t)width * sizeof *reading->sets);
    cases->width = width;
    cases->columns = memory_get(memory, (size_t)width * sizeof *cases->columns);
    for (int i = 0; i < width; i++)
        options_vary = options_vary || case_names_is_option(&reading->names, reading->csv.names[i]);
    for (int i = 0; i < width; i++) {
        struct case_column *column = &reading->table.columns[i];
        *column = (struct case_column){.name = memory_text(memory, reading->csv.names[i]), .place = header};
        const bool is_known =
            case_names_find(&reading->names, column->name, column, options_vary, &cases->columns[i]);
        const enum varied_kind kind = cases->columns[i].kind;
        const bool has_texts = cases->columns[i].target && (kind == VARIED_OPTION || kind == VARIED_SAMPLES);
        column->kind = is_known && has_texts ? CASES_TEXTS : CASES_NUMBERS;
        reading->sets[i].memory = memory;
    }
    return reading->messages.errors == 0;
}

/* Room for one more row. */
static void grow(struct table_reading *reading) {
    const long count = reading->table.count;
    if (count < reading->room)
        return;
    const int room = reading->room ? 2 * reading->room : 64;
    for (int i = 0; i < reading->table.width; i++) {
        double **values = &reading->table.columns[i].values;
        *values = memory_grow(reading->names.memory, *values, (size_t)count * sizeof **values,
                              (size_t)room * sizeof **values);
    }
    reading->room = room;
}

static bool read_row(struct table_reading *reading) {
    grow(reading);
    const long row = reading->table.count++;
    for (int i = 0; i < reading->table.width; i++) {
        struct case_column *column = &reading->table.columns[i];
        const char *field = reading->csv.fields[i];
        if (column->kind == CASES_NUMBERS) {
            if (!csv_number(&reading->csv, i, &column->values[row]))
                return false;
        } else if (!*field) {
            return csv_complain(&reading->csv, "%s: the field is empty, a value is needed", column->name);
        } else {
            column->values[row] = text_set_add(&reading->sets[i], field);
        }
    }
    return true;
}

static bool read_rows(struct table_reading *reading) {
    int answer;
    while ((answer = csv_next(&reading->csv)) > 0)
        if (reading->table.count >= INT_MAX / 4 || !read_row(reading))
            return false;
    if (answer == 0 && reading->table.count == 0)
        return csv_complain(&reading->csv, "no row below the names, at least one case is needed");
    for (int i = 0; i < reading->table.width; i++) {
        reading->table.columns[i].texts = reading->sets[i].texts;
        reading->table.columns[i].text_count = reading->sets[i].count;
    }
    return answer == 0;
}

static bool read_table(struct table_reading *reading, struct sweep *sweep, const char *path) {
    struct cases *cases = &sweep->cases;
    if (!csv_open(&reading->csv, path, "cases") || !read_columns(reading, cases) || !read_rows(reading))
        return false;
    cases->count = reading->table.count;
    for (int i = 0; i < cases->width; i++)
        case_names_convert(&reading->names, reading->table.columns[i].name, &reading->table.columns[i],
                           cases->count, &cases->columns[i]);
    if (reading->messages.errors || !case_names_check(&reading->names, &reading->table, cases))
        return false;
    sweep->text = read_text(path, "cases");
    return sweep->text;
}

enum status sweep_read_table(struct sweep *sweep, struct memory *memory, const char *path,
                             const struct generation *generation, const struct options *options) {
    struct table_reading reading = {.messages = {.memory = memory}};
    *sweep = (struct sweep){.keep = {.final = true}, .text = ""};
    reading.names = (struct case_names){.memory = memory,
                                        .messages = &reading.messages,
                                        .generation = generation,
                                        .options = options,
                                        .folder = case_folder(memory, path)};
    const bool is_read = read_table(&reading, sweep, path);
    case_messages_print(&reading.messages);
    csv_close(&reading.csv);
    return is_read ? STATUS_DONE : STATUS_FAULT;
}
