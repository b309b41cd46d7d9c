/* The parts of an FMU. */
#ifndef REFDYN_FMI_H
#define REFDYN_FMI_H

#include <stddef.h>

#include "refdyn.h"
#include "runtime/bindings/fmi/variables.h"

/*
 * What an FMU knows of itself: its model and the values that it was exported with.
 *
 * `refdyn export` writes one of these as C beside the emitted model; the layer of this folder turns it into
 * the functions of FMI. FMI: Functional Mock-up Interface for Model Exchange and Co-Simulation, 2.0.5 and
 * 3.0.2, Modelica Association.
 */

struct refdyn_fmu {
    const struct refdyn_model *model;
    const struct refdyn_spatial *spatial; /* NULL: no point has angular velocities */
    const char *token;                    /* GUID of FMI 2.0, instantiation token of FMI 3.0 */
    const double *parameters;             /* (parameter_count) values at the start */
    const int *given;     /* (anchored_count) non-zero: an anchored parameter that has its value from above */
    const double *inputs; /* (input_count) */
    const double *start;  /* (2 n) q, qd; NULL: what the model's `start` makes of its parameters */
    double t_start;       /* [s] */
    struct refdyn_options options; /* of Co-Simulation */
};

extern const struct refdyn_fmu refdyn_fmu;

/*
 * One instance of an FMU, for both versions of FMI and both of its types.
 *
 * It holds a workspace and an integrator of the core: Co-Simulation steps with it; Model Exchange takes its
 * state, its accelerations and its events, and leaves the steps to the importer. All that changes lies in
 * the struct and in one block of memory, so that both together are the instance's state.
 */

/* As FMI numbers them, but for fmi2Pending. */
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

/* Who hears messages; both functions belong to a version of FMI. */
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

struct fmu_instance {
    struct fmu_listener listener;
    int is_logging; /* warnings and errors are told in any case */
    int is_exchange;
    enum fmu_mode mode;
    struct refdyn_options options;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double t_first, t_stop; /* INFINITY: not known [s] */
    double t_from;      /* Model Exchange: nothing is evaluated before, right of the last time event [s], */
    double t_to;        /* and nothing from here on, left of the next one; INFINITY: none is known [s] */
    double t_next;      /* that next one */
    double t_seen;      /* of the last step that the importer has completed, or of the last event mode [s] */
    int is_started;     /* the integrator has a motion */
    int is_stale;       /* accelerations are not those of the state */
    int has_new_values; /* parameters or inputs are not those that the integrator knows */
    int has_events_due; /* those of the start, whose values still hold, and not taken yet */
    unsigned filled;    /* set of enum fmu_block */

    size_t work_size, integrator_size, block_size;
    char *block;              /* memory of workspace and integrator, then: */
    double *start;            /* (2 n) q, qd that were set before the start */
    int *is_start_set;        /* (2 n) */
    int *given;               /* (anchored_count) parameters that keep their value at the start */
    double *rates;            /* (2 n + 1 + m) */
    double *r, *rd, *rdd, *C; /* of points */
    double *energy;           /* (3) */
    double *force;            /* (n) */
    double *course;           /* (course_count) */
    double *drift, *J;        /* (spatial x 6), (spatial x 6 x n) */
    double *d_qdd, *d_force;  /* (n x (2 n + inputs)) by q, qd, inputs, one behind the other */
    double *zeros;            /* (indicators) what an event has left of its value beyond zero */
    double *left_at,
        *left_rate;  /* (events) when each last happened, -INFINITY: not yet [s]; the value's rate after it */
    double *since;   /* (contacts) when they came to rest, as the listener knows; NaN: they are free [s] */
    double *scratch; /* (6 n + 1 + m + 2 inputs + 3 points + courses + indicators) */
};

/* NULL: out of memory, or the model is refused, as the listener is told. */
struct fmu_instance *fmu_open(const struct fmu_listener *listener, int is_exchange, int is_logging);
void fmu_close(struct fmu_instance *instance);
/* As behind fmu_open. */
enum fmu_status fmu_reset(struct fmu_instance *instance);
/* Where and how the motion starts; tolerance 0: that of the export. Model Exchange, which takes no steps, has
 * none. */
enum fmu_status fmu_set_experiment(struct fmu_instance *instance, double tolerance, double t_first,
                                   double t_stop);
/* A motion begins with the values that were set, at a state that meets the rows. */
enum fmu_status fmu_start(struct fmu_instance *instance);
/* Accelerations, multipliers and row terms of the state, with the values that were set. */
enum fmu_status fmu_evaluate(struct fmu_instance *instance);
/* The state has changed: nothing that was computed holds. */
void fmu_invalidate(struct fmu_instance *instance);
/* The motion's parameters, with the gains that its stabilisation takes. */
const double *fmu_motion_parameters(const struct fmu_instance *instance);

/* Tells what is wrong, and returns the status. */
enum fmu_status fmu_tell(struct fmu_instance *instance, enum fmu_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/* Says which contacts have come to rest or have let go since the last call. */
void fmu_tell_contacts(struct fmu_instance *instance);
/* The numbers have failed, with a status of the core: tells when, why and at which state. */
enum fmu_status fmu_tell_failure(struct fmu_instance *instance, int status);
/* Is the instance in one of the modes (a set of 1 << mode)? Otherwise tells that `function` does not go. */
int fmu_allows(struct fmu_instance *instance, unsigned modes, const char *function);

/* Co-Simulation: the integrator of the core steps from one communication point to the next. */

/* From t_now, where the motion is, to t_next. FMU_DISCARD: an event of the model has ended the motion before,
 * at integrator.t. */
enum fmu_status fmu_step(struct fmu_instance *instance, double t_now, double t_next);

/* Directional derivatives of accelerations and outputs by states and inputs. */

/* sensitivity (unknown_count) = d unknowns / d knowns seed (known_count), at the present state. */
enum fmu_status fmu_directional(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                                const unsigned *knowns, size_t known_count, const double *seed,
                                double *sensitivity);

/* sensitivity (known_count) = seed (unknown_count) d unknowns / d knowns. */
enum fmu_status fmu_adjoint(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity);

/*
 * Functions that an FMU's library gives to importers.
 *
 * Importers that link sources into a program put FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX before them, as
 * the standard has it. Names behind them have no prefix: a program holds the sources of one FMU of Refdyn.
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

/* Model Exchange: the importer integrates, this finds and takes what happens in event mode. */

struct fmu_event_update {
    int ends;           /* an event of the model ends the motion */
    int changes_states; /* q, qd are other ones */
    double t_next;      /* of the next time event; INFINITY: none is known [s] */
};

enum fmu_status fmu_set_time(struct fmu_instance *instance, double t);
/* state (2 n) */
enum fmu_status fmu_set_states(struct fmu_instance *instance, const double *state);
enum fmu_status fmu_get_derivatives(struct fmu_instance *instance, double *derivatives);
/* indicators (fmu_count_indicators) */
enum fmu_status fmu_get_indicators(struct fmu_instance *instance, double *indicators);
/* Everything that happens at the present time and state. */
enum fmu_status fmu_update_events(struct fmu_instance *instance, struct fmu_event_update *update);
/* After a step of the importer. 1: the importer has passed an event without seeing it, and must enter event
 * mode. Importers do not see a value that leaves zero and comes back within one step. */
int fmu_complete_step(struct fmu_instance *instance);

/* Copies of an instance's state, to go back to. */

struct fmu_saved;

/* Into *saved, which is made where it is NULL. */
enum fmu_status fmu_save(struct fmu_instance *instance, struct fmu_saved **saved);
/* The instance goes on as it would have then: to the bit. Only the instance that it is of. */
enum fmu_status fmu_restore(struct fmu_instance *instance, const struct fmu_saved *saved);
void fmu_forget(struct fmu_saved *saved);

/* What both versions of FMI do alike: their functions check the mode, then call these. */

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

/* Values of variables, from outside and to outside. */

enum fmu_status fmu_get(struct fmu_instance *instance, unsigned reference, double *value);
enum fmu_status fmu_set(struct fmu_instance *instance, unsigned reference, double value);
/* Fills the blocks (set of enum fmu_block) for the present state, which is evaluated already. */
void fmu_fill(struct fmu_instance *instance, unsigned blocks);

/* Event indicators (fmu_count_indicators) of a state q, qd (2 n), at the present time. */
void fmu_find_indicators(const struct fmu_instance *instance, const double *state, double *indicators);

#endif
