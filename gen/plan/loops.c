/* The form of each kind of loop (loops.h), the entries that it sets, and its operations. */
#include "gen/plan/plan.h"

struct loop_form *loops_lower(struct memory *memory, const struct function *function, const struct loop *loop,
                              bool is_in_strips) {
    struct loop_form *form = memory_get(memory, sizeof *form);
    *form =
        (struct loop_form){.memory = memory, .function = function, .value_count = plan_value_count(function)};
    form->at = &form->body;
    switch (loop->kind) {
    case LOOP_PAIRS:
        loops_lower_pairs(form, &loop->of.pairs, is_in_strips);
        break;
    case LOOP_PRODUCT:
        loops_lower_product(form, &loop->of.product);
        break;
    case LOOP_FACTORING:
        loops_lower_factoring(form, &loop->of.factoring);
        break;
    case LOOP_SOLVING:
        loops_lower_solving(form, &loop->of.solving);
        break;
    case LOOP_SWEEPS:
        loops_lower_sweeps(form, &loop->of.sweeps);
        break;
    }
    return form;
}

/* Rows and columns of joints at one stage, which are straight-line values, are near the diagonal. */
static bool sets_columns(const struct sweeps *s, int array) {
    for (int i = 0; i < s->n; i++)
        if (s->root[i])
            return false;
    return s->columns[0].array == array || s->columns[s->column_count - 1].array == array;
}

enum loops_coverage loops_coverage(const struct function *function, int array) {
    enum loops_coverage coverage = LOOPS_SET_SOME;
    for (int i = 0; i < function->loop_count && coverage == LOOPS_SET_SOME; i++) {
        const struct loop *loop = &function->loops[i];
        if (loop->kind == LOOP_PAIRS)
            coverage = loops_pairs_coverage(function, &loop->of.pairs, array);
        else if (loop->kind == LOOP_SWEEPS && sets_columns(&loop->of.sweeps, array))
            coverage = LOOPS_SET_OTHERS;
    }
    return coverage;
}

/* ---- Operations ---- */

struct counter {
    struct loop_walk walk;
    struct operation_count *count;
};

/* A product comes with an addition; constants before inner loops are few, copies cost nothing. */
static void count_assignment(struct loop_walk *walk, const struct loop_statement *assignment, long times) {
    struct operation_count *count = ((struct counter *)walk)->count;
    long products = 0;
    for (int i = 0; i < assignment->term_count; i++)
        products += assignment->terms[i].operand_count > 1;
    const long entries = assignment->term_count - products;
    if (assignment->is_constant)
        return;
    count->adds += times * (products + (entries > 1 ? entries - 1 : 0));
    count->muls += times * (products + (assignment->effect == LOOP_MULTIPLY));
    count->divs += times * (assignment->effect == LOOP_INVERT);
}

void loops_count_operations(struct memory *memory, const struct function *function, const struct loop *loop,
                            struct operation_count *count) {
    struct counter counter = {.count = count};
    counter.walk = (struct loop_walk){
        .form = loops_lower(memory, function, loop, false), .visit = count_assignment, .is_counting = true};
    loop_walk(&counter.walk);
}
