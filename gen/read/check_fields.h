/*
 * What the checks of fields (check_fields.c) need of the table of fields (fields.c): the rule of each type,
 * and what a table has of an owner's fields.
 */
#ifndef REFDYN_GEN_CHECK_FIELDS_H
#define REFDYN_GEN_CHECK_FIELDS_H

#include "read/fields.h"

extern const struct type_rule {
    const char *text;
    unsigned takes;   /* a bit for each kind of value */
    enum owner owner; /* of a table of that type, OWNER_COUNT for none */
} type_rules[TYPE_COUNT];

bool is_empty_text(const struct value *value);
bool field_types_matches(const struct value *value, enum field_type type);
/* A table made by a function of the module that is not for this type. */
bool is_made_otherwise(const struct value *value, enum field_type type);
/* The field's value, whatever it is, or NULL. */
const struct value *given_field(const struct value *table, enum field field);
/* How many fields may stand without a name. */
int item_room(enum owner owner);
/* Names of the owner's fields. */
int owner_names(enum owner owner, const char **names);

#endif
