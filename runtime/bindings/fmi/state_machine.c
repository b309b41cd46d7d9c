/* Common parts of both versions of FMI: checks of modes and lengths. */
#include "runtime/bindings/fmi/fmi.h"

#include <string.h>

struct fmu_instance *fmu_enter(struct fmu_instance *instance, unsigned modes, const char *function) {
    return instance && fmu_allows(instance, modes, function) ? instance : NULL;
}

struct fmu_instance *fmu_enter_exchange(struct fmu_instance *instance, unsigned modes, const char *function) {
    if (!fmu_enter(instance, modes, function))
        return NULL;
    if (instance->is_exchange)
        return instance;
    fmu_tell(instance, FMU_ERROR, "%s belongs to Model Exchange", function);
    return NULL;
}

struct fmu_instance *fmu_enter_steps(struct fmu_instance *instance, unsigned modes, const char *function) {
    if (!fmu_enter(instance, modes, function))
        return NULL;
    if (!instance->is_exchange)
        return instance;
    fmu_tell(instance, FMU_ERROR, "%s belongs to Co-Simulation", function);
    return NULL;
}

int fmu_has_length(struct fmu_instance *instance, size_t count, int wanted) {
    if (count == (size_t)wanted)
        return 1;
    fmu_tell(instance, FMU_ERROR, "an array of %lu numbers; must have %d", (unsigned long)count, wanted);
    return 0;
}

enum fmu_status fmu_leave_initialisation(struct fmu_instance *instance) {
    const enum fmu_status status = fmu_evaluate(instance);
    if (status == FMU_OK)
        instance->mode = instance->is_exchange ? FMU_EVENT_MODE : FMU_STEP_MODE;
    return status;
}

enum fmu_status fmu_get_states(struct fmu_instance *instance, double *states) {
    const enum fmu_status status = instance->mode == FMU_INITIALISING ? fmu_evaluate(instance) : FMU_OK;
    if (status == FMU_OK)
        memcpy(states, instance->integrator.q, (size_t)(2 * instance->work.n) * sizeof *states);
    return status;
}

enum fmu_status fmu_refuse(struct fmu_instance *instance, const char *function) {
    if (fmu_enter(instance, FMU_ALIVE, function))
        fmu_tell(instance, FMU_ERROR, "%s: this FMU does not support it", function);
    return FMU_ERROR;
}

enum fmu_status fmu_refuse_type(struct fmu_instance *instance, size_t count, const char *function) {
    if (!fmu_enter(instance, FMU_ALIVE, function))
        return FMU_ERROR;
    return count == 0
               ? FMU_OK
               : fmu_tell(instance, FMU_ERROR, "%s: all variables of this FMU are real numbers", function);
}
