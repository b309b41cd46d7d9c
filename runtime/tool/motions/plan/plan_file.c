/* Reads a plan file: from the values of rd.plan to plain data. The file runs in the sandbox of model files.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"

/* Largest memory for reading. */
static const size_t bound_of_reading = (size_t)256 << 20;
/* Starts of the scan, unless the file sets them. */
static const double starts_default = 100;

struct reading {
    struct plan_file *file;
    struct checker check;
};

static void refuse(const struct reading *reading, const struct value *value, const char *path,
                   const char *needed) {
    message_error(reading->check.messages, value->place, "%s: %s; must be %s", path,
                  fields_made_text(&reading->check, value), needed);
}

static void refuse_number(const struct reading *reading, const struct value *value, const char *path,
                          const char *needed) {
    message_error(reading->check.messages, value->place, "%s: value %s; must be %s", path,
                  isfinite(value->number) ? memory_format(reading->check.memory, "%.15g", value->number)
                                          : text_not_finite(value->number),
                  needed);
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

static void read_whole(const struct reading *reading, const struct value *value, const char *path,
                       void *target) {
    const double most = 1e6;
    if (value->kind != VALUE_NUMBER)
        refuse(reading, value, path, "a number");
    else if (!(value->number >= 1 && value->number <= most && value->number == floor(value->number)))
        refuse_number(reading, value, path, "a whole number from 1 to 1000000");
    else
        *(double *)target = value->number;
}

static void read_text(const struct reading *reading, const struct value *value, const char *path,
                      void *target) {
    if (value->kind != VALUE_TEXT)
        refuse(reading, value, path, "a text");
    else if (!*value->text)
        message_error(reading->check.messages, value->place, "%s: an empty text; must be a name", path);
    else
        *(const char **)target = value->text;
}

static bool is_list(const struct value *value) {
    return value->kind == VALUE_TABLE && !value->tag && value->field_count == 0;
}

/* Names separated by commas, as on the command line. */
static void read_names(const struct reading *reading, const struct value *value, const char *path,
                       void *target) {
    const char **names, *text = "";
    if (value->kind != VALUE_TEXT && !is_list(value)) {
        refuse(reading, value, path, "a list of names such as { \"a\", \"b\" }");
        return;
    }
    const int count = fields_get_names(&reading->check, value, &names);
    for (int i = 0; i < count; i++)
        text = memory_format(reading->check.memory, "%s%s%s", text, i ? "," : "", names[i]);
    *(const char **)target = text;
}

/* ---- What varies ---- */

static bool is_table_of_names(const struct reading *reading, const struct value *value, const char *path,
                              const char *form) {
    if (value->kind != VALUE_TABLE || value->tag) {
        refuse(reading, value, path, form);
        return false;
    }
    if (!field_types_has_no_items(&reading->check, value, path, form))
        return false;
    if (value->field_count == 0)
        message_error(reading->check.messages, value->place, "%s: empty; must have at least one name", path);
    return value->field_count > 0;
}

static void read_range(const struct reading *reading, const struct value *value, const char *path,
                       struct plan_value *into) {
    if (!fields_has_tag(value, "within")) {
        refuse(reading, value, path, "rd.within(from, to)");
        return;
    }
    into->from = value->items[0].number;
    into->to = value->items[1].number;
    into->start = value->item_count > 2 ? value->items[2].number : NAN;
    if (!isfinite(into->from) || !isfinite(into->to) || !(into->from < into->to))
        message_error(reading->check.messages, value->place,
                      "%s: rd.within(%.15g, %.15g): the range must ascend", path, into->from, into->to);
    else if (value->item_count > 2 && !(into->start >= into->from && into->start <= into->to))
        message_error(reading->check.messages, value->place,
                      "%s: rd.within(%.15g, %.15g, %.15g): the start must be within the range", path,
                      into->from, into->to, into->start);
}

static void read_vary(const struct reading *reading, const struct value *value, const char *path,
                      void *target) {
    struct plan_file *file = reading->file;
    (void)target;
    if (!is_table_of_names(reading, value, path, "a table such as { T = rd.within(0.5, 2) }"))
        return;
    file->values = memory_get(reading->check.memory, (size_t)value->field_count * sizeof *file->values);
    file->value_count = value->field_count;
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        file->values[i] = (struct plan_value){.name = value->fields[i].name, .place = entry->place};
        read_range(reading, entry, fields_path_name(&reading->check, path, value->fields[i].name),
                   &file->values[i]);
    }
}

static void read_cases(const struct reading *reading, const struct value *value, const char *path,
                       struct plan_varied *into) {
    if (!is_list(value) || value->item_count == 0) {
        refuse(reading, value, path, "a list of numbers such as { 1.8, 2.2 }");
        return;
    }
    into->list = memory_get(reading->check.memory, (size_t)value->item_count * sizeof *into->list);
    into->count = value->item_count;
    for (int i = 0; i < value->item_count; i++) {
        const struct value *item = &value->items[i];
        into->list[i] = item->number;
        if (item->kind != VALUE_NUMBER)
            refuse(reading, item, fields_path_item(&reading->check, path, i), "a number");
    }
}

static void read_for_all(const struct reading *reading, const struct value *value, const char *path,
                         void *target) {
    struct plan_file *file = reading->file;
    (void)target;
    if (!is_table_of_names(reading, value, path, "a table such as { m = { 1.8, 2.2 } }"))
        return;
    file->varied = memory_get(reading->check.memory, (size_t)value->field_count * sizeof *file->varied);
    file->varied_count = value->field_count;
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        file->varied[i] = (struct plan_varied){.name = value->fields[i].name, .place = entry->place};
        read_cases(reading, entry, fields_path_name(&reading->check, path, value->fields[i].name),
                   &file->varied[i]);
    }
}

/* ---- End, objective, limits ---- */

static void read_end(const struct reading *reading, const struct value *value, const char *path,
                     void *target) {
    struct plan_file *file = reading->file;
    (void)target;
    file->end_place = value->place;
    if (value->kind == VALUE_TEXT)
        read_text(reading, value, path, &file->end_name);
    else if (value->kind == VALUE_NUMBER)
        read_positive(reading, value, path, &file->t_end);
    else
        refuse(reading, value, path, "a number or the name of a parameter");
}

static void read_objective(const struct reading *reading, const struct value *value, const char *path,
                           void *target) {
    static const char *const tags[] = {[PLAN_PARAMETER] = "",
                                       [PLAN_AT_END] = "at_end",
                                       [PLAN_INTEGRAL] = "integral",
                                       [PLAN_LARGEST] = "largest"};
    struct plan_file *file = reading->file;
    (void)target;
    file->objective_place = value->place;
    if (value->kind == VALUE_TEXT) {
        read_text(reading, value, path, &file->objective);
        return;
    }
    const int measure = value->kind == VALUE_TABLE && value->tag ? text_index(value->tag, tags, 4) : -1;
    if (measure < 0)
        refuse(reading, value, path, "the name of a varied value, rd.at_end, rd.integral or rd.largest");
    else if (value->item_count > 1)
        message_error(reading->check.messages, value->place,
                      "%s: rd.at_end: bounds belong to the field within; remove them", path);
    else {
        file->measure = (enum plan_measure)measure;
        file->objective = value->items[0].text;
    }
}

/* The bounds { from = , to = } of rd.at_end. */
static void read_bounds(const struct reading *reading, const struct value *value, const char *path,
                        struct plan_limit *limit) {
    static const char *const names[] = {"from", "to"};
    double *const targets[] = {&limit->from, &limit->to};
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        const char *own = fields_path_name(&reading->check, path, value->fields[i].name);
        const int place = text_index(value->fields[i].name, names, 2);
        if (place < 0)
            fields_refuse_name(&reading->check, entry->place, own, "unknown field", value->fields[i].name,
                               names, 2);
        else if (entry->kind != VALUE_NUMBER)
            refuse(reading, entry, own, "a number");
        else
            *targets[place] = entry->number;
    }
    if (isinf(limit->from) && isinf(limit->to))
        message_error(reading->check.messages, value->place, "%s: no bound; must have from or to", path);
    else if (!(limit->from <= limit->to))
        message_error(reading->check.messages, value->place, "%s: from %.15g is above to %.15g; must ascend",
                      path, limit->from, limit->to);
}

static void read_limit(const struct reading *reading, const struct value *value, const char *path,
                       struct plan_limit *limit) {
    *limit = (struct plan_limit){.place = value->place, .from = -INFINITY, .to = INFINITY};
    if (value->kind == VALUE_TEXT)
        read_text(reading, value, path, &limit->name);
    else if (!fields_has_tag(value, "at_end"))
        refuse(reading, value, path, "the name of a limit of the model, or rd.at_end");
    else if (value->item_count < 2)
        message_error(reading->check.messages, value->place,
                      "%s: rd.at_end: no bounds; add them, as in rd.at_end(\"E_z\", { to = 0.01 })", path);
    else {
        limit->is_at_end = true;
        limit->column = value->items[0].text;
        limit->name = memory_format(reading->check.memory, "%s at end", limit->column);
        read_bounds(reading, &value->items[1], path, limit);
    }
}

static void read_limits(const struct reading *reading, const struct value *value, const char *path,
                        void *target) {
    struct plan_file *file = reading->file;
    (void)target;
    if (!is_list(value)) {
        refuse(reading, value, path, "a list such as { \"arm_torque\", rd.at_end(\"E_z\", { to = 0.01 }) }");
        return;
    }
    file->has_limits = true;
    file->limits = memory_get(reading->check.memory, ((size_t)value->item_count + 1) * sizeof *file->limits);
    file->limit_count = value->item_count;
    for (int i = 0; i < value->item_count; i++)
        read_limit(reading, &value->items[i], fields_path_item(&reading->check, path, i), &file->limits[i]);
}

static void read_search(const struct reading *reading, const struct value *value, const char *path,
                        void *target) {
    static const char *const names[] = {"slsqp", "cobyla"};
    const int found = value->kind == VALUE_TEXT ? text_index(value->text, names, 2) : -1;
    if (found < 0)
        refuse(reading, value, path, "\"slsqp\" or \"cobyla\"");
    *(bool *)target = found == 1;
}

/* ---- The plan ---- */

#define AT(field) offsetof(struct plan_file, field)

static const struct field_reader {
    const char *name;
    read_field *read;
    size_t target;
} plan_fields[] = {
    {"vary", read_vary, 0},
    {"t_end", read_end, 0},
    {"from", read_text, AT(from)},
    {"hold", read_names, AT(hold)},
    {"method", read_text, AT(method)},
    {"tol", read_positive, AT(tol)},
    {"minimise", read_objective, 0},
    {"within", read_limits, 0},
    {"for_all", read_for_all, 0},
    {"search", read_search, AT(is_by_cobyla)},
    {"starts", read_whole, AT(starts)},
    {"seed", read_whole, AT(seed)},
};

enum { FIELDS = sizeof plan_fields / sizeof *plan_fields };

static void check_needed(const struct reading *reading, const struct value *plan) {
    static const struct {
        const char *name, *form;
    } needed[] = {{"vary", "{ T = rd.within(0.5, 2) }"},
                  {"t_end", "10, the end of the motion [s], or the name of a parameter"},
                  {"minimise", "\"T\", or a measure of a column such as rd.at_end(\"E_z\")"}};
    for (int i = 0; i < 3; i++)
        if (!value_find_field(plan, needed[i].name))
            message_error(reading->check.messages, plan->place, "rd.plan: %s is missing; add %s = %s",
                          needed[i].name, needed[i].name, needed[i].form);
}

static void read_plan(const struct reading *reading, const struct value *plan) {
    struct plan_file *file = reading->file;
    const char *known[FIELDS];
    file->place = plan->place;
    if (!fields_has_tag(plan, "plan")) {
        message_error(reading->check.messages, plan->place,
                      "the file returns %s; must return rd.plan { ... }", value_kind_text(plan->kind));
        return;
    }
    for (int i = 0; i < FIELDS; i++)
        known[i] = plan_fields[i].name;
    for (int i = 0; i < plan->field_count; i++) {
        const char *name = plan->fields[i].name;
        const struct value *value = &plan->fields[i].value;
        const int field = text_index(name, known, FIELDS);
        if (field < 0)
            fields_refuse_name(&reading->check, value->place, name, "unknown field", name, known, FIELDS);
        else
            plan_fields[field].read(reading, value, name, (char *)file + plan_fields[field].target);
    }
    if (plan->item_count > 0)
        message_error(reading->check.messages, plan->items[0].place,
                      "rd.plan: an entry without a name; write NAME = value");
    check_needed(reading, plan);
}

static _Noreturn void out_of_memory(void *context) {
    struct plan_file *file = context;
    longjmp(file->out_of_memory, 1);
}

bool plan_file_read(struct plan_file *file, const char *path) {
    memset(file, 0, sizeof *file);
    file->memory =
        (struct memory){.allowance = -1, .bound = bound_of_reading, .fail = out_of_memory, .context = file};
    file->messages.memory = &file->memory;
    file->starts = starts_default;
    file->seed = 1;
    if (setjmp(file->out_of_memory)) {
        file->memory.bound = 0;
        if (!file->messages.errors)
            format_complain_line(
                path, 0,
                format_text("more than %d MB of memory to read the plan", (int)(bound_of_reading >> 20)));
        plan_file_print(file);
        return false;
    }
    graph_start(&file->graph, &file->memory);
    const struct read_request request = {.file = path, .kind = FILE_PLAN};
    file->script = script_open(&file->memory, &file->graph, &request, &file->messages);
    const struct reading reading = {
        .file = file, .check = {.memory = &file->memory, .graph = &file->graph, .messages = &file->messages}};
    if (file->script)
        read_plan(&reading, script_result(file->script));
    return plan_file_print(file);
}

bool plan_file_print(struct plan_file *file) {
    const struct messages *messages = &file->messages;
    if (file->told == 0)
        message_sort(&file->messages);
    for (; file->told < messages->count; file->told++) {
        const struct message *message = &messages->list[file->told];
        format_complain_line(message->place.file, message->place.line, message->text);
    }
    return messages->errors == 0;
}

void plan_file_release(struct plan_file *file) {
    memory_release(&file->memory);
}
