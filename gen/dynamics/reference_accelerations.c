/*
 * Reference accelerations: the inertia and gravity of each body are loads at these accelerations, while the
 * recursion for M x = f computes the differences of the true accelerations from them.
 *
 * Input: kinematics and the elimination. Output: accelerations by frame (theory, sect. 5.5). They are the
 * bias accelerations, at qdd = 0, except for dw/dt after a ball joint. No joint restricts the accelerations
 * there, so that any reference is valid, and dw/dt = 0 need not be turned from frame to frame. The joint's
 * coordinates then include the omitted part of dw/dt (ball_coordinates in articulated_body.c). With a force
 * on each coordinate of the manipulator, qdd_free took 14 to 16 % longer with bias accelerations alone.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

/* w of frame i. The motion of an ENTRY is that of the previous element in its loop, so that its w comes
 * from its parent's. */
static struct vector angular_velocity(const struct kinematics *k, int i) {
    const struct frame *frame = &k->tree->frames[i];
    const struct vector still = {{0, 0, 0}};
    if (frame->kind == FRAME_JOINT)
        return k->frames[i].angular;
    return kinematics_to_child(k, i, frame->parent < 0 ? still : k->frames[frame->parent].angular);
}

/* wdr = E wdr_p + w x e qd, 0 after a ball joint; ar = E (ar_p + B_p s) + 2 w x e qd: theory, sect. 5.5. */
static struct reference refer(const struct kinematics *k, const struct elimination *elimination, int i,
                              const struct reference *parent) {
    struct graph *g = k->g;
    const struct frame *frame = &k->tree->frames[i];
    kinematics_remark(k, i, "reference accelerations wdr, ar (5.5)");
    const struct vector across = matrix_times(g, parent->gradient.at, k->joints[i].shift);
    struct reference own = {.angular = kinematics_to_child(k, i, parent->angular),
                            .linear = kinematics_to_child(k, i, vector_add(g, parent->linear, across))};
    const struct vector none = {{0, 0, 0}};
    if (articulated_body_ends_ball(elimination, i))
        own.angular = none;
    else if (frame->kind == FRAME_JOINT && frame->joint.is_revolute)
        own.angular = kinematics_gyroscopic(k, i, own.angular);
    else if (frame->kind == FRAME_JOINT)
        own.linear =
            vector_add(g, own.linear, kinematics_gyroscopic(k, i, kinematics_gyroscopic(k, i, none)));
    own.gradient = kinematics_acceleration_gradient(g, angular_velocity(k, i), own.angular);
    kinematics_name_vector(k, i, "reference_wd", own.angular);
    kinematics_name_vector(k, i, "reference_a", own.linear);
    return own;
}

struct reference *reference_accelerations_derive(const struct kinematics *k,
                                                 const struct elimination *elimination) {
    const struct reference ground = {
        .linear = vector_scale(k->g, expr_neg(k->g, EXPR_ONE), vector_of(k->model->gravity))};
    struct reference *list = memory_get(k->memory, ((size_t)k->tree->count + 1) * sizeof *list);
    struct recursion recursion = kinematics_recursion(k, list, sizeof *list);
    for (int i = -1; recursion_outward(&recursion, &i);) {
        const int parent = k->tree->frames[i].parent;
        list[i] = refer(k, elimination, i, parent < 0 ? &ground : &list[parent]);
    }
    return list;
}
