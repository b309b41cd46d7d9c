/*
 * The motion at given accelerations of the coordinates, and its derivatives by one coordinate at a time while
 * those accelerations stay the same: what exact derivatives of the equations are made of.
 *
 * Takes kinematics and accelerations by frame, gives the accelerations of frames and points and, for an
 * expression in symbols, its derivatives by q and qd (theory, sect. 7.1 and 7.2). The columns of C and their
 * first two time derivatives suffice: a point's symbol of order i has the derivative
 * (i over o) d^(i-o)C_j/dt^(i-o) by coordinate j's symbol of order o, since r = r(q, t) makes derivatives by
 * q and by t commute.
 */
#ifndef REFDYN_GEN_GIVEN_MOTION_H
#define REFDYN_GEN_GIVEN_MOTION_H

#include "dynamics/kinematics.h"

/* What a recursion outward carries from frame to frame. */
struct given_frame_motion {
    struct vector angular;                /* dw/dt, own axes [rad/s^2] */
    struct vector less_gravity;           /* acceleration of the origin minus gravity, own axes [m/s^2] */
    struct vector velocity, acceleration; /* of the origin in the ground frame */
    struct vector pending_rate;           /* of a frame without a joint: added to the next one's way_rate */
};

struct given_frame_rates {
    struct vector shift_rate, shift_rate2;     /* of the shift from the parent, its axes; 0 on the ground */
    struct vector way_rate;                    /* of the way from the joint before, ground axes */
    struct vector own_rate, own_rate2;         /* de/dt, d2e/dt2, own axes */
    struct vector axis, axis_rate, axis_rate2; /* the joint's axis e, de/dt, d2e/dt2 in the ground frame */
};

/* C_j, dC_j/dt and d2C_j/dt2 of one point or direction: a column a frame. */
struct column_rates {
    struct vector *by_order[3];
};

struct given_motion {
    const struct kinematics *k;
    bool is_resting;                    /* no velocities and accelerations: no frames either */
    const expression *accelerations;    /* by frame */
    const expression *multipliers;      /* what their symbols stand for, or NULL */
    struct given_frame_motion *motions; /* by frame */
    struct given_frame_rates *frames;
    struct vector *points;        /* accelerations */
    struct column_rates *columns; /* by point, made when first asked for */
};

struct given_motion *given_motion_derive(const struct kinematics *k, const expression *accelerations,
                                         const expression *multipliers);

/* B = [wd]x + [w]x [w]x of a frame, own axes [1/s^2]. */
struct matrix given_motion_gradient(const struct given_motion *given, int i);
/* At rest. */
struct given_motion *given_motion_at_rest(const struct kinematics *k);
/* Symbols replaced by the motion: points, accelerations of coordinates, multipliers. */
expression given_motion_place(const struct given_motion *given, expression e);
struct vector given_motion_place_vector(const struct given_motion *given, struct vector v);
/* Derivatives of e, in symbols, by the coordinates' values (order 0) or rates (order 1), by frame. */
expression *given_motion_derivatives(struct given_motion *given, expression e, int order);

#endif
