/*
 * Reads a sweep file: from the values of rd.sweep to plain data. Each field has a line in `sweep_fields`,
 * with the function that reads it and the member that it sets.
 *
 * The file runs in the sandbox of model files. Errors are collected in `messages`, to which the caller may
 * add.
 */
#include "gen/script/script.h"
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/random/random.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Bound of the number of cases unless the file sets cases_max. More are probably a mistake. */
static const double cases_by_accident = 1e6;
/* Bound of the memory for the tables of all cases. */
static const size_t bound_of_cases = (size_t)512 << 20;

/* ---- Values of one kind each ---- */

enum { WHOLE_BITS = 53 }; /* of doubles */

static bool is_whole(const struct plain_file *file, const struct value *value, const char *path,
                     double least) {
    return plain_is_whole(file, value, path, least, ldexp(1, WHOLE_BITS),
                          least > 0 ? "a positive whole number" : "a whole number and not negative");
}

static void read_count(const struct plain_file *file, const struct value *value, const char *path,
                       void *target) {
    if (is_whole(file, value, path, 1))
        *(double *)target = value->number;
}

static void read_seed(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    struct sweep_file *sweep = target;
    sweep->has_seed = is_whole(file, value, path, 0);
    sweep->seed = value->number;
}

static void read_function(const struct plain_file *file, const struct value *value, const char *path,
                          void *target) {
    if (value->kind != VALUE_FUNCTION)
        plain_refuse(file, value, path, "a function of the values of a case");
    else
        *(const struct value **)target = value;
}

static void read_times(const struct plain_file *file, const struct value *value, const char *path,
                       void *target) {
    struct sweep_keep *keep = target;
    if (!plain_is_list(value) || value->item_count == 0) {
        plain_refuse(file, value, path, "a list of times such as { 0.5, 1 }");
        return;
    }
    keep->at = memory_get(file->check.memory, (size_t)value->item_count * sizeof *keep->at);
    keep->at_place = value->place;
    for (int i = 0; i < value->item_count; i++) {
        const struct value *item = &value->items[i];
        const char *own_path = fields_path_item(&file->check, path, i);
        keep->at[i] = item->number;
        if (item->kind != VALUE_NUMBER && item->kind != VALUE_NOTHING)
            plain_refuse(file, item, own_path, "a number");
        else if (!(item->number >= 0 && isfinite(item->number)) || (i > 0 && item->number <= keep->at[i - 1]))
            message_error(file->check.messages, item->place,
                          "%s: time %s; times must ascend and not be negative", own_path,
                          plain_number_text(file, item->number));
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
static bool join_kinds(const struct plain_file *file, struct case_column *column, const struct value *item,
                       int index, const char *path) {
    const enum case_values kind = kind_of(item);
    const bool are_numbers = kind <= CASES_WHOLE && column->kind <= CASES_WHOLE;
    if (index > 0 && kind != column->kind && !are_numbers) {
        plain_refuse(file, item, path, "of the same kind as the values before it");
        return false;
    }
    column->kind = index > 0 && kind != column->kind ? CASES_NUMBERS : kind;
    return true;
}

static void add_value(const struct plain_file *file, struct case_column *column, const struct value *item,
                      int index, const char *path) {
    if (item->kind != VALUE_NUMBER && item->kind != VALUE_TEXT && item->kind != VALUE_BOOLEAN) {
        if (item->kind != VALUE_NOTHING) /* a gap, reported before */
            plain_refuse(file, item, path, "a number, a text, true or false");
        return;
    }
    if (!join_kinds(file, column, item, index, path))
        return;
    if (item->kind == VALUE_NUMBER && !isfinite(item->number))
        message_error(file->check.messages, item->place, "%s: value %s; must be finite", path,
                      text_not_finite(item->number));
    column->values[index] = item->kind == VALUE_NUMBER ? item->number : item->truth;
    if (item->kind == VALUE_TEXT) {
        column->values[index] = index;
        column->texts[index] = item->text;
    }
}

/* A list of values, or one value for all cases. */
static void read_values(const struct plain_file *file, struct vary *vary, const struct value *items,
                        int count, const char *path) {
    struct memory *memory = file->check.memory;
    struct case_column *column = &vary->list;
    *column = (struct case_column){.name = vary->name, .place = vary->place, .text_count = count};
    column->values = memory_get(memory, (size_t)count * sizeof *column->values);
    column->texts = memory_get(memory, (size_t)count * sizeof *column->texts);
    vary->count = count;
    for (int i = 0; i < count; i++)
        add_value(file, column, &items[i], i, count > 1 ? fields_path_item(&file->check, path, i) : path);
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
static void read_range(const struct plain_file *file, struct vary *vary, const struct value *value,
                       const char *path) {
    int index = 0;
    while (index < FORM_COUNT && strcmp(forms[index].tag, value->tag))
        index++;
    const int needed = index < FORM_COUNT && forms[index].form <= VARY_LOG_GRID ? 3 : 2;
    if (index == FORM_COUNT || !plain_is_made(value, forms[index].tag, needed, needed)) {
        plain_refuse(file, value, path,
                     "a number, a list of values, rd.grid, log_grid, uniform, log_uniform or normal");
        return;
    }
    vary->form = forms[index].form;
    vary->from = value->items[0].number;
    vary->to = value->items[1].number;
    vary->count = needed == 3 ? value->items[2].number : 0;
    const char *fault = fault_of_range(file->check.memory, vary);
    if (fault)
        message_error(file->check.messages, vary->place, "%s: rd.%s: %s", path, value->tag, fault);
}

static void read_column(const struct plain_file *file, struct vary *vary, const struct value *value,
                        const char *path) {
    if (value->kind == VALUE_TABLE && value->tag)
        read_range(file, vary, value, path);
    else if (value->kind == VALUE_TABLE && !plain_is_list(value))
        field_types_has_no_names(&file->check, value, path, "a list of values");
    else if (value->kind == VALUE_TABLE && value->item_count == 0)
        message_error(file->check.messages, value->place, "%s: an empty list; must have at least one value",
                      path);
    else if (value->kind == VALUE_TABLE)
        read_values(file, vary, value->items, value->item_count, path);
    else
        read_values(file, vary, value, 1, path);
}

static void read_vary(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    struct sweep_file *sweep = target;
    if (!plain_needs_names(file, value, path, "{ m = rd.grid(1, 3, 5) }"))
        return;
    sweep->varies = memory_get(file->check.memory, (size_t)value->field_count * sizeof *sweep->varies);
    sweep->vary_count = value->field_count;
    for (int i = 0; i < value->field_count; i++) {
        struct value entry = value->fields[i].value;
        sweep->varies[i] = (struct vary){.name = value->fields[i].name, .place = entry.place, .count = 1};
        read_column(file, &sweep->varies[i], &entry,
                    fields_path_name(&file->check, path, value->fields[i].name));
    }
}

static void read_sequence(const struct plain_file *file, const struct value *value, const char *path,
                          void *target) {
    static const char *const names[] = {"random", "sobol", "halton"};
    const char *name = NULL;
    plain_read_text(file, value, path, &name);
    const int index = name ? text_index(name, names, 3) : SEQUENCE_RANDOM;
    if (index < 0)
        fields_refuse_name(&file->check, value->place, path,
                           memory_format(file->check.memory, "\"%s\"", name), name, names, 3);
    else
        *(enum sequence *)target = (enum sequence)index;
}

/* ---- Fields ---- */

#define AT(field) offsetof(struct sweep_file, field)

static void read_keep(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    static const struct plain_field fields[] = {
        {"final", plain_read_truth, AT(keep.final)},
        {"at", read_times, AT(keep)},
        {"extremes", plain_read_names, AT(keep.extremes)},
        {"norms", plain_read_names, AT(keep.norms)},
        {"history", plain_read_names, AT(keep.history)},
        {"derivatives", plain_read_names, AT(keep.derivatives)},
        {"limits", plain_read_truth, AT(keep.limits)},
    };
    struct sweep_keep *keep = target;
    if (value->kind != VALUE_TABLE || value->tag) {
        plain_refuse(file, value, path, "a table such as { final = true }");
        return;
    }
    const int errors = file->check.messages->errors;
    keep->final = false;
    plain_read_fields(file, value, path, fields, sizeof fields / sizeof *fields);
    if (!keep->final && !keep->limits &&
        keep->at_count + keep->extremes.count + keep->norms.count + keep->history.count +
                keep->derivatives.count ==
            0 &&
        errors == file->check.messages->errors)
        message_error(file->check.messages, value->place,
                      "%s: keeps nothing; add final = true or names of columns", path);
}

static const struct plain_field sweep_fields[] = {
    {"vary", read_vary, 0},
    {"table", plain_read_text, AT(table)},
    {"draws", read_count, AT(draws)},
    {"seed", read_seed, 0},
    {"sequence", read_sequence, AT(sequence)},
    {"cases_max", read_count, AT(cases_max)},
    {"derive", read_function, AT(derive)},
    {"t_end", plain_read_positive, AT(run.t_end)},
    {"tol", plain_read_positive, AT(run.tol)},
    {"tol_rates", plain_read_positive, AT(run.tol_rates)},
    {"step", plain_read_positive, AT(run.step)},
    {"step_max", plain_read_positive, AT(run.step_max)},
    {"every", plain_read_positive, AT(run.every)},
    {"method", plain_read_text, AT(run.method)},
    {"from", plain_read_text, AT(run.from)},
    {"stabilise", plain_read_text, AT(run.stabilise)},
    {"singular", plain_read_text, AT(run.singular)},
    {"start", plain_read_text, AT(run.start)},
    {"hold", plain_read_joined, AT(run.hold)},
    {"release", plain_read_joined, AT(run.release)},
    {"way", plain_read_text, AT(run.way)},
    {"realise", plain_read_truth, AT(run.realise)},
    {"before", plain_read_positive, AT(run.before)},
    {"after", plain_read_positive, AT(run.after)},
    {"mesh", plain_read_positive, AT(run.mesh)},
    {"keep", read_keep, AT(keep)},
};

/* ---- Checks of several fields ---- */

static void check_needed(const struct plain_file *file, const struct value *value) {
    const struct value *table = value_find_field(value, "table");
    if (table && value_find_field(value, "vary"))
        message_error(file->check.messages, table->place,
                      "table: its rows are the cases, but vary is given as well; remove one of them");
    if (!table)
        plain_needs_field(file, value, "vary", "{ m = rd.grid(1, 3, 5) }");
    plain_needs_field(file, value, "t_end", "10, the end of the motions [s]");
    const struct value *step = value_find_field(value, "step");
    if (step && (value_find_field(value, "tol") || value_find_field(value, "tol_rates") ||
                 value_find_field(value, "step_max")))
        message_error(file->check.messages, step->place,
                      "step: fixed steps, but tol, tol_rates or step_max is given for adaptive steps; remove "
                      "one of them");
}

/* Random columns need a number of draws. The fields for draws have no effect without them. */
static void check_draws(const struct plain_file *file, const struct value *value) {
    static const char *const fields[] = {"draws", "seed", "sequence"};
    const struct sweep_file *sweep = file->data;
    struct messages *messages = file->check.messages;
    const struct vary *first = NULL;
    int count = 0;
    for (int i = 0; i < sweep->vary_count; i++) {
        count += sweeps_is_random(&sweep->varies[i]);
        first = !first && count ? &sweep->varies[i] : first;
    }
    for (int i = 0; i < 3 && !first; i++)
        if (value_find_field(value, fields[i]))
            message_error(messages, value_find_field(value, fields[i])->place,
                          "%s: has no effect, since nothing random varies; remove it", fields[i]);
    if (first && !value_find_field(value, "draws"))
        message_error(
            messages, first->place,
            "vary.%s: random, but draws is missing; add draws, the cases at each point of the grids",
            first->name);
    if (sweep->sequence == SEQUENCE_SOBOL && count > RANDOM_SOBOL_MOST)
        message_error(messages, value_find_field(value, "sequence")->place,
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
static void check_case_memory(const struct plain_file *file, const struct value *value, double count) {
    const struct sweep_file *sweep = file->data;
    const double bytes = count * (8.0 * (sweep->vary_count + 1) + 4);
    if (bytes > (double)bound_of_cases)
        message_error(
            file->check.messages, value->place,
            "rd.sweep: %.15g cases take %.0f MB of memory, more than %d MB; divide them into several sweeps",
            count, ceil(bytes / 1048576), (int)(bound_of_cases >> 20));
}

static void check_case_count(const struct plain_file *file, const struct value *value) {
    const struct sweep_file *sweep = file->data;
    struct memory *memory = file->check.memory;
    const double count = sweeps_file_case_count(sweep);
    const char *factors = "";
    if (count <= sweep->cases_max) {
        check_case_memory(file, value, count);
        return;
    }
    for (int i = 0; i < sweep->vary_count; i++)
        if (sweep->varies[i].count > 1)
            factors = memory_format(memory, "%s%s%.15g of %s", factors, *factors ? " x " : "",
                                    sweep->varies[i].count, sweep->varies[i].name);
    if (sweep->draws > 1)
        factors = memory_format(memory, "%s%s%.15g draws", factors, *factors ? " x " : "", sweep->draws);
    message_error(file->check.messages, value->place,
                  "rd.sweep: %.15g cases (%s), more than %.15g; to allow them add cases_max = %.15g", count,
                  factors, sweep->cases_max, count);
}

static void read_sweep(const struct plain_file *file, const struct value *value, const char *path,
                       void *target) {
    struct sweep_file *sweep = target;
    sweep->place = value->place;
    plain_read_fields(file, value, path, sweep_fields, sizeof sweep_fields / sizeof *sweep_fields);
    check_needed(file, value);
    check_draws(file, value);
    if (!file->check.messages->errors)
        check_case_count(file, value);
}

/* ---- The file ---- */

bool sweeps_file_read(struct sweep_file *file, const char *path) {
    *file = (struct sweep_file){.draws = 1, .cases_max = cases_by_accident, .keep.final = true};
    return plain_file_read(&file->plain, path, FILE_SWEEP, read_sweep, file, format_out_of_memory);
}

struct deriving {
    const struct case_table *given;
    struct memory *memory;
    struct case_table *derived;
};

static bool derive(struct plain_file *file, void *context) {
    const struct deriving *deriving = context;
    const struct sweep_file *sweep = file->data;
    return script_derive(file->script, sweep->derive, deriving->given, deriving->memory, deriving->derived);
}

bool sweeps_file_derive(struct sweep_file *file, const struct case_table *given, struct memory *memory,
                        struct case_table *derived) {
    struct deriving deriving = {given, memory, derived};
    *derived = (struct case_table){.count = given->count};
    return !file->derive || plain_file_try(&file->plain, derive, &deriving);
}

struct place sweeps_file_place(const struct sweep_file *file, const char *field) {
    const struct value *value = value_find_field(script_result(file->plain.script), field);
    return value ? value->place : file->place;
}

const char *sweeps_file_text(const struct sweep_file *file, struct memory *memory) {
    const struct sources *sources = script_sources(file->plain.script);
    char *text = memory_get(memory, sources->length + (size_t)sources->count + 1), *at = text;
    for (int i = 0; i < sources->count; i++) {
        memcpy(at, sources->list[i].text, sources->list[i].length);
        at += sources->list[i].length;
    }
    return text;
}

void sweeps_file_release(struct sweep_file *file) {
    memory_release(&file->plain.memory);
}
