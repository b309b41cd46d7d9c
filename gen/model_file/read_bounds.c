/*
 * Reads what the author's function `limits` returns: named values with bounds. A value that is an expression
 * becomes a course, so that it is emitted, recorded and drawn as other courses are; a column of the motion
 * has bounds without one.
 */
#include "gen/model_file/reader.h"

#include <math.h>
#include <string.h>

static double bound_of(const struct value *table, enum field field, double none) {
    const struct value *value = fields_get(table, field);
    return value ? value->number : none;
}

static bool is_taken(const struct model *model, const char *name) {
    for (int i = 0; i < model->course_count; i++)
        if (strcmp(model->courses[i].name, name) == 0)
            return true;
    for (int i = 0; i < model->bound_count; i++)
        if (strcmp(model->bounds[i].name, name) == 0)
            return true;
    return false;
}

/* Reports a limit without bounds, with bounds that cross, with a name that is taken, or without one value. */
static bool is_sound(const struct reader *reader, const struct value *table, const struct bound *bound,
                     const char *path) {
    struct messages *messages = reader->check.messages;
    const bool has_value = fields_has(table, FIELD_BOUND_value),
               has_column = fields_has(table, FIELD_BOUND_column);
    if (isinf(bound->from) && isinf(bound->to))
        message_error(messages, table->place, "%s: has no bound; add from or to", path);
    else if (!(bound->from < bound->to))
        message_error(messages, table->place, "%s: from %.6g to %.6g; the range must ascend", path,
                      bound->from, bound->to);
    else if (has_value == has_column)
        message_error(messages, table->place, "%s: has %s; give one of value and column", path,
                      has_value ? "a value and a column" : "neither a value nor a column");
    else if (is_taken(reader->model, bound->name))
        message_error(messages, table->place,
                      "%s: the name \"%s\" is already taken by a course or a limit; "
                      "choose another name",
                      path, bound->name);
    else
        return true;
    return false;
}

static void read_bound(const struct reader *reader, const struct value *table, const char *path) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    const int errors = check->messages->errors;
    if (table->kind != VALUE_TABLE) {
        message_error(check->messages, table->place,
                      "%s: %s; must be a table such as { \"speed\", s.qd.arm_psi, to = 2 }", path,
                      fields_made_text(check, table));
        return;
    }
    fields_check(check, table, OWNER_BOUND, path);
    if (check->messages->errors > errors)
        return;
    const struct value *column = fields_get(table, FIELD_BOUND_column);
    struct bound bound = {.name = fields_get(table, FIELD_BOUND_name)->text,
                          .from = bound_of(table, FIELD_BOUND_from, -INFINITY),
                          .to = bound_of(table, FIELD_BOUND_to, INFINITY),
                          .is_course = !column,
                          .place = table->place};
    bound.column = column ? column->text : bound.name;
    if (!is_sound(reader, table, &bound, path))
        return;
    if (!column)
        model->courses[model->course_count++] =
            (struct course){.name = bound.name,
                            .value = fields_get_value(check, table, FIELD_BOUND_value),
                            .place = table->place};
    model->bounds[model->bound_count++] = bound;
}

static void add_bound(struct model *model, const char *name, double from, double to, struct place place) {
    if (isfinite(from) || isfinite(to))
        model->bounds[model->bound_count++] =
            (struct bound){.name = name, .column = name, .from = from, .to = to, .place = place};
}

/* A limit of a drive, or of the force on its coordinate, bounds the input that is the drive's force. */
static void add_limits_of_drives(const struct reader *reader) {
    struct model *model = reader->model;
    for (int i = 0; i < model->drive_count; i++) {
        const struct drive *drive = &model->drives[i];
        const struct limits *limits =
            drive->coordinate >= 0 ? reader->tree->frames[drive->coordinate].joint.limits : NULL;
        const double largest = isfinite(drive->limit) ? drive->limit : limits ? limits->force : INFINITY;
        add_bound(model, model->inputs[drive->input].name, -largest, largest, drive->place);
    }
}

/* The limits of links: each is a short form of limits of the coordinate, its rate and its programme force. */
static void add_limits_of_joints(const struct reader *reader) {
    const struct tree *tree = reader->tree;
    for (int i = 0; i < tree->count; i++) {
        const struct joint *joint = &tree->frames[i].joint;
        const char *name = tree->frames[i].name;
        const struct limits *limits = joint->limits;
        if (!limits)
            continue;
        add_bound(reader->model, name, limits->from, limits->to, joint->place);
        add_bound(reader->model, memory_format(reader->check.memory, "%s_d", name), -limits->rate,
                  limits->rate, joint->place);
        add_bound(reader->model, memory_format(reader->check.memory, "force_%s", name), -limits->force,
                  limits->force, joint->place);
    }
}

static void read_list(const struct reader *reader, const struct value *list) {
    static const char needed[] = "a list such as { { \"speed\", s.qd.arm_psi, to = 2 } }, or {} for none";
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    if (!read_is_result(reader, list, "limits", needed) ||
        !field_types_has_no_names(check, list, "limits", needed))
        return;
    struct course *courses = memory_get(
        check->memory, ((size_t)model->course_count + (size_t)list->item_count + 1) * sizeof *courses);
    for (int i = 0; i < model->course_count; i++)
        courses[i] = model->courses[i];
    model->courses = courses;
    for (int i = 0; i < list->item_count; i++)
        read_bound(reader, &list->items[i], fields_path_item(check, "limits", i));
}

void read_bounds(const struct reader *reader, const struct value *list) {
    const size_t most = 3 * (size_t)reader->tree->count + (size_t)reader->model->drive_count +
                        (list ? (size_t)list->item_count : 0);
    reader->model->bounds = memory_get(reader->check.memory, (most + 1) * sizeof *reader->model->bounds);
    add_limits_of_joints(reader);
    add_limits_of_drives(reader);
    if (list)
        read_list(reader, list);
}
