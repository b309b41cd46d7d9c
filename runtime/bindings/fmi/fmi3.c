/*
 * The functions of FMI 3.0. All variables are numbers of type
 * Float64 without dimensions; there are no clocks, and events are handled inside the steps of Co-Simulation.
 */
#include "runtime/bindings/fmi/fmi3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/bindings/fmi/fmi.h"

/* ---- Instances ---- */

/* An instance with the data of FMI 3.0. */
struct component {
    struct fmu_instance *instance;
    fmi3InstanceEnvironment environment;
    fmi3Logger *logger;
};

static void tell(const struct fmu_listener *listener, enum fmu_status status, const char *category,
                 const char *text) {
    const struct component *component = listener->environment;
    if (component->logger)
        component->logger(component->environment, (fmi3Status)status, category, text);
}

static struct fmu_instance *instance_of(fmi3Instance component) {
    return component ? ((struct component *)component)->instance : NULL;
}

static fmi3Instance open_component(const struct component *wanted, fmi3String token, int is_exchange,
                                   int is_logging) {
    struct component *component = calloc(1, sizeof *component);
    if (!component)
        return NULL;
    *component = *wanted;
    struct fmu_listener listener = {.tell = tell, .environment = component};
    if (!token || strcmp(token, refdyn_fmu.token) != 0)
        tell(&listener, FMU_ERROR, "logStatusError", "the instantiation token is not that of this FMU");
    else
        component->instance = fmu_open(&listener, is_exchange, is_logging);
    if (component->instance)
        return component;
    free(component);
    return NULL;
}

fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources,
                                                fmi3Boolean is_visible, fmi3Boolean is_logging,
                                                fmi3InstanceEnvironment environment, fmi3Logger *logger) {
    const struct component wanted = {.environment = environment, .logger = logger};
    (void)name;
    (void)resources;
    (void)is_visible;
    return open_component(&wanted, token, 1, is_logging);
}

fmi3Instance FMI3(fmi3InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean is_visible, fmi3Boolean is_logging,
                                               fmi3Boolean uses_event_mode, fmi3Boolean may_return_early,
                                               const fmi3ValueReference intermediate[],
                                               size_t intermediate_count, fmi3InstanceEnvironment environment,
                                               fmi3Logger *logger, fmi3IntermediateUpdate *update) {
    const struct component wanted = {.environment = environment, .logger = logger};
    struct fmu_listener listener = {.tell = tell, .environment = &wanted};
    (void)name;
    (void)resources;
    (void)is_visible;
    (void)may_return_early;
    (void)intermediate;
    (void)update;
    if (!uses_event_mode && intermediate_count == 0)
        return open_component(&wanted, token, 0, is_logging);
    tell(&listener, FMU_ERROR, "logStatusError", "this FMU has no event mode and no intermediate updates");
    return NULL;
}

fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources,
                                                     fmi3Boolean is_visible, fmi3Boolean is_logging,
                                                     fmi3InstanceEnvironment environment, fmi3Logger *logger,
                                                     fmi3ClockUpdate *clock_update, fmi3Preemption *lock,
                                                     fmi3Preemption *unlock) {
    const struct component wanted = {.environment = environment, .logger = logger};
    struct fmu_listener listener = {.tell = tell, .environment = &wanted};
    (void)name;
    (void)token;
    (void)resources;
    (void)is_visible;
    (void)is_logging;
    (void)clock_update;
    (void)lock;
    (void)unlock;
    tell(&listener, FMU_ERROR, "logStatusError", "this FMU has no Scheduled Execution");
    return NULL;
}

void FMI3(fmi3FreeInstance)(fmi3Instance component) {
    fmu_close(instance_of(component));
    free(component);
}

const char *FMI3(fmi3GetVersion)(void) {
    return "3.0";
}

fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance component, fmi3Boolean is_logging, size_t category_count,
                                     const fmi3String categories[]) {
    (void)category_count;
    (void)categories;
    if (!component)
        return fmi3Error;
    instance_of(component)->is_logging = is_logging;
    return fmi3OK;
}

/* ---- Modes ---- */

fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance component, fmi3Boolean has_tolerance,
                                             fmi3Float64 tolerance, fmi3Float64 t_first, fmi3Boolean has_stop,
                                             fmi3Float64 t_stop) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_MODE(INSTANTIATED), "fmi3EnterInitializationMode");
    if (!instance)
        return fmi3Error;
    const enum fmu_status status =
        fmu_set_experiment(instance, has_tolerance ? tolerance : 0, t_first, has_stop ? t_stop : INFINITY);
    if (status == FMU_OK)
        instance->mode = FMU_INITIALISING;
    return (fmi3Status)status;
}

fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance component) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_MODE(INITIALISING), "fmi3ExitInitializationMode");
    return instance ? (fmi3Status)fmu_leave_initialisation(instance) : fmi3Error;
}

/* Changes from one mode of Model Exchange to another. */
static fmi3Status go_to(fmi3Instance component, unsigned from, enum fmu_mode to, const char *function) {
    struct fmu_instance *instance = fmu_enter_exchange(instance_of(component), from, function);
    if (!instance)
        return fmi3Error;
    instance->mode = to;
    return fmi3OK;
}

fmi3Status FMI3(fmi3EnterEventMode)(fmi3Instance component) {
    return go_to(component, FMU_MODE(CONTINUOUS_MODE) | FMU_MODE(EVENT_MODE), FMU_EVENT_MODE,
                 "fmi3EnterEventMode");
}

fmi3Status FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance component) {
    return go_to(component, FMU_MODE(EVENT_MODE), FMU_CONTINUOUS_MODE, "fmi3EnterContinuousTimeMode");
}

fmi3Status FMI3(fmi3Terminate)(fmi3Instance component) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_RUNNING, "fmi3Terminate");
    if (!instance)
        return fmi3Error;
    instance->mode = FMU_ENDED;
    return fmi3OK;
}

fmi3Status FMI3(fmi3Reset)(fmi3Instance component) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_ALIVE | FMU_MODE(FAILED), "fmi3Reset");
    return instance ? (fmi3Status)fmu_reset(instance) : fmi3Error;
}

static fmi3Status refuse(fmi3Instance component, const char *function) {
    return (fmi3Status)fmu_refuse(instance_of(component), function);
}

fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance component) {
    return refuse(component, "fmi3EnterStepMode");
}

fmi3Status FMI3(fmi3EnterConfigurationMode)(fmi3Instance component) {
    return refuse(component, "fmi3EnterConfigurationMode");
}

fmi3Status FMI3(fmi3ExitConfigurationMode)(fmi3Instance component) {
    return refuse(component, "fmi3ExitConfigurationMode");
}

/* ---- Values ---- */

fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance component, const fmi3ValueReference references[], size_t count,
                                fmi3Float64 values[], size_t value_count) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_ALIVE, "fmi3GetFloat64");
    if (!instance || !fmu_has_length(instance, value_count, (int)count))
        return fmi3Error;
    enum fmu_status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_get(instance, references[i], &values[i]);
    return (fmi3Status)status;
}

fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance component, const fmi3ValueReference references[], size_t count,
                                const fmi3Float64 values[], size_t value_count) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_ALIVE, "fmi3SetFloat64");
    if (!instance || !fmu_has_length(instance, value_count, (int)count))
        return fmi3Error;
    enum fmu_status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_set(instance, references[i], values[i]);
    return (fmi3Status)status;
}

#define REFUSE_TYPE(name, type)                                                                   \
    fmi3Status FMI3(fmi3Get##name)(fmi3Instance component, const fmi3ValueReference references[], \
                                   size_t count, type values[], size_t value_count) {             \
        (void)references;                                                                         \
        (void)values;                                                                             \
        (void)value_count;                                                                        \
        return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3Get" #name);       \
    }                                                                                             \
    fmi3Status FMI3(fmi3Set##name)(fmi3Instance component, const fmi3ValueReference references[], \
                                   size_t count, const type values[], size_t value_count) {       \
        (void)references;                                                                         \
        (void)values;                                                                             \
        (void)value_count;                                                                        \
        return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3Set" #name);       \
    }
FMI3_OTHER_TYPES(REFUSE_TYPE)

fmi3Status FMI3(fmi3GetBinary)(fmi3Instance component, const fmi3ValueReference references[], size_t count,
                               size_t sizes[], fmi3Binary values[], size_t value_count) {
    (void)references;
    (void)sizes;
    (void)values;
    (void)value_count;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3GetBinary");
}

fmi3Status FMI3(fmi3SetBinary)(fmi3Instance component, const fmi3ValueReference references[], size_t count,
                               const size_t sizes[], const fmi3Binary values[], size_t value_count) {
    (void)references;
    (void)sizes;
    (void)values;
    (void)value_count;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3SetBinary");
}

fmi3Status FMI3(fmi3GetClock)(fmi3Instance component, const fmi3ValueReference references[], size_t count,
                              fmi3Clock values[]) {
    (void)references;
    (void)values;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3GetClock");
}

fmi3Status FMI3(fmi3SetClock)(fmi3Instance component, const fmi3ValueReference references[], size_t count,
                              const fmi3Clock values[]) {
    (void)references;
    (void)values;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3SetClock");
}

fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance component, fmi3ValueReference reference,
                                                     size_t *count) {
    (void)reference;
    (void)count;
    return refuse(component, "fmi3GetNumberOfVariableDependencies");
}

fmi3Status FMI3(fmi3GetVariableDependencies)(fmi3Instance component, fmi3ValueReference dependent,
                                             size_t dependent_elements[], fmi3ValueReference independents[],
                                             size_t independent_elements[], fmi3DependencyKind kinds[],
                                             size_t count) {
    (void)dependent;
    (void)dependent_elements;
    (void)independents;
    (void)independent_elements;
    (void)kinds;
    (void)count;
    return refuse(component, "fmi3GetVariableDependencies");
}

/* ---- Saved states ---- */

fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance component, fmi3FMUState *state) {
    struct fmu_instance *instance = fmu_enter(instance_of(component), FMU_ALIVE, "fmi3GetFMUState");
    struct fmu_saved *saved = *state;
    const enum fmu_status status = instance ? fmu_save(instance, &saved) : FMU_ERROR;
    *state = saved;
    return (fmi3Status)status;
}

fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance component, fmi3FMUState state) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_ALIVE | FMU_MODE(FAILED), "fmi3SetFMUState");
    return instance ? (fmi3Status)fmu_restore(instance, state) : fmi3Error;
}

fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance component, fmi3FMUState *state) {
    (void)component;
    fmu_forget(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance component, fmi3FMUState state, size_t *size) {
    (void)state;
    (void)size;
    return refuse(component, "fmi3SerializedFMUStateSize");
}

fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance component, fmi3FMUState state, fmi3Byte bytes[],
                                       size_t size) {
    (void)state;
    (void)bytes;
    (void)size;
    return refuse(component, "fmi3SerializeFMUState");
}

fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance component, const fmi3Byte bytes[], size_t size,
                                         fmi3FMUState *state) {
    (void)bytes;
    (void)size;
    (void)state;
    return refuse(component, "fmi3DeserializeFMUState");
}

/* ---- Derivatives ---- */

fmi3Status FMI3(fmi3GetDirectionalDerivative)(fmi3Instance component, const fmi3ValueReference unknowns[],
                                              size_t unknown_count, const fmi3ValueReference knowns[],
                                              size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                                              fmi3Float64 sensitivity[], size_t sensitivity_count) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_STARTED, "fmi3GetDirectionalDerivative");
    if (!instance || !fmu_has_length(instance, seed_count, (int)known_count) ||
        !fmu_has_length(instance, sensitivity_count, (int)unknown_count))
        return fmi3Error;
    return (fmi3Status)fmu_directional(instance, unknowns, unknown_count, knowns, known_count, seed,
                                       sensitivity);
}

fmi3Status FMI3(fmi3GetAdjointDerivative)(fmi3Instance component, const fmi3ValueReference unknowns[],
                                          size_t unknown_count, const fmi3ValueReference knowns[],
                                          size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                                          fmi3Float64 sensitivity[], size_t sensitivity_count) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_STARTED, "fmi3GetAdjointDerivative");
    if (!instance || !fmu_has_length(instance, seed_count, (int)unknown_count) ||
        !fmu_has_length(instance, sensitivity_count, (int)known_count))
        return fmi3Error;
    return (fmi3Status)fmu_adjoint(instance, unknowns, unknown_count, knowns, known_count, seed, sensitivity);
}

/* ---- Clocks: there are none ---- */

fmi3Status FMI3(fmi3GetIntervalDecimal)(fmi3Instance component, const fmi3ValueReference references[],
                                        size_t count, fmi3Float64 intervals[],
                                        fmi3IntervalQualifier qualifiers[]) {
    (void)references;
    (void)intervals;
    (void)qualifiers;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3GetIntervalDecimal");
}

fmi3Status FMI3(fmi3GetIntervalFraction)(fmi3Instance component, const fmi3ValueReference references[],
                                         size_t count, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                         fmi3IntervalQualifier qualifiers[]) {
    (void)references;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3GetIntervalFraction");
}

fmi3Status FMI3(fmi3GetShiftDecimal)(fmi3Instance component, const fmi3ValueReference references[],
                                     size_t count, fmi3Float64 shifts[]) {
    (void)references;
    (void)shifts;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3GetShiftDecimal");
}

fmi3Status FMI3(fmi3GetShiftFraction)(fmi3Instance component, const fmi3ValueReference references[],
                                      size_t count, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)references;
    (void)counters;
    (void)resolutions;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3GetShiftFraction");
}

fmi3Status FMI3(fmi3SetIntervalDecimal)(fmi3Instance component, const fmi3ValueReference references[],
                                        size_t count, const fmi3Float64 intervals[]) {
    (void)references;
    (void)intervals;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3SetIntervalDecimal");
}

fmi3Status FMI3(fmi3SetIntervalFraction)(fmi3Instance component, const fmi3ValueReference references[],
                                         size_t count, const fmi3UInt64 counters[],
                                         const fmi3UInt64 resolutions[]) {
    (void)references;
    (void)counters;
    (void)resolutions;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3SetIntervalFraction");
}

fmi3Status FMI3(fmi3SetShiftDecimal)(fmi3Instance component, const fmi3ValueReference references[],
                                     size_t count, const fmi3Float64 shifts[]) {
    (void)references;
    (void)shifts;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3SetShiftDecimal");
}

fmi3Status FMI3(fmi3SetShiftFraction)(fmi3Instance component, const fmi3ValueReference references[],
                                      size_t count, const fmi3UInt64 counters[],
                                      const fmi3UInt64 resolutions[]) {
    (void)references;
    (void)counters;
    (void)resolutions;
    return (fmi3Status)fmu_refuse_type(instance_of(component), count, "fmi3SetShiftFraction");
}

fmi3Status FMI3(fmi3ActivateModelPartition)(fmi3Instance component, fmi3ValueReference clock, fmi3Float64 t) {
    (void)clock;
    (void)t;
    return refuse(component, "fmi3ActivateModelPartition");
}

/* ---- Model Exchange ---- */

fmi3Status FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance component) {
    return fmu_enter(instance_of(component), FMU_MODE(INITIALISING) | FMU_MODE(EVENT_MODE),
                     "fmi3EvaluateDiscreteStates")
               ? fmi3OK
               : fmi3Error;
}

fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance component, fmi3Boolean *needs_update,
                                          fmi3Boolean *terminates, fmi3Boolean *nominals_changed,
                                          fmi3Boolean *states_changed, fmi3Boolean *has_next,
                                          fmi3Float64 *t_next) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(EVENT_MODE), "fmi3UpdateDiscreteStates");
    struct fmu_event_update update;
    if (!instance)
        return fmi3Error;
    const enum fmu_status status = fmu_update_events(instance, &update);
    *needs_update = *nominals_changed = false;
    *terminates = update.ends;
    *states_changed = update.changes_states;
    *has_next = isfinite(update.t_next);
    *t_next = isfinite(update.t_next) ? update.t_next : 0;
    return (fmi3Status)status;
}

fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance component, fmi3Boolean is_final,
                                             fmi3Boolean *wants_event_mode, fmi3Boolean *wants_end) {
    (void)is_final;
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(CONTINUOUS_MODE), "fmi3CompletedIntegratorStep");
    *wants_event_mode = *wants_end = false;
    if (!instance)
        return fmi3Error;
    *wants_event_mode = fmu_complete_step(instance) != 0;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SetTime)(fmi3Instance component, fmi3Float64 t) {
    struct fmu_instance *instance = fmu_enter_exchange(
        instance_of(component), FMU_MODE(EVENT_MODE) | FMU_MODE(CONTINUOUS_MODE), "fmi3SetTime");
    return instance ? (fmi3Status)fmu_set_time(instance, t) : fmi3Error;
}

fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance component, const fmi3Float64 states[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_MODE(CONTINUOUS_MODE), "fmi3SetContinuousStates");
    return instance && fmu_has_length(instance, count, fmu_count_states(instance->work.model))
               ? (fmi3Status)fmu_set_states(instance, states)
               : fmi3Error;
}

fmi3Status FMI3(fmi3GetContinuousStates)(fmi3Instance component, fmi3Float64 states[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_STARTED, "fmi3GetContinuousStates");
    return instance && fmu_has_length(instance, count, fmu_count_states(instance->work.model))
               ? (fmi3Status)fmu_get_states(instance, states)
               : fmi3Error;
}

fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance component, fmi3Float64 derivatives[],
                                                   size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_STARTED, "fmi3GetContinuousStateDerivatives");
    return instance && fmu_has_length(instance, count, fmu_count_states(instance->work.model))
               ? (fmi3Status)fmu_get_derivatives(instance, derivatives)
               : fmi3Error;
}

fmi3Status FMI3(fmi3GetEventIndicators)(fmi3Instance component, fmi3Float64 indicators[], size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_STARTED, "fmi3GetEventIndicators");
    return instance && fmu_has_length(instance, count, fmu_count_indicators(instance->work.model))
               ? (fmi3Status)fmu_get_indicators(instance, indicators)
               : fmi3Error;
}

fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance component, fmi3Float64 nominals[],
                                                   size_t count) {
    struct fmu_instance *instance =
        fmu_enter_exchange(instance_of(component), FMU_ALIVE, "fmi3GetNominalsOfContinuousStates");
    if (!instance || !fmu_has_length(instance, count, fmu_count_states(instance->work.model)))
        return fmi3Error;
    fmu_find_nominals(instance->work.model, nominals);
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance component, size_t *count) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_ALIVE, "fmi3GetNumberOfEventIndicators");
    if (!instance)
        return fmi3Error;
    *count = (size_t)fmu_count_indicators(instance->work.model);
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance component, size_t *count) {
    struct fmu_instance *instance =
        fmu_enter(instance_of(component), FMU_ALIVE, "fmi3GetNumberOfContinuousStates");
    if (!instance)
        return fmi3Error;
    *count = (size_t)fmu_count_states(instance->work.model);
    return fmi3OK;
}

/* ---- Co-Simulation ---- */

fmi3Status FMI3(fmi3GetOutputDerivatives)(fmi3Instance component, const fmi3ValueReference references[],
                                          size_t count, const fmi3Int32 orders[], fmi3Float64 values[],
                                          size_t value_count) {
    (void)references;
    (void)count;
    (void)orders;
    (void)values;
    (void)value_count;
    return refuse(component, "fmi3GetOutputDerivatives");
}

/* Steps. An event that ends the motion is not a failure: the step returns early. */
fmi3Status FMI3(fmi3DoStep)(fmi3Instance component, fmi3Float64 t_now, fmi3Float64 step, fmi3Boolean is_final,
                            fmi3Boolean *needs_event_mode, fmi3Boolean *terminates, fmi3Boolean *is_early,
                            fmi3Float64 *t_last) {
    struct fmu_instance *instance =
        fmu_enter_steps(instance_of(component), FMU_MODE(STEP_MODE), "fmi3DoStep");
    fmi3Boolean *const results[] = {needs_event_mode, terminates, is_early};
    (void)is_final;
    for (int i = 0; i < 3; i++)
        if (results[i])
            *results[i] = false;
    if (!instance)
        return fmi3Error;
    const enum fmu_status status = fmu_step(instance, t_now, t_now + step);
    const bool has_ended = instance->mode == FMU_ENDED;
    if (terminates)
        *terminates = has_ended;
    if (t_last)
        *t_last = instance->integrator.t;
    return has_ended ? fmi3OK : (fmi3Status)status;
}
