/*
 * Cuts beams into rigid finite elements, joined by spring-damping elements of up to three turns.
 *
 * Input: a link's beam. Output: frames with their inertias, stiffnesses and dampings. Half elements are at
 * both ends of a segment, so that segments join rigidly. Formulas: theory, sect. 3.1 to 3.3.
 */
#include "gen/base/base.h"
#include "gen/tree/tree.h"

#include <assert.h>

static const char *const turn_names[3] = {"psi", "theta", "phi"};
static const int turn_axes[3] = {AXIS_Z, AXIS_Y, AXIS_X};

/* The exact integral over a prism from x = 0 to `length`: mc = m l/2, Jxx = rho l (Iy + Iz),
 * Jyy = m l^2/3 + rho l Iy, Jzz = m l^2/3 + rho l Iz. Theory, sect. 3.3. */
static struct inertia prism_inertia(struct graph *g, const struct segment *segment, expression length) {
    const expression line = expr_mul(g, segment->rho, length);
    const expression mass = expr_mul(g, line, segment->area);
    const expression slender = expr_div(g, expr_mul(g, mass, expr_mul(g, length, length)), expr_number(g, 3));
    return (struct inertia){
        .mass = mass,
        .moment = {{expr_mul(g, expr_number(g, 0.5), expr_mul(g, mass, length)), 0, 0}},
        .tensor = {{expr_mul(g, line, expr_add(g, segment->Iy, segment->Iz)),
                    expr_add(g, slender, expr_mul(g, line, segment->Iy)),
                    expr_add(g, slender, expr_mul(g, line, segment->Iz)), 0, 0, 0}},
    };
}

/* s = E Iz / dl, E Iy / dl, G It / dl with G = E / (2 (1 + nu)): theory, sect. 3.2. */
static expression element_stiffness(struct graph *g, const struct segment *segment, int turn, expression dl) {
    const expression G =
        expr_div(g, segment->E, expr_mul(g, expr_number(g, 2), expr_add(g, EXPR_ONE, segment->nu)));
    const expression rigidity[3] = {expr_mul(g, segment->E, segment->Iz),
                                    expr_mul(g, segment->E, segment->Iy), expr_mul(g, G, segment->It)};
    return expr_div(g, rigidity[turn], dl);
}

/* dl, the length that one spring-damping element represents: theory, sect. 3.1. */
static expression spacing(struct graph *g, const struct segment *segment) {
    return segment->rfe > 1 ? expr_div(g, segment->length, expr_number(g, segment->rfe - 1))
                            : segment->length;
}

/* A round or square section bends equally about both axes. */
static const char *deformation_name(const struct segment *segment, int turn) {
    const bool bends_alike = segment->Iy == segment->Iz && segment->damping[0] == segment->damping[1];
    return turn < 2 && bends_alike ? "bending" : turn_names[turn];
}

/* The turn at which an element is not strained. If springs act on strains, it is the turn at which the
 * strains are those of the unloaded beam, w = curvature dl, to second order: theory, sect. 3.4. */
static expression rest_of(struct graph *g, const struct segment *segment, bool has_strains, int turn,
                          expression dl) {
    expression w[3];
    for (int i = 0; i < 3; i++)
        w[i] = expr_mul(g, segment->curvature[i], dl);
    const expression other = expr_mul(g, w[(turn + 1) % 3], w[(turn + 2) % 3]);
    const expression half = expr_mul(g, expr_number(g, 0.5), other);
    if (!has_strains)
        return w[turn];
    return turn == 1 ? expr_sub(g, w[turn], half) : expr_add(g, w[turn], half);
}

static struct joint element_joint(struct expansion *x, const struct link *link, const struct segment *segment,
                                  int turn) {
    struct graph *g = x->g;
    const expression dl = spacing(g, segment);
    struct joint joint = {
        .is_revolute = true, .axis = turn_axes[turn], .name = turn_names[turn], .place = link->place};
    joint.stiffness = element_stiffness(g, segment, turn, dl);
    joint.damping = expr_add(g, expr_mul(g, segment->eta, joint.stiffness), segment->damping[turn]);
    joint.rest = joint.start = rest_of(g, segment, link->beam.has_strains, turn, dl);
    const char *deformation = deformation_name(segment, turn);
    graph_name_shared(g, joint.stiffness, link->name, memory_format(x->memory, "stiffness_%s", deformation));
    graph_name_shared(g, joint.damping, link->name, memory_format(x->memory, "damping_%s", deformation));
    return joint;
}

/* The spring-damping element before element r: up to three turns at one point, R = Rz Ry Rx. */
static void add_element_joints(struct expansion *x, const struct link *link, const struct segment *segment,
                               int r, struct fixed_frame *at) {
    for (int turn = 0; turn < 3; turn++) {
        if (!link->beam.keeps[turn])
            continue;
        const struct joint joint = element_joint(x, link, segment, turn);
        struct frame *frame = frames_add(x, at, &joint);
        frame->link = (int)(link - x->model->links);
        frame->element = r;
        frame->has_strains = link->beam.has_strains;
        frame->turn = link->beam.has_strains ? turn : 0;
        frame->name = memory_format(x->memory, "%s_%s_%d", link->name, turn_names[turn], r);
    }
}

/* Adds one element from the carrier's tip on. The entry after the last element has the beam's whole
 * length. */
static void add_element(struct expansion *x, struct carrier *carrier, const struct segment *segment,
                        expression length) {
    struct element *element = &carrier->elements[carrier->element_count++];
    const struct placement end = placement_shift_x(length);
    frames_add_inertia(x, (int)(carrier - x->tree->carriers), &carrier->tip,
                       prism_inertia(x->g, segment, length));
    element[0].at = carrier->tip;
    element[1].start = expr_add(x->g, element[0].start, length);
    carrier->tip.placement = placement_compose(x->g, &carrier->tip.placement, &end);
}

/* Adds the elements of one segment from the carrier's tip on, with half elements at both ends. */
static void add_segment(struct expansion *x, const struct link *link, const struct segment *segment,
                        int *number_of_sde, struct carrier *carrier) {
    struct graph *g = x->g;
    const expression dl = spacing(g, segment);
    const expression half = segment->rfe > 1 ? expr_mul(g, expr_number(g, 0.5), dl) : dl;
    graph_name_shared(g, dl, link->name, "element_length");
    for (int r = 0; r < segment->rfe; r++) {
        if (r > 0)
            add_element_joints(x, link, segment, ++*number_of_sde, &carrier->tip);
        add_element(x, carrier, segment, r == 0 || r == segment->rfe - 1 ? half : dl);
    }
}

void rigid_finite_elements_add(struct expansion *x, const struct link *link, struct carrier *carrier) {
    int count = 0, number_of_sde = 0;
    for (int i = 0; i < link->beam.segment_count; i++)
        count += link->beam.segments[i].rfe;
    carrier->elements = memory_get(x->memory, ((size_t)count + 1) * sizeof *carrier->elements);
    for (int i = 0; i < link->beam.segment_count; i++)
        add_segment(x, link, &link->beam.segments[i], &number_of_sde, carrier);
}
