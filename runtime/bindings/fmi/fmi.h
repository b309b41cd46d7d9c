/* The parts of an FMU, for fmi2.c and fmi3.c, the two versions of the standard: Functional Mock-up Interface
 * for Model Exchange and Co-Simulation, 2.0.5 and 3.0.2, Modelica Association. */
#ifndef REFDYN_FMI_H
#define REFDYN_FMI_H

#include "refdyn.h"
#include "runtime/bindings/fmi/variables.h"

/* ---- Constants ---- */

/* The model of an FMU and the values that it was exported with. `refdyn export` writes this struct as C. */
struct refdyn_fmu {
    const struct refdyn_model *model;
    const struct refdyn_spatial *spatial; /* NULL: no point with angular velocity */
    const char *token;                    /* GUID of FMI 2.0, instantiation token of FMI 3.0 */
    const double *parameters;             /* (parameter_count) values at the start */
    const int *given; /* (anchored_count) non-zero: the anchored parameter keeps its value in `parameters` */
    const double *inputs;          /* (input_count) */
    const double *start;           /* (2 n) q, qd; NULL: computed from parameters by the model's `start` */
    double t_start;                /* [s] */
    struct refdyn_options options; /* of Co-Simulation */
};
extern const struct refdyn_fmu refdyn_fmu;

/* ---- Instances (instance.c) ---- */

/* Numbered like the statuses of FMI, without fmi2Pending. */
enum fmu_status { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR, FMU_FATAL };

enum fmu_mode {
    FMU_INSTANTIATED,
    FMU_INITIALISING,
    FMU_EVENT_MODE,
    FMU_CONTINUOUS_MODE,
    FMU_STEP_MODE, /* of Co-Simulation */
    FMU_ENDED,     /* terminated, or ended by an event */
    FMU_FAILED
};

/* The receiver of messages; both functions belong to a version of FMI. */
struct fmu_listener {
    void (*tell)(const struct fmu_listener *listener, enum fmu_status status, const char *category,
                 const char *text);
    const void *environment, *function, *name;
};

/* Values that are computed together. */
enum fmu_block {
    FMU_POINTS = 1,
    FMU_ENERGIES = 2,
    FMU_FORCES = 4,
    FMU_COURSES = 8,
    FMU_ANGULAR = 16,
    FMU_D_QDD = 32,
    FMU_D_FORCE = 64
};

/* One instance, of both versions and types. Co-Simulation steps with the integrator; Model Exchange uses its
 * state, accelerations and events, and leaves the steps to the importer. This struct and one block of memory
 * are the state of the instance. */
struct fmu_instance {
    struct fmu_listener listener;
    int is_logging; /* messages other than warnings and errors are sent */
    int is_exchange;
    enum fmu_mode mode;
    struct refdyn_options options;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double t_first, t_stop; /* start and end of the experiment; INFINITY: unknown [s] */
    double t_from;  /* Model Exchange: evaluations begin here, on the right side of the last time event [s] */
    double t_to;    /* and end here, on the left side of the next time event; INFINITY: none is known [s] */
    double t_next;  /* the next time event [s] */
    double t_seen;  /* time of the last completed step of the importer, or of the last event mode [s] */
    int is_started; /* the integrator has a motion */
    int is_stale;   /* accelerations do not belong to the state */
    int has_new_values; /* parameters or inputs have changed since the integrator read them */
    int has_events_due; /* events at the start are waiting, with values that are still valid */
    unsigned filled;    /* set of enum fmu_block */

    size_t work_size, integrator_size, block_size;
    char *block;                     /* memory of workspace and integrator, followed by the arrays below */
    double *start;                   /* (2 n) q, qd set before the start */
    int *is_start_set;               /* (2 n) */
    int *given;                      /* (anchored_count) parameters that keep their value at the start */
    double *rates;                   /* (2 n + 1 + m) */
    double *r, *rd, *rdd, *C;        /* positions, velocities, accelerations and Jacobians of points */
    double *energy, *force, *course; /* (3), (n), (course_count) */
    double *lambda;                  /* (m) NaN for rows whose multiplier is not unique */
    double *drift, *J;               /* (spatial x 6), (spatial x 6 x n) */
    double *d_qdd, *d_force;         /* (n x (2 n + inputs)) derivatives by q, qd, inputs, in this order */
    double *zeros;                   /* (indicators) value that an event has left beyond zero */
    double *left_at, *left_rate; /* (events) time of the last occurrence [s], or -INFINITY; rate after it */
    double *since;   /* (contacts) when they came to rest, as reported to the listener; NaN: open [s] */
    double *scratch; /* (6 n + 1 + m + 2 inputs + 3 points + courses + indicators) */
};

/* Creates an instance. Returns NULL, after a message, if memory is exhausted or the model is invalid. */
struct fmu_instance *fmu_open(const struct fmu_listener *listener, int is_exchange, int is_logging);
void fmu_close(struct fmu_instance *instance);
/* Returns the instance to its state after fmu_open. */
enum fmu_status fmu_reset(struct fmu_instance *instance);
/* Sets start, end and tolerance of the motion; tolerance 0: that of the export. Model Exchange ignores it,
 * because the importer takes the steps. */
enum fmu_status fmu_set_experiment(struct fmu_instance *instance, double tolerance, double t_first,
                                   double t_stop);
/* Computes accelerations, multipliers and row terms of the state with the values that were set. Starts the
 * motion first, at a state that satisfies the rows. */
enum fmu_status fmu_evaluate(struct fmu_instance *instance);
/* Discards everything that was computed, after a change of the state. */
void fmu_invalidate(struct fmu_instance *instance);
/* Returns the parameters of the motion, including the gains of its stabilisation. */
const double *fmu_motion_parameters(const struct fmu_instance *instance);

/* Sends a message and returns the status. */
enum fmu_status fmu_tell(struct fmu_instance *instance, enum fmu_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/* Reports contacts that have come to rest or have opened since the last call. */
void fmu_tell_contacts(struct fmu_instance *instance);
/* Reports a numerical failure: time, reason and state, for a status of the core. */
enum fmu_status fmu_tell_failure(struct fmu_instance *instance, int status);
/* Returns whether the instance is in one of the modes (a set of 1 << mode); otherwise reports that `function`
 * is not allowed. */
int fmu_allows(struct fmu_instance *instance, unsigned modes, const char *function);

/* ---- Co-Simulation (co_simulation.c) ---- */

/* Steps from t_now, the time of the motion, to t_next. FMU_DISCARD: an event of the model has ended the
 * motion earlier, at integrator.t. */
enum fmu_status fmu_step(struct fmu_instance *instance, double t_now, double t_next);

/* ---- Directional derivatives of accelerations and outputs by states and inputs (directional.c) ---- */

/* At the present state: sensitivity (unknown_count) = d unknowns / d knowns seed (known_count); and
 * sensitivity (known_count) = seed (unknown_count) d unknowns / d knowns. */
enum fmu_status fmu_directional(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                                const unsigned *knowns, size_t known_count, const double *seed,
                                double *sensitivity);
enum fmu_status fmu_adjoint(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity);

/* ---- Exported functions. Importers that link the sources into a program define FMI2_FUNCTION_PREFIX or
 * FMI3_FUNCTION_PREFIX; private names have no prefix, so that it can contain the sources of one FMU only ----
 */

#if defined(_WIN32)
#define FMI_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI_EXPORT __attribute__((visibility("default")))
#else
#define FMI_EXPORT
#endif

#define FMI_JOIN_(a, b) a##b
#define FMI_JOIN(a, b) FMI_JOIN_(a, b)

/* ---- Model Exchange (model_exchange.c) ---- */

struct fmu_event_update {
    int ends;           /* an event of the model ends the motion */
    int changes_states; /* q or qd have changed */
    double t_next;      /* time of the next time event; INFINITY: none is known [s] */
};

/* nominals (fmu_count_states): 1, or the scale of a state of a controller */
void fmu_find_nominals(const struct refdyn_model *model, double *nominals);
enum fmu_status fmu_set_time(struct fmu_instance *instance, double t);
/* state (fmu_count_states) */
enum fmu_status fmu_set_states(struct fmu_instance *instance, const double *state);
enum fmu_status fmu_get_derivatives(struct fmu_instance *instance, double *derivatives);
/* indicators (fmu_count_indicators) */
enum fmu_status fmu_get_indicators(struct fmu_instance *instance, double *indicators);
/* Executes all events at the present time and state. */
enum fmu_status fmu_update_events(struct fmu_instance *instance, struct fmu_event_update *update);
/* Call after a step of the importer. Returns 1 if the importer has passed an event unnoticed and must enter
 * event mode: importers miss a value that leaves zero and returns within one step. */
int fmu_complete_step(struct fmu_instance *instance);

/* ---- Saved states ---- */

struct fmu_saved;
/* Copies the state into *saved, which is allocated if NULL. */
enum fmu_status fmu_save(struct fmu_instance *instance, struct fmu_saved **saved);
/* Restores a state of this instance, which then continues to the bit as it did from there. */
enum fmu_status fmu_restore(struct fmu_instance *instance, const struct fmu_saved *saved);
void fmu_forget(struct fmu_saved *saved);

/* ---- Common parts of both versions: their functions check the mode, then call these ---- */

#define FMU_MODE(name) (1u << FMU_##name)
enum {
    FMU_ALIVE = FMU_MODE(INSTANTIATED) | FMU_MODE(INITIALISING) | FMU_MODE(EVENT_MODE) |
                FMU_MODE(CONTINUOUS_MODE) | FMU_MODE(STEP_MODE) | FMU_MODE(ENDED),
    FMU_STARTED = FMU_ALIVE & ~FMU_MODE(INSTANTIATED), /* with a motion, or being initialised */
    FMU_RUNNING = FMU_STARTED & ~FMU_MODE(INITIALISING)
};

/* Returns the instance if it is in one of the modes, and of any type, of Model Exchange, or of Co-Simulation;
 * otherwise reports the error and returns NULL. */
struct fmu_instance *fmu_enter(struct fmu_instance *instance, unsigned modes, const char *function);
struct fmu_instance *fmu_enter_exchange(struct fmu_instance *instance, unsigned modes, const char *function);
struct fmu_instance *fmu_enter_steps(struct fmu_instance *instance, unsigned modes, const char *function);
/* Returns whether an array of the importer has the length of the model. */
int fmu_has_length(struct fmu_instance *instance, size_t count, int wanted);
enum fmu_status fmu_leave_initialisation(struct fmu_instance *instance);
/* states (fmu_count_states): q of joints, qd */
enum fmu_status fmu_get_states(struct fmu_instance *instance, double *states);
/* Reports a function that the description excludes. */
enum fmu_status fmu_refuse(struct fmu_instance *instance, const char *function);
/* Reports an error if variables of a type other than real numbers are requested. */
enum fmu_status fmu_refuse_type(struct fmu_instance *instance, size_t count, const char *function);

/* ---- Values of variables ---- */

enum fmu_status fmu_get(struct fmu_instance *instance, unsigned reference, double *value);
enum fmu_status fmu_set(struct fmu_instance *instance, unsigned reference, double value);
/* Computes the blocks (set of enum fmu_block) for the present state, which has been evaluated. */
void fmu_fill(struct fmu_instance *instance, unsigned blocks);
/* Computes event indicators (fmu_count_indicators) of a state q, qd (2 n) at the present time. */
void fmu_find_indicators(const struct fmu_instance *instance, const double *state, double *indicators);

#endif
