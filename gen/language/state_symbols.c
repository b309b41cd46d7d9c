/*
 * Symbols of formulas: from names such as s.q.arm_psi to symbols, markers of points and directions, and kinks
 * of formulas in coordinates and rates.
 */
#include "gen/language/language.h"

#include <string.h>

/* ---- markers: points and directions that formulas need in addition to the points of interest ---- */

/* Each is made once and read by its symbols. A place on the ground is constant and needs no marker. */

struct attachment markers_ground_attachment(void) {
    return (struct attachment){.link = -1, .placement = placement_identity()};
}

static bool is_same_place(const struct attachment *a, const struct attachment *b) {
    return a->link == b->link && a->where == b->where && a->along == b->along &&
           memcmp(a->placement.position, b->placement.position, sizeof a->placement.position) == 0;
}

static int find_marker(const struct model *model, const struct attachment *at, bool is_direction) {
    for (int i = 0; i < model->marker_count; i++)
        if (model->points[i].is_direction == is_direction && is_same_place(&model->points[i].at, at))
            return i;
    return -1;
}

/* "arm_tip_axis_x" for an axis of a link; "arm_direction_7" or "arm_marker_7" for other markers. */
static const char *marker_name(const struct model *model, const struct attachment *at, bool is_direction) {
    static const char *const wheres[] = {"", "_tip", "_along"};
    _Static_assert(sizeof wheres / sizeof *wheres == AT_ALONG + 1, "each place has a name");
    struct memory *memory = model->graph->memory;
    const char *link = model->links[at->link].name;
    const expression *c = at->placement.position;
    for (int axis = 0; is_direction && at->where != AT_ALONG && axis < 3; axis++)
        if (c[axis] == EXPR_ONE && !c[(axis + 1) % 3] && !c[(axis + 2) % 3])
            return memory_format(memory, "%s%s_axis_%c", link, wheres[at->where], "xyz"[axis]);
    return memory_format(memory, "%s%s_%s_%d", link, wheres[at->where], is_direction ? "direction" : "marker",
                         model->marker_count + 1);
}

static int add_marker(struct model *model, const struct attachment *at, bool is_direction) {
    const int found = find_marker(model, at, is_direction);
    if (found >= 0)
        return found;
    model->points = memory_room(model->graph->memory, model->points, model->marker_count,
                                &model->marker_capacity, sizeof *model->points);
    model->points[model->marker_count] =
        (struct point){.name = marker_name(model, at, is_direction), .at = *at, .is_direction = is_direction};
    return model->marker_count++;
}

int markers_point(struct model *model, const struct attachment *at) {
    return add_marker(model, at, false);
}

/* Number of the marker of a vector with components in the axes of `at`, which is on a link. */
static int markers_direction(struct model *model, const struct attachment *at, struct vector components) {
    struct attachment fixed = *at;
    const struct vector turned = matrix_times(model->graph, at->placement.rotation, components);
    fixed.placement = placement_identity();
    memcpy(fixed.placement.position, turned.at, sizeof turned.at);
    return add_marker(model, &fixed, true);
}

static struct vector marker_vector(const struct model *model, int marker, int order) {
    struct vector v;
    for (int axis = 0; axis < 3; axis++)
        v.at[axis] = expr_symbol(model->graph, SYMBOL_POINT, 3 * marker + axis, order);
    return v;
}

struct vector markers_point_vector(struct model *model, const struct attachment *at, int order) {
    const struct vector still = {{0, 0, 0}};
    if (at->link < 0)
        return order == 0 ? vector_of(at->placement.position) : still;
    return marker_vector(model, markers_point(model, at), order);
}

struct vector markers_direction_vector(struct model *model, const struct attachment *at,
                                       struct vector components) {
    if (at->link < 0)
        return matrix_times(model->graph, at->placement.rotation, components);
    return marker_vector(model, markers_direction(model, at, components), 0);
}

/* ---- names of the state and of parameters ---- */

/*
 * The names:
 * s.t  s.q.NAME  s.qd.NAME  s.qdd.NAME  s.points.NAME.x ... zdd  s.points.NAME.axes.x.x ... zdd
 * s.axes.LINK.x.x ... zdd  s.points.NAME.wx ... wzd  s.axes.LINK.wx ... wzd  s.inputs.NAME  s.states.NAME
 * s.start.<the same>  p.NAME
 */

/* The kinds of a view. Its `order` is the time derivative of coordinates, `index` the number of a point,
 * direction or link. */
enum view_kind {
    VIEW_PARAMETERS,
    VIEW_STATE,
    VIEW_COORDINATES,
    VIEW_POINTS,
    VIEW_POINT,
    VIEW_INPUTS,
    VIEW_STATES, /* continuous states of controllers */
    VIEW_AXES,   /* by link */
    VIEW_AXES_OF_POINT,
    VIEW_AXES_OF_LINK,
    VIEW_AXES_OF_TIP,
    VIEW_DIRECTION
};

const struct view view_of_state = {.kind = VIEW_STATE}, view_of_parameters = {.kind = VIEW_PARAMETERS};

static struct view_result no_field(const struct view_names *names, const char *path, const char *field,
                                   const char *kind, const char *const *known, int count) {
    struct memory *memory = names->declarations->memory;
    const char *fault = memory_format(memory, "%s.%s: unknown %s%s", path, field, kind,
                                      message_advice_on_name(memory, field, known, count));
    const bool is_reported = !message_is_first_mention(names->declarations->messages, kind, field);
    return (struct view_result){.fault = fault, .is_reported = is_reported};
}

static struct view_result no_acceleration(void) {
    return (struct view_result){.fault =
                                    "s.start: has no accelerations; use q, qd, positions and velocities"};
}

static struct view_result found(const struct view_names *names, const struct view *view, expression e) {
    if (view->at_start)
        e = expr_symbol(names->declarations->graph, SYMBOL_START, (int)e, 0);
    return (struct view_result){.expression = e};
}

static struct view_result state_field(const struct view_names *names, struct view view, const char *field) {
    static const char *const known[] = {"t", "q", "qd", "qdd", "points", "inputs", "start", "axes", "states"};
    struct view inner = {.at_start = view.at_start};
    switch (text_index(field, known, 9)) {
    case 0:
        return found(names, &view, expr_symbol(names->declarations->graph, SYMBOL_TIME, 0, 0));
    case 1:
    case 2:
    case 3:
        inner.kind = VIEW_COORDINATES;
        inner.order = (int)strlen(field) - 1;
        if (inner.at_start && inner.order == 2)
            return no_acceleration();
        break;
    case 4:
        inner.kind = VIEW_POINTS;
        break;
    case 5:
        inner.kind = VIEW_INPUTS;
        break;
    case 6:
        inner.kind = VIEW_STATE;
        inner.at_start = true;
        break;
    case 7:
        inner.kind = VIEW_AXES;
        break;
    case 8:
        inner.kind = VIEW_STATES;
        break;
    default:
        return no_field(names, "s", field, "field", known, 9);
    }
    return (struct view_result){.is_view = true, .view = inner};
}

static struct view_result coordinate_field(const struct view_names *names, struct view view,
                                           const char *field) {
    static const char *const paths[] = {"s.q", "s.qd", "s.qdd"};
    int index = text_index(field, names->coordinates, names->coordinate_count);
    if (index < 0)
        return no_field(names, paths[view.order], field, "coordinate", names->coordinates,
                        names->coordinate_count);
    return found(names, &view, expr_symbol(names->declarations->graph, SYMBOL_COORDINATE, index, view.order));
}

static struct view_result points_field(const struct view_names *names, struct view view, const char *field) {
    const struct model *model = names->model;
    const char **known =
        memory_get(names->declarations->memory, ((size_t)model->point_count + 1) * sizeof *known);
    for (int i = 0; i < model->point_count; i++)
        known[i] = model->points[i].name;
    int index = text_index(field, known, model->point_count);
    if (index < 0)
        return no_field(names, "s.points", field, "point", known, model->point_count);
    view.kind = VIEW_POINT;
    view.index = index;
    return (struct view_result){.is_view = true, .view = view};
}

/* A component of a direction, or of its time derivative of the given order. */
static expression direction_symbol(const struct view_names *names, const struct view *view, int marker,
                                   int axis, int order) {
    return found(names, view, expr_symbol(names->declarations->graph, SYMBOL_POINT, 3 * marker + axis, order))
        .expression;
}

static struct vector direction_vector(const struct view_names *names, const struct view *view, int marker,
                                      int order) {
    struct vector v;
    for (int axis = 0; axis < 3; axis++)
        v.at[axis] = direction_symbol(names, view, marker, axis, order);
    return v;
}

static const char on_ground[] = "axes of a point on the ground: they never move; write numbers";

/* w = 1/2 sum of a x a' over the three axes a fixed to `at`, and wd the same with a'': theory, sect. 4.4. */
static struct view_result angular_field(const struct view_names *names, const struct view *view,
                                        const struct attachment *at, int component) {
    struct graph *g = names->declarations->graph;
    struct vector sum = {{0, 0, 0}};
    const int order = 1 + component / 3;
    if (at->link < 0)
        return (struct view_result){.fault = on_ground};
    if (view->at_start && order == 2)
        return no_acceleration();
    for (int axis = 0; axis < 3; axis++) {
        const int marker = markers_direction(names->model, at, vector_unit(axis));
        const struct vector a = direction_vector(names, view, marker, 0),
                            rate = direction_vector(names, view, marker, order);
        sum = vector_add(g, sum, vector_cross(g, a, rate));
    }
    return (struct view_result){.expression = expr_mul(g, expr_number(g, 0.5), sum.at[component % 3])};
}

/* Components of a point or direction. A point also has axes and an angular velocity and acceleration. */
static struct view_result vector_field(const struct view_names *names, struct view view, const char *field) {
    static const char *const known[] = {"x",   "y",    "z",  "xd", "yd", "zd",  "xdd", "ydd",
                                        "zdd", "axes", "wx", "wy", "wz", "wxd", "wyd", "wzd"};
    const int count = view.kind == VIEW_POINT ? 16 : 9, component = text_index(field, known, count);
    if (component < 0) {
        const char *path = memory_format(names->declarations->memory,
                                         view.kind == VIEW_POINT ? "s.points.%s" : "direction %s",
                                         names->model->points[view.index].name);
        return no_field(names, path, field, "field", known, count);
    }
    if (component > 9) {
        const struct attachment at =
            names->model->points[view.index].at; /* a copy, since new directions may move the list */
        return angular_field(names, &view, &at, component - 10);
    }
    if (component == 9) {
        view.kind = VIEW_AXES_OF_POINT;
        return (struct view_result){.is_view = true, .view = view};
    }
    if (view.at_start && component / 3 == 2)
        return no_acceleration();
    return found(
        names, &view,
        expr_symbol(names->declarations->graph, SYMBOL_POINT, 3 * view.index + component % 3, component / 3));
}

/* s.axes: links, and "arm.tip" for the end of a beam. */
static struct view_result axes_field(const struct view_names *names, struct view view, const char *field) {
    struct memory *memory = names->declarations->memory;
    const struct model *model = names->model;
    const char **known = memory_get(memory, (2 * (size_t)model->link_count + 1) * sizeof *known);
    int *links = memory_get(memory, (2 * (size_t)model->link_count + 1) * sizeof *links);
    int count = 0;
    for (int i = 0; i < model->link_count; i++) {
        links[count] = i;
        known[count++] = model->links[i].name;
        if (!model->links[i].beam.exists)
            continue;
        links[count] = i;
        known[count++] = memory_format(memory, "%s.tip", model->links[i].name);
    }
    int index = text_index(field, known, count);
    if (index < 0)
        return no_field(names, "s.axes", field, "link", known, count);
    view.kind = strchr(field, '.') ? VIEW_AXES_OF_TIP : VIEW_AXES_OF_LINK;
    view.index = links[index];
    return (struct view_result){.is_view = true, .view = view};
}

static struct view_result axis_field(const struct view_names *names, struct view view, const char *field) {
    static const char *const known[] = {"x", "y", "z", "wx", "wy", "wz", "wxd", "wyd", "wzd"};
    struct model *model = names->model;
    struct attachment at = markers_ground_attachment();
    const int axis = text_index(field, known, 9);
    if (axis < 0)
        return no_field(names, "s.axes", field, "axis", known, 9);
    if (view.kind == VIEW_AXES_OF_POINT) {
        at = model->points[view.index].at;
    } else {
        at.link = view.index;
        at.where = view.kind == VIEW_AXES_OF_TIP ? AT_TIP : AT_FRAME;
    }
    if (axis >= 3)
        return angular_field(names, &view, &at, axis - 3);
    if (at.link < 0)
        return (struct view_result){.fault = on_ground};
    view.kind = VIEW_DIRECTION;
    view.index = markers_direction(model, &at, vector_unit(axis));
    return (struct view_result){.is_view = true, .view = view};
}

static struct view_result parameter_field(const struct view_names *names, const char *field) {
    const struct declarations *declarations = names->declarations;
    int count = declarations->parameter_count;
    const char **known = memory_get(declarations->memory, ((size_t)count + 1) * sizeof *known);
    for (int i = 0; i < count; i++)
        known[i] = declarations->parameters[i].name;
    int index = text_index(field, known, count);
    if (index < 0 && declarations->lacks_parameters)
        return (struct view_result){.expression = EXPR_ONE};
    if (index < 0)
        return no_field(names, "p", field, "parameter", known, count);
    return (struct view_result){.expression = declarations_parameter_expression(declarations, index)};
}

static struct view_result input_field(const struct view_names *names, struct view view, const char *field) {
    const struct declarations *declarations = names->declarations;
    int count = declarations->input_count;
    const char **known = memory_get(declarations->memory, ((size_t)count + 1) * sizeof *known);
    for (int i = 0; i < count; i++)
        known[i] = declarations->inputs[i].name;
    int index = text_index(field, known, count);
    if (index < 0)
        return no_field(names, "s.inputs", field, "input", known, count);
    return found(names, &view, expr_symbol(declarations->graph, SYMBOL_INPUT, index, 0));
}

int state_symbols_find_state(struct model *model, const char *name, bool adds) {
    for (int i = 0; i < model->state_count; i++)
        if (strcmp(model->states[i].name, name) == 0)
            return i;
    if (!adds)
        return -1;
    model->states = memory_room(model->graph->memory, model->states, model->state_count,
                                &model->state_capacity, sizeof *model->states);
    model->states[model->state_count] = (struct model_state){.name = name};
    return model->state_count++;
}

/* A state is the rate of its frame, and the frames of states follow those of joints. While the author's
 * function declares states, each name is accepted, because rates may read states that follow. */
static struct view_result declared_state_field(const struct view_names *names, struct view view,
                                               const char *field) {
    struct model *model = names->model;
    const char *name = memory_format(names->declarations->memory, "%s", field);
    const int index = state_symbols_find_state(model, name, names->declares_states);
    if (index < 0) {
        const char **known =
            memory_get(names->declarations->memory, ((size_t)model->state_count + 1) * sizeof *known);
        for (int i = 0; i < model->state_count; i++)
            known[i] = model->states[i].name;
        return no_field(names, "s.states", field, "state", known, model->state_count);
    }
    return found(
        names, &view,
        expr_symbol(names->declarations->graph, SYMBOL_COORDINATE, names->coordinate_count + index, 1));
}

struct view_result state_symbols_field(const struct view_names *names, struct view view, const char *field) {
    switch ((enum view_kind)view.kind) {
    case VIEW_PARAMETERS:
        return parameter_field(names, field);
    case VIEW_STATE:
        return state_field(names, view, field);
    case VIEW_COORDINATES:
        return coordinate_field(names, view, field);
    case VIEW_POINTS:
        return points_field(names, view, field);
    case VIEW_POINT:
    case VIEW_DIRECTION:
        return vector_field(names, view, field);
    case VIEW_AXES:
        return axes_field(names, view, field);
    case VIEW_AXES_OF_POINT:
    case VIEW_AXES_OF_LINK:
    case VIEW_AXES_OF_TIP:
        return axis_field(names, view, field);
    case VIEW_STATES:
        return declared_state_field(names, view, field);
    default:
        return input_field(names, view, field);
    }
}

/* ---- kinks of formulas in coordinates and rates ---- */

/*
 * Kinks are the expressions that change sign at the kinks of absolute values, minima, maxima and comparisons
 * in forces, loads, energies and rows, and at the kinks, jumps and poles of events. The steps of a motion end
 * on them, as on events without a name. event_terms.c has kinks in time alone.
 */

enum { MOST_KINKS = 100 }; /* with more of them, their location costs more than small steps */

static void mark_formulas(const struct model *model, bool *marks) {
    for (int i = 0; i < model->force_count; i++)
        marks[model->forces[i].value] = true;
    for (int i = 0; i < model->load_count; i++)
        for (int a = 0; a < 3; a++)
            marks[model->loads[i].value[a]] = true;
    for (int i = 0; i < model->potential_count; i++)
        marks[model->potentials[i].energy] = true;
    for (int i = 0; i < model->row_count; i++)
        marks[model->rows[i].residual] = true;
}

static void mark_events(const struct model *model, bool *marks) {
    for (int i = 0; i < model->event_count; i++)
        marks[model->events[i].value] = true;
}

/* The expression that changes sign at a kink of the node, or in an event at its jump or pole; 0 if the node
 * is smooth or does not depend on coordinates or rates. */
static expression switching_function(struct graph *g, expression e, bool is_of_event) {
    const struct node node = g->nodes[e];
    expression s = 0;
    if (node.operation == OP_ABS || (is_of_event && node.operation == OP_ATAN2))
        s = node.operand[0];
    else if (node.operation == OP_LESS || node.operation == OP_MIN || node.operation == OP_MAX)
        s = expr_sub(g, node.operand[0], node.operand[1]);
    else if (is_of_event && node.operation == OP_DIV)
        s = node.operand[1];
    else if (is_of_event && node.operation == OP_TAN)
        s = expr_apply1(g, OP_COS, node.operand[0]);
    const unsigned depends = s ? g->nodes[s].depends : 0;
    return depends & (ON_STATE | ON_RATE) ? s : 0;
}

/* Adds s unless it, or its negative, is in the list. */
static void list_once(struct model *model, expression s) {
    for (int i = 0; i < model->kink_count; i++)
        if (model->kinks[i] == s || model->kinks[i] == expr_neg(model->graph, s))
            return;
    if (model->kink_count < MOST_KINKS)
        model->kinks[model->kink_count++] = s;
}

void state_kinks_list(struct memory *memory, struct model *model) {
    struct graph *g = model->graph;
    const uint32_t count = g->count; /* without expressions that are built here */
    bool *inside = memory_get(memory, count * sizeof *inside);
    bool *inside_event = memory_get(memory, count * sizeof *inside_event);
    model->kinks = memory_get(memory, MOST_KINKS * sizeof *model->kinks);
    mark_formulas(model, inside);
    mark_events(model, inside_event);
    rewrite_mark_operands(g, inside, count);
    rewrite_mark_operands(g, inside_event, count);
    for (expression e = 0; e < count; e++) {
        const expression s = inside[e] || inside_event[e] ? switching_function(g, e, inside_event[e]) : 0;
        if (s)
            list_once(model, s);
    }
}
