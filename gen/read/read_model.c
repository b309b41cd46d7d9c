/*
 * From the values of a model file to the model: links, points and names here, forces and rows in
 * read_programme.
 *
 * What the table of fields (fields.def) can check is checked by it; here follows what concerns several
 * fields.
 */
#include "read/read_model.h"
#include "read/reader.h"
#include "read/script.h"

#include <stddef.h>
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

/* ---- joints ---- */

static const struct {
    const char *name;
    bool is_revolute;
    int axis;
} joint_kinds[] = {{"x", false, AXIS_X},  {"y", false, AXIS_Y},    {"z", false, AXIS_Z},
                   {"phi", true, AXIS_X}, {"theta", true, AXIS_Y}, {"psi", true, AXIS_Z}};

static bool make_joint(const char *name, struct place place, struct joint *joint) {
    for (size_t i = 0; i < sizeof joint_kinds / sizeof *joint_kinds; i++) {
        if (strcmp(name, joint_kinds[i].name) != 0)
            continue;
        *joint = (struct joint){.is_revolute = joint_kinds[i].is_revolute,
                                .axis = joint_kinds[i].axis,
                                .name = joint_kinds[i].name,
                                .place = place};
        return true;
    }
    return false;
}

static struct joint *find_joint(const struct link *link, const char *name) {
    for (int i = 0; i < link->joint_count; i++)
        if (strcmp(link->joints[i].name, name) == 0)
            return &link->joints[i];
    return NULL;
}

/* False when the joints that the link has are not known. */
static bool read_joints(const struct reader *reader, const struct value *table, const char *path,
                        struct link *link) {
    static const char *const free_names[] = {"x", "y", "z", "psi", "theta", "phi"};
    const struct value *value = fields_get(table, FIELD_LINK_joint);
    const int errors = reader->check.messages->errors;
    const char **names;
    int count = fields_get_names(&reader->check, value, &names);
    const bool is_free = count == 1 && strcmp(names[0], "free") == 0;
    if (is_free) {
        count = 6;
        names = memory_grow(reader->check.memory, free_names, sizeof free_names, sizeof free_names);
    }
    link->joints = memory_get(reader->check.memory, (size_t)count * sizeof *link->joints);
    for (int i = 0; i < count; i++) {
        struct place place = value->kind == VALUE_TABLE && !is_free ? value->items[i].place : value->place;
        if (find_joint(link, names[i]))
            continue; /* said by fields_check */
        if (make_joint(names[i], place, &link->joints[link->joint_count]))
            link->joint_count++;
        else
            message_error(reader->check.messages, place, "%s: \"%s\" is no joint, x y z phi theta psi are",
                          fields_path_item(&reader->check, path, i), names[i]);
    }
    const bool is_sound = value && value->field_count == 0 &&
                          (value->kind == VALUE_TEXT || is_free || count == value->item_count);
    return (is_sound || !fields_has(table, FIELD_LINK_joint)) && reader->check.messages->errors == errors;
}

/* Squares of its components are numbers, too. */
static void require_length(const struct reader *reader, const struct value *axis, const char *path,
                           const struct joint *joint) {
    struct requirement requirement = {
        .fault = requirement_length, .count = 3, .path = path, .place = axis->place};
    memcpy(requirement.values, joint->direction, sizeof joint->direction);
    read_require(reader, requirement);
}

/* One coordinate has a direction of its own. */
static void read_joint_axis(const struct reader *reader, const struct value *table, const char *path,
                            struct link *link) {
    const struct value *axis = fields_get(table, FIELD_LINK_axis);
    if (!axis || !link->joint_count)
        return;
    if (link->joint_count > 1) {
        message_error(reader->check.messages, axis->place, "%s: the link has %d coordinates, one is needed",
                      path, link->joint_count);
        return;
    }
    const struct vector direction = read_direction(reader, axis);
    link->joints->has_direction = true;
    memcpy(link->joints->direction, direction.at, sizeof direction.at);
    if (!vector_is_zero(direction))
        require_length(reader, axis, path, link->joints);
}

/* Fields of a link that set a member of its joints. */
static const struct {
    enum field field;
    size_t member;
} joint_fields[] = {{FIELD_LINK_start, offsetof(struct joint, start)},
                    {FIELD_LINK_start_rate, offsetof(struct joint, start_rate)},
                    {FIELD_LINK_spring, offsetof(struct joint, stiffness)},
                    {FIELD_LINK_rest, offsetof(struct joint, rest)},
                    {FIELD_LINK_damper, offsetof(struct joint, damping)}};

static void read_by_joint(const struct reader *reader, const struct value *table, enum field field,
                          size_t member, const char *path, struct link *link) {
    const struct value *value = fields_get(table, field);
    for (int i = 0; value && i < value->field_count; i++) {
        const struct named_value *entry = &value->fields[i];
        struct joint *joint = find_joint(link, entry->name);
        if (joint) {
            value_expression(reader->check.graph, &entry->value, (expression *)((char *)joint + member));
            continue;
        }
        const char *known = "";
        for (int j = 0; j < link->joint_count; j++)
            known = memory_format(reader->check.memory, "%s %s", known, link->joints[j].name);
        message_error(reader->check.messages, entry->value.place,
                      "%s.%s.%s: the link has no such joint, it has%s", path, field_rules[field].name,
                      entry->name, link->joint_count ? known : " none");
    }
}

/* A rest without a spring at the same joint. */
static void check_rests(const struct reader *reader, const struct value *table, const char *path,
                        const struct link *link) {
    const struct value *rest = fields_get(table, FIELD_LINK_rest),
                       *spring = fields_get(table, FIELD_LINK_spring);
    for (int i = 0; rest && spring && i < rest->field_count; i++)
        if (find_joint(link, rest->fields[i].name) && !value_find_field(spring, rest->fields[i].name))
            message_error(reader->check.messages, rest->fields[i].value.place,
                          "%s.rest.%s: given without spring.%s, which is needed", path, rest->fields[i].name,
                          rest->fields[i].name);
}

/* ---- links ---- */

/* A link as read, in the order of the file. */
struct entry {
    struct link link;
    const struct value *value;
    const char *path;
    int parent;   /* entry that it stands on, -1: the ground */
    int position; /* in the model's order, -1: not yet placed */
};

static void check_inertias(const struct reader *reader, const struct link *link) {
    const char *path = memory_format(reader->check.memory, "link %s", link->name);
    for (int i = 0; i < link->solid_count; i++) {
        struct requirement requirement = {
            .fault = requirement_inertia, .count = 6, .path = path, .place = link->place};
        memcpy(requirement.values, link->solids[i].inertia, sizeof requirement.values);
        read_require(reader, requirement);
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
    const bool has_joints = !fields_is_misspelled(value, OWNER_LINK, "joint") &&
                            read_joints(reader, value, fields_path_name(check, entry->path, "joint"), link);
    if (has_joints)
        read_joint_axis(reader, value, fields_path_name(check, entry->path, "axis"), link);
    for (size_t i = 0; has_joints && i < sizeof joint_fields / sizeof *joint_fields; i++)
        read_by_joint(reader, value, joint_fields[i].field, joint_fields[i].member, entry->path, link);
    if (has_joints)
        check_rests(reader, value, entry->path, link);
    read_solids(reader, value, entry->path, link);
    if (beam)
        read_beam(reader, beam, fields_path_name(check, entry->path, "beam"), &link->beam);
    link->is_wrong = check->messages->errors > errors;
    if (!link->is_wrong)
        check_inertias(reader, link);
}

/* The links stand in the model in the order of the file meanwhile, so that places can be looked up. */
static void find_parents(const struct reader *reader, struct entry *entries, int count) {
    struct model *model = reader->model;
    for (int i = 0; i < count; i++)
        model->links[model->link_count++] = entries[i].link;
    for (int i = 0; i < count; i++) {
        struct attachment *on = &entries[i].link.on;
        read_attachment(reader, entries[i].value, &link_place, entries[i].path, false, on);
        entries[i].parent = on->link;
        entries[i].position = -1;
    }
    model->link_count = 0;
}

/* Every unplaced entry has an unplaced parent: names one cycle among them and puts it on the ground. */
static void break_cycle(const struct reader *reader, struct entry *entries, int count) {
    int at = 0;
    while (entries[at].position >= 0)
        at++;
    for (int i = 0; i < count; i++) /* after so many steps one is within the cycle */
        at = entries[at].parent;
    int first = at;
    for (int i = entries[at].parent; i != at; i = entries[i].parent)
        first = i < first ? i : first;
    const char *text = memory_format(reader->check.memory, "\"%s\"", entries[first].link.name);
    for (int i = entries[first].parent;; i = entries[i].parent) {
        text = memory_format(reader->check.memory, "%s stands on \"%s\"", text, entries[i].link.name);
        if (i == first)
            break;
    }
    message_error(reader->check.messages, entries[first].link.place,
                  "%s: %s, a chain that ends on the ground is needed", entries[first].path, text);
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
        message_error(reader->check.messages, list->place, "links: empty, a model has at least one link");
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

static void read_point(const struct reader *reader, const struct named_value *named, struct point *point) {
    const struct value *value = &named->value;
    *point = (struct point){.name = named->name, .place = value->place, .at = markers_ground_attachment()};
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

static void read_form(const struct reader *reader, const struct value *form) {
    if (!form)
        return;
    reader->model->printed_form = strcmp(form->text, "printed") == 0;
    if (!reader->model->printed_form && strcmp(form->text, "corrected") != 0)
        message_error(reader->check.messages, form->place,
                      "form: \"%s\", \"corrected\" or \"printed\" is needed", form->text);
}

static void read_names(const struct reader *reader, const struct value *root) {
    struct model *model = reader->model;
    const struct value *name = fields_get(root, FIELD_MODEL_name);
    const struct value *dependent = fields_get(root, FIELD_MODEL_dependent);
    const struct value *hold = fields_get(root, FIELD_MODEL_hold);
    if (name)
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
        message_error(reader.check.messages, root->place,
                      "the file returns %s, return rd.model { ... } is needed", value_kind_text(root->kind));
        return;
    }
    fields_check(&reader.check, root, OWNER_MODEL, "");
    read_names(&reader, root);
    read_form(&reader, fields_get(root, FIELD_MODEL_form));
    fields_get_vector(&reader.check, root, FIELD_MODEL_gravity, model->gravity);
    read_links(&reader, fields_get(root, FIELD_MODEL_links));
    read_points(&reader, fields_get(root, FIELD_MODEL_points));
}

/* ---- forces and rows ---- */

void read_programme(struct script *script, const struct tree *tree, struct model *model) {
    struct reader reader = reader_of(script, model);
    const struct value *root = script_result(script);
    const struct value *forces = fields_get(root, FIELD_MODEL_forces);
    const struct value *constraints = fields_get(root, FIELD_MODEL_constraints);
    const struct value *courses = fields_get(root, FIELD_MODEL_courses);
    const struct value *events = fields_get(root, FIELD_MODEL_events);
    struct value result;
    reader.tree = tree;
    script_set_names(script, model, tree_coordinate_names(reader.check.memory, tree), tree->count);
    if (forces && script_call(script, forces, "forces", &result))
        read_forces(&reader, &result);
    if (courses && script_call(script, courses, "courses", &result))
        read_courses(&reader, &result);
    if (constraints && script_call(script, constraints, "constraints", &result))
        read_constraints(&reader, &result);
    if (events && script_call(script, events, "events", &result))
        read_events(&reader, &result);
    copy_declarations(&reader);
    declarations_refuse_unknown_settings(reader.check.declarations);
}
