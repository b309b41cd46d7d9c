/*
 * The error of a whole motion, from two runs of it at different tolerances or steps.
 *
 * Where the error of the other run is a part s of that of the judged one, their difference is |1 - s| of the
 * latter (Richardson; Hairer, Norsett and Wanner, Solving ODEs I, II.4). Fixed steps: s = (h_other/h)^p, p
 * the order of the method. Steps that are found: errors go with the tolerance, also where stability rules the
 * steps.
 */
#ifndef REFDYN_TOOL_ERROR_ESTIMATE_H
#define REFDYN_TOOL_ERROR_ESTIMATE_H

#include "text/output.h"
#include "refdyn.h"

/* Positions at the outputs of one run. */
struct track {
    const struct refdyn_model *model;
    long count;
    double *t; /* (count) [s] */
    double *q; /* (count x n) */
    double *r; /* (count x point_count x 3) [m] */
};

void track_start(struct track *track, const struct refdyn_model *model, long room);
/* The integration's state is the next output. */
void track_add(struct track *track, const struct refdyn_integrator *integrator);
/* How far the points of output i of one are from those of output j of the other, the largest; of a model
 * without points the coordinates. NaN when any is. */
double track_distance(const struct track *a, long i, const struct track *b, long j);
/* How far the motion gets from its start in the first `count` outputs. */
double track_way(const struct track *track, long count);
void track_release(struct track *track);

/* The largest of some errors, and when. */
struct peak {
    double error, t;
};

struct estimate {
    const struct refdyn_model *model;
    long count;               /* outputs that both runs have */
    const double *t;          /* (count) [s], of the judged one */
    double *distances;        /* (point_count x count) estimated error of each point [m] */
    struct peak *points;      /* (point_count) */
    struct peak *coordinates; /* (n) */
    struct peak largest; /* over all points; over the coordinates of a model without points [m, or the units
                            of the coordinates] */
    double difference;   /* of the two runs, from which it comes */
    bool is_trusted;
};

/* Error of `judged` from its difference to `other`; share: error of `other` over that of `judged`, not 1.
 * Trusted are differences that are small beside the way of the motion. estimate_release in any case. */
void estimate_make(struct estimate *estimate, const struct track *judged, const struct track *other,
                   double share);
void estimate_print(const struct estimate *estimate);
void estimate_put(const struct estimate *estimate, struct document *document);
void estimate_release(struct estimate *estimate);

#endif
