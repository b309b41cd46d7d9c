/* One accepted step of a motion. */
#ifndef REFDYN_ACCEPTED_STEP_H
#define REFDYN_ACCEPTED_STEP_H

#include "motion/motion.h"

/* One step towards t_out: of fixed steps never past it, but by one that passes a state where the rows lose
 * rank. From state_new at t_end to the same, later. Errors: as refdyn_integrator_step. */
int refdyn_accept_step(struct refdyn_motion *motion, double t_out);
/*
 * The same in parts, so that somebody else may take the step: begin, then prepare, plan, take and judge until
 * is_over, when the step is accepted. Fixed steps, those through a state where the rows lose rank, and a
 * begin at which events are due, are over behind begin. Errors: as refdyn_integrator_step.
 */
struct refdyn_attempt {
    double t_out;    /* what is asked for, */
    double t_near;   /* beyond which the step does not reach [s] */
    double half_way; /* to a state where the rows lose rank; INFINITY: none is near [s] */
    double h, t_new; /* length and end of the step to take [s] */
    double size;     /* its error, in tolerances, behind refdyn_attempt_measured */
    int is_measured; /* that is known */
    int is_left;     /* somebody else was to take the step and could not */
    int is_over;     /* no step is being tried */
};
int refdyn_attempt_begin(struct refdyn_motion *motion, double t_out, struct refdyn_attempt *attempt);
/* What the steps of some methods begin with, unless somebody else takes them; without it the automatic method
 * goes on with another one. */
int refdyn_attempt_prepare(struct refdyn_motion *motion);
int refdyn_attempt_plan(struct refdyn_motion *motion, struct refdyn_attempt *attempt);
/* Errors: those of the method, for judge. */
int refdyn_attempt_take(struct refdyn_motion *motion, const struct refdyn_attempt *attempt);
/* The error of what was tried, as refdyn_step_largest_error. */
void refdyn_attempt_measured(const struct refdyn_motion *motion, struct refdyn_attempt *attempt,
                             double error);
/* taken: what taking it ended with. */
void refdyn_attempt_judge(struct refdyn_motion *motion, struct refdyn_attempt *attempt, int taken);
/*
 * A step of h from the begin may come near a state where the rows lose rank: *t is when, INFINITY: it does
 * not, or options.singular asks for no passing. Then tries to pass that state, with a step that ends before
 * t_bound: 1 when that was done, and state_new at t_end is the new state; 0: no other step should go more
 * than half of the way.
 */
int refdyn_pass_singular(struct refdyn_motion *motion, double h, double t_bound, double *t);
/* The motion may not go beyond t_final and t_most, unless they lie behind. */
double refdyn_motion_bound(const struct refdyn_motion *motion);
/* Times closer to t than this are the same time for the motion; it depends on the larger of t and t_final. */
double refdyn_motion_resolution(const struct refdyn_motion *motion, double t);
/* Are options.step_limit steps tried? */
int refdyn_step_limit_reached(const struct refdyn_motion *motion);
/* An evaluation or projection has failed at t. */
void refdyn_motion_failed(struct refdyn_motion *motion, int cause, double t);

#endif
