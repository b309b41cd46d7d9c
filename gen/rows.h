/*
 * Programme constraints and author's forces: from residuals in symbols to expressions in q and qd.
 *
 * Takes the rows and forces of the model (in symbols of coordinates, rates and points), gives u, v, phi, psi,
 * k and generalized forces (formulation, sect. 3 and 4). One rule serves all levels: d/dt of a symbol of
 * order i is the symbol of order i + 1, at qdd = 0, and the coefficient of coordinate j at order i is the
 * derivative by its symbol of that order plus, for each point, the derivative by the point's symbols times
 * column j of C.
 */
#ifndef REFDYN_GEN_ROWS_H
#define REFDYN_GEN_ROWS_H

#include "kinematics.h"

struct row_terms {
    expression *u;             /* n coefficients */
    expression v, phi, psi, k; /* u qdd + v = 0; residuals; stabilised right side */
};

struct row_terms *derive_rows(const struct kinematics *k);

/* Author's forces, dampers and springs in Q, each n long. */
expression *derive_author_forces(const struct kinematics *k);
expression *derive_spring_forces(const struct kinematics *k); /* -s (q - rest) */
expression *derive_damper_forces(const struct kinematics *k); /* -d qd */

/* Derivatives at qd = 0 of the author's forces by q (n x n, row: force). */
expression *derive_author_tangent(const struct kinematics *k);
/* sum_j qd_j dQ_j/dqd_i: the printed form's extra term. */
expression *derive_printed_rates(const struct kinematics *k);

/* Symbols of points replaced by their kinematics. */
expression with_points(const struct kinematics *k, expression e);

#endif
