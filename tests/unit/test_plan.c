/*
 * The plan alone, for functions made here. The tests cover the order of summands, the values that become
 * statements or move to `prepare`, and the loops that are merged. They also cover the values that loops store
 * for each other, the places where long functions are cut, and the report of a plan that breaks a promise of
 * plan.h.
 */
#include "check.h"
#include "expressions.h"
#include "gen/plan/plan.h"

#include <string.h>

enum { COORDINATES = 8, ELEMENTS = 5, FRAME = 1 };
static const double at[COORDINATES] = {0.43715629, 0.82613947, 0.29384751, 1.37261984,
                                       2.61803127, 0.17432906, 3.14871265, 0.58120437};

/* One function over a tree of eight coordinates, five of which, from the second on, form a run. */
struct scene {
    struct expressions own;
    struct graph *g;
    struct model model;
    struct parameter parameters[2];
    struct frame frames[3];
    struct element_run run;
    struct tree tree, rolled;
    struct plan plan;
    struct function function;
};

static void start(struct scene *s) {
    memset(s, 0, sizeof *s);
    s->g = expressions_start(&s->own);
    s->model = (struct model){.graph = s->g, .parameters = s->parameters, .parameter_count = 2};
    s->frames[0] = (struct frame){.kind = FRAME_ENTRY, .parent = -1, .partner = 2};
    s->frames[FRAME] = (struct frame){.kind = FRAME_JOINT, .coordinate = 1, .step = 1};
    s->frames[2] = (struct frame){.kind = FRAME_EXIT, .parent = 1};
    s->run = (struct element_run){.name = "arm", .first = 1, .period = 1, .count = ELEMENTS};
    s->tree = (struct tree){.count = COORDINATES};
    s->rolled = (struct tree){.frames = s->frames, .count = 3, .runs = &s->run, .run_count = 1};
    s->function = (struct function){.quantity = "made"};
    s->plan = (struct plan){.memory = &s->own.memory,
                            .g = s->g,
                            .model = &s->model,
                            .tree = &s->tree,
                            .rolled = &s->rolled,
                            .functions = &s->function,
                            .function_count = 1};
}

static void add_result(struct scene *s, expression value) {
    const int field = plan_open_result(&s->own.memory, &s->function, "part", "", 1, 0);
    plan_set_entry(&s->own.memory, &s->function, field, 0, value);
}

static expression result(const struct scene *s, int field) {
    return s->function.arrays[field].singles[0].value;
}

static void make_plan(struct scene *s) {
    order_of_sums(&s->plan);
    plan_functions(&s->plan);
    const char *broken = plan_violation(&s->plan);
    if (broken)
        printf("%s\n", broken);
    CHECK(!broken);
}

/* ---- Order of sums ---- */

static bool adds(const struct graph *g, expression sum, expression summand) {
    const struct node *node = &g->nodes[sum];
    return node->operation == OP_ADD && (node->operand[0] == summand || node->operand[1] == summand);
}

static expression late_value(struct graph *g) {
    return expr_apply1(g, OP_EXP, expr_apply1(g, OP_SIN, expr_apply1(g, OP_EXP, variable(g, 6))));
}

static void test_late_summand_is_last(void) {
    struct scene s;
    start(&s);
    const expression late = late_value(s.g), x = variable(s.g, 0), y = variable(s.g, 1);
    const expression sum = expr_add(s.g, expr_add(s.g, late, x), y);
    const double expected = value_at(s.g, sum, at);
    CHECK(!adds(s.g, sum, late));
    add_result(&s, sum);
    order_of_sums(&s.plan);
    CHECK(adds(s.g, result(&s, 0), late));
    CHECK_NEAR(value_at(s.g, result(&s, 0), at), expected, 1e-15);
    expressions_release(&s.own);
}

/* A value with a name for the reader, or one that is also read elsewhere, remains one summand. */
static void test_kept_summands(void) {
    struct scene s;
    start(&s);
    const expression x = variable(s.g, 0), y = variable(s.g, 1), z = variable(s.g, 2);
    const expression late = late_value(s.g), named = expr_add(s.g, late, x), shared = expr_add(s.g, late, y);
    graph_name_value(s.g, named, "height");
    add_result(&s, expr_add(s.g, named, z));
    add_result(&s, expr_add(s.g, shared, z));
    add_result(&s, shared);
    order_of_sums(&s.plan);
    CHECK(adds(s.g, result(&s, 0), named) && adds(s.g, named, late));
    CHECK(adds(s.g, result(&s, 1), shared) && adds(s.g, shared, late));
    expressions_release(&s.own);
}

static void test_differences_keep_their_signs(void) {
    struct scene s;
    start(&s);
    struct graph *g = s.g;
    const expression product = expr_mul(g, variable(g, 2), variable(g, 3));
    const expression other = expr_mul(g, variable(g, 4), variable(g, 5));
    const expression sum = expr_sub(g, expr_sub(g, expr_sub(g, variable(g, 0), late_value(g)), product),
                                    expr_sub(g, other, product));
    const double expected = value_at(g, sum, at);
    add_result(&s, sum);
    order_of_sums(&s.plan);
    CHECK_NEAR(value_at(g, result(&s, 0), at), expected, 4e-15);
    expressions_release(&s.own);
}

/* ---- Statements ---- */

static int place_of(const struct function *function, expression e) {
    for (int i = 0; i < function->statement_count; i++)
        if (function->statements[i] == e)
            return i;
    return -1;
}

static void test_statements(void) {
    struct scene s;
    start(&s);
    struct graph *g = s.g;
    const expression shared = expr_apply1(g, OP_EXP, variable(g, 0)),
                     once = expr_apply1(g, OP_EXP, variable(g, 1));
    const expression named = expr_mul(g, shared, once), unread = expr_apply1(g, OP_EXP, variable(g, 2));
    graph_name_value(g, named, "area");
    add_result(&s, expr_add(g, expr_mul(g, named, variable(g, 3)), shared));
    make_plan(&s);
    CHECK(place_of(&s.function, shared) == 0 && place_of(&s.function, named) == 1);
    CHECK(place_of(&s.function, once) < 0 && !s.function.is_needed[unread]);
    CHECK(s.function.statement_count == 2 && s.function.piece_count == 1);
    CHECK(s.function.operations.functions == 2 && s.function.operations.muls == 2);
    expressions_release(&s.own);
}

static void test_parameters_move_to_prepare(void) {
    struct scene s;
    start(&s);
    struct graph *g = s.g;
    const expression p0 = expr_symbol(g, SYMBOL_PARAMETER, 0, 0), p1 = expr_symbol(g, SYMBOL_PARAMETER, 1, 0);
    const expression derived = expr_div(g, p0, expr_add(g, p1, expr_number(g, 2.71937)));
    const expression gain = expr_apply1(g, OP_RATE_GAIN, expr_number(g, 31.4159));
    add_result(&s, expr_add(g, expr_mul(g, derived, variable(g, 0)), expr_mul(g, gain, variable(g, 1))));
    make_plan(&s);
    CHECK(s.plan.is_derived[derived] && s.plan.is_derived[gain] && !s.plan.is_derived[result(&s, 0)]);
    CHECK(s.plan.prepare.statement_count == 2 && s.plan.prepare.operations.divs == 1);
    CHECK(s.function.operations.divs == 0 && s.function.operations.muls == 2 &&
          s.function.operations.adds == 1);
    CHECK(s.plan.parameter_count == 2);
    expressions_release(&s.own);
}

static void test_long_functions_are_cut(void) {
    enum { MANY = 9000, LONGEST = 400 };
    struct scene s;
    start(&s);
    expression x = variable(s.g, 0);
    const int field = plan_open_result(&s.own.memory, &s.function, "course", "", MANY, 0);
    for (int i = 0; i < MANY; i++) {
        x = expr_apply1(s.g, OP_SIN, expr_add(s.g, x, expr_number(s.g, 0.3137)));
        plan_set_entry(&s.own.memory, &s.function, field, i, x);
    }
    make_plan(&s);
    CHECK(s.function.statement_count == MANY - 1 && s.function.piece_count >= MANY / LONGEST);
    for (int i = 0, begin = 0; i < s.function.piece_count; begin = s.function.piece_ends[i++])
        CHECK(s.function.piece_ends[i] > begin && s.function.piece_ends[i] <= begin + LONGEST);
    expressions_release(&s.own);
}

/* ---- Loops ---- */

/* The value that a loop carries, and a value of each element computed on the way. */
struct recursion_made {
    expression final, each;
};

/* carried = exp(q of the element + `more`) * carried + `more`; if `more` is 0, a number replaces it. */
static struct recursion_made recur(struct graph *g, bool inward, expression initial, expression more) {
    graph_open_loop(g, 0, inward);
    const int slot = graph_new_slot(g, initial);
    const expression own = expr_symbol(g, SYMBOL_ELEMENT, FRAME, 0);
    const expression each =
        expr_mul(g, expr_apply1(g, OP_EXP, expr_add(g, own, more)), g->slots[slot].carried);
    graph_set_next(g, slot, expr_add(g, each, more));
    graph_close_loop(g);
    return (struct recursion_made){g->slots[slot].final, each};
}

static int loops_in(const struct function *function) {
    int count = 0;
    for (int b = 0; b < function->block_count; b++)
        count += function->blocks[b].run >= 0;
    return count;
}

static void test_independent_loops_run_as_one(void) {
    struct scene s;
    start(&s);
    const struct recursion_made a = recur(s.g, false, variable(s.g, 0), variable(s.g, 6));
    const struct recursion_made b = recur(s.g, false, variable(s.g, 7), expr_number(s.g, 0.7183));
    add_result(&s, expr_add(s.g, a.final, b.final));
    make_plan(&s);
    CHECK(loops_in(&s.function) == 1);
    CHECK(s.function.operations.functions == 2 * ELEMENTS && s.function.operations.adds == 4 * ELEMENTS + 1);
    expressions_release(&s.own);
}

static void test_loops_that_wait_run_apart(void) {
    struct scene s;
    start(&s);
    const struct recursion_made a = recur(s.g, false, variable(s.g, 0), variable(s.g, 6));
    const struct recursion_made b = recur(s.g, false, a.final, expr_number(s.g, 0.7183));
    const struct recursion_made c =
        recur(s.g, false, variable(s.g, 7), expr_mul(s.g, b.final, variable(s.g, 6)));
    add_result(&s, c.final);
    make_plan(&s);
    CHECK(loops_in(&s.function) == 3);
    CHECK(!s.function.is_stored[a.each]);
    expressions_release(&s.own);
}

static void test_opposite_loops_keep_values(void) {
    struct scene s;
    start(&s);
    const struct recursion_made a = recur(s.g, false, variable(s.g, 0), variable(s.g, 6));
    const struct recursion_made b = recur(s.g, true, variable(s.g, 7), a.each);
    add_result(&s, expr_add(s.g, a.final, b.final));
    make_plan(&s);
    CHECK(loops_in(&s.function) == 2 && s.function.is_stored[a.each] && !s.function.is_stored[b.each]);
    CHECK(s.function.blocks[1].run == 0 && !s.function.blocks[1].inward);
    expressions_release(&s.own);
}

static void test_same_element_is_read_in_one_loop(void) {
    struct scene s;
    start(&s);
    const struct recursion_made a = recur(s.g, false, variable(s.g, 0), variable(s.g, 6));
    const struct recursion_made b = recur(s.g, false, variable(s.g, 7), a.each);
    add_result(&s, b.final);
    make_plan(&s);
    CHECK(loops_in(&s.function) == 1 && !s.function.is_stored[a.each]);
    CHECK(place_of(&s.function, a.each) >= 0);
    expressions_release(&s.own);
}

static void test_results_of_elements(void) {
    struct scene s;
    start(&s);
    const struct recursion_made a = recur(s.g, true, variable(s.g, 0), variable(s.g, 6));
    const int field = plan_open_result(&s.own.memory, &s.function, "each", "", COORDINATES, 0);
    plan_set_frame(&s.own.memory, &s.rolled, &s.function, field, 1, 1, FRAME, a.each);
    plan_set_entry(&s.own.memory, &s.function, field, 0, a.final);
    make_plan(&s);
    CHECK(loops_in(&s.function) == 1 && s.function.blocks[s.function.run_results[0].block].inward);
    expressions_release(&s.own);
}

/* ---- Plans that break a promise ---- */

static bool tells(struct scene *s, const char *promise) {
    const char *found = plan_violation(&s->plan);
    if (!found || !strstr(found, promise))
        printf("'%s' is not told, but: %s\n", promise, found ? found : "nothing");
    return found && strstr(found, promise);
}

static void start_two_loops(struct scene *s, expression *kept) {
    start(s);
    const struct recursion_made a = recur(s->g, false, variable(s->g, 0), variable(s->g, 6));
    const struct recursion_made b = recur(s->g, true, variable(s->g, 7), a.each);
    const expression shared = expr_apply1(s->g, OP_EXP, a.final), again = expr_apply1(s->g, OP_EXP, shared);
    add_result(s, expr_mul(s->g, shared, expr_add(s->g, again, b.final)));
    add_result(s, again);
    *kept = a.each;
    make_plan(s);
}

static void test_broken_order(void) {
    struct scene s;
    expression kept;
    start_two_loops(&s, &kept);
    struct function *f = &s.function;
    const int last = f->statement_count - 1;
    const expression statement = f->statements[last];
    f->statements[last] = f->statements[last - 1];
    CHECK(tells(&s, "a statement occurs once"));
    f->statements[last - 1] = statement;
    CHECK(tells(&s, "every value is computed before it is read"));
    f->statements[last - 1] = f->statements[last];
    f->statements[last] = statement;
    f->is_stored[kept] = false;
    CHECK(tells(&s, "every value is computed before it is read"));
    f->is_stored[kept] = true;
    f->statement_count--;
    CHECK(tells(&s, "blocks hold all statements"));
    f->statement_count++;
    CHECK(!plan_violation(&s.plan));
    expressions_release(&s.own);
}

static void test_broken_results(void) {
    struct scene s;
    expression kept;
    start_two_loops(&s, &kept);
    struct function *f = &s.function;
    struct write *last = &f->writes[f->write_count - 1], write = *last;
    const int place = f->writes[0].place;
    f->writes[0].place = 1;
    CHECK(tells(&s, "every value is computed before it is read"));
    f->writes[0].place = place;
    last->entry = 1;
    CHECK(tells(&s, "writes stay within their array"));
    *last = write;
    last->value = kept;
    CHECK(tells(&s, "computed before it is read"));
    *last = write;
    f->write_count--;
    CHECK(tells(&s, "each entry is written"));
    f->write_count++;
    f->arrays[1].offset++;
    CHECK(plan_violation(&s.plan));
    f->arrays[1].offset--;
    CHECK(!plan_violation(&s.plan));
    expressions_release(&s.own);
}

static void test_broken_counts(void) {
    struct scene s;
    expression kept;
    start_two_loops(&s, &kept);
    s.function.operations.muls++;
    CHECK(tells(&s, "additions and multiplications are those of the code"));
    s.function.operations.muls--;
    s.function.operations.functions--;
    CHECK(tells(&s, "divisions and functions are those of the code"));
    s.function.operations.functions++;
    s.plan.is_derived[kept] = true;
    CHECK(tells(&s, "depend on parameters alone"));
    s.plan.is_derived[kept] = false;
    s.function.piece_ends[0]--;
    CHECK(tells(&s, "pieces hold all statements"));
    s.function.piece_ends[0]++;
    struct loop loop = {.kind = LOOP_FACTORING, .of.factoring = {.matrix = 9}};
    s.function.loops = &loop;
    s.function.loop_count = 1;
    CHECK(tells(&s, "loops stay within their arrays"));
    expressions_release(&s.own);
}

int main(void) {
    test_late_summand_is_last();
    test_kept_summands();
    test_differences_keep_their_signs();
    test_statements();
    test_parameters_move_to_prepare();
    test_long_functions_are_cut();
    test_independent_loops_run_as_one();
    test_loops_that_wait_run_apart();
    test_opposite_loops_keep_values();
    test_same_element_is_read_in_one_loop();
    test_results_of_elements();
    test_broken_order();
    test_broken_results();
    test_broken_counts();
    return check_summary();
}
