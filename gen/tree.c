/*
 * From links to frames: one frame a coordinate, welds merged, beams cut into rigid finite elements.
 * Takes a checked model, gives the tree of tree.h. Formulas: formulation, sect. 1 and 2.
 */
#include "tree.h"
#include "memory.h"
#include "vector.h"

#include <string.h>

/* Where links and points attach: the frame that carries them and their placement in it. */
struct carrier {
    struct fixed_frame base, tip; /* the link's own frame (a beam's first element) and a beam's end */
};

struct expansion {
    struct memory *memory;
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
    frame->parent = at->frame;
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
    return inertia_place(g, &to_center, inertia);
}

/* The exact integral over a prism from x = 0 to `length`. */
static struct inertia prism_inertia(struct graph *g, const struct beam *beam, expression length) {
    const expression line = mul(g, beam->rho, length);
    const expression mass = mul(g, line, beam->area);
    const expression slender = quotient(g, mul(g, mass, mul(g, length, length)), number(g, 3));
    return (struct inertia){
        .mass = mass,
        .moment = {mul(g, number(g, 0.5), mul(g, mass, length)), 0, 0},
        .tensor = {mul(g, line, add(g, beam->Iy, beam->Iz)), add(g, slender, mul(g, line, beam->Iy)),
                   add(g, slender, mul(g, line, beam->Iz)), 0, 0, 0},
    };
}

static expression element_stiffness(struct graph *g, const struct beam *beam, int turn, expression dl) {
    const expression G = quotient(g, beam->E, mul(g, number(g, 2), add(g, one(g), beam->nu)));
    const expression rigidity[3] = {mul(g, beam->E, beam->Iz), mul(g, beam->E, beam->Iy),
                                    mul(g, G, beam->It)};
    return quotient(g, rigidity[turn], dl);
}

/* The spring-damping element before element r: up to three turns at one point, R = Rz Ry Rx. */
static void add_element_joints(struct expansion *x, const struct link *link, int link_index, int r,
                               expression dl, struct fixed_frame *at) {
    struct graph *g = x->g;
    for (int turn = 0; turn < 3; turn++) {
        if (!link->beam.keeps[turn])
            continue;
        struct joint joint = {
            .is_turn = true, .axis = turn_axes[turn], .name = turn_names[turn], .place = link->place};
        joint.stiffness = element_stiffness(g, &link->beam, turn, dl);
        joint.damping = mul(g, link->beam.eta, joint.stiffness);
        struct frame *frame = add_joint(x, at, &joint);
        frame->link = link_index;
        frame->element = r;
        frame->name = memory_format(x->memory, "%s_%s_%d", link->name, turn_names[turn], r);
        name_value(g, joint.stiffness,
                   memory_format(x->memory, "%s_stiffness_%s", link->name, turn_names[turn]));
        name_value(g, joint.damping, memory_format(x->memory, "%s_damping_%s", link->name, turn_names[turn]));
    }
}

/* Elements of a beam whose first one stands at `at`; gives its end. */
static struct fixed_frame add_beam(struct expansion *x, const struct link *link, int link_index,
                                   struct fixed_frame at) {
    struct graph *g = x->g;
    const struct beam *beam = &link->beam;
    const int count = beam->rfe;
    const expression dl = count > 1 ? quotient(g, beam->length, number(g, count - 1)) : beam->length;
    const expression half = count > 1 ? mul(g, number(g, 0.5), dl) : dl;
    name_value(g, dl, memory_format(x->memory, "%s_element_length", link->name));
    for (int r = 0; r < count; r++) {
        const expression length = r == 0 || r == count - 1 ? half : dl;
        if (r > 0)
            add_element_joints(x, link, link_index, r, dl, &at);
        add_inertia(x, &at, prism_inertia(g, beam, length));
        const struct placement end = placement_shift_x(length);
        at.placement = placement_compose(g, &at.placement, &end);
    }
    return at;
}

static struct fixed_frame attach(struct graph *g, const struct carrier *carriers,
                                 const struct attachment *on) {
    struct fixed_frame at = {.frame = -1, .placement = placement_identity()};
    if (on->link >= 0)
        at = on->where == AT_TIP ? carriers[on->link].tip : carriers[on->link].base;
    at.placement = placement_compose(g, &at.placement, &on->placement);
    return at;
}

/* A direction turns with its carrier and has no place. */
static struct fixed_frame attach_point(struct graph *g, const struct carrier *carriers,
                                       const struct point *point) {
    struct attachment on = point->at;
    if (!point->is_direction)
        return attach(g, carriers, &on);
    on.placement = placement_identity();
    struct fixed_frame at = attach(g, carriers, &on);
    const struct vector turned =
        matrix_times(g, at.placement.rotation, vector_of(point->at.placement.position));
    memcpy(at.placement.position, turned.at, sizeof turned.at);
    return at;
}

static void add_link(struct expansion *x, const struct model *model, struct carrier *carriers, int index) {
    const struct link *link = &model->links[index];
    struct fixed_frame at = attach(x->g, carriers, &link->on);
    for (int i = 0; i < link->joint_count; i++) {
        struct frame *frame = add_joint(x, &at, &link->joints[i]);
        frame->link = index;
        frame->name = memory_format(x->memory, "%s_%s", link->name, link->joints[i].name);
    }
    add_inertia(x, &at, solid_inertia(x->g, &link->solid));
    carriers[index].base = carriers[index].tip = at;
    if (link->beam.exists)
        carriers[index].tip = add_beam(x, link, index, at);
}

/* "arm_psi_1_mass", "arm_psi_1_moment_x", "arm_psi_1_inertia_xx": fields of the derived parameters. */
static void name_inertia(struct expansion *x, const struct frame *frame) {
    static const char *const axes[3] = {"x", "y", "z"}, *const pairs[6] = {"xx", "yy", "zz",
                                                                           "xy", "xz", "yz"};
    const struct inertia *inertia = &frame->inertia;
    name_value(x->g, inertia->mass, memory_format(x->memory, "%s_mass", frame->name));
    for (int i = 0; i < 3; i++)
        name_value(x->g, inertia->moment[i], memory_format(x->memory, "%s_moment_%s", frame->name, axes[i]));
    for (int i = 0; i < 6; i++)
        name_value(x->g, inertia->tensor[i],
                   memory_format(x->memory, "%s_inertia_%s", frame->name, pairs[i]));
}

void expand(struct memory *memory, const struct model *model, struct tree *tree) {
    struct expansion x = {.memory = memory, .g = model->graph, .tree = tree};
    struct carrier *carriers = memory_get(memory, ((size_t)model->link_count + 1) * sizeof *carriers);
    *tree = (struct tree){0};
    for (int i = 0; i < model->link_count; i++)
        add_link(&x, model, carriers, i);
    for (int i = 0; i < tree->count; i++)
        name_inertia(&x, &tree->frames[i]);
    tree->points = memory_get(memory, ((size_t)model->marker_count + 1) * sizeof *tree->points);
    for (int i = 0; i < model->marker_count; i++)
        tree->points[i] = attach_point(model->graph, carriers, &model->points[i]);
}

int find_coordinate(const struct tree *tree, const char *name) {
    for (int i = 0; i < tree->count; i++)
        if (!strcmp(tree->frames[i].name, name))
            return i;
    return -1;
}

const char **coordinate_names(struct memory *memory, const struct tree *tree) {
    const char **names = memory_get(memory, ((size_t)tree->count + 1) * sizeof *names);
    for (int i = 0; i < tree->count; i++)
        names[i] = tree->frames[i].name;
    return names;
}
