/*
 * Local arrays and loops over pairs of coordinates of one function (plan.h), from vectors of coordinates.
 *
 * Input: vectors by frame. Output: arrays by position, an order in which all coordinates beyond a joint
 * follow it. Arrays of the result come first; local arrays follow the last of them.
 */
#include "gen/quantities/quantities.h"
#include "gen/base/base.h"

#include <string.h>

/* By frame: its child beyond which most coordinates are, the last one of several. */
static const int *longest_branches(const struct pair_arrays *p, const int *beyond) {
    const struct tree *tree = p->plan->tree;
    int *longest = memory_get(p->memory, ((size_t)tree->count + 1) * sizeof *longest);
    for (int i = 0; i < tree->count; i++) {
        const int parent = tree->frames[i].parent;
        if (parent >= 0 && (!longest[parent] || beyond[i] >= beyond[longest[parent]]))
            longest[parent] = i;
    }
    return longest;
}

/* Numbers the positions in depth-first order, children in the order of their numbers. `longest_last`: the
 * longest branch of each frame follows the others. */
static void order_coordinates(struct pair_arrays *p, bool longest_last) {
    const struct tree *tree = p->plan->tree;
    const int n = tree->count;
    int *beyond = memory_get(
        p->memory, ((size_t)n + 1) * sizeof *beyond); /* number of coordinates beyond each, itself included */
    int *next =
        memory_get(p->memory, ((size_t)n + 1) * sizeof *next); /* position at which its next child begins */
    for (int i = n - 1; i >= 0; i--)
        beyond[tree->frames[i].parent < 0 ? n : tree->frames[i].parent] += beyond[i] += 1;
    const int *longest = longest_last ? longest_branches(p, beyond) : NULL;
    for (int i = 0; i < n; i++) {
        const int parent = tree->frames[i].parent;
        int *from = &next[parent < 0 ? n : parent];
        if (longest && parent >= 0 && longest[parent] == i) {
            p->position[i] = p->end[p->position[parent]] - beyond[i];
        } else {
            p->position[i] = *from;
            *from += beyond[i];
        }
        next[i] = p->position[i] + 1;
        p->order[p->position[i]] = i;
        p->end[p->position[i]] = p->position[i] + beyond[i];
    }
}

/* All elements of a run are alike. */
static void mark_joints(struct pair_arrays *p, const struct vector *shifts) {
    const struct tree *tree = p->k->tree;
    for (int i = 0; i < tree->count; i++) {
        const struct frame *frame = &tree->frames[i];
        const int count = frame->kind != FRAME_JOINT ? 0 : frame->run < 0 ? 1 : tree->runs[frame->run].count;
        for (int e = 0; e < count; e++) {
            const int at = p->position[frame->coordinate + e * frame->step];
            p->is_revolute[at] = frame->joint.is_revolute;
            p->moves_on[at] = shifts && frame->parent >= 0 && !vector_is_zero(shifts[i]);
        }
    }
}

static struct pair_arrays open_arrays(struct plan *plan, const struct kinematics *k,
                                      struct function *function, const struct vector *shifts,
                                      bool longest_last) {
    const size_t n = (size_t)plan->tree->count + 1;
    struct pair_arrays p = {.memory = k->memory, .plan = plan, .function = function, .k = k};
    p.order = memory_get(k->memory, n * sizeof *p.order);
    p.position = memory_get(k->memory, n * sizeof *p.position);
    p.end = memory_get(k->memory, n * sizeof *p.end);
    p.is_revolute = memory_get(k->memory, n * sizeof *p.is_revolute);
    p.moves_on = memory_get(k->memory, n * sizeof *p.moves_on);
    order_coordinates(&p, longest_last);
    mark_joints(&p, shifts);
    return p;
}

struct pair_arrays pair_loops_open(struct plan *plan, const struct kinematics *k, struct function *function,
                                   const struct vector *shifts) {
    return open_arrays(plan, k, function, shifts, false);
}

struct pair_arrays pair_loops_open_sweeps(struct plan *plan, const struct kinematics *k,
                                          struct function *function, const struct vector *shifts) {
    return open_arrays(plan, k, function, shifts, true);
}

struct pair_arrays pair_loops_open_results(struct plan *plan, const struct kinematics *k,
                                           struct function *function) {
    const int n = plan->tree->count;
    struct pair_arrays p = {
        .memory = k->memory, .plan = plan, .function = function, .k = k, .is_result = true};
    p.position = memory_get(k->memory, ((size_t)n + 1) * sizeof *p.position);
    for (int i = 0; i < n; i++)
        p.position[i] = i;
    return p;
}

static bool has_local(const struct function *function, const char *name) {
    for (int f = function->array_count; f < plan_count_arrays(function); f++)
        if (!strcmp(function->arrays[f].name, name))
            return true;
    return false;
}

int pair_loops_add_local(struct memory *memory, struct function *function, const char *name, int count,
                         int columns) {
    const char *unique = name;
    for (int copy = 2; has_local(function, unique); copy++)
        unique = memory_format(memory, "%s_%d", name, copy);
    return plan_open_local(memory, function, unique, count, columns);
}

static int add_axis(struct pair_arrays *p, const char *name, const struct vector *by_frame, int axis) {
    const struct tree *tree = p->k->tree;
    const char *axis_name = memory_format(p->memory, "%s_%c", name, "xyz"[axis]);
    const int n = p->plan->tree->count;
    const int array = p->is_result ? plan_open_result(p->memory, p->function, axis_name,
                                                      "(n) by coordinate, ground axes", n, 0)
                                   : pair_loops_add_local(p->memory, p->function, axis_name, n, 0);
    for (int i = 0; i < tree->count; i++)
        if (tree->frames[i].kind == FRAME_JOINT)
            plan_set_frame(p->memory, tree, p->function, array, p->position[tree->frames[i].coordinate],
                           tree->frames[i].step, i, by_frame[i].at[axis]);
    return array;
}

static bool is_zero_axis(const struct pair_arrays *p, const struct vector *by_frame, int axis) {
    for (int i = 0; i < p->k->tree->count; i++)
        if (p->k->tree->frames[i].kind == FRAME_JOINT && by_frame[i].at[axis])
            return false;
    return true;
}

struct vector_arrays pair_loops_add_arrays(struct pair_arrays *p, const char *name,
                                           const struct vector *by_frame) {
    struct vector_arrays arrays;
    for (int axis = 0; axis < 3; axis++)
        arrays.at[axis] = is_zero_axis(p, by_frame, axis) ? NOTHING : add_axis(p, name, by_frame, axis);
    return arrays;
}

static bool meet(const struct pair_move *move, int shift, int force) {
    return move->shift.at[shift] != NOTHING && move->force.at[force] != NOTHING;
}

void pair_loops_add_moved(struct pair_arrays *p, const char *name, const struct vector *by_frame,
                          struct pair_move *move) {
    for (int axis = 0; axis < 3; axis++) {
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        const bool stays_zero = is_zero_axis(p, by_frame, axis) && !meet(move, b, c) && !meet(move, c, b);
        move->moment.at[axis] = stays_zero ? NOTHING : add_axis(p, name, by_frame, axis);
    }
}

struct loop *pair_loops_add_loop(struct memory *memory, struct function *function, enum loop_kind kind,
                                 const char *about) {
    function->loops = memory_room(memory, function->loops, function->loop_count, &function->loop_capacity,
                                  sizeof *function->loops);
    struct loop *loop = &function->loops[function->loop_count++];
    *loop = (struct loop){.kind = kind, .about = about};
    return loop;
}

struct pairs *pair_loops_add_pairs(struct pair_arrays *p, const char *about) {
    struct pairs *pairs = &pair_loops_add_loop(p->memory, p->function, LOOP_PAIRS, about)->of.pairs;
    *pairs = (struct pairs){.order = p->order,
                            .end = p->end,
                            .is_revolute = p->is_revolute,
                            .moves_on = p->moves_on,
                            .n = p->plan->tree->count};
    return pairs;
}

void pair_loops_add_term(struct pair_terms *terms, double factor, struct vector_arrays near,
                         struct vector_arrays far) {
    const struct pair_term term = {near, far, factor};
    if (has_component(&term, 0) || has_component(&term, 1) || has_component(&term, 2))
        terms->terms[terms->count++] = term;
}

/* ---- Unread arrays ---- */

static void use_terms(const struct pair_terms *terms, bool *used) {
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++)
            if (has_component(&terms->terms[t], a))
                used[terms->terms[t].near.at[a]] = used[terms->terms[t].far.at[a]] = true;
}

static void use_cross(const struct pair_move *move, int shift, int force, bool *used) {
    if (meet(move, shift, force))
        used[move->shift.at[shift]] = used[move->force.at[force]] = true;
}

static bool has_joint(const struct pairs *pairs, int is_revolute) {
    for (int i = 0; i < pairs->n; i++)
        if (pairs->is_revolute[i] == is_revolute)
            return true;
    return false;
}

static void use_pairs(struct pairs *pairs, bool *used) {
    for (int p = 0; p < pairs->product_count; p++) {
        const struct pair_product *product = &pairs->products[p];
        const struct pair_entries *both[2] = {&product->slide, &product->turn};
        used[product->array] = true;
        for (int kind = 0; kind < 2; kind++)
            if (has_joint(pairs, kind)) {
                use_terms(&both[kind]->rows, used);
                use_terms(&both[kind]->columns, used);
            }
    }
    for (int m = 0; m < pairs->move_count; m++)
        for (int a = 0; a < 3; a++) {
            struct pair_move *move = &pairs->moves[m];
            if (move->moment.at[a] == NOTHING || !used[move->moment.at[a]]) {
                move->moment.at[a] = NOTHING;
                continue;
            }
            use_cross(move, (a + 1) % 3, (a + 2) % 3, used);
            use_cross(move, (a + 2) % 3, (a + 1) % 3, used);
        }
}

static void use_loop(struct loop *loop, bool *used) {
    if (loop->kind == LOOP_SWEEPS)
        sweeps_drop_unread(&loop->of.sweeps);
    const struct array_list list = loops_list_arrays(loop);
    if (loop->kind == LOOP_PAIRS)
        use_pairs(&loop->of.pairs, used);
    for (int i = 0; i < list.count && loop->kind != LOOP_PAIRS; i++)
        if (*list.arrays[i] != NOTHING)
            used[*list.arrays[i]] = true;
}

static void renumber_loop(struct loop *loop, const int *number) {
    const struct array_list list = loops_list_arrays(loop);
    for (int i = 0; i < list.count; i++)
        *list.arrays[i] = *list.arrays[i] == NOTHING ? NOTHING : number[*list.arrays[i]];
}

static void renumber_run_results(struct function *function, const int *number) {
    int kept = 0;
    for (int i = 0; i < function->run_result_count; i++) {
        struct run_result result = function->run_results[i];
        result.array = number[result.array];
        if (result.array != NOTHING)
            function->run_results[kept++] = result;
    }
    function->run_result_count = kept;
}

void pair_loops_drop_unread(struct memory *memory, struct function *function) {
    const int arrays = plan_count_arrays(function);
    bool *used = memory_get(memory, ((size_t)arrays + 1) * sizeof *used);
    int *number = memory_get(memory, ((size_t)arrays + 1) * sizeof *number), kept = function->array_count;
    for (int i = 0; i < function->loop_count; i++)
        use_loop(&function->loops[i], used);
    function->local_out_count = 0;
    for (int f = 0; f < arrays; f++) {
        const struct array array = function->arrays[f];
        number[f] = f < function->array_count ? f : used[f] ? kept++ : NOTHING;
        if (f < function->array_count || !used[f])
            continue;
        struct array *into = &function->arrays[number[f]];
        *into = array;
        into->offset = function->out_count + function->local_out_count;
        function->local_out_count += array.count;
    }
    function->local_count = kept - function->array_count;
    for (int i = 0; i < function->loop_count; i++)
        renumber_loop(&function->loops[i], number);
    renumber_run_results(function, number);
}
