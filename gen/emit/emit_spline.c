/*
 * The C text of splines: for each a table of pieces and a function, with the same search and polynomial as
 * spline.c.
 */
#include "gen/emit/emit.h"
#include "gen/graph/graph.h"

static void emit_table(struct emission *x, struct text *text, const struct spline *spline, int index) {
    char digits[32];
    text_add(
        text,
        "/* Pieces of spline %d: knot, c0, c1, c2, c3; y = c0 + h (c1 + h (c2 + h c3)), h = x - knot. */\n",
        index + 1);
    text_add(text, "static const double %s_pieces_%d[%d][%d] = {\n", x->name, index + 1, spline->count,
             PIECE_COLUMNS);
    for (int i = 0; i < spline->count; i++) {
        text_add(text, "    {");
        for (int c = 0; c < PIECE_COLUMNS; c++)
            text_add(text, "%s%s", c ? ", " : "",
                     text_of_number(spline->pieces[PIECE_COLUMNS * i + c], digits));
        text_add(text, "},\n");
    }
    text_add(text, "};\n\n");
}

static void emit_search(struct emission *x, struct text *text, const struct spline *spline, int index) {
    text_add(text, "double %s_spline_%d(double at, int order) {\n", x->name, index + 1);
    text_add(text, "    int low = 0, high = %d;\n    while (high - low > 1) {\n", spline->count);
    text_add(text, "        const int middle = (low + high) / 2;\n");
    text_add(text, "        if (%s_pieces_%d[middle][0] <= at)\n            low = middle;\n", x->name,
             index + 1);
    text_add(text, "        else\n            high = middle;\n    }\n");
    text_add(text, "    const double *c = %s_pieces_%d[low] + 1, h = at - c[-1];\n", x->name, index + 1);
    text_add(text, "    if (order == 0)\n        return c[0] + h * (c[1] + h * (c[2] + h * c[3]));\n");
    text_add(text, "    if (order == 1)\n        return c[1] + h * (2.0 * c[2] + h * (3.0 * c[3]));\n");
    text_add(text, "    return order == 2 ? 2.0 * c[2] + h * (6.0 * c[3]) : 6.0 * c[3];\n}\n\n");
}

/* Splines that some function uses. */
static bool *used_splines(struct emission *x) {
    struct plan *plan = x->plan;
    const bool *needed = plan_mark_nodes_of_functions(plan);
    bool *used = memory_get(plan->memory, ((size_t)x->g->spline_count + 1) * sizeof *used);
    for (expression e = 0; e < x->g->count; e++)
        if (needed[e] && x->g->nodes[e].operation == OP_SPLINE)
            used[x->g->nodes[e].operand[1] / SPLINE_ORDERS] = true;
    return used;
}

void emit_spline_functions(struct emission *x, struct text *text) {
    const bool *used = used_splines(x);
    for (uint32_t i = 0; i < x->g->spline_count; i++) {
        if (!used[i])
            continue;
        emit_table(x, text, &x->g->splines[i], (int)i);
        emit_search(x, text, &x->g->splines[i], (int)i);
    }
}

void emit_spline_prototypes(struct emission *x, struct text *text) {
    const bool *used = used_splines(x);
    for (uint32_t i = 0; i < x->g->spline_count; i++)
        if (used[i])
            text_add(text,
                     "/* Spline %u of the model, or its derivative of the given order, 0 to 3. */\n"
                     "double %s_spline_%u(double at, int order);\n\n",
                     i + 1, x->name, i + 1);
}
