/*
 * The order of execution of one function: which loops run as one, what comes before and after them, and which
 * values they keep for each other.
 *
 * Input: statements and needed nodes (plan.c). Output: blocks. Loops over one run are fused if nothing
 * between them needs the end of the first one. Values then stay in registers, and recursions that do not wait
 * for each other overlap.
 */
#include "gen/plan/plan.h"

#include <stdlib.h>
#include <string.h>

/* ---- The coordinates whose sines and cosines a function computes in one pass (emit_sincos.c): a range ----
 */

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

/* Finds the coordinates in the pass over angles. */
static void find_angles(const struct plan *plan, struct function *function) {
    const struct angle_range range = angles_range(plan, function);
    function->first_angle = range.first;
    if (!plan->is_single && /* the pass is for doubles: emit_sincos.c */
        range.count >= FEWEST_ANGLES &&
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

/* ---- Loops and straight-line code ---- */

/* A set of loops of the graph, one bit each. */
typedef uint64_t word;

struct scheduler {
    struct plan *plan;
    struct function *function;
    const struct graph *g;
    int words;
    word *awaits_end;                /* by handle of a node outside loops: the loops whose end it needs */
    word *needs_end, *needs_element; /* by loop: the loops whose end, or whose same element, it needs */
    bool *is_used, *is_directed;     /* by loop: is in the function; carries a value in it */
    bool *is_done;                   /* by group */
    bool *is_seen;                   /* by group, in one search */
    bool *is_placed;                 /* by handle: the statement has its place */
};

static word *set_of(const struct scheduler *x, word *sets, uint32_t index) {
    return sets + (size_t)index * (size_t)x->words;
}

static bool has(const word *set, int loop) {
    return set[loop / 64] >> (loop % 64) & 1;
}

static void include(word *set, int loop) {
    set[loop / 64] |= (word)1 << (loop % 64);
}

static void unite(const struct scheduler *x, word *into, const word *from) {
    for (int w = 0; w < x->words; w++)
        into[w] |= from[w];
}

/* ---- What each loop and each straight node waits for ---- */

static bool has_own_name(const struct scheduler *x, expression e) {
    return x->plan->is_statement[e] || x->plan->is_derived[e] || graph_as_slot(x->g, e);
}

/* Calls `read` for each named value in the expression of e; for e itself if it has a name. */
static void visit_read(struct scheduler *x, expression e, int loop,
                       void (*read)(struct scheduler *x, expression e, int loop)) {
    if (has_own_name(x, e) || !x->g->nodes[e].loop) {
        read(x, e, loop);
        return;
    }
    for (int k = 0; k < operation_arity(x->g->nodes[e].operation); k++)
        visit_read(x, x->g->nodes[e].operand[k], loop, read);
}

static void visit_operands(struct scheduler *x, expression e, int loop,
                           void (*read)(struct scheduler *x, expression e, int loop)) {
    for (int k = 0; k < operation_arity(x->g->nodes[e].operation); k++)
        visit_read(x, x->g->nodes[e].operand[k], loop, read);
}

/* The loop that computes a result of all elements; 0: any loop can write it. */
static int loop_of_result(const struct scheduler *x, const struct run_result *result) {
    const int loop = x->g->nodes[result->value].loop;
    return loop == ANY_LOOP ? 0 : loop;
}

/* Visits all that loops read: statements, carried values, results. */
static void visit_loops(struct scheduler *x, void (*read)(struct scheduler *x, expression e, int loop)) {
    const struct graph *g = x->g;
    for (expression e = 0; e < g->count; e++) {
        const struct slot *slot = x->function->is_needed[e] ? graph_as_slot(g, e) : NULL;
        if (slot)
            visit_read(x, slot->next, slot->loop, read);
        if (x->plan->is_statement[e] && g->nodes[e].loop)
            visit_operands(x, e, g->nodes[e].loop, read);
    }
    for (int i = 0; i < x->function->run_result_count; i++) {
        const struct run_result *result = &x->function->run_results[i];
        if (loop_of_result(x, result))
            visit_read(x, result->value, loop_of_result(x, result), read);
    }
}

static void wait_for(struct scheduler *x, expression e, int loop) {
    const int home = x->g->nodes[e].loop;
    if (!home)
        unite(x, set_of(x, x->needs_end, (uint32_t)loop), set_of(x, x->awaits_end, e));
    else if (home != loop && !angles_is_repeated(x->plan, x->function, e))
        include(set_of(x, x->needs_element, (uint32_t)loop), home);
}

static void find_used_loops(struct scheduler *x) {
    const struct graph *g = x->g;
    for (expression e = 0; e < g->count; e++) {
        const struct slot *slot = x->function->is_needed[e] ? graph_as_slot(g, e) : NULL;
        if (slot)
            x->is_used[slot->loop] = x->is_directed[slot->loop] = true;
        if (x->plan->is_statement[e] && !angles_is_repeated(x->plan, x->function, e))
            x->is_used[g->nodes[e].loop] = true;
    }
    for (int i = 0; i < x->function->run_result_count; i++)
        x->is_used[loop_of_result(x, &x->function->run_results[i])] = true;
    x->is_used[0] = false;
}

static void find_waiting(struct scheduler *x) {
    const struct graph *g = x->g;
    for (expression e = 0; e < g->count; e++) {
        if (!x->function->is_needed[e] || g->nodes[e].loop)
            continue;
        if (graph_as_slot(g, e))
            include(set_of(x, x->awaits_end, e), graph_as_slot(g, e)->loop);
        for (int k = 0; k < operation_arity(g->nodes[e].operation); k++)
            unite(x, set_of(x, x->awaits_end, e), set_of(x, x->awaits_end, g->nodes[e].operand[k]));
    }
    for (expression e = 0; e < g->count; e++) {
        const struct slot *slot = x->function->is_needed[e] ? graph_as_slot(g, e) : NULL;
        if (slot)
            unite(x, set_of(x, x->needs_end, slot->loop), set_of(x, x->awaits_end, slot->initial));
    }
    visit_loops(x, wait_for);
}

/* ---- Fusion ---- */

/* Returns whether the group needs the end of a loop or, if `elements_too`, the same element of it. */
static bool group_needs(const struct scheduler *x, int group, int loop, bool elements_too) {
    for (int member = 1; member < x->g->loop_count; member++)
        if (x->is_used[member] && x->function->group_of[member] == group &&
            (has(set_of(x, x->needs_end, (uint32_t)member), loop) ||
             (elements_too && has(set_of(x, x->needs_element, (uint32_t)member), loop))))
            return true;
    return false;
}

/* Returns whether something that the group waits for waits for group `other`. Groups that have been `seen`
 * do not. */
static bool waits_for_group(const struct scheduler *x, int group, int other, bool *seen) {
    const int *group_of = x->function->group_of;
    if (seen[group])
        return false;
    seen[group] = true;
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (x->is_used[loop] && group_needs(x, group, loop, true) &&
            (group_of[loop] == other || waits_for_group(x, group_of[loop], other, seen)))
            return true;
    return false;
}

/* Returns whether `group` depends on `other` in another way than by reading its elements. Then they cannot
 * run as one. */
static bool is_separated(const struct scheduler *x, int group, int other) {
    const int *group_of = x->function->group_of;
    memset(x->is_seen, 0, (size_t)x->g->loop_count);
    x->is_seen[group] = true;
    for (int loop = 1; loop < x->g->loop_count; loop++) {
        const bool is_other = group_of[loop] == other;
        if (x->is_used[loop] && group_needs(x, group, loop, !is_other) &&
            (is_other || waits_for_group(x, group_of[loop], other, x->is_seen)))
            return true;
    }
    return false;
}

static bool is_group_directed(const struct scheduler *x, int group, bool *inward) {
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (x->is_used[loop] && x->function->group_of[loop] == group && x->is_directed[loop]) {
            *inward = x->g->loops[loop].inward;
            return true;
        }
    return false;
}

static bool can_fuse(const struct scheduler *x, int group, int other) {
    bool a = false, b = false;
    if (group == other || x->g->loops[group].run != x->g->loops[other].run)
        return false;
    if (is_group_directed(x, group, &a) && is_group_directed(x, other, &b) && a != b)
        return false;
    return !is_separated(x, group, other) && !is_separated(x, other, group);
}

static void fuse(struct scheduler *x, int group, int into) {
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (x->is_used[loop] && x->function->group_of[loop] == group)
            x->function->group_of[loop] = into;
}

static bool reads_elements(const struct scheduler *x, int loop) {
    for (int other = 1; other < x->g->loop_count; other++)
        if (x->is_used[other] && has(set_of(x, x->needs_element, (uint32_t)loop), other))
            return true;
    return false;
}

/*
 * Each loop joins the latest possible group. A loop that carries nothing and reads no other loop joins the
 * first group that reads it, so that its values need not be kept.
 */
static void fuse_loops(struct scheduler *x) {
    int *group_of = x->function->group_of;
    for (int loop = 1; loop < x->g->loop_count; loop++)
        group_of[loop] = x->is_used[loop] ? loop : 0;
    for (int loop = 1; loop < x->g->loop_count; loop++) {
        if (!x->is_used[loop] || (!x->is_directed[loop] && !reads_elements(x, loop)))
            continue;
        for (int other = loop - 1; other > 0 && group_of[loop] == loop; other--)
            if (x->is_used[other] && (x->is_directed[other] || reads_elements(x, other)) &&
                can_fuse(x, loop, group_of[other]))
                fuse(x, loop, group_of[other]);
        for (int other = loop - 1; other > 0; other--)
            if (x->is_used[other] && !x->is_directed[other] && group_of[other] == other &&
                has(set_of(x, x->needs_element, (uint32_t)loop), other) && can_fuse(x, other, group_of[loop]))
                fuse(x, other, group_of[loop]);
    }
}

/* ---- Order ---- */

static struct code_block *add_block(struct function *function, int run, int group) {
    struct code_block *last = function->block_count ? &function->blocks[function->block_count - 1] : NULL;
    if (last && last->run < 0 && run < 0)
        return last;
    last = &function->blocks[function->block_count++];
    *last = (struct code_block){run, group, false, function->statement_count};
    return last;
}

static void add_statement(struct scheduler *x, expression e) {
    struct function *function = x->function;
    x->is_placed[e] = true;
    function->statements[function->statement_count++] = e;
    function->blocks[function->block_count - 1].end = function->statement_count;
}

/* Returns whether all loops of a set have ended. */
static bool have_ended(const struct scheduler *x, const word *loops) {
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (has(loops, loop) && x->is_used[loop] && !x->is_done[x->function->group_of[loop]])
            return false;
    return true;
}

/* Places the statements below `limit` outside loops that wait for nothing. */
static void place_straight(struct scheduler *x, expression limit) {
    for (expression e = 0; e < limit; e++) {
        if (!x->plan->is_statement[e] || x->g->nodes[e].loop || x->is_placed[e] ||
            !have_ended(x, set_of(x, x->awaits_end, e)))
            continue;
        add_block(x->function, -1, 0);
        add_statement(x, e);
    }
}

static void place_group(struct scheduler *x, int group) {
    const struct graph *g = x->g;
    struct code_block *block = add_block(x->function, g->loops[group].run, group);
    is_group_directed(x, group, &block->inward);
    for (expression e = 0; e < g->count; e++) {
        const uint16_t loop = g->nodes[e].loop;
        if (x->plan->is_statement[e] && loop && x->function->group_of[loop] == group &&
            !angles_is_repeated(x->plan, x->function, e))
            add_statement(x, e);
    }
    x->is_done[group] = true;
}

static bool is_group_ready(const struct scheduler *x, int group) {
    const int *group_of = x->function->group_of;
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (x->is_used[loop] && group_of[loop] != group && !x->is_done[group_of[loop]] &&
            group_needs(x, group, loop, true))
            return false;
    return true;
}

/* The first group that waits for nothing; 0: all are done. */
static int next_group(const struct scheduler *x) {
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (x->is_used[loop] && x->function->group_of[loop] == loop && !x->is_done[loop] &&
            is_group_ready(x, loop))
            return loop;
    return 0;
}

static expression end_of_group(const struct scheduler *x, int group) {
    expression end = 0;
    for (int loop = 1; loop < x->g->loop_count; loop++)
        if (x->is_used[loop] && x->function->group_of[loop] == group)
            end = x->g->loops[loop].end > end ? x->g->loops[loop].end : end;
    return end;
}

static void order_statements(struct scheduler *x) {
    add_block(x->function, -1, 0);
    for (int group = next_group(x); group; group = next_group(x)) {
        place_straight(x, end_of_group(x, group));
        place_group(x, group);
    }
    place_straight(x, x->g->count);
}

/* The loop that computes the results of a run writes them. Results that no loop computes get a loop of
 * their own. */
static void place_run_results(struct scheduler *x) {
    struct function *function = x->function;
    for (int i = 0; i < function->run_result_count; i++) {
        struct run_result *result = &function->run_results[i];
        const int loop = loop_of_result(x, result), group = loop ? function->group_of[loop] : 0;
        int block = function->block_count - 1;
        while (block >= 0 &&
               !(function->blocks[block].run == result->run && function->blocks[block].group == group))
            block--;
        if (block < 0) {
            add_block(function, result->run, group);
            block = function->block_count - 1;
        }
        result->block = block;
    }
}

/* ---- What loops keep for other loops ---- */

static void repeat(struct scheduler *x, expression e, int group) {
    struct function *function = x->function;
    for (int i = 0; i < function->repeat_count; i++)
        if (function->repeats[i].group == group && function->repeats[i].value == e)
            return;
    function->repeats = memory_room(x->plan->memory, function->repeats, function->repeat_count,
                                    &function->repeat_capacity, sizeof *function->repeats);
    function->repeats[function->repeat_count++] = (struct repeat){group, e};
}

static void keep(struct scheduler *x, expression e, int loop) {
    const int home = x->g->nodes[e].loop;
    const int *group_of = x->function->group_of;
    if (home && angles_is_repeated(x->plan, x->function, e))
        repeat(x, e, group_of[loop]);
    else if (home && group_of[home] != group_of[loop])
        x->function->is_stored[e] = true;
}

/* ---- Results ---- */

/* By handle: how many statements and blocks must end before the value may be read. */
static int *find_places(const struct scheduler *x) {
    const struct graph *g = x->g;
    const struct function *function = x->function;
    int *place = memory_scratch(x->plan->memory, g->count * sizeof *place);
    int *end_of_group = memory_scratch(x->plan->memory, ((size_t)g->loop_count + 1) * sizeof *end_of_group);
    for (int b = 0, at = 0; b < function->block_count; at = function->blocks[b++].end) {
        const struct code_block *block = &function->blocks[b];
        end_of_group[block->group] = block->end + b + 1;
        for (int i = at; i < block->end; i++)
            place[function->statements[i]] = (block->run < 0 ? i : block->end) + b + 1;
    }
    for (expression e = 0; e < g->count; e++) {
        if (x->plan->is_statement[e] || x->plan->is_derived[e])
            continue;
        if (graph_as_slot(g, e))
            place[e] = end_of_group[function->group_of[graph_as_slot(g, e)->loop]];
        for (int k = 0; k < operation_arity(g->nodes[e].operation); k++) {
            const int operand = place[g->nodes[e].operand[k]];
            place[e] = operand > place[e] ? operand : place[e];
        }
    }
    return place;
}

static int compare_writes(const void *a, const void *b) {
    const struct write *first = a, *second = b;
    if (first->place != second->place)
        return first->place < second->place ? -1 : 1;
    if (first->array != second->array)
        return first->array < second->array ? -1 : 1;
    return first->entry < second->entry ? -1 : 1;
}

static void add_write(struct scheduler *x, struct write write) {
    struct function *function = x->function;
    function->writes = memory_room(x->plan->memory, function->writes, function->write_count,
                                   &function->write_capacity, sizeof *function->writes);
    function->writes[function->write_count++] = write;
}

/* Writes the zeros of an array that is not cleared. */
static void write_zeros(struct scheduler *x, int array, int place) {
    const struct memory_mark mark = memory_mark(x->plan->memory);
    const struct function *function = x->function;
    const struct array *of = &function->arrays[array];
    bool *is_given = memory_scratch(x->plan->memory, (size_t)of->count + 1);
    for (int i = 0; i < of->single_count; i++)
        is_given[of->singles[i].entry] = true;
    for (int i = 0; i < function->run_result_count; i++) {
        const struct run_result *result = &function->run_results[i];
        for (int e = 0; result->array == array && e < x->plan->rolled->runs[result->run].count; e++)
            is_given[result->entry + e * result->stride] = true;
    }
    for (int i = 0; i < of->count; i++)
        if (!is_given[i] && plan_is_output_copied(of, i))
            add_write(x, (struct write){array, i, place, 0});
    memory_back(x->plan->memory, mark);
}

static void order_writes(struct scheduler *x) {
    struct function *function = x->function;
    const int *place = find_places(x);
    for (int f = 0; f < plan_count_arrays(function); f++) {
        const struct array *array = &function->arrays[f];
        for (int i = 0; i < array->single_count; i++)
            add_write(x, (struct write){f, array->singles[i].entry, place[array->singles[i].value],
                                        array->singles[i].value});
        if (!plan_is_cleared(x->plan, function, f))
            write_zeros(x, f, place[0]);
    }
    if (function->write_count)
        qsort(function->writes, (size_t)function->write_count, sizeof *function->writes, compare_writes);
}

void schedule_function(struct plan *plan, struct function *function) {
    struct graph *g = plan->g;
    const size_t nodes = g->count, loops = (size_t)g->loop_count + 1;
    struct scheduler x = {.plan = plan, .function = function, .g = g, .words = g->loop_count / 64 + 1};
    const size_t words = (size_t)x.words * sizeof(word);
    find_angles(plan, function);
    x.awaits_end = memory_scratch(plan->memory, nodes * words);
    x.needs_end = memory_scratch(plan->memory, loops * words);
    x.needs_element = memory_scratch(plan->memory, loops * words);
    x.is_used = memory_scratch(plan->memory, loops);
    x.is_directed = memory_scratch(plan->memory, loops);
    x.is_done = memory_scratch(plan->memory, loops);
    x.is_seen = memory_scratch(plan->memory, loops);
    x.is_placed = memory_scratch(plan->memory, nodes);
    function->group_of = memory_get(plan->memory, loops * sizeof *function->group_of);
    function->is_stored = memory_get(plan->memory, nodes);
    function->blocks = memory_get(plan->memory, (2 * loops + (size_t)plan->rolled->run_count + 3) *
                                                    sizeof *function->blocks);
    int statements = 0;
    for (expression e = 0; e < g->count; e++)
        statements += plan->is_statement[e];
    function->statements = memory_get(plan->memory, ((size_t)statements + 1) * sizeof(expression));
    find_used_loops(&x);
    find_waiting(&x);
    fuse_loops(&x);
    order_statements(&x);
    place_run_results(&x);
    visit_loops(&x, keep);
    if (function != &plan->prepare) /* in `prepare` each statement is a result */
        order_writes(&x);
}
