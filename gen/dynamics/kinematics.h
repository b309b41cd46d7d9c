/*
 * Kinematics: rotations, angular velocities and bias accelerations of all frames, from the base outward.
 *
 * Takes the tree, gives expressions in each frame's own axes (theory, sect. 4.1 to 4.4). A bias acceleration
 * is the acceleration at qdd = 0, sum_jk T_jk qd_j qd_k of theory, sect. 2.1. Points are in the ground frame.
 */
#ifndef REFDYN_GEN_KINEMATICS_H
#define REFDYN_GEN_KINEMATICS_H

#include "tree/recursion.h"
#include "tree/vector.h"

struct joint_place {
    expression sine, cosine; /* of a turn's angle */
    struct vector shift;     /* origin in the parent's axes, from the parent's origin [m] */
};

struct frame_motion {
    expression cosine,
        sine;              /* of the angle from the frame's axes to those of its body: see parallel_axes.h */
    struct vector angular; /* angular velocity w [rad/s] */
    struct vector linear;  /* velocity of the origin [m/s] */
    struct vector bias_angular;      /* dw/dt at qdd = 0 [rad/s^2] */
    struct vector bias_linear;       /* acceleration of the origin at qdd = 0 [m/s^2] */
    struct vector bias_less_gravity; /* the same minus gravity: what an accelerometer would show [m/s^2] */
    struct matrix gradient;          /* B, of bias_linear in space: B r = wd0 x r + w x (w x r) [1/s^2] */
    struct vector gravity;           /* the field, in own axes [m/s^2] */
    struct matrix rotation;          /* axes in the ground frame */
    struct vector position;          /* origin in the ground frame [m] */
};

/* Of a point, or of a direction: then r is the vector itself. */
struct point_motion {
    struct vector r, rd, d; /* position, velocity, bias acceleration: rdd = C qdd + d */
    struct vector *columns; /* C: a column a frame, zero off the point's path */
};

struct kinematics {
    struct graph *g;
    struct memory *memory;
    const struct tree *tree;    /* rolled: see roll.h */
    struct joint_place *joints; /* by frame */
    struct frame_motion *frames;
    struct point_motion *points;
    const struct model *model;
};

void kinematics_derive(struct memory *memory, const struct model *model, const struct tree *tree,
                       struct kinematics *kinematics);

/* A recursion over its frames: see recursion_over. */
struct recursion kinematics_recursion(const struct kinematics *k, void *state, size_t size);
/* q, qd or qdd of frame i; in a run those of the element that the loop is at. */
expression kinematics_coordinate_of(const struct kinematics *k, int i, int order);
/* Is frame `outer` on the way from frame i to the ground, i itself included? */
bool kinematics_is_on_path(const struct kinematics *k, int outer, int i);
/* B = [wd]x + [w]x [w]x, which makes a + B r the acceleration at r from that of the origin, a: taken once a
 * frame, for its centre and for all that it carries. */
struct matrix kinematics_acceleration_gradient(struct graph *g, struct vector w, struct vector wd);
/* wd + w x e qd for the axis e of joint i, own axes: dw/dt behind a revolute joint at qdd = 0. Twice the same
 * term is what a prismatic joint adds to the acceleration of the origin (theory, sect. 4.3). */
struct vector kinematics_gyroscopic(const struct kinematics *k, int i, struct vector wd);
/* The axis of joint i in the ground frame. */
struct vector kinematics_joint_axis(const struct kinematics *k, int i);
/* A free vector, and a tensor, from the axes of frame i's body, -1: the ground, into its own. */
struct vector kinematics_from_body(const struct kinematics *k, int i, struct vector a);
struct tensor kinematics_tensor_from_body(const struct kinematics *k, int i, struct tensor t);
/* A free vector from the axes of frame i's parent into its own, and back. */
struct vector kinematics_to_child(const struct kinematics *k, int i, struct vector a);
struct vector kinematics_to_parent(const struct kinematics *k, int i, struct vector a);
struct tensor kinematics_tensor_to_parent(const struct kinematics *k, int i, struct tensor t);
/* The same in a few more operations of which fewer wait for each other: for long recursions. */
struct tensor kinematics_tensor_to_parent_quickly(const struct kinematics *k, int i, struct tensor t);

/*
 * d of a point, in the ground frame, from the acceleration of its frame's origin minus gravity and from B:
 * for callers whose recursion has both anyway. For a direction from B alone. Theory, sect. 4.4.
 */
struct vector kinematics_acceleration_less_gravity(const struct kinematics *k, int point,
                                                   struct vector less_gravity, const struct matrix *gradient);

/* By frame: the joint's origin from that of the joint before, ground axes. */
struct vector *kinematics_ground_shifts(const struct kinematics *k);

/* "arm_psi: <formula>", for a reader of the C. */
void kinematics_remark(const struct kinematics *k, int i, const char *formula);
/* Names for a reader of the C: "arm_psi_1_<what>_x" ... */
void kinematics_name_vector(const struct kinematics *k, int i, const char *what, struct vector a);
/* Rows of a matrix: "<what>_x_x", "<what>_x_y" ... */
void kinematics_name_matrix(const struct kinematics *k, int i, const char *what, const struct matrix *m);
void kinematics_name_scalar(const struct kinematics *k, int i, const char *what, expression e);

#endif
