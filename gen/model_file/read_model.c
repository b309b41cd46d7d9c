/*
 * From the values of a model file to the model: read_scene reads names, links and points, read_programme
 * calls the author's functions for forces, courses, rows and events.
 *
 * The table of fields (fields.def) checks single fields. This file checks what concerns several of them.
 */
#include "gen/model_file/reader.h"

#include <string.h>

static struct reader reader_of(struct script *script, struct model *model) {
    struct declarations *declarations = script_declarations(script);
    return (struct reader){.check = {.memory = declarations->memory,
                                     .graph = declarations->graph,
                                     .messages = script_messages(script),
                                     .declarations = declarations},
                           .model = model};
}

static void copy_declarations(const struct reader *reader) {
    const struct declarations *declarations = reader->check.declarations;
    struct model *model = reader->model;
    model->options = declarations->options;
    model->option_count = declarations->option_count;
    model->parameters = declarations->parameters;
    model->parameter_count = declarations->parameter_count;
    model->inputs = declarations->inputs;
    model->input_count = declarations->input_count;
    model->requirements = declarations->requirements;
    model->requirement_count = declarations->requirement_count;
}

/* ---- links ---- */

/* A link as read, in the order of the file. */
struct entry {
    struct link link;
    const struct value *value;
    const char *path;
    int parent;   /* entry that carries it, -1: the ground */
    int position; /* in the model's order, -1 if not yet placed */
};

static void check_inertias(const struct reader *reader, const struct link *link) {
    const char *path = memory_format(reader->check.memory, "link %s", link->name);
    for (int i = 0; i < link->solid_count; i++) {
        const int errors = reader->check.messages->errors;
        read_require(reader, requirement_moments(link->solids[i].inertia), path, link->place);
        if (reader->check.messages->errors == errors)
            read_require(reader, requirement_products(link->solids[i].inertia), path, link->place);
    }
}

static void read_link(const struct reader *reader, const struct value *value, struct entry *entry) {
    const struct checker *check = &reader->check;
    const struct value *name = fields_get(value, FIELD_LINK_name), *beam = fields_get(value, FIELD_LINK_beam);
    struct link *link = &entry->link;
    const int errors = check->messages->errors;
    entry->value = value;
    fields_check(check, value, OWNER_LINK, entry->path);
    link->name = name ? name->text : "";
    link->place = value->place;
    read_joints(reader, value, entry->path, link);
    read_solids(reader, value, entry->path, link);
    if (beam)
        read_beam(reader, beam, fields_path_name(check, entry->path, "beam"), &link->beam);
    link->is_wrong = check->messages->errors > errors;
    if (!link->is_wrong)
        check_inertias(reader, link);
}

/* Finds the carrier of each link. For look-ups of places, the model has the links in the file's order
 * meanwhile. */
static void find_parents(const struct reader *reader, struct entry *entries, int count) {
    struct model *model = reader->model;
    for (int i = 0; i < count; i++)
        model->links[model->link_count++] = entries[i].link;
    for (int i = 0; i < count; i++) {
        struct attachment *on = &entries[i].link.on;
        read_carrier(reader, entries[i].value, entries[i].path, on);
        entries[i].parent = on->link;
        entries[i].position = -1;
    }
    model->link_count = 0;
}

/* Every unplaced entry has an unplaced parent. Reports one cycle among them and puts it on the ground. */
static void break_cycle(const struct reader *reader, struct entry *entries, int count) {
    int at = 0;
    while (entries[at].position >= 0)
        at++;
    for (int i = 0; i < count; i++) /* after at most `count` steps, `at` is in the cycle */
        at = entries[at].parent;
    int first = at;
    for (int i = entries[at].parent; i != at; i = entries[i].parent)
        first = i < first ? i : first;
    const char *text = memory_format(reader->check.memory, "\"%s\"", entries[first].link.name);
    for (int i = entries[first].parent;; i = entries[i].parent) {
        text = memory_format(reader->check.memory, "%s on \"%s\"", text, entries[i].link.name);
        if (i == first)
            break;
    }
    message_error(reader->check.messages, entries[first].link.place,
                  "%s: %s is a cycle; put one of these links on another link or on the ground",
                  entries[first].path, text);
    entries[first].parent = -1;
}

/* Parents first, otherwise as in the file. */
static void order_links(const struct reader *reader, struct entry *entries, int count) {
    struct model *model = reader->model;
    while (model->link_count < count) {
        int i = 0;
        while (i < count && (entries[i].position >= 0 ||
                             (entries[i].parent >= 0 && entries[entries[i].parent].position < 0)))
            i++;
        if (i == count) {
            break_cycle(reader, entries, count);
            continue;
        }
        entries[i].position = model->link_count;
        entries[i].link.on.link = entries[i].parent < 0 ? -1 : entries[entries[i].parent].position;
        model->links[model->link_count++] = entries[i].link;
    }
}

static void read_links(struct reader *reader, const struct value *list) {
    struct entry *entries = NULL;
    int count = 0;
    reader->lacks_links = !list || list->field_count > 0;
    if (!list)
        return;
    if (list->item_count == 0 && list->field_count == 0)
        message_error(reader->check.messages, list->place, "links: empty; a model needs at least one link");
    entries = memory_get(reader->check.memory, ((size_t)list->item_count + 1) * sizeof *entries);
    for (int i = 0; i < list->item_count; i++) {
        struct entry *entry = &entries[count];
        if (list->items[i].kind == VALUE_TABLE) {
            entry->path = fields_path_item(&reader->check, "links", i);
            read_link(reader, &list->items[i], entry);
            count++;
        }
        reader->lacks_links = reader->lacks_links || !entry->link.name || !*entry->link.name;
    }
    reader->model->links = memory_get(reader->check.memory, ((size_t)count + 1) * sizeof(struct link));
    find_parents(reader, entries, count);
    order_links(reader, entries, count);
}

/* ---- points and names ---- */

static void read_point(const struct reader *reader, const struct value_field *named, struct point *point) {
    const struct value *value = &named->value;
    *point = (struct point){.name = named->name, .place = value->place, .at = markers_ground_attachment()};
    const struct value *angular = value->kind == VALUE_TABLE ? fields_get(value, FIELD_POINT_angular) : NULL;
    point->is_angular = angular && angular->truth;
    if (value->kind == VALUE_TABLE || value->kind == VALUE_TEXT)
        read_place(reader, value, fields_path_name(&reader->check, "points", named->name), false, &point->at);
}

static void read_points(const struct reader *reader, const struct value *table) {
    struct model *model = reader->model;
    if (!table)
        return;
    model->points = memory_get(reader->check.memory, (size_t)table->field_count * sizeof *model->points);
    model->point_count = model->marker_count = model->marker_capacity = table->field_count;
    for (int i = 0; i < table->field_count; i++)
        read_point(reader, &table->fields[i], &model->points[i]);
}

/* [m] translation that tolerances equate with a turn of 1 rad, if the file has no field `length`. */
static const double length_default = 1;

static void read_length(const struct reader *reader, const struct value *length) {
    reader->model->length = length ? length->number : length_default;
}

static void read_form(const struct reader *reader, const struct value *form) {
    if (!form)
        return;
    reader->model->printed_form = strcmp(form->text, "printed") == 0;
    if (!reader->model->printed_form && strcmp(form->text, "corrected") != 0)
        message_error(reader->check.messages, form->place,
                      "form: \"%s\"; must be \"corrected\" or \"printed\"", form->text);
}

static void read_names(const struct reader *reader, const struct value *root) {
    struct model *model = reader->model;
    const struct value *name = fields_get(root, FIELD_MODEL_name);
    const struct value *dependent = fields_get(root, FIELD_MODEL_dependent);
    const struct value *hold = fields_get(root, FIELD_MODEL_hold);
    const char *requested = reader->check.declarations->request->name;
    model->is_renamed = requested != NULL;
    if (requested)
        model->name = requested;
    else if (name)
        model->name = name->text;
    model->dependent_count = fields_get_names(&reader->check, dependent, &model->dependent);
    model->dependent_place = dependent ? dependent->place : root->place;
    model->hold_count = fields_get_names(&reader->check, hold, &model->hold);
    model->hold_place = hold ? hold->place : root->place;
}

void read_scene(struct script *script, struct model *model) {
    struct reader reader = reader_of(script, model);
    const struct value *root = script_result(script);
    *model = (struct model){.name = "",
                            .file = reader.check.declarations->request->file,
                            .place = root->place,
                            .graph = reader.check.graph,
                            .fold = reader.check.declarations->request->fold,
                            .accelerations = reader.check.declarations->request->accelerations,
                            .loops = reader.check.declarations->request->loops};
    copy_declarations(&reader);
    if (root->kind != VALUE_TABLE || !root->tag || strcmp(root->tag, "model") != 0) {
        message_error(reader.check.messages, root->place, "the file returns %s; must return rd.model { ... }",
                      fields_made_text(&reader.check, root));
        return;
    }
    fields_check(&reader.check, root, OWNER_MODEL, "");
    read_names(&reader, root);
    read_form(&reader, fields_get(root, FIELD_MODEL_form));
    read_length(&reader, fields_get(root, FIELD_MODEL_length));
    fields_get_vector(&reader.check, root, FIELD_MODEL_gravity, model->gravity);
    read_links(&reader, fields_get(root, FIELD_MODEL_links));
    read_points(&reader, fields_get(root, FIELD_MODEL_points));
}

/* ---- forces and rows ---- */

/* States come first, because all other functions may read them. */
static void declare_states(struct script *script, const struct reader *reader, struct tree *tree,
                           const struct value *states) {
    struct value result;
    script_declare_states(script, true);
    if (script_call(script, states, "states", &result))
        read_states(reader, &result);
    script_declare_states(script, false);
    tree_add_states(reader->check.memory, reader->model, tree);
}

void read_programme(struct script *script, struct tree *tree, struct model *model) {
    struct reader reader = reader_of(script, model);
    const struct value *root = script_result(script);
    const struct value *states = fields_get(root, FIELD_MODEL_states);
    const struct value *forces = fields_get(root, FIELD_MODEL_forces);
    const struct value *constraints = fields_get(root, FIELD_MODEL_constraints);
    const struct value *courses = fields_get(root, FIELD_MODEL_courses);
    const struct value *limits = fields_get(root, FIELD_MODEL_limits);
    const struct value *events = fields_get(root, FIELD_MODEL_events);
    const struct value *drives = fields_get(root, FIELD_MODEL_drives);
    struct value result;
    reader.tree = tree;
    const char *const *coordinates = tree_coordinate_names(reader.check.memory, tree);
    const int joints = tree->count;
    script_set_names(script, model, coordinates, joints);
    if (states)
        declare_states(script, &reader, tree, states);
    if (forces && script_call(script, forces, "forces", &result))
        read_forces(&reader, &result);
    if (drives)
        read_drives(&reader, drives);
    if (reader.check.declarations->request->has_pulls)
        read_pulls(&reader);
    read_rates_of_states(&reader);
    if (courses && script_call(script, courses, "courses", &result))
        read_courses(&reader, &result);
    read_bounds(&reader, limits && script_call(script, limits, "limits", &result) ? &result : NULL);
    if (constraints && script_call(script, constraints, "constraints", &result))
        read_constraints(&reader, &result);
    read_drives_end(&reader);
    if (events && script_call(script, events, "events", &result))
        read_events(&reader, &result);
    copy_declarations(&reader);
    declarations_refuse_unknown_settings(reader.check.declarations, coordinates, joints);
}
