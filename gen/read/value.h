/*
 * A Lua value in plain C: what script_value.c makes of the table that a model file returns, so that nothing
 * after it knows Lua. Named entries are sorted by name, list items stand in order; each knows its file and
 * line.
 */
#ifndef REFDYN_GEN_VALUE_H
#define REFDYN_GEN_VALUE_H

#include "graph/graph.h"
#include "base/message.h"

enum value_kind {
    VALUE_NOTHING,
    VALUE_NUMBER,
    VALUE_TEXT,
    VALUE_BOOLEAN,
    VALUE_EXPRESSION,
    VALUE_FUNCTION,
    VALUE_CURVE, /* what rd.spline makes: a function of an expression */
    VALUE_TABLE,
    VALUE_GROUP /* parameters, or a part of the state: something with named values */
};

struct named_value;

struct value {
    enum value_kind kind;
    struct place place;
    double number;
    bool is_whole, truth;
    const char *text;
    expression expression;
    int function;    /* handle of script_call */
    int curve;       /* number of the graph's spline */
    const char *tag; /* "model", "position" ... of a table that a function of the module has made, or NULL */
    struct value *items;
    int item_count;
    struct named_value *fields;
    int field_count;
};

struct named_value {
    const char *name;
    struct value value;
};

/* "a number", "a table" ...: for messages. */
const char *value_kind_text(enum value_kind kind);
/* The entry of that name, or NULL. */
const struct value *value_find_field(const struct value *table, const char *name);
/* Number or expression as an expression; false for anything else. */
bool value_expression(struct graph *graph, const struct value *value, expression *result);

#endif
