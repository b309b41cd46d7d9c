/*
 * Reads a sweep file: from the values of rd.sweep to plain data. Each field has a line in `sweep_fields`,
 * with the function that reads it and the member that it sets.
 *
 * The file runs in the sandbox of model files. Errors are collected in `messages`, to which the caller may
 * add.
 */
#include "gen/read/read.h"
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/random/random.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Bound of the memory for reading and deriving. */
static const size_t bound_of_reading = (size_t)256 << 20;
/* Bound of the number of cases unless the file sets cases_max. More are probably a mistake. */
static const double cases_by_accident = 1e6;
/* Bound of the memory for the tables of all cases. */
static const size_t bound_of_cases = (size_t)512 << 20;

struct reading {
    struct sweep_file *file;
    struct checker check;
};

static void refuse(const struct reading *reading, const struct value *value, const char *path,
                   const char *needed) {
    message_error(reading->check.messages, value->place, "%s: %s; must be %s", path,
                  fields_made_text(&reading->check, value), needed);
}

static const char *number_text(const struct reading *reading, double x) {
    return isfinite(x) ? memory_format(reading->check.memory, "%.15g", x) : text_not_finite(x);
}

static void refuse_number(const struct reading *reading, const struct value *value, const char *path,
                          const char *needed) {
    message_error(reading->check.messages, value->place, "%s: value %s; must be %s", path,
                  number_text(reading, value->number), needed);
}

/* ---- Values of one kind each, stored in `target` ---- */

typedef void read_field(const struct reading *reading, const struct value *value, const char *path,
                        void *target);

static void read_positive(const struct reading *reading, const struct value *value, const char *path,
                          void *target) {
    if (value->kind != VALUE_NUMBER)
        refuse(reading, value, path, "a number");
    else if (!(value->number > 0 && isfinite(value->number)))
        refuse_number(reading, value, path, "positive");
    else
        *(double *)target = value->number;
}

static bool is_whole(const struct reading *reading, const struct value *value, const char *path,
                     double least) {
    const double largest = 9007199254740992; /* 2^53 */
    const double x = value->number;
    if (value->kind != VALUE_NUMBER)
        refuse(reading, value, path, "a number");
    else if (!(x >= least && x <= largest && x == floor(x)))
        refuse_number(reading, value, path,
                      least > 0 ? "a positive whole number" : "a whole number and not negative");
    else
        return true;
    return false;
}

static void read_count(const struct reading *reading, const struct value *value, const char *path,
                       void *target) {
    if (is_whole(reading, value, path, 1))
        *(double *)target = value->number;
}

static void read_seed(const struct reading *reading, const struct value *value, const char *path,
                      void *target) {
    reading->file->has_seed = is_whole(reading, value, path, 0);
    *(double *)target = value->number;
}

static void read_text_field(const struct reading *reading, const struct value *value, const char *path,
                            void *target) {
    if (value->kind != VALUE_TEXT)
        refuse(reading, value, path, "a text");
    else if (!*value->text)
        message_error(reading->check.messages, value->place, "%s: an empty text; must be a name", path);
    else
        *(const char **)target = value->text;
}

static void read_truth(const struct reading *reading, const struct value *value, const char *path,
                       void *target) {
    if (value->kind != VALUE_BOOLEAN)
        refuse(reading, value, path, "true or false");
    else
        *(bool *)target = value->truth;
}

static void read_function(const struct reading *reading, const struct value *value, const char *path,
                          void *target) {
    if (value->kind != VALUE_FUNCTION)
        refuse(reading, value, path, "a function of the values of a case");
    else
        *(const struct value **)target = value;
}

static bool is_list(const struct value *value) {
    return value->kind == VALUE_TABLE && !value->tag && value->field_count == 0;
}

/* ---- Lists of names and of times ---- */

static void read_names(const struct reading *reading, const struct value *value, const char *path,
                       void *target) {
    struct sweep_names *names = target;
    if (value->kind != VALUE_TEXT && !is_list(value)) {
        refuse(reading, value, path, "a list of names such as { \"a\", \"b\" }");
        return;
    }
    names->count = fields_get_names(&reading->check, value, &names->names);
    names->places = memory_get(reading->check.memory, ((size_t)names->count + 1) * sizeof *names->places);
    for (int i = 0; i < names->count; i++)
        names->places[i] = value->kind == VALUE_TABLE && names->count == value->item_count
                               ? value->items[i].place
                               : value->place;
    for (int i = 0; value->kind == VALUE_TABLE && i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TEXT && value->items[i].kind != VALUE_NOTHING)
            refuse(reading, &value->items[i], fields_path_item(&reading->check, path, i), "a name");
    for (int i = 0; i < names->count; i++)
        if (text_index(names->names[i], names->names, names->count) < i)
            message_error(reading->check.messages, names->places[i],
                          "%s: \"%s\" is given twice; give it once", path, names->names[i]);
}

/* Names with commas between them, as on the command line. */
static void read_list(const struct reading *reading, const struct value *value, const char *path,
                      void *target) {
    struct sweep_names names = {.count = 0};
    const char *text = "";
    read_names(reading, value, path, &names);
    for (int i = 0; i < names.count; i++)
        text = memory_format(reading->check.memory, "%s%s%s", text, i ? "," : "", names.names[i]);
    *(const char **)target = text;
}

static void read_times(const struct reading *reading, const struct value *value, const char *path,
                       void *target) {
    struct sweep_keep *keep = target;
    if (!is_list(value) || value->item_count == 0) {
        refuse(reading, value, path, "a list of times such as { 0.5, 1 }");
        return;
    }
    keep->at = memory_get(reading->check.memory, (size_t)value->item_count * sizeof *keep->at);
    keep->at_place = value->place;
    for (int i = 0; i < value->item_count; i++) {
        const struct value *item = &value->items[i];
        const char *own_path = fields_path_item(&reading->check, path, i);
        keep->at[i] = item->number;
        if (item->kind != VALUE_NUMBER && item->kind != VALUE_NOTHING)
            refuse(reading, item, own_path, "a number");
        else if (!(item->number >= 0 && isfinite(item->number)) || (i > 0 && item->number <= keep->at[i - 1]))
            message_error(reading->check.messages, item->place,
                          "%s: time %s; times must ascend and not be negative", own_path,
                          number_text(reading, item->number));
    }
    keep->at_count = value->item_count;
}

/* ---- The columns ---- */

static enum case_values kind_of(const struct value *value) {
    if (value->kind == VALUE_NUMBER)
        return value->is_whole ? CASES_WHOLE : CASES_NUMBERS;
    return value->kind == VALUE_TEXT ? CASES_TEXTS : CASES_TRUTHS;
}

/* Sets the kind of the column with one more entry. Reports mixed kinds. */
static bool join_kinds(const struct reading *reading, struct case_column *column, const struct value *item,
                       int index, const char *path) {
    const enum case_values kind = kind_of(item);
    const bool are_numbers = kind <= CASES_WHOLE && column->kind <= CASES_WHOLE;
    if (index > 0 && kind != column->kind && !are_numbers) {
        refuse(reading, item, path, "of the same kind as the values before it");
        return false;
    }
    column->kind = index > 0 && kind != column->kind ? CASES_NUMBERS : kind;
    return true;
}

static void add_value(const struct reading *reading, struct case_column *column, const struct value *item,
                      int index, const char *path) {
    if (item->kind != VALUE_NUMBER && item->kind != VALUE_TEXT && item->kind != VALUE_BOOLEAN) {
        if (item->kind != VALUE_NOTHING) /* a gap, reported before */
            refuse(reading, item, path, "a number, a text, true or false");
        return;
    }
    if (!join_kinds(reading, column, item, index, path))
        return;
    if (item->kind == VALUE_NUMBER && !isfinite(item->number))
        message_error(reading->check.messages, item->place, "%s: value %s; must be finite", path,
                      text_not_finite(item->number));
    column->values[index] = item->kind == VALUE_NUMBER ? item->number : item->truth;
    if (item->kind == VALUE_TEXT) {
        column->values[index] = index;
        column->texts[index] = item->text;
    }
}

/* A list of values, or one value for all cases. */
static void read_values(const struct reading *reading, struct vary *vary, const struct value *items,
                        int count, const char *path) {
    struct memory *memory = reading->check.memory;
    struct case_column *column = &vary->list;
    *column = (struct case_column){.name = vary->name, .place = vary->place, .text_count = count};
    column->values = memory_get(memory, (size_t)count * sizeof *column->values);
    column->texts = memory_get(memory, (size_t)count * sizeof *column->texts);
    vary->count = count;
    for (int i = 0; i < count; i++)
        add_value(reading, column, &items[i], i,
                  count > 1 ? fields_path_item(&reading->check, path, i) : path);
}

static const struct {
    const char *tag;
    enum vary_form form;
} forms[] = {{"grid", VARY_GRID},
             {"log_grid", VARY_LOG_GRID},
             {"uniform", VARY_UNIFORM},
             {"log_uniform", VARY_LOG_UNIFORM},
             {"normal", VARY_NORMAL}};
enum { FORM_COUNT = sizeof forms / sizeof *forms };

bool sweeps_is_random(const struct vary *vary) {
    return vary->form == VARY_UNIFORM || vary->form == VARY_LOG_UNIFORM || vary->form == VARY_NORMAL;
}

static const char *fault_of_range(struct memory *memory, const struct vary *vary) {
    const double a = vary->from, b = vary->to, largest = 1e300; /* so that no value overflows */
    const bool is_logarithmic = vary->form == VARY_LOG_GRID || vary->form == VARY_LOG_UNIFORM;
    if (!isfinite(a) || !isfinite(b) || !isfinite(vary->count))
        return "a number is not finite; numbers must be finite";
    if (vary->form == VARY_NORMAL && b < 0)
        return memory_format(memory, "standard deviation %.15g; must not be negative", b);
    if (fabs(a) > largest || fabs(b) > largest)
        return "a number is beyond 1e300; numbers must be smaller";
    if (vary->form == VARY_NORMAL)
        return NULL;
    if (is_logarithmic && !(a > 0))
        return memory_format(memory, "from %.15g; bounds must be positive", a);
    if (!sweeps_is_random(vary) && !(vary->count >= 1 && vary->count == floor(vary->count)))
        return memory_format(memory, "%.15g points; must be a positive whole number", vary->count);
    if (!(a < b) && !(a == b && vary->count == 1))
        return memory_format(memory, "from %.15g to %.15g; the range must ascend", a, b);
    return NULL;
}

/* A range made by a function such as rd.grid, unless the file has changed it since. */
static void read_range(const struct reading *reading, struct vary *vary, const struct value *value,
                       const char *path) {
    int index = 0;
    while (index < FORM_COUNT && strcmp(forms[index].tag, value->tag))
        index++;
    const int needed = index < FORM_COUNT && forms[index].form <= VARY_LOG_GRID ? 3 : 2;
    bool has_numbers = index < FORM_COUNT && value->item_count == needed && value->field_count == 0;
    for (int i = 0; has_numbers && i < needed; i++)
        has_numbers = value->items[i].kind == VALUE_NUMBER;
    if (!has_numbers) {
        refuse(reading, value, path,
               "a number, a list of values, rd.grid, log_grid, uniform, log_uniform or normal");
        return;
    }
    vary->form = forms[index].form;
    vary->from = value->items[0].number;
    vary->to = value->items[1].number;
    vary->count = needed == 3 ? value->items[2].number : 0;
    const char *fault = fault_of_range(reading->check.memory, vary);
    if (fault)
        message_error(reading->check.messages, vary->place, "%s: rd.%s: %s", path, value->tag, fault);
}

static void read_column(const struct reading *reading, struct vary *vary, const struct value *value,
                        const char *path) {
    if (value->kind == VALUE_TABLE && value->tag)
        read_range(reading, vary, value, path);
    else if (value->kind == VALUE_TABLE && !is_list(value))
        field_types_has_no_names(&reading->check, value, path, "a list of values");
    else if (value->kind == VALUE_TABLE && value->item_count == 0)
        message_error(reading->check.messages, value->place,
                      "%s: an empty list; must have at least one value", path);
    else if (value->kind == VALUE_TABLE)
        read_values(reading, vary, value->items, value->item_count, path);
    else
        read_values(reading, vary, value, 1, path);
}

static void read_vary(const struct reading *reading, const struct value *value, const char *path,
                      void *target) {
    static const char form[] = "a table such as { m = rd.grid(1, 3, 5) }";
    struct sweep_file *file = reading->file;
    (void)target;
    if (value->kind != VALUE_TABLE || value->tag) {
        refuse(reading, value, path, form);
        return;
    }
    if (!field_types_has_no_items(&reading->check, value, path, form))
        return;
    if (value->field_count == 0)
        message_error(reading->check.messages, value->place, "%s: empty; must have at least one name", path);
    file->varies = memory_get(reading->check.memory, (size_t)value->field_count * sizeof *file->varies);
    file->vary_count = value->field_count;
    for (int i = 0; i < value->field_count; i++) {
        struct value entry = value->fields[i].value;
        file->varies[i] = (struct vary){.name = value->fields[i].name, .place = entry.place, .count = 1};
        read_column(reading, &file->varies[i], &entry,
                    fields_path_name(&reading->check, path, value->fields[i].name));
    }
}

static void read_sequence(const struct reading *reading, const struct value *value, const char *path,
                          void *target) {
    static const char *const names[] = {"random", "sobol", "halton"};
    const char *name = NULL;
    read_text_field(reading, value, path, &name);
    const int index = name ? text_index(name, names, 3) : SEQUENCE_RANDOM;
    if (index < 0)
        fields_refuse_name(&reading->check, value->place, path,
                           memory_format(reading->check.memory, "\"%s\"", name), name, names, 3);
    else
        *(enum sequence *)target = (enum sequence)index;
}

/* ---- Tables with named fields ---- */

struct field_reader {
    const char *name;
    read_field *read;
    size_t target; /* in struct sweep_file */
};

static void read_fields(const struct reading *reading, const struct value *table, const char *path,
                        const struct field_reader *fields, int count) {
    const char *known[32];
    for (int i = 0; i < count; i++)
        known[i] = fields[i].name;
    for (int i = 0; i < table->field_count; i++) {
        const char *name = table->fields[i].name;
        const struct value *value = &table->fields[i].value;
        const char *own_path = fields_path_name(&reading->check, path, name);
        const int field = text_index(name, known, count);
        if (field < 0)
            fields_refuse_name(&reading->check, value->place, own_path, "unknown field", name, known, count);
        else
            fields[field].read(reading, value, own_path, (char *)reading->file + fields[field].target);
    }
    if (table->item_count > 0)
        message_error(reading->check.messages, table->items[0].place,
                      "%s: an entry without a name; write NAME = value", *path ? path : "rd.sweep");
}

#define AT(field) offsetof(struct sweep_file, field)

static void read_keep(const struct reading *reading, const struct value *value, const char *path,
                      void *target) {
    static const struct field_reader fields[] = {
        {"final", read_truth, AT(keep.final)},       {"at", read_times, AT(keep)},
        {"extremes", read_names, AT(keep.extremes)}, {"norms", read_names, AT(keep.norms)},
        {"history", read_names, AT(keep.history)},   {"derivatives", read_names, AT(keep.derivatives)},
        {"limits", read_truth, AT(keep.limits)},
    };
    struct sweep_keep *keep = target;
    if (value->kind != VALUE_TABLE || value->tag) {
        refuse(reading, value, path, "a table such as { final = true }");
        return;
    }
    const int errors = reading->check.messages->errors;
    keep->final = false;
    read_fields(reading, value, path, fields, sizeof fields / sizeof *fields);
    if (!keep->final && !keep->limits &&
        keep->at_count + keep->extremes.count + keep->norms.count + keep->history.count +
                keep->derivatives.count ==
            0 &&
        errors == reading->check.messages->errors)
        message_error(reading->check.messages, value->place,
                      "%s: keeps nothing; add final = true or names of columns", path);
}

static const struct field_reader sweep_fields[] = {
    {"vary", read_vary, 0},
    {"table", read_text_field, AT(table)},
    {"draws", read_count, AT(draws)},
    {"seed", read_seed, AT(seed)},
    {"sequence", read_sequence, AT(sequence)},
    {"cases_max", read_count, AT(cases_max)},
    {"derive", read_function, AT(derive)},
    {"t_end", read_positive, AT(run.t_end)},
    {"tol", read_positive, AT(run.tol)},
    {"step", read_positive, AT(run.step)},
    {"step_max", read_positive, AT(run.step_max)},
    {"every", read_positive, AT(run.every)},
    {"method", read_text_field, AT(run.method)},
    {"from", read_text_field, AT(run.from)},
    {"stabilise", read_text_field, AT(run.stabilise)},
    {"singular", read_text_field, AT(run.singular)},
    {"start", read_text_field, AT(run.start)},
    {"hold", read_list, AT(run.hold)},
    {"release", read_list, AT(run.release)},
    {"way", read_text_field, AT(run.way)},
    {"keep", read_keep, AT(keep)},
};

/* ---- Checks of several fields ---- */

static void check_needed(const struct reading *reading, const struct value *sweep) {
    static const struct {
        const char *name, *form;
    } needed[] = {{"vary", "{ m = rd.grid(1, 3, 5) }"}, {"t_end", "10, the end of the motions [s]"}};
    const struct value *table = value_find_field(sweep, "table");
    if (table && value_find_field(sweep, "vary"))
        message_error(reading->check.messages, table->place,
                      "table: its rows are the cases, but vary is given as well; remove one of them");
    for (int i = table ? 1 : 0; i < 2; i++)
        if (!value_find_field(sweep, needed[i].name))
            message_error(reading->check.messages, sweep->place, "rd.sweep: %s is missing; add %s = %s",
                          needed[i].name, needed[i].name, needed[i].form);
    const struct value *step = value_find_field(sweep, "step");
    if (step && (value_find_field(sweep, "tol") || value_find_field(sweep, "step_max")))
        message_error(
            reading->check.messages, step->place,
            "step: fixed steps, but tol or step_max is given for adaptive steps; remove one of them");
}

/* Random columns need a number of draws. The fields for draws have no effect without them. */
static void check_draws(const struct reading *reading, const struct value *sweep) {
    static const char *const fields[] = {"draws", "seed", "sequence"};
    const struct sweep_file *file = reading->file;
    struct messages *messages = reading->check.messages;
    const struct vary *first = NULL;
    int count = 0;
    for (int i = 0; i < file->vary_count; i++) {
        count += sweeps_is_random(&file->varies[i]);
        first = !first && count ? &file->varies[i] : first;
    }
    for (int i = 0; i < 3 && !first; i++)
        if (value_find_field(sweep, fields[i]))
            message_error(messages, value_find_field(sweep, fields[i])->place,
                          "%s: has no effect, since nothing random varies; remove it", fields[i]);
    if (first && !value_find_field(sweep, "draws"))
        message_error(
            messages, first->place,
            "vary.%s: random, but draws is missing; add draws, the cases at each point of the grids",
            first->name);
    if (file->sequence == SEQUENCE_SOBOL && count > RANDOM_SOBOL_MOST)
        message_error(messages, value_find_field(sweep, "sequence")->place,
                      "sequence: %d random columns; sobol has at most %d", count, RANDOM_SOBOL_MOST);
}

double sweeps_file_case_count(const struct sweep_file *file) {
    double count = file->draws;
    for (int i = 0; i < file->vary_count; i++)
        count *= sweeps_is_random(&file->varies[i]) ? 1 : file->varies[i].count;
    return count;
}

/* Memory of the values of all cases, their structure and their number. The bound equals that of all other
 * memory of a sweep. */
static void check_case_memory(const struct reading *reading, const struct value *sweep, double count) {
    const double bytes = count * (8.0 * (reading->file->vary_count + 1) + 4);
    if (bytes > (double)bound_of_cases)
        message_error(
            reading->check.messages, sweep->place,
            "rd.sweep: %.15g cases take %.0f MB of memory, more than %d MB; divide them into several sweeps",
            count, ceil(bytes / 1048576), (int)(bound_of_cases >> 20));
}

static void check_case_count(const struct reading *reading, const struct value *sweep) {
    const struct sweep_file *file = reading->file;
    struct memory *memory = reading->check.memory;
    const double count = sweeps_file_case_count(file);
    const char *factors = "";
    if (count <= file->cases_max) {
        check_case_memory(reading, sweep, count);
        return;
    }
    for (int i = 0; i < file->vary_count; i++)
        if (file->varies[i].count > 1)
            factors = memory_format(memory, "%s%s%.15g of %s", factors, *factors ? " x " : "",
                                    file->varies[i].count, file->varies[i].name);
    if (file->draws > 1)
        factors = memory_format(memory, "%s%s%.15g draws", factors, *factors ? " x " : "", file->draws);
    message_error(reading->check.messages, sweep->place,
                  "rd.sweep: %.15g cases (%s), more than %.15g; to allow them add cases_max = %.15g", count,
                  factors, file->cases_max, count);
}

static void read_sweep(const struct reading *reading, const struct value *sweep) {
    struct sweep_file *file = reading->file;
    file->place = sweep->place;
    if (!fields_has_tag(sweep, "sweep")) {
        message_error(reading->check.messages, sweep->place,
                      "the file returns %s; must return rd.sweep { ... }", value_kind_text(sweep->kind));
        return;
    }
    read_fields(reading, sweep, "", sweep_fields, sizeof sweep_fields / sizeof *sweep_fields);
    check_needed(reading, sweep);
    check_draws(reading, sweep);
    if (!reading->check.messages->errors)
        check_case_count(reading, sweep);
}

/* ---- The file ---- */

static _Noreturn void out_of_memory(void *context) {
    struct sweep_file *file = context;
    longjmp(file->out_of_memory, 1);
}

static bool no_memory(struct sweep_file *file, const char *path) {
    struct memory *memory = &file->memory;
    const int megabytes = (int)(memory->bound >> 20);
    const bool is_over_bound = memory->is_over_bound;
    memory->bound = 0;
    if (is_over_bound && !file->messages.are_too_many && !setjmp(file->out_of_memory))
        message_error(&file->messages, (struct place){.file = path},
                      "more than %d MB of memory to read the sweep", megabytes);
    return false;
}

bool sweeps_file_read(struct sweep_file *file, const char *path) {
    memset(file, 0, sizeof *file);
    file->memory =
        (struct memory){.allowance = -1, .bound = bound_of_reading, .fail = out_of_memory, .context = file};
    file->messages.memory = &file->memory;
    file->draws = 1;
    file->cases_max = cases_by_accident;
    file->keep.final = true;
    if (setjmp(file->out_of_memory))
        return no_memory(file, path);
    graph_start(&file->graph, &file->memory);
    const struct read_request request = {.file = path, .kind = FILE_SWEEP};
    file->script = script_open(&file->memory, &file->graph, &request, &file->messages);
    const struct reading reading = {.file = file,
                                    .check = {.memory = &file->memory,
                                              .graph = &file->graph,
                                              .messages = &file->messages,
                                              .declarations = NULL}};
    if (file->script)
        read_sweep(&reading, script_result(file->script));
    message_sort(&file->messages);
    return file->messages.errors == 0;
}

bool sweeps_file_derive(struct sweep_file *file, const struct case_table *given, struct memory *memory,
                        struct case_table *derived) {
    *derived = (struct case_table){.count = given->count};
    if (!file->derive)
        return true;
    if (setjmp(file->out_of_memory))
        return no_memory(file, file->place.file);
    return script_derive(file->script, file->derive, given, memory, derived);
}

struct place sweeps_file_place(const struct sweep_file *file, const char *field) {
    const struct value *value = value_find_field(script_result(file->script), field);
    return value ? value->place : file->place;
}

const char *sweeps_file_text(const struct sweep_file *file, struct memory *memory) {
    const struct sources *sources = script_sources(file->script);
    char *text = memory_get(memory, sources->length + (size_t)sources->count + 1), *at = text;
    for (int i = 0; i < sources->count; i++) {
        memcpy(at, sources->list[i].text, sources->list[i].length);
        at += sources->list[i].length;
    }
    return text;
}

void sweeps_file_release(struct sweep_file *file) {
    memory_release(&file->memory);
}
