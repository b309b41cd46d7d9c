/* Places, turns and directions of a model file: see reader.h. */
#include "gen/read/reader.h"

#include <float.h>
#include <math.h>
#include <string.h>

const struct place_fields link_place = {FIELD_LINK_on, FIELD_LINK_along, FIELD_LINK_at, FIELD_LINK_turn};
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
 * Sine and cosine of a number; exact at multiples of pi/2, which no double is: a frame turned by a right
 * angle must have zeros in its rotation, or the scene pays for terms of 1e-17.
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
        rotation[i] = expr_zero(g);
    rotation[4 * axis] = expr_one(g);
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
        return vector_unit(g, axis >= AXIS_X && axis <= AXIS_Z ? axis : AXIS_X);
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

static void complain_of_carrier(const struct reader *reader, struct place place, const char *path,
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

/* What `text` names: "arm", "arm.tip", "ground", or a point of interest; false when nothing is called so. */
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
        complain_of_carrier(reader, value->place, path, name, may_be_point);
    } else if (dot && strcmp(dot, ".tip") != 0) {
        message_error(check->messages, value->place,
                      "%s: \"%s\", only \"%s.tip\", the end of a beam, is known", path, text, name);
    } else if (dot && !link->beam.exists && !link->is_wrong) {
        message_error(check->messages, value->place, "%s: \"%s\" is no beam, only a beam has a tip", path,
                      name);
    } else if (dot) {
        at->where = AT_TIP;
    }
    return link && (!dot || at->where == AT_TIP);
}

static expression beam_length(const struct reader *reader, const struct beam *beam) {
    expression length = expr_zero(reader->check.graph);
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
        message_error(check->messages, along->place, "%s: %s, only a beam has places along it", path,
                      is_beam ? "beside the tip of the beam" : "on what is no beam");
        return;
    }
    value_expression(check->graph, along, &at->along);
    at->where = AT_ALONG;
    read_require(reader, requirement_along(at->along, beam_length(reader, &link->beam)), path, along->place);
}

bool read_attachment(const struct reader *reader, const struct value *table,
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
        message_error(reader->check.messages, value->place, "%s.angular: of a point of interest only",
                      own_path);
    const bool is_found = field_rules[field].type == TYPE_AXIS
                              ? read_attachment(reader, value, &axis_place, own_path, true, at)
                              : read_place(reader, value, own_path, true, at);
    return is_found && reader->check.messages->errors == errors;
}
