/*
 * Warnings about what a model may well mean otherwise: values that look like millimetres or degrees, beams
 * that are none, coordinates without inertia or load. Takes a model without complaints.
 */
#ifndef REFDYN_GEN_WARNINGS_H
#define REFDYN_GEN_WARNINGS_H

#include "tree/tree.h"

void warnings_of_values(const struct model *model, const struct tree *tree, struct messages *messages);

#endif
