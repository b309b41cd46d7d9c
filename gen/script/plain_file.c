/*
 * Reads files in Lua that are no models, such as sweeps, fits and plans, into plain data.
 *
 * In: the path, the kind of file, and the reader of its table. Out: the plain data, in the memory of the
 * file, and messages. A reader of a field reports a value that it cannot use and leaves its target unchanged.
 */
#include <math.h>
#include <string.h>

#include "gen/script/source.h"

/* Bound of the memory of a file. */
static const size_t bound_of_memory = (size_t)256 << 20;

/* ---- The file ---- */

static _Noreturn void out_of_memory(void *context) {
    struct plain_file *file = context;
    longjmp(file->out_of_memory, 1);
}

static bool report_memory(struct plain_file *file) {
    const int megabytes = (int)(file->memory.bound >> 20);
    const bool is_over_bound = file->memory.is_over_bound;
    file->memory.bound = 0;
    if (is_over_bound && !file->messages.are_too_many && !setjmp(file->out_of_memory))
        message_error(&file->messages, (struct place){.file = file->path},
                      "more than %d MB of memory to read the %s", megabytes, script_kind_noun(file->kind));
    return false;
}

bool plain_file_try(struct plain_file *file, bool (*work)(struct plain_file *file, void *context),
                    void *context) {
    file->messages.ends_reading = true;
    const bool is_done = setjmp(file->out_of_memory) ? report_memory(file) : work(file, context);
    file->messages.ends_reading = false;
    return is_done;
}

static bool run(struct plain_file *file, void *context) {
    plain_read *const *read = context;
    const struct read_request request = {.file = file->path, .kind = file->kind};
    const char *tag = script_kind_tag(file->kind);
    graph_start(&file->graph, &file->memory);
    file->script = script_open(&file->memory, &file->graph, &request, &file->messages);
    if (!file->script)
        return false;
    const struct value *result = script_result(file->script);
    if (fields_has_tag(result, tag))
        (*read)(file, result, "", file->data);
    else
        message_error(&file->messages, result->place, "the file returns %s; must return rd.%s { ... }",
                      value_kind_text(result->kind), tag);
    return true;
}

bool plain_file_read(struct plain_file *file, const char *path, enum file_kind kind, plain_read *read,
                     void *data) {
    *file = (struct plain_file){.path = path, .kind = kind, .data = data};
    file->memory =
        (struct memory){.allowance = -1, .bound = bound_of_memory, .fail = out_of_memory, .context = file};
    file->messages.memory = &file->memory;
    file->check =
        (struct checker){.memory = &file->memory, .graph = &file->graph, .messages = &file->messages};
    const bool is_read = plain_file_try(file, run, &read);
    message_sort(&file->messages);
    return is_read && file->messages.errors == 0;
}

/* ---- Messages ---- */

void plain_refuse(const struct plain_file *file, const struct value *value, const char *path,
                  const char *needed) {
    message_error(file->check.messages, value->place, "%s: %s; must be %s", path,
                  fields_made_text(&file->check, value), needed);
}

const char *plain_number_text(const struct plain_file *file, double x) {
    return isfinite(x) ? memory_format(file->check.memory, "%.15g", x) : text_not_finite(x);
}

void plain_refuse_number(const struct plain_file *file, const struct value *value, const char *path,
                         const char *needed) {
    message_error(file->check.messages, value->place, "%s: value %s; must be %s", path,
                  plain_number_text(file, value->number), needed);
}

/* ---- Values of one kind ---- */

bool plain_is_number(const struct plain_file *file, const struct value *value, const char *path) {
    if (value->kind != VALUE_NUMBER)
        plain_refuse(file, value, path, "a number");
    return value->kind == VALUE_NUMBER;
}

void plain_read_positive(const struct plain_file *file, const struct value *value, const char *path,
                         void *target) {
    if (!plain_is_number(file, value, path))
        return;
    if (value->number > 0 && isfinite(value->number))
        *(double *)target = value->number;
    else
        plain_refuse_number(file, value, path, "positive");
}

bool plain_is_whole(const struct plain_file *file, const struct value *value, const char *path, double least,
                    double most, const char *needed) {
    const double x = value->number;
    if (!plain_is_number(file, value, path))
        return false;
    if (x >= least && x <= most && x == floor(x))
        return true;
    plain_refuse_number(file, value, path, needed);
    return false;
}

void plain_read_text(const struct plain_file *file, const struct value *value, const char *path,
                     void *target) {
    if (value->kind != VALUE_TEXT)
        plain_refuse(file, value, path, "a text");
    else if (!*value->text)
        message_error(file->check.messages, value->place, "%s: an empty text; must be a name", path);
    else
        *(const char **)target = value->text;
}

void plain_read_truth(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    if (value->kind != VALUE_BOOLEAN)
        plain_refuse(file, value, path, "true or false");
    else
        *(bool *)target = value->truth;
}

/* ---- Lists, and tables of names ---- */

bool plain_is_list(const struct value *value) {
    return value->kind == VALUE_TABLE && !value->tag && value->field_count == 0;
}

bool plain_needs_list(const struct plain_file *file, const struct value *value, const char *path,
                      const char *form) {
    if (!plain_is_list(value))
        plain_refuse(file, value, path, memory_format(file->check.memory, "a list such as %s", form));
    return plain_is_list(value);
}

bool plain_needs_table(const struct plain_file *file, const struct value *value, const char *path,
                       const char *form) {
    const char *needed = memory_format(file->check.memory, "a table such as %s", form);
    if (value->kind == VALUE_TABLE && !value->tag)
        return field_types_has_no_items(&file->check, value, path, needed);
    plain_refuse(file, value, path, needed);
    return false;
}

bool plain_needs_names(const struct plain_file *file, const struct value *value, const char *path,
                       const char *form) {
    if (!plain_needs_table(file, value, path, form))
        return false;
    if (value->field_count == 0)
        message_error(file->check.messages, value->place, "%s: empty; must have at least one name", path);
    return value->field_count > 0;
}

enum { NAMES_MOST = 10000 };

void plain_read_names(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    struct plain_names *names = target;
    if (value->kind != VALUE_TEXT && !plain_is_list(value)) {
        plain_refuse(file, value, path, "a list of names such as { \"a\", \"b\" }");
        return;
    }
    names->count = fields_get_names(&file->check, value, &names->names);
    if (names->count > NAMES_MOST) {
        message_error(file->check.messages, value->place, "%s: %d names; must be at most %d", path,
                      names->count, NAMES_MOST);
        names->count = 0;
    }
    names->places = memory_get(file->check.memory, ((size_t)names->count + 1) * sizeof *names->places);
    for (int i = 0; i < names->count; i++)
        names->places[i] = value->kind == VALUE_TABLE && names->count == value->item_count
                               ? value->items[i].place
                               : value->place;
    for (int i = 0; value->kind == VALUE_TABLE && i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TEXT && value->items[i].kind != VALUE_NOTHING)
            plain_refuse(file, &value->items[i], fields_path_item(&file->check, path, i), "a name");
    for (int i = 0; i < names->count; i++)
        if (text_index(names->names[i], names->names, names->count) < i)
            message_error(file->check.messages, names->places[i], "%s: \"%s\" is given twice; give it once",
                          path, names->names[i]);
}

void plain_read_joined(const struct plain_file *file, const struct value *value, const char *path,
                       void *target) {
    struct plain_names names = {.count = 0};
    const char *text = "";
    plain_read_names(file, value, path, &names);
    for (int i = 0; i < names.count; i++)
        text = memory_format(file->check.memory, "%s%s%s", text, i ? "," : "", names.names[i]);
    *(const char **)target = text;
}

/* ---- What functions of rd have made ---- */

bool plain_is_made(const struct value *value, const char *tag, int least, int most) {
    bool has_numbers = fields_has_tag(value, tag) && value->item_count >= least &&
                       value->item_count <= most && value->field_count == 0;
    for (int i = 0; has_numbers && i < value->item_count; i++)
        has_numbers = value->items[i].kind == VALUE_NUMBER;
    return has_numbers;
}

static const char *fault_of_range(struct memory *memory, const struct plain_range *range) {
    const double largest = 1e300; /* so that no difference overflows */
    if (!(fabs(range->from) <= largest && fabs(range->to) <= largest &&
          (!range->has_start || isfinite(range->start))))
        return "a number is not finite; numbers must be finite";
    if (!(range->from < range->to))
        return memory_format(memory, "from %.15g to %.15g; the range must ascend", range->from, range->to);
    if (range->has_start && !(range->from <= range->start && range->start <= range->to))
        return memory_format(memory, "start %.15g; must be from %.15g to %.15g", range->start, range->from,
                             range->to);
    return NULL;
}

bool plain_read_range(const struct plain_file *file, const struct value *value, const char *path,
                      const char *needed, struct plain_range *range) {
    if (!plain_is_made(value, "within", 2, 3)) {
        plain_refuse(file, value, path, needed);
        return false;
    }
    range->from = value->items[0].number;
    range->to = value->items[1].number;
    range->has_start = value->item_count == 3;
    range->start = range->has_start ? value->items[2].number : 0;
    const char *fault = fault_of_range(file->check.memory, range);
    if (fault)
        message_error(file->check.messages, value->place, "%s: rd.within: %s", path, fault);
    return !fault;
}

/* ---- Tables with named fields ---- */

void plain_read_fields(const struct plain_file *file, const struct value *table, const char *path,
                       const struct plain_field *fields, int count) {
    const char **known = memory_get(file->check.memory, (size_t)count * sizeof *known);
    for (int i = 0; i < count; i++) {
        const struct value *value = value_find_field(table, fields[i].name);
        known[i] = fields[i].name;
        if (value)
            fields[i].read(file, value, fields_path_name(&file->check, path, known[i]),
                           (char *)file->data + fields[i].target);
    }
    for (int i = 0; i < table->field_count; i++) {
        const char *name = table->fields[i].name;
        if (text_index(name, known, count) < 0)
            fields_refuse_name(&file->check, table->fields[i].value.place,
                               fields_path_name(&file->check, path, name), "unknown field", name, known,
                               count);
    }
    if (table->item_count > 0)
        message_error(file->check.messages, table->items[0].place,
                      "%s: an entry without a name; write NAME = value",
                      *path ? path : memory_format(file->check.memory, "rd.%s", script_kind_tag(file->kind)));
}

void plain_needs_field(const struct plain_file *file, const struct value *table, const char *name,
                       const char *form) {
    if (!value_find_field(table, name))
        message_error(file->check.messages, table->place, "rd.%s: %s is missing; add %s = %s",
                      script_kind_tag(file->kind), name, name, form);
}
