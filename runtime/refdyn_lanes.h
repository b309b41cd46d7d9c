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
#define REFDYN_LANES_VERSION 6

/** The form of all emitted functions for lanes. */
typedef void refdyn_lane_function(const double *p, const double *x, const double *t, const double *q,
                                  const double *qd, double *out);

/** The functions of a model for lanes of one width. */
struct refdyn_lane_model {
    int interface_version;            /**< REFDYN_LANES_VERSION; the first field in every version */
    int width;                        /**< lanes: 1, 2, 4 or 8 */
    const struct refdyn_model *model; /**< its tables hold for all lanes */

    void (*prepare)(double *p); /**< writes the derived values p[parameter_count * width] and following */
/** A member for lanes, of this name. */
#define REFDYN_LANE_FUNCTION(name) refdyn_lane_function *name;
    /** The function of struct refdyn_model with this name, for lanes; NULL if that one is NULL. */
    /** @{ */
    REFDYN_QUANTITIES(REFDYN_LANE_FUNCTION)
    /** @} */
#undef REFDYN_LANE_FUNCTION
};

#endif
