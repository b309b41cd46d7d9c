/*
 * Motions whose steps are taken side by side by somebody else (batch/lanes.h): a motion halts where it would
 * take one.
 */
#ifndef REFDYN_LOCKSTEP_H
#define REFDYN_LOCKSTEP_H

#include "motion/accepted_step.h"

/* Beside the statuses of refdyn.h. */
enum {
    REFDYN_HALTED = 1000,
    REFDYN_LEFT_TO_MOTION /* the motion takes the step itself: it needs what the others lack, or its numbers
                             are not finite */
};

/*
 * Steps towards t_out until one is to be taken that others may take: HALTED, and *attempt tells which.
 * Otherwise t_out is reached or the motion has failed, as refdyn_integrator_to tells it. *attempt is over
 * before the first call.
 */
int refdyn_integrator_halt(struct refdyn_integrator *integrator, double t_out,
                           struct refdyn_attempt *attempt);
/* The step at which it halted was taken: OK or an error of the method. LEFT_TO_MOTION: the motion takes it
 * when it goes on. */
void refdyn_integrator_judge(struct refdyn_integrator *integrator, struct refdyn_attempt *attempt, int taken);

#endif
