/*
 * What several commands say of a scene in JSON: takes the scene, writes entries of a document.
 */
#ifndef REFDYN_TOOL_SCENE_JSON_H
#define REFDYN_TOOL_SCENE_JSON_H

#include "text/output.h"
#include "scene/scene.h"

/* Names of the coordinates that are non-zero in `which` (n); NULL: of all. */
void put_coordinates(struct document *document, const char *key, const struct refdyn_model *model,
                     const int *which);
/* "points": where each one is. */
void put_positions(struct document *document, const struct scene *scene);

#endif
