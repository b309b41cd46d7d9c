/* Copies of an instance's state, to go back to. */
#ifndef REFDYN_FMI_SAVED_STATE_H
#define REFDYN_FMI_SAVED_STATE_H

#include "fmi/instance.h"

struct fmu_saved;

/* Into *saved, which is made where it is NULL. */
enum fmu_status fmu_save(struct fmu_instance *instance, struct fmu_saved **saved);
/* The instance goes on as it would have then: to the bit. Only the instance that it is of. */
enum fmu_status fmu_restore(struct fmu_instance *instance, const struct fmu_saved *saved);
void fmu_forget(struct fmu_saved *saved);

#endif
