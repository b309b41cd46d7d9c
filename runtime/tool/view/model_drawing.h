/*
 * A model as a picture: the tree of its links on the left, its rows and drives on the right, each with lines
 * to the links that it acts on. Takes a model that was read; gives the text of an SVG file, the same for the
 * same model.
 */
#ifndef REFDYN_TOOL_MODEL_DRAWING_H
#define REFDYN_TOOL_MODEL_DRAWING_H

#include "gen.h"

#include <stdio.h>

void model_drawing_put(FILE *out, struct generation *generation);

#endif
