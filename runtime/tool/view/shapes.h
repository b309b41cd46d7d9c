/*
 * What stands for the bodies of a model: elements of beams by their sections, solids by mass and inertia.
 *
 * Takes a model whose parameters have their values; gives shapes of unit size (a ball of diameter 1, a
 * cylinder and a box along x of length and width 1), each with the map from its axes to those of a frame.
 * Solids that are mostly air, as wrong inertias make them, are drawn smaller, about their centre.
 */
#ifndef REFDYN_TOOL_SHAPES_H
#define REFDYN_TOOL_SHAPES_H

#include "gen.h"

/* A box and a cylinder begin at x = 0 and lie about the x axis; a ball has its middle at 0. */
enum shape_kind { SHAPE_BALL, SHAPE_CYLINDER, SHAPE_BOX };

struct shape {
    enum shape_kind kind;
    int frame; /* of the tree, -1: the ground */
    int link;
    bool is_solid;    /* else an element of a beam */
    double bore;      /* of a cylinder: inner over outer diameter */
    double axes[9];   /* row-major: columns are the images of the unit axes [m] */
    double origin[3]; /* [m] */
};

/* Calls `take` for each shape, link by link. */
void shapes_give(const struct generation *generation, void take(void *context, const struct shape *shape),
                 void *context);

#endif
