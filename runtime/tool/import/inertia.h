/*
 * Mass data of rigid bodies as plain numbers.
 *
 * The second moments of a body are the symmetric 4x4 matrix J = int p p^T dm of p = (x, y, z, 1): mass,
 * first moments and int r r^T dm in one. They add up, and there is a body with given J exactly where J has no
 * negative eigenvalue. Source: Wensing, Kim, Slotine (2018), Linear matrix inequalities for physically
 * consistent inertial parameter identification, eq. (8) to (12).
 */
#ifndef REFDYN_TOOL_INERTIA_H
#define REFDYN_TOOL_INERTIA_H

#include <stdbool.h>

struct pose;

/* A body: its centre [m] and, about it, xx yy zz xy xz yz [kg m^2], along the axes of one frame. */
struct body {
    double mass, center[3], inertia[6];
};

/* Rz(rpy[2]) Ry(rpy[1]) Rx(rpy[0]), by rows. */
void rotation_of_rpy(const double rpy[3], double R[9]);
/* Tensor xx yy zz xy xz yz along axes that R turns into those of the result. */
void inertia_turn(const double R[9], const double tensor[6], double turned[6]);

/* By rows. The mass of `body_of` has to be positive. */
void second_moments(const struct body *body, double J[16]);
struct body body_of(const double J[16]);

/* The largest s for which A - s B is that of a body; 0 where A itself is of none. B is that of a body. */
double second_moments_share(const double A[16], const double B[16]);

/* Makes a tensor that no body has the nearest one, in second moments, that a body has; true: it was none. */
bool inertia_mend(double inertia[6]);

#endif
