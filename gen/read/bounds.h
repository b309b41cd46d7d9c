/*
 * Bounds of the values of expressions. Coordinates, points, inputs and time are unbounded; parameters have
 * their values. Bounds are never too narrow.
 */
#ifndef REFDYN_GEN_BOUNDS_H
#define REFDYN_GEN_BOUNDS_H

#include "graph/graph.h"
#include "model/model.h"

struct bounds {
    double least, most;
};

/* Bounds of all values of the graph so far, by handle, in the scratch of its memory. */
struct bounds *bounds_of_values(const struct graph *g, const struct parameter *parameters);

#endif
