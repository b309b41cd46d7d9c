/*
 * Points and directions that forces and rows need beside the points of interest: markers of the model.
 *
 * Takes an attachment, gives expressions in symbols of the marker, which is made when there is none like it.
 * What stands on the ground is constant and needs no marker.
 */
#ifndef REFDYN_GEN_MARKERS_H
#define REFDYN_GEN_MARKERS_H

#include "tree/vector.h"

struct attachment markers_ground_attachment(void);
/* Number of the marker of a point on a link. */
int markers_point(struct model *model, const struct attachment *at);
/* Number of the marker of a vector given in the axes of `at`, which is on a link. */
int markers_direction(struct model *model, const struct attachment *at, struct vector components);

/* The marker's components in the ground frame: order 0 position, 1 velocity, 2 acceleration. */
struct vector markers_point_vector(struct model *model, const struct attachment *at, int order);
struct vector markers_direction_vector(struct model *model, const struct attachment *at,
                                       struct vector components);

#endif
