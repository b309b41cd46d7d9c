/* Kinks of formulas in coordinates and rates: see read.h. */
#include "gen/read/read.h"
#include "gen/base/base.h"

enum { MOST_KINKS = 100 }; /* beyond, looking for them costs more than small steps */

static void mark_formulas(const struct model *model, bool *marks) {
    for (int i = 0; i < model->force_count; i++)
        marks[model->forces[i].value] = true;
    for (int i = 0; i < model->load_count; i++)
        for (int a = 0; a < 3; a++)
            marks[model->loads[i].value[a]] = true;
    for (int i = 0; i < model->potential_count; i++)
        marks[model->potentials[i].energy] = true;
    for (int i = 0; i < model->row_count; i++)
        marks[model->rows[i].residual] = true;
}

/* What changes sign at the node, 0: it is smooth, or of time, parameters and inputs alone. */
static expression switching_function(struct graph *g, expression e) {
    const struct node node = g->nodes[e];
    expression s = 0;
    if (node.operation == OP_ABS)
        s = node.operand[0];
    else if (node.operation == OP_LESS || node.operation == OP_MIN || node.operation == OP_MAX)
        s = expr_sub(g, node.operand[0], node.operand[1]);
    const unsigned depends = s ? g->nodes[s].depends : 0;
    return depends & (ON_STATE | ON_RATE) ? s : 0;
}

/* Once, also with the other sign. */
static void list_once(struct model *model, expression s) {
    for (int i = 0; i < model->kink_count; i++)
        if (model->kinks[i] == s || model->kinks[i] == expr_neg(model->graph, s))
            return;
    if (model->kink_count < MOST_KINKS)
        model->kinks[model->kink_count++] = s;
}

void state_kinks_list(struct memory *memory, struct model *model) {
    struct graph *g = model->graph;
    const uint32_t count = g->count; /* what is built here is looked at no more */
    bool *inside = memory_get(memory, count * sizeof *inside);
    model->kinks = memory_get(memory, MOST_KINKS * sizeof *model->kinks);
    mark_formulas(model, inside);
    rewrite_mark_operands(g, inside, count);
    for (expression e = 0; e < count; e++) {
        const expression s = inside[e] ? switching_function(g, e) : 0;
        if (s)
            list_once(model, s);
    }
}
