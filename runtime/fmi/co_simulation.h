/* Co-Simulation: the integrator of the core steps from one communication point to the next. */
#ifndef REFDYN_FMI_CO_SIMULATION_H
#define REFDYN_FMI_CO_SIMULATION_H

#include "fmi/instance.h"

/* From t_now, where the motion is, to t_next. FMU_DISCARD: an event of the model has ended the motion before,
 * at integrator.t. */
enum fmu_status fmu_step(struct fmu_instance *instance, double t_now, double t_next);

#endif
