/* The automatic choice of a method. */
#ifndef REFDYN_CHOOSE_H
#define REFDYN_CHOOSE_H

#include "refdyn.h"

/* Begins the first trial; at the start of a motion. */
void refdyn_choose_start(struct refdyn_drive *drive);
/* After an accepted step: counts, judges, and asks for another method (drive->choice.next) where that is due.
 */
void refdyn_choose_after_step(struct refdyn_drive *drive);
/* The tolerance that the method in use needs for an error as that of the others. */
double refdyn_choose_tolerance(const struct refdyn_drive *drive);
/* Takes up the method that was asked for. */
void refdyn_choose_take_up(struct refdyn_drive *drive);

#endif
