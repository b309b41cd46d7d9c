/*
 * Types of the fields of a model file (enum field_type): what each takes, and what is wrong with a value of
 * it.
 *
 * Takes a value and the rule of its field; complains, with the field's path. fields.c calls it for each
 * field.
 */
#ifndef REFDYN_GEN_FIELD_TYPES_H
#define REFDYN_GEN_FIELD_TYPES_H

#include "read/fields.h"

bool field_types_matches(const struct value *value, enum field_type type);
void field_types_check(const struct checker *checker, const struct value *value,
                       const struct field_rule *rule, const char *path);

#endif
