/*
 * Rows that fade out towards a time event: their own part becomes smaller and smaller and is 0 from there on,
 * as that of y in x + (1 - ramp(t, 0.5, 1)) y beside x.
 *
 * Until then they determine the motion, but the nearer the event the less their numbers tell: what rounding
 * leaves of phi is divided by their own part, and what it leaves of accelerations by its square. The motion
 * itself is smooth. So one step of gauss12 ends at the event: its last stage lies 0.034 of the step before
 * it, and nothing is evaluated nearer. Its stages are brought onto the programme. Behind the event the next
 * step begins with the rows that are left (row_changes.h).
 */
#ifndef REFDYN_FADING_ROWS_H
#define REFDYN_FADING_ROWS_H

#include "motion/motion.h"

/* Doubles of a step's memory. */
int refdyn_fading_memory_size(const struct refdyn_model *model);
/* A motion begins. */
void refdyn_fading_start(struct refdyn_motion *motion);
/* Is the time event at t near enough for a motion whose steps are h, and nearer than half of where it was
 * looked at last? */
int refdyn_fading_is_due(struct refdyn_motion *motion, double h, double t);
/* Do rows fade out towards the time event at t? The row terms in the workspace are lost. */
int refdyn_fading_is_ahead(struct refdyn_motion *motion, double t);
/* An ordinary step was taken: has it lost rows that fade out towards an event that it did not begin behind?
 */
int refdyn_fading_lost_rows(const struct refdyn_motion *motion);
/* Enters the step that ends at such an event, and leaves it: from one to the other the method is gauss12, and
 * its stages are brought onto the programme. */
void refdyn_fading_enter(struct refdyn_motion *motion);
void refdyn_fading_leave(struct refdyn_motion *motion);
/* The step was taken; is its error, in tolerances, small enough? It ends where the rows have changed. Error:
 * NO_CONVERGENCE. */
int refdyn_fading_judge(struct refdyn_motion *motion);
/* It was refused: the partition is that of its begin again. Returns 0 where the rank is lost there already:
 * then the motion ends. */
int refdyn_fading_refuse(struct refdyn_motion *motion);
/* Does t lie so near the event that its accelerations are not to be had from the rows? */
int refdyn_fading_is_near(const struct refdyn_motion *motion, double t);

#endif
