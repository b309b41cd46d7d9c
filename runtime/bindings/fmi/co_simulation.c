/* Co-Simulation. Inputs are constant from one communication point to the next. */
#include "runtime/bindings/fmi/fmi.h"

#include <math.h>

/* Two times this near to each other are the same communication point. */
static const double same_time = 1e-9;

static enum fmu_status check_times(struct fmu_instance *instance, double t_now, double t_next) {
    const double t = instance->integrator.t, apart = same_time * fmax(1, fabs(t));
    if (!(fabs(t_now - t) <= apart))
        return fmu_tell(instance, FMU_ERROR,
                        "a step from %.15g s; must begin at %.15g s, where the motion is", t_now, t);
    if (!(isfinite(t_next) && t_next >= t))
        return fmu_tell(instance, FMU_ERROR, "t = %.9g s: a step to %g s; must not end earlier", t, t_next);
    if (t_next > instance->t_stop + apart)
        return fmu_tell(instance, FMU_ERROR, "a step to %.15g s; must not end after the stop time, %.15g s",
                        t_next, instance->t_stop);
    return FMU_OK;
}

/* Events at the last communication point of a motion happen like all others. */
static enum fmu_status tell_end(struct fmu_instance *instance) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const char *name = integrator->event_count > 0 ? instance->work.model->events[integrator->event[0]].name
                                                   : "of the model";
    instance->mode = FMU_ENDED;
    return fmu_tell(instance, FMU_DISCARD, "t = %.9g s: event %s has ended the motion", integrator->t, name);
}

enum fmu_status fmu_step(struct fmu_instance *instance, double t_now, double t_next) {
    struct refdyn_integrator *integrator = &instance->integrator;
    enum fmu_status told = check_times(instance, t_now, t_next);
    if (told == FMU_OK)
        told = fmu_evaluate(instance);
    if (told != FMU_OK)
        return told;
    if (instance->work.model->input_count > 0) /* inputs may change there */
        refdyn_integrator_limit(integrator, t_next);
    const int status = refdyn_integrator_to(integrator, t_next);
    instance->filled = 0;
    fmu_tell_contacts(instance);
    if (status == REFDYN_EVENT_ENDS)
        return tell_end(instance);
    return status ? fmu_tell_failure(instance, status) : FMU_OK;
}
