/* Energy by which a state jumps, at impacts and where rows begin to act: it counts as work. */
#ifndef REFDYN_ENERGY_JUMPS_H
#define REFDYN_ENERGY_JUMPS_H

#include "motion/motion.h"

/* Kinetic and potential energy at the begin of the step [J]; 0 where no balance is asked for. */
double refdyn_energy_at_begin(const struct refdyn_motion *motion);
/* The state at the begin of the step has jumped from one of this energy. */
void refdyn_energy_has_jumped(struct refdyn_motion *motion, double before);

#endif
