/*
 * Programme constraints: from residuals in symbols to the rows of the motion equations.
 *
 * Takes the rows of the model (residuals of time, coordinates, rates and points), gives u, v, phi, psi, k
 * (formulation, sect. 3 and 4). One rule serves all levels: d/dt of a symbol of order i is the symbol of
 * order i + 1, at qdd = 0; the coefficients u come from coordinate_derivatives.h.
 */
#ifndef REFDYN_GEN_CONSTRAINTS_H
#define REFDYN_GEN_CONSTRAINTS_H

#include "dynamics/kinematics.h"

struct row_terms {
    expression *u;             /* n coefficients */
    expression v, phi, psi, k; /* u qdd + v = 0; residuals; stabilised right side */
    expression *pull;          /* gradient by the coordinates themselves, by frame */
    struct vector *pulls;      /* and by each point, ground axes: u = pull + C^T pulls */
};

/* 2 alpha and beta^2, in p where the runtime may replace them. */
expression constraints_rate_gain(struct graph *g, const struct row *row);
expression constraints_position_gain(struct graph *g, const struct row *row);

struct row_terms *constraints_derive(const struct kinematics *k);

#endif
