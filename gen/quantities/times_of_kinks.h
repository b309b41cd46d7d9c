/*
 * Times at which formulas of time alone have kinks or jumps: an integrator ends a step there.
 *
 * Takes the functions of a plan and what changes sign in their minima, maxima, absolute values and
 * comparisons of time, parameters and inputs alone, and such values of events. Gives plan->breaks, the zeros
 * of those that are piecewise linear in t, as expressions without t. The others themselves are
 * plan->switches, whose zeros are searched for in a motion, and plan->pace is their largest frequency.
 */
#ifndef REFDYN_GEN_TIMES_OF_KINKS_H
#define REFDYN_GEN_TIMES_OF_KINKS_H

#include "plan/plan.h"

/* The comparison e says whether rounding alone is left of something: it is no kink of the model. Before
 * time_events_find. */
void time_events_leave_out(struct plan *plan, expression e);
void time_events_find(struct plan *plan);

#endif
