/*
 * Jumps of forces that lead back to themselves, as Coulomb's friction by a sign, or a relay on a rate: a
 * motion slides along such a jump, where the formulas say nothing (Filippov, Differential Equations with
 * Discontinuous Righthand Sides, 1988, ch. 1), and steps go to and fro without end.
 */
#ifndef REFDYN_SLIDING_H
#define REFDYN_SLIDING_H

#include "motion/motion.h"

/* Before a step whose begin state_events.h knows: SLIDES where so many short steps have stayed at such a jump
 * that it is not left. */
int refdyn_sliding_look(struct refdyn_motion *motion);

#endif
