/*
 * One instance of an FMU, for both versions of FMI and both of its types.
 *
 * It holds a workspace and an integrator of the core: Co-Simulation steps with it; Model Exchange takes its
 * state, its accelerations and its events, and leaves the steps to the importer. All that changes lies in
 * the struct and in one block of memory, so that both together are the instance's state.
 */
#ifndef REFDYN_FMI_INSTANCE_H
#define REFDYN_FMI_INSTANCE_H

#include "fmi/fmu.h"
#include "fmi/variables.h"

#include <stddef.h>

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

#endif
