/*
 * Warnings about what a model may well mean otherwise: values that look like millimetres or degrees, beams
 * that are none, coordinates without inertia or load. Takes a model without complaints.
 */
#ifndef REFDYN_GEN_PLAUSIBLE_H
#define REFDYN_GEN_PLAUSIBLE_H

#include "tree.h"

void warn_of_values(const struct model *model, const struct tree *tree, struct messages *messages);

#endif
