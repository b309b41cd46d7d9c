/*
 * Error against run time: the runs of one scene with any of the methods, over tolerances or steps, judged by
 * a reference that two methods agree on.
 */
#ifndef REFDYN_TOOL_STUDY_H
#define REFDYN_TOOL_STUDY_H

#include "simulate/motion.h"

enum {
    SETTINGS_MAX = 24,
    HALVINGS_MAX = 26 /* of the time between outputs */,
    SERIES_MAX = REFDYN_METHOD_COUNT * STABILISE_COUNT,
    REFERENCES = 2
};

/* Tolerances or steps, descending. */
struct settings {
    double list[HALVINGS_MAX];
    int count;
    bool are_given; /* else a series ends where the next one tells nothing */
};

/* What is to be run. */
struct study_plan {
    bool methods[REFDYN_METHOD_COUNT];
    struct settings tols, steps;
    double until, every; /* [s] */
};

/* One run: at a tolerance (step is 0), or at a fixed step (tol is 0). */
struct trial {
    enum refdyn_method method;
    enum refdyn_stabilise stabilise;
    double tol, step;
    int result, cause;  /* statuses of the runtime, or MOTION_...; cause: of what the steps shrank for */
    double stopped_t;   /* where it ended [s] */
    double error;       /* largest distance from the reference over the outputs; NaN when it failed */
    double cpu_s;       /* least of its repetitions; of one that was too slow: expected to the end [s] */
    double cpu_limit_s; /* what it was given [s] */
    double phi_max, psi_max, energy_error;
    long steps, rejected, evaluations, tangents;
};

/* Runs of one method and stabilisation, from the loosest setting on. Behind one that is too slow none
 * follows. */
struct series {
    enum refdyn_method method;
    enum refdyn_stabilise stabilise;
    bool is_fixed; /* settings are steps, otherwise tolerances */
    struct trial trials[SETTINGS_MAX];
    int count;
    int next;     /* setting to be run */
    bool is_over; /* no further one */
};

struct study {
    const char *name; /* "n_rfe=4", or the model's name */
    char *facts;      /* of the scene, as HTML: page.h */
    struct series series[SERIES_MAX];
    int series_count;
    struct trial references[REFERENCES]; /* errors are distances from the first one */
    int reference_count;                 /* that were found */
    double from;                         /* start of the motion [s] */
    double floor;                        /* their distance: no error below it is claimed */
    double way;                          /* how far the motion gets from its start */
    long outputs;                        /* times at which runs are compared */
    bool has_points;                     /* errors are those of points, else those of coordinates */
};

/* Runs all within about `seconds`; an interrupt ends it early. Returns STATUS_DONE also when runs failed,
 * STATUS_NUMBERS when no two methods came to the end for a reference. */
enum status study_run(struct study *study, const struct study_plan *plan, struct scene *scene,
                      double seconds);
/* The run came to the end. */
bool is_done(const struct trial *trial);
/* The two references are the same motion: nearer than 5 % of the way. */
bool has_reference(const struct study *study);
/* It came to the end near the reference: within 5 % of the way. */
bool is_settled(const struct study *study, const struct trial *trial);

#endif
