/*
 * Reads what the author's function `constraints` returns: rows, one by one or as closed loops, axes and
 * joints; and contacts, whose rows act while they rest. Fills the model's rows, and events of contacts.
 *
 * Loops, axes and joints become position rows in symbols of points and directions. Two axes are kept parallel
 * by two dot products: of one axis with two directions fixed to the other body, at right angles to its axis.
 * These rows stay independent near every closed position.
 */
#include "gen/model_file/reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the rows of one entry have in common. */
struct group {
    const struct reader *reader;
    const struct value *value;
    const char *path, *name;
    expression alpha, beta;
};

/* The number in a name such as "loop 2 x" of a row of the kind "loop"; 0 for any other name. */
static long number_in(const char *name, const char *kind) {
    const size_t length = strlen(kind);
    if (strncmp(name, kind, length) != 0 || name[length] != ' ')
        return 0;
    char *end;
    const long found = strtol(name + length + 1, &end, 10);
    return *end == '\0' || *end == ' ' ? found : 0;
}

/* "loop 1", "loop 2" ..., with the first number that no row has. */
static const char *next_name(const struct reader *reader, const char *kind) {
    const struct model *model = reader->model;
    struct memory *memory = reader->check.memory;
    const struct memory_mark mark = memory_mark(memory);
    bool *is_taken = memory_scratch(memory, (size_t)model->row_count + 2);
    for (int i = 0; i < model->row_count; i++) {
        const long taken = number_in(model->rows[i].name, kind);
        if (taken > 0 && taken <= model->row_count)
            is_taken[taken] = true;
    }
    int first = 1;
    while (is_taken[first])
        first++;
    memory_back(memory, mark);
    return memory_format(memory, "%s %d", kind, first);
}

/* `name` is used if the author gives none; NULL selects the next one of its kind. */
static struct group start_group(const struct reader *reader, const struct value *value, const char *path,
                                const enum field gains[3], const char *name) {
    const struct checker *check = &reader->check;
    const struct value *given = fields_get(value, gains[2]);
    return (struct group){.reader = reader,
                          .value = value,
                          .path = path,
                          .name = given  ? given->text
                                  : name ? name
                                         : next_name(reader, value->tag),
                          .alpha = fields_get_value(check, value, gains[0]),
                          .beta = fields_get_value(check, value, gains[1])};
}

/* Units of multipliers, of rows whose residual is a distance, a cosine or an angle, or any formula. */
static const char force[] = "N", moment[] = "N m", any_unit[] = "";

/* Adds one row. `part` distinguishes it from the other rows of its entry; NULL if it is the only one. */
static void add_row(const struct group *group, enum row_level level, expression residual, const char *unit,
                    const char *part) {
    const struct checker *check = &group->reader->check;
    struct model *model = group->reader->model;
    model->rows =
        memory_room(check->memory, model->rows, model->row_count, &model->row_capacity, sizeof *model->rows);
    model->rows[model->row_count++] = (struct row){
        .level = level,
        .residual = residual,
        .unit = unit,
        .alpha = group->alpha,
        .beta = group->beta,
        .name = part ? memory_format(check->memory, "%s %s", group->name, part) : group->name,
        .path = group->path,
        .is_closure = part != NULL,
        .place = group->value->place,
    };
}

#define GAINS(owner) \
    ((const enum field[3]){FIELD_##owner##_alpha, FIELD_##owner##_beta, FIELD_##owner##_name})

/* ---- rows that the author writes ---- */

/* A formula of the author may contain values at the start of the motion. */
static void add_programme(const struct group *group, enum row_level level, expression residual,
                          const char *unit, const char *part) {
    const struct reader *reader = group->reader;
    add_row(group, level, residual, unit, part);
    struct row *row = &reader->model->rows[reader->model->row_count - 1];
    row->is_closure = false;
    row->is_programme = true;
    row->starts = declarations_start_values(reader->check.declarations, residual, &row->start_count);
}

/* Reports gains that have no residual to act on. */
static void check_gains(const struct reader *reader, const struct value *value, enum row_level level,
                        const char *path) {
    const struct value *alpha = fields_get(value, FIELD_ROW_alpha), *beta = fields_get(value, FIELD_ROW_beta);
    if (level == ROW_ACCELERATION && alpha)
        message_error(reader->check.messages, alpha->place,
                      "%s.alpha: an acceleration row has no residual to stabilise; remove it", path);
    if (level != ROW_POSITION && beta)
        message_error(reader->check.messages, beta->place, "%s.beta: only position rows have it; remove it",
                      path);
}

static void read_written_row(const struct reader *reader, const struct value *value, const char *path,
                             enum row_level level) {
    const struct value *residual = fields_get(value, FIELD_ROW_residual);
    expression e = EXPR_ZERO;
    if (!residual)
        return;
    check_gains(reader, value, level, path);
    value_expression(reader->check.graph, residual, &e);
    const char *name = memory_format(reader->check.memory, "row %d", reader->model->row_count + 1);
    const struct group group = start_group(reader, value, path, GAINS(ROW), name);
    add_programme(&group, level, e, any_unit, NULL);
}

static void read_position(const struct reader *reader, const struct value *value, const char *path) {
    read_written_row(reader, value, path, ROW_POSITION);
}

static void read_velocity(const struct reader *reader, const struct value *value, const char *path) {
    read_written_row(reader, value, path, ROW_VELOCITY);
}

static void read_acceleration(const struct reader *reader, const struct value *value, const char *path) {
    read_written_row(reader, value, path, ROW_ACCELERATION);
}

/* ---- vectors ---- */

static struct vector unit_of(struct graph *g, struct vector v) {
    return vector_scale(g, expr_div(g, EXPR_ONE, expr_sqrt(g, vector_dot(g, v, v))), v);
}

/* Two unit vectors at right angles to `along` and to each other: the other axes if it is an axis, else cross
 * products with the axis that is farthest from it. */
static void normals_of(const struct reader *reader, struct vector along, struct vector normal[2]) {
    struct graph *g = reader->check.graph;
    int farthest = 0, zeros = 0;
    double size[3];
    for (int i = 0; i < 3; i++) {
        size[i] = fabs(read_value_now(reader, along.at[i]));
        zeros += !along.at[i];
        farthest = size[i] < size[farthest] ? i : farthest;
    }
    for (int i = 0; zeros == 2 && i < 3; i++) {
        if (!along.at[i])
            continue;
        normal[0] = vector_unit((i + 1) % 3);
        normal[1] = vector_unit((i + 2) % 3);
        return;
    }
    normal[0] = unit_of(g, vector_cross(g, along, vector_unit(farthest)));
    normal[1] = unit_of(g, vector_cross(g, along, normal[0]));
}

static struct vector axis_of(const struct reader *reader, const struct attachment *at, int axis) {
    return markers_direction_vector(reader->model, at, vector_unit(axis));
}

static struct vector gap(const struct reader *reader, const struct attachment *a,
                         const struct attachment *b) {
    return vector_sub(reader->check.graph, markers_point_vector(reader->model, a, 0),
                      markers_point_vector(reader->model, b, 0));
}

static expression dot(const struct reader *reader, struct vector a, struct vector b) {
    return vector_dot(reader->check.graph, a, b);
}

/* A place of the model, and the unit direction of an axis there. */
struct axis {
    struct attachment at;
    struct vector direction;
};

static bool read_end(const struct reader *reader, const struct value *value, enum field field,
                     const char *path, struct axis *end) {
    const struct value *table = fields_get(value, field);
    if (!read_place_field(reader, value, field, path, &end->at))
        return false;
    if (field_rules[field].type != TYPE_AXIS)
        return true;
    const struct value *direction = fields_get(table, FIELD_AXIS_direction);
    if (!direction)
        return false;
    end->direction = read_direction(reader, direction);
    if (direction->kind == VALUE_TABLE)
        end->direction = unit_of(reader->check.graph, end->direction);
    return true;
}

/* The two fields of an entry that say what it connects. */
static bool read_ends(const struct reader *reader, const struct value *value, enum field first,
                      enum field second, const char *path, struct axis ends[2]) {
    const bool has_first = read_end(reader, value, first, path, &ends[0]);
    return read_end(reader, value, second, path, &ends[1]) && has_first;
}

static struct vector direction_of(const struct reader *reader, const struct axis *axis) {
    return markers_direction_vector(reader->model, &axis->at, axis->direction);
}

/* ---- loops and axes ---- */

static const char *const component_names[3] = {"x", "y", "z"};

static void read_loop(const struct reader *reader, const struct value *value, const char *path) {
    struct axis ends[2];
    const char **names;
    const struct value *keep = fields_get(value, FIELD_LOOP_keep);
    const int count = fields_get_names(&reader->check, keep, &names);
    bool keeps[3] = {!keep, !keep, !keep};
    for (int i = 0; i < count; i++) {
        if (strlen(names[i]) == 1 && strchr("xyz", *names[i]))
            keeps[*names[i] - 'x'] = true;
        else
            message_error(reader->check.messages, keep->place,
                          "%s.keep: \"%s\" is not an axis; use x, y or z", path, names[i]);
    }
    if (keep && count == 0 && keep->item_count + keep->field_count == 0)
        message_error(reader->check.messages, keep->place, "%s.keep: empty; name x, y, z or some of them",
                      path);
    if (!read_ends(reader, value, FIELD_LOOP_a, FIELD_LOOP_b, path, ends))
        return;
    const struct group group = start_group(reader, value, path, GAINS(LOOP), NULL);
    const struct vector apart = gap(reader, &ends[0].at, &ends[1].at);
    for (int i = 0; i < 3; i++)
        if (keeps[i])
            add_row(&group, ROW_POSITION, apart.at[i], force, component_names[i]);
}

/* Two rows: the vector `direction`, fixed to a, stays at right angles to the normals of the axis b. */
static void add_parallel(const struct group *group, struct vector direction, const struct axis *b,
                         const char *unit, const char *const parts[2]) {
    struct vector normal[2];
    normals_of(group->reader, b->direction, normal);
    for (int i = 0; i < 2; i++) {
        const struct vector across = markers_direction_vector(group->reader->model, &b->at, normal[i]);
        add_row(group, ROW_POSITION, dot(group->reader, direction, across), unit, parts[i]);
    }
}

static const char *const two_parts[2] = {"1", "2"};

static void read_parallel(const struct reader *reader, const struct value *value, const char *path) {
    struct axis ends[2];
    if (!read_ends(reader, value, FIELD_PARALLEL_a, FIELD_PARALLEL_b, path, ends))
        return;
    const struct group group = start_group(reader, value, path, GAINS(PARALLEL), NULL);
    add_parallel(&group, direction_of(reader, &ends[0]), &ends[1], moment, two_parts);
}

static void read_perpendicular(const struct reader *reader, const struct value *value, const char *path) {
    struct axis ends[2];
    if (!read_ends(reader, value, FIELD_PERPENDICULAR_a, FIELD_PERPENDICULAR_b, path, ends))
        return;
    const struct group group = start_group(reader, value, path, GAINS(PERPENDICULAR), NULL);
    const struct vector first = direction_of(reader, &ends[0]);
    add_row(&group, ROW_POSITION, dot(reader, first, direction_of(reader, &ends[1])), moment, NULL);
}

static void read_on_line(const struct reader *reader, const struct value *value, const char *path) {
    struct axis ends[2];
    if (!read_ends(reader, value, FIELD_ON_LINE_point, FIELD_ON_LINE_line, path, ends))
        return;
    const struct group group = start_group(reader, value, path, GAINS(ON_LINE), NULL);
    add_parallel(&group, gap(reader, &ends[0].at, &ends[1].at), &ends[1], force, two_parts);
}

static void read_on_plane(const struct reader *reader, const struct value *value, const char *path) {
    struct axis ends[2];
    if (!read_ends(reader, value, FIELD_ON_PLANE_point, FIELD_ON_PLANE_plane, path, ends))
        return;
    const struct group group = start_group(reader, value, path, GAINS(ON_PLANE), NULL);
    const struct vector normal = direction_of(reader, &ends[1]);
    add_row(&group, ROW_POSITION, dot(reader, gap(reader, &ends[0].at, &ends[1].at), normal), force, NULL);
}

static void read_distance(const struct reader *reader, const struct value *value, const char *path) {
    struct graph *g = reader->check.graph;
    struct axis ends[2];
    const struct value *length = fields_get(value, FIELD_DISTANCE_length);
    expression e;
    if (!read_ends(reader, value, FIELD_DISTANCE_a, FIELD_DISTANCE_b, path, ends) || !length)
        return;
    value_expression(g, length, &e);
    if (expr_is_number(g, e, NULL) && read_value_now(reader, e) <= 0)
        message_error(reader->check.messages, length->place,
                      "%s.length: value %.6g; must be positive (to make points coincide use rd.loop)", path,
                      read_value_now(reader, e));
    const struct group group = start_group(reader, value, path, GAINS(DISTANCE), NULL);
    const struct vector apart = gap(reader, &ends[0].at, &ends[1].at);
    add_row(&group, ROW_POSITION, expr_sub(g, expr_sqrt(g, dot(reader, apart, apart)), e), force, NULL);
}

/* ---- a whole orientation ---- */

/* R_t^T R by rows: products of the target's axes with those of the point. */
static struct matrix relative_rotation(const struct reader *reader, const struct placement *target,
                                       const struct attachment *at) {
    struct graph *g = reader->check.graph;
    struct matrix relative;
    for (int j = 0; j < 3; j++) {
        const struct vector turned = matrix_transpose_times(g, target->rotation, axis_of(reader, at, j));
        for (int i = 0; i < 3; i++)
            relative.at[3 * i + j] = turned.at[i];
    }
    return relative;
}

/* 2 tan(angle / 2) along the axis of R_t^T R: theory, sect. 6.6. */
static void read_orientation(const struct reader *reader, const struct value *value, const char *path) {
    struct graph *g = reader->check.graph;
    const struct value *turns = fields_get(value, FIELD_ORIENTATION_target);
    struct placement target = placement_identity();
    struct axis end;
    if (!read_end(reader, value, FIELD_ORIENTATION_of, path, &end) || !turns)
        return;
    read_turns(reader, turns, &target);
    const struct group group = start_group(reader, value, path, GAINS(ORIENTATION), NULL);
    const struct matrix R = relative_rotation(reader, &target, &end.at);
    const expression trace = expr_add(g, expr_add(g, R.at[0], R.at[4]), R.at[8]);
    const expression scale = expr_div(g, expr_number(g, 2), expr_add(g, EXPR_ONE, trace));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const expression twice_sine = expr_sub(g, R.at[3 * k + j], R.at[3 * j + k]);
        add_programme(&group, ROW_POSITION, expr_mul(g, scale, twice_sine), moment, component_names[i]);
    }
}

/* ---- joints ---- */

/* Kinds of closed joints: slides along x, y, z, then turns about them. */
enum closing_kind { CLOSING_X, CLOSING_Z = 2, CLOSING_PHI, CLOSING_BALL = 6, CLOSING_WELD, CLOSING_COUNT };

/* The motions that a closed joint leaves free. */
struct closing {
    bool slides[3];
    int turns[3], turn_count; /* axes, in order */
};

/* The error if the kind of joint `kind` follows those noted in `closing`, or NULL. */
static const char *closing_fault(const struct closing *closing, int kind, int count) {
    if (kind == CLOSING_COUNT)
        return "is not a joint; use x, y, z, phi, theta, psi, ball or weld";
    if (kind == CLOSING_WELD && count > 1)
        return "leaves nothing free; use it alone";
    if (kind <= CLOSING_Z && closing->turn_count > 0)
        return "slides after a turn; name slides first";
    if (kind > CLOSING_Z && kind != CLOSING_WELD && closing->turn_count + (kind == CLOSING_BALL ? 3 : 1) > 3)
        return "makes more than three turns; for three turns use ball alone";
    return NULL;
}

static bool read_closing(const struct reader *reader, const struct value *joint, const char *path,
                         struct closing *closing) {
    static const char *const kinds[] = {"x", "y", "z", "phi", "theta", "psi", "ball", "weld"};
    const struct checker *check = &reader->check;
    const char **names;
    const int count = fields_get_names(check, joint, &names);
    *closing = (struct closing){.turn_count = 0};
    for (int i = 0; i < count; i++) {
        int kind = CLOSING_X;
        while (kind < CLOSING_COUNT && strcmp(kinds[kind], names[i]) != 0)
            kind++;
        const char *fault = closing_fault(closing, kind, count);
        if (fault) {
            message_error(check->messages, joint->place, "%s: \"%s\" %s", path, names[i], fault);
            return false;
        }
        if (kind <= CLOSING_Z)
            closing->slides[kind] = true;
        else if (kind == CLOSING_BALL)
            closing->turn_count = 3;
        else if (kind != CLOSING_WELD)
            closing->turns[closing->turn_count++] = kind - CLOSING_PHI;
    }
    if (closing->turn_count < 3 || !closing->slides[0] || !closing->slides[1] || !closing->slides[2])
        return true;
    message_error(check->messages, joint->place, "%s: leaves all motions free; remove some of them", path);
    return false;
}

static void add_closed_positions(const struct group *group, const struct closing *closing,
                                 const struct attachment *a, const struct attachment *b) {
    const struct vector apart = gap(group->reader, a, b);
    const bool slides = closing->slides[0] || closing->slides[1] || closing->slides[2];
    for (int i = 0; i < 3; i++)
        if (!closing->slides[i])
            add_row(group, ROW_POSITION,
                    slides ? dot(group->reader, apart, axis_of(group->reader, b, i)) : apart.at[i], force,
                    component_names[i]);
}

/* One turn keeps its axis parallel. Two turns keep the first axis of b and the second of a at right angles.
 * No turn keeps each axis of a at right angles to the next axis of b. */
static void add_closed_turns(const struct group *group, const struct closing *closing,
                             const struct attachment *a, const struct attachment *b) {
    static const char *const parts[3] = {"turn 1", "turn 2", "turn 3"};
    const struct reader *reader = group->reader;
    const int first = closing->turns[0], second = closing->turns[1];
    if (closing->turn_count == 1) {
        const struct axis axis = {.at = *b, .direction = vector_unit(first)};
        add_parallel(group, axis_of(reader, a, first), &axis, moment, parts);
    } else if (closing->turn_count == 2) {
        add_row(group, ROW_POSITION, dot(reader, axis_of(reader, a, second), axis_of(reader, b, first)),
                moment, "turn");
    }
    for (int i = 0; closing->turn_count == 0 && i < 3; i++)
        add_row(group, ROW_POSITION, dot(reader, axis_of(reader, a, i), axis_of(reader, b, (i + 1) % 3)),
                moment, parts[i]);
}

static void read_close(const struct reader *reader, const struct value *value, const char *path) {
    const struct value *joint = fields_get(value, FIELD_CLOSE_joint);
    struct axis ends[2];
    struct closing closing;
    const bool has_ends = read_ends(reader, value, FIELD_CLOSE_a, FIELD_CLOSE_b, path, ends);
    if (!joint || !read_closing(reader, joint, fields_path_name(&reader->check, path, "joint"), &closing) ||
        !has_ends)
        return;
    const struct group group = start_group(reader, value, path, GAINS(CLOSE), NULL);
    add_closed_positions(&group, &closing, &ends[0].at, &ends[1].at);
    add_closed_turns(&group, &closing, &ends[0].at, &ends[1].at);
}

/* ---- coordinates as functions of time ---- */

static int find_named_coordinate(const struct reader *reader, const struct value *name, const char *path) {
    const struct checker *check = &reader->check;
    const int found = name ? tree_find_coordinate(reader->tree, name->text) : -1;
    if (name && found < 0)
        read_refuse_coordinate(reader, name->place, fields_path_name(check, path, "coordinate"),
                               memory_format(check->memory, "unknown coordinate \"%s\"", name->text),
                               name->text);
    return found;
}

static expression away(const struct reader *reader, int coordinate, expression value) {
    struct graph *g = reader->check.graph;
    return expr_sub(g, expr_symbol(g, SYMBOL_COORDINATE, coordinate, 0), value);
}

/* Notes that the last row drives or locks this coordinate. */
static void note_driven(const struct reader *reader, int coordinate) {
    reader->model->rows[reader->model->row_count - 1].driven = coordinate + 1;
}

static const char *unit_of_force(const struct reader *reader, int coordinate) {
    return reader->tree->frames[coordinate].joint.is_revolute ? moment : force;
}

static void read_drive(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    const struct value *course = fields_get(value, FIELD_DRIVE_value);
    const int coordinate = find_named_coordinate(reader, fields_get(value, FIELD_DRIVE_coordinate), path);
    expression e;
    if (coordinate < 0 || !course)
        return;
    value_expression(check->graph, course, &e);
    const char *name = memory_format(check->memory, "drive %s", reader->tree->frames[coordinate].name);
    const struct group group = start_group(reader, value, path, GAINS(DRIVE), name);
    add_programme(&group, ROW_POSITION, away(reader, coordinate, e), unit_of_force(reader, coordinate), NULL);
    note_driven(reader, coordinate);
}

/* The position at which a coordinate is locked if the model does not give one: an anchored parameter with its
 * value at the start of the motion. */
static expression start_parameter(const struct reader *reader, const struct value *value, int coordinate) {
    const struct checker *check = &reader->check;
    struct graph *g = check->graph;
    const struct frame *frame = &reader->tree->frames[coordinate];
    const expression now = expr_symbol(g, SYMBOL_COORDINATE, coordinate, 0);
    const struct value start = {.kind = VALUE_EXPRESSION,
                                .place = value->place,
                                .expression = expr_symbol(g, SYMBOL_START, (int)now, 0)};
    return declarations_add_parameter(check->declarations, value->place,
                                      memory_format(check->memory, "lock_%s", frame->name), &start,
                                      frame->joint.is_revolute ? "rad" : "m");
}

static void read_lock(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    const int coordinate = find_named_coordinate(reader, fields_get(value, FIELD_LOCK_coordinate), path);
    if (coordinate < 0)
        return;
    const expression e = fields_has(value, FIELD_LOCK_value)
                             ? fields_get_value(check, value, FIELD_LOCK_value)
                             : start_parameter(reader, value, coordinate);
    const char *name = memory_format(check->memory, "lock %s", reader->tree->frames[coordinate].name);
    const struct group group = start_group(reader, value, path, GAINS(LOCK), name);
    add_row(&group, ROW_POSITION, away(reader, coordinate, e), unit_of_force(reader, coordinate), NULL);
    note_driven(reader, coordinate);
}

/* ---- contacts ---- */

/* Adds the event of a contact. It changes the parameter that says whether the contact rests. */
static void add_contact_event(const struct group *group, expression gap, expression restitution, int mode) {
    struct memory *memory = group->reader->check.memory;
    struct model *model = group->reader->model;
    model->changes = memory_room(memory, model->changes, model->change_count, &model->change_capacity,
                                 sizeof *model->changes);
    model->events =
        memory_room(memory, model->events, model->event_count, &model->event_capacity, sizeof *model->events);
    model->events[model->event_count++] = (struct event){.name = group->name,
                                                         .value = gap,
                                                         .direction = -1,
                                                         .restitution = restitution,
                                                         .contact = model->row_count - 1,
                                                         .first_change = model->change_count,
                                                         .change_count = 1,
                                                         .path = group->path,
                                                         .place = group->value->place};
    model->changes[model->change_count++] = (struct change){.what = CHANGED_PARAMETER,
                                                            .index = mode,
                                                            .value = EXPR_ZERO,
                                                            .path = group->path,
                                                            .place = group->value->place};
}

/* The row is the gap times the parameter, so that it vanishes while the contact is open. */
static void read_contact(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    const struct value *given = fields_get(value, FIELD_CONTACT_gap);
    const char *standard = memory_format(check->memory, "contact_%d", model->event_count + 1);
    const struct group group = start_group(reader, value, path, GAINS(CONTACT), standard);
    expression gap;
    if (!given || !value_expression(check->graph, given, &gap))
        return;
    const expression rests = declarations_add_mode(check->declarations, value->place,
                                                   memory_format(check->memory, "%s_rests", group.name));
    add_row(&group, ROW_POSITION, expr_mul(check->graph, rests, gap), any_unit, NULL);
    model->rows[model->row_count - 1].rests = rests;
    add_contact_event(&group, gap, fields_get_value(check, value, FIELD_CONTACT_restitution),
                      check->declarations->parameter_count - 1);
}

/* Puts rows of contacts after all others, in the order of their events. */
static void put_contacts_last(const struct reader *reader) {
    struct model *model = reader->model;
    struct row *ordered = memory_get(reader->check.memory, ((size_t)model->row_count + 1) * sizeof *ordered);
    int count = 0;
    for (int contacts = 0; contacts < 2; contacts++)
        for (int i = 0; i < model->row_count; i++)
            if ((model->rows[i].rests != 0) == contacts)
                ordered[count++] = model->rows[i];
    for (int i = 0; i < model->event_count; i++)
        model->events[i].contact = model->row_count - model->event_count + i;
    model->rows = ordered;
    model->row_capacity = count;
}

/* ---- all entries ---- */

static const struct entry_kind kinds[] = {
    {"position", OWNER_ROW, read_position},
    {"velocity", OWNER_ROW, read_velocity},
    {"acceleration", OWNER_ROW, read_acceleration},
    {"loop", OWNER_LOOP, read_loop},
    {"parallel", OWNER_PARALLEL, read_parallel},
    {"perpendicular", OWNER_PERPENDICULAR, read_perpendicular},
    {"on_line", OWNER_ON_LINE, read_on_line},
    {"on_plane", OWNER_ON_PLANE, read_on_plane},
    {"distance", OWNER_DISTANCE, read_distance},
    {"orientation", OWNER_ORIENTATION, read_orientation},
    {"close", OWNER_CLOSE, read_close},
    {"drive", OWNER_DRIVE, read_drive},
    {"lock", OWNER_LOCK, read_lock},
    {"contact", OWNER_CONTACT, read_contact},
};

void read_constraints(const struct reader *reader, const struct value *result) {
    static const char needed[] = "a list of rows such as { rd.position { expression } }, or {} for none";
    const int errors = reader->check.messages->errors;
    if (!read_is_result(reader, result, "constraints", needed) ||
        !field_types_has_no_names(&reader->check, result, "constraints", needed))
        return;
    read_entries(reader, result, "constraints", kinds, sizeof kinds / sizeof *kinds,
                 "made by rd.position, velocity, acceleration, loop, parallel, perpendicular, on_line, "
                 "on_plane, distance, orientation, close, drive, lock or contact");
    put_contacts_last(reader);
    if (reader->check.messages->errors == errors)
        read_check_slopes(reader);
}
