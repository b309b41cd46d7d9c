/* Prints expressions as C in which every rounding occurs where the graph has it. */
#include "gen/emit/emit.h"
#include "gen/graph/graph.h"

#include <string.h>

const char *emit_lane_function(enum operation operation) {
    return operation == OP_LESS ? "less" : operation == OP_WHERE ? "where" : operation_text(operation);
}

enum { WIDTH = 104 }; /* a line is broken after an operator beyond this column */

static bool is_named(const struct emission *x, expression e) {
    return x->plan->is_statement[e] || x->plan->is_derived[e];
}

/* The operand of HOLD, which has the same value. */
static expression without_hold(const struct emission *x, expression e) {
    while (x->g->nodes[e].operation == OP_HOLD)
        e = x->g->nodes[e].operand[0];
    return e;
}

static void emit_operand(struct emission *x, struct text *text, expression e, enum binding at_least) {
    e = without_hold(x, e);
    const bool bare = is_named(x, e) || binding_of(&x->g->nodes[e]) >= at_least;
    text_add(text, bare ? "" : "(");
    emit_value(x, text, e);
    text_add(text, bare ? "" : ")");
}

static void break_long_line(struct text *text) {
    text_add(text, "%s", text_column(text) > WIDTH ? "\n        " : " ");
}

/* a + b + c is (a + b) + c: a right operand of equal binding needs its parentheses. */
static void emit_infix(struct emission *x, struct text *text, const struct node *node) {
    const enum binding own = binding_of(node);
    emit_operand(x, text, node->operand[0], own);
    text_add(text, " %s", operation_text(node->operation));
    break_long_line(text);
    emit_operand(x, text, node->operand[1], own + 1);
}

static const char *coordinate_array(struct emission *x, int order) {
    static const char *const arrays[] = {"q", "qd", "qdd"};
    bool *const uses[] = {&x->uses_q, &x->uses_qd, &x->uses_given[0]};
    *uses[order] = true;
    return arrays[order];
}

static const char *row_array(struct emission *x) {
    x->uses_given[1] = true;
    return "lambda";
}

/* q[4 + 3 * e]: the coordinate of the current element. */
static void emit_element(struct emission *x, struct text *text, const struct symbol *s) {
    const struct frame *frame = &x->plan->rolled->frames[s->index];
    text_add(text, "%s[", coordinate_array(x, s->order));
    emit_run_index(text, frame->coordinate, x->plan->rolled->runs[frame->run].period);
    text_add(text, "]");
}

/* In its loop, a slot is the loop's own variable; in a later loop, the value kept from it; in a later
 * piece, the value carried there. */
static void emit_slot(struct emission *x, struct text *text, expression e) {
    const struct symbol *s = expr_as_symbol(x->g, e);
    const bool is_kept =
        s->kind == SYMBOL_CARRIED && x->function->group_of[x->g->slots[s->index].loop] != x->group;
    bool *is_carried = is_kept ? &x->is_carried[e] : &x->is_slot_carried[s->index];
    if (x->slot_piece[s->index] != x->piece)
        *is_carried = true;
    if (x->slot_piece[s->index] != x->piece || (is_kept && *is_carried)) {
        x->uses_carried = true;
        text_add(text, "s->");
    }
    text_add(text, "%s%s", x->slot_names[s->index], is_kept ? "_at[e]" : "");
}

static void emit_symbol(struct emission *x, struct text *text, expression e) {
    const struct symbol *s = expr_as_symbol(x->g, e);
    switch (s->kind) {
    case SYMBOL_ELEMENT:
        emit_element(x, text, s);
        return;
    case SYMBOL_LAST:
        text_add(text, "e == %d", x->plan->rolled->runs[s->index].count - 1);
        return;
    case SYMBOL_CARRIED:
    case SYMBOL_FINAL:
        emit_slot(x, text, e);
        return;
    case SYMBOL_PARAMETER:
        x->uses_p = true;
        text_add(text, "p->%s", x->plan->model->parameters[s->index].name);
        return;
    case SYMBOL_INPUT:
        x->uses_x = true;
        text_add(text, "x->%s", x->plan->model->inputs[s->index].name);
        return;
    case SYMBOL_TIME:
        x->uses_t = true;
        text_add(text, x->is_lanes ? "t[0]" : "t");
        return;
    case SYMBOL_MULTIPLIER:
        text_add(text, "%s[%d]", row_array(x), s->index);
        return;
    default:
        text_add(text, "%s[%d]", coordinate_array(x, s->order), s->index);
    }
}

/* Returns whether its text is a plain number even in lanes, because it consists of numbers alone. */
static bool is_plain_number(const struct emission *x, expression e) {
    const struct node *node = &x->g->nodes[e];
    const int arity = operation_arity(node->operation);
    if (is_named(x, e) || (arity > 0 && binding_of(node) == BINDS_ATOM && node->operation != OP_HOLD))
        return false;
    for (int k = 0; k < arity; k++)
        if (!is_plain_number(x, node->operand[k]))
            return false;
    return arity > 0 || node->operation == OP_NUMBER;
}

/* C converts a number to a vector only as the operand of an operator. */
void emit_assigned(struct emission *x, struct text *text, expression e) {
    const bool is_wrapped = x->is_lanes && is_plain_number(x, e);
    text_add(text, is_wrapped ? "every_lane(" : "");
    emit_value(x, text, e);
    text_add(text, is_wrapped ? ")" : "");
}

const char *emit_zero(const struct emission *x) {
    return x->is_lanes ? "every_lane(0.0)" : "0.0";
}

/* An operator without a sign in C is a function at the beginning of the file. */
static void emit_lane_call(struct emission *x, struct text *text, const struct node *node) {
    x->uses_operation[node->operation] = true;
    text_add(text, "%s_lanes(", emit_lane_function(node->operation));
    for (int k = 0; k < operation_arity(node->operation); k++) {
        text_add(text, k ? ", " : "");
        emit_assigned(x, text, node->operand[k]);
    }
    text_add(text, ")");
}

static void emit_comparison(struct emission *x, struct text *text, const struct node *node) {
    emit_operand(x, text, node->operand[0], BINDS_SUM);
    text_add(text, " < ");
    emit_operand(x, text, node->operand[1], BINDS_SUM);
}

static bool is_last_element(const struct emission *x, expression e) {
    const struct symbol *s = expr_as_symbol(x->g, e);
    return s && s->kind == SYMBOL_LAST;
}

/* All lanes are at the same element. */
static void emit_choice(struct emission *x, struct text *text, const struct node *node) {
    const expression condition = node->operand[0];
    const struct node *compared = &x->g->nodes[condition];
    if (x->is_lanes && !is_last_element(x, condition)) {
        emit_lane_call(x, text, node);
        return;
    }
    text_add(text, "(");
    if (compared->operation == OP_LESS && !is_named(x, condition)) {
        emit_comparison(x, text, compared);
    } else if (is_last_element(x, condition)) {
        emit_value(x, text, condition);
    } else {
        emit_operand(x, text, condition, BINDS_SUM);
        text_add(text, " != 0.0");
    }
    text_add(text, " ? ");
    emit_assigned(x, text, node->operand[1]);
    text_add(text, " : ");
    emit_assigned(x, text, node->operand[2]);
    text_add(text, ")");
}

static void emit_spline(struct emission *x, struct text *text, const struct node *node) {
    if (x->is_lanes)
        x->uses_spline[node->operand[1] / SPLINE_ORDERS] = true;
    text_add(text, "%s_spline_%u(", x->name, node->operand[1] / SPLINE_ORDERS + 1);
    emit_assigned(x, text, node->operand[0]);
    text_add(text, ", %u)", node->operand[1] % SPLINE_ORDERS);
}

static void emit_call(struct emission *x, struct text *text, const struct node *node) {
    if (x->is_lanes) {
        emit_lane_call(x, text, node);
        return;
    }
    text_add(text, "%s(", operation_text(node->operation));
    for (int k = 0; k < operation_arity(node->operation); k++) {
        text_add(text, k ? ", " : "");
        emit_value(x, text, node->operand[k]);
    }
    text_add(text, ")");
}

void emit_definition(struct emission *x, struct text *text, expression e) {
    const struct node node = x->g->nodes[e];
    double value;
    char digits[32];
    switch (node.operation) {
    case OP_RATE_GAIN:
    case OP_POSITION_GAIN:
        emit_assigned(x, text, node.operand[0]);
        return;
    case OP_NUMBER:
        expr_is_number(x->g, e, &value);
        text_add(text, "%s", text_of_number(value, digits));
        return;
    case OP_SYMBOL:
        emit_symbol(x, text, e);
        return;
    case OP_ADD:
    case OP_SUB:
    case OP_MUL:
    case OP_DIV:
        emit_infix(x, text, &node);
        return;
    case OP_NEG:
        text_add(text, "-");
        emit_operand(x, text, node.operand[0], BINDS_PRODUCT);
        return;
    case OP_LESS:
        if (x->is_lanes) {
            emit_lane_call(x, text, &node);
            return;
        }
        text_add(text, "(");
        emit_comparison(x, text, &node);
        text_add(text, " ? 1.0 : 0.0)");
        return;
    case OP_WHERE:
        emit_choice(x, text, &node);
        return;
    case OP_SPLINE:
        emit_spline(x, text, &node);
        return;
    default:
        if (!emit_angle(x, text, e))
            emit_call(x, text, &node);
    }
}

void emit_name(struct emission *x, struct text *text, expression e) {
    if (x->value_names[e])
        text_add(text, "%s", x->value_names[e]);
    else
        text_add(text, "t%d", x->temporary[e]);
}

void emit_value(struct emission *x, struct text *text, expression e) {
    e = without_hold(x, e);
    if (x->plan->is_derived[e]) {
        x->uses_p = true;
        text_add(text, "p->derived.%s", x->value_names[e]);
    } else if (!x->plan->is_statement[e]) {
        emit_definition(x, text, e);
    } else {
        if (x->piece_of[e] != x->piece)
            x->is_carried[e] = true;
        if (x->piece_of[e] != x->piece || (x->is_carried[e] && x->function->is_stored[e])) {
            x->uses_carried = true;
            text_add(text, "s->");
        } else {
            x->is_read[e] = true;
        }
        emit_name(x, text, e);
        text_add(text, "%s", x->function->is_stored[e] ? "[e]" : "");
    }
}

/* ---- Splines ---- */

/* For each spline a table of pieces and a function, with the same search and polynomial as graph.c. */

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
