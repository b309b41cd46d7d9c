/*
 * Finds the coordinates whose sines and cosines a function computes in one pass (emit_sincos.c): a contiguous
 * range.
 *
 * Input: the needed nodes of a function.
 */
#include "gen/plan/plan.h"

/* Coordinates whose sine or cosine a node is: first, first + stride, ... one for each element; count 0:
 * none. */
struct angles {
    int first, stride, count;
};

static struct angles angles_of(const struct plan *plan, expression e) {
    const struct node *node = &plan->g->nodes[e];
    const bool is_either = node->operation == OP_SIN || node->operation == OP_COS;
    const struct symbol *s = is_either ? expr_as_symbol(plan->g, node->operand[0]) : NULL;
    if (s && s->kind == SYMBOL_COORDINATE && s->order == 0)
        return (struct angles){s->index, 0, 1};
    if (!s || s->kind != SYMBOL_ELEMENT || s->order != 0)
        return (struct angles){0, 0, 0};
    const struct frame *frame = &plan->rolled->frames[s->index];
    return (struct angles){frame->coordinate, frame->step, plan->rolled->runs[frame->run].count};
}

static bool *mark_angles(const struct plan *plan, const struct function *function) {
    bool *is_angle = memory_get(plan->memory, ((size_t)plan->tree->count + 1) * sizeof *is_angle);
    for (expression e = 0; e < plan->g->count && function->is_needed; e++) {
        const struct angles angles = function->is_needed[e] ? angles_of(plan, e) : (struct angles){0, 0, 0};
        for (int i = 0; i < angles.count; i++)
            is_angle[angles.first + i * angles.stride] = true;
    }
    return is_angle;
}

struct angle_range angles_range(const struct plan *plan, const struct function *function) {
    const bool *is_angle = mark_angles(plan, function);
    struct angle_range range = {.is_angle = is_angle};
    int count = 0, last = -1;
    for (int i = 0; i < plan->tree->count; i++) {
        if (!is_angle[i])
            continue;
        if (!count++)
            range.first = i;
        last = i;
    }
    range.count = last - range.first + 1;
    range.is_dense = 3 * count >= 2 * range.count;
    return range;
}

void angles_find(const struct plan *plan, struct function *function) {
    const struct angle_range range = angles_range(plan, function);
    function->first_angle = range.first;
    if (range.count >= FEWEST_ANGLES &&
        range.is_dense) /* sliding coordinates in the range are computed without need */
        function->angle_count = range.count;
}

bool angles_is_plain(const struct plan *plan, expression e) {
    return angles_of(plan, e).count > 0;
}

static bool is_in_pass(const struct plan *plan, const struct function *function, expression e) {
    return function->angle_count && angles_is_plain(plan, e);
}

bool angles_is_repeated(const struct plan *plan, const struct function *function, expression e) {
    const struct node *node = &plan->g->nodes[e];
    const struct symbol *s = node->operation == OP_WHERE ? expr_as_symbol(plan->g, node->operand[0]) : NULL;
    return is_in_pass(plan, function, e) || (s && s->kind == SYMBOL_LAST);
}
