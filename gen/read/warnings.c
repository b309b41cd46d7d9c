/*
 * Doubtful values: see reader.h. Inertia and gravity's pull are looked at in two positions, the start and
 * one beside it, with plain numbers.
 */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <math.h>
#include <string.h>

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

static void look_at_segment(const struct look *look, const struct link *link, const struct segment *segment,
                            double beam_length) {
    const double E = value_of(look, segment->E), rho = value_of(look, segment->rho);
    const double I = fmax(value_of(look, segment->Iy), value_of(look, segment->Iz));
    const double thickness = sqrt(12 * I / value_of(look, segment->area));
    if (E < 1e6)
        message_warning(look->messages, link->place,
                        "link %s: beam: E = %.6g Pa: in MPa or GPa? Pa are needed", link->name, E);
    if (rho < 20)
        message_warning(look->messages, link->place,
                        "link %s: beam: rho = %.6g kg/m^3: in g/cm^3? kg/m^3 are needed", link->name, rho);
    if (thickness > beam_length / 3)
        message_warning(
            look->messages, link->place,
            "link %s: beam: a section %.3g m thick on a length of %.3g m: a body rather than a beam, or in "
            "mm?",
            link->name, thickness, beam_length);
}

static void look_at_spring(const struct look *look, const struct link *link, const struct joint *joint) {
    const double stiffness = value_of(look, joint->stiffness);
    const char *unit = joint->is_revolute ? "N m" : "N/m";
    if (stiffness < 0)
        message_warning(look->messages, joint->place,
                        "link %s: spring: %s = %.6g %s pushes away from its rest; %.6g %s pulls back",
                        link->name, joint->name, stiffness, unit, -stiffness, unit);
    if (joint->is_revolute && fabs(value_of(look, joint->rest)) > 6.3)
        message_warning(look->messages, joint->place,
                        "link %s: rest: %s = %.6g rad: in degrees? rd.pi / 180 makes radians of them",
                        link->name, joint->name, value_of(look, joint->rest));
}

static void look_at_link(const struct look *look, const struct link *link) {
    const double far = largest_of(look, link->on.placement.position, 3);
    const struct attachment *on = &link->on;
    double length = 0;
    if (on->link >= 0 && on->where == AT_FRAME && look->model->links[on->link].beam.exists && far == 0)
        message_warning(look->messages, link->place,
                        "link %s: on: \"%s\" is the root of the beam; its end is \"%s.tip\"", link->name,
                        look->model->links[on->link].name, look->model->links[on->link].name);
    if (far > 100)
        message_warning(look->messages, link->place,
                        "link %s: at: %.6g m from its carrier: in mm? m are needed", link->name, far);
    for (int i = 0; i < link->joint_count; i++) {
        const double start = value_of(look, link->joints[i].start);
        look_at_spring(look, link, &link->joints[i]);
        if (link->joints[i].is_revolute && fabs(start) > 6.3)
            message_warning(look->messages, link->joints[i].place,
                            "link %s: start: %s = %.6g rad: in degrees? rd.pi / 180 makes radians of them",
                            link->name, link->joints[i].name, start);
    }
    for (int i = 0; i < link->beam.segment_count; i++)
        length += value_of(look, link->beam.segments[i].length);
    if (length > 100)
        message_warning(look->messages, link->place, "link %s: beam: %.6g m long: in mm? m are needed",
                        link->name, length);
    for (int i = 0; i < link->beam.segment_count; i++)
        look_at_segment(look, link, &link->beam.segments[i], length);
}

/* ---- inertia and gravity ---- */

/* What moves with a coordinate, in the ground frame about its origin: m, m c, int r r^T dm. */
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

/* The frame's pose before its joint in `base`, after it in the result. */
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

/* M_ii and the generalized force of gravity of one coordinate, without what is rounding. */
static void judge_coordinate(const struct look *look, const struct joint *joint, const struct pose *base,
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

static void judge_position(const struct look *look, double beside, double *inertia, double *pull) {
    const struct pose ground = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    struct memory *memory = look->messages->memory;
    const int n = look->tree->count;
    struct pose *poses = memory_get(memory, ((size_t)n + 1) * sizeof *poses);
    struct pose *bases = memory_get(memory, ((size_t)n + 1) * sizeof *bases);
    struct load_of_mass *loads = memory_get(memory, ((size_t)n + 1) * sizeof *loads);
    for (int i = 0; i < n; i++) {
        const struct frame *frame = &look->tree->frames[i];
        const double q = value_of(look, frame->joint.start) + beside * (1 + 0.1 * (i % 7));
        poses[i] =
            place_frame(look, frame, frame->parent < 0 ? &ground : &poses[frame->parent], q, &bases[i]);
        loads[i] = mass_in_ground(look, &frame->inertia, &poses[i]);
    }
    for (int i = n - 1; i >= 0; i--) {
        const int parent = look->tree->frames[i].parent;
        judge_coordinate(look, &look->tree->frames[i].joint, &bases[i], &loads[i], &inertia[i], &pull[i]);
        if (parent < 0)
            continue;
        loads[parent].mass += loads[i].mass;
        for (int k = 0; k < 3; k++)
            loads[parent].moment[k] += loads[i].moment[k];
        for (int k = 0; k < 9; k++)
            loads[parent].second[k] += loads[i].second[k];
    }
}

/* ---- what acts on a coordinate ---- */

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

/* By coordinate. */
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

/* A body that floats freely may well be left alone. */
static bool floats(const struct look *look, const struct frame *frame) {
    return look->model->links[frame->link].joint_count == 6;
}

static void look_at_coordinates(const struct look *look) {
    const int n = look->tree->count;
    double *inertia = memory_get(look->messages->memory, ((size_t)n + 1) * sizeof *inertia);
    double *pull = memory_get(look->messages->memory, ((size_t)n + 1) * sizeof *pull);
    const bool *acts = acted_on(look);
    judge_position(look, 0, inertia, pull);
    judge_position(look, 0.4, inertia, pull);
    for (int i = 0; i < n; i++) {
        const struct frame *frame = &look->tree->frames[i];
        if (inertia[i] == 0 && value_of(look, frame->joint.rotor) == 0)
            message_warning(
                look->messages, frame->joint.place,
                "coordinate %s: moves nothing that has %s, its acceleration has no value unless rows give "
                "it one",
                frame->name, frame->joint.is_revolute ? "inertia about its axis" : "mass");
        else if (!acts[i] && pull[i] == 0 && !floats(look, frame))
            message_warning(look->messages, frame->joint.place,
                            "coordinate %s: nothing loads it, no gravity, spring, damper, force or row",
                            frame->name);
    }
}

/* ---- limits of force ---- */

/* "input tau", "inputs a, b", or `path` where the values follow time. */
static const char *drivers_of(const struct look *look, const expression *values, int value_count,
                              const char *path) {
    struct memory *memory = look->messages->memory;
    bool *is_named = memory_get(memory, (size_t)look->model->input_count + 1);
    const char *names = "";
    int count, inputs = 0;
    for (int i = 0; i < value_count; i++) {
        const expression *symbols = rewrite_list_symbols(look->model->graph, values[i], &count);
        for (int k = 0; k < count; k++) {
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

/* Does one of the values follow inputs or time, beyond `limit`? */
static bool drives(const struct look *look, const struct bounds *bounds, const expression *values, int count,
                   double limit) {
    for (int i = 0; i < count; i++)
        if (look->model->graph->nodes[values[i]].depends & (ON_INPUT | ON_TIME) &&
            !(bounds[values[i]].least >= -limit && bounds[values[i]].most <= limit))
            return true;
    return false;
}

/* The limit is meant for a drive, but motions compare it with the force of rows. Other driving forces are not
 * included. */
static void look_at_drive(const struct look *look, const struct bounds *bounds, int coordinate,
                          const expression *values, int count, const char *path) {
    const struct frame *frame = &look->tree->frames[coordinate];
    const double limit = frame->joint.limits ? frame->joint.limits->force : INFINITY;
    if (isfinite(limit) && drives(look, bounds, values, count, limit))
        message_warning(look->messages, frame->joint.place,
                        "coordinate %s: limits.force compares the programme force with %.6g; %s is not in it",
                        frame->name, limit, drivers_of(look, values, count, path));
}

static void look_at_force_limits(const struct look *look) {
    const struct model *model = look->model;
    const struct memory_mark mark = memory_mark(model->graph->memory);
    const struct bounds *bounds = bounds_of_values(model->graph, model->parameters);
    for (int i = 0; i < model->force_count; i++) {
        const struct force *force = &model->forces[i];
        const char *name = look->tree->frames[force->coordinate].name;
        look_at_drive(look, bounds, force->coordinate, &force->value, 1,
                      memory_format(look->messages->memory, "forces.%s", name));
    }
    for (int i = 0; i < model->load_count; i++) {
        const struct load *load = &model->loads[i];
        const int frame = look->tree->points[load->point].frame;
        if (load->is_torque && frame >= 0)
            look_at_drive(look, bounds, frame, load->value, 3, load->path);
    }
    memory_back(model->graph->memory, mark);
}

void warnings_of_values(const struct model *model, const struct tree *tree, struct messages *messages) {
    const struct look look = {.model = model, .tree = tree, .messages = messages};
    const double g = largest_of(&look, model->gravity, 3);
    if (g > 100)
        message_warning(messages, model->place, "gravity: %.6g m/s^2: in mm/s^2? m/s^2 are needed", g);
    for (int i = 0; i < model->link_count; i++)
        look_at_link(&look, &model->links[i]);
    look_at_force_limits(&look);
    if (messages->errors == 0) /* else what loads them may be among the errors */
        look_at_coordinates(&look);
}
