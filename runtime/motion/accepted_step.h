/* One accepted step of a motion. */
#ifndef REFDYN_ACCEPTED_STEP_H
#define REFDYN_ACCEPTED_STEP_H

#include "motion/motion.h"

/* One step towards t_out: of fixed steps never past it, but by one that passes a state where the rows lose
 * rank. From state_new at t_end to the same, later. Errors: as refdyn_integrator_step. */
int refdyn_accept_step(struct refdyn_motion *motion, double t_out);
/*
 * A step of h from the begin may come near a state where the rows lose rank: *t is when, INFINITY: it does
 * not, or options.singular asks for no passing. Then tries to pass that state, with a step that ends before
 * t_bound: 1 when that was done, and state_new at t_end is the new state; 0: no other step should go more
 * than half of the way.
 */
int refdyn_pass_singular(struct refdyn_motion *motion, double h, double t_bound, double *t);
/* The motion may not go beyond t_final and t_most, unless they lie behind. */
double refdyn_motion_bound(const struct refdyn_motion *motion);
/* Are options.step_limit steps tried? */
int refdyn_step_limit_reached(const struct refdyn_motion *motion);
/* An evaluation or projection has failed at t. */
void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t);

#endif
