/*
 * Rows that come and go at time events: their coefficients jump there, as in x + where(t < 1, 1, 0) y.
 *
 * The step before the event knows the rows on its left side alone: its end is brought onto them, and what is
 * seen inside it or at its end has their accelerations. The next step begins behind the event, where rows and
 * dependent coordinates are found anew, and the state is brought onto these rows: positions have to meet them
 * already, velocities that they do not allow are lost, by an impulse u^T Lambda, as in an inelastic impact.
 */
#ifndef REFDYN_ROW_CHANGES_H
#define REFDYN_ROW_CHANGES_H

#include "motion/motion.h"

/* After a step was taken: do the rows change at the time event at its end? Row terms in the workspace and
 * room of projections are lost. */
void refdyn_rows_look_at_end(struct refdyn_motion *motion);
/* Do coefficients of rows jump at the time event that limits the step, at the state from which it begins? The
 * row terms behind the event are in the workspace then. */
int refdyn_rows_jump_at(struct refdyn_motion *motion, double t);
/* The time at which rates and rows of t, inside the last step or at its end, are evaluated. */
double refdyn_rows_side_of(const struct refdyn_motion *motion, double t);
/* The next step begins where rows have changed: its state and rates. Errors: those of refdyn_project and
 * refdyn_rates; ROWS_UNMET. */
int refdyn_rows_take_new(struct refdyn_motion *motion);

#endif
