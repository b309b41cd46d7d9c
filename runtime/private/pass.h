/*
 * Through a state where the rows lose rank: options.singular = REFDYN_PASS (theory, sect. 8.9).
 *
 * There K qdd = k has no unique solution, and off the programme, at a distance e from it and a time s before
 * that state, accelerations are wrong by about e/s^2. On the programme they are smooth along a branch. So one
 * step of rk8 is laid over that state whose stages are first brought onto the programme, with the state in
 * the widest gap between its stages; its embedded formulas tell its error as they do elsewhere.
 */
#ifndef REFDYN_PASS_H
#define REFDYN_PASS_H

#include "../refdyn.h"

/* Will the rows lose rank within `reach` from t_begin? Then *t is when, on the motion continued by its
 * accelerations. The row terms in the workspace and drive->stage are lost. */
int refdyn_pass_is_ahead(struct refdyn_drive *drive, double reach, double *t);
/* Did they on the ordinary step to t_new, which was longer than that continuation is good for? Then
 * drive->singular_t is when. The workspace holds the row terms of state_new at the end. */
int refdyn_pass_was_crossed(struct refdyn_drive *drive, double t_new);
/* Was the same tried not much further away? */
int refdyn_pass_is_vain(const struct refdyn_drive *drive, double t);
/* End of the step that leads through a state at t, not beyond t_bound; INFINITY: there is none. */
double refdyn_pass_end(struct refdyn_drive *drive, double t, double t_bound);
/* After refdyn_pass_end: from here to refdyn_pass_leave drive->method is rk8 and drive->is_passing holds.
 * Error: those of refdyn_slope. */
int refdyn_pass_enter(struct refdyn_drive *drive);
void refdyn_pass_leave(struct refdyn_drive *drive);
/* A stage's state (2 n) at t onto the programme. Errors: those of refdyn_project and refdyn_pass_follow. */
int refdyn_pass_meet(struct refdyn_drive *drive, double t, double *state);
/* Is a state (2 n) on the branch that was followed, after a projection? NO_CONVERGENCE: it was moved so far
 * that it may not be. */
int refdyn_pass_follow(struct refdyn_drive *drive, const double *before, const double *state);
/* Largest error of a step of h that is accepted; INFINITY where steps are fixed. */
double refdyn_pass_error_most(const struct refdyn_drive *drive, double h);
/* After the step to t_new: drive->singular_t is when the rows lose rank on it. The row terms in the workspace
 * are lost. */
void refdyn_pass_look_back(struct refdyn_drive *drive, double t_new);
/* The step to t_new with this error into the statistics; an attempt that was refused into drive->refused.
 * drive->refused.why is set before by what refused it, else it is NO_STATE. */
void refdyn_pass_record(struct refdyn_drive *drive, double t_new, double error);
void refdyn_pass_refuse(struct refdyn_drive *drive, double t_new);
/* Does t lie so near a state passed that its accelerations are not to be had from the rows? */
int refdyn_pass_is_near(const struct refdyn_drive *drive, double t);

#endif
