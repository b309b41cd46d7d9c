/*
 * Joints of a link: names, direction, and what is given by joint: springs, dampers, rotors, limits. See
 * reader.h.
 */
#include "gen/read/reader.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

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
static bool read_names(const struct reader *reader, const struct value *table, const char *path,
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
    read_require(reader, requirement_length(reader->check.graph, joint->direction), path, axis->place);
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

static void refuse_joint(const struct reader *reader, const struct named_value *entry, const char *path,
                         const struct link *link) {
    const char *known = "";
    for (int j = 0; j < link->joint_count; j++)
        known = memory_format(reader->check.memory, "%s %s", known, link->joints[j].name);
    message_error(reader->check.messages, entry->value.place, "%s.%s: the link has no such joint, it has%s",
                  path, entry->name, link->joint_count ? known : " none");
}

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
        refuse_joint(reader, entry, fields_path_name(&reader->check, path, field_rules[field].name), link);
    }
}

/* ---- rotors ---- */

/* Entry i of a field of tables by joint: its joint; NULL: the link has no such joint, or the entry is no
 * table. */
static struct joint *joint_of_entry(const struct reader *reader, const struct value *field, int i,
                                    const char *path, const struct link *link) {
    const struct named_value *named = &field->fields[i];
    struct joint *joint = find_joint(link, named->name);
    if (!joint)
        refuse_joint(reader, named, path, link);
    return named->value.kind == VALUE_TABLE ? joint : NULL;
}

/* inertia gear^2: theory, sect. 4.6. */
static expression reflected_inertia(const struct checker *check, const struct value *rotor) {
    struct graph *g = check->graph;
    const expression gear =
        fields_has(rotor, FIELD_ROTOR_gear) ? fields_get_value(check, rotor, FIELD_ROTOR_gear) : expr_one(g);
    return expr_mul(g, fields_get_value(check, rotor, FIELD_ROTOR_inertia), expr_mul(g, gear, gear));
}

static void read_rotors(const struct reader *reader, const struct value *table, const char *path,
                        struct link *link) {
    const struct value *rotors = fields_get(table, FIELD_LINK_rotor);
    for (int i = 0; rotors && i < rotors->field_count; i++) {
        struct joint *joint = joint_of_entry(reader, rotors, i, path, link);
        if (joint)
            joint->rotor = reflected_inertia(&reader->check, &rotors->fields[i].value);
    }
}

static double limit_of(const struct value *limits, enum field field, double none) {
    const struct value *value = fields_get(limits, field);
    return value ? value->number : none;
}

static const struct limits *read_limit(const struct reader *reader, const struct value *table,
                                       const char *path) {
    struct limits *limits = memory_get(reader->check.memory, sizeof *limits);
    *limits = (struct limits){.from = limit_of(table, FIELD_LIMITS_from, -INFINITY),
                              .to = limit_of(table, FIELD_LIMITS_to, INFINITY),
                              .rate = limit_of(table, FIELD_LIMITS_rate, INFINITY),
                              .force = limit_of(table, FIELD_LIMITS_force, INFINITY)};
    if (table->field_count + table->item_count == 0)
        message_error(reader->check.messages, table->place, "%s: empty, %s is needed", path,
                      owner_form(OWNER_LIMITS));
    else if (isfinite(limits->from) && isfinite(limits->to) && !(limits->from < limits->to))
        message_error(reader->check.messages, table->place,
                      "%s: from %.15g to %.15g, a range that ascends is needed", path, limits->from,
                      limits->to);
    return limits;
}

static void read_limits(const struct reader *reader, const struct value *table, const char *path,
                        struct link *link) {
    const struct value *limits = fields_get(table, FIELD_LINK_limits);
    for (int i = 0; limits && i < limits->field_count; i++) {
        struct joint *joint = joint_of_entry(reader, limits, i, path, link);
        if (joint)
            joint->limits = read_limit(reader, &limits->fields[i].value,
                                       fields_path_name(&reader->check, path, joint->name));
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

void read_joints(const struct reader *reader, const struct value *table, const char *path,
                 struct link *link) {
    const struct checker *check = &reader->check;
    if (fields_is_misspelled(table, OWNER_LINK, "joint") ||
        !read_names(reader, table, fields_path_name(check, path, "joint"), link))
        return;
    read_joint_axis(reader, table, fields_path_name(check, path, "axis"), link);
    for (size_t i = 0; i < sizeof joint_fields / sizeof *joint_fields; i++)
        read_by_joint(reader, table, joint_fields[i].field, joint_fields[i].member, path, link);
    check_rests(reader, table, path, link);
    read_rotors(reader, table, fields_path_name(check, path, "rotor"), link);
    read_limits(reader, table, fields_path_name(check, path, "limits"), link);
}
