/*
 * The interpreter of the plan: computes what an emitted function would, node by node, with the doubles of the
 * host. Declared in gen.h. It shares the graph with the printer and nothing else, so that it can judge the C.
 */
#include "plan.h"

#include <string.h>

struct arguments {
    const struct plan *plan;
    const double *p, *x, *q, *qd;
    double t;
};

static double parameter_value(const struct arguments *a, int index) {
    for (int i = 0; i < a->plan->parameter_count; i++)
        if (a->plan->parameters[i] == index)
            return a->p[i];
    return 0;
}

static double symbol_value(const struct arguments *a, const struct symbol *s) {
    switch (s->kind) {
    case SYMBOL_PARAMETER:
        return parameter_value(a, s->index);
    case SYMBOL_INPUT:
        return a->x[s->index];
    case SYMBOL_TIME:
        return a->t;
    default:
        return s->order ? a->qd[s->index] : a->q[s->index];
    }
}

static const struct function *find_function(const struct plan *plan, const char *quantity) {
    for (int f = 0; f < plan->function_count; f++)
        if (!strcmp(plan->functions[f].quantity, quantity))
            return &plan->functions[f];
    return NULL;
}

/* Values of all fields, before and behind the loops. */
static const double *field_values(const struct plan *plan, const struct function *function,
                                  const struct arguments *arguments) {
    const struct graph *g = plan->g;
    const int count = function->out_count + function->local_out_count;
    bool *needed = memory_get(plan->memory, g->count * sizeof *needed);
    double *values = memory_get(plan->memory, g->count * sizeof *values);
    double *fields = memory_get(plan->memory, ((size_t)count + 1) * sizeof *fields);
    for (int i = 0; i < count; i++)
        needed[function->out[i]] = true;
    mark_operands(g, needed, g->count);
    for (expression e = 0; e < g->count; e++)
        if (needed[e])
            values[e] = as_symbol(g, e) ? symbol_value(arguments, as_symbol(g, e)) : node_value(g, e, values);
    for (int i = 0; i < count; i++)
        fields[i] = values[function->out[i]];
    for (int i = 0; i < function->loop_count; i++)
        run_loop(function, &function->loops[i], fields);
    return fields;
}

int gen_interpret(const struct generation *generation, const char *quantity, const double *p, const double *x,
                  double t, const double *q, const double *qd, double *out) {
    struct plan *plan = generation->plan;
    const struct function *function = find_function(plan, quantity);
    const struct arguments arguments = {plan, p, x, q, qd, t};
    if (!function)
        return 1;
    memcpy(out, field_values(plan, function, &arguments), (size_t)function->out_count * sizeof *out);
    return 0;
}
