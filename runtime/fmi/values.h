/* Values of variables, from outside and to outside. */
#ifndef REFDYN_FMI_VALUES_H
#define REFDYN_FMI_VALUES_H

#include "fmi/instance.h"

enum fmu_status fmu_get(struct fmu_instance *instance, unsigned reference, double *value);
enum fmu_status fmu_set(struct fmu_instance *instance, unsigned reference, double value);
/* Fills the blocks (set of enum fmu_block) for the present state, which is evaluated already. */
void fmu_fill(struct fmu_instance *instance, unsigned blocks);

/* Event indicators (fmu_count_indicators) of a state q, qd (2 n), at the present time. */
void fmu_find_indicators(const struct fmu_instance *instance, const double *state, double *indicators);

#endif
