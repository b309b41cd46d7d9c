/*
 * How an expression in symbols changes with the coordinates: the one rule behind rows, forces and tangents.
 *
 * Takes an expression of time, coordinates and points, gives its n derivatives by the coordinates' values,
 * rates or accelerations. A point's symbol of order i moves with the coordinates of order i by the columns of
 * C, at every order.
 */
#ifndef REFDYN_GEN_SENSITIVITY_H
#define REFDYN_GEN_SENSITIVITY_H

#include "kinematics.h"

/* Derivatives of e by the symbols of one order: a coordinate a frame, then three for each point; still in
 * symbols. */
expression *symbol_gradient(const struct kinematics *k, expression e, int order);

/* The same with the symbols replaced by the kinematics. */
expression *placed_gradient(const struct kinematics *k, expression e, int order);

/* The same as derivatives by the coordinates of all frames, points by their kinematics; `resting`: at qd = 0.
 */
expression *coefficients_of(const struct kinematics *k, expression e, int order, bool resting);

/* Symbols of points replaced by their kinematics, accelerations at qdd = 0. */
expression with_points(const struct kinematics *k, expression e);
/* The same at qd = 0. */
expression at_rest(const struct kinematics *k, expression e);

#endif
