/*
 * Expressions as text, for people who change the generator: in messages of checks, and in `refdyn gen
 * --explain`.
 *
 * A value is called by its name and its handle, "w_x#412", or by its handle alone, "#412"; numbers and
 * symbols are shown as what they are: p[2] a parameter, x[0] an input, q[3], qd[3], qdd[3] a coordinate,
 * e.q[7] that of frame 7 in the element that a loop is at, carried[5] and final[5] what slot 5 holds when an
 * iteration begins and behind the loop.
 */
#ifndef REFDYN_GEN_DESCRIBE_H
#define REFDYN_GEN_DESCRIBE_H

#include "graph/graph.h"
#include "base/text.h"

/* The name of an operation in ops.def. */
const char *operation_name(enum operation operation);
/* What stands for e where it is read: marked nodes by name and handle, what is not marked is spelled out.
 * `is_marked` by handle; NULL: all are. */
void describe_value(struct text *text, const struct graph *g, expression e, const bool *is_marked);
/* The operation of e over its operands. */
void describe_definition(struct text *text, const struct graph *g, expression e, const bool *is_marked);

#endif
