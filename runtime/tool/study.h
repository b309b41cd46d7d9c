/*
 * Error against run time: the runs of one scene over step sizes and stabilisations, judged by a reference
 * run.
 */
#ifndef REFDYN_TOOL_STUDY_H
#define REFDYN_TOOL_STUDY_H

#include "motion.h"

enum { STEPS_MAX = 16, STUDY_RUNS_MAX = STABILISE_COUNT * STEPS_MAX };

/* One run of RK4. */
struct trial {
    double step;
    enum refdyn_stabilise stabilise;
    int result;       /* status of the runtime; REFDYN_OK: to the end */
    double stopped_t; /* where it stopped [s] */
    double *track; /* (outputs x tracked) positions of points, or coordinates of a model without points; NULL
                      when it failed */
    double error;  /* largest distance from the reference over the outputs [m] */
    double cpu_s, phi_max, psi_max, energy_error;
    long steps, evaluations;
};

struct study {
    const char *name; /* "n_rfe=4", or the model's name */
    struct trial trials[STUDY_RUNS_MAX];
    int count;
    struct trial reference;
    long outputs;
    int tracked; /* numbers an output */
    int stride;  /* numbers that make one distance: 3 for points, 1 for coordinates */
};

/*
 * Runs all. steps (step_count): those to try; NULL: halved from the largest that completes, as long as the
 * whole study is expected to end within `seconds`. Returns STATUS_DONE also when some runs failed;
 * STATUS_NUMBERS when no reference could be had.
 */
enum status study_run(struct study *study, struct scene *scene, const struct options *options,
                      const double *steps, int step_count, double seconds);
void study_release(struct study *study);

#endif
