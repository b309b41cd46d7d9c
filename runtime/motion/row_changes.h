/*
 * Rows that jump. At time events they come and go, as x + where(t < 1, 1, 0) y does, or ask for other rates,
 * as x - min(t, 1) does; at kinks in coordinates they turn, as x - abs(y) does; events and callers set inputs
 * and parameters that rows read.
 *
 * The step before the jump uses only the rows on its left side: its end is brought onto them, and states that
 * are seen inside it or at its end have their accelerations. The next step begins after the jump, where rows
 * and dependent coordinates are determined again. Positions must already meet the new rows. Rates jump by an
 * impulse u^T Lambda, as in an inelastic impact, so that the residuals of rates stay as they were, with any
 * stabilisation.
 */
#ifndef REFDYN_ROW_CHANGES_H
#define REFDYN_ROW_CHANGES_H

#include "base/layout.h"
#include "motion/motion.h"

void refdyn_rows_lay_out(struct refdyn_residuals_before *before, const struct refdyn_model *model,
                         struct layout *layout);
/* After a step was taken: do the rows change at the time event at its end? Row terms in the workspace and
 * room of projections are lost. */
void refdyn_rows_look_at_end(struct refdyn_motion *motion);
/* Do coefficients of rows jump at the time event that limits the step, at the state from which it begins? The
 * workspace then holds the row terms after the event. */
int refdyn_rows_jump_at(struct refdyn_motion *motion, double t);
/* The time at which rates and rows of t, inside the last step or at its end, are evaluated. */
double refdyn_rows_side_of(const struct refdyn_motion *motion, double t);
/* The next step begins where rows have changed: its state and rates. Errors: those of refdyn_project and
 * refdyn_rates; ROWS_UNMET. */
int refdyn_rows_take_new(struct refdyn_motion *motion);

/* Notes the residuals of this state, from the row terms in the workspace: of a state before a jump; of a
 * state that the caller sees. */
void refdyn_rows_note(struct refdyn_motion *motion, const double *state);
void refdyn_rows_note_seen(struct refdyn_motion *motion, const double *state);
/* A motion starts: no state was seen before. */
void refdyn_rows_forget_seen(struct refdyn_motion *motion);
/* Have the rows jumped since the state at the begin of the step was noted? Evaluates them there. Errors:
 * NOT_FINITE. */
int refdyn_rows_have_jumped(struct refdyn_motion *motion, int *have);
/* When rows have jumped: rates at the begin of the step jump with them, and the change of energy counts as
 * work. Errors: those of refdyn_project and refdyn_impulse_of_rows; ROWS_UNMET. */
int refdyn_rows_meet(struct refdyn_motion *motion);
/* When the step begins at the state that was seen last: the caller may have set it since; otherwise it jumps
 * with its rows. Errors: those of refdyn_rows_meet. */
int refdyn_rows_meet_seen(struct refdyn_motion *motion);

#endif
