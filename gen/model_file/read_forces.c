/*
 * Reads what the author's functions `forces` and `courses` return: forces on coordinates, loads at points,
 * energies, and values to record. Fills those lists of the model.
 */
#include "gen/model_file/reader.h"

#include <string.h>

/* ---- on coordinates ---- */

static void read_coordinate_force(const struct reader *reader, const struct value_field *named) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    const char *path = fields_path_name(check, "forces", named->name);
    struct force force = {.coordinate = tree_find_coordinate(reader->tree, named->name),
                          .place = named->value.place};
    if (force.coordinate < 0)
        read_refuse_coordinate(reader, force.place, path, "unknown coordinate", named->name);
    else if (!value_expression(check->graph, &named->value, &force.value))
        message_error(check->messages, force.place, "%s: %s; must be a number or an expression", path,
                      value_kind_text(named->value.kind));
    else if (!expr_is_number(check->graph, force.value, NULL) || force.value != EXPR_ZERO)
        model->forces[model->force_count++] = force;
}

/* ---- between two points ---- */

static void add_load(const struct reader *reader, const struct attachment *at, bool is_torque,
                     struct vector value, const struct value *source, const char *path) {
    struct model *model = reader->model;
    if (at->link < 0 || vector_is_zero(value))
        return; /* loads on the ground have no effect */
    struct load load = {
        .point = markers_point(model, at), .is_torque = is_torque, .path = path, .place = source->place};
    memcpy(load.value, value.at, sizeof load.value);
    model->loads = memory_room(reader->check.memory, model->loads, model->load_count, &model->load_capacity,
                               sizeof *model->loads);
    model->loads[model->load_count++] = load;
}

static void add_potential(const struct reader *reader, expression energy, const struct value *source,
                          const char *path) {
    struct model *model = reader->model;
    model->potentials = memory_room(reader->check.memory, model->potentials, model->potential_count,
                                    &model->potential_capacity, sizeof *model->potentials);
    model->potentials[model->potential_count++] =
        (struct potential){.energy = energy, .path = path, .place = source->place};
}

static bool slides(const struct link *link) {
    for (int i = 0; i < link->joint_count; i++)
        if (!link->joints[i].is_revolute)
            return true;
    return false;
}

/* Warns of a force at the root of a beam or at a place that does not move, which is probably a mistake. */
static void warn_of_origin(const struct reader *reader, const struct attachment *at, struct place place,
                           const char *path) {
    const expression *position = at->placement.position;
    if (at->link < 0 || at->where != AT_FRAME || position[0] || position[1] || position[2])
        return;
    const struct link *link = &reader->model->links[at->link];
    if (link->is_wrong || slides(link))
        return;
    if (link->beam.exists)
        message_warning(reader->check.messages, place,
                        "%s: acts at the root of the beam \"%s\"; for its end write \"%s.tip\"", path,
                        link->name, link->name);
    else if (link->on.link < 0)
        message_warning(reader->check.messages, place,
                        "%s: acts at the origin of \"%s\", which does not move; for another place write "
                        "{ on = \"%s\", at = { x, y, z } }",
                        path, link->name, link->name);
}

/* The line between two places, along which springs, dampers and actuators act. */
struct line {
    struct attachment from, to;
    struct vector apart, rate; /* to - from */
};

/* Whether both places are fixed to one rigid body. Places along a beam move relative to each other. */
static bool is_one_link(const struct attachment *a, const struct attachment *b) {
    return a->link == b->link && a->where == AT_FRAME && b->where == AT_FRAME;
}

static bool read_line(const struct reader *reader, const struct value *value, enum field from, enum field to,
                      const char *path, struct line *line) {
    struct graph *g = reader->check.graph;
    struct model *model = reader->model;
    const bool has_from = read_place_field(reader, value, from, path, &line->from);
    const bool has_to = read_place_field(reader, value, to, path, &line->to);
    if (!has_from || !has_to)
        return false;
    if (is_one_link(&line->from, &line->to))
        message_error(reader->check.messages, value->place,
                      "%s: both ends are on one link; put them on two links", path);
    warn_of_origin(reader, &line->from, value->place, path);
    warn_of_origin(reader, &line->to, value->place, path);
    line->apart =
        vector_sub(g, markers_point_vector(model, &line->to, 0), markers_point_vector(model, &line->from, 0));
    line->rate =
        vector_sub(g, markers_point_vector(model, &line->to, 1), markers_point_vector(model, &line->from, 1));
    return true;
}

/* A force of `push` times the vector from one end to the other, and the opposite force on the other end. */
static void add_push(const struct reader *reader, const struct line *line, expression push,
                     const struct value *source, const char *path) {
    struct graph *g = reader->check.graph;
    add_load(reader, &line->to, false, vector_scale(g, push, line->apart), source, path);
    add_load(reader, &line->from, false, vector_scale(g, expr_neg(g, push), line->apart), source, path);
}

/* 1/2 s (length - rest)^2 */
static void read_spring(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    struct graph *g = check->graph;
    struct line line;
    if (!read_line(reader, value, FIELD_SPRING_from, FIELD_SPRING_to, path, &line))
        return;
    const expression half =
        expr_mul(g, expr_number(g, 0.5), fields_get_value(check, value, FIELD_SPRING_stiffness));
    const expression rest = fields_get_value(check, value, FIELD_SPRING_rest);
    expression square = vector_dot(g, line.apart, line.apart);
    if (rest) {
        const expression stretch = expr_sub(g, expr_sqrt(g, square), rest);
        square = expr_mul(g, stretch, stretch);
    }
    add_potential(reader, expr_mul(g, half, square), value, path);
}

static void read_damper(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    struct graph *g = check->graph;
    struct line line;
    if (!read_line(reader, value, FIELD_DAMPER_from, FIELD_DAMPER_to, path, &line))
        return;
    const expression speed = vector_dot(g, line.apart, line.rate),
                     square = vector_dot(g, line.apart, line.apart);
    const expression damping = fields_get_value(check, value, FIELD_DAMPER_damping);
    add_push(reader, &line, expr_neg(g, expr_div(g, expr_mul(g, damping, speed), square)), value, path);
}

static expression free_value(const struct reader *reader, const struct value *table, enum field field) {
    const struct value *value = fields_get(table, field);
    expression e = EXPR_ZERO;
    if (value)
        value_expression(reader->check.graph, value, &e);
    return e;
}

bool read_push(const struct reader *reader, const struct value *value, enum field from, enum field to,
               expression force, const char *path) {
    struct graph *g = reader->check.graph;
    struct line line;
    if (!read_line(reader, value, from, to, path, &line))
        return false;
    const expression length = expr_sqrt(g, vector_dot(g, line.apart, line.apart));
    add_push(reader, &line, expr_div(g, force, length), value, path);
    return true;
}

static void read_actuator(const struct reader *reader, const struct value *value, const char *path) {
    read_push(reader, value, FIELD_ACTUATOR_from, FIELD_ACTUATOR_to,
              free_value(reader, value, FIELD_ACTUATOR_force), path);
}

/* ---- at a point ---- */

/* The components of a load in the ground frame. The author gives them in it or along the axes of a link or
 * point. */
static struct vector ground_components(const struct reader *reader, const struct value *value,
                                       enum field components, enum field axes, const char *path) {
    struct graph *g = reader->check.graph;
    const struct value *given = fields_get(value, components), *frame = fields_get(value, axes);
    struct vector own = {{0, 0, 0}}, sum = {{0, 0, 0}};
    struct attachment at;
    for (int i = 0; given && i < given->item_count && i < 3; i++)
        value_expression(g, &given->items[i], &own.at[i]);
    if (!frame)
        return own;
    read_place(reader, frame, fields_path_name(&reader->check, path, "axes"), true, &at);
    for (int i = 0; i < 3; i++) {
        if (!own.at[i])
            continue;
        const struct vector axis = markers_direction_vector(reader->model, &at, vector_unit(i));
        sum = vector_add(g, sum, vector_scale(g, own.at[i], axis));
    }
    return sum;
}

static void read_force(const struct reader *reader, const struct value *value, const char *path) {
    struct attachment at;
    const struct vector F = ground_components(reader, value, FIELD_FORCE_value, FIELD_FORCE_axes, path);
    if (!read_place_field(reader, value, FIELD_FORCE_at, path, &at))
        return;
    if (at.link < 0)
        message_error(reader->check.messages, value->place, "%s: acts on the ground; must act on a link",
                      path);
    warn_of_origin(reader, &at, value->place, path);
    add_load(reader, &at, false, F, value, path);
}

static void read_torque(const struct reader *reader, const struct value *value, const char *path) {
    struct graph *g = reader->check.graph;
    struct attachment on, against;
    const struct vector T = ground_components(reader, value, FIELD_TORQUE_value, FIELD_TORQUE_axes, path);
    const bool has_on = read_place_field(reader, value, FIELD_TORQUE_on, path, &on);
    const bool has_against = read_place_field(reader, value, FIELD_TORQUE_against, path, &against);
    if (has_on && on.link < 0 && against.link < 0 && has_against == fields_has(value, FIELD_TORQUE_against))
        message_error(reader->check.messages, value->place, "%s: acts on the ground; must act on a link",
                      path);
    if (has_on && has_against && on.link >= 0 && is_one_link(&on, &against))
        message_error(reader->check.messages, value->place,
                      "%s: against names the link on which the torque acts; name another link", path);
    if (has_on)
        add_load(reader, &on, true, T, value, path);
    if (has_against)
        add_load(reader, &against, true, vector_scale(g, expr_neg(g, EXPR_ONE), T), value, path);
}

static void read_energy(const struct reader *reader, const struct value *value, const char *path) {
    const expression energy = free_value(reader, value, FIELD_ENERGY_value);
    if (energy)
        add_potential(reader, energy, value, path);
}

/* ---- what the functions return ---- */

static const struct entry_kind kinds[] = {
    {"spring", OWNER_SPRING, read_spring},       {"damper", OWNER_DAMPER, read_damper},
    {"actuator", OWNER_ACTUATOR, read_actuator}, {"force", OWNER_FORCE, read_force},
    {"torque", OWNER_TORQUE, read_torque},       {"energy", OWNER_ENERGY, read_energy}};

void read_forces(const struct reader *reader, const struct value *result) {
    struct model *model = reader->model;
    if (!read_is_result(reader, result, "forces", "a table such as { arm_psi = 1 }, or {} for none"))
        return;
    model->forces = memory_get(reader->check.memory, (size_t)result->field_count * sizeof *model->forces);
    for (int i = 0; i < result->field_count; i++)
        read_coordinate_force(reader, &result->fields[i]);
    read_entries(reader, result, "forces", kinds, sizeof kinds / sizeof *kinds,
                 "COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy");
}

static void read_course(const struct reader *reader, const struct value_field *named) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    struct course *course = &model->courses[model->course_count];
    *course = (struct course){.name = named->name, .place = named->value.place};
    if (value_expression(check->graph, &named->value, &course->value))
        model->course_count++;
    else
        message_error(check->messages, course->place, "%s: %s; must be a number or an expression",
                      fields_path_name(check, "courses", named->name), value_kind_text(named->value.kind));
}

void read_courses(const struct reader *reader, const struct value *table) {
    static const char needed[] = "a table of values by name such as { speed = s.qd.arm_psi }";
    if (!read_is_result(reader, table, "courses", needed) ||
        !field_types_has_no_items(&reader->check, table, "courses", needed))
        return;
    reader->model->courses =
        memory_get(reader->check.memory, (size_t)table->field_count * sizeof *reader->model->courses);
    for (int i = 0; i < table->field_count; i++)
        read_course(reader, &table->fields[i]);
}
