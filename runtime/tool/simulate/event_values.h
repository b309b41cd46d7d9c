/* Parameters that an event is about to set: may the model's numbers have such values? */
#ifndef REFDYN_TOOL_EVENT_VALUES_H
#define REFDYN_TOOL_EVENT_VALUES_H

#include "scene/scene.h"

/* Of the events at which the integration stands, before they happen: what the first value does that the model
 * refuses, as "the event NAME: FILE:LINE: what is wrong"; NULL: none. */
const char *event_values_fault(struct scene *scene, const struct refdyn_integrator *integrator);

#endif
