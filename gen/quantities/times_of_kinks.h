/*
 * Times at which formulas of time alone have kinks or jumps: an integrator ends a step there.
 *
 * Takes the functions of a plan and what changes sign in their minima, maxima, absolute values and
 * comparisons of time, parameters and inputs alone. Gives plan->breaks, the zeros of those that are piecewise
 * linear in t, expressions without t, and plan->switches, the others themselves, whose zeros are searched for
 * in a motion.
 */
#ifndef REFDYN_GEN_TIMES_OF_KINKS_H
#define REFDYN_GEN_TIMES_OF_KINKS_H

#include "plan/plan.h"

void time_events_find(struct plan *plan);

#endif
