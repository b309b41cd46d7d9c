/*
 * FMI 2.0 as C: types and functions, declared after the text of the standard (FMI 2.0.5, ch. 2 to 4).
 */
#ifndef REFDYN_FMI2_H
#define REFDYN_FMI2_H

#include <stddef.h>

#include "runtime/bindings/fmi/fmi.h"

#if defined(FMI2_FUNCTION_PREFIX)
#define FMI2(name) FMI_JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;

enum { fmi2False, fmi2True };

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef void fmi2Logger(fmi2ComponentEnvironment environment, fmi2String instance_name, fmi2Status status,
                        fmi2String category, fmi2String message, ...);

typedef struct {
    fmi2Logger *logger;
    void *(*allocate_memory)(size_t count, size_t size);
    void (*free_memory)(void *memory);
    void (*step_finished)(fmi2ComponentEnvironment environment, fmi2Status status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean new_discrete_states_needed;
    fmi2Boolean terminate_simulation;
    fmi2Boolean nominals_changed;
    fmi2Boolean states_changed;
    fmi2Boolean next_event_time_defined;
    fmi2Real next_event_time;
} fmi2EventInfo;

/* Of both types. */
#define fmi2GetTypesPlatform FMI2(fmi2GetTypesPlatform)
#define fmi2GetVersion FMI2(fmi2GetVersion)
#define fmi2SetDebugLogging FMI2(fmi2SetDebugLogging)
#define fmi2Instantiate FMI2(fmi2Instantiate)
#define fmi2FreeInstance FMI2(fmi2FreeInstance)
#define fmi2SetupExperiment FMI2(fmi2SetupExperiment)
#define fmi2EnterInitializationMode FMI2(fmi2EnterInitializationMode)
#define fmi2ExitInitializationMode FMI2(fmi2ExitInitializationMode)
#define fmi2Terminate FMI2(fmi2Terminate)
#define fmi2Reset FMI2(fmi2Reset)
#define fmi2GetReal FMI2(fmi2GetReal)
#define fmi2GetInteger FMI2(fmi2GetInteger)
#define fmi2GetBoolean FMI2(fmi2GetBoolean)
#define fmi2GetString FMI2(fmi2GetString)
#define fmi2SetReal FMI2(fmi2SetReal)
#define fmi2SetInteger FMI2(fmi2SetInteger)
#define fmi2SetBoolean FMI2(fmi2SetBoolean)
#define fmi2SetString FMI2(fmi2SetString)
#define fmi2GetFMUstate FMI2(fmi2GetFMUstate)
#define fmi2SetFMUstate FMI2(fmi2SetFMUstate)
#define fmi2FreeFMUstate FMI2(fmi2FreeFMUstate)
#define fmi2SerializedFMUstateSize FMI2(fmi2SerializedFMUstateSize)
#define fmi2SerializeFMUstate FMI2(fmi2SerializeFMUstate)
#define fmi2DeSerializeFMUstate FMI2(fmi2DeSerializeFMUstate)
#define fmi2GetDirectionalDerivative FMI2(fmi2GetDirectionalDerivative)
/* Of Model Exchange. */
#define fmi2EnterEventMode FMI2(fmi2EnterEventMode)
#define fmi2NewDiscreteStates FMI2(fmi2NewDiscreteStates)
#define fmi2EnterContinuousTimeMode FMI2(fmi2EnterContinuousTimeMode)
#define fmi2CompletedIntegratorStep FMI2(fmi2CompletedIntegratorStep)
#define fmi2SetTime FMI2(fmi2SetTime)
#define fmi2SetContinuousStates FMI2(fmi2SetContinuousStates)
#define fmi2GetDerivatives FMI2(fmi2GetDerivatives)
#define fmi2GetEventIndicators FMI2(fmi2GetEventIndicators)
#define fmi2GetContinuousStates FMI2(fmi2GetContinuousStates)
#define fmi2GetNominalsOfContinuousStates FMI2(fmi2GetNominalsOfContinuousStates)
/* Of Co-Simulation. */
#define fmi2SetRealInputDerivatives FMI2(fmi2SetRealInputDerivatives)
#define fmi2GetRealOutputDerivatives FMI2(fmi2GetRealOutputDerivatives)
#define fmi2DoStep FMI2(fmi2DoStep)
#define fmi2CancelStep FMI2(fmi2CancelStep)
#define fmi2GetStatus FMI2(fmi2GetStatus)
#define fmi2GetRealStatus FMI2(fmi2GetRealStatus)
#define fmi2GetIntegerStatus FMI2(fmi2GetIntegerStatus)
#define fmi2GetBooleanStatus FMI2(fmi2GetBooleanStatus)
#define fmi2GetStringStatus FMI2(fmi2GetStringStatus)

FMI_EXPORT const char *fmi2GetTypesPlatform(void);
FMI_EXPORT const char *fmi2GetVersion(void);
FMI_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean is_logging,
                                          size_t category_count, const fmi2String categories[]);
FMI_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                         fmi2String resources, const fmi2CallbackFunctions *functions,
                                         fmi2Boolean is_visible, fmi2Boolean is_logging);
FMI_EXPORT void fmi2FreeInstance(fmi2Component component);
FMI_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean has_tolerance,
                                          fmi2Real tolerance, fmi2Real t_first, fmi2Boolean has_stop,
                                          fmi2Real t_stop);
FMI_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component component);
FMI_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component component);
FMI_EXPORT fmi2Status fmi2Terminate(fmi2Component component);
FMI_EXPORT fmi2Status fmi2Reset(fmi2Component component);
FMI_EXPORT fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference references[],
                                  size_t count, fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference references[],
                                     size_t count, fmi2Integer values[]);
FMI_EXPORT fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference references[],
                                     size_t count, fmi2Boolean values[]);
FMI_EXPORT fmi2Status fmi2GetString(fmi2Component component, const fmi2ValueReference references[],
                                    size_t count, fmi2String values[]);
FMI_EXPORT fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference references[],
                                  size_t count, const fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference references[],
                                     size_t count, const fmi2Integer values[]);
FMI_EXPORT fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference references[],
                                     size_t count, const fmi2Boolean values[]);
FMI_EXPORT fmi2Status fmi2SetString(fmi2Component component, const fmi2ValueReference references[],
                                    size_t count, const fmi2String values[]);
FMI_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state);
FMI_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state);
FMI_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state);
FMI_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size);
FMI_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[],
                                            size_t size);
FMI_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                              fmi2FMUstate *state);
FMI_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component component,
                                                   const fmi2ValueReference unknowns[], size_t unknown_count,
                                                   const fmi2ValueReference knowns[], size_t known_count,
                                                   const fmi2Real seed[], fmi2Real sensitivity[]);
FMI_EXPORT fmi2Status fmi2EnterEventMode(fmi2Component component);
FMI_EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info);
FMI_EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component);
FMI_EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean is_final,
                                                  fmi2Boolean *wants_event_mode, fmi2Boolean *wants_end);
FMI_EXPORT fmi2Status fmi2SetTime(fmi2Component component, fmi2Real t);
FMI_EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real states[], size_t count);
FMI_EXPORT fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real derivatives[], size_t count);
FMI_EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real indicators[], size_t count);
FMI_EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real states[], size_t count);
FMI_EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real nominals[],
                                                        size_t count);
FMI_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component component,
                                                  const fmi2ValueReference references[], size_t count,
                                                  const fmi2Integer orders[], const fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component,
                                                   const fmi2ValueReference references[], size_t count,
                                                   const fmi2Integer orders[], fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2DoStep(fmi2Component component, fmi2Real t_now, fmi2Real step,
                                 fmi2Boolean is_final);
FMI_EXPORT fmi2Status fmi2CancelStep(fmi2Component component);
FMI_EXPORT fmi2Status fmi2GetStatus(fmi2Component component, fmi2StatusKind kind, fmi2Status *value);
FMI_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component component, fmi2StatusKind kind, fmi2Real *value);
FMI_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component component, fmi2StatusKind kind, fmi2Integer *value);
FMI_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component component, fmi2StatusKind kind, fmi2Boolean *value);
FMI_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component component, fmi2StatusKind kind, fmi2String *value);

#endif
