/* What both versions of FMI do alike: their functions check the mode, then call these. */
#ifndef REFDYN_FMI_STATE_MACHINE_H
#define REFDYN_FMI_STATE_MACHINE_H

#include "fmi/instance.h"

#define FMU_MODE(name) (1u << FMU_##name)
enum {
    FMU_ALIVE = FMU_MODE(INSTANTIATED) | FMU_MODE(INITIALISING) | FMU_MODE(EVENT_MODE) |
                FMU_MODE(CONTINUOUS_MODE) | FMU_MODE(STEP_MODE) | FMU_MODE(ENDED),
    FMU_STARTED = FMU_ALIVE & ~FMU_MODE(INSTANTIATED), /* with a motion, or about to have one */
    FMU_RUNNING = FMU_STARTED & ~FMU_MODE(INITIALISING)
};

/* The instance, where it is in one of the modes; NULL: it is not, as was told. */
struct fmu_instance *fmu_enter(struct fmu_instance *instance, unsigned modes, const char *function);
/* The same, of an instance of Model Exchange, of one of Co-Simulation. */
struct fmu_instance *fmu_enter_exchange(struct fmu_instance *instance, unsigned modes, const char *function);
struct fmu_instance *fmu_enter_steps(struct fmu_instance *instance, unsigned modes, const char *function);
/* Has an array of the importer the length that the model has? */
int fmu_has_length(struct fmu_instance *instance, size_t count, int wanted);

enum fmu_status fmu_leave_initialisation(struct fmu_instance *instance);
/* states (2 n): q, qd */
enum fmu_status fmu_get_states(struct fmu_instance *instance, double *states);
/* What the description says that this FMU cannot do. */
enum fmu_status fmu_refuse(struct fmu_instance *instance, const char *function);
/* Variables of another type than real numbers: none may be asked for. */
enum fmu_status fmu_refuse_type(struct fmu_instance *instance, size_t count, const char *function);

#endif
