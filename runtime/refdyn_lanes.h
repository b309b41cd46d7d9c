/*
 * The interface between emitted C for motions side by side and whatever calls it: the functions of
 * refdyn_model.h, each call for `width` motions, one in each lane of a vector.
 *
 * All functions share one form:
 *     void f(const double *p, const double *x, const double *t, const double *q, const double *qd, double
 * *out) Arguments and shapes are those of refdyn_model.h, each entry `width` doubles, one a lane: entry i of
 * lane l stands at [i * width + l], t has `width` doubles, parameters may differ from lane to lane. All
 * arrays are aligned to `width` doubles. What a lane gives depends on no other one, not even its last bit.
 */
#ifndef REFDYN_LANES_H
#define REFDYN_LANES_H

#include "refdyn_model.h"

/* Of struct refdyn_lane_model, as REFDYN_MODEL_VERSION is of struct refdyn_model. */
#define REFDYN_LANES_VERSION 3

typedef void refdyn_lane_function(const double *p, const double *x, const double *t, const double *q,
                                  const double *qd, double *out);

/* A pointer is NULL where that of the model is. */
struct refdyn_lane_model {
    int interface_version; /* REFDYN_LANES_VERSION; the first field in every version */
    int width;             /* lanes: 1, 2, 4 or 8 */
    const struct refdyn_model *model;

    void (*prepare)(double *p); /* writes p[parameter_count * width ...] */
    /* the functions of struct refdyn_model from `start` on */
#define REFDYN_LANE_FUNCTION(name) refdyn_lane_function *name;
    REFDYN_QUANTITIES(REFDYN_LANE_FUNCTION)
#undef REFDYN_LANE_FUNCTION
};

#endif
