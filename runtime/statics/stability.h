/*
 * Is an equilibrium stable?
 *
 * Takes the tangent H of what the rows leave free (balance.h); gives in how many directions the stiffness
 * S = -(H + H^T)/2 is negative, or zero. Where forces have a potential, H is symmetric, and an equilibrium is
 * stable where that has a minimum (Lagrange and Dirichlet): no such direction. The signs do not depend on
 * masses (Sylvester). Where H is not symmetric, as with follower loads, growing modes of the linear motion
 * are counted (linear_motion.h). Where the model has no tangent for that, S is judged nevertheless: if it is
 * positive, the motion cannot leave the state without oscillating; oscillations may still grow.
 */
#ifndef REFDYN_STABILITY_H
#define REFDYN_STABILITY_H

#include "statics/balance.h"

/* S = D V values V^T D, in the room of a balance: D units by which its entries are at most about 1, V one
 * vector a column. */
struct spectrum {
    double *size;          /* (count - rank) D */
    double *values;        /* (count - rank) in no order */
    double *vectors;       /* (count - rank)^2 V */
    int unstable, neutral; /* values below and at 0 */
    int is_symmetric;      /* H was */
};

/* Of balance->stiffness; H, tangent and what was read of `trial` are overwritten. */
void refdyn_stability_find_spectrum(struct balance *balance, struct spectrum *spectrum);
/* y (count - rank) along the lowest of the values. */
void refdyn_stability_lowest(const struct balance *balance, const struct spectrum *spectrum, double *y);
/* After refdyn_newton_solve. Sets unstable, neutral, has_potential, criterion and unstable_coordinate of the
 * result. */
void refdyn_stability_judge(struct balance *balance, struct refdyn_statics_result *result);

#endif
