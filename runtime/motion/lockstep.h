/*
 * Motions whose explicit steps are taken side by side by somebody else (batch/lanes.h): a motion halts where
 * it would take one.
 */
#ifndef REFDYN_LOCKSTEP_H
#define REFDYN_LOCKSTEP_H

#include "motion/accepted_step.h"

enum { REFDYN_HALTED = 1000 /* beside the statuses of refdyn.h */ };

/*
 * Steps towards t_out until an explicit one is to be taken: HALTED, and *attempt tells which. Otherwise t_out
 * is reached or the motion has failed, as refdyn_integrator_to tells it. *attempt is over before the first
 * call.
 */
int refdyn_integrator_halt(struct refdyn_integrator *integrator, double t_out,
                           struct refdyn_attempt *attempt);
/* The step at which it halted was taken, or could not be: then the motion takes it itself. */
void refdyn_integrator_judge(struct refdyn_integrator *integrator, struct refdyn_attempt *attempt,
                             int is_taken);

#endif
