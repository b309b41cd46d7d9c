/* Reads a plan file: from the values of rd.plan to plain data. The file runs in the sandbox of model files.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "runtime/tool/motions/plan/planning.h"

/* Starts of the scan, unless the file sets them. */
static const double starts_default = 100;

static void read_whole(const struct plain_file *file, const struct value *value, const char *path,
                       void *target) {
    if (plain_is_whole(file, value, path, 1, 1e6, "a whole number from 1 to 1000000"))
        *(double *)target = value->number;
}

static bool read_finite(const struct plain_file *file, const struct value *value, const char *path,
                        double *target) {
    if (!plain_is_number(file, value, path))
        return false;
    *target = value->number;
    if (!isfinite(value->number))
        plain_refuse_number(file, value, path, "finite");
    return isfinite(value->number);
}

/* ---- What varies ---- */

static void read_range(const struct plain_file *file, const struct value *value, const char *path,
                       struct plan_value *into) {
    struct plain_range range;
    if (!plain_read_range(file, value, path, "rd.within(from, to)", &range))
        return;
    into->from = range.from;
    into->to = range.to;
    into->start = range.has_start ? range.start : NAN;
}

static void read_vary(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    struct plan_file *plan = target;
    if (!plain_needs_names(file, value, path, "{ T = rd.within(0.5, 2) }"))
        return;
    plan->values = memory_get(file->check.memory, (size_t)value->field_count * sizeof *plan->values);
    plan->value_count = value->field_count;
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        plan->values[i] = (struct plan_value){.name = value->fields[i].name, .place = entry->place};
        read_range(file, entry, fields_path_name(&file->check, path, value->fields[i].name),
                   &plan->values[i]);
    }
}

static void read_cases(const struct plain_file *file, const struct value *value, const char *path,
                       struct plan_varied *into) {
    if (!plain_is_list(value)) {
        plain_refuse(file, value, path, "a list of numbers such as { 1.8, 2.2 }");
        return;
    }
    if (value->item_count == 0)
        message_error(file->check.messages, value->place, "%s: empty; must have at least one number", path);
    into->list = memory_get(file->check.memory, ((size_t)value->item_count + 1) * sizeof *into->list);
    into->count = value->item_count;
    for (int i = 0; i < value->item_count; i++)
        read_finite(file, &value->items[i], fields_path_item(&file->check, path, i), &into->list[i]);
}

static void read_for_all(const struct plain_file *file, const struct value *value, const char *path,
                         void *target) {
    struct plan_file *plan = target;
    if (!plain_needs_names(file, value, path, "{ m = { 1.8, 2.2 } }"))
        return;
    plan->varied = memory_get(file->check.memory, (size_t)value->field_count * sizeof *plan->varied);
    plan->varied_count = value->field_count;
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        plan->varied[i] = (struct plan_varied){.name = value->fields[i].name, .place = entry->place};
        read_cases(file, entry, fields_path_name(&file->check, path, value->fields[i].name),
                   &plan->varied[i]);
    }
}

/* ---- End, objective, limits ---- */

static void read_end(const struct plain_file *file, const struct value *value, const char *path,
                     void *target) {
    struct plan_file *plan = target;
    plan->end_place = value->place;
    if (value->kind == VALUE_TEXT)
        plain_read_text(file, value, path, &plan->end_name);
    else if (value->kind == VALUE_NUMBER)
        plain_read_positive(file, value, path, &plan->t_end);
    else
        plain_refuse(file, value, path, "a number or the name of a parameter");
}

static void read_objective(const struct plain_file *file, const struct value *value, const char *path,
                           void *target) {
    static const char *const tags[] = {[PLAN_PARAMETER] = "",
                                       [PLAN_AT_END] = "at_end",
                                       [PLAN_INTEGRAL] = "integral",
                                       [PLAN_LARGEST] = "largest"};
    struct plan_file *plan = target;
    plan->objective_place = value->place;
    if (value->kind == VALUE_TEXT) {
        plain_read_text(file, value, path, &plan->objective);
        return;
    }
    const int measure = value->kind == VALUE_TABLE && value->tag ? text_index(value->tag, tags, 4) : -1;
    if (measure < 0)
        plain_refuse(file, value, path, "the name of a varied value, rd.at_end, rd.integral or rd.largest");
    else if (value->item_count > 1)
        message_error(file->check.messages, value->place,
                      "%s: rd.at_end: bounds belong to the field within; remove them", path);
    else {
        plan->measure = (enum plan_measure)measure;
        plan->objective = value->items[0].text;
    }
}

/* The bounds { from = , to = } of rd.at_end. */
static void read_bounds(const struct plain_file *file, const struct value *value, const char *path,
                        struct plan_limit *limit) {
    static const char *const names[] = {"from", "to"};
    double *const targets[] = {&limit->from, &limit->to};
    bool is_good = true;
    for (int i = 0; i < value->field_count; i++) {
        const struct value *entry = &value->fields[i].value;
        const char *own = fields_path_name(&file->check, path, value->fields[i].name);
        const int place = text_index(value->fields[i].name, names, 2);
        if (place < 0)
            fields_refuse_name(&file->check, entry->place, own, "unknown field", value->fields[i].name, names,
                               2);
        is_good = place >= 0 && read_finite(file, entry, own, targets[place]) && is_good;
    }
    if (!is_good)
        return;
    if (isinf(limit->from) && isinf(limit->to))
        message_error(file->check.messages, value->place, "%s: no bound; must have from or to", path);
    else if (!(limit->from <= limit->to))
        message_error(file->check.messages, value->place, "%s: from %.15g is above to %.15g; must ascend",
                      path, limit->from, limit->to);
}

static void read_limit(const struct plain_file *file, const struct value *value, const char *path,
                       struct plan_limit *limit) {
    *limit = (struct plan_limit){.place = value->place, .from = -INFINITY, .to = INFINITY};
    if (value->kind == VALUE_TEXT)
        plain_read_text(file, value, path, &limit->name);
    else if (!fields_has_tag(value, "at_end"))
        plain_refuse(file, value, path, "the name of a limit of the model, or rd.at_end");
    else if (value->item_count < 2)
        message_error(file->check.messages, value->place,
                      "%s: rd.at_end: no bounds; add them, as in rd.at_end(\"E_z\", { to = 0.01 })", path);
    else {
        limit->is_at_end = true;
        limit->column = value->items[0].text;
        limit->name = memory_format(file->check.memory, "%s at end", limit->column);
        read_bounds(file, &value->items[1], path, limit);
    }
}

/* The result has one entry of each name, and two equal limits would share their multiplier. */
static void refuse_twins(const struct plain_file *file, const struct plan_file *plan, const char *path) {
    for (int i = 1; i < plan->limit_count; i++)
        for (int k = 0; k < i; k++)
            if (plan->limits[i].name && plan->limits[k].name &&
                strcmp(plan->limits[i].name, plan->limits[k].name) == 0) {
                message_error(file->check.messages, plan->limits[i].place, "%s: \"%s\" is given twice; %s",
                              fields_path_item(&file->check, path, i), plan->limits[i].name,
                              plan->limits[i].is_at_end ? "give from and to together" : "give it once");
                break;
            }
}

static void read_limits(const struct plain_file *file, const struct value *value, const char *path,
                        void *target) {
    struct plan_file *plan = target;
    if (!plain_needs_list(file, value, path, "{ \"arm_torque\", rd.at_end(\"E_z\", { to = 0.01 }) }"))
        return;
    plan->has_limits = true;
    plan->limits = memory_get(file->check.memory, ((size_t)value->item_count + 1) * sizeof *plan->limits);
    plan->limit_count = value->item_count;
    for (int i = 0; i < value->item_count; i++)
        read_limit(file, &value->items[i], fields_path_item(&file->check, path, i), &plan->limits[i]);
    refuse_twins(file, plan, path);
}

static void read_search(const struct plain_file *file, const struct value *value, const char *path,
                        void *target) {
    static const char *const names[] = {"slsqp", "cobyla"};
    const int found = value->kind == VALUE_TEXT ? text_index(value->text, names, 2) : -1;
    if (found < 0)
        plain_refuse(file, value, path, "\"slsqp\" or \"cobyla\"");
    *(bool *)target = found == 1;
}

/* A path is relative to the folder of PLAN.lua. */
static void read_from(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    const char *from = NULL, *slash = strrchr(file->path, '/');
    plain_read_text(file, value, path, &from);
    const bool is_beside = options_state_path(from) && *from != '/' && slash;
    *(const char **)target = is_beside ? memory_format(file->check.memory, "%.*s%s",
                                                       (int)(slash + 1 - file->path), file->path, from)
                                       : from;
}

/* ---- The plan ---- */

#define AT(field) offsetof(struct plan_file, field)

static const struct plain_field plan_fields[] = {
    {"vary", read_vary, 0},
    {"t_end", read_end, 0},
    {"from", read_from, AT(from)},
    {"hold", plain_read_joined, AT(hold)},
    {"method", plain_read_text, AT(method)},
    {"tol", plain_read_positive, AT(tol)},
    {"tol_rates", plain_read_positive, AT(tol_rates)},
    {"minimise", read_objective, 0},
    {"within", read_limits, 0},
    {"for_all", read_for_all, 0},
    {"search", read_search, AT(is_by_cobyla)},
    {"starts", read_whole, AT(starts)},
    {"seed", read_whole, AT(seed)},
};

static void read_plan(const struct plain_file *file, const struct value *value, const char *path,
                      void *target) {
    struct plan_file *plan = target;
    plan->place = value->place;
    plain_read_fields(file, value, path, plan_fields, sizeof plan_fields / sizeof *plan_fields);
    plain_needs_field(file, value, "vary", "{ T = rd.within(0.5, 2) }");
    plain_needs_field(file, value, "t_end", "10, the end of the motion [s], or the name of a parameter");
    plain_needs_field(file, value, "minimise", "\"T\", or a measure of a column such as rd.at_end(\"E_z\")");
}

bool plan_file_read(struct plan_file *file, const char *path) {
    *file = (struct plan_file){.starts = starts_default, .seed = 1};
    const bool is_read = plain_file_read(&file->plain, path, FILE_PLAN, read_plan, file);
    return plan_file_print(file) && is_read;
}

bool plan_file_print(struct plan_file *file) {
    format_complain_messages(&file->plain.messages, file->told);
    file->told = file->plain.messages.count;
    return file->plain.messages.errors == 0;
}

void plan_file_release(struct plan_file *file) {
    memory_release(&file->plain.memory);
}
