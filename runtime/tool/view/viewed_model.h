/*
 * The model of a run that is drawn: that of a file of HDF5 from the texts, options and parameters that the
 * file carries, that of a CSV from --model and --set.
 */
#ifndef REFDYN_TOOL_VIEWED_MODEL_H
#define REFDYN_TOOL_VIEWED_MODEL_H

#include "figures/recorded_motion.h"
#include "scene/scene.h"
#include "system/temporary_folder.h"

/* Parameters are numbers in its graph, with the values that the motion had. */
struct viewed_model {
    struct scene scene;    /* that is read and no more */
    struct scratch folder; /* of the files that the run carries */
    bool has_folder;
};

/* Reads the model of the run, whose columns have to be its coordinates. Complains on stderr;
 * viewed_model_release in any case. */
enum status viewed_model_read(struct viewed_model *viewed, const struct run *run,
                              const struct options *options);
void viewed_model_release(struct viewed_model *viewed);

#endif
