/* The automatic choice of a method. */
#ifndef REFDYN_CHOOSE_H
#define REFDYN_CHOOSE_H

#include "../refdyn.h"

/* Begins the first trial; at the start of a motion. */
void refdyn_choose_start(struct refdyn_drive *drive);
/* After an accepted step: counts, judges, and asks for another method (drive->choice.next) where that is due.
 */
void refdyn_choose_after_step(struct refdyn_drive *drive);
/* The tolerance that the method in use needs for an error as that of the others. */
double refdyn_choose_tolerance(const struct refdyn_drive *drive);
/* After a step that could not be evaluated; 1: the automatic choice has gone over to the explicit method,
 * since the tangent at the begin of the step is not finite, which no smaller step changes. */
int refdyn_choose_after_failure(struct refdyn_drive *drive);
/* The drive goes on from a time before the end of its last step, by `back` [s]. */
void refdyn_choose_go_back(struct refdyn_drive *drive, double back);
/* Takes up the method that was asked for. */
void refdyn_choose_take_up(struct refdyn_drive *drive);

#endif
