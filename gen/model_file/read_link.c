/*
 * What describes one link or place: places, turns and directions, then bodies, then joints. Reads tables of
 * the file; fills attachments, solids and joints of the model.
 */
#include "gen/model_file/reader.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

/* The fields of a table that describe a place. */
struct place_fields {
    enum field on, along, at, turn;
};
static const struct place_fields link_place = {FIELD_LINK_on, FIELD_LINK_along, FIELD_LINK_at,
                                               FIELD_LINK_turn};
static const struct place_fields point_place = {FIELD_POINT_on, FIELD_POINT_along, FIELD_POINT_at,
                                                FIELD_POINT_turn};
static const struct place_fields axis_place = {FIELD_AXIS_on, FIELD_AXIS_along, FIELD_AXIS_at,
                                               FIELD_AXIS_turn};

double read_value_now(const struct reader *reader, expression e) {
    return parameters_evaluate(reader->check.graph, reader->check.declarations->parameters, e);
}

void read_require(const struct reader *reader, struct requirement requirement, const char *path,
                  struct place place) {
    requirement.path = path;
    requirement.place = place;
    const char *fault = declarations_require(reader->check.declarations, requirement);
    if (fault)
        message_error(reader->check.messages, requirement.place, "%s", fault);
}

/* ---- turns ---- */

/*
 * Sine and cosine of a number, exact near multiples of pi/2, which no double represents exactly. A frame
 * turned by a right angle must have zeros in its rotation, so that no terms of 1e-17 are computed.
 */
static void exact_sine_cosine(double angle, double *sine, double *cosine) {
    static const double sines[] = {0, 1, 0, -1}, cosines[] = {1, 0, -1, 0};
    const double right = 1.57079632679489661923;
    double quarters = round(angle / right);
    *sine = sin(angle);
    *cosine = cos(angle);
    if (fabs(quarters) < 1e6 && fabs(angle - quarters * right) <= 4 * DBL_EPSILON * fabs(angle)) {
        int quarter = (int)quarters & 3;
        *sine = sines[quarter];
        *cosine = cosines[quarter];
    }
}

static void rotation_about(struct graph *g, int axis, expression angle, expression rotation[9]) {
    expression s, c;
    double value, sine, cosine;
    if (expr_is_number(g, angle, &value)) {
        exact_sine_cosine(value, &sine, &cosine);
        s = expr_number(g, sine);
        c = expr_number(g, cosine);
    } else {
        s = expr_apply1(g, OP_SIN, angle);
        c = expr_apply1(g, OP_COS, angle);
    }
    int j = (axis + 1) % 3, k = (axis + 2) % 3;
    for (int i = 0; i < 9; i++)
        rotation[i] = EXPR_ZERO;
    rotation[4 * axis] = EXPR_ONE;
    rotation[4 * j] = c;
    rotation[4 * k] = c;
    rotation[3 * j + k] = expr_neg(g, s);
    rotation[3 * k + j] = s;
}

void read_turns(const struct reader *reader, const struct value *turns, struct placement *placement) {
    struct graph *g = reader->check.graph;
    for (int i = 0; turns && i < turns->item_count; i++) {
        const struct value *turn = &turns->items[i];
        expression angle, rotation[9];
        if (turn->kind != VALUE_TABLE || turn->item_count != 2 || turn->items[0].kind != VALUE_TEXT)
            continue;
        int axis = *turn->items[0].text - 'x';
        if (axis < AXIS_X || axis > AXIS_Z || !value_expression(g, &turn->items[1], &angle))
            continue;
        rotation_about(g, axis, angle, rotation);
        struct matrix product = matrix_product(g, placement->rotation, rotation);
        memcpy(placement->rotation, product.at, sizeof placement->rotation);
    }
}

struct vector read_direction(const struct reader *reader, const struct value *value) {
    struct graph *g = reader->check.graph;
    struct vector v = {{0, 0, 0}};
    if (value->kind == VALUE_TEXT) {
        const int axis = *value->text - 'x';
        return vector_unit(axis >= AXIS_X && axis <= AXIS_Z ? axis : AXIS_X);
    }
    for (int i = 0; i < value->item_count && i < 3; i++)
        value_expression(g, &value->items[i], &v.at[i]);
    return v;
}

/* ---- places ---- */

static int find_link(const struct model *model, const char *name) {
    for (int i = 0; i < model->link_count; i++)
        if (*name && strcmp(model->links[i].name, name) == 0)
            return i;
    return -1;
}

static const struct point *find_point(const struct model *model, const char *name) {
    for (int i = 0; i < model->point_count; i++)
        if (strcmp(model->points[i].name, name) == 0)
            return &model->points[i];
    return NULL;
}

static void refuse_carrier(const struct reader *reader, struct place place, const char *path,
                           const char *name, bool may_be_point) {
    const struct model *model = reader->model;
    if (reader->lacks_links || !message_is_first_mention(reader->check.messages, "link", name))
        return;
    const int points = may_be_point ? model->point_count : 0, count = model->link_count + points;
    const char **known = memory_get(reader->check.memory, ((size_t)count + 1) * sizeof *known);
    for (int i = 0; i < points; i++)
        known[i] = model->points[i].name;
    for (int i = 0; i < model->link_count; i++)
        known[points + i] = model->links[i].name;
    const char *fact =
        memory_format(reader->check.memory, "no %slink \"%s\"", may_be_point ? "point or " : "", name);
    fields_refuse_name(&reader->check, place, path, fact, name, known, count);
}

/* Finds what the text names: "arm", "arm.tip", "ground" or a point of interest. False if there is none. */
static bool find_carrier(const struct reader *reader, const struct value *value, const char *path,
                         bool may_be_point, struct attachment *at) {
    const struct checker *check = &reader->check;
    const char *text = value->text, *dot = strchr(text, '.');
    const char *name = dot ? memory_format(check->memory, "%.*s", (int)(dot - text), text) : text;
    const struct point *point = may_be_point ? find_point(reader->model, text) : NULL;
    *at = point ? point->at : markers_ground_attachment();
    if (point || strcmp(text, "ground") == 0)
        return true;
    at->link = find_link(reader->model, name);
    const struct link *link = at->link < 0 ? NULL : &reader->model->links[at->link];
    if (!link) {
        refuse_carrier(reader, value->place, path, name, may_be_point);
    } else if (dot && strcmp(dot, ".tip") != 0) {
        message_error(check->messages, value->place,
                      "%s: \"%s\" is not a place; did you mean \"%s.tip\", the end of a beam?", path, text,
                      name);
    } else if (dot && !link->beam.exists && !link->is_wrong) {
        message_error(check->messages, value->place, "%s: \"%s\" is not a beam; only a beam has a tip", path,
                      name);
    } else if (dot) {
        at->where = AT_TIP;
    }
    return link && (!dot || at->where == AT_TIP);
}

static expression beam_length(const struct reader *reader, const struct beam *beam) {
    expression length = EXPR_ZERO;
    for (int i = 0; i < beam->segment_count; i++)
        length = expr_add(reader->check.graph, length, beam->segments[i].length);
    return length;
}

static void read_along(const struct reader *reader, const struct value *along, const char *path,
                       struct attachment *at) {
    const struct checker *check = &reader->check;
    const struct link *link = at->link < 0 ? NULL : &reader->model->links[at->link];
    const bool is_beam = link && link->beam.exists;
    if (link && link->is_wrong)
        return;
    if (!is_beam || at->where != AT_FRAME) {
        message_error(check->messages, along->place,
                      is_beam ? "%s: given together with the tip of the beam; give one of them"
                              : "%s: the link is not a beam; only a beam has places along it",
                      path);
        return;
    }
    value_expression(check->graph, along, &at->along);
    at->where = AT_ALONG;
    read_require(reader, requirement_along(at->along, beam_length(reader, &link->beam)), path, along->place);
}

/* `may_be_point`: `on` may name a point of interest. */
static bool read_attachment(const struct reader *reader, const struct value *table,
                            const struct place_fields *fields, const char *path, bool may_be_point,
                            struct attachment *at) {
    const struct checker *check = &reader->check;
    const struct value *on = fields_get(table, fields->on), *along = fields_get(table, fields->along);
    struct placement own = placement_identity();
    *at = markers_ground_attachment();
    const bool is_found = on ? find_carrier(reader, on, fields_path_name(check, path, "on"), may_be_point, at)
                             : field_rules[fields->on].need != NEED_NEEDED;
    if (along && on && is_found)
        read_along(reader, along, fields_path_name(check, path, "along"), at);
    fields_get_vector(check, table, fields->at, own.position);
    read_turns(reader, fields_get(table, fields->turn), &own);
    at->placement = placement_compose(check->graph, &at->placement, &own);
    return is_found;
}

bool read_carrier(const struct reader *reader, const struct value *table, const char *path,
                  struct attachment *at) {
    return read_attachment(reader, table, &link_place, path, false, at);
}

bool read_place(const struct reader *reader, const struct value *value, const char *path, bool may_be_point,
                struct attachment *at) {
    return value->kind == VALUE_TABLE ? read_attachment(reader, value, &point_place, path, may_be_point, at)
                                      : find_carrier(reader, value, path, may_be_point, at);
}

bool read_place_field(const struct reader *reader, const struct value *table, enum field field,
                      const char *path, struct attachment *at) {
    const struct value *value = fields_get(table, field);
    *at = markers_ground_attachment();
    if (!value)
        return false;
    const int errors = reader->check.messages->errors;
    const char *own_path = fields_path_name(&reader->check, path, field_rules[field].name);
    if (field_rules[field].type == TYPE_PLACE && value->kind == VALUE_TABLE &&
        fields_has(value, FIELD_POINT_angular))
        message_error(reader->check.messages, value->place,
                      "%s.angular: allowed for points of interest only; remove it", own_path);
    const bool is_found = field_rules[field].type == TYPE_AXIS
                              ? read_attachment(reader, value, &axis_place, own_path, true, at)
                              : read_place(reader, value, own_path, true, at);
    return is_found && reader->check.messages->errors == errors;
}

/* ---- bodies: mass data, and boxes, cylinders, tubes and spheres of even density ---- */

static const double pi = 3.14159265358979323846;

static void read_inertia(const struct reader *reader, const struct value *inertia, struct solid *solid) {
    static const enum field entries[] = {FIELD_INERTIA_xx, FIELD_INERTIA_yy, FIELD_INERTIA_zz,
                                         FIELD_INERTIA_xy, FIELD_INERTIA_xz, FIELD_INERTIA_yz};
    for (int i = 0; inertia && i < 6; i++)
        solid->inertia[i] = fields_get_value(&reader->check, inertia, entries[i]);
}

static void read_body(const struct reader *reader, const struct value *table, const char *path,
                      struct solid *solid) {
    const struct checker *check = &reader->check;
    fields_check(check, table, OWNER_BODY, path);
    solid->mass = fields_get_value(check, table, FIELD_BODY_mass);
    fields_get_vector(check, table, FIELD_BODY_center, solid->center);
    fields_get_vector(check, table, FIELD_BODY_at, solid->placement.position);
    read_turns(reader, fields_get(table, FIELD_BODY_turn), &solid->placement);
    read_inertia(reader, fields_get(table, FIELD_BODY_inertia), solid);
}

/* A shape whose mass is not yet known. */
struct shape {
    expression volume;    /* [m^3] */
    expression moment[3]; /* xx yy zz over mass [m^2] */
};

static expression square(struct graph *g, expression a) {
    return expr_mul(g, a, a);
}

static expression over(struct graph *g, expression a, double b) {
    return expr_div(g, a, expr_number(g, b));
}

static struct shape box_shape(const struct reader *reader, const struct value *table, const char *path) {
    struct graph *g = reader->check.graph;
    expression size[3];
    (void)path;
    fields_get_vector(&reader->check, table, FIELD_BOX_size, size);
    const expression xx = square(g, size[0]), yy = square(g, size[1]), zz = square(g, size[2]);
    return (struct shape){.volume = expr_mul(g, expr_mul(g, size[0], size[1]), size[2]),
                          .moment = {over(g, expr_add(g, yy, zz), 12), over(g, expr_add(g, xx, zz), 12),
                                     over(g, expr_add(g, xx, yy), 12)}};
}

static int read_axis_name(const struct reader *reader, const struct value *axis, const char *path) {
    if (!axis)
        return AXIS_X;
    if (strlen(axis->text) == 1 && strchr("xyz", *axis->text))
        return *axis->text - 'x';
    message_error(reader->check.messages, axis->place, "%s: \"%s\" is not an axis; use x, y or z",
                  fields_path_name(&reader->check, path, "axis"), axis->text);
    return AXIS_X;
}

/* A hollow cylinder: r^2 = (outer^2 + inner^2) / 4 with diameters; m r^2 / 2 about its axis, m (3 r^2 + L^2)
 * / 12 across. */
static struct shape hollow_shape(struct graph *g, int axis, expression outer, expression inner,
                                 expression length) {
    const expression out = square(g, outer), in = square(g, inner);
    const expression r2 = over(g, expr_add(g, out, in), 4);
    const expression across = over(g, expr_add(g, expr_mul(g, expr_number(g, 3), r2), square(g, length)), 12);
    struct shape shape = {.volume =
                              expr_mul(g, expr_mul(g, expr_number(g, pi / 4), expr_sub(g, out, in)), length),
                          .moment = {across, across, across}};
    shape.moment[axis] = over(g, r2, 2);
    return shape;
}

static struct shape cylinder_shape(const struct reader *reader, const struct value *table, const char *path) {
    const struct checker *check = &reader->check;
    const int axis = read_axis_name(reader, fields_get(table, FIELD_CYLINDER_axis), path);
    return hollow_shape(check->graph, axis, fields_get_value(check, table, FIELD_CYLINDER_diameter),
                        EXPR_ZERO, fields_get_value(check, table, FIELD_CYLINDER_length));
}

static struct shape tube_shape(const struct reader *reader, const struct value *table, const char *path) {
    const struct checker *check = &reader->check;
    const int axis = read_axis_name(reader, fields_get(table, FIELD_TUBE_axis), path);
    const expression outer = fields_get_value(check, table, FIELD_TUBE_outer);
    const struct value *inner = fields_get(table, FIELD_TUBE_inner);
    const expression hole = inner ? fields_get_value(check, table, FIELD_TUBE_inner) : EXPR_ZERO;
    if (inner)
        read_require(reader, requirement_hole(hole, outer), fields_path_name(check, path, "inner"),
                     inner->place);
    return hollow_shape(check->graph, axis, outer, hole, fields_get_value(check, table, FIELD_TUBE_length));
}

static struct shape sphere_shape(const struct reader *reader, const struct value *table, const char *path) {
    struct graph *g = reader->check.graph;
    const expression d = fields_get_value(&reader->check, table, FIELD_SPHERE_diameter);
    const expression moment = over(g, square(g, d), 10);
    (void)path;
    return (struct shape){.volume = expr_mul(g, expr_number(g, pi / 6), expr_mul(g, d, square(g, d))),
                          .moment = {moment, moment, moment}};
}

static const struct shape_rule {
    enum owner owner;
    enum field density, mass, at, turn;
    struct shape (*shape)(const struct reader *reader, const struct value *table, const char *path);
} shape_rules[] = {
    {OWNER_BOX, FIELD_BOX_density, FIELD_BOX_mass, FIELD_BOX_at, FIELD_BOX_turn, box_shape},
    {OWNER_CYLINDER, FIELD_CYLINDER_density, FIELD_CYLINDER_mass, FIELD_CYLINDER_at, FIELD_CYLINDER_turn,
     cylinder_shape},
    {OWNER_TUBE, FIELD_TUBE_density, FIELD_TUBE_mass, FIELD_TUBE_at, FIELD_TUBE_turn, tube_shape},
    {OWNER_SPHERE, FIELD_SPHERE_density, FIELD_SPHERE_mass, FIELD_SPHERE_at, FIELD_SPHERE_turn, sphere_shape},
};

static void read_shape(const struct reader *reader, const struct shape_rule *rule, const struct value *table,
                       const char *path, struct solid *solid) {
    const struct checker *check = &reader->check;
    struct graph *g = check->graph;
    const int errors = check->messages->errors;
    fields_check(check, table, rule->owner, path);
    const bool is_reported = check->messages->errors > errors;
    const struct shape shape = rule->shape(reader, table, path);
    const bool has_density = fields_has(table, rule->density), has_mass = fields_has(table, rule->mass);
    if (has_density == has_mass && (has_mass || !is_reported))
        message_error(check->messages, table->place, "%s: has %s; give one of them", path,
                      has_mass ? "both density and mass" : "neither density nor mass");
    solid->mass = has_mass ? fields_get_value(check, table, rule->mass)
                           : expr_mul(g, fields_get_value(check, table, rule->density), shape.volume);
    for (int i = 0; i < 3; i++)
        solid->inertia[i] = expr_mul(g, solid->mass, shape.moment[i]);
    fields_get_vector(check, table, rule->at, solid->placement.position);
    read_turns(reader, fields_get(table, rule->turn), &solid->placement);
}

static void read_listed(const struct reader *reader, const struct value *table, const char *path,
                        struct solid *solid) {
    solid->placement = placement_identity();
    for (size_t i = 0; i < sizeof shape_rules / sizeof *shape_rules; i++) {
        if (!fields_has_tag(table, owner_rules[shape_rules[i].owner].tag))
            continue;
        read_shape(reader, &shape_rules[i], table, path, solid);
        return;
    }
    read_body(reader, table, path, solid);
}

void read_solids(const struct reader *reader, const struct value *table, const char *path,
                 struct link *link) {
    const struct checker *check = &reader->check;
    const struct value *bodies = fields_get(table, FIELD_LINK_bodies);
    const int count = bodies ? bodies->item_count : 0;
    link->solids = memory_get(check->memory, ((size_t)count + 1) * sizeof *link->solids);
    struct solid *own = &link->solids[0];
    own->placement = placement_identity();
    own->mass = fields_get_value(check, table, FIELD_LINK_mass);
    fields_get_vector(check, table, FIELD_LINK_center, own->center);
    read_inertia(reader, fields_get(table, FIELD_LINK_inertia), own);
    link->solid_count = 1;
    for (int i = 0; i < count; i++)
        if (bodies->items[i].kind == VALUE_TABLE)
            read_listed(reader, &bodies->items[i],
                        fields_path_item(check, fields_path_name(check, path, "bodies"), i),
                        &link->solids[link->solid_count++]);
}

/* ---- joints: names, direction, and springs, dampers, rotors and limits by joint ---- */

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

/* False if the joints of the link are not known, because of an error. */
static bool read_joint_names(const struct reader *reader, const struct value *table, const char *path,
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
            continue; /* reported by fields_check */
        if (make_joint(names[i], place, &link->joints[link->joint_count]))
            link->joint_count++;
        else
            message_error(reader->check.messages, place,
                          "%s: \"%s\" is not a joint; use x, y, z, phi, theta or psi",
                          fields_path_item(&reader->check, path, i), names[i]);
    }
    const bool is_sound = value && value->field_count == 0 &&
                          (value->kind == VALUE_TEXT || is_free || count == value->item_count);
    return (is_sound || !fields_has(table, FIELD_LINK_joint)) && reader->check.messages->errors == errors;
}

/* The squares of its components must neither overflow nor underflow. */
static void require_length(const struct reader *reader, const struct value *axis, const char *path,
                           const struct joint *joint) {
    read_require(reader, requirement_length(reader->check.graph, joint->direction), path, axis->place);
}

/* The name of the only coordinate of a link. */
static void read_joint_coordinate(const struct reader *reader, const struct value *table, const char *path,
                                  struct link *link) {
    const struct value *name = fields_get(table, FIELD_LINK_coordinate);
    if (!name || name->kind != VALUE_TEXT)
        return;
    if (link->joint_count == 1)
        link->joints->coordinate = memory_text(reader->check.memory, name->text);
    else
        message_error(reader->check.messages, name->place,
                      "%s: the link has %d coordinates; must have exactly one", path, link->joint_count);
}

/* The direction of the only coordinate of a link. */
static void read_joint_axis(const struct reader *reader, const struct value *table, const char *path,
                            struct link *link) {
    const struct value *axis = fields_get(table, FIELD_LINK_axis);
    if (!axis || !link->joint_count)
        return;
    if (link->joint_count > 1) {
        message_error(reader->check.messages, axis->place,
                      "%s: the link has %d coordinates; an axis needs exactly one", path, link->joint_count);
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

static void refuse_joint(const struct reader *reader, const struct value_field *entry, const char *path,
                         const struct link *link) {
    const char *known[6];
    for (int j = 0; j < link->joint_count; j++)
        known[j] = link->joints[j].name;
    message_error(reader->check.messages, entry->value.place, "%s.%s: the link has no such joint%s", path,
                  entry->name,
                  message_advice_on_name(reader->check.memory, entry->name, known, link->joint_count));
}

static void read_by_joint(const struct reader *reader, const struct value *table, enum field field,
                          size_t member, const char *path, struct link *link) {
    const struct value *value = fields_get(table, field);
    for (int i = 0; value && i < value->field_count; i++) {
        const struct value_field *entry = &value->fields[i];
        struct joint *joint = find_joint(link, entry->name);
        if (joint) {
            value_expression(reader->check.graph, &entry->value, (expression *)((char *)joint + member));
            continue;
        }
        refuse_joint(reader, entry, fields_path_name(&reader->check, path, field_rules[field].name), link);
    }
}

/* The joint of entry i in a field of tables by joint. NULL if the link has no such joint or the entry is not
 * a table. */
static struct joint *joint_of_entry(const struct reader *reader, const struct value *field, int i,
                                    const char *path, const struct link *link) {
    const struct value_field *named = &field->fields[i];
    struct joint *joint = find_joint(link, named->name);
    if (!joint)
        refuse_joint(reader, named, path, link);
    return named->value.kind == VALUE_TABLE ? joint : NULL;
}

/* Inertia gear^2: theory, sect. 4.6. */
static expression reflected_inertia(const struct checker *check, const struct value *rotor) {
    struct graph *g = check->graph;
    const expression gear =
        fields_has(rotor, FIELD_ROTOR_gear) ? fields_get_value(check, rotor, FIELD_ROTOR_gear) : EXPR_ONE;
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
        message_error(reader->check.messages, table->place, "%s: empty; write %s", path,
                      owner_rules[OWNER_LIMITS].form);
    else if (isfinite(limits->from) && isfinite(limits->to) && !(limits->from < limits->to))
        message_error(reader->check.messages, table->place, "%s: from %.15g to %.15g; the range must ascend",
                      path, limits->from, limits->to);
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

/* Reports a rest without a spring at the same joint. */
static void check_rests(const struct reader *reader, const struct value *table, const char *path,
                        const struct link *link) {
    const struct value *rest = fields_get(table, FIELD_LINK_rest),
                       *spring = fields_get(table, FIELD_LINK_spring);
    for (int i = 0; rest && spring && i < rest->field_count; i++)
        if (find_joint(link, rest->fields[i].name) && !value_find_field(spring, rest->fields[i].name))
            message_error(reader->check.messages, rest->fields[i].value.place,
                          "%s.rest.%s: has no effect without spring.%s; add spring.%s", path,
                          rest->fields[i].name, rest->fields[i].name, rest->fields[i].name);
}

void read_joints(const struct reader *reader, const struct value *table, const char *path,
                 struct link *link) {
    const struct checker *check = &reader->check;
    if (fields_is_misspelled(table, OWNER_LINK, "joint") ||
        !read_joint_names(reader, table, fields_path_name(check, path, "joint"), link))
        return;
    read_joint_coordinate(reader, table, fields_path_name(check, path, "coordinate"), link);
    read_joint_axis(reader, table, fields_path_name(check, path, "axis"), link);
    for (size_t i = 0; i < sizeof joint_fields / sizeof *joint_fields; i++)
        read_by_joint(reader, table, joint_fields[i].field, joint_fields[i].member, path, link);
    check_rests(reader, table, path, link);
    read_rotors(reader, table, fields_path_name(check, path, "rotor"), link);
    read_limits(reader, table, fields_path_name(check, path, "limits"), link);
}
