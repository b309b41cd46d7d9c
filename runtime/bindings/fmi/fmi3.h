/*
 * FMI 3.0 as C: types and functions, declared after the text of the standard (FMI 3.0.2, ch. 2 to 4).
 */
#ifndef REFDYN_FMI3_H
#define REFDYN_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "runtime/bindings/fmi/fmi.h"

#if defined(FMI3_FUNCTION_PREFIX)
#define FMI3(name) FMI_JOIN(FMI3_FUNCTION_PREFIX, name)
#else
#define FMI3(name) name
#endif

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void fmi3Logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message);
typedef void fmi3ClockUpdate(fmi3InstanceEnvironment environment);
typedef void fmi3IntermediateUpdate(fmi3InstanceEnvironment environment, fmi3Float64 t, fmi3Boolean may_set,
                                    fmi3Boolean may_get, fmi3Boolean is_step_done, fmi3Boolean may_return,
                                    fmi3Boolean *wants_return, fmi3Float64 *t_return);
typedef void fmi3Preemption(void);

/*
 * Types of variables other than Float64, with TYPE and C type: this FMU answers their functions alike.
 * Functions for binary data and clocks have another form; they follow below.
 */
#define FMI3_OTHER_TYPES(ENTRY) \
    ENTRY(Float32, fmi3Float32) \
    ENTRY(Int8, fmi3Int8)       \
    ENTRY(UInt8, fmi3UInt8)     \
    ENTRY(Int16, fmi3Int16)     \
    ENTRY(UInt16, fmi3UInt16)   \
    ENTRY(Int32, fmi3Int32)     \
    ENTRY(UInt32, fmi3UInt32)   \
    ENTRY(Int64, fmi3Int64)     \
    ENTRY(UInt64, fmi3UInt64)   \
    ENTRY(Boolean, fmi3Boolean) \
    ENTRY(String, fmi3String)

#define FMI3_DECLARE_TYPE(name, type)                                                                        \
    FMI_EXPORT fmi3Status FMI3(fmi3Get##name)(fmi3Instance component, const fmi3ValueReference references[], \
                                              size_t count, type values[], size_t value_count);              \
    FMI_EXPORT fmi3Status FMI3(fmi3Set##name)(fmi3Instance component, const fmi3ValueReference references[], \
                                              size_t count, const type values[], size_t value_count);
FMI3_OTHER_TYPES(FMI3_DECLARE_TYPE)
#undef FMI3_DECLARE_TYPE

/* ---- Instances ---- */

FMI_EXPORT const char *FMI3(fmi3GetVersion)(void);
FMI_EXPORT fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance component, fmi3Boolean is_logging,
                                                size_t category_count, const fmi3String categories[]);
FMI_EXPORT fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token,
                                                           fmi3String resources, fmi3Boolean is_visible,
                                                           fmi3Boolean is_logging,
                                                           fmi3InstanceEnvironment environment,
                                                           fmi3Logger *logger);
FMI_EXPORT fmi3Instance FMI3(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean is_visible, fmi3Boolean is_logging,
    fmi3Boolean uses_event_mode, fmi3Boolean may_return_early, const fmi3ValueReference intermediate[],
    size_t intermediate_count, fmi3InstanceEnvironment environment, fmi3Logger *logger,
    fmi3IntermediateUpdate *update);
FMI_EXPORT fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean is_visible, fmi3Boolean is_logging,
    fmi3InstanceEnvironment environment, fmi3Logger *logger, fmi3ClockUpdate *clock_update,
    fmi3Preemption *lock, fmi3Preemption *unlock);
FMI_EXPORT void FMI3(fmi3FreeInstance)(fmi3Instance component);

/* ---- Modes ---- */

FMI_EXPORT fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance component, fmi3Boolean has_tolerance,
                                                        fmi3Float64 tolerance, fmi3Float64 t_first,
                                                        fmi3Boolean has_stop, fmi3Float64 t_stop);
FMI_EXPORT fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3EnterEventMode)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3EnterConfigurationMode)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3ExitConfigurationMode)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3Terminate)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3Reset)(fmi3Instance component);

/* ---- Values ---- */

FMI_EXPORT fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance component, const fmi3ValueReference references[],
                                           size_t count, fmi3Float64 values[], size_t value_count);
FMI_EXPORT fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance component, const fmi3ValueReference references[],
                                           size_t count, const fmi3Float64 values[], size_t value_count);
FMI_EXPORT fmi3Status FMI3(fmi3GetBinary)(fmi3Instance component, const fmi3ValueReference references[],
                                          size_t count, size_t sizes[], fmi3Binary values[],
                                          size_t value_count);
FMI_EXPORT fmi3Status FMI3(fmi3SetBinary)(fmi3Instance component, const fmi3ValueReference references[],
                                          size_t count, const size_t sizes[], const fmi3Binary values[],
                                          size_t value_count);
FMI_EXPORT fmi3Status FMI3(fmi3GetClock)(fmi3Instance component, const fmi3ValueReference references[],
                                         size_t count, fmi3Clock values[]);
FMI_EXPORT fmi3Status FMI3(fmi3SetClock)(fmi3Instance component, const fmi3ValueReference references[],
                                         size_t count, const fmi3Clock values[]);
FMI_EXPORT fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance component,
                                                                fmi3ValueReference reference, size_t *count);
FMI_EXPORT fmi3Status FMI3(fmi3GetVariableDependencies)(fmi3Instance component, fmi3ValueReference dependent,
                                                        size_t dependent_elements[],
                                                        fmi3ValueReference independents[],
                                                        size_t independent_elements[],
                                                        fmi3DependencyKind kinds[], size_t count);
FMI_EXPORT fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance component, fmi3FMUState *state);
FMI_EXPORT fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance component, fmi3FMUState state);
FMI_EXPORT fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance component, fmi3FMUState *state);
FMI_EXPORT fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance component, fmi3FMUState state,
                                                       size_t *size);
FMI_EXPORT fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance component, fmi3FMUState state,
                                                  fmi3Byte bytes[], size_t size);
FMI_EXPORT fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance component, const fmi3Byte bytes[],
                                                    size_t size, fmi3FMUState *state);
FMI_EXPORT fmi3Status FMI3(fmi3GetDirectionalDerivative)(
    fmi3Instance component, const fmi3ValueReference unknowns[], size_t unknown_count,
    const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[], size_t seed_count,
    fmi3Float64 sensitivity[], size_t sensitivity_count);
FMI_EXPORT fmi3Status FMI3(fmi3GetAdjointDerivative)(fmi3Instance component,
                                                     const fmi3ValueReference unknowns[],
                                                     size_t unknown_count, const fmi3ValueReference knowns[],
                                                     size_t known_count, const fmi3Float64 seed[],
                                                     size_t seed_count, fmi3Float64 sensitivity[],
                                                     size_t sensitivity_count);

/* ---- Clocks ---- */

FMI_EXPORT fmi3Status FMI3(fmi3GetIntervalDecimal)(fmi3Instance component,
                                                   const fmi3ValueReference references[], size_t count,
                                                   fmi3Float64 intervals[],
                                                   fmi3IntervalQualifier qualifiers[]);
FMI_EXPORT fmi3Status FMI3(fmi3GetIntervalFraction)(fmi3Instance component,
                                                    const fmi3ValueReference references[], size_t count,
                                                    fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                                    fmi3IntervalQualifier qualifiers[]);
FMI_EXPORT fmi3Status FMI3(fmi3GetShiftDecimal)(fmi3Instance component, const fmi3ValueReference references[],
                                                size_t count, fmi3Float64 shifts[]);
FMI_EXPORT fmi3Status FMI3(fmi3GetShiftFraction)(fmi3Instance component,
                                                 const fmi3ValueReference references[], size_t count,
                                                 fmi3UInt64 counters[], fmi3UInt64 resolutions[]);
FMI_EXPORT fmi3Status FMI3(fmi3SetIntervalDecimal)(fmi3Instance component,
                                                   const fmi3ValueReference references[], size_t count,
                                                   const fmi3Float64 intervals[]);
FMI_EXPORT fmi3Status FMI3(fmi3SetIntervalFraction)(fmi3Instance component,
                                                    const fmi3ValueReference references[], size_t count,
                                                    const fmi3UInt64 counters[],
                                                    const fmi3UInt64 resolutions[]);
FMI_EXPORT fmi3Status FMI3(fmi3SetShiftDecimal)(fmi3Instance component, const fmi3ValueReference references[],
                                                size_t count, const fmi3Float64 shifts[]);
FMI_EXPORT fmi3Status FMI3(fmi3SetShiftFraction)(fmi3Instance component,
                                                 const fmi3ValueReference references[], size_t count,
                                                 const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
FMI_EXPORT fmi3Status FMI3(fmi3ActivateModelPartition)(fmi3Instance component, fmi3ValueReference clock,
                                                       fmi3Float64 t);

/* ---- Model Exchange ---- */

FMI_EXPORT fmi3Status FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance component);
FMI_EXPORT fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance component, fmi3Boolean *needs_update,
                                                     fmi3Boolean *terminates, fmi3Boolean *nominals_changed,
                                                     fmi3Boolean *states_changed, fmi3Boolean *has_next,
                                                     fmi3Float64 *t_next);
FMI_EXPORT fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance component, fmi3Boolean is_final,
                                                        fmi3Boolean *wants_event_mode,
                                                        fmi3Boolean *wants_end);
FMI_EXPORT fmi3Status FMI3(fmi3SetTime)(fmi3Instance component, fmi3Float64 t);
FMI_EXPORT fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance component, const fmi3Float64 states[],
                                                    size_t count);
FMI_EXPORT fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance component,
                                                              fmi3Float64 derivatives[], size_t count);
FMI_EXPORT fmi3Status FMI3(fmi3GetEventIndicators)(fmi3Instance component, fmi3Float64 indicators[],
                                                   size_t count);
FMI_EXPORT fmi3Status FMI3(fmi3GetContinuousStates)(fmi3Instance component, fmi3Float64 states[],
                                                    size_t count);
FMI_EXPORT fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance component, fmi3Float64 nominals[],
                                                              size_t count);
FMI_EXPORT fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance component, size_t *count);
FMI_EXPORT fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance component, size_t *count);

/* ---- Co-Simulation ---- */

FMI_EXPORT fmi3Status FMI3(fmi3GetOutputDerivatives)(fmi3Instance component,
                                                     const fmi3ValueReference references[], size_t count,
                                                     const fmi3Int32 orders[], fmi3Float64 values[],
                                                     size_t value_count);
FMI_EXPORT fmi3Status FMI3(fmi3DoStep)(fmi3Instance component, fmi3Float64 t_now, fmi3Float64 step,
                                       fmi3Boolean is_final, fmi3Boolean *needs_event_mode,
                                       fmi3Boolean *terminates, fmi3Boolean *is_early, fmi3Float64 *t_last);

#endif
