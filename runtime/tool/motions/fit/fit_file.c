/*
 * A request in a file: from the table of rd.fit in FIT.lua to `struct fit_request`.
 *
 * The file runs in the sandbox of model files. It is read without the model, so that it may contain any name.
 * Texts are copied into the memory of the program, and the memory of Lua is released.
 */
#include <math.h>
#include <setjmp.h>
#include <string.h>

#include "gen/gen.h"
#include "gen/read/read.h"
#include "runtime/tool/motions/fit/fit.h"

/* Largest memory for reading. */
static const size_t bound_of_reading = (size_t)64 << 20;

static const char vary_form[] = "{ m = rd.free() }", noise_form[] = "{ psi = 1e-3 }",
                  data_form[] = "{ \"run.csv\" }", range_form[] = "rd.free() or rd.within(FROM, TO)";

struct fit_file {
    struct memory memory;
    struct graph graph;
    struct messages messages;
    struct checker check;
    jmp_buf out_of_memory;
    struct fit_request *request;
};

static void refuse(const struct fit_file *file, const struct value *value, const char *path,
                   const char *needed) {
    message_error(file->check.messages, value->place, "%s: %s; must be %s", path,
                  fields_made_text(&file->check, value), needed);
}

static void refuse_number(const struct fit_file *file, const struct value *value, const char *path,
                          const char *needed) {
    message_error(file->check.messages, value->place, "%s: value %s; must be %s", path,
                  isfinite(value->number) ? format_text("%.15g", value->number)
                                          : text_not_finite(value->number),
                  needed);
}

static const char *place_text(const struct value *value) {
    return format_text("%s:%d", value->place.file, value->place.line);
}

static bool is_list(const struct value *value) {
    return value->kind == VALUE_TABLE && !value->tag && value->field_count == 0;
}

/* Whether the value is a table with named entries only; reports anything else. */
static bool is_named(const struct fit_file *file, const struct value *value, const char *path,
                     const char *form) {
    const char *needed = format_text("a table such as %s", form);
    if (value->kind == VALUE_TABLE && !value->tag)
        return field_types_has_no_items(&file->check, value, path, needed);
    refuse(file, value, path, needed);
    return false;
}

static bool is_listed(const struct fit_file *file, const struct value *value, const char *path,
                      const char *form) {
    if (is_list(value))
        return true;
    refuse(file, value, path, format_text("a list such as %s", form));
    return false;
}

static double read_positive(const struct fit_file *file, const struct value *value, const char *path) {
    if (value->kind != VALUE_NUMBER)
        refuse(file, value, path, "a number");
    else if (!(value->number > 0 && isfinite(value->number)))
        refuse_number(file, value, path, "positive");
    else
        return value->number;
    return 1;
}

/* ---- Ranges ---- */

static const char *fault_of_range(const struct fit_range *range) {
    const double largest = 1e300; /* so that no difference overflows */
    if (!(fabs(range->lower) <= largest && fabs(range->upper) <= largest && isfinite(range->start)))
        return "a number is not finite; numbers must be finite";
    if (!(range->lower < range->upper))
        return format_text("from %.15g to %.15g; the range must ascend", range->lower, range->upper);
    if (range->has_start && !(range->lower <= range->start && range->start <= range->upper))
        return format_text("start %.15g; must be from %.15g to %.15g", range->start, range->lower,
                           range->upper);
    return NULL;
}

/* Whether a function of rd has made the value with `least` to `most` numbers, and the file has not changed it
 * since. */
static bool is_made(const struct value *value, const char *tag, int least, int most) {
    bool has_numbers = fields_has_tag(value, tag) && value->item_count >= least &&
                       value->item_count <= most && value->field_count == 0;
    for (int i = 0; has_numbers && i < value->item_count; i++)
        has_numbers = value->items[i].kind == VALUE_NUMBER;
    return has_numbers;
}

static struct fit_range read_range(const struct fit_file *file, const struct value *value, const char *path,
                                   const char *needed) {
    struct fit_range range = {.is_unknown = true, .lower = -INFINITY, .upper = INFINITY};
    if (is_made(value, "free", 0, 0))
        return range;
    if (!is_made(value, "within", 2, 3)) {
        refuse(file, value, path, needed);
        return range;
    }
    range.is_bounded = true;
    range.lower = value->items[0].number;
    range.upper = value->items[1].number;
    range.has_start = value->item_count == 3;
    range.start = range.has_start ? value->items[2].number : 0;
    const char *fault = fault_of_range(&range);
    if (fault)
        message_error(file->check.messages, value->place, "%s: rd.within: %s", path, fault);
    return range;
}

/* ---- Fields ---- */

typedef void read_field(struct fit_file *file, const struct value *value, const char *path);

static void read_vary(struct fit_file *file, const struct value *value, const char *path) {
    struct fit_request *request = file->request;
    if (!is_named(file, value, path, vary_form))
        return;
    request->value_count = value->field_count;
    request->values = format_allocate((size_t)value->field_count, sizeof *request->values);
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        const char *name = format_text("%s", value->fields[i].name);
        request->values[i] = (struct fit_asked_value){
            name, place_text(entry),
            read_range(file, entry, fields_path_name(&file->check, path, name), range_form)};
    }
}

static void read_noise(struct fit_file *file, const struct value *value, const char *path) {
    struct fit_request *request = file->request;
    if (!is_named(file, value, path, noise_form))
        return;
    if (value->field_count == 0)
        message_error(file->check.messages, value->place,
                      "%s: empty; must have at least one column, as in %s", path, noise_form);
    request->column_count = value->field_count;
    request->columns = format_allocate((size_t)value->field_count, sizeof *request->columns);
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        const char *name = format_text("%s", value->fields[i].name);
        struct fit_asked_column *column = &request->columns[i];
        *column = (struct fit_asked_column){.name = name, .place = place_text(entry)};
        column->noise = read_positive(file, entry, fields_path_name(&file->check, path, name));
        for (int k = 0; k < FIT_SENSOR_COUNT; k++)
            column->sensor[k] = (struct fit_range){.number = fit_sensor_ideal[k]};
    }
}

static struct fit_range read_property(const struct fit_file *file, const struct value *value,
                                      const char *path, enum fit_kind kind) {
    const char *needed =
        kind == FIT_DELAY ? "a number [s] or rd.within(FROM, TO)" : format_text("a number, %s", range_form);
    if (value->kind != VALUE_NUMBER) {
        const struct fit_range range = read_range(file, value, path, needed);
        if (kind == FIT_DELAY && range.is_unknown && fields_has_tag(value, "free"))
            refuse(file, value, path, needed);
        return range;
    }
    if (!isfinite(value->number) || (kind == FIT_GAIN && value->number == 0))
        refuse_number(file, value, path, kind == FIT_GAIN ? "finite and not 0" : "finite");
    return (struct fit_range){.number = value->number};
}

static void read_sensor(struct fit_file *file, const struct value *value, const char *path,
                        struct fit_asked_column *column) {
    if (!is_named(file, value, path, "{ offset = rd.free() }"))
        return;
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        const char *name = value->fields[i].name, *own_path = fields_path_name(&file->check, path, name);
        const int kind = text_index(name, fit_sensor_words, FIT_SENSOR_COUNT);
        if (kind < 0)
            fields_refuse_name(&file->check, entry->place, own_path, "unknown field", name, fit_sensor_words,
                               FIT_SENSOR_COUNT);
        else
            column->sensor[kind] = read_property(file, entry, own_path, (enum fit_kind)kind);
    }
}

/* Follows read_noise. */
static void read_sensors(struct fit_file *file, const struct value *value, const char *path) {
    struct fit_request *request = file->request;
    if (!is_named(file, value, path, "{ psi = { offset = rd.free() } }"))
        return;
    for (int i = 0; i < value->field_count; i++) {
        const char *name = value->fields[i].name, *own_path = fields_path_name(&file->check, path, name);
        int column = 0;
        while (column < request->column_count && strcmp(request->columns[column].name, name) != 0)
            column++;
        if (column < request->column_count)
            read_sensor(file, &value->fields[i].value, own_path, &request->columns[column]);
        else
            message_error(file->check.messages, value->fields[i].value.place,
                          "%s: no measured column; add its noise to noise", own_path);
    }
}

static void read_starts(struct fit_file *file, const struct value *value, const char *path) {
    struct fit_request *request = file->request;
    if (!is_listed(file, value, path, "{ \"psi\", \"psi_d\" }"))
        return;
    request->starts = format_allocate((size_t)value->item_count, sizeof *request->starts);
    for (int i = 0; i < value->item_count; i++) {
        const struct value *item = &value->items[i];
        struct fit_asked_value *start = &request->starts[request->start_count];
        *start = (struct fit_asked_value){
            .place = place_text(item), .range = {.is_unknown = true, .lower = -INFINITY, .upper = INFINITY}};
        if (item->kind != VALUE_TEXT) {
            refuse(file, item, fields_path_item(&file->check, path, i), "a name");
            continue;
        }
        start->name = format_text("%s", item->text);
        for (int k = 0; k < request->start_count; k++)
            if (strcmp(request->starts[k].name, start->name) == 0)
                message_error(file->check.messages, item->place, "%s: \"%s\" is given twice; give it once",
                              fields_path_item(&file->check, path, i), start->name);
        request->start_count++;
    }
}

/* The file of an item { "b.csv", weight = 0.5 }, and its weight; NULL after a reported error. */
static const struct value *read_weighted(const struct fit_file *file, const struct value *item,
                                         const char *path, double *weight) {
    static const char *const known[] = {"weight"};
    if (item->kind == VALUE_TEXT)
        return item;
    if (item->kind != VALUE_TABLE || item->tag || item->item_count != 1 ||
        item->items[0].kind != VALUE_TEXT) {
        refuse(file, item, path, "a file such as \"run.csv\" or { \"run.csv\", weight = 0.5 }");
        return NULL;
    }
    for (int i = 0; i < item->field_count; i++) {
        const char *name = item->fields[i].name, *own_path = fields_path_name(&file->check, path, name);
        if (strcmp(name, known[0]) == 0)
            *weight = read_positive(file, &item->fields[i].value, own_path);
        else
            fields_refuse_name(&file->check, item->fields[i].value.place, own_path, "unknown field", name,
                               known, 1);
    }
    return &item->items[0];
}

/* Paths are relative to the folder of FIT.lua. */
static const char *path_beside(const char *file, const char *name) {
    const char *slash = strrchr(file, '/');
    return *name == '/' || !slash ? name : format_text("%.*s%s", (int)(slash + 1 - file), file, name);
}

static void add_data(struct fit_file *file, const struct value *list, const char *path, bool is_held_out) {
    struct fit_request *request = file->request;
    if (!is_listed(file, list, path, data_form))
        return;
    const size_t size = sizeof *request->data, count = (size_t)request->data_count;
    request->data =
        memory_grow(&format_memory, request->data, count * size, (count + (size_t)list->item_count) * size);
    for (int i = 0; i < list->item_count; i++) {
        const char *own_path = fields_path_item(&file->check, path, i);
        double weight = 1;
        const struct value *text = read_weighted(file, &list->items[i], own_path, &weight);
        if (!text)
            continue;
        const char *name = format_text("%s", text->text);
        for (int k = 0; k < request->data_count; k++)
            if (strcmp(request->data[k].name, name) == 0)
                message_error(file->check.messages, text->place, "%s: \"%s\" is given twice; give it once",
                              own_path, name);
        request->data[request->data_count++] =
            (struct fit_asked_data){name, path_beside(request->path, name), weight, is_held_out};
    }
}

static void read_data(struct fit_file *file, const struct value *value, const char *path) {
    add_data(file, value, path, false);
}

static void read_held_out(struct fit_file *file, const struct value *value, const char *path) {
    add_data(file, value, path, true);
}

/* In the order of reading. */
static const struct {
    const char *name;
    read_field *read;
} fit_fields[] = {{"vary", read_vary},     {"noise", read_noise}, {"sensors", read_sensors},
                  {"starts", read_starts}, {"data", read_data},   {"held_out", read_held_out}};
enum { FIELD_COUNT_OF_FIT = sizeof fit_fields / sizeof *fit_fields };

/* ---- The file ---- */

static void check_needed(const struct fit_file *file, const struct value *fit, bool needs_data) {
    const struct {
        const char *name, *form;
        bool is_needed;
    } needed[] = {{"noise", noise_form, true}, {"data", data_form, needs_data}};
    const struct fit_request *request = file->request;
    for (int i = 0; i < 2; i++)
        if (needed[i].is_needed && !value_find_field(fit, needed[i].name))
            message_error(file->check.messages, fit->place, "rd.fit: %s is missing; add %s = %s",
                          needed[i].name, needed[i].name, needed[i].form);
    int used = 0, unknown = request->value_count + request->start_count;
    for (int i = 0; i < request->data_count; i++)
        used += !request->data[i].is_held_out;
    for (int i = 0; i < request->column_count; i++)
        for (int k = 0; k < FIT_SENSOR_COUNT; k++)
            unknown += request->columns[i].sensor[k].is_unknown;
    if (file->check.messages->errors)
        return;
    if (unknown == 0)
        message_error(file->check.messages, fit->place, "rd.fit: no value is to be found; add vary = %s",
                      vary_form);
    if (needs_data && used == 0)
        message_error(file->check.messages, value_find_field(fit, "data")->place,
                      "data: an empty list; must have at least one file, as in %s", data_form);
}

static void read_fit(struct fit_file *file, const struct value *fit, bool needs_data) {
    const char *known[FIELD_COUNT_OF_FIT];
    if (!fields_has_tag(fit, "fit")) {
        message_error(file->check.messages, fit->place, "the file returns %s; must return rd.fit { ... }",
                      value_kind_text(fit->kind));
        return;
    }
    file->request->place = place_text(fit);
    for (int i = 0; i < FIELD_COUNT_OF_FIT; i++) {
        const struct value *value = value_find_field(fit, fit_fields[i].name);
        known[i] = fit_fields[i].name;
        if (value)
            fit_fields[i].read(file, value, fit_fields[i].name);
    }
    for (int i = 0; i < fit->field_count; i++)
        if (text_index(fit->fields[i].name, known, FIELD_COUNT_OF_FIT) < 0)
            fields_refuse_name(&file->check, fit->fields[i].value.place, fit->fields[i].name, "unknown field",
                               fit->fields[i].name, known, FIELD_COUNT_OF_FIT);
    if (fit->item_count > 0)
        message_error(file->check.messages, fit->items[0].place,
                      "rd.fit: an entry without a name; write NAME = value");
    check_needed(file, fit, needs_data);
}

static _Noreturn void out_of_memory(void *context) {
    struct fit_file *file = context;
    longjmp(file->out_of_memory, 1);
}

/* Returns false if the memory does not suffice. */
static bool run_file(struct fit_file *file, bool needs_data) {
    if (setjmp(file->out_of_memory))
        return false;
    const struct read_request request = {.file = file->request->path, .kind = FILE_FIT};
    graph_start(&file->graph, &file->memory);
    const struct script *script = script_open(&file->memory, &file->graph, &request, &file->messages);
    if (script)
        read_fit(file, script_result(script), needs_data);
    message_sort(&file->messages);
    return true;
}

enum status fit_file_read(const struct options *options, struct fit_request *request) {
    struct fit_file *file = format_allocate(1, sizeof *file);
    *file = (struct fit_file){.request = request};
    file->memory =
        (struct memory){.allowance = -1, .bound = bound_of_reading, .fail = out_of_memory, .context = file};
    file->messages.memory = &file->memory;
    file->check =
        (struct checker){.memory = &file->memory, .graph = &file->graph, .messages = &file->messages};
    request->path = options->operands[1];
    const bool has_memory = run_file(file, !options_has(options, "check"));
    for (int i = 0; i < file->messages.count; i++)
        format_complain_line(file->messages.list[i].place.file, file->messages.list[i].place.line,
                             file->messages.list[i].text);
    if (!has_memory)
        format_complain_line(
            request->path, 0,
            format_text("more than %d MB of memory to read the fit", (int)(bound_of_reading >> 20)));
    const bool is_good = has_memory && file->messages.errors == 0;
    memory_release(&file->memory);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}
