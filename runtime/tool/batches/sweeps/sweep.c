/*
 * Reads a sweep file or a table of cases for one model: columns of cases, what is kept, options of the
 * motions.
 *
 * The generator reads the language (gen/language/); expand.c makes the cases of a sweep file.
 */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct sweep_reading {
    struct sweep_file file;
    struct case_names names;
    struct messages messages; /* about names that the model lacks */
    struct sweep *sweep;
    struct case_table table; /* given columns, then derived ones */
    int given;               /* number of columns that vary or that a table lists */
};

static const char *folder_of(struct memory *memory, const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? memory_format(memory, "%.*s", (int)(slash + 1 - path), path) : "";
}

/* ---- A table of cases ---- */

struct table_reading {
    struct csv csv;
    struct case_names names;
    struct case_table table;
    struct text_set *sets; /* (width) of columns of texts */
    int room;              /* rows */
};

/* A column has texts if its name is an option or `inputs`, and numbers otherwise. Where options vary, another
 * structure may have a name that this one lacks. */
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
        options_vary = options_vary || sweeps_names_is_option(&reading->names, reading->csv.names[i]);
    for (int i = 0; i < width; i++) {
        struct case_column *column = &reading->table.columns[i];
        *column = (struct case_column){.name = memory_text(memory, reading->csv.names[i]), .place = header};
        const bool is_known =
            sweeps_names_find(&reading->names, column->name, column, options_vary, &cases->columns[i]);
        const enum varied_kind kind = cases->columns[i].kind;
        const bool has_texts = cases->columns[i].target && (kind == VARIED_OPTION || kind == VARIED_SAMPLES);
        column->kind = is_known && has_texts ? CASES_TEXTS : CASES_NUMBERS;
        reading->sets[i].memory = memory;
    }
    return reading->names.messages->errors == 0;
}

/* Makes space for one more row. */
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

/* Numbers, and nan, inf and -inf as other programs write them: such a case is not computed. */
static bool read_number(const struct table_reading *reading, int column, double *value) {
    const char *field = reading->csv.fields[column];
    const bool is_negative = *field == '-';
    if (!*field)
        return format_csv_complain(
            &reading->csv, "%s: the field is empty; write a number, or nan for a case without this value",
            reading->table.columns[column].name);
    *value = strcasecmp(field, "nan") == 0 ? NAN : is_negative ? -INFINITY : INFINITY;
    return isnan(*value) || strcasecmp(field + is_negative, "inf") == 0 ||
           format_csv_number(&reading->csv, column, value);
}

static bool read_row(struct table_reading *reading) {
    grow(reading);
    const long row = reading->table.count++;
    for (int i = 0; i < reading->table.width; i++) {
        struct case_column *column = &reading->table.columns[i];
        const char *field = reading->csv.fields[i];
        if (column->kind == CASES_NUMBERS) {
            if (!read_number(reading, i, &column->values[row]))
                return false;
        } else if (!*field) {
            return format_csv_complain(&reading->csv, "%s: the field is empty; write a value", column->name);
        } else {
            column->values[row] = sweeps_text_set_add(&reading->sets[i], field);
        }
    }
    return true;
}

static bool read_rows(struct table_reading *reading) {
    int answer;
    while ((answer = format_csv_next(&reading->csv)) > 0)
        if (reading->table.count >= INT_MAX / 4 || !read_row(reading))
            return false;
    if (answer == 0 && reading->table.count == 0)
        return format_csv_complain(&reading->csv, "no row below the names; write at least one case");
    for (int i = 0; i < reading->table.width; i++) {
        reading->table.columns[i].texts = reading->sets[i].texts;
        reading->table.columns[i].text_count = reading->sets[i].count;
    }
    return answer == 0;
}

/* Reads the columns; `cases` has what each of them is. Errors about the form go to stderr. */
static bool read_table(struct table_reading *reading, struct cases *cases, const char *path) {
    const bool is_read =
        format_csv_open(&reading->csv, path, "cases") && read_columns(reading, cases) && read_rows(reading);
    cases->count = reading->table.count;
    format_csv_close(&reading->csv);
    return is_read;
}

/* ---- Names ---- */

static bool has_options(const struct sweep_reading *reading) {
    for (int i = 0; i < reading->file.vary_count; i++)
        if (sweeps_names_is_option(&reading->names, reading->file.varies[i].name))
            return true;
    return false;
}

static const char *path_of(const struct sweep_reading *reading, int column) {
    const char *origin = column >= reading->given ? "derive: " : reading->file.table ? "" : "vary.";
    return memory_format(reading->names.memory, "%s%s", origin, reading->table.columns[column].name);
}

/* Checks that need no cases. A name may wait for the cases if `derive` may return options. */
static void find_varied(struct sweep_reading *reading) {
    const struct sweep_file *file = &reading->file;
    const bool derives_options = file->derive && reading->names.generation->model.option_count > 0;
    const bool may_wait = has_options(reading) || derives_options;
    for (int i = 0; i < file->vary_count; i++) {
        const struct vary *vary = &file->varies[i];
        const struct case_column column = {.name = vary->name, .place = vary->place};
        const char *path = memory_format(reading->names.memory, "vary.%s", vary->name);
        struct varied varied;
        if (sweeps_names_find(&reading->names, path, &column, may_wait, &varied) && varied.target &&
            sweeps_is_random(vary) && (varied.kind == VARIED_OPTION || varied.kind == VARIED_SAMPLES))
            message_error(&reading->messages, vary->place, "%s: random numbers; write a list of values",
                          path);
    }
    if (file->sequence == SEQUENCE_SOBOL && !HAS_METHODS_OF_GSL)
        message_error(&reading->messages, file->place, "sequence: sobol needs GSL; build refdyn with it");
}

/* ---- Cases ---- */

/* Reads the columns that vary: from the file's table, whose path is relative to the file, or from `vary`. */
static bool make_given(struct sweep_reading *reading, struct case_table *given) {
    const char *table = reading->file.table;
    struct table_reading rows = {.names = reading->names};
    struct cases cases;
    if (!table) {
        sweeps_expand_cases(&reading->file, reading->names.memory, given);
        return true;
    }
    reading->sweep->table =
        memory_format(reading->names.memory, "%s%s", *table == '/' ? "" : reading->names.folder, table);
    const bool is_read = read_table(&rows, &cases, reading->sweep->table);
    *given = rows.table;
    return is_read;
}

/* Joins given and derived columns into one table. The messages of the file have the errors of `derive`. */
static bool make_table(struct sweep_reading *reading) {
    struct memory *memory = reading->names.memory;
    struct case_table given, derived;
    if (!make_given(reading, &given))
        return false;
    reading->given = given.width;
    if (!sweeps_file_derive(&reading->file, &given, memory, &derived))
        return false;
    reading->table = (struct case_table){.count = given.count, .width = given.width + derived.width};
    reading->table.columns = memory_get(memory, (size_t)reading->table.width * sizeof *given.columns);
    memcpy(reading->table.columns, given.columns, (size_t)given.width * sizeof *given.columns);
    if (derived.width)
        memcpy(reading->table.columns + given.width, derived.columns,
               (size_t)derived.width * sizeof *given.columns);
    return true;
}

static void make_cases(struct sweep_reading *reading) {
    const struct case_table *table = &reading->table;
    struct cases *cases = &reading->sweep->cases;
    bool options_vary = false;
    *cases = (struct cases){.count = table->count, .width = table->width};
    cases->columns = memory_get(reading->names.memory, (size_t)table->width * sizeof *cases->columns);
    for (int i = 0; i < table->width; i++)
        options_vary = options_vary || sweeps_names_is_option(&reading->names, table->columns[i].name);
    for (int i = 0; i < table->width; i++)
        if (sweeps_names_find(&reading->names, path_of(reading, i), &table->columns[i], options_vary,
                              &cases->columns[i]))
            sweeps_names_convert(&reading->names, path_of(reading, i), &table->columns[i], table->count,
                                 &cases->columns[i]);
    if (!reading->messages.errors)
        sweeps_names_check(&reading->names, table, cases);
}

/* ---- What is kept, and how motions run ---- */

static const char *place_text(struct memory *memory, struct place place) {
    return memory_format(memory, "%s:%d", place.file, place.line);
}

static struct name_list copy_names(struct memory *memory, const struct plain_names *names) {
    struct name_list list = {.count = names->count};
    list.names = memory_get(memory, ((size_t)names->count + 1) * sizeof *list.names);
    const char **places = memory_get(memory, ((size_t)names->count + 1) * sizeof *places);
    for (int i = 0; i < names->count; i++) {
        list.names[i] = memory_text(memory, names->names[i]);
        places[i] = place_text(memory, names->places[i]);
    }
    list.places = places;
    return list;
}

static void copy_keep(struct sweep_reading *reading, double t_end) {
    struct memory *memory = reading->names.memory;
    const struct sweep_keep *keep = &reading->file.keep;
    for (int i = 0; i < keep->at_count; i++)
        if (keep->at[i] > t_end)
            message_error(&reading->messages, keep->at_place,
                          "keep.at[%d]: time %.15g; must not be after the end of the motions at %.15g", i + 1,
                          keep->at[i], t_end);
    reading->sweep->keep =
        (struct keep){.final = keep->final,
                      .limits = keep->limits,
                      .extremes = copy_names(memory, &keep->extremes),
                      .norms = copy_names(memory, &keep->norms),
                      .history = copy_names(memory, &keep->history),
                      .derivatives = copy_names(memory, &keep->derivatives),
                      .at = memory_grow(memory, keep->at, (size_t)keep->at_count * sizeof *keep->at,
                                        ((size_t)keep->at_count + 1) * sizeof *keep->at),
                      .at_count = keep->at_count};
}

/* Notes where the file sets an option, for messages about its value. */
static void tell(struct sweep_reading *reading, struct options *options, const char *option,
                 const char *field) {
    struct memory *memory = reading->names.memory;
    const size_t size = sizeof *options->origins, count = (size_t)options->origin_count;
    struct option_origin *origins = memory_grow(memory, options->origins, count * size, (count + 1) * size);
    origins[options->origin_count++] =
        (struct option_origin){option, field, place_text(memory, sweeps_file_place(&reading->file, field))};
    options->origins = origins;
}

/* Sets an option that the command line leaves open. */
static void set_number(struct sweep_reading *reading, struct options *options, double value,
                       const char *option, const char *field) {
    if (options_has(options, option) || !(value > 0))
        return;
    options_set_number(options, option, value);
    tell(reading, options, option, field);
}

static void set_text(struct sweep_reading *reading, struct options *options, const char *value,
                     const char *option) {
    if (options_has(options, option) || !value)
        return;
    options_set_text(options, option, memory_text(reading->names.memory, value));
    tell(reading, options, option, option);
}

/* The command line overrides the file: fixed steps there also cancel the file's tolerance, and the reverse.
 */
static void set_options(struct sweep_reading *reading, struct options *options) {
    const double step = options_number(options, "step"), tol = options_number(options, "tol"),
                 tol_rates = options_number(options, "tol-rates"),
                 step_max = options_number(options, "step-max");
    const struct sweep_run *run = &reading->file.run;
    const bool has_step = step > 0, has_tolerance = tol > 0 || tol_rates > 0 || step_max > 0;
    set_number(reading, options, run->t_end, "until", "t_end");
    set_number(reading, options, run->every, "every", "every");
    set_number(reading, options, has_tolerance ? 0 : run->step, "step", "step");
    set_number(reading, options, has_step ? 0 : run->tol, "tol", "tol");
    set_number(reading, options, has_step ? 0 : run->tol_rates, "tol-rates", "tol_rates");
    set_number(reading, options, has_step ? 0 : run->step_max, "step-max", "step_max");
    set_number(reading, options, run->before, "before", "before");
    set_number(reading, options, run->after, "after", "after");
    set_number(reading, options, run->mesh, "mesh", "mesh");
    if (run->realise && !options_has(options, "realise")) {
        options_set_flag(options, "realise");
        tell(reading, options, "realise", "realise");
    }
    set_text(reading, options, run->method, "method");
    set_text(reading, options, run->stabilise, "stabilise");
    set_text(reading, options, run->singular, "singular");
    set_text(reading, options, run->start, "start");
    set_text(reading, options, run->hold, "hold");
    set_text(reading, options, run->release, "release");
    set_text(reading, options, run->way, "way");
    const bool is_file = run->from && strcmp(run->from, "initial") != 0 &&
                         strcmp(run->from, "statics") != 0 &&
                         !(options_has(options, "realise") && strcmp(run->from, "held") == 0);
    set_text(reading, options,
             is_file && *run->from != '/'
                 ? memory_format(reading->names.memory, "%s%s", reading->names.folder, run->from)
                 : run->from,
             "from");
    tell(reading, options, "keep", "keep");
}

/* ---- The file ---- */

static bool read_sweep(struct sweep_reading *reading, const char *path, struct options *options) {
    const double until = options_number(options, "until");
    if (!sweeps_file_read(&reading->file, path))
        return false;
    find_varied(reading);
    const double t_end = until > 0 ? until : reading->file.run.t_end;
    copy_keep(reading, t_end);
    if (reading->messages.errors || !make_table(reading))
        return false;
    make_cases(reading);
    if (reading->messages.errors)
        return false;
    set_options(reading, options);
    const char *rows = reading->sweep->table ? format_read_file(reading->sweep->table, "cases") : "";
    reading->sweep->text = rows ? memory_format(reading->names.memory, "%s%s",
                                                sweeps_file_text(&reading->file, reading->names.memory), rows)
                                : NULL;
    return rows != NULL;
}

enum status sweeps_read(struct sweep *sweep, struct memory *memory, const char *path,
                        const struct generation *generation, struct options *options) {
    struct sweep_reading reading = {.sweep = sweep, .messages = {.memory = memory}};
    *sweep = (struct sweep){.text = ""};
    reading.names = (struct case_names){.memory = memory,
                                        .messages = &reading.messages,
                                        .generation = generation,
                                        .options = options,
                                        .folder = folder_of(memory, path)};
    const bool is_read = read_sweep(&reading, path, options);
    format_complain_messages(&reading.file.plain.messages, 0);
    format_complain_messages(&reading.messages, 0);
    if (!is_read && !sweep->table && reading.file.plain.messages.errors + reading.messages.errors == 0)
        format_complain("refdyn: %s: out of memory\n", path);
    sweeps_file_release(&reading.file);
    return is_read ? STATUS_DONE : STATUS_FAULT;
}

/* ---- A table alone ---- */

static bool read_alone(struct table_reading *reading, struct sweep *sweep, const char *path) {
    struct cases *cases = &sweep->cases;
    if (!read_table(reading, cases, path))
        return false;
    for (int i = 0; i < cases->width; i++)
        sweeps_names_convert(&reading->names, reading->table.columns[i].name, &reading->table.columns[i],
                             cases->count, &cases->columns[i]);
    if (reading->names.messages->errors || !sweeps_names_check(&reading->names, &reading->table, cases))
        return false;
    sweep->text = format_read_file(path, "cases");
    return sweep->text;
}

enum status sweeps_read_table(struct sweep *sweep, struct memory *memory, const char *path,
                              const struct generation *generation, const struct options *options) {
    struct messages messages = {.memory = memory};
    struct table_reading reading = {.names = {.memory = memory,
                                              .messages = &messages,
                                              .generation = generation,
                                              .options = options,
                                              .folder = folder_of(memory, path)}};
    *sweep = (struct sweep){.keep = {.final = true}, .text = ""};
    const bool is_read = read_alone(&reading, sweep, path);
    format_complain_messages(&messages, 0);
    return is_read ? STATUS_DONE : STATUS_FAULT;
}
