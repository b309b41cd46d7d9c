/*
 * The number that an expression in parameters has with their values in the model file and on the command
 * line. Takes the parameters, gives the number; declared in model.h.
 */
#include "gen/model/model.h"

static double parameter_value(void *context, const struct symbol *symbol) {
    const struct parameter *parameters = context;
    return symbol->kind == SYMBOL_PARAMETER ? parameters[symbol->index].value : 0;
}

double parameters_evaluate(struct graph *graph, const struct parameter *parameters, expression e) {
    struct parameter *context = (struct parameter *)(uintptr_t)parameters; /* only read */
    return rewrite_evaluate(graph, e, parameter_value, context);
}
