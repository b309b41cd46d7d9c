/* Names to symbols: see reader.h. */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <string.h>

static struct view_result no_field(const struct view_names *names, const char *path, const char *field,
                                   const char *kind, const char *const *known, int count) {
    const char *nearest = message_nearest_name(field, known, count);
    struct memory *memory = names->declarations->memory;
    const char *list = "";
    for (int i = 0; i < count && i < 20; i++)
        list = memory_format(memory, "%s %s", list, known[i]);
    const char *fault = nearest ? memory_format(memory, "%s.%s: unknown %s, the nearest known one is \"%s\"",
                                                path, field, kind, nearest)
                                : memory_format(memory, "%s.%s: unknown %s, known:%s", path, field, kind,
                                                count > 0 ? list : " none");
    const bool is_told = !message_is_first_mention(names->declarations->messages, kind, field);
    return (struct view_result){.fault = fault, .is_told = is_told};
}

static struct view_result no_acceleration(void) {
    return (struct view_result){.fault = "s.start: has no accelerations, the state at the start is q and qd"};
}

static struct view_result found(const struct view_names *names, const struct view *view, expression e) {
    if (view->at_start)
        e = expr_symbol(names->declarations->graph, SYMBOL_START, (int)e, 0);
    return (struct view_result){.expression = e};
}

static struct view_result state_field(const struct view_names *names, struct view view, const char *field) {
    static const char *const known[] = {"t", "q", "qd", "qdd", "points", "inputs", "start", "axes"};
    struct view inner = {.at_start = view.at_start};
    switch (text_index(field, known, 8)) {
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
    default:
        return no_field(names, "s", field, "field", known, 8);
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

/* A component of a direction or its rate of that order. */
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

static const char on_ground[] = "axes of a point on the ground: they never move, numbers do";

/* w = 1/2 sum of a x a' over the three axes a that are fixed to `at`, wd the same with a'': theory, sect.
 * 4.4. */
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
        const int marker = markers_direction(names->model, at, vector_unit(g, axis));
        const struct vector a = direction_vector(names, view, marker, 0),
                            rate = direction_vector(names, view, marker, order);
        sum = vector_add(g, sum, vector_cross(g, a, rate));
    }
    return (struct view_result){.expression = expr_mul(g, expr_number(g, 0.5), sum.at[component % 3])};
}

/* Components of a point or direction; a point has axes, and what turns them, beside them. */
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
        const struct attachment at = names->model->points[view.index].at; /* directions may move the list */
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
    view.index = markers_direction(model, &at, vector_unit(names->declarations->graph, axis));
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
        return (struct view_result){.expression = expr_one(declarations->graph)};
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

struct view_result state_symbols_field(const struct view_names *names, struct view view, const char *field) {
    switch (view.kind) {
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
    default:
        return input_field(names, view, field);
    }
}
