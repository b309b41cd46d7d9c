/*
 * Derivatives of an expression in symbols by the coordinates: theory, sect. 6.2, for rows, forces and
 * tangents.
 *
 * Takes an expression of time, coordinates and points, gives its n derivatives by the coordinates' values,
 * rates or accelerations. A point's symbol of order o changes with the coordinates of order o by the columns
 * of C, at every order.
 */
#ifndef REFDYN_GEN_COORDINATE_DERIVATIVES_H
#define REFDYN_GEN_COORDINATE_DERIVATIVES_H

#include "dynamics/kinematics.h"

/* Derivatives of e by the symbols of one order: one for each frame's coordinate, then three for each point;
 * still in symbols. */
expression *coordinate_derivatives_symbol_gradient(const struct kinematics *k, expression e, int order);

/* The same with the symbols replaced by the kinematics. */
expression *coordinate_derivatives_placed_gradient(const struct kinematics *k, expression e, int order);

/* The same as derivatives by the coordinates of all frames, points by their kinematics; `resting`: at qd = 0.
 */
expression *coordinate_derivatives_coefficients(const struct kinematics *k, expression e, int order,
                                                bool resting);

/* d/dt of an expression in symbols at qdd = 0, in symbols: theory, sect. 6.2. */
expression coordinate_derivatives_rate(const struct kinematics *k, expression e);

/* Symbols of points replaced by their kinematics, accelerations at qdd = 0. */
expression coordinate_derivatives_with_points(const struct kinematics *k, expression e);
/* The same at qd = 0. */
expression coordinate_derivatives_at_rest(const struct kinematics *k, expression e);

#endif
