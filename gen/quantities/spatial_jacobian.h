/*
 * The spatial Jacobian of points of interest that ask for it (`angular = true`): the quantities J and Jd_qd.
 *
 * Takes kinematics, gives for each such point, in their order, six rows: velocity of the point, then angular
 * velocity of what carries it, both in the ground's axes, (rd, w) = J qd and (rdd, wd) = J qdd + Jd_qd.
 * Theory, sect. 4.4.
 */
#ifndef REFDYN_GEN_SPATIAL_JACOBIAN_H
#define REFDYN_GEN_SPATIAL_JACOBIAN_H

#include "quantities/quantities.h"

bool spatial_jacobian_exists(const struct derivation *d);
void spatial_jacobian_build(struct derivation *d, struct function *f);
void spatial_jacobian_build_drift(struct derivation *d, struct function *f);

#endif
