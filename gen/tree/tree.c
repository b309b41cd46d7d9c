/*
 * Expands links to frames: one frame for each coordinate, welds merged. rigid_finite_elements.c cuts beams.
 *
 * Input: a checked model. Output: frames with their joints and inertias. Formulas: theory, sect. 2.1 and 3.1.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <string.h>

/* ---- Names of inertias ---- */

/*
 * Names of inertias among the derived parameters of the emitted C. Equal values are one value, so that its
 * name must be true for all bodies with this inertia: the name of the frame, of the beam's elements, or
 * "shared" for several links.
 */

/* The owners of an inertia's value, by handle. */
struct owners {
    const struct frame *first;
    int link;
    bool has_frames, has_links; /* more than one */
};

static void own(struct owners *of, int link, const struct frame *frame) {
    if (!of->first)
        *of = (struct owners){.first = frame, .link = link};
    of->has_frames |= of->first != frame;
    of->has_links |= of->link != link;
}

/* mass, moments and tensor, in the order of struct inertia */
enum { INERTIA_VALUES = sizeof(struct inertia) / sizeof(expression) };

static void own_inertia(struct owners *owners, int link, const struct frame *frame,
                        const struct inertia *inertia) {
    const expression *values = (const expression *)inertia;
    for (int i = 0; i < INERTIA_VALUES; i++)
        own(&owners[values[i]], link, frame);
}

/* "arm_psi" for one frame, "arm_element" or "arm_half_element" for several elements of one beam, "shared"
 * for several links. */
static const char *owner_name(const struct expansion *x, const struct owners *of) {
    const char *link = x->model->links[of->link].name;
    if (of->has_links)
        return "shared";
    if (!of->has_frames)
        return of->first->name;
    return memory_format(x->memory, "%s_%selement", link, of->first->element ? "" : "half_");
}

/* "arm_psi_mass", "arm_psi_moment_x", "arm_psi_inertia_xx" */
static void name_inertia(const struct expansion *x, const struct owners *owners,
                         const struct inertia *inertia) {
    static const char *const names[INERTIA_VALUES] = {"mass",       "moment_x",   "moment_y",   "moment_z",
                                                      "inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy",
                                                      "inertia_xz", "inertia_yz"};
    const expression *values = (const expression *)inertia;
    for (int i = 0; i < INERTIA_VALUES; i++)
        graph_name_value(x->g, values[i],
                         memory_format(x->memory, "%s_%s", owner_name(x, &owners[values[i]]), names[i]));
}

static void inertia_names_give(const struct expansion *x) {
    const struct tree *tree = x->tree;
    struct owners *owners = memory_get(x->memory, x->g->count * sizeof *owners);
    for (int i = 0; i < x->part_count; i++)
        own_inertia(owners, x->parts[i].link, &tree->frames[x->parts[i].frame], &x->parts[i].inertia);
    for (int i = 0; i < tree->count; i++)
        own_inertia(owners, tree->frames[i].link, &tree->frames[i], &tree->frames[i].inertia);
    for (int i = 0; i < tree->count; i++)
        name_inertia(x, owners, &tree->frames[i].inertia);
}

/* ---- Links and points ---- */

/* J about the origin = J about the centre + m (c.c 1 - c c^T): theory, sect. 3.3. */
static struct inertia solid_inertia(struct graph *g, const struct solid *solid) {
    struct placement to_center = placement_identity();
    struct inertia inertia = {.mass = solid->mass};
    memcpy(to_center.position, solid->center, sizeof to_center.position);
    memcpy(inertia.tensor.at, solid->inertia, sizeof inertia.tensor.at);
    inertia = inertia_place(g, &to_center, inertia);
    return inertia_place(g, &solid->placement, inertia);
}

static double value_of(const struct expansion *x, expression e) {
    return parameters_evaluate(x->g, x->model->parameters, e);
}

/* The element that contains a place along the beam, for the present values of parameters. */
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
        struct frame *frame = joint_axis_add(x, &at, &link->joints[i]);
        frame->link = index;
        frame->name = link->joints[i].coordinate
                          ? link->joints[i].coordinate
                          : memory_format(x->memory, "%s_%s", link->name, link->joints[i].name);
        graph_name_shared(x->g, frame->joint.rotor, frame->name, "rotor");
    }
    for (int i = 0; i < link->solid_count; i++)
        frames_add_inertia(x, at.frame < 0 ? index : x->tree->frames[at.frame].link, &at,
                           solid_inertia(x->g, &link->solids[i]));
    carriers[index].base = carriers[index].tip = at;
    if (link->beam.exists)
        rigid_finite_elements_add(x, link, &carriers[index]);
}

void tree_expand(struct memory *memory, const struct model *model, struct tree *tree) {
    struct expansion x = {.memory = memory, .model = model, .g = model->graph, .tree = tree};
    *tree = (struct tree){.carriers =
                              memory_get(memory, ((size_t)model->link_count + 1) * sizeof *tree->carriers)};
    for (int i = 0; i < model->link_count; i++)
        add_link(&x, tree->carriers, i);
    inertia_names_give(&x);
}

void tree_place_points(struct memory *memory, const struct model *model, struct tree *tree) {
    const struct expansion x = {.memory = memory, .model = model, .g = model->graph, .tree = tree};
    tree->points = memory_get(memory, ((size_t)model->marker_count + 1) * sizeof *tree->points);
    for (int i = 0; i < model->marker_count; i++)
        tree->points[i] = attach_point(&x, tree->carriers, &model->points[i]);
}

void tree_add_states(struct memory *memory, const struct model *model, struct tree *tree) {
    struct expansion x = {
        .memory = memory, .model = model, .g = model->graph, .tree = tree, .capacity = tree->count};
    for (int i = 0; i < model->state_count; i++) {
        const struct model_state *state = &model->states[i];
        const struct joint joint = {.name = "state",
                                    .coordinate = state->name,
                                    .start_rate = state->start,
                                    .rotor = EXPR_ONE,
                                    .place = state->place};
        struct fixed_frame ground = {.frame = -1, .placement = placement_identity()};
        struct frame *frame = frames_add(&x, &ground, &joint);
        frame->name = state->name;
        frame->is_state = true;
    }
}

int tree_joint_count(const struct tree *tree) {
    int count = tree->count;
    while (count > 0 && tree->frames[count - 1].is_state)
        count--;
    return count;
}

static int find_between(const struct tree *tree, const char *name, int first, int end) {
    for (int i = first; i < end; i++)
        if (!strcmp(tree->frames[i].name, name))
            return i;
    return -1;
}

int tree_find_frame(const struct tree *tree, const char *name) {
    return find_between(tree, name, 0, tree->count);
}

int tree_find_coordinate(const struct tree *tree, const char *name) {
    return find_between(tree, name, 0, tree_joint_count(tree));
}

int tree_find_state(const struct tree *tree, const char *name) {
    return find_between(tree, name, tree_joint_count(tree), tree->count);
}

const char **tree_coordinate_names(struct memory *memory, const struct tree *tree) {
    const char **names = memory_get(memory, ((size_t)tree->count + 1) * sizeof *names);
    for (int i = 0; i < tree->count; i++)
        names[i] = tree->frames[i].name;
    return names;
}
