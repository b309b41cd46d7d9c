/*
 * A request in a file: from the table of rd.fit in FIT.lua to `struct fit_request`.
 *
 * The file runs in the sandbox of model files. It is read without the model, so that it may contain any name.
 * Texts are copied into the memory of the program, and the memory of Lua is released.
 */
#include <math.h>
#include <string.h>

#include "gen/gen.h"
#include "gen/script/script.h"
#include "runtime/tool/motions/fit/fit.h"

static const char vary_form[] = "{ m = rd.free() }", noise_form[] = "{ psi = 1e-3 }",
                  data_form[] = "{ \"run.csv\" }", range_form[] = "rd.free() or rd.within(FROM, TO)";

static const char *place_text(const struct value *value) {
    return format_text("%s:%d", value->place.file, value->place.line);
}

static struct fit_range read_range(const struct plain_file *file, const struct value *value, const char *path,
                                   const char *needed) {
    struct fit_range range = {.is_unknown = true, .lower = -INFINITY, .upper = INFINITY};
    struct plain_range bounds;
    if (plain_is_made(value, "free", 0, 0) || !plain_read_range(file, value, path, needed, &bounds))
        return range;
    range.is_bounded = true;
    range.lower = bounds.from;
    range.upper = bounds.to;
    range.has_start = bounds.has_start;
    range.start = bounds.start;
    return range;
}

/* ---- Fields ---- */

static void read_vary(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    struct fit_request *request = target;
    if (!plain_needs_table(file, value, path, vary_form))
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

static void read_noise(const struct plain_file *file, const struct value *value, const char *path,
                       void *target) {
    struct fit_request *request = target;
    if (!plain_needs_table(file, value, path, noise_form))
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
        column->noise = 1;
        plain_read_positive(file, entry, fields_path_name(&file->check, path, name), &column->noise);
        for (int k = 0; k < FIT_SENSOR_COUNT; k++)
            column->sensor[k] = (struct fit_range){.number = fit_sensor_ideal[k]};
    }
}

static struct fit_range read_property(const struct plain_file *file, const struct value *value,
                                      const char *path, enum fit_kind kind) {
    const char *needed =
        kind == FIT_DELAY ? "a number [s] or rd.within(FROM, TO)" : format_text("a number, %s", range_form);
    if (value->kind != VALUE_NUMBER) {
        const struct fit_range range = read_range(file, value, path, needed);
        if (kind == FIT_DELAY && range.is_unknown && fields_has_tag(value, "free"))
            plain_refuse(file, value, path, needed);
        return range;
    }
    if (!isfinite(value->number) || (kind == FIT_GAIN && value->number == 0))
        plain_refuse_number(file, value, path, kind == FIT_GAIN ? "finite and not 0" : "finite");
    return (struct fit_range){.number = value->number};
}

static void read_sensor(const struct plain_file *file, const struct value *value, const char *path,
                        struct fit_asked_column *column) {
    if (!plain_needs_table(file, value, path, "{ offset = rd.free() }"))
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
static void read_sensors(const struct plain_file *file, const struct value *value, const char *path,
                         void *target) {
    struct fit_request *request = target;
    if (!plain_needs_table(file, value, path, "{ psi = { offset = rd.free() } }"))
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

static void add_start(const struct plain_file *file, struct fit_request *request, const struct value *value,
                      const char *path, const char *name, struct fit_range range) {
    for (int k = 0; k < request->start_count; k++)
        if (strcmp(request->starts[k].name, name) == 0)
            message_error(file->check.messages, value->place, "%s: \"%s\" is given twice; give it once", path,
                          name);
    request->starts[request->start_count++] =
        (struct fit_asked_value){format_text("%s", name), place_text(value), range};
}

/* Names alone have no bounds; NAME = rd.within(FROM, TO) has. */
static void read_starts(const struct plain_file *file, const struct value *value, const char *path,
                        void *target) {
    struct fit_request *request = target;
    if (value->kind != VALUE_TABLE || value->tag) {
        plain_refuse(file, value, path, "a table such as { \"psi\", psi_d = rd.within(-1, 1) }");
        return;
    }
    request->starts =
        format_allocate((size_t)(value->item_count + value->field_count), sizeof *request->starts);
    for (int i = 0; i < value->item_count; i++) {
        const struct value *item = &value->items[i];
        const char *own_path = fields_path_item(&file->check, path, i);
        if (item->kind == VALUE_TEXT)
            add_start(file, request, item, own_path, item->text,
                      (struct fit_range){.is_unknown = true, .lower = -INFINITY, .upper = INFINITY});
        else
            plain_refuse(file, item, own_path, "a name");
    }
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        const char *name = value->fields[i].name, *own_path = fields_path_name(&file->check, path, name);
        add_start(file, request, entry, own_path, name, read_range(file, entry, own_path, range_form));
    }
}

/* The file of an item { "b.csv", weight = 0.5 }, and its weight; NULL after a reported error. */
static const struct value *read_weighted(const struct plain_file *file, const struct value *item,
                                         const char *path, double *weight) {
    static const char *const known[] = {"weight"};
    if (item->kind == VALUE_TEXT)
        return item;
    if (item->kind != VALUE_TABLE || item->tag || item->item_count != 1 ||
        item->items[0].kind != VALUE_TEXT) {
        plain_refuse(file, item, path, "a file such as \"run.csv\" or { \"run.csv\", weight = 0.5 }");
        return NULL;
    }
    for (int i = 0; i < item->field_count; i++) {
        const char *name = item->fields[i].name, *own_path = fields_path_name(&file->check, path, name);
        if (strcmp(name, known[0]) == 0)
            plain_read_positive(file, &item->fields[i].value, own_path, weight);
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

static void add_data(const struct plain_file *file, struct fit_request *request, const struct value *list,
                     const char *path, bool is_held_out) {
    if (!plain_needs_list(file, list, path, data_form))
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

static void read_data(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    add_data(file, target, value, path, false);
}

static void read_held_out(const struct plain_file *file, const struct value *value, const char *path,
                          void *target) {
    add_data(file, target, value, path, true);
}

/* In the order of reading. */
static const struct plain_field fit_fields[] = {{"vary", read_vary, 0},       {"noise", read_noise, 0},
                                                {"sensors", read_sensors, 0}, {"starts", read_starts, 0},
                                                {"data", read_data, 0},       {"held_out", read_held_out, 0}};

/* ---- The file ---- */

static void check_needed(const struct plain_file *file, const struct fit_request *request,
                         const struct value *fit) {
    plain_needs_field(file, fit, "noise", noise_form);
    if (request->needs_data)
        plain_needs_field(file, fit, "data", data_form);
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
    if (request->needs_data && used == 0)
        message_error(file->check.messages, value_find_field(fit, "data")->place,
                      "data: an empty list; must have at least one file, as in %s", data_form);
}

static void read_fit(const struct plain_file *file, const struct value *value, const char *path,
                     void *target) {
    struct fit_request *request = target;
    request->place = place_text(value);
    plain_read_fields(file, value, path, fit_fields, sizeof fit_fields / sizeof *fit_fields);
    check_needed(file, request, value);
}

enum status fit_file_read(const struct options *options, struct fit_request *request) {
    struct plain_file *file = format_allocate(1, sizeof *file);
    request->path = options->operands[1];
    request->needs_data = !options_has(options, "check");
    const bool is_good =
        plain_file_read(file, request->path, FILE_FIT, read_fit, request, format_out_of_memory);
    format_complain_messages(&file->messages, 0);
    memory_release(&file->memory);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}
