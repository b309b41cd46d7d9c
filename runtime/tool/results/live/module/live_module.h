/* The module of a live page: what the program emits for one model, and module.c calls. */
#ifndef REFDYN_TOOL_LIVE_MODULE_H
#define REFDYN_TOOL_LIVE_MODULE_H

#include "refdyn.h"

/* A parameter that the drawing reads. */
struct live_parameter {
    const char *name;
    double value; /* if the model's functions do not read it, so that it cannot change */
};

/* A curve on which the programme keeps a point, in two of its components. */
struct live_curve {
    int point, axes[2];
};

/* One model. The functions read the values of `parameters`, in their order. */
struct live_model {
    const struct refdyn_model *model;
    const struct refdyn_spatial *spatial; /* NULL if no point has angular columns */
    const struct live_parameter *parameters;
    int parameter_count;
    /* Numbers of the drawn model, as drawn_model.c prints them. Those of shapes are consecutive. */
    int number_count, shape_start;
    int shape_count;
    const int *shape_places; /* (shape_count) places of a solid; -1: an element of a beam */
    void (*numbers)(const double *parameters, double *out);
    /* Forces and torques at a state: parts of the applied forces, one after another. */
    int applied_count;
    void (*applied)(const double *parameters, const double *x, double t, const double *q, const double *qd,
                    const double *r, const double *rd, double *out);
    const char *const *requirement_places; /* (requirement_count) "FILE:LINE" */
    /* (m x anchored_count) non-zero: the row reads this anchored parameter from the start of the motion, so
     * that it holds in statics only if the parameter is given. */
    const int *row_waits;
    const struct live_curve *curves;
    int curve_count;
    /* (curve_count) at the positions r of the points */
    void (*curve_residuals)(const double *parameters, const double *r, double *out);
};

extern const struct live_model live_model;

#endif
