/* The model's rules for parameters: the quantity `required`, which the runtime evaluates before a motion. */
#ifndef REFDYN_GEN_REQUIRED_VALUES_H
#define REFDYN_GEN_REQUIRED_VALUES_H

#include "quantities/quantities.h"

/* Lists the rules in the plan; to be called when all other functions are listed. */
void required_values_find(struct derivation *d);
bool required_values_exist(const struct derivation *d);
void required_values_build(struct derivation *d, struct function *f);

#endif
