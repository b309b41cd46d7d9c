/*
 * Curves on which a programme holds points of interest, as JSON: of each position row that is a formula in
 * two components of one point, and in nothing else, the curve through the place where the motion begins.
 *
 *     "curves": [{"point": , "axes": [0, 1], "closed": true, "path": [x, y, x, y, ...]}, ...]
 *
 * By steps along the tangent of phi(x, y) = 0, each brought back by Newton's method.
 */
#ifndef REFDYN_TOOL_PROGRAMME_CURVES_H
#define REFDYN_TOOL_PROGRAMME_CURVES_H

#include "figures/recorded_motion.h"
#include "gen.h"

#include <stdio.h>

void programme_curves_put(FILE *out, struct generation *generation, const struct run *run);

#endif
