/* What happens at events of the state: impacts, rates, inputs and parameters that they set. */
#ifndef REFDYN_EVENT_ACTIONS_H
#define REFDYN_EVENT_ACTIONS_H

#include "motion/motion.h"

/*
 * Before a step: what is due happens at its begin, and the motion goes on from there. Then other events may
 * be due, of which the caller is told first. Errors: EVENTS_ACCUMULATE; EVENT_NOT_MET; SLIDES; those of
 * refdyn_accelerate and, where rows are met by projection, of refdyn_project.
 */
int refdyn_event_actions_take(struct refdyn_motion *motion);

#endif
