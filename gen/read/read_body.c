/*
 * Solids of a link: mass data, and boxes, cylinders, tubes and spheres of even density. See reader.h.
 */
#include "gen/read/reader.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- mass data ---- */

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

/* ---- shapes ---- */

/* What a shape is before its density or mass is known: volume, and moments of inertia over mass. */
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
    message_error(reader->check.messages, axis->place, "%s: \"%s\" is no axis, x y z are",
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
                        expr_zero(check->graph), fields_get_value(check, table, FIELD_CYLINDER_length));
}

static struct shape tube_shape(const struct reader *reader, const struct value *table, const char *path) {
    const struct checker *check = &reader->check;
    const int axis = read_axis_name(reader, fields_get(table, FIELD_TUBE_axis), path);
    const expression outer = fields_get_value(check, table, FIELD_TUBE_outer);
    const struct value *inner = fields_get(table, FIELD_TUBE_inner);
    const expression hole =
        inner ? fields_get_value(check, table, FIELD_TUBE_inner) : expr_zero(check->graph);
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
    const bool is_told = check->messages->errors > errors;
    const struct shape shape = rule->shape(reader, table, path);
    const bool has_density = fields_has(table, rule->density), has_mass = fields_has(table, rule->mass);
    if (has_density == has_mass && (has_mass || !is_told))
        message_error(check->messages, table->place, "%s: %s, one of them is needed", path,
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
        if (!fields_has_tag(table, fields_owner_tag(shape_rules[i].owner)))
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
