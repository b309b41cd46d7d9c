/*
 * Expands links to frames: one frame for each coordinate, welds merged. rigid_finite_elements.c cuts beams.
 *
 * Input: a checked model. Formulas: theory, sect. 3.1 and 3.3.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <string.h>

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
        frame->name = memory_format(x->memory, "%s_%s", link->name, link->joints[i].name);
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
