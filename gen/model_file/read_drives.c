/*
 * Reads the list `drives` of a model: coordinates, or lines between two places, on which drives act. Each
 * drive adds an input `drive_NAME` and a generalized force of this size. Programme rows need ideal forces;
 * where drives realise the programme instead, this file also takes these rows out of the model.
 */
#include "gen/model_file/reader.h"

#include <math.h>
#include <string.h>

/* Returns whether the drive's name can be used; reports it otherwise. */
static bool is_new(const struct reader *reader, const struct drive *drive, const char *path) {
    for (int i = 0; i < reader->model->drive_count; i++)
        if (strcmp(reader->model->drives[i].name, drive->name) == 0) {
            message_error(reader->check.messages, drive->place, "%s: \"%s\" is given twice; give it once",
                          path, drive->name);
            return false;
        }
    return true;
}

static void add_force(const struct reader *reader, int coordinate, expression value, struct place place) {
    struct model *model = reader->model;
    struct force *forces =
        memory_get(reader->check.memory, ((size_t)model->force_count + 1) * sizeof *forces);
    for (int i = 0; i < model->force_count; i++)
        forces[i] = model->forces[i];
    forces[model->force_count++] = (struct force){.coordinate = coordinate, .value = value, .place = place};
    model->forces = forces;
}

/* `value` is the name of a coordinate, or a table of the drive. */
static void read_one(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    const bool is_table = value->kind == VALUE_TABLE;
    const struct value *name = is_table ? fields_get(value, FIELD_EFFORT_name) : value;
    const struct value *limit = is_table ? fields_get(value, FIELD_EFFORT_limit) : NULL;
    const bool is_line = is_table && fields_has(value, FIELD_EFFORT_from);
    if (!name || name->kind != VALUE_TEXT || is_empty_text(name))
        return;
    struct drive drive = {.name = name->text,
                          .coordinate = is_line ? -1 : tree_find_coordinate(reader->tree, name->text),
                          .limit = limit ? limit->number : INFINITY,
                          .place = value->place};
    if (!is_line && drive.coordinate < 0) {
        read_refuse_coordinate(reader, drive.place, path,
                               memory_format(check->memory, "unknown coordinate \"%s\"", name->text),
                               name->text);
        return;
    }
    if (!is_new(reader, &drive, path))
        return;
    const bool is_torque = !is_line && reader->tree->frames[drive.coordinate].joint.is_revolute;
    const expression force = declarations_add_input(check->declarations, drive.place,
                                                    memory_format(check->memory, "drive_%s", drive.name), 0,
                                                    is_torque ? "N m" : "N");
    drive.input = check->declarations->input_count - 1;
    if (!is_line)
        add_force(reader, drive.coordinate, force, drive.place);
    else if (!read_push(reader, value, FIELD_EFFORT_from, FIELD_EFFORT_to, force, path))
        return;
    reader->model->drives[reader->model->drive_count++] = drive;
}

void read_drives(const struct reader *reader, const struct value *list) {
    struct model *model = reader->model;
    const int errors = reader->check.messages->errors;
    model->drives = memory_get(reader->check.memory, ((size_t)list->item_count + 1) * sizeof *model->drives);
    for (int i = 0; i < list->item_count && reader->check.messages->errors == errors; i++)
        read_one(reader, &list->items[i], fields_path_item(&reader->check, "drives", i));
    model->inputs = reader->check.declarations->inputs;
    model->input_count = reader->check.declarations->input_count;
}

/* ---- the programme while drives realise it ---- */

static void refuse_locked(const struct reader *reader) {
    const struct model *model = reader->model;
    for (int i = 0; i < model->drive_count; i++)
        for (int j = 0; j < model->row_count; j++)
            if (model->drives[i].coordinate >= 0 && !model->rows[j].is_programme &&
                model->rows[j].driven == model->drives[i].coordinate + 1)
                message_error(reader->check.messages, model->drives[i].place,
                              "drives[%d]: %s is locked (rd.lock), so that a drive has no effect on it; "
                              "remove one of them",
                              i + 1, model->drives[i].name);
}

static void release(struct model *model) {
    int kept = 0;
    for (int i = 0; i < model->row_count; i++)
        if (!model->rows[i].is_programme)
            model->rows[kept++] = model->rows[i];
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact >= 0)
            model->events[i].contact -= model->row_count - kept;
    model->row_count = kept;
    model->dependent_count = 0; /* those that the author names belong to all rows */
}

/* max(t, 0) takes the place of t. */
static void rest_before_start(const struct reader *reader) {
    struct graph *g = reader->check.graph;
    const expression t = expr_symbol(g, SYMBOL_TIME, 0, 0), late = expr_apply2(g, OP_MAX, t, EXPR_ZERO);
    for (int i = 0; i < reader->model->row_count; i++) {
        struct row *row = &reader->model->rows[i];
        if (row->is_programme)
            row->residual = rewrite_replace(g, row->residual, t, late);
    }
}

void read_drives_end(const struct reader *reader) {
    refuse_locked(reader);
    if (reader->check.declarations->request->programme == PROGRAMME_FREE)
        release(reader->model);
    else if (reader->check.declarations->request->programme == PROGRAMME_RESTS)
        rest_before_start(reader);
}
