/*
 * The motion at given accelerations, and the vectors of joints from which exact derivatives of forces and
 * inertia are computed.
 */
#ifndef REFDYN_GEN_TANGENT_H
#define REFDYN_GEN_TANGENT_H

#include "gen/dynamics/dynamics.h"

/* ---- The motion at given accelerations: theory, sect. 7.1 and 7.2 ---- */

/* The state that the outward recursion carries from frame to frame. */
struct given_frame_motion {
    struct vector angular;                /* dw/dt, own axes [rad/s^2] */
    struct vector less_gravity;           /* acceleration of the origin minus gravity, own axes [m/s^2] */
    struct vector velocity, acceleration; /* of the origin in the ground frame */
    struct vector pending_rate; /* of a frame without a joint: added to the way_rate of the next joint */
};

struct given_frame_rates {
    struct vector shift_rate, shift_rate2; /* of the shift from the parent, in its axes; 0 on the ground */
    struct vector way_rate;                /* of the vector from the previous joint, ground axes */
    struct vector own_rate, own_rate2;     /* de/dt, d2e/dt2, own axes */
    struct vector axis, axis_rate, axis_rate2; /* the joint's axis e, de/dt, d2e/dt2 in the ground frame */
};

struct given_motion {
    const struct kinematics *k;
    bool is_resting;                    /* at qd = 0 and qdd = 0; then there are no `motions` */
    const expression *accelerations;    /* by frame */
    const expression *multipliers;      /* values of their symbols, or NULL */
    struct given_frame_motion *motions; /* by frame */
    struct given_frame_rates *frames;
    struct vector *points;        /* accelerations */
    struct column_rates *columns; /* by point, made when first requested */
};

struct given_motion *given_motion_derive(const struct kinematics *k, const expression *accelerations,
                                         const expression *multipliers);
/* B = [wd]x + [w]x [w]x of a frame, own axes [1/s^2]. */
struct matrix given_motion_gradient(const struct given_motion *given, int i);
/* The motion at rest. */
struct given_motion *given_motion_at_rest(const struct kinematics *k);
/* Replaces symbols by the motion: points, accelerations of coordinates, multipliers. */
expression given_motion_place(const struct given_motion *given, expression e);
struct vector given_motion_place_vector(const struct given_motion *given, struct vector v);
/* Derivatives of e, in symbols, by the coordinates' values (order 0) or rates (order 1), by frame. */
expression *given_motion_derivatives(struct given_motion *given, expression e, int order);

/* ---- Forces, rows and vectors of joints: theory, sect. 7.3 to 7.6 ---- */

/* Forces on coordinates, at points and on bodies, in symbols, without springs and dampers. Their
 * generalized forces are F . C_i and T . e_i: theory, sect. 7.3. */
struct applied_forces {
    bool has_springs;        /* springs and dampers on all coordinates act, too */
    expression *coordinates; /* forces by frame; the frame is in no run */
    struct vector *points;   /* by point: a force F there, or the factor of a direction's columns */
    struct vector *torques;  /* by point: a torque T on the body that carries it */
};

struct applied_forces *tangent_no_forces(const struct kinematics *k);
/* Springs, dampers and the forces of the author. */
void tangent_add_applied_forces(const struct kinematics *k, struct applied_forces *applied_forces);
/* u^T lambda: lambda times the gradient of each row's residual by its symbols of highest order. */
void tangent_add_row_forces(const struct kinematics *k, struct applied_forces *applied_forces);
/* One row in symbols: the residuals, and u qdd - k with its stabilisation. */
struct row_symbols {
    expression phi, psi, balance;
};
struct row_symbols tangent_row_symbols(const struct kinematics *k, int row);
/* u qdd - k of all rows. */
expression *tangent_row_balances(const struct kinematics *k);
/* Generalized forces of the applied forces, by frame. */
expression *tangent_generalized_forces(const struct given_motion *given,
                                       const struct applied_forces *applied_forces);

/* Vectors of one coordinate, about its own origin, in the ground frame. Near ones are motions of joint j,
 * far ones wrenches of a coordinate i beyond it (theory, sect. 7.4; plan.h). */
struct pair_vectors {
    struct vector less_gravity_lever; /* near: (acceleration - gravity) x e */
    struct wrench mass;               /* (int rho x C_i, int C_i) */
    struct vector spin;               /* int rho' x C_i */
    struct wrench stiffness, damping; /* the same for C_i'' and C_i'; in `stiffness` the load turns with i */
};
/* By frame, from the inertia beyond each joint. */
struct pair_vectors *tangent_pair_vectors(const struct given_motion *given, const struct inertia *composites);
/* M qdd + c + g at the given accelerations, by frame. */
expression *tangent_inertia_forces(const struct given_motion *given);
/* Sums over mass, own axes, with arms rho from the origin: theory, sect. 7.5. */
struct flow {
    struct vector momentum; /* b = int rho' dm */
    struct matrix growth;   /* E = int rho' rho^T dm */
    struct wrench load;     /* L = (int rho x (rdd - grav) dm, int (rdd - grav) dm) */
};
/* Of the body that moves with frame i. */
struct flow tangent_own_flow(const struct given_motion *given, int i);

/* ---- Derivatives of accelerations, column by column: theory, sect. 7.7 ---- */

/* One column of derivatives by q or qd, ground axes, moments about the joint's origin. */
struct acceleration_column {
    struct vector spin; /* beta, the change of the angular velocity of everything beyond the joint */
    struct vector push_moment, push_force;     /* the wrench that the stage passes on */
    struct vector start_angular, start_linear; /* A, the change of acceleration after the stage */
    struct vector own;                         /* derivatives of the accelerations of the stage's joints */
};

/* Values of joint i, ground axes. In a single joint x = -(hold . A + hold_spin . beta + hold_turned . gamma)
 * and A gains `turn` x. In a ball joint the values of its joint number r are row r of A_angular =
 * -(hold_force A_linear + hold_spin beta + hold_turned gamma), and x = turn . (change of A_angular). */
struct acceleration_columns {
    struct acceleration_column by[2];          /* by q, qd */
    struct vector turn;                        /* e, or row r of the matrix from turns to coordinates */
    struct vector turned;                      /* gamma: e of a revolute joint, else 0 */
    struct vector hold_moment, hold_force;     /* U / D, or 0 and row r of J^-1 H */
    struct vector hold_spin, hold_turned;      /* the same for the changes of velocity and of direction */
    struct vector start_angular, start_linear; /* the acceleration after the stage by a unit force at i */
    /* Only of a frame that carries several branches: its (angular, linear) acceleration by a unit moment
     * along x, y, z and a unit force along x, y, z. */
    struct wrench units[6];
};

/* Returns whether a frame carries several branches. */
bool acceleration_columns_branch(const struct tree *tree, int frame);
/* The stages of an elimination and the changes `own` of the required force of each joint by the coordinates
 * of its stage, by q and qd and by frame. Returns the columns by frame. */
struct acceleration_columns *acceleration_columns_derive(const struct given_motion *given,
                                                         const struct elimination *elimination,
                                                         const struct applied_forces *applied_forces,
                                                         struct vector *const own[2]);

#endif
