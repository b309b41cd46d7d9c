/* A separate graph for unit tests of expressions, with coordinates as variables, and their values. */
#ifndef REFDYN_TESTS_UNIT_EXPRESSIONS_H
#define REFDYN_TESTS_UNIT_EXPRESSIONS_H

#include "gen/graph/graph.h"
#include "gen/base/base.h"

#include <stdio.h>
#include <stdlib.h>

static inline _Noreturn void no_memory(void *context) {
    (void)context;
    puts("out of memory");
    exit(EXIT_FAILURE);
}

struct expressions {
    struct memory memory;
    struct graph graph;
};

static inline struct graph *expressions_start(struct expressions *x) {
    *x = (struct expressions){.memory = {.allowance = -1, .fail = no_memory}};
    graph_start(&x->graph, &x->memory);
    return &x->graph;
}

static inline void expressions_release(struct expressions *x) {
    memory_release(&x->memory);
}

static inline expression variable(struct graph *g, int index) {
    return expr_symbol(g, SYMBOL_COORDINATE, index, 0);
}

/* `context`: values by coordinate */
static inline double variable_value(void *context, const struct symbol *s) {
    return ((const double *)context)[s->index];
}

static inline double value_at(struct graph *g, expression e, const double *values) {
    double copy[8];
    for (int i = 0; i < 8; i++)
        copy[i] = values[i];
    return rewrite_evaluate(g, e, variable_value, copy);
}

#endif
