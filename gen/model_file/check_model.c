/*
 * Checks of a whole model: names, and formulas of forces, rows and events.
 *
 * check_scene runs before the tree is built, check_programme when forces and rows are known. The reader has
 * checked numbers against their ranges, field by field.
 */
#include "gen/model_file/reader.h"

#include <math.h>
#include <string.h>

struct check {
    const struct model *model;
    const struct tree *tree;
    struct messages *messages;
};

/* ---- names ---- */

static struct named *new_list(const struct check *check, int count) {
    return memory_get(check->messages->memory, ((size_t)count + 1) * sizeof(struct named));
}

static void refuse_ground(const struct check *check, const char *kind, const struct named *list, int count) {
    for (int i = 0; i < count; i++)
        if (strcmp(list[i].name, "ground") == 0)
            message_error(check->messages, list[i].place,
                          "%s ground: the name of the fixed frame; choose another name", kind);
}

static void check_link_names(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->link_count);
    int count = 0;
    for (int i = 0; i < model->link_count; i++)
        if (*model->links[i].name) /* the reader has reported a missing name */
            list[count++] = (struct named){model->links[i].name, model->links[i].place};
    refuse_ground(check, "link", list, count);
    names_check(check->messages, "link", list, count);
}

static void check_point_names(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->point_count);
    for (int i = 0; i < model->point_count; i++)
        list[i] = (struct named){model->points[i].name, model->points[i].place};
    refuse_ground(check, "point", list, model->point_count);
    names_check(check->messages, "point", list, model->point_count);
}

/* The names of coordinates that links choose. */
static void check_chosen_names(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->link_count);
    int count = 0;
    for (int i = 0; i < model->link_count; i++) {
        const struct joint *joint = model->links[i].joint_count == 1 ? model->links[i].joints : NULL;
        if (joint && joint->coordinate)
            list[count++] = (struct named){joint->coordinate, joint->place};
    }
    names_check(check->messages, "coordinate", list, count);
    for (int i = 0; i < count; i++)
        if (strcmp(list[i].name, "t") == 0)
            message_error(check->messages, list[i].place,
                          "coordinate t: this is the name of the time; choose another name");
}

static void check_options(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->option_count);
    for (int i = 0; i < model->option_count; i++)
        list[i] = (struct named){model->options[i].name, model->options[i].place};
    names_check(check->messages, "option", list, model->option_count);
}

static void check_parameters(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->parameter_count);
    for (int i = 0; i < model->parameter_count; i++) {
        const struct parameter *parameter = &model->parameters[i];
        list[i] = (struct named){parameter->name, parameter->place};
        if (strcmp(parameter->name, "derived") == 0)
            message_error(
                check->messages, parameter->place,
                "parameter derived: the emitted struct of parameters has a member of this name; choose "
                "another name");
    }
    names_check_members(check->messages, "parameter", list, model->parameter_count);
}

static void check_inputs(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->input_count);
    for (int i = 0; i < model->input_count; i++) {
        const struct input *input = &model->inputs[i];
        list[i] = (struct named){input->name, input->place};
        if (!isfinite(input->value))
            message_error(check->messages, input->place, "input %s: value %s; must be finite", input->name,
                          text_not_finite(input->value));
    }
    names_check_members(check->messages, "input", list, model->input_count);
}

/* ---- names of states ---- */

/* The kind of another thing with this name, or NULL. The columns of a motion must have different names. */
static const char *taken_by(const struct check *check, const char *name) {
    static const char *const endings[] = {"", "_d", "_dd"};
    const struct model *model = check->model;
    for (int i = 0; i < model->input_count; i++)
        if (strcmp(model->inputs[i].name, name) == 0)
            return "an input";
    for (int i = 0; i < model->parameter_count; i++)
        if (strcmp(model->parameters[i].name, name) == 0)
            return "a parameter";
    for (int i = 0; i < tree_joint_count(check->tree); i++)
        for (int k = 0; k < 3; k++)
            if (strcmp(
                    memory_format(check->messages->memory, "%s%s", check->tree->frames[i].name, endings[k]),
                    name) == 0)
                return k == 0 ? "a coordinate" : k == 1 ? "the rate of a coordinate" : "an acceleration";
    return strcmp(name, "t") == 0 ? "the time" : strcmp(name, "energy") == 0 ? "the energy" : NULL;
}

static void check_state_names(const struct check *check) {
    const struct model *model = check->model;
    struct named *list = new_list(check, model->state_count);
    for (int i = 0; i < model->state_count; i++) {
        const struct model_state *state = &model->states[i];
        const char *by = taken_by(check, state->name);
        list[i] = (struct named){state->name, state->place};
        if (by)
            message_error(check->messages, state->place,
                          "state %s: the name is already taken by %s; choose another name", state->name, by);
    }
    names_check(check->messages, "state", list, model->state_count);
}

/* ---- lists of coordinates ---- */

static void check_coordinates(const struct check *check, const char *what, struct place place,
                              const char *const *names, int count) {
    const char **known = tree_coordinate_names(check->messages->memory, check->tree);
    for (int i = 0; i < count; i++) {
        if (tree_find_frame(check->tree, names[i]) >= 0 ||
            !message_is_first_mention(check->messages, "coordinate", names[i]))
            continue;
        message_error(check->messages, place, "%s[%d]: unknown coordinate \"%s\"%s", what, i + 1, names[i],
                      message_advice_on_name(check->messages->memory, names[i], known, check->tree->count));
    }
}

/* Rows without those of closed loops, which are partly redundant in a plane mechanism, and without contacts,
 * not all of which rest at once. The runtime examines these. */
static int count_written_rows(const struct model *model) {
    int count = 0;
    for (int i = 0; i < model->row_count; i++)
        count += !model->rows[i].is_closure && !model->rows[i].rests;
    return count;
}

static void check_dependent(const struct check *check) {
    const struct model *model = check->model;
    check_coordinates(check, "dependent", model->dependent_place, model->dependent, model->dependent_count);
    check_coordinates(check, "hold", model->hold_place, model->hold, model->hold_count);
    if (model->dependent_count > 0 && model->dependent_count != model->row_count)
        message_error(check->messages, model->dependent_place,
                      "dependent: number of coordinates is %d; must be that of constraint rows, %d",
                      model->dependent_count, model->row_count);
    for (int i = 0; i < model->dependent_count; i++)
        if (tree_find_state(check->tree, model->dependent[i]) >= 0)
            message_error(check->messages, model->dependent_place,
                          "dependent[%d]: \"%s\" is a state, which no row determines; name a coordinate",
                          i + 1, model->dependent[i]);
    if (count_written_rows(model) > tree_joint_count(check->tree))
        message_error(check->messages, model->place,
                      "constraints: number of rows is %d; must be at most that of coordinates, %d",
                      count_written_rows(model), tree_joint_count(check->tree));
}

/* ---- forces and rows ---- */

/* The symbols in an expression that move, counted by the order of the time derivative. */
struct moving {
    int symbols[3];
    int states; /* continuous states among the rates */
    expression *accelerations;
};

static struct moving moving_of(const struct check *check, expression e) {
    struct moving moving = {{0, 0, 0}, 0, NULL};
    const int joints = tree_joint_count(check->tree);
    int count;
    const expression *symbols = rewrite_list_symbols(check->model->graph, e, &count);
    moving.accelerations = memory_get(check->messages->memory, ((size_t)count + 1) * sizeof *symbols);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(check->model->graph, symbols[i]);
        bool is_point = symbol->kind == SYMBOL_POINT && check->tree->points[symbol->index / 3].frame >= 0;
        if (symbol->kind != SYMBOL_COORDINATE && !is_point)
            continue;
        moving.states += symbol->kind == SYMBOL_COORDINATE && symbol->index >= joints;
        if (symbol->order == 2)
            moving.accelerations[moving.symbols[2]] = symbols[i];
        moving.symbols[symbol->order]++;
    }
    return moving;
}

/* Returns a number in e that is not finite, INFINITY for a division by 0, or 0 if all are finite. */
static double find_not_finite(const struct check *check, expression e) {
    const struct graph *graph = check->model->graph;
    bool *reached = memory_get(check->messages->memory, (size_t)e + 1);
    reached[e] = true;
    for (expression i = e + 1; i-- > 0;) {
        double value;
        if (!reached[i])
            continue;
        if (expr_is_number(graph, i, &value) && !isfinite(value))
            return value;
        if (graph->nodes[i].operation == OP_DIV && graph->nodes[i].operand[1] == EXPR_ZERO)
            return INFINITY;
        int arity = operation_arity((enum operation)graph->nodes[i].operation);
        for (int operand = 0; operand < arity; operand++)
            reached[graph->nodes[i].operand[operand]] = true;
    }
    return 0;
}

/* Checks of all formulas. */
static void check_formula(const struct check *check, struct place place, const char *path, expression e) {
    double value = find_not_finite(check, e);
    if (value != 0)
        message_error(check->messages, place, "%s: contains %s; all numbers must be finite", path,
                      text_not_finite(value));
    if (check->model->graph->nodes[e].depends & ON_START)
        message_error(check->messages, place, "%s: s.start outside a parameter; wrap it in rd.parameter(...)",
                      path);
}

static void refuse_accelerations(const struct check *check, struct place place, const char *path,
                                 const char *noun) {
    message_error(check->messages, place,
                  "%s: depends on accelerations; %s may depend on t, q, qd and inputs only", path, noun);
}

static void check_force(const struct check *check, const struct force *force) {
    const struct frame *frame = &check->tree->frames[force->coordinate];
    const char *path =
        frame->is_state
            ? memory_format(check->messages->memory, "%s.rate",
                            check->model->states[force->coordinate - tree_joint_count(check->tree)].path)
            : memory_format(check->messages->memory, "forces.%s", frame->name);
    check_formula(check, force->place, path, force->value);
    if (moving_of(check, force->value).symbols[2] > 0)
        refuse_accelerations(check, force->place, path, frame->is_state ? "a rate" : "a force");
}

static void check_load(const struct check *check, const struct load *load) {
    for (int i = 0; i < 3; i++) {
        check_formula(check, load->place, load->path, load->value[i]);
        if (moving_of(check, load->value[i]).symbols[2] > 0)
            refuse_accelerations(check, load->place, load->path, "a force");
    }
}

/* A potential energy depends on the configuration alone. */
static void check_potential(const struct check *check, const struct potential *potential) {
    const struct moving moving = moving_of(check, potential->energy);
    const unsigned depends = check->model->graph->nodes[potential->energy].depends;
    check_formula(check, potential->place, potential->path, potential->energy);
    if (moving.symbols[1] > 0 || moving.symbols[2] > 0 || (depends & (ON_TIME | ON_INPUT)))
        message_error(check->messages, potential->place,
                      "%s: an energy may depend on coordinates and positions only; write such forces as "
                      "rd.force or forces on coordinates",
                      potential->path);
}

/* The name is that of a column of a motion, which other programs must be able to read. */
static void check_course_name(const struct check *check, const struct course *course, const char *path) {
    const size_t length = strlen(course->name);
    if (length == 0)
        message_error(check->messages, course->place, "courses: an empty name; name the column");
    else if (course->name[0] == ' ' || course->name[length - 1] == ' ')
        message_error(check->messages, course->place,
                      "courses.'%s': the name begins or ends with a blank, which programs drop; remove it",
                      course->name);
    if (strchr(course->name, ','))
        message_error(check->messages, course->place,
                      "%s: the name contains a comma, which separates columns; remove it", path);
}

/* A course of the author, or the value of a limit. */
static const char *field_of_course(const struct check *check, const struct course *course) {
    for (int i = 0; i < check->model->bound_count; i++)
        if (check->model->bounds[i].is_course && check->model->bounds[i].name == course->name)
            return "limits";
    return "courses";
}

static void check_course(const struct check *check, const struct course *course) {
    const char *path =
        memory_format(check->messages->memory, "%s.%s", field_of_course(check, course), course->name);
    check_course_name(check, course, path);
    check_formula(check, course->place, path, course->value);
    if (moving_of(check, course->value).symbols[2] > 0)
        refuse_accelerations(check, course->place, path, "a value that is recorded");
    for (int i = 0; i < check->model->input_count; i++)
        if (strcmp(check->model->inputs[i].name, course->name) == 0)
            message_error(check->messages, course->place,
                          "%s: the name is already taken by an input; choose another name", path);
    if (tree_find_state(check->tree, course->name) >= 0)
        message_error(check->messages, course->place,
                      "%s: the name is already taken by a state; choose another name", path);
}

/* Whether the column is of a coordinate: its value, rate, acceleration or programme force. */
static bool is_of_coordinate(const struct check *check, const char *name) {
    static const char *const endings[] = {"", "_d", "_dd"};
    for (int i = 0; i < tree_joint_count(check->tree); i++) {
        const char *coordinate = check->tree->frames[i].name;
        const size_t length = strlen(coordinate);
        if (strncmp(name, "force_", 6) == 0 && strcmp(name + 6, coordinate) == 0)
            return true;
        for (int k = 0; k < 3 && strncmp(name, coordinate, length) == 0; k++)
            if (strcmp(name + length, endings[k]) == 0)
                return true;
    }
    return false;
}

static bool is_of_point(const struct check *check, const char *name) {
    static const char *const endings[] = {"_x", "_y", "_z", "_xd", "_yd", "_zd", "_xdd", "_ydd", "_zdd"};
    for (int i = 0; i < check->model->point_count; i++) {
        const size_t length = strlen(check->model->points[i].name);
        for (int k = 0; k < 9 && strncmp(name, check->model->points[i].name, length) == 0; k++)
            if (strcmp(name + length, endings[k]) == 0)
                return true;
    }
    return false;
}

/* The time, the energy and the residuals of rows. */
static bool is_of_motion(const char *name) {
    const bool is_residual = strncmp(name, "phi_", 4) == 0 || strncmp(name, "psi_", 4) == 0;
    return strcmp(name, "t") == 0 || strcmp(name, "energy") == 0 ||
           (is_residual && name[4] && !name[4 + strspn(name + 4, "0123456789")]);
}

static void check_bound(const struct check *check, const struct bound *bound) {
    const struct model *model = check->model;
    bool is_known = is_of_coordinate(check, bound->column) || is_of_point(check, bound->column) ||
                    tree_find_state(check->tree, bound->column) >= 0;
    for (int i = 0; i < model->course_count; i++)
        is_known = is_known || strcmp(model->courses[i].name, bound->column) == 0;
    for (int i = 0; i < model->input_count; i++)
        is_known = is_known || strcmp(model->inputs[i].name, bound->column) == 0;
    if (bound->is_course && (is_of_coordinate(check, bound->name) || is_of_point(check, bound->name) ||
                             is_of_motion(bound->name)))
        message_error(check->messages, bound->place,
                      "limits.%s: a column of the motion has this name; give its bounds by column, or choose "
                      "another name",
                      bound->name);
    if (!is_known)
        message_error(check->messages, bound->place,
                      "limits.%s: a motion has no column \"%s\" of a coordinate, point, course or input",
                      bound->name, bound->column);
}

static void check_linear(const struct check *check, const struct row *row, const char *path,
                         const struct moving *moving) {
    int count = moving->symbols[2];
    expression *slopes = memory_get(check->messages->memory, (size_t)count * sizeof *slopes);
    rewrite_gradient(check->model->graph, row->residual, moving->accelerations, slopes, count);
    for (int i = 0; i < count; i++) {
        if (moving_of(check, slopes[i]).symbols[2] == 0)
            continue;
        message_error(check->messages, row->place,
                      "%s: not linear in the accelerations; must be of the form a qdd + b", path);
        return;
    }
}

/* Reports a row without symbols of its own level. */
static void refuse_still(const struct check *check, const struct row *row, const struct moving *moving) {
    static const char *const needed[] = {"a coordinate or the position of a moving point",
                                         "a rate or the velocity of a moving point, as s.points.tip.zd",
                                         "an acceleration, as s.qdd.arm_psi or s.points.tip.zdd"};
    const char *has = "no coordinate", *other = "";
    if (row->level == ROW_ACCELERATION && moving->symbols[1] > 0) {
        has = "velocities, but on no acceleration";
        other = "; rd.velocity keeps a velocity";
    } else if (moving->symbols[0] > 0) {
        has = row->level == ROW_VELOCITY ? "positions, but on no velocity"
                                         : "positions, but on no acceleration";
        other = "; rd.position keeps a position";
    }
    message_error(check->messages, row->place, "%s: depends on %s; must contain %s%s", row->path, has,
                  needed[row->level], other);
}

static void check_row(const struct check *check, const struct row *row) {
    const char *path = row->path;
    struct moving moving = moving_of(check, row->residual);
    check_formula(check, row->place, path, row->residual);
    if (moving.states > 0)
        message_error(check->messages, row->place,
                      "%s: depends on a state; rows may depend on t, coordinates, points and inputs only",
                      path);
    else if (row->level == ROW_POSITION && moving.symbols[1] > 0)
        message_error(check->messages, row->place, "%s: depends on velocities; use rd.velocity", path);
    else if (row->level != ROW_ACCELERATION && moving.symbols[2] > 0)
        message_error(check->messages, row->place, "%s: depends on accelerations; use rd.acceleration", path);
    else if (moving.symbols[row->level] > 0 && row->level == ROW_ACCELERATION)
        check_linear(check, row, path, &moving);
    else if (moving.symbols[row->level] == 0 && message_is_first_mention(check->messages, "still", path))
        refuse_still(check, row, &moving); /* once for all rows of one entry */
}

static void check_row_names(const struct check *check) {
    const struct model *model = check->model;
    for (int i = 0; i < model->row_count; i++) {
        int first = 0;
        while (strcmp(model->rows[first].name, model->rows[i].name) != 0)
            first++;
        if (first < i)
            message_error(check->messages, model->rows[i].place,
                          "%s.name: \"%s\" is already taken in line %d; choose another name",
                          model->rows[i].path, model->rows[i].name, model->rows[first].place.line);
    }
}

/* ---- events ---- */

static bool depends_on_accelerations(const struct check *check, expression e) {
    return moving_of(check, e).symbols[2] > 0;
}

/* The impulse acts along the gradient of the expression that is zero at the impact. */
static void check_impact(const struct check *check, const struct event *event) {
    const struct moving moving = moving_of(check, event->value);
    if (moving.symbols[1] > 0)
        message_error(check->messages, event->place,
                      "%s: depends on %s; an impact needs an expression in positions only", event->path,
                      moving.states > 0 ? "a state" : "velocities");
    else if (moving.symbols[0] == 0)
        message_error(check->messages, event->place,
                      "%s: depends on no coordinate; an impact needs an expression in positions",
                      event->path);
}

static void check_event(const struct check *check, const struct event *event) {
    check_formula(check, event->place, event->path, event->value);
    if (depends_on_accelerations(check, event->value))
        refuse_accelerations(check, event->place, event->path, "an event");
    else if (event->is_impact || event->contact >= 0)
        check_impact(check, event);
    else if (!(check->model->graph->nodes[event->value].depends & (ON_TIME | ON_INPUT | ON_STATE | ON_RATE)))
        message_error(check->messages, event->place,
                      "%s: constant; must depend on time, coordinates, rates or inputs", event->path);
}

static void check_change(const struct check *check, const struct change *change) {
    check_formula(check, change->place, change->path, change->value);
    if (depends_on_accelerations(check, change->value))
        refuse_accelerations(check, change->place, change->path, "a value set by an event");
}

static void check_events(const struct check *check) {
    const struct model *model = check->model;
    for (int i = 0; i < model->event_count; i++) {
        int first = 0;
        while (strcmp(model->events[first].name, model->events[i].name) != 0)
            first++;
        if (first < i)
            message_error(check->messages, model->events[i].place,
                          "%s.name: \"%s\" is already taken in line %d; choose another name",
                          model->events[i].path, model->events[i].name, model->events[first].place.line);
        check_event(check, &model->events[i]);
    }
    for (int i = 0; i < model->change_count; i++)
        check_change(check, &model->changes[i]);
}

void check_scene(const struct model *model, struct messages *messages) {
    const struct check check = {.model = model, .messages = messages};
    if (*model->name && !model->is_renamed) /* else the reader has reported it, or the caller checked it */
        names_check_model(messages, (struct named){model->name, model->place});
    check_options(&check);
    check_parameters(&check);
    check_inputs(&check);
    check_link_names(&check);
    check_point_names(&check);
    check_chosen_names(&check);
}

static bool is_rate_of(const char *name, const char *coordinate) {
    const size_t length = strlen(coordinate);
    return strncmp(name, coordinate, length) == 0 && strcmp(name + length, "_d") == 0;
}

/* Compares the names that links choose with the other names of coordinates and of their rates. */
static void check_coordinate_names(const struct check *check) {
    const int joints = tree_joint_count(check->tree);
    for (int i = 0; i < joints; i++) {
        const struct joint *joint = &check->tree->frames[i].joint;
        for (int k = 0; joint->coordinate && k < joints; k++) {
            const char *other = check->tree->frames[k].name;
            if (!check->tree->frames[k].joint.coordinate && strcmp(joint->coordinate, other) == 0)
                message_error(check->messages, joint->place,
                              "coordinate %s: another coordinate has this name; choose another name", other);
            else if (is_rate_of(joint->coordinate, other) || is_rate_of(other, joint->coordinate))
                message_error(
                    check->messages, joint->place,
                    "coordinate %s: differs from coordinate %s by _d, which marks rates; choose another name",
                    joint->coordinate, other);
        }
    }
}

/* The columns POINT_x ... of a motion and those of slides, LINK_x ..., must differ. */
static void warn_of_columns(const struct check *check) {
    static const char *const axes[] = {"x", "y", "z"};
    for (int i = 0; i < check->model->point_count; i++)
        for (int axis = 0; axis < 3; axis++) {
            const struct point *point = &check->model->points[i];
            const char *column = memory_format(check->messages->memory, "%s_%s", point->name, axes[axis]);
            if (tree_find_coordinate(check->tree, column) >= 0)
                message_warning(
                    check->messages, point->place,
                    "points.%s: a coordinate is called %s; the columns of the point will be called "
                    "point_%s ...",
                    point->name, column, column);
        }
}

void check_programme(const struct model *model, const struct tree *tree, struct messages *messages) {
    const struct check check = {.model = model, .tree = tree, .messages = messages};
    if (tree_joint_count(tree) == 0) {
        message_error(messages, model->place,
                      "links: no link has a joint; a model needs at least one coordinate");
        return;
    }
    check_coordinate_names(&check);
    check_state_names(&check);
    check_parameters(&check); /* the author's functions may have declared more */
    check_inputs(&check);
    for (int i = 0; i < model->force_count; i++)
        check_force(&check, &model->forces[i]);
    for (int i = 0; i < model->load_count; i++)
        check_load(&check, &model->loads[i]);
    for (int i = 0; i < model->potential_count; i++)
        check_potential(&check, &model->potentials[i]);
    for (int i = 0; i < model->course_count; i++)
        check_course(&check, &model->courses[i]);
    for (int i = 0; i < model->bound_count; i++)
        check_bound(&check, &model->bounds[i]);
    for (int i = 0; i < model->row_count; i++)
        if (!model->rows[i].rests) /* the row of a contact is checked with its event */
            check_row(&check, &model->rows[i]);
    check_events(&check);
    warn_of_columns(&check);
    check_row_names(&check);
    check_dependent(&check);
    warnings_of_values(model, tree, messages);
}
