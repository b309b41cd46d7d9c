/* The functions of FMI 2.0. All variables are real numbers. */
#include "runtime/bindings/fmi/fmi2.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/bindings/fmi/fmi.h"

/* ---- Instances ---- */

/* An instance with the data of FMI 2.0. */
struct component {
    struct fmu_instance *instance;
    fmi2CallbackFunctions functions;
    char *name;
};

static void tell(const struct fmu_listener *listener, enum fmu_status status, const char *category,
                 const char *text) {
    const struct component *component = listener->environment;
    if (component->functions.logger)
        component->functions.logger(component->functions.environment, component->name, (fmi2Status)status,
                                    category, text);
}

static struct fmu_instance *instance_of(fmi2Component component) {
    return component ? ((struct component *)component)->instance : NULL;
}

static char *copy_of(const char *text) {
    const size_t size = text ? strlen(text) + 1 : 1;
    char *copy = malloc(size);
    if (copy && text)
        memcpy(copy, text, size);
    else if (copy)
        *copy = '\0';
    return copy;
}

static void close_component(struct component *component) {
    fmu_close(component->instance);
    free(component->name);
    free(component);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean is_visible,
                              fmi2Boolean is_logging) {
    struct component *component = calloc(1, sizeof *component);
    struct fmu_listener listener = {.tell = tell, .environment = component};
    (void)resources;
    (void)is_visible;
    if (!component)
        return NULL;
    component->functions = functions ? *functions : (fmi2CallbackFunctions){0};
    component->name = copy_of(name);
    if (!guid || strcmp(guid, refdyn_fmu.token) != 0)
        tell(&listener, FMU_ERROR, "logStatusError", "the GUID is not that of this FMU");
    else if (component->name)
        component->instance = fmu_open(&listener, type == fmi2ModelExchange, is_logging);
    if (component->instance)
        return component;
    close_component(component);
    return NULL;
}

void fmi2FreeInstance(fmi2Component component) {
    if (component)
        close_component(component);
}

const char *fmi2GetTypesPlatform(void) {
    return "default";
}

const char *fmi2GetVersion(void) {
    return "2.0";
}

fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean is_logging, size_t category_count,
                               const fmi2String categories[]) {
    (void)category_count;
    (void)categories;
    if (!component)
        return fmi2Error;
    instance_of(component)->is_logging = is_logging;
    return fmi2OK;
}

/* ---- Start and end ---- */

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real t_first, fmi2Boolean has_stop, fmi2Real t_stop) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_MODE(INSTANTIATED), "fmi2SetupExperiment");
    if (!instance)
        return fmi2Error;
    return (fmi2Status)fmu_set_experiment(instance, has_tolerance ? tolerance : 0, t_first,
                                          has_stop ? t_stop : INFINITY);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_MODE(INSTANTIATED), "fmi2EnterInitializationMode");
    if (!instance)
        return fmi2Error;
    instance->mode = FMU_INITIALISING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_MODE(INITIALISING), "fmi2ExitInitializationMode");
    if (!instance)
        return fmi2Error;
    return (fmi2Status)fmu_leave_initialisation(instance);
}

fmi2Status fmi2Terminate(fmi2Component component) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_RUNNING, "fmi2Terminate");
    if (!instance)
        return fmi2Error;
    instance->mode = FMU_ENDED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component component) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_ALIVE | FMU_MODE(FAILED), "fmi2Reset");
    return instance ? (fmi2Status)fmu_reset(instance) : fmi2Error;
}

/* ---- Values ---- */

fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference references[], size_t count,
                       fmi2Real values[]) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_ALIVE, "fmi2GetReal");
    enum fmu_status status = instance ? FMU_OK : FMU_ERROR;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_get(instance, references[i], &values[i]);
    return (fmi2Status)status;
}

fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference references[], size_t count,
                       const fmi2Real values[]) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_ALIVE, "fmi2SetReal");
    enum fmu_status status = instance ? FMU_OK : FMU_ERROR;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_set(instance, references[i], values[i]);
    return (fmi2Status)status;
}

static fmi2Status refuse_type(fmi2Component component, size_t count, const char *function) {
    return (fmi2Status)fmu_refuse_type(instance_of(component), count, function);
}

fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference references[], size_t count,
                          fmi2Integer values[]) {
    (void)references;
    (void)values;
    return refuse_type(component, count, "fmi2GetInteger");
}

fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference references[], size_t count,
                          fmi2Boolean values[]) {
    (void)references;
    (void)values;
    return refuse_type(component, count, "fmi2GetBoolean");
}

fmi2Status fmi2GetString(fmi2Component component, const fmi2ValueReference references[], size_t count,
                         fmi2String values[]) {
    (void)references;
    (void)values;
    return refuse_type(component, count, "fmi2GetString");
}

fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference references[], size_t count,
                          const fmi2Integer values[]) {
    (void)references;
    (void)values;
    return refuse_type(component, count, "fmi2SetInteger");
}

fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference references[], size_t count,
                          const fmi2Boolean values[]) {
    (void)references;
    (void)values;
    return refuse_type(component, count, "fmi2SetBoolean");
}

fmi2Status fmi2SetString(fmi2Component component, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[]) {
    (void)references;
    (void)values;
    return refuse_type(component, count, "fmi2SetString");
}

/* ---- Saved states ---- */

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_ALIVE, "fmi2GetFMUstate");
    struct fmu_saved *saved = *state;
    const enum fmu_status status = instance ? fmu_save(instance, &saved) : FMU_ERROR;
    *state = saved;
    return (fmi2Status)status;
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_ALIVE | FMU_MODE(FAILED), "fmi2SetFMUstate");
    return instance ? (fmi2Status)fmu_restore(instance, state) : fmi2Error;
}

fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
    (void)component;
    fmu_forget(*state);
    *state = NULL;
    return fmi2OK;
}

static fmi2Status refuse(fmi2Component component, const char *function) {
    return (fmi2Status)fmu_refuse(instance_of(component), function);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size) {
    (void)state;
    (void)size;
    return refuse(component, "fmi2SerializedFMUstateSize");
}

fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    (void)state;
    (void)bytes;
    (void)size;
    return refuse(component, "fmi2SerializeFMUstate");
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state) {
    (void)bytes;
    (void)size;
    (void)state;
    return refuse(component, "fmi2DeSerializeFMUstate");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknowns[],
                                        size_t unknown_count, const fmi2ValueReference knowns[],
                                        size_t known_count, const fmi2Real seed[], fmi2Real sensitivity[]) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_STARTED, "fmi2GetDirectionalDerivative");
    if (!instance)
        return fmi2Error;
    return (fmi2Status)fmu_directional(instance, unknowns, unknown_count, knowns, known_count, seed,
                                       sensitivity);
}

/* ---- Model Exchange ---- */

fmi2Status fmi2EnterEventMode(fmi2Component component) {
    struct fmu_instance *instance = fmu_enter_exchange(
        instance_of(component), FMU_MODE(CONTINUOUS_MODE) | FMU_MODE(EVENT_MODE), "fmi2EnterEventMode");
    if (!instance)
        return fmi2Error;
    instance->mode = FMU_EVENT_MODE;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(EVENT_MODE), "fmi2NewDiscreteStates");
    struct fmu_event_update update;
    if (!instance)
        return fmi2Error;
    const enum fmu_status status = fmu_update_events(instance, &update);
    *info = (fmi2EventInfo){.terminate_simulation = update.ends,
                            .states_changed = update.changes_states,
                            .next_event_time_defined = isfinite(update.t_next),
                            .next_event_time = isfinite(update.t_next) ? update.t_next : 0};
    return (fmi2Status)status;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(EVENT_MODE), "fmi2EnterContinuousTimeMode");
    if (!instance)
        return fmi2Error;
    instance->mode = FMU_CONTINUOUS_MODE;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean is_final,
                                       fmi2Boolean *wants_event_mode, fmi2Boolean *wants_end) {
    (void)is_final;
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(CONTINUOUS_MODE), "fmi2CompletedIntegratorStep");
    *wants_event_mode = *wants_end = fmi2False;
    if (!instance)
        return fmi2Error;
    *wants_event_mode = fmu_complete_step(instance);
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component component, fmi2Real t) {
    struct fmu_instance *instance = fmu_enter_exchange(
        instance_of(component), FMU_MODE(EVENT_MODE) | FMU_MODE(CONTINUOUS_MODE), "fmi2SetTime");
    return instance ? (fmi2Status)fmu_set_time(instance, t) : fmi2Error;
}

fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real states[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(CONTINUOUS_MODE), "fmi2SetContinuousStates");
    return instance && fmu_has_length(instance, count, fmu_count_states(instance->work.model))
               ? (fmi2Status)fmu_set_states(instance, states)
               : fmi2Error;
}

fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real states[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_STARTED, "fmi2GetContinuousStates");
    return instance && fmu_has_length(instance, count, fmu_count_states(instance->work.model))
               ? (fmi2Status)fmu_get_states(instance, states)
               : fmi2Error;
}

fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real derivatives[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_STARTED, "fmi2GetDerivatives");
    return instance && fmu_has_length(instance, count, fmu_count_states(instance->work.model))
               ? (fmi2Status)fmu_get_derivatives(instance, derivatives)
               : fmi2Error;
}

fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real indicators[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_STARTED, "fmi2GetEventIndicators");
    return instance && fmu_has_length(instance, count, fmu_count_indicators(instance->work.model))
               ? (fmi2Status)fmu_get_indicators(instance, indicators)
               : fmi2Error;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real nominals[], size_t count) {
    struct fmu_instance *instance = fmu_enter_exchange(instance_of(component), FMU_ALIVE & ~FMU_MODE(ENDED),
                                                       "fmi2GetNominalsOfContinuousStates");
    if (!instance || !fmu_has_length(instance, count, fmu_count_states(instance->work.model)))
        return fmi2Error;
    fmu_find_nominals(instance->work.model, nominals);
    return fmi2OK;
}

/* ---- Co-Simulation ---- */

static struct fmu_instance *enter_steps(fmi2Component component, const char *function) {
    return fmu_enter_steps(instance_of(component), FMU_MODE(STEP_MODE) | FMU_MODE(ENDED), function);
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real t_now, fmi2Real step, fmi2Boolean is_final) {
    struct fmu_instance *instance = enter_steps(component, "fmi2DoStep");
    (void)is_final;
    if (!instance || !fmu_allows(instance, FMU_MODE(STEP_MODE), "fmi2DoStep"))
        return fmi2Error;
    return (fmi2Status)fmu_step(instance, t_now, t_now + step);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference references[],
                                       size_t count, const fmi2Integer orders[], const fmi2Real values[]) {
    (void)references;
    (void)count;
    (void)orders;
    (void)values;
    return refuse(component, "fmi2SetRealInputDerivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference references[],
                                        size_t count, const fmi2Integer orders[], fmi2Real values[]) {
    (void)references;
    (void)count;
    (void)orders;
    (void)values;
    return refuse(component, "fmi2GetRealOutputDerivatives");
}

/* Steps are complete when fmi2DoStep returns, so that there is nothing to cancel. */
fmi2Status fmi2CancelStep(fmi2Component component) {
    return refuse(component, "fmi2CancelStep");
}

fmi2Status fmi2GetStatus(fmi2Component component, fmi2StatusKind kind, fmi2Status *value) {
    (void)kind;
    *value = fmi2OK;
    return enter_steps(component, "fmi2GetStatus") ? fmi2Discard : fmi2Error;
}

fmi2Status fmi2GetRealStatus(fmi2Component component, fmi2StatusKind kind, fmi2Real *value) {
    struct fmu_instance *instance = enter_steps(component, "fmi2GetRealStatus");
    if (!instance)
        return fmi2Error;
    *value = instance->integrator.t;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component component, fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind;
    *value = 0;
    return enter_steps(component, "fmi2GetIntegerStatus") ? fmi2Discard : fmi2Error;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component component, fmi2StatusKind kind, fmi2Boolean *value) {
    struct fmu_instance *instance = enter_steps(component, "fmi2GetBooleanStatus");
    if (!instance)
        return fmi2Error;
    *value = instance->mode == FMU_ENDED;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetStringStatus(fmi2Component component, fmi2StatusKind kind, fmi2String *value) {
    (void)kind;
    *value = "";
    return enter_steps(component, "fmi2GetStringStatus") ? fmi2Discard : fmi2Error;
}
