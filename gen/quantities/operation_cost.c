/*
 * What values cost: the operations of a call that computes them and nothing else, by which forms are chosen,
 * and the line that tells of a choice. Declared in quantities.h.
 */
#include "gen/quantities/quantities.h"

/* A division keeps its unit busy for four to five cycles, in which as many products or sums begin and more.
 */
enum { DIVISION_WEIGHT = 4 };

/* Of what the marked nodes are made of. */
static long weigh_marked(const struct derivation *d, bool *needed) {
    const struct graph *g = d->g;
    long operations = 0;
    rewrite_mark_operands(g, needed, g->count);
    for (expression e = 0; e < g->count; e++) {
        const enum cost cost = operation_cost(g->nodes[e].operation);
        if (needed[e] && (g->nodes[e].depends & ~ON_PARAMETER) != 0)
            operations += plan_trips_of(d->plan, e) *
                          (cost == COST_DIV ? DIVISION_WEIGHT : cost == COST_ADD || cost == COST_MUL);
    }
    return operations;
}

long operation_cost_of_values(const struct derivation *d, const expression *values, int count) {
    const struct memory_mark mark = memory_mark(d->memory);
    bool *needed = memory_scratch(d->memory, d->g->count * sizeof *needed);
    for (int i = 0; i < count; i++)
        needed[values[i]] = true;
    const long operations = weigh_marked(d, needed);
    memory_back(d->memory, mark);
    return operations;
}

long operation_cost_of_results(const struct derivation *d, const struct function *function) {
    const struct memory_mark mark = memory_mark(d->memory);
    bool *needed = memory_scratch(d->memory, d->g->count * sizeof *needed);
    plan_mark_results(function, needed);
    const long operations = weigh_marked(d, needed);
    memory_back(d->memory, mark);
    return operations;
}

void operation_cost_note_choice(struct derivation *d, const char *choice) {
    struct plan *plan = d->plan;
    if (d->is_second)
        return;
    plan->choices = plan->choices ? memory_format(plan->memory, "%s; %s", plan->choices, choice) : choice;
}
