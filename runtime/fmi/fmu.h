/*
 * What an FMU knows of itself: its model and the values that it was exported with.
 *
 * `refdyn export` writes one of these as C beside the emitted model; the layer of this folder turns it into
 * the functions of FMI. FMI: Functional Mock-up Interface for Model Exchange and Co-Simulation, 2.0.5 and
 * 3.0.2, Modelica Association.
 */
#ifndef REFDYN_FMU_H
#define REFDYN_FMU_H

#include "refdyn.h"

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

#endif
