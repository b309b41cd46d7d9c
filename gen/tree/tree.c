/*
 * From links to frames: one frame a coordinate, welds merged, beams cut into rigid finite elements.
 * Takes a checked model, gives the tree of tree.h. Formulas: formulation, sect. 1 and 2.
 */
#include "tree/tree.h"
#include "base/memory.h"
#include "tree/vector.h"

#include <assert.h>
#include <string.h>

/* An element of a beam: the frame that carries it, and where it begins along the beam. */
struct element {
    struct fixed_frame at;
    expression start; /* [m] from the beam's root */
};

/* Where links and points attach: the frame that carries them and their placement in it. */
struct carrier {
    struct fixed_frame base, tip; /* the link's own frame (a beam's first element) and a beam's end */
    struct element *elements;     /* of a beam */
    int element_count;
};

struct expansion {
    struct memory *memory;
    const struct model *model;
    struct graph *g;
    struct tree *tree;
    int capacity;
};

static const char *const turn_names[3] = {"psi", "theta", "phi"};
static const int turn_axes[3] = {AXIS_Z, AXIS_Y, AXIS_X};

static struct frame *new_frame(struct expansion *x) {
    struct tree *tree = x->tree;
    if (tree->count == x->capacity) {
        int capacity = x->capacity ? 2 * x->capacity : 32;
        tree->frames = memory_grow(x->memory, tree->frames, (size_t)tree->count * sizeof *tree->frames,
                                   (size_t)capacity * sizeof *tree->frames);
        x->capacity = capacity;
    }
    return &tree->frames[tree->count++];
}

/* A new frame with one joint, standing where `at` is; `at` becomes that frame. */
static struct frame *add_joint(struct expansion *x, struct fixed_frame *at, const struct joint *joint) {
    struct frame *frame = new_frame(x);
    assert(at->frame < x->tree->count - 1);
    frame->parent = at->frame;
    frame->run = -1;
    frame->coordinate = x->tree->count - 1;
    frame->placement = at->placement;
    frame->joint = *joint;
    at->frame = x->tree->count - 1;
    at->placement = placement_identity();
    return frame;
}

/* What is fixed to the ground has no part in the motion. */
static void add_inertia(struct expansion *x, const struct fixed_frame *at, struct inertia inertia) {
    if (at->frame < 0)
        return;
    struct inertia *into = &x->tree->frames[at->frame].inertia;
    *into = inertia_add(x->g, *into, inertia_place(x->g, &at->placement, inertia));
}

/* J about the origin = J about the centre + m (c.c 1 - c c^T). */
static struct inertia solid_inertia(struct graph *g, const struct solid *solid) {
    struct placement to_center = placement_identity();
    struct inertia inertia = {.mass = solid->mass};
    memcpy(to_center.position, solid->center, sizeof to_center.position);
    memcpy(inertia.tensor, solid->inertia, sizeof inertia.tensor);
    inertia = inertia_place(g, &to_center, inertia);
    return inertia_place(g, &solid->placement, inertia);
}

/* The exact integral over a prism from x = 0 to `length`. */
static struct inertia prism_inertia(struct graph *g, const struct segment *segment, expression length) {
    const expression line = expr_mul(g, segment->rho, length);
    const expression mass = expr_mul(g, line, segment->area);
    const expression slender = expr_div(g, expr_mul(g, mass, expr_mul(g, length, length)), expr_number(g, 3));
    return (struct inertia){
        .mass = mass,
        .moment = {expr_mul(g, expr_number(g, 0.5), expr_mul(g, mass, length)), 0, 0},
        .tensor = {expr_mul(g, line, expr_add(g, segment->Iy, segment->Iz)),
                   expr_add(g, slender, expr_mul(g, line, segment->Iy)),
                   expr_add(g, slender, expr_mul(g, line, segment->Iz)), 0, 0, 0},
    };
}

/* s = E Iz / dl, E Iy / dl, G It / dl with G = E / (2 (1 + nu)) */
static expression element_stiffness(struct graph *g, const struct segment *segment, int turn, expression dl) {
    const expression G =
        expr_div(g, segment->E, expr_mul(g, expr_number(g, 2), expr_add(g, expr_one(g), segment->nu)));
    const expression rigidity[3] = {expr_mul(g, segment->E, segment->Iz),
                                    expr_mul(g, segment->E, segment->Iy), expr_mul(g, G, segment->It)};
    return expr_div(g, rigidity[turn], dl);
}

/* The length that one spring-damping element stands for. */
static expression spacing(struct graph *g, const struct segment *segment) {
    return segment->rfe > 1 ? expr_div(g, segment->length, expr_number(g, segment->rfe - 1))
                            : segment->length;
}

static struct joint element_joint(struct expansion *x, const struct link *link, const struct segment *segment,
                                  int turn) {
    struct graph *g = x->g;
    const expression dl = spacing(g, segment);
    struct joint joint = {
        .is_revolute = true, .axis = turn_axes[turn], .name = turn_names[turn], .place = link->place};
    joint.stiffness = element_stiffness(g, segment, turn, dl);
    joint.damping = expr_add(g, expr_mul(g, segment->eta, joint.stiffness), segment->damping[turn]);
    joint.rest = joint.start = expr_mul(g, segment->curvature[turn], dl);
    graph_name_value(g, joint.stiffness,
                     memory_format(x->memory, "%s_stiffness_%s", link->name, turn_names[turn]));
    graph_name_value(g, joint.damping,
                     memory_format(x->memory, "%s_damping_%s", link->name, turn_names[turn]));
    return joint;
}

/* The spring-damping element before element r: up to three turns at one point, R = Rz Ry Rx. */
static void add_element_joints(struct expansion *x, const struct link *link, const struct segment *segment,
                               int r, struct fixed_frame *at) {
    for (int turn = 0; turn < 3; turn++) {
        if (!link->beam.keeps[turn])
            continue;
        const struct joint joint = element_joint(x, link, segment, turn);
        struct frame *frame = add_joint(x, at, &joint);
        frame->link = (int)(link - x->model->links);
        frame->element = r;
        frame->name = memory_format(x->memory, "%s_%s_%d", link->name, turn_names[turn], r);
    }
}

/* One element from the carrier's tip on; the entry behind the last element holds the beam's whole length. */
static void add_element(struct expansion *x, struct carrier *carrier, const struct segment *segment,
                        expression length) {
    struct element *element = &carrier->elements[carrier->element_count++];
    const struct placement end = placement_shift_x(length);
    add_inertia(x, &carrier->tip, prism_inertia(x->g, segment, length));
    element[0].at = carrier->tip;
    element[1].start = expr_add(x->g, element[0].start, length);
    carrier->tip.placement = placement_compose(x->g, &carrier->tip.placement, &end);
}

/* Elements of one segment from the carrier's tip on; half ones at both ends, so that segments join rigidly.
 */
static void add_segment(struct expansion *x, const struct link *link, const struct segment *segment,
                        int *number_of_sde, struct carrier *carrier) {
    struct graph *g = x->g;
    const expression dl = spacing(g, segment);
    const expression half = segment->rfe > 1 ? expr_mul(g, expr_number(g, 0.5), dl) : dl;
    graph_name_value(g, dl, memory_format(x->memory, "%s_element_length", link->name));
    for (int r = 0; r < segment->rfe; r++) {
        if (r > 0)
            add_element_joints(x, link, segment, ++*number_of_sde, &carrier->tip);
        add_element(x, carrier, segment, r == 0 || r == segment->rfe - 1 ? half : dl);
    }
}

static void add_beam(struct expansion *x, const struct link *link, struct carrier *carrier) {
    int count = 0, number_of_sde = 0;
    for (int i = 0; i < link->beam.segment_count; i++)
        count += link->beam.segments[i].rfe;
    carrier->elements = memory_get(x->memory, ((size_t)count + 1) * sizeof *carrier->elements);
    for (int i = 0; i < link->beam.segment_count; i++)
        add_segment(x, link, &link->beam.segments[i], &number_of_sde, carrier);
}

static double value_of(const struct expansion *x, expression e) {
    return parameters_evaluate(x->g, x->model->parameters, e);
}

/* The element that covers a place, with the parameters' values as they are when the C is generated. */
static struct fixed_frame along_beam(const struct expansion *x, const struct carrier *carrier,
                                     expression along) {
    const double place = value_of(x, along);
    int i = 0;
    while (i + 1 < carrier->element_count && value_of(x, carrier->elements[i + 1].start) <= place)
        i++;
    struct fixed_frame at = carrier->elements[i].at;
    const struct placement shift = placement_shift_x(expr_sub(x->g, along, carrier->elements[i].start));
    at.placement = placement_compose(x->g, &at.placement, &shift);
    return at;
}

static struct fixed_frame attach(const struct expansion *x, const struct carrier *carriers,
                                 const struct attachment *on) {
    struct fixed_frame at = {.frame = -1, .placement = placement_identity()};
    if (on->link >= 0 && on->where == AT_ALONG)
        at = along_beam(x, &carriers[on->link], on->along);
    else if (on->link >= 0)
        at = on->where == AT_TIP ? carriers[on->link].tip : carriers[on->link].base;
    at.placement = placement_compose(x->g, &at.placement, &on->placement);
    return at;
}

/* A direction turns with its carrier and has no place. */
static struct fixed_frame attach_point(const struct expansion *x, const struct carrier *carriers,
                                       const struct point *point) {
    struct attachment on = point->at;
    if (!point->is_direction)
        return attach(x, carriers, &on);
    on.placement = placement_identity();
    struct fixed_frame at = attach(x, carriers, &on);
    const struct vector turned =
        matrix_times(x->g, at.placement.rotation, vector_of(point->at.placement.position));
    memcpy(at.placement.position, turned.at, sizeof turned.at);
    return at;
}

static void add_link(struct expansion *x, struct carrier *carriers, int index) {
    const struct link *link = &x->model->links[index];
    struct fixed_frame at = attach(x, carriers, &link->on);
    for (int i = 0; i < link->joint_count; i++) {
        struct frame *frame = add_joint(x, &at, &link->joints[i]);
        frame->link = index;
        frame->name = memory_format(x->memory, "%s_%s", link->name, link->joints[i].name);
    }
    for (int i = 0; i < link->solid_count; i++)
        add_inertia(x, &at, solid_inertia(x->g, &link->solids[i]));
    carriers[index].base = carriers[index].tip = at;
    if (link->beam.exists)
        add_beam(x, link, &carriers[index]);
}

/* "arm_psi_1_mass", "arm_psi_1_moment_x", "arm_psi_1_inertia_xx": fields of the derived parameters. */
static void name_inertia(struct expansion *x, const struct frame *frame) {
    static const char *const axes[3] = {"x", "y", "z"}, *const pairs[6] = {"xx", "yy", "zz",
                                                                           "xy", "xz", "yz"};
    const struct inertia *inertia = &frame->inertia;
    graph_name_value(x->g, inertia->mass, memory_format(x->memory, "%s_mass", frame->name));
    for (int i = 0; i < 3; i++)
        graph_name_value(x->g, inertia->moment[i],
                         memory_format(x->memory, "%s_moment_%s", frame->name, axes[i]));
    for (int i = 0; i < 6; i++)
        graph_name_value(x->g, inertia->tensor[i],
                         memory_format(x->memory, "%s_inertia_%s", frame->name, pairs[i]));
}

void tree_expand(struct memory *memory, const struct model *model, struct tree *tree) {
    struct expansion x = {.memory = memory, .model = model, .g = model->graph, .tree = tree};
    *tree = (struct tree){.carriers =
                              memory_get(memory, ((size_t)model->link_count + 1) * sizeof *tree->carriers)};
    for (int i = 0; i < model->link_count; i++)
        add_link(&x, tree->carriers, i);
    for (int i = 0; i < tree->count; i++)
        name_inertia(&x, &tree->frames[i]);
}

void tree_place_points(struct memory *memory, const struct model *model, struct tree *tree) {
    const struct expansion x = {.memory = memory, .model = model, .g = model->graph, .tree = tree};
    tree->points = memory_get(memory, ((size_t)model->marker_count + 1) * sizeof *tree->points);
    for (int i = 0; i < model->marker_count; i++)
        tree->points[i] = attach_point(&x, tree->carriers, &model->points[i]);
}

int tree_find_coordinate(const struct tree *tree, const char *name) {
    for (int i = 0; i < tree->count; i++)
        if (!strcmp(tree->frames[i].name, name))
            return i;
    return -1;
}

const char **tree_coordinate_names(struct memory *memory, const struct tree *tree) {
    const char **names = memory_get(memory, ((size_t)tree->count + 1) * sizeof *names);
    for (int i = 0; i < tree->count; i++)
        names[i] = tree->frames[i].name;
    return names;
}
