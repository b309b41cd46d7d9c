/*
 * Times at which formulas of time alone have kinks or jumps: an integrator ends a step there.
 *
 * Takes the functions of a plan, gives plan->breaks: expressions of parameters, each the zero of what changes
 * sign in a minimum, maximum, absolute value or comparison, where that is piecewise linear in t. Others are
 * not found.
 */
#ifndef REFDYN_GEN_BREAKS_H
#define REFDYN_GEN_BREAKS_H

#include "plan.h"

void find_breaks(struct plan *plan);

#endif
