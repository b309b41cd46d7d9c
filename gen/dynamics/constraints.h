/*
 * Programme constraints: from residuals in symbols to the rows of the motion equations.
 *
 * Takes the rows of the model (residuals of time, coordinates, rates and points), gives u, v, phi, psi, k
 * (theory, sect. 6.1 to 6.3). One rule serves all levels: d/dt of a symbol of order o is the symbol of order
 * o + 1, at qdd = 0; the coefficients u come from coordinate_derivatives.h.
 */
#ifndef REFDYN_GEN_CONSTRAINTS_H
#define REFDYN_GEN_CONSTRAINTS_H

#include "dynamics/kinematics.h"

struct row_terms {
    expression *u;             /* n coefficients */
    expression v, phi, psi, k; /* u qdd + v = 0; residuals; stabilised right side */
    expression *pull;          /* gradient by the coordinates themselves, by frame */
    struct vector *pulls;      /* and by each point, ground frame: u = pull + C^T pulls */
};

/* 2 alpha and beta^2: values of the parameter struct, which the runtime may replace. */
expression constraints_rate_gain(struct graph *g, const struct row *row);
expression constraints_position_gain(struct graph *g, const struct row *row);

struct row_terms *constraints_derive(const struct kinematics *k);

#endif
