/*
 * From the values of a model file to the model: links, points and names here, forces and rows in
 * read_programme.
 *
 * What the table of fields (fields.def) can check is checked by it; here follows what concerns several
 * fields.
 */
#include "read.h"
#include "fields.h"
#include "memory.h"
#include "script.h"
#include "vector.h"

#include <float.h>
#include <math.h>
#include <string.h>

struct reader {
    struct checker check;
    struct model *model;
};

static struct reader reader_of(struct script *script, struct model *model) {
    const struct declarations *declarations = script_declarations(script);
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
}

/* ---- placements ---- */

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
    if (is_number(g, angle, &value)) {
        exact_sine_cosine(value, &sine, &cosine);
        s = number(g, sine);
        c = number(g, cosine);
    } else {
        s = apply1(g, OP_SIN, angle);
        c = apply1(g, OP_COS, angle);
    }
    int j = (axis + 1) % 3, k = (axis + 2) % 3;
    for (int i = 0; i < 9; i++)
        rotation[i] = zero(g);
    rotation[4 * axis] = one(g);
    rotation[4 * j] = c;
    rotation[4 * k] = c;
    rotation[3 * j + k] = neg(g, s);
    rotation[3 * k + j] = s;
}

static void read_turns(const struct reader *reader, const struct value *turns, struct placement *placement) {
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

/* ---- joints ---- */

static const struct {
    const char *name;
    bool is_turn;
    int axis;
} joint_kinds[] = {{"x", false, AXIS_X},  {"y", false, AXIS_Y},    {"z", false, AXIS_Z},
                   {"phi", true, AXIS_X}, {"theta", true, AXIS_Y}, {"psi", true, AXIS_Z}};

static bool make_joint(const char *name, struct place place, struct joint *joint) {
    for (size_t i = 0; i < sizeof joint_kinds / sizeof *joint_kinds; i++) {
        if (strcmp(name, joint_kinds[i].name) != 0)
            continue;
        *joint = (struct joint){.is_turn = joint_kinds[i].is_turn,
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

static void read_joints(const struct reader *reader, const struct value *value, const char *path,
                        struct link *link) {
    const char **names;
    int count = get_names(&reader->check, value, &names);
    link->joints = memory_get(reader->check.memory, (size_t)count * sizeof *link->joints);
    for (int i = 0; i < count; i++) {
        struct place place = value->kind == VALUE_TABLE ? value->items[i].place : value->place;
        const char *joint_path = path_item(&reader->check, path, i);
        if (find_joint(link, names[i]))
            complain(reader->check.messages, place, "%s: \"%s\" is there twice, a link has each joint once",
                     joint_path, names[i]);
        else if (make_joint(names[i], place, &link->joints[link->joint_count]))
            link->joint_count++;
        else
            complain(reader->check.messages, place, "%s: \"%s\" is no joint, x y z phi theta psi are",
                     joint_path, names[i]);
    }
}

/* Which member of a joint a field of a link sets. */
static expression *joint_member(struct joint *joint, enum field field) {
    switch (field) {
    case FIELD_LINK_start:
        return &joint->start;
    case FIELD_LINK_start_rate:
        return &joint->start_rate;
    case FIELD_LINK_spring:
        return &joint->stiffness;
    case FIELD_LINK_rest:
        return &joint->rest;
    default:
        return &joint->damping;
    }
}

static void read_by_joint(const struct reader *reader, const struct value *table, enum field field,
                          const char *path, struct link *link) {
    const struct value *value = get_field(table, field);
    for (int i = 0; value && i < value->field_count; i++) {
        const struct named_value *entry = &value->fields[i];
        struct joint *joint = find_joint(link, entry->name);
        if (joint) {
            value_expression(reader->check.graph, &entry->value, joint_member(joint, field));
            continue;
        }
        const char *known = "";
        for (int j = 0; j < link->joint_count; j++)
            known = memory_format(reader->check.memory, "%s %s", known, link->joints[j].name);
        complain(reader->check.messages, entry->value.place, "%s.%s.%s: the link has no such joint, it has%s",
                 path, field_rules[field].name, entry->name, link->joint_count ? known : " none");
    }
}

/* ---- bodies ---- */

static void read_solid(const struct reader *reader, const struct value *table, const char *path,
                       struct link *link) {
    struct solid *solid = memory_get(reader->check.memory, sizeof *solid);
    link->solids = solid;
    link->solid_count = 1;
    solid->placement = placement_identity();
    static const enum field entries[] = {FIELD_INERTIA_xx, FIELD_INERTIA_yy, FIELD_INERTIA_zz,
                                         FIELD_INERTIA_xy, FIELD_INERTIA_xz, FIELD_INERTIA_yz};
    const struct checker *check = &reader->check;
    const struct value *inertia = get_field(table, FIELD_LINK_inertia);
    solid->mass = get_value(check, table, FIELD_LINK_mass);
    get_vector(check, table, FIELD_LINK_center, solid->center);
    if (!inertia)
        return;
    check_fields(check, inertia, OWNER_INERTIA, path_name(check, path, "inertia"));
    for (int i = 0; i < 6; i++)
        solid->inertia[i] = get_value(check, inertia, entries[i]);
}

static void read_dofs(const struct reader *reader, const struct value *value, const char *path,
                      struct beam *beam) {
    static const char *const turns[] = {"psi", "theta", "phi"};
    const char **names;
    int count = get_names(&reader->check, value, &names);
    for (int turn = 0; turn < 3; turn++)
        beam->keeps[turn] = !value;
    for (int i = 0; i < count; i++) {
        int turn = 0;
        while (turn < 3 && strcmp(turns[turn], names[i]) != 0)
            turn++;
        if (turn == 3)
            complain(reader->check.messages, value->place,
                     "%s: \"%s\" is no turn of an element, psi theta phi are", path, names[i]);
        else
            beam->keeps[turn] = true;
    }
    if (value && count == 0)
        complain(reader->check.messages, value->place,
                 "%s: empty, psi theta phi or some of them are needed (a rigid link has rfe = 1)", path);
}

static void read_beam(const struct reader *reader, const struct value *table, const char *path,
                      struct beam *beam) {
    const struct checker *check = &reader->check;
    struct segment *segment = memory_get(check->memory, sizeof *segment);
    const struct value *section = get_field(table, FIELD_BEAM_section);
    const struct value *rfe = get_field(table, FIELD_BEAM_rfe);
    check_fields(check, table, OWNER_BEAM, path);
    beam->exists = true;
    beam->segments = segment;
    beam->segment_count = 1;
    segment->length = get_value(check, table, FIELD_BEAM_length);
    segment->E = get_value(check, table, FIELD_BEAM_E);
    segment->nu = get_value(check, table, FIELD_BEAM_nu);
    segment->rho = get_value(check, table, FIELD_BEAM_rho);
    segment->eta = get_value(check, table, FIELD_BEAM_eta);
    segment->rfe = rfe && rfe->number >= 1 && rfe->number <= 10000 ? (int)rfe->number : 1;
    read_dofs(reader, get_field(table, FIELD_BEAM_dofs), path_name(check, path, "dofs"), beam);
    if (!section)
        return;
    check_fields(check, section, OWNER_SECTION, path_name(check, path, "section"));
    segment->area = get_value(check, section, FIELD_SECTION_area);
    segment->Iy = get_value(check, section, FIELD_SECTION_Iy);
    segment->Iz = get_value(check, section, FIELD_SECTION_Iz);
    segment->It = get_value(check, section, FIELD_SECTION_It);
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

static void read_link(const struct reader *reader, const struct value *value, struct entry *entry) {
    static const enum field by_joint[] = {FIELD_LINK_start, FIELD_LINK_start_rate, FIELD_LINK_spring,
                                          FIELD_LINK_rest, FIELD_LINK_damper};
    const struct checker *check = &reader->check;
    const struct value *name = get_field(value, FIELD_LINK_name), *beam = get_field(value, FIELD_LINK_beam);
    struct link *link = &entry->link;
    entry->value = value;
    check_fields(check, value, OWNER_LINK, entry->path);
    link->name = name ? name->text : "";
    link->place = value->place;
    link->on.placement = placement_identity();
    get_vector(check, value, FIELD_LINK_at, link->on.placement.position);
    read_turns(reader, get_field(value, FIELD_LINK_turn), &link->on.placement);
    read_joints(reader, get_field(value, FIELD_LINK_joint), path_name(check, entry->path, "joint"), link);
    for (size_t i = 0; i < sizeof by_joint / sizeof *by_joint; i++)
        read_by_joint(reader, value, by_joint[i], entry->path, link);
    read_solid(reader, value, entry->path, link);
    if (beam)
        read_beam(reader, beam, path_name(check, entry->path, "beam"), &link->beam);
}

static int find_entry(const struct entry *entries, int count, const char *name) {
    for (int i = 0; i < count; i++)
        if (*name && strcmp(entries[i].link.name, name) == 0)
            return i;
    return -1;
}

/* The entry that `text` ("arm", "arm.tip" or "ground") names, -1 for the ground and after a complaint. */
static int find_carrier(const struct reader *reader, const struct entry *entries, int count,
                        const struct value *value, const char *path, enum attachment_where *where) {
    const struct checker *check = &reader->check;
    const char *text = value->text, *dot = strchr(text, '.');
    const char *name = dot ? memory_format(check->memory, "%.*s", (int)(dot - text), text) : text;
    *where = AT_FRAME;
    if (strcmp(text, "ground") == 0)
        return -1;
    int carrier = find_entry(entries, count, name);
    if (carrier < 0) {
        const char **known = memory_get(check->memory, ((size_t)count + 1) * sizeof *known);
        for (int i = 0; i < count; i++)
            known[i] = entries[i].link.name;
        complain_of_name(check, value->place, path, memory_format(check->memory, "no link \"%s\"", name),
                         name, known, count);
    } else if (dot && strcmp(dot, ".tip") != 0) {
        complain(check->messages, value->place, "%s: \"%s\", only \"%s.tip\", the end of a beam, is known",
                 path, text, name);
    } else if (dot && !entries[carrier].link.beam.exists) {
        complain(check->messages, value->place, "%s: \"%s\" is no beam, only a beam has a tip", path, name);
    } else if (dot) {
        *where = AT_TIP;
    }
    return carrier;
}

static void find_parents(const struct reader *reader, struct entry *entries, int count) {
    for (int i = 0; i < count; i++) {
        const struct value *on = get_field(entries[i].value, FIELD_LINK_on);
        entries[i].parent = -1;
        entries[i].position = -1;
        if (on)
            entries[i].parent =
                find_carrier(reader, entries, count, on, path_name(&reader->check, entries[i].path, "on"),
                             &entries[i].link.on.where);
    }
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
    complain(reader->check.messages, entries[first].link.place,
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

static struct entry *read_links(const struct reader *reader, const struct value *list, int *count) {
    struct entry *entries = NULL;
    *count = 0;
    if (!list)
        return NULL;
    if (list->item_count == 0)
        complain(reader->check.messages, list->place, "links: empty, a model has at least one link");
    entries = memory_get(reader->check.memory, ((size_t)list->item_count + 1) * sizeof *entries);
    for (int i = 0; i < list->item_count; i++) {
        if (list->items[i].kind != VALUE_TABLE)
            continue;
        entries[*count].path = path_item(&reader->check, "links", i);
        read_link(reader, &list->items[i], &entries[(*count)++]);
    }
    reader->model->links = memory_get(reader->check.memory, ((size_t)*count + 1) * sizeof(struct link));
    find_parents(reader, entries, *count);
    order_links(reader, entries, *count);
    return entries;
}

/* ---- points and names ---- */

static void read_point(const struct reader *reader, const struct entry *entries, int count,
                       const struct named_value *named, struct point *point) {
    const struct checker *check = &reader->check;
    const char *path = path_name(check, "points", named->name);
    const struct value *on = &named->value;
    *point = (struct point){.name = named->name, .place = named->value.place};
    point->at.placement = placement_identity();
    point->at.link = -1;
    if (named->value.kind == VALUE_TABLE) {
        check_fields(check, &named->value, OWNER_POINT, path);
        on = get_field(&named->value, FIELD_POINT_on);
        get_vector(check, &named->value, FIELD_POINT_at, point->at.placement.position);
        path = path_name(check, path, "on");
    } else if (on->kind != VALUE_TEXT) {
        complain(check->messages, on->place, "%s: %s, the name of a link or { on = ..., at = ... } is needed",
                 path, kind_text(on->kind));
        on = NULL;
    }
    if (!on)
        return;
    int carrier = find_carrier(reader, entries, count, on, path, &point->at.where);
    point->at.link = carrier < 0 ? -1 : entries[carrier].position;
}

static void read_points(const struct reader *reader, const struct value *table, const struct entry *entries,
                        int count) {
    struct model *model = reader->model;
    if (!table)
        return;
    for (int i = 0; i < table->item_count; i++)
        complain(reader->check.messages, table->items[i].place,
                 "points[%d]: without a name, E = \"arm\" or the like is needed", i + 1);
    model->points = memory_get(reader->check.memory, (size_t)table->field_count * sizeof *model->points);
    model->point_count = model->marker_count = table->field_count;
    for (int i = 0; i < table->field_count; i++)
        read_point(reader, entries, count, &table->fields[i], &model->points[i]);
}

static void read_form(const struct reader *reader, const struct value *form) {
    if (!form)
        return;
    reader->model->printed_form = strcmp(form->text, "printed") == 0;
    if (!reader->model->printed_form && strcmp(form->text, "corrected") != 0)
        complain(reader->check.messages, form->place, "form: \"%s\", \"corrected\" or \"printed\" is needed",
                 form->text);
}

static void read_names(const struct reader *reader, const struct value *root) {
    struct model *model = reader->model;
    const struct value *name = get_field(root, FIELD_MODEL_name);
    const struct value *dependent = get_field(root, FIELD_MODEL_dependent);
    const struct value *hold = get_field(root, FIELD_MODEL_hold);
    if (name)
        model->name = name->text;
    model->dependent_count = get_names(&reader->check, dependent, &model->dependent);
    model->dependent_place = dependent ? dependent->place : root->place;
    model->hold_count = get_names(&reader->check, hold, &model->hold);
    model->hold_place = hold ? hold->place : root->place;
}

void read_scene(struct script *script, struct model *model) {
    const struct reader reader = reader_of(script, model);
    const struct value *root = script_result(script);
    int count;
    *model = (struct model){.name = "",
                            .file = reader.check.declarations->request->file,
                            .place = root->place,
                            .graph = reader.check.graph,
                            .fold = reader.check.declarations->request->fold};
    copy_declarations(&reader);
    if (root->kind != VALUE_TABLE || !root->tag || strcmp(root->tag, "model") != 0) {
        complain(reader.check.messages, root->place, "the file returns %s, return rd.model { ... } is needed",
                 kind_text(root->kind));
        return;
    }
    check_fields(&reader.check, root, OWNER_MODEL, "");
    read_names(&reader, root);
    read_form(&reader, get_field(root, FIELD_MODEL_form));
    get_vector(&reader.check, root, FIELD_MODEL_gravity, model->gravity);
    const struct entry *entries = read_links(&reader, get_field(root, FIELD_MODEL_links), &count);
    read_points(&reader, get_field(root, FIELD_MODEL_points), entries, count);
}

/* ---- forces and rows ---- */

static void read_force(const struct reader *reader, const struct tree *tree,
                       const struct named_value *named) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    const char *path = path_name(check, "forces", named->name);
    struct force force = {.coordinate = find_coordinate(tree, named->name), .place = named->value.place};
    if (force.coordinate < 0)
        complain_of_name(check, force.place, path, "unknown coordinate", named->name,
                         coordinate_names(check->memory, tree), tree->count);
    else if (!value_expression(check->graph, &named->value, &force.value))
        complain(check->messages, force.place, "%s: %s, a number or an expression is needed", path,
                 kind_text(named->value.kind));
    else if (!is_number(check->graph, force.value, NULL) || force.value != zero(check->graph))
        model->forces[model->force_count++] = force;
}

static void read_course(const struct reader *reader, const struct named_value *named) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    struct course *course = &model->courses[model->course_count];
    *course = (struct course){.name = named->name, .place = named->value.place};
    if (value_expression(check->graph, &named->value, &course->value))
        model->course_count++;
    else
        complain(check->messages, course->place, "%s: %s, a number or an expression is needed",
                 path_name(check, "courses", named->name), kind_text(named->value.kind));
}

static void read_courses(const struct reader *reader, const struct value *table) {
    if (table->kind != VALUE_TABLE || table->item_count > 0) {
        complain(reader->check.messages, table->place,
                 "courses: the function gives %s, a table of values by name is needed",
                 table->item_count > 0 ? "a list" : kind_text(table->kind));
        return;
    }
    reader->model->courses =
        memory_get(reader->check.memory, (size_t)table->field_count * sizeof *reader->model->courses);
    for (int i = 0; i < table->field_count; i++)
        read_course(reader, &table->fields[i]);
}

static void read_forces(const struct reader *reader, const struct tree *tree, const struct value *table) {
    if (table->kind == VALUE_NOTHING)
        return;
    if (table->kind != VALUE_TABLE) {
        complain(reader->check.messages, table->place,
                 "forces: the function gives %s, a table by coordinate is needed", kind_text(table->kind));
        return;
    }
    for (int i = 0; i < table->item_count; i++)
        complain(reader->check.messages, table->items[i].place,
                 "forces[%d]: without a name, that of a coordinate is needed", i + 1);
    reader->model->forces =
        memory_get(reader->check.memory, (size_t)table->field_count * sizeof *reader->model->forces);
    for (int i = 0; i < table->field_count; i++)
        read_force(reader, tree, &table->fields[i]);
}

static bool level_of(const struct value *value, enum row_level *level) {
    static const char *const tags[] = {"position", "velocity", "acceleration"};
    for (int i = 0; value->kind == VALUE_TABLE && value->tag && i < 3; i++) {
        *level = (enum row_level)i;
        if (strcmp(value->tag, tags[i]) == 0)
            return true;
    }
    return false;
}

/* A gain that has nothing to act on is a mistake of the author. */
static void check_gains(const struct reader *reader, const struct value *value, const struct row *row,
                        const char *path) {
    const struct value *alpha = get_field(value, FIELD_ROW_alpha), *beta = get_field(value, FIELD_ROW_beta);
    if (row->level == ROW_ACCELERATION && alpha)
        complain(reader->check.messages, alpha->place,
                 "%s.alpha: an acceleration row has no residual to stabilise", path);
    if (row->level != ROW_POSITION && beta)
        complain(reader->check.messages, beta->place,
                 "%s.beta: only a position row has a residual of position", path);
}

static void read_row(const struct reader *reader, const struct value *value, int index) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    struct row row = {.place = value->place};
    const char *path = path_item(check, "constraints", index);
    if (!level_of(value, &row.level)) {
        complain(check->messages, value->place,
                 "%s: %s, rd.position, rd.velocity or rd.acceleration { ... } is needed", path,
                 kind_text(value->kind));
        return;
    }
    check_fields(check, value, OWNER_ROW, path);
    const struct value *residual = get_field(value, FIELD_ROW_residual);
    const struct value *name = get_field(value, FIELD_ROW_name);
    if (!residual)
        return;
    check_gains(reader, value, &row, path);
    value_expression(check->graph, residual, &row.residual);
    row.alpha = get_value(check, value, FIELD_ROW_alpha);
    row.beta = get_value(check, value, FIELD_ROW_beta);
    row.name = name ? name->text : memory_format(check->memory, "row %d", index + 1);
    model->rows[model->row_count++] = row;
}

static void read_rows(const struct reader *reader, const struct value *list) {
    if (list->kind == VALUE_NOTHING)
        return;
    if (list->kind != VALUE_TABLE) {
        complain(reader->check.messages, list->place,
                 "constraints: the function gives %s, a list of rows is needed", kind_text(list->kind));
        return;
    }
    for (int i = 0; i < list->field_count; i++)
        complain(reader->check.messages, list->fields[i].value.place,
                 "constraints.%s: a named entry, a list of rows is needed", list->fields[i].name);
    reader->model->rows =
        memory_get(reader->check.memory, (size_t)list->item_count * sizeof *reader->model->rows);
    for (int i = 0; i < list->item_count; i++)
        read_row(reader, &list->items[i], i);
}

void read_programme(struct script *script, const struct tree *tree, struct model *model) {
    const struct reader reader = reader_of(script, model);
    const struct value *root = script_result(script);
    const struct value *forces = get_field(root, FIELD_MODEL_forces);
    const struct value *constraints = get_field(root, FIELD_MODEL_constraints);
    const struct value *courses = get_field(root, FIELD_MODEL_courses);
    const char **points = memory_get(reader.check.memory, ((size_t)model->point_count + 1) * sizeof *points);
    struct value result;
    for (int i = 0; i < model->point_count; i++)
        points[i] = model->points[i].name;
    script_set_names(script, coordinate_names(reader.check.memory, tree), tree->count, points,
                     model->point_count);
    if (forces && script_call(script, forces, &result))
        read_forces(&reader, tree, &result);
    if (courses && script_call(script, courses, &result))
        read_courses(&reader, &result);
    if (constraints && script_call(script, constraints, &result))
        read_rows(&reader, &result);
    copy_declarations(&reader);
    complain_of_unknown_settings(reader.check.declarations);
}
