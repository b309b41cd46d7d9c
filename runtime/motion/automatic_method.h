/* The automatic method: a choice by trial. */
#ifndef REFDYN_AUTOMATIC_METHOD_H
#define REFDYN_AUTOMATIC_METHOD_H

#include "motion/motion.h"

/* Begins the first trial; at the start of a motion. */
void refdyn_automatic_start(struct refdyn_motion *motion);
/* After an accepted step: counts, judges, and asks for another method (its `next`) where that is due.
 */
void refdyn_automatic_after_step(struct refdyn_motion *motion);
/* The tolerance that the method in use needs for an error as that of the others. */
double refdyn_automatic_tolerance(const struct refdyn_motion *motion);
/* After a step that could not be evaluated; 1: the automatic choice has gone over to the explicit method,
 * since the tangent at the begin of the step is not finite, which no smaller step changes. */
int refdyn_automatic_after_failure(struct refdyn_motion *motion);
/* The motion goes on from a time before the end of its last step, by `back` [s]. */
void refdyn_automatic_go_back(struct refdyn_motion *motion, double back);
/* Takes up the method that was asked for. */
void refdyn_automatic_take_up(struct refdyn_motion *motion);

#endif
