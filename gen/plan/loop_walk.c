/*
 * Visiting the assignments of a loop's form (loops.h) in the order of execution: integers, loops and
 * conditions are executed, values are up to the visitor. Visitors count operations, find the entries that are
 * written or may be nonzero, and compute.
 */
#include "gen/plan/plan.h"

#include <stdlib.h>

int loop_index_value(const struct loop_walk *walk, const struct loop_index *index) {
    int value = index->constant;
    for (int i = 0; i < index->count; i++) {
        const struct loop_index_part *part = &index->parts[i];
        const int variable = walk->variables[part->variable];
        value += part->factor *
                 (part->table == NOTHING ? variable : walk->form->tables[part->table].values[variable]);
    }
    return value;
}

int loop_place(const struct loop_walk *walk, const struct loop_entry *entry) {
    const struct function *function = walk->form->function;
    const int local = entry->array - plan_count_arrays(function);
    const int first = local < 0 ? function->arrays[entry->array].offset : walk->form->locals[local].place;
    return first + loop_index_value(walk, &entry->at);
}

bool loop_holds(int a, enum loop_relation relation, int b) {
    switch (relation) {
    case LOOP_LESS:
        return a < b;
    case LOOP_GREATER:
        return a > b;
    case LOOP_AT_LEAST:
        return a >= b;
    default:
        return a == b;
    }
}

static void walk_list(struct loop_walk *walk, const struct loop_list *list, long times);

static bool has_inner_loops(const struct loop_list *list) {
    for (const struct loop_statement *s = list->first; s; s = s->next)
        if (s->kind != LOOP_ASSIGN)
            return true;
    return false;
}

/* From the present value of the variable on. */
static long count_iterations(const struct loop_walk *walk, const struct loop_statement *loop) {
    const int from = walk->variables[loop->variable], to = loop_index_value(walk, &loop->to),
              step = loop_index_value(walk, &loop->step);
    const int way = step > 0 ? to - from : from - to + (loop->relation == LOOP_AT_LEAST);
    return way > 0 ? (way + abs(step) - 1) / abs(step) : 0;
}

static void walk_for(struct loop_walk *walk, const struct loop_statement *loop, long times) {
    int *variable = &walk->variables[loop->variable];
    if (loop->is_declared)
        *variable = loop_index_value(walk, &loop->from);
    if (walk->is_counting && loop->is_declared && !has_inner_loops(&loop->body)) {
        const long iterations = count_iterations(walk, loop);
        for (const struct loop_statement *s = loop->body.first; s; s = s->next)
            walk->visit(walk, s, times * (iterations - (s->is_unread_at_first && iterations)));
        return;
    }
    for (; loop_holds(*variable, loop->relation, loop_index_value(walk, &loop->to));
         *variable += loop_index_value(walk, &loop->step))
        walk_list(walk, &loop->body, times);
}

static void walk_list(struct loop_walk *walk, const struct loop_list *list, long times) {
    for (const struct loop_statement *s = list->first; s; s = s->next)
        switch (s->kind) {
        case LOOP_FOR:
            walk_for(walk, s, times);
            break;
        case LOOP_IF:
            walk_list(
                walk,
                loop_holds(loop_index_value(walk, &s->from), s->relation, loop_index_value(walk, &s->to))
                    ? &s->body
                    : &s->otherwise,
                times);
            break;
        case LOOP_INTEGER:
            walk->variables[s->variable] = loop_index_value(walk, &s->from);
            break;
        case LOOP_ASSIGN:
            walk->visit(walk, s, times);
            break;
        case LOOP_SEQUENCE:
            walk_list(walk, &s->body, times);
            break;
        case LOOP_ARRAY:
            break;
        }
}

void loop_walk(struct loop_walk *walk) {
    walk_list(walk, &walk->form->body, 1);
}
