/* Look-ups in values of a model file: see reader.h. */
#include "gen/read/reader.h"

#include <string.h>

const char *value_kind_text(enum value_kind kind) {
    static const char *const texts[] = {"nothing",       "a number",      "a text",
                                        "true or false", "an expression", "a function",
                                        "a curve",       "a table",       "a group of values"};
    _Static_assert(sizeof texts / sizeof *texts == VALUE_GROUP + 1, "each kind has a text");
    return texts[kind];
}

const struct value *value_find_field(const struct value *table, const char *name) {
    for (int i = 0; i < table->field_count; i++)
        if (strcmp(table->fields[i].name, name) == 0)
            return &table->fields[i].value;
    return NULL;
}

bool value_expression(struct graph *graph, const struct value *value, expression *result) {
    if (value->kind == VALUE_NUMBER)
        *result = expr_number(graph, value->number);
    else if (value->kind == VALUE_EXPRESSION)
        *result = value->expression;
    else
        return false;
    return true;
}
