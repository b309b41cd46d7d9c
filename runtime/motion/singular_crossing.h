/*
 * Through a state where the rows lose rank: options.singular = REFDYN_PASS (theory, sect. 8.9).
 *
 * There K qdd = k has no unique solution, and off the programme, at a distance e from it and a time s before
 * that state, accelerations are wrong by about e/s^2. On the programme they are smooth along a branch. So one
 * step of rk8 is laid over that state whose stages are first brought onto the programme, with the state in
 * the widest gap between its stages; its embedded formulas tell its error as they do elsewhere.
 */
#ifndef REFDYN_SINGULAR_CROSSING_H
#define REFDYN_SINGULAR_CROSSING_H

#include "motion/motion.h"

void refdyn_crossing_lay_out(struct refdyn_singular_crossing *crossing, const struct refdyn_model *model,
                             struct layout *layout);
/* A motion begins. */
void refdyn_crossing_start(struct refdyn_motion *motion);

/* Will the rows lose rank within `reach` from t_begin? Then *t is when, on the motion continued by its
 * accelerations. The row terms in the workspace and the step's stage are lost. */
int refdyn_crossing_is_ahead(struct refdyn_motion *motion, double reach, double *t);
/* Did they on the ordinary step that was taken, which was longer than that continuation is good for? Then it
 * is known when. The workspace holds the row terms of its end afterwards. */
int refdyn_crossing_was_missed(struct refdyn_motion *motion);
/* Would an attempt be useless: is a step through the state at t too long, judging by the errors of earlier
 * ones, or was one through the same state tried from not much further away? */
int refdyn_crossing_is_vain(const struct refdyn_motion *motion, double t);
/* End of the step that leads through a state at t, not beyond t_bound; INFINITY: there is none. */
double refdyn_crossing_end(struct refdyn_motion *motion, double t, double t_bound);
/* After refdyn_crossing_end: from here to refdyn_crossing_leave the method is rk8, whose stages are brought
 * onto the programme. Error: those of refdyn_rates. */
int refdyn_crossing_enter(struct refdyn_motion *motion);
void refdyn_crossing_leave(struct refdyn_motion *motion);
/* Is a state (2 n) on the branch that was followed, after a projection? NO_CONVERGENCE: it was moved so far
 * that it may not be. */
int refdyn_crossing_follow(struct refdyn_motion *motion, const double *before, const double *state);
/* The error of the step; NO_CONVERGENCE: it is too large. */
int refdyn_crossing_judge(struct refdyn_motion *motion, double *error);
/* After the step: it is known when the rows lose rank on it. The row terms in the workspace are lost. */
void refdyn_crossing_look_back(struct refdyn_motion *motion);
/* The step with this error is told in the statistics; an attempt at one to t_new was refused. */
void refdyn_crossing_record(struct refdyn_motion *motion, double error);
void refdyn_crossing_refuse(struct refdyn_motion *motion, double t_new);
/* Does t lie so near a state passed that its accelerations are not to be had from the rows? */
int refdyn_crossing_is_near(const struct refdyn_motion *motion, double t);

#endif
