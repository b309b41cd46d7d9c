/* What the model needs of parameters: the quantity `required`, which the runtime asks before a motion. */
#ifndef REFDYN_GEN_REQUIRED_VALUES_H
#define REFDYN_GEN_REQUIRED_VALUES_H

#include "quantities/quantities.h"

/* Lists them in the plan; when all other functions are listed. */
void required_values_find(struct derivation *d);
bool required_values_exist(const struct derivation *d);
void required_values_build(struct derivation *d, struct function *f);

#endif
