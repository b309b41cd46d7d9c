/*
 * Types of the fields of a model file (enum field_type): what each takes, and what is wrong with a value of
 * it.
 *
 * Takes a value and the rule of its field; complains, with the field's path. fields.c calls it for each
 * field.
 */
#ifndef REFDYN_GEN_FIELD_TYPES_H
#define REFDYN_GEN_FIELD_TYPES_H

#include "fields.h"

bool has_type(const struct value *value, enum field_type type);
void check_field(const struct checker *checker, const struct value *value, const struct field_rule *rule,
                 const char *path);

#endif
