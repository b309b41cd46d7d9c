/*
 * Times at which formulas of time alone have kinks or jumps: an integrator ends a step there.
 *
 * Takes the functions of a plan. Their minima, maxima, absolute values and comparisons, and events, have
 * values that change sign; those that depend on time, parameters and inputs alone are collected here. Of
 * values that are piecewise linear in t, plan->breaks has the zeros, as expressions without t. The other
 * values are plan->switches, whose zeros are searched for in a motion; plan->pace is their largest frequency.
 */
#ifndef REFDYN_GEN_TIMES_OF_KINKS_H
#define REFDYN_GEN_TIMES_OF_KINKS_H

#include "plan/plan.h"

/* The comparison e says whether rounding alone is left of something: it is no kink of the model. Before
 * time_events_find. */
void time_events_leave_out(struct plan *plan, expression e);
void time_events_find(struct plan *plan);

#endif
