/** @file
 * The interface between emitted C for motions side by side and its callers: the functions of refdyn_model.h,
 * where each call computes `width` motions, one in each lane of a vector.
 *
 * All functions have one form:
 *
 *     void f(const double *p, const double *x, const double *t, const double *q, const double *qd,
 *            double *out)
 *
 * Arguments and shapes are those of refdyn_model.h, but each entry consists of `width` doubles, one per lane:
 * entry i of lane l is at [i * width + l]. t has `width` doubles. Parameters may differ between lanes. All
 * arrays are aligned to `width` doubles. The result of a lane does not depend on the other lanes, not even in
 * its last bit.
 */
#ifndef REFDYN_LANES_H
#define REFDYN_LANES_H

#include "refdyn_model.h"

/** Version of struct refdyn_lane_model and of its functions, like REFDYN_MODEL_VERSION for refdyn_model. */
#define REFDYN_LANES_VERSION 3

/** The form of all emitted functions for lanes. */
typedef void refdyn_lane_function(const double *p, const double *x, const double *t, const double *q,
                                  const double *qd, double *out);

/** The functions of a model for lanes of one width. */
struct refdyn_lane_model {
    int interface_version;            /**< REFDYN_LANES_VERSION; the first field in every version */
    int width;                        /**< lanes: 1, 2, 4 or 8 */
    const struct refdyn_model *model; /**< its tables hold for all lanes */

    void (*prepare)(double *p); /**< writes the derived values p[parameter_count * width] and following */
    /** The function of struct refdyn_model with this name; NULL if that one is NULL. */
    /**@{*/
    refdyn_lane_function *start;
    refdyn_lane_function *anchor;
    refdyn_lane_function *M;
    refdyn_lane_function *h;
    refdyn_lane_function *Q;
    refdyn_lane_function *u;
    refdyn_lane_function *v;
    refdyn_lane_function *phi;
    refdyn_lane_function *psi;
    refdyn_lane_function *k;
    refdyn_lane_function *r;
    refdyn_lane_function *rd;
    refdyn_lane_function *C;
    refdyn_lane_function *d;
    refdyn_lane_function *energy;
    refdyn_lane_function *power;
    refdyn_lane_function *Q_q;
    refdyn_lane_function *qdd_free;
    refdyn_lane_function *qdd;
    refdyn_lane_function *force;
    refdyn_lane_function *equations;
    refdyn_lane_function *M_h;
    refdyn_lane_function *f;
    refdyn_lane_function *row_terms;
    refdyn_lane_function *point_terms;
    refdyn_lane_function *constrained;
    refdyn_lane_function *terms;
    refdyn_lane_function *accelerations;
    refdyn_lane_function *tangent;
    refdyn_lane_function *tangent_vectors;
    refdyn_lane_function *d_qdd;
    refdyn_lane_function *d_qdd_free;
    refdyn_lane_function *d_force;
    refdyn_lane_function *d_statics;
    refdyn_lane_function *d_rows;
    refdyn_lane_function *course;
    refdyn_lane_function *breaks;
    refdyn_lane_function *switches;
    refdyn_lane_function *pace;
    refdyn_lane_function *event;
    refdyn_lane_function *event_terms;
    refdyn_lane_function *required;
    /**@}*/
};

#endif
