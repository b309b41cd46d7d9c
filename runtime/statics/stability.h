/*
 * Is an equilibrium stable?
 *
 * Takes the tangent H of what the rows leave free (balance.h); gives in how many directions the stiffness -H
 * is negative, or zero. Where forces have a potential, H is symmetric, and the equilibrium is stable when its
 * potential has a minimum (Lagrange and Dirichlet): no such direction. The signs do not depend on masses
 * (Sylvester). Where H is not symmetric, as with follower loads, the symmetric part is judged: positive, it
 * excludes that the state is left without oscillation, and no more.
 */
#ifndef REFDYN_STABILITY_H
#define REFDYN_STABILITY_H

#include "statics/balance.h"

/* Into result: unstable, neutral, has_potential, unstable_coordinate. After newton_solve; H and tangent are
 * overwritten. */
void stability_judge(struct balance *balance, struct refdyn_statics_result *result);

#endif
