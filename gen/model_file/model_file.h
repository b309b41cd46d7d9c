/*
 * From the table that a model file returns to the model, and the checks of the model.
 */
#ifndef REFDYN_GEN_MODEL_FILE_H
#define REFDYN_GEN_MODEL_FILE_H

#include "gen/script/script.h"

/* Fills the model in the first of its two steps (model.h). After errors the model has harmless values for
 * what is missing, but must not be expanded. */
void read_scene(struct script *script, struct model *model);
/* The second step, for a model and a tree without errors. Reports unknown settings too. */
/* Also adds the frames of continuous states to the tree. */
void read_programme(struct script *script, struct tree *tree, struct model *model);

/* Checks that need no Lua: names, values at the parameters' defaults, references. */
void check_scene(const struct model *model, struct messages *messages);
void check_programme(const struct model *model, const struct tree *tree, struct messages *messages);

#endif
