/*
 * One motion of a scene, from its start to its end, output by output: what `sim` and `report` share.
 */
#ifndef REFDYN_TOOL_MOTION_H
#define REFDYN_TOOL_MOTION_H

#include "simulate/event_record.h"
#include "simulate/gsl_motion.h"
#include "command_line/commands.h"
#include "system/progress.h"
#include "simulate/stop_conditions.h"

enum {
    MOTION_INTERRUPTED = 1000 /* beside the runtime's statuses */,
    MOTION_TOO_SLOW,
    MOTION_NOT_WRITTEN,
    STABILISE_COUNT = 3
};

/* By enum refdyn_stabilise. */
extern const char *const stabilise_names[STABILISE_COUNT];

/* What --stabilise, --start and --singular may be; NULL ends each list. */
extern const char *const motion_stabilise_words[], *const motion_start_words[],
                                                       *const motion_singular_words[];

struct motion {
    struct scene *scene;
    struct refdyn_integrator integrator;
    const char *method;
    struct refdyn_gsl *gsl; /* takes the steps, NULL: the integration does */
    void *memory;
    struct refdyn_energy energy;
    struct event_record events;
    double *values;            /* p, then x of the scene at the start, where events change them; NULL */
    struct stops *stops;       /* conditions that end it, the caller's; NULL, as after motion_start: none */
    double from, until, every; /* [s] */
    long outputs;              /* the first one is the start */
    double cpu_s, wall_s;      /* of integration alone; since the start */
    double cpu_limit;          /* MOTION_TOO_SLOW beyond; 0, as at the start: none [s] */
    double started;
};

/* Runtime options from --method --step --tol --step-max --stabilise --singular --start; complains when they
 * do not go together. */
enum status motion_options(const struct options *options, struct refdyn_options *integration);
/* A model in the printed form has no tangent: complains when the method that was asked for needs it. */
enum status motion_fit(const struct scene *scene, const struct options *options,
                       const struct refdyn_options *integration);
/* Between outputs [s]: `every`, or where it is 0 a 200th of the motion's length `span`. */
double motion_distance(double span, double every);
/* Outputs at the multiples of `every` before the end, and at the end; the first is the start. */
long motion_count_outputs(double span, double every);
/* What a scene needs for a motion from where --from tells. */
unsigned motion_needs(const struct options *options);
/* Sets the scene's q, qd and t to the start of the motion that --from tells, and the anchored parameters from
 * it. */
enum status motion_place(struct scene *scene, const struct options *options);
/* Complains when the motion from the scene's t to --until has no length, or too many outputs. */
enum status motion_check_times(const struct scene *scene, const struct options *options);
/* Starts at the scene's state. Returns a status of the runtime; motion_release in any case, which restores.
 */
int motion_start(struct motion *motion, struct scene *scene, const struct refdyn_options *integration,
                 double until, double every);
/* After motion_start: the steps by a method of GSL. Returns a status of the runtime. */
int motion_by_gsl(struct motion *motion, const char *method);
/* How much of the way from the start to the end is done. */
double motion_fraction(const struct motion *motion);
/* Goes on to output i, or to where one of the stops is reached or an event ends it; progress may be NULL.
 * Returns a status of the runtime, MOTION_INTERRUPTED or MOTION_TOO_SLOW. */
int motion_to(struct motion *motion, long i, struct progress *progress);
bool motion_is_stopped(const struct motion *motion);
/* The scene's parameters and inputs are those of the start again, whatever events have set. */
void motion_restore(const struct motion *motion);
void motion_release(struct motion *motion);

#endif
