/* May a model be used, and a workspace; units of its coordinates. */
#ifndef REFDYN_MODEL_CHECK_H
#define REFDYN_MODEL_CHECK_H

#include "refdyn.h"

/* Is it there, and of this version? Another one's fields may be read no further than interface_version. */
static inline int refdyn_model_is_readable(const struct refdyn_model *model) {
    return model && model->interface_version == REFDYN_MODEL_VERSION;
}

/* Errors: BAD_MODEL, OTHER_VERSION. */
int refdyn_model_status(const struct refdyn_model *model);
/* The same of a workspace's model; BAD_MEMORY when its arrays are not laid out. */
int refdyn_workspace_status(const struct refdyn_workspace *work);

/* Number of doubles in the result of `required`. */
int refdyn_required_count(const struct refdyn_model *model);

/* Place in p of the parameter that says whether the contact of event i rests. */
static inline int refdyn_contact_mode_place(const struct refdyn_model *model, int i) {
    return model->changes[model->events[i].first_change].place;
}
/* Change of coordinate j that counts as much as 1 rad: `length` for a translation, 0: that of the model; 1
 * for a rotation. */
double refdyn_coordinate_unit(const struct refdyn_model *model, int j, double length);

#endif
