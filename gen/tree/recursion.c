/* Recursions over a rolled tree: see recursion.h. */
#include "tree/recursion.h"
#include "base/memory.h"

#include <assert.h>
#include <string.h>

/* What one loop carries. */
struct carry {
    struct graph *g;
    int width;
    expression *initial;
    int *slots; /* -1: no iteration changes it */
};

static struct carry start_carry(const struct recursion *x, const expression *initial) {
    const size_t size = ((size_t)x->width + 1) * sizeof(expression);
    struct carry carry = {.g = x->g, .width = x->width};
    carry.initial = memory_grow(x->memory, initial, size - sizeof(expression), size);
    carry.slots = memory_get(x->memory, ((size_t)x->width + 1) * sizeof *carry.slots);
    for (int s = 0; s < x->width; s++)
        carry.slots[s] = -1;
    return carry;
}

/* The state when an iteration begins, or behind the loop. */
static void write_carry(const struct carry *carry, bool behind, expression *state) {
    for (int s = 0; s < carry->width; s++) {
        const struct slot *slot = &carry->g->slots[carry->slots[s] < 0 ? 0 : carry->slots[s]];
        state[s] = carry->slots[s] < 0 ? carry->initial[s] : behind ? slot->final : slot->carried;
    }
}

/* Takes the state after an iteration; true when a part that was held for constant has changed. */
static bool take_carry(struct carry *carry, const expression *state) {
    bool changed = false;
    for (int s = 0; s < carry->width; s++) {
        if (carry->slots[s] >= 0) {
            graph_set_next(carry->g, carry->slots[s], state[s]);
        } else if (state[s] != carry->initial[s]) {
            carry->slots[s] = graph_new_slot(carry->g, carry->initial[s]);
            changed = true;
        }
    }
    return changed;
}

static expression *state_of(const struct recursion *x, int frame) {
    return (expression *)x->state + (size_t)frame * (size_t)x->width;
}

static void loop_outward(const struct recursion *x, int entry) {
    const int exit = x->tree->frames[entry].partner;
    assert(x->tree->frames[exit].kind == FRAME_EXIT && exit > entry + 1);
    struct carry carry = start_carry(x, state_of(x, entry));
    graph_open_loop(x->g, x->tree->frames[entry].run, false);
    do {
        write_carry(&carry, false, state_of(x, entry));
        for (int i = entry + 1; i < exit; i++)
            x->step(x->context, i);
    } while (take_carry(&carry, state_of(x, exit - 1)));
    graph_close_loop(x->g);
    write_carry(&carry, true, state_of(x, exit));
}

void recursion_outward(const struct recursion *x) {
    for (int i = 0; i < x->tree->count; i++) {
        assert(x->tree->frames[i].parent < i);
        x->step(x->context, i);
        if (x->tree->frames[i].kind != FRAME_ENTRY)
            continue;
        loop_outward(x, i);
        i = x->tree->frames[i].partner;
    }
}

static void loop_inward(const struct recursion *x, int exit) {
    const int entry = x->tree->frames[exit].partner;
    assert(x->tree->frames[entry].kind == FRAME_ENTRY && exit > entry + 1);
    struct carry carry = start_carry(x, state_of(x, exit));
    graph_open_loop(x->g, x->tree->frames[exit].run, true);
    do {
        memset(state_of(x, entry), 0, (size_t)(exit - entry) * (size_t)x->width * sizeof(expression));
        write_carry(&carry, false, state_of(x, exit - 1));
        for (int i = exit - 1; i > entry; i--)
            x->step(x->context, i);
    } while (take_carry(&carry, state_of(x, entry)));
    graph_close_loop(x->g);
    write_carry(&carry, true, state_of(x, entry));
}

void recursion_inward(const struct recursion *x) {
    for (int i = x->tree->count - 1; i >= 0; i--) {
        if (x->tree->frames[i].kind == FRAME_EXIT) {
            loop_inward(x, i);
            i = x->tree->frames[i].partner;
        }
        x->step(x->context, i);
    }
}

void recursion_visit_joints(struct graph *g, const struct tree *tree, void (*visit)(void *context, int i),
                            void *context) {
    for (int i = 0; i < tree->count; i++) {
        const struct frame *frame = &tree->frames[i];
        if (frame->kind == FRAME_ENTRY)
            graph_open_loop(g, frame->run, false);
        else if (frame->kind == FRAME_EXIT)
            graph_close_loop(g);
        else
            visit(context, i);
    }
}

/* ---- Sums: a recursion along the list of frames ---- */

struct sum {
    struct graph *g;
    const struct tree *tree;
    expression (*term)(void *context, int i);
    void *context;
};

static expression sum_of_element(const struct sum *sum, int entry, expression total) {
    for (int i = entry + 1; sum->tree->frames[i].kind == FRAME_JOINT; i++)
        total = expr_add(sum->g, total, sum->term(sum->context, i));
    return total;
}

static expression sum_of_run(const struct sum *sum, int entry, expression total) {
    struct graph *g = sum->g;
    graph_open_loop(g, sum->tree->frames[entry].run, false);
    if (sum_of_element(sum, entry, expr_zero(g))) {
        const int slot = graph_new_slot(g, total);
        graph_set_next(g, slot, sum_of_element(sum, entry, g->slots[slot].carried));
        graph_close_loop(g);
        return g->slots[slot].final;
    }
    graph_close_loop(g);
    return total;
}

expression recursion_sum_over_joints(struct graph *g, const struct tree *tree,
                                     expression (*term)(void *context, int i), void *context) {
    const struct sum sum = {g, tree, term, context};
    expression total = 0;
    for (int i = 0; i < tree->count; i++) {
        const struct frame *frame = &tree->frames[i];
        if (frame->kind == FRAME_JOINT) {
            total = expr_add(g, total, term(context, i));
        } else if (frame->kind == FRAME_ENTRY) {
            total = sum_of_run(&sum, i, total);
            i = frame->partner;
        }
    }
    return total;
}
