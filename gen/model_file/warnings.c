/*
 * Warnings about a model without errors: rows without a slope, values that look like millimetres or degrees,
 * coordinates without inertia or load, limits of force that ignore a drive, inputs that nothing reads.
 */
#include "gen/model_file/reader.h"

#include <math.h>
#include <string.h>

/*
 * ---- bounds of the values of expressions ----
 *
 * Coordinates, points, inputs and time are unbounded, parameters have their values. The bounds of an
 * operation follow from those of its operands by interval arithmetic (Moore, Kearfott and Cloud, Introduction
 * to Interval Analysis, 2009), so that they are never too narrow.
 */

struct bounds {
    double least, most;
};

static const struct bounds unbounded = {-INFINITY, INFINITY};

static struct bounds between(double least, double most) {
    return isnan(least) || isnan(most) ? unbounded : (struct bounds){least, most};
}

/* Here 0 times infinity is 0, since no value is infinite. */
static double times(double a, double b) {
    return a == 0 || b == 0 ? 0 : a * b;
}

static struct bounds bounds_of_product(struct bounds a, struct bounds b) {
    const double p = times(a.least, b.least), q = times(a.least, b.most), r = times(a.most, b.least),
                 s = times(a.most, b.most);
    return between(fmin(fmin(p, q), fmin(r, s)), fmax(fmax(p, q), fmax(r, s)));
}

static struct bounds size(struct bounds a) {
    const double least = fabs(a.least), most = fabs(a.most);
    return between(a.least <= 0 && a.most >= 0 ? 0 : fmin(least, most), fmax(least, most));
}

static struct bounds quotient(struct bounds a, struct bounds b) {
    if (b.least <= 0 && b.most >= 0)
        return a.least >= 0 && b.least >= 0 ? between(0, INFINITY) : unbounded;
    return bounds_of_product(a, between(1 / b.most, 1 / b.least));
}

static struct bounds hull(struct bounds a, struct bounds b) {
    return between(fmin(a.least, b.least), fmax(a.most, b.most));
}

/* Bounds of a function that rises with its operand. */
static struct bounds rising(double function(double), struct bounds a) {
    return between(function(a.least), function(a.most));
}

static struct bounds bounds_of_power(const struct graph *g, const struct node *node,
                                     const struct bounds *bounds) {
    double exponent;
    const bool is_even =
        expr_is_number(g, node->operand[1], &exponent) && fmod(exponent, 2) == 0 && exponent > 0;
    const struct bounds a = size(bounds[node->operand[0]]);
    if (is_even)
        return between(pow(a.least, exponent), pow(a.most, exponent));
    return bounds[node->operand[0]].least >= 0 ? between(0, INFINITY) : unbounded;
}

static struct bounds bounds_of_node(const struct graph *g, expression e, const struct bounds *bounds) {
    const struct node *node = &g->nodes[e];
    if (node->operation == OP_SPLINE)
        return unbounded;
    const struct bounds a = bounds[node->operand[0]], b = bounds[node->operand[1]];
    switch ((enum operation)node->operation) {
    case OP_ADD:
        return between(a.least + b.least, a.most + b.most);
    case OP_SUB:
        return between(a.least - b.most, a.most - b.least);
    case OP_NEG:
        return between(-a.most, -a.least);
    case OP_MUL:
        return node->operand[0] == node->operand[1] ? bounds_of_product(size(a), size(a))
                                                    : bounds_of_product(a, b);
    case OP_DIV:
        return quotient(a, b);
    case OP_HOLD:
        return a;
    case OP_SIN:
    case OP_COS:
        return between(-1, 1);
    case OP_TANH:
        return rising(tanh, a);
    case OP_ATAN:
        return rising(atan, a);
    case OP_EXP:
        return rising(exp, a);
    case OP_COSH:
        return rising(cosh, size(a));
    case OP_SQRT:
        return between(sqrt(fmax(a.least, 0)), sqrt(fmax(a.most, 0)));
    case OP_ABS:
        return size(a);
    case OP_MIN:
        return between(fmin(a.least, b.least), fmin(a.most, b.most));
    case OP_MAX:
        return between(fmax(a.least, b.least), fmax(a.most, b.most));
    case OP_LESS:
        return between(0, 1);
    case OP_WHERE:
        return hull(b, bounds[node->operand[2]]);
    case OP_POW:
        return bounds_of_power(g, node, bounds);
    default:
        return unbounded;
    }
}

/* Whether e is a number, or a parameter whose value is known before the motion starts. */
static bool is_known(const struct graph *g, const struct parameter *parameters, expression e, double *value) {
    const struct symbol *symbol = expr_as_symbol(g, e);
    if (!symbol || symbol->kind != SYMBOL_PARAMETER)
        return expr_is_number(g, e, value);
    const struct parameter *parameter = &parameters[symbol->index];
    *value = parameter->value;
    return parameter->is_given || !parameter->is_anchored;
}

/* Bounds of all values of the graph so far, by handle, in the scratch of its memory. */
static struct bounds *bounds_of_values(const struct graph *g, const struct parameter *parameters) {
    struct bounds *bounds = memory_scratch(g->memory, g->count * sizeof *bounds);
    for (expression e = 0; e < g->count; e++) {
        double value;
        if (is_known(g, parameters, e, &value))
            bounds[e] = between(value, value);
        else
            bounds[e] = expr_as_symbol(g, e) ? unbounded : bounds_of_node(g, e, bounds);
    }
    return bounds;
}

/*
 * ---- rows without a slope where they are zero ----
 *
 * Squares, absolute values and their sums are such rows. They constrain nothing, since the force of a row
 * acts along its gradient.
 */

/* The base of e if e is a power, otherwise e, without sign and constant factors; `power` is the exponent. */
static expression base_of_power(const struct graph *g, expression e, int *power) {
    const struct node *node = &g->nodes[e];
    const bool is_product = node->operation == OP_MUL;
    *power = 1;
    if (node->operation == OP_NEG || (is_product && expr_is_number(g, node->operand[1], NULL)))
        return base_of_power(g, node->operand[0], power);
    if (is_product && expr_is_number(g, node->operand[0], NULL))
        return base_of_power(g, node->operand[1], power);
    if (!is_product)
        return e;
    int powers[2];
    const expression left = base_of_power(g, node->operand[0], &powers[0]),
                     right = base_of_power(g, node->operand[1], &powers[1]);
    if (left != right)
        return e;
    *power = powers[0] + powers[1];
    return left;
}

static void check_slope(const struct reader *reader, const struct row *row, struct bounds bounds) {
    struct messages *messages = reader->check.messages;
    int power;
    base_of_power(reader->check.graph, row->residual, &power);
    if (bounds.least > 0 || bounds.most < 0)
        message_warning(messages, row->place,
                        "%s: its residual is %s %.6g and never 0; subtract the intended value", row->path,
                        bounds.least > 0 ? "at least" : "at most",
                        bounds.least > 0 ? bounds.least : bounds.most);
    else if (power > 1)
        message_warning(messages, row->place,
                        "%s: its residual is a power, which has no slope at 0 and so constrains nothing; "
                        "write its base",
                        row->path);
    else if ((bounds.least == 0) != (bounds.most == 0))
        message_warning(messages, row->place,
                        "%s: its residual is never %s 0, so that it has no slope at 0 and constrains "
                        "nothing; write a row "
                        "for each term, without squares, abs or less",
                        row->path, bounds.least == 0 ? "below" : "above");
}

void read_check_slopes(const struct reader *reader) {
    const struct model *model = reader->model;
    const struct memory_mark mark = memory_mark(reader->check.memory);
    const struct bounds *bounds =
        bounds_of_values(reader->check.graph, reader->check.declarations->parameters);
    for (int i = 0; i < model->row_count; i++)
        if (!model->rows[i].is_closure && !model->rows[i].rests && model->rows[i].level != ROW_ACCELERATION &&
            reader->check.graph->nodes[model->rows[i].residual].depends & (ON_STATE | ON_RATE))
            check_slope(reader, &model->rows[i], bounds[model->rows[i].residual]);
    memory_back(reader->check.memory, mark);
}

struct look {
    const struct model *model;
    const struct tree *tree;
    struct messages *messages;
};

static double value_of(const struct look *look, expression e) {
    return parameters_evaluate(look->model->graph, look->model->parameters, e);
}

static double largest_of(const struct look *look, const expression *list, int count) {
    double largest = 0;
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(value_of(look, list[i])));
    return largest;
}

/* ---- units ---- */

static void check_segment(const struct look *look, const struct link *link, const struct segment *segment,
                          double beam_length) {
    const double E = value_of(look, segment->E), rho = value_of(look, segment->rho);
    const double I = fmax(value_of(look, segment->Iy), value_of(look, segment->Iz));
    const double thickness = sqrt(12 * I / value_of(look, segment->area));
    if (E < 1e6)
        message_warning(look->messages, link->place,
                        "link %s: beam: E = %.6g Pa, very small; if it is in MPa or GPa, convert it to Pa",
                        link->name, E);
    if (rho < 20)
        message_warning(
            look->messages, link->place,
            "link %s: beam: rho = %.6g kg/m^3, very small; if it is in g/cm^3, convert it to kg/m^3",
            link->name, rho);
    if (thickness > beam_length / 3)
        message_warning(look->messages, link->place,
                        "link %s: beam: a section %.3g m thick on a length of %.3g m is not a slender beam; "
                        "if it is in mm, "
                        "convert it to m",
                        link->name, thickness, beam_length);
}

static void check_spring(const struct look *look, const struct link *link, const struct joint *joint) {
    const double stiffness = value_of(look, joint->stiffness);
    const char *unit = joint->is_revolute ? "N m" : "N/m";
    if (stiffness < 0)
        message_warning(look->messages, joint->place,
                        "link %s: spring: %s = %.6g %s pushes away from its rest; to pull back write %.6g %s",
                        link->name, joint->name, stiffness, unit, -stiffness, unit);
    if (joint->is_revolute && fabs(value_of(look, joint->rest)) > 6.3)
        message_warning(look->messages, joint->place,
                        "link %s: rest: %s = %.6g rad; if it is in degrees, multiply by rd.pi / 180",
                        link->name, joint->name, value_of(look, joint->rest));
}

static void check_link(const struct look *look, const struct link *link) {
    const double far = largest_of(look, link->on.placement.position, 3);
    const struct attachment *on = &link->on;
    double length = 0;
    if (on->link >= 0 && on->where == AT_FRAME && look->model->links[on->link].beam.exists && far == 0)
        message_warning(look->messages, link->place,
                        "link %s: on: \"%s\" is the root of the beam; for its end write \"%s.tip\"",
                        link->name, look->model->links[on->link].name, look->model->links[on->link].name);
    if (far > 100)
        message_warning(look->messages, link->place,
                        "link %s: at: %.6g m from its carrier; if it is in mm, convert it to m", link->name,
                        far);
    for (int i = 0; i < link->joint_count; i++) {
        const double start = value_of(look, link->joints[i].start);
        check_spring(look, link, &link->joints[i]);
        if (link->joints[i].is_revolute && fabs(start) > 6.3)
            message_warning(look->messages, link->joints[i].place,
                            "link %s: start: %s = %.6g rad; if it is in degrees, multiply by rd.pi / 180",
                            link->name, link->joints[i].name, start);
    }
    for (int i = 0; i < link->beam.segment_count; i++)
        length += value_of(look, link->beam.segments[i].length);
    if (length > 100)
        message_warning(look->messages, link->place,
                        "link %s: beam: %.6g m long; if it is in mm, convert it to m", link->name, length);
    for (int i = 0; i < link->beam.segment_count; i++)
        check_segment(look, link, &link->beam.segments[i], length);
}

/* ---- inertia and gravity, with plain numbers in two positions: the start and one near it ---- */

/* The bodies that move with a coordinate, in the ground frame about its origin: m, m c, int r r^T dm. */
struct load_of_mass {
    double mass, moment[3], second[9];
};

struct pose {
    double rotation[9], position[3];
};

static void product(const double a[9], const double b[9], double c[9]) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

static void joint_rotation(int axis, double angle, double R[9]) {
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    memset(R, 0, 9 * sizeof *R);
    R[4 * axis] = 1;
    R[4 * j] = R[4 * k] = cos(angle);
    R[3 * k + j] = sin(angle);
    R[3 * j + k] = -sin(angle);
}

/* Returns the pose of the frame after its joint, and in `base` the pose before it. */
static struct pose place_frame(const struct look *look, const struct frame *frame, const struct pose *parent,
                               double q, struct pose *base) {
    double placed[9], R[9];
    for (int i = 0; i < 9; i++)
        placed[i] = value_of(look, frame->placement.rotation[i]);
    product(parent->rotation, placed, base->rotation);
    for (int i = 0; i < 3; i++) {
        base->position[i] = parent->position[i];
        for (int j = 0; j < 3; j++)
            base->position[i] += parent->rotation[3 * i + j] * value_of(look, frame->placement.position[j]);
    }
    struct pose pose = *base;
    if (frame->joint.is_revolute) {
        joint_rotation(frame->joint.axis, q, R);
        product(base->rotation, R, pose.rotation);
    } else {
        for (int i = 0; i < 3; i++)
            pose.position[i] += q * base->rotation[3 * i + frame->joint.axis];
    }
    return pose;
}

/* int r r^T dm of a body: from the tensor xx yy zz xy xz yz about its frame's origin, then moved to the
 * ground. */
static struct load_of_mass mass_in_ground(const struct look *look, const struct inertia *inertia,
                                          const struct pose *pose) {
    static const int products[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    struct load_of_mass load = {.mass = value_of(look, inertia->mass)};
    double J[6], own[9], turned[9], transposed[9], c[3] = {0, 0, 0};
    for (int i = 0; i < 6; i++)
        J[i] = value_of(look, inertia->tensor.at[i]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            own[3 * i + j] = i == j ? (J[0] + J[1] + J[2]) / 2 - J[i] : -J[products[i][j]];
            transposed[3 * j + i] = pose->rotation[3 * i + j];
            c[i] += pose->rotation[3 * i + j] * value_of(look, inertia->moment.at[j]);
        }
    product(pose->rotation, own, turned);
    product(turned, transposed, load.second);
    const double *p = pose->position;
    for (int i = 0; i < 3; i++) {
        load.moment[i] = c[i] + load.mass * p[i];
        for (int j = 0; j < 3; j++)
            load.second[3 * i + j] += p[i] * c[j] + c[i] * p[j] + load.mass * p[i] * p[j];
    }
    return load;
}

/* M_ii and the generalized force of gravity of one coordinate; 0 if they are of the size of rounding. */
static void weigh_coordinate(const struct look *look, const struct joint *joint, const struct pose *base,
                             const struct load_of_mass *load, double *inertia, double *pull) {
    double e[3], arm[3], g[3], about = 0, scale = 0;
    for (int i = 0; i < 3; i++) {
        e[i] = base->rotation[3 * i + joint->axis];
        arm[i] = load->moment[i] - load->mass * base->position[i];
        g[i] = value_of(look, look->model->gravity[i]);
    }
    const double *p = base->position;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) { /* int |r - p|^2 dm - int (e.(r - p))^2 dm */
            const double second = load->second[3 * i + j] - p[i] * load->moment[j] - load->moment[i] * p[j] +
                                  load->mass * p[i] * p[j];
            about += (i == j ? second : 0) - e[i] * e[j] * second;
            scale += fabs(load->second[3 * i + j]) + load->mass * p[i] * p[i];
        }
    const double field = fabs(g[0]) + fabs(g[1]) + fabs(g[2]);
    double force = 0;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        force += joint->is_revolute ? g[i] * (e[j] * arm[k] - e[k] * arm[j]) : g[i] * e[i] * load->mass;
    }
    const double reach = joint->is_revolute ? sqrt(load->mass * scale) : load->mass;
    *inertia = fmax(*inertia, !joint->is_revolute ? load->mass : about > 1e-12 * scale ? about : 0);
    *pull = fmax(*pull, fabs(force) > 1e-9 * field * reach ? fabs(force) : 0);
}

/* Adds inertia and pull of gravity of all coordinates in a position `shift` [m, rad] from the start. */
static void weigh_position(const struct look *look, double shift, double *inertia, double *pull) {
    const struct pose ground = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    struct memory *memory = look->messages->memory;
    const int n = look->tree->count;
    struct pose *poses = memory_get(memory, ((size_t)n + 1) * sizeof *poses);
    struct pose *bases = memory_get(memory, ((size_t)n + 1) * sizeof *bases);
    struct load_of_mass *loads = memory_get(memory, ((size_t)n + 1) * sizeof *loads);
    for (int i = 0; i < n; i++) {
        const struct frame *frame = &look->tree->frames[i];
        const double q = value_of(look, frame->joint.start) + shift * (1 + 0.1 * (i % 7));
        poses[i] =
            place_frame(look, frame, frame->parent < 0 ? &ground : &poses[frame->parent], q, &bases[i]);
        loads[i] = mass_in_ground(look, &frame->inertia, &poses[i]);
    }
    for (int i = n - 1; i >= 0; i--) {
        const int parent = look->tree->frames[i].parent;
        weigh_coordinate(look, &look->tree->frames[i].joint, &bases[i], &loads[i], &inertia[i], &pull[i]);
        if (parent < 0)
            continue;
        loads[parent].mass += loads[i].mass;
        for (int k = 0; k < 3; k++)
            loads[parent].moment[k] += loads[i].moment[k];
        for (int k = 0; k < 9; k++)
            loads[parent].second[k] += loads[i].second[k];
    }
}

/* ---- loads on a coordinate ---- */

static void act_on_marker(const struct look *look, int marker, bool *acts) {
    for (int i = look->tree->points[marker].frame; i >= 0; i = look->tree->frames[i].parent)
        acts[i] = true;
}

static void act_on_formula(const struct look *look, expression e, bool *acts) {
    int count;
    const expression *symbols = rewrite_list_symbols(look->model->graph, e, &count);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(look->model->graph, symbols[i]);
        if (symbol->kind == SYMBOL_COORDINATE)
            acts[symbol->index] = true;
        else if (symbol->kind == SYMBOL_POINT)
            act_on_marker(look, symbol->index / 3, acts);
    }
}

/* Whether a spring, damper, initial rate, force, load, energy or row acts, by coordinate. */
static bool *acted_on(const struct look *look) {
    const struct model *model = look->model;
    bool *acts = memory_get(look->messages->memory, ((size_t)look->tree->count + 1) * sizeof *acts);
    for (int i = 0; i < look->tree->count; i++) {
        const struct joint *joint = &look->tree->frames[i].joint;
        acts[i] = joint->stiffness || joint->damping || joint->start_rate;
    }
    for (int i = 0; i < model->force_count; i++)
        acts[model->forces[i].coordinate] = true;
    for (int i = 0; i < model->load_count; i++)
        act_on_marker(look, model->loads[i].point, acts);
    for (int i = 0; i < model->potential_count; i++)
        act_on_formula(look, model->potentials[i].energy, acts);
    for (int i = 0; i < model->row_count; i++)
        act_on_formula(look, model->rows[i].residual, acts);
    return acts;
}

/* A body with six coordinates may float freely. */
static bool floats(const struct look *look, const struct frame *frame) {
    return look->model->links[frame->link].joint_count == 6;
}

static void check_coordinates(const struct look *look) {
    const int n = look->tree->count;
    double *inertia = memory_get(look->messages->memory, ((size_t)n + 1) * sizeof *inertia);
    double *pull = memory_get(look->messages->memory, ((size_t)n + 1) * sizeof *pull);
    const bool *acts = acted_on(look);
    weigh_position(look, 0, inertia, pull);
    weigh_position(look, 0.4, inertia, pull);
    for (int i = 0; i < tree_joint_count(look->tree); i++) {
        const struct frame *frame = &look->tree->frames[i];
        if (inertia[i] == 0 && value_of(look, frame->joint.rotor) == 0)
            message_warning(look->messages, frame->joint.place,
                            "coordinate %s: moves no %s, so that only rows can determine its acceleration; "
                            "add %s or a row",
                            frame->name, frame->joint.is_revolute ? "inertia about its axis" : "mass",
                            frame->joint.is_revolute ? "inertia" : "mass");
        else if (!acts[i] && pull[i] == 0 && !floats(look, frame))
            message_warning(look->messages, frame->joint.place,
                            "coordinate %s: no load acts on it: no gravity, spring, damper, force or row",
                            frame->name);
    }
}

/* ---- limits of force ---- */

/* Whether the value is the force of a drive, which has a limit for itself. */
static bool is_of_drive(const struct look *look, expression value) {
    const struct symbol *symbol = expr_as_symbol(look->model->graph, value);
    for (int i = 0; i < look->model->drive_count; i++)
        if (symbol && symbol->kind == SYMBOL_INPUT && symbol->index == look->model->drives[i].input)
            return true;
    return false;
}

/* "input tau", "inputs a, b", or `path` if the values depend on time. */
static const char *drivers_of(const struct look *look, const expression *values, int value_count,
                              const char *path) {
    struct memory *memory = look->messages->memory;
    bool *is_named = memory_get(memory, (size_t)look->model->input_count + 1);
    const char *names = "";
    int count, inputs = 0;
    for (int i = 0; i < value_count; i++) {
        const expression *symbols = rewrite_list_symbols(look->model->graph, values[i], &count);
        for (int k = 0; k < count && !is_of_drive(look, values[i]); k++) {
            const struct symbol *symbol = expr_as_symbol(look->model->graph, symbols[k]);
            if (symbol->kind == SYMBOL_INPUT)
                is_named[symbol->index] = true;
        }
    }
    for (int i = 0; i < look->model->input_count; i++)
        if (is_named[i])
            names = memory_format(memory, "%s%s%s", names, inputs++ ? ", " : "", look->model->inputs[i].name);
    return inputs ? memory_format(memory, "input%s %s", inputs > 1 ? "s" : "", names) : path;
}

/* Whether one of the values depends on inputs or time and may exceed `limit`. */
static bool drives(const struct look *look, const struct bounds *bounds, const expression *values, int count,
                   double limit) {
    for (int i = 0; i < count; i++)
        if (look->model->graph->nodes[values[i]].depends & (ON_INPUT | ON_TIME) &&
            !is_of_drive(look, values[i]) &&
            !(bounds[values[i]].least >= -limit && bounds[values[i]].most <= limit))
            return true;
    return false;
}

/* The limit is meant for a drive, but motions compare it with the force of rows, without other driving
 * forces.
 */
static void check_drive(const struct look *look, const struct bounds *bounds, int coordinate,
                        const expression *values, int count, const char *path) {
    const struct frame *frame = &look->tree->frames[coordinate];
    const double limit = frame->joint.limits ? frame->joint.limits->force : INFINITY;
    if (isfinite(limit) && drives(look, bounds, values, count, limit))
        message_warning(look->messages, frame->joint.place,
                        "coordinate %s: limits.force compares only the programme force with %.6g, without %s",
                        frame->name, limit, drivers_of(look, values, count, path));
}

static void check_force_limits(const struct look *look) {
    const struct model *model = look->model;
    const struct memory_mark mark = memory_mark(model->graph->memory);
    const struct bounds *bounds = bounds_of_values(model->graph, model->parameters);
    for (int i = 0; i < model->force_count; i++) {
        const struct force *force = &model->forces[i];
        const char *name = look->tree->frames[force->coordinate].name;
        check_drive(look, bounds, force->coordinate, &force->value, 1,
                    memory_format(look->messages->memory, "forces.%s", name));
    }
    for (int i = 0; i < model->load_count; i++) {
        const struct load *load = &model->loads[i];
        const int frame = look->tree->points[load->point].frame;
        if (load->is_torque && frame >= 0)
            check_drive(look, bounds, frame, load->value, 3, load->path);
    }
    memory_back(model->graph->memory, mark);
}

/* ---- unused inputs ---- */

/* Marks the values of the programme, the only ones that may depend on inputs. */
static void mark_values(const struct model *model, bool *needed) {
    for (int i = 0; i < model->force_count; i++)
        needed[model->forces[i].value] = true;
    for (int i = 0; i < model->load_count; i++)
        for (int k = 0; k < 3; k++)
            needed[model->loads[i].value[k]] = true;
    for (int i = 0; i < model->course_count; i++)
        needed[model->courses[i].value] = true;
    for (int i = 0; i < model->row_count; i++)
        needed[model->rows[i].residual] = true;
    for (int i = 0; i < model->event_count; i++)
        needed[model->events[i].value] = true;
    for (int i = 0; i < model->change_count; i++)
        needed[model->changes[i].value] = true;
    for (int i = 0; i < model->parameter_count; i++)
        needed[model->parameters[i].anchor] = true;
}

/* Setting an input at an event does not read it. */
static void check_inputs(const struct look *look) {
    const struct model *model = look->model;
    const struct graph *g = model->graph;
    const struct memory_mark mark = memory_mark(g->memory);
    bool *needed = memory_scratch(g->memory, g->count + 1);
    bool *is_read = memory_scratch(g->memory, (size_t)model->input_count + 1);
    mark_values(model, needed);
    rewrite_mark_operands(g, needed, g->count);
    for (expression e = 0; e < g->count; e++) {
        const struct symbol *symbol = needed[e] ? expr_as_symbol(g, e) : NULL;
        if (symbol && symbol->kind == SYMBOL_INPUT)
            is_read[symbol->index] = true;
    }
    for (int i = 0; i < model->input_count; i++)
        if (!is_read[i])
            message_warning(look->messages, model->inputs[i].place, "input %s: nothing reads it",
                            model->inputs[i].name);
    memory_back(g->memory, mark);
}

void warnings_of_values(const struct model *model, const struct tree *tree, struct messages *messages) {
    const struct look look = {.model = model, .tree = tree, .messages = messages};
    const double g = largest_of(&look, model->gravity, 3);
    if (g > 100)
        message_warning(messages, model->place,
                        "gravity: %.6g m/s^2; if it is in mm/s^2, convert it to m/s^2", g);
    for (int i = 0; i < model->link_count; i++)
        check_link(&look, &model->links[i]);
    check_force_limits(&look);
    if (messages->errors == 0) { /* after errors, loads may be missing */
        check_coordinates(&look);
        check_inputs(&look);
    }
}
