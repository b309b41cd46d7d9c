/*
 * Rows that have no slope where they are zero: squares, absolute values and their sums. Such a row holds
 * nothing, since its force acts along its gradient. See reader.h.
 */
#include "gen/read/reader.h"

/* The base of e if e is a power, otherwise e, without sign and constant factors; `power` is the exponent. */
static expression base_of_power(const struct graph *g, expression e, int *power) {
    const struct node *node = &g->nodes[e];
    const bool is_product = node->operation == OP_MUL;
    *power = 1;
    if (node->operation == OP_NEG || (is_product && expr_is_number(g, node->operand[1], NULL)))
        return base_of_power(g, node->operand[0], power);
    if (is_product && expr_is_number(g, node->operand[0], NULL))
        return base_of_power(g, node->operand[1], power);
    if (!is_product)
        return e;
    int powers[2];
    const expression left = base_of_power(g, node->operand[0], &powers[0]),
                     right = base_of_power(g, node->operand[1], &powers[1]);
    if (left != right)
        return e;
    *power = powers[0] + powers[1];
    return left;
}

static void check_slope(const struct reader *reader, const struct row *row, struct bounds bounds) {
    struct messages *messages = reader->check.messages;
    int power;
    base_of_power(reader->check.graph, row->residual, &power);
    if (bounds.least > 0 || bounds.most < 0)
        message_warning(messages, row->place,
                        "%s: its residual is %s %.6g, nowhere 0; subtract what it is to be", row->path,
                        bounds.least > 0 ? "at least" : "at most",
                        bounds.least > 0 ? bounds.least : bounds.most);
    else if (power > 1)
        message_warning(messages, row->place,
                        "%s: its residual is a power, without slope where it is 0, so that it holds nothing; "
                        "write its base",
                        row->path);
    else if ((bounds.least == 0) != (bounds.most == 0))
        message_warning(
            messages, row->place,
            "%s: its residual is nowhere %s 0, without slope where it is 0, so that it holds nothing; "
            "write a row for each term, without squares, abs or less",
            row->path, bounds.least == 0 ? "below" : "above");
}

void read_check_slopes(const struct reader *reader) {
    const struct model *model = reader->model;
    const struct memory_mark mark = memory_mark(reader->check.memory);
    const struct bounds *bounds =
        bounds_of_values(reader->check.graph, reader->check.declarations->parameters);
    for (int i = 0; i < model->row_count; i++)
        if (!model->rows[i].is_closure && !model->rows[i].rests && model->rows[i].level != ROW_ACCELERATION &&
            reader->check.graph->nodes[model->rows[i].residual].depends & (ON_STATE | ON_RATE))
            check_slope(reader, &model->rows[i], bounds[model->rows[i].residual]);
    memory_back(reader->check.memory, mark);
}
