/*
 * A model as the page draws it, as JSON: frames with their joints, from which the page finds all placements,
 * and what is fixed to them: shapes, sticks, points, ends of closures.
 *
 *     "coordinates": ["base_z", ...]       the names, by frame
 *     "links": ["base", ...]
 *     "frames": [[parent, link, element, joint, x, y, z, (R11 R12 ... R33)], ...]
 *                joint 0 1 2: slides along x y z, 3 4 5: turns; T = T_parent A D(q); without R the axes are
 *                the parent's
 *     "shapes": [[kind, frame, link, is_solid, bore, m11 m12 ... m33, x, y, z], ...]    shapes.h
 *     "sticks": [[frame, link, x, y, z, x, y, z], ...]                                  from, to
 *     "points": [{"name": , "frame": , "at": [x, y, z]}, ...]
 *     "closures": [{"name": , "ends": [{"frame": , "at": }, ...]}, ...]
 */
#ifndef REFDYN_TOOL_DRAWN_MODEL_H
#define REFDYN_TOOL_DRAWN_MODEL_H

#include "gen.h"

#include <stdio.h>

/* These members, without brackets around them. Parameters are numbers in the model's graph. */
void drawn_model_put(FILE *out, struct generation *generation);

#endif
