/*
 * Recursions over a rolled tree: one step for each frame; runs of equal elements become loops of the graph.
 *
 * In a run the step uses symbols for the values that the loop carries (theory, sect. 4.13). Trial finds the
 * parts of the state that no iteration changes, so that the frames of a run may come several times; such a
 * part keeps its value from before the loop, which often is zero.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <assert.h>
#include <string.h>

struct recursion recursion_over(struct memory *memory, struct graph *g, const struct tree *tree, void *state,
                                size_t size) {
    return (struct recursion){
        .memory = memory, .g = g, .tree = tree, .state = state, .width = (int)(size / sizeof(expression))};
}

static expression *state_of(const struct recursion *x, int frame) {
    return x->state + (size_t)frame * (size_t)x->width;
}

/* Writes the state at the beginning of an iteration, or after the loop. */
static void write_carry(const struct recursion *x, bool after, int frame) {
    for (int s = 0; s < x->width; s++) {
        const int slot = x->carry.slots[s];
        const struct slot *of = &x->g->slots[slot < 0 ? 0 : slot];
        state_of(x, frame)[s] = slot < 0 ? x->carry.initial[s] : after ? of->final : of->carried;
    }
}

/* Opens the loop of a run, from the state before it. */
static void open_loop(struct recursion *x, int before, bool inward) {
    const size_t size = ((size_t)x->width + 1) * sizeof(expression);
    x->carry.initial = memory_grow(x->memory, state_of(x, before), size - sizeof(expression), size);
    x->carry.slots = memory_get(x->memory, ((size_t)x->width + 1) * sizeof *x->carry.slots);
    for (int s = 0; s < x->width; s++)
        x->carry.slots[s] = -1;
    graph_open_loop(x->g, x->tree->frames[before].run, inward);
}

/* Reads the state after an iteration, at frame `end`. Closes the loop, unless a part that was assumed
 * constant has changed. */
static bool close_loop(struct recursion *x, int end) {
    bool changed = false;
    for (int s = 0; s < x->width; s++) {
        const expression next = state_of(x, end)[s];
        if (x->carry.slots[s] >= 0) {
            graph_set_next(x->g, x->carry.slots[s], next);
        } else if (next != x->carry.initial[s]) {
            x->carry.slots[s] = graph_new_slot(x->g, x->carry.initial[s]);
            changed = true;
        }
    }
    if (!changed)
        graph_close_loop(x->g);
    return !changed;
}

bool recursion_outward(struct recursion *x, int *i) {
    const struct frame *frames = x->tree->frames;
    if (*i >= 0 && frames[*i].kind == FRAME_ENTRY)
        open_loop(x, *i, false);
    ++*i;
    if (*i < x->tree->count && frames[*i].kind == FRAME_EXIT) {
        const int entry = frames[*i].partner;
        assert(frames[entry].kind == FRAME_ENTRY && *i > entry + 1);
        const bool ends = close_loop(x, *i - 1);
        write_carry(x, ends, ends ? *i : entry);
        *i = ends ? *i + 1 : entry + 1;
    }
    assert(*i == x->tree->count || frames[*i].parent < *i);
    return *i < x->tree->count;
}

static void start_inward_iteration(const struct recursion *x, int entry, int exit) {
    memset(state_of(x, entry), 0, (size_t)(exit - entry) * (size_t)x->width * sizeof(expression));
    write_carry(x, false, exit - 1);
}

bool recursion_inward(struct recursion *x, int *i) {
    const struct frame *frames = x->tree->frames;
    --*i;
    if (*i >= 0 && frames[*i].kind == FRAME_EXIT) {
        assert(frames[frames[*i].partner].kind == FRAME_ENTRY && *i > frames[*i].partner + 1);
        open_loop(x, *i, true);
        start_inward_iteration(x, frames[*i].partner, *i);
        --*i;
    } else if (*i >= 0 && frames[*i].kind == FRAME_ENTRY) {
        if (close_loop(x, *i)) {
            write_carry(x, true, *i);
        } else {
            start_inward_iteration(x, *i, frames[*i].partner);
            *i = frames[*i].partner - 1;
        }
    }
    return *i >= 0;
}

bool recursion_next_joint(struct graph *g, const struct tree *tree, int *i) {
    for (++*i; *i < tree->count && tree->frames[*i].kind != FRAME_JOINT; ++*i)
        if (tree->frames[*i].kind == FRAME_ENTRY)
            graph_open_loop(g, tree->frames[*i].run, false);
        else
            graph_close_loop(g);
    return *i < tree->count;
}

/* ---- Sums: a recursion along the list of frames ---- */

struct recursion recursion_sum(struct memory *memory, struct graph *g, const struct tree *tree) {
    expression *sums = memory_get(memory, ((size_t)tree->count + 1) * sizeof *sums);
    return recursion_over(memory, g, tree, sums, sizeof *sums);
}

bool recursion_next_term(struct recursion *x, int *i) {
    while (recursion_outward(x, i)) {
        x->state[*i] = *i ? x->state[*i - 1] : 0;
        if (x->tree->frames[*i].kind == FRAME_JOINT)
            return true;
    }
    return false;
}

void recursion_add_term(struct recursion *x, int i, expression term) {
    x->state[i] = expr_add(x->g, x->state[i], term);
}

expression recursion_total(const struct recursion *x) {
    return x->tree->count ? x->state[x->tree->count - 1] : 0;
}
