/*
 * Applied forces of a model along a run, as JSON: drives on coordinates, and forces and torques at points.
 *
 *     "applied": [{"name": , "kind": "drive", "frame": , "parts": [{"unit": , "steps": }]},
 *                 {"name": , "kind": "force" or "torque", "frame": , "at": [x, y, z], "parts": [3 of them]},
 * ...]
 *
 * Values are those of the model's formulas at the coordinates, rates, inputs and points of the rows, to four
 * digits of the largest. What a formula takes beside these (points that are none of interest, values of a
 * start that nobody gave) is in no row: that force is left out, and so is one that is 0 throughout.
 */
#ifndef REFDYN_TOOL_APPLIED_FORCES_H
#define REFDYN_TOOL_APPLIED_FORCES_H

#include "gen.h"
#include "view/drawn_run.h"

void applied_forces_put(FILE *out, struct generation *generation, const struct run *run,
                        const struct drawn_rows *rows);

#endif
