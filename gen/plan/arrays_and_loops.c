/*
 * The arrays of a function: its results, those that its loops read, and the entries that straight-line code
 * writes into them. The operations of its loops.
 *
 * This file counts the operations of loops, emit_loops.c prints them, interpreter.c runs them. All visit the
 * entries in the same order, so that every rounding is the same.
 *
 * PAIRS computes entries for two coordinates, one of which carries the other. Each coordinate has vectors in
 * ground axes: far ones (wrenches about its own origin) and near ones (motions of its joint). The loop visits
 * each coordinate j from the tips. There the far vectors of all coordinates beyond j refer to the origin of
 * j; the entries are their dot products with the near vectors of j. Then they are moved to the origin of j's
 * parent: moment += shift x force. Moving from joint to joint, instead of through the ground's origin, keeps
 * the digits of short elements. Vectors are stored by position, an order in which all coordinates beyond a
 * joint follow it.
 *
 * SWEEPS computes derivatives of accelerations on chains that begin on the ground. It visits the stages
 * (joints, or three turns at one point) outward. For each coordinate j nearer to the ground it carries the
 * change of acceleration A that the column of j makes, and the acceleration z that a unit force on j makes.
 * A yields the entries of the stage's rows, z those of its columns, as a product with the wrench that the
 * stage passes on. Then the columns of the stage's own joints begin.
 */
#include "gen/plan/plan.h"

#include <assert.h>

/* ---- Arrays ---- */

enum { FEW_ZEROS = 3 }; /* if an array has more zeros, one loop clears it */

bool plan_is_output_copied(const struct array *array, int entry) {
    return !array->symmetric || entry / array->symmetric >= entry % array->symmetric;
}

bool plan_is_struct_result(const struct function *function) {
    return function->array_count > 1 || function->has_blocks;
}

int plan_count_arrays(const struct function *function) {
    return function->array_count + function->local_count;
}

int plan_value_count(const struct function *function) {
    return function->out_count + function->local_out_count;
}

/* Adds an array. The caller counts it among the results or the local arrays. */
static int open_array(struct memory *memory, struct function *function, struct array array) {
    const int index = plan_count_arrays(function);
    function->arrays =
        memory_room(memory, function->arrays, index, &function->array_capacity, sizeof *function->arrays);
    array.offset = plan_value_count(function);
    function->arrays[index] = array;
    return index;
}

int plan_open_result(struct memory *memory, struct function *function, const char *name, const char *about,
                     int count, int columns) {
    const struct array array = {.name = name, .about = about, .count = count, .columns = columns};
    const int index = open_array(memory, function, array);
    function->array_count++;
    function->out_count += count;
    return index;
}

int plan_open_local(struct memory *memory, struct function *function, const char *name, int count,
                    int columns) {
    const struct array array = {.name = name, .about = "", .count = count, .columns = columns};
    const int index = open_array(memory, function, array);
    function->local_count++;
    function->local_out_count += count;
    return index;
}

void plan_set_entry(struct memory *memory, struct function *function, int array, int entry,
                    expression value) {
    struct array *of = &function->arrays[array];
    assert(array < plan_count_arrays(function) && entry >= 0 && entry < of->count);
    if (!value)
        return;
    of->singles =
        memory_room(memory, of->singles, of->single_count, &of->single_capacity, sizeof *of->singles);
    of->singles[of->single_count++] = (struct single){entry, value};
}

void plan_set_entries(struct memory *memory, struct function *function, int array, int first,
                      const expression *values, int count) {
    for (int i = 0; i < count; i++)
        plan_set_entry(memory, function, array, first + i, values[i]);
}

void plan_set_frame(struct memory *memory, const struct tree *tree, struct function *f, int array, int first,
                    int step, int frame, expression value) {
    const int run = tree->frames[frame].run;
    if (run < 0)
        plan_set_entry(memory, f, array, first, value);
    if (run < 0 || !value)
        return;
    f->run_results = memory_room(memory, f->run_results, f->run_result_count, &f->run_result_capacity,
                                 sizeof *f->run_results);
    f->run_results[f->run_result_count++] = (struct run_result){value, array, first, step, run, 0};
}

/* Number of entries that are not mirrored. */
static int copied_count(const struct array *array) {
    return array->symmetric ? array->symmetric * (array->symmetric + 1) / 2 : array->count;
}

bool plan_is_cleared(const struct plan *plan, const struct function *function, int array) {
    int zeros = copied_count(&function->arrays[array]) - function->arrays[array].single_count;
    for (int i = 0; i < function->run_result_count; i++)
        if (function->run_results[i].array == array)
            zeros -= plan->rolled->runs[function->run_results[i].run].count;
    return zeros > FEW_ZEROS;
}

int plan_columns_of(const struct array *array) {
    return array->columns ? array->columns : array->count;
}

static int rows_of(const struct array *array) {
    assert(array->count % plan_columns_of(array) == 0);
    return array->count / plan_columns_of(array);
}

static int products_in(const struct pair_terms *terms) {
    int count = 0;
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++)
            count += has_component(&terms->terms[t], a);
    return count;
}

static int products_in_cross(const struct pair_move *move) {
    int count = 0;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        if (move->moment.at[a] == NOTHING)
            continue;
        count += move->shift.at[b] != NOTHING && move->force.at[c] != NOTHING;
        count += move->shift.at[c] != NOTHING && move->force.at[b] != NOTHING;
    }
    return count;
}

/* A product and an addition for each component; the first addition goes into the entry itself. */
static void count_pairs(const struct pairs *pairs, struct operation_count *count) {
    for (int j = 0; j < pairs->n; j++) {
        const int beyond = pairs->end[j] - j;
        long products = 0;
        for (int p = 0; p < pairs->product_count; p++) {
            const struct pair_product *product = &pairs->products[p];
            const struct pair_entries *entries = pairs->is_revolute[j] ? &product->turn : &product->slide;
            products += (long)beyond * products_in(&entries->rows);
            products += (long)(beyond - 1) * products_in(&entries->columns);
        }
        for (int m = 0; m < pairs->move_count && pairs->moves_on[j]; m++)
            products += (long)beyond * products_in_cross(&pairs->moves[m]);
        count->adds += products;
        count->muls += products;
    }
}

static void count_product(const struct function *f, const struct product *p, struct operation_count *count) {
    const long sum = rows_of(&f->arrays[p->left]);
    const long products = sum * plan_columns_of(&f->arrays[p->left]) * plan_columns_of(&f->arrays[p->right]);
    count->adds += products;
    count->muls += products;
}

/* n^3 / 6 products each for the factor and the update, n divisions. */
static void count_factoring(const struct function *f, const struct factoring *factoring,
                            struct operation_count *count) {
    const long n = plan_columns_of(&f->arrays[factoring->matrix]);
    const long products = n * (n - 1) * (n + 1) / 6;
    count->adds += products;
    count->muls += products + n * (n - 1) / 2;
    count->divs += n;
}

static void count_solving(const struct function *f, const struct solving *solving,
                          struct operation_count *count) {
    const long n = rows_of(&f->arrays[solving->array]), columns = plan_columns_of(&f->arrays[solving->array]);
    count->adds += n * (n - 1) * columns;
    count->muls += n * n * columns;
}

static bool has_kind(const struct sweeps *s, enum stage_kind kind) {
    for (int i = 0; i < s->n; i++)
        if (s->kind[i] == (int)kind)
            return true;
    return false;
}

static bool is_there(const struct vector_arrays *arrays, int axis) {
    return arrays->at[axis] != NOTHING;
}

static const struct vector_arrays *start_of(const struct sweeps *s, int column, bool is_angular) {
    if (column < 0)
        return is_angular ? &s->start_angular : &s->start_linear;
    return is_angular ? &s->columns[column].start_angular : &s->columns[column].start_linear;
}

/* Returns whether component `axis` of a cross product a x b reads both b and component `of` of a. */
static bool crosses(const struct vector_arrays *b, int axis, int of) {
    return axis != of && is_there(b, 3 - axis - of);
}

/* Components that may become nonzero. */
static struct sweep_state set_components(const struct sweeps *s, int column) {
    struct sweep_state state = {.angular = {false}};
    for (int a = 0; a < 3; a++) {
        state.spin[a] = column >= 0 && is_there(&s->columns[column].spin, a);
        state.turned[a] = column >= 0 && is_there(&s->columns[column].turned, a);
        state.angular[a] = has_kind(s, STAGE_BALL) || is_there(start_of(s, column, true), a) ||
                           (has_kind(s, STAGE_TURN) && is_there(&s->turn, a));
    }
    for (int a = 0; a < 3; a++) {
        state.linear[a] =
            is_there(start_of(s, column, false), a) || (has_kind(s, STAGE_SLIDE) && is_there(&s->turn, a));
        for (int of = 0; of < 3; of++)
            state.linear[a] = state.linear[a] || (state.angular[of] && crosses(&s->shift, a, of)) ||
                              (state.spin[of] && crosses(&s->swing, a, of));
    }
    return state;
}

static bool pushes(const struct sweeps *s, bool is_moment, int axis) {
    for (int c = 0; c < s->column_count; c++)
        if (is_there(is_moment ? &s->columns[c].push_moment : &s->columns[c].push_force, axis))
            return true;
    return false;
}

/* Components that are read. */
static struct sweep_state read_components(const struct sweeps *s, int column) {
    struct sweep_state state = {.angular = {false}};
    for (int a = 0; a < 3; a++) {
        state.linear[a] = is_there(&s->hold_force, a) || (column < 0 && pushes(s, false, a));
        state.angular[a] =
            has_kind(s, STAGE_BALL) || is_there(&s->hold_moment, a) || (column < 0 && pushes(s, true, a));
        state.spin[a] = is_there(&s->hold_spin, a);
        state.turned[a] = is_there(&s->hold_turned, a);
    }
    for (int a = 0; a < 3; a++)
        for (int of = 0; of < 3; of++) {
            state.angular[of] = state.angular[of] || (state.linear[a] && crosses(&s->shift, a, of));
            state.spin[of] = state.spin[of] || (state.linear[a] && crosses(&s->swing, a, of));
        }
    return state;
}

struct sweep_state sweeps_state(const struct sweeps *s, int column) {
    struct sweep_state state = set_components(s, column);
    const struct sweep_state read = read_components(s, column);
    for (int a = 0; a < 3; a++) {
        state.angular[a] = state.angular[a] && read.angular[a];
        state.linear[a] = state.linear[a] && read.linear[a];
        state.spin[a] = state.spin[a] && read.spin[a];
        state.turned[a] = state.turned[a] && read.turned[a];
    }
    return state;
}

/* Drops the components that multiply only zeros. Returns whether it has dropped any. */
static bool keep(struct vector_arrays *arrays, const bool is_read[3]) {
    bool dropped = false;
    for (int a = 0; a < 3; a++) {
        dropped = dropped || (is_there(arrays, a) && !is_read[a]);
        arrays->at[a] = is_read[a] ? arrays->at[a] : NOTHING;
    }
    return dropped;
}

static bool drop_once(struct sweeps *s) {
    const struct sweep_state response = sweeps_state(s, -1);
    struct sweep_state any = response; /* of all states */
    bool shift[3] = {false}, swing[3] = {false}, turn[3], dropped = false;
    for (int k = -1; k < s->column_count; k++) {
        const struct sweep_state state = sweeps_state(s, k);
        for (int a = 0; a < 3; a++) {
            any.angular[a] = any.angular[a] || state.angular[a];
            any.linear[a] = any.linear[a] || state.linear[a];
            any.spin[a] = any.spin[a] || state.spin[a];
            any.turned[a] = any.turned[a] || state.turned[a];
            for (int of = 0; of < 3; of++)
                if (of != a && state.linear[a]) {
                    shift[3 - a - of] = shift[3 - a - of] || state.angular[of];
                    swing[3 - a - of] = swing[3 - a - of] || state.spin[of];
                }
        }
        dropped |= keep((struct vector_arrays *)start_of(s, k, true), state.angular);
        dropped |= keep((struct vector_arrays *)start_of(s, k, false), state.linear);
        if (k < 0)
            continue;
        dropped |= keep(&s->columns[k].spin, state.spin);
        dropped |= keep(&s->columns[k].turned, state.turned);
        dropped |= keep(&s->columns[k].push_moment, response.angular);
        dropped |= keep(&s->columns[k].push_force, response.linear);
    }
    for (int a = 0; a < 3; a++)
        turn[a] = has_kind(s, STAGE_BALL) || (has_kind(s, STAGE_TURN) && any.angular[a]) ||
                  (has_kind(s, STAGE_SLIDE) && any.linear[a]);
    dropped |= keep(&s->turn, turn);
    dropped |= keep(&s->hold_moment, any.angular);
    dropped |= keep(&s->hold_force, any.linear);
    dropped |= keep(&s->hold_spin, any.spin);
    dropped |= keep(&s->hold_turned, any.turned);
    dropped |= keep(&s->shift, shift);
    dropped |= keep(&s->swing, swing);
    return dropped;
}

void sweeps_drop_unread(struct sweeps *s) {
    bool moves = false;
    for (int i = 0; i < s->n; i++)
        moves = moves || s->moves_on[i];
    for (int a = 0; a < 3 && !moves; a++)
        s->shift.at[a] = s->swing.at[a] = NOTHING;
    while (drop_once(s))
        continue;
}

static int met(const bool state[3], const struct vector_arrays *arrays) {
    int count = 0;
    for (int a = 0; a < 3; a++)
        count += state[a] && is_there(arrays, a);
    return count;
}

static int crossed(const bool to[3], const bool state[3], const struct vector_arrays *arrays) {
    int count = 0;
    for (int a = 0; a < 3; a++)
        for (int of = 0; of < 3; of++)
            count += to[a] && state[of] && crosses(arrays, a, of);
    return count;
}

/* Products of one state at the stage of position i; in a sum each product comes with an addition. */
static int products_of_state(const struct sweeps *s, const struct sweep_state *state, int i) {
    const int force = met(state->linear, &s->hold_force),
              changes = met(state->spin, &s->hold_spin) + met(state->turned, &s->hold_turned);
    const int moved = s->moves_on[i] ? crossed(state->linear, state->angular, &s->shift) +
                                           crossed(state->linear, state->spin, &s->swing)
                                     : 0;
    if (s->kind[i] == STAGE_BALL)
        return moved + 3 * (force + changes);
    return moved + force + changes + met(state->angular, &s->hold_moment) +
           met(s->kind[i] == STAGE_TURN ? state->angular : state->linear, &s->turn);
}

static void count_sweeps(const struct sweeps *s, struct operation_count *count) {
    const struct sweep_state response = sweeps_state(s, -1);
    for (int i = 0; i < s->n; i += sweeps_joints_at(s, i)) {
        const long before = i - s->root[i], joints = sweeps_joints_at(s, i);
        long products = products_of_state(s, &response, i), more = 0;
        for (int c = 0; c < s->column_count; c++) {
            const struct sweep_column *column = &s->columns[c];
            const struct sweep_state state = sweeps_state(s, c);
            products += products_of_state(s, &state, i);
            products += joints * (met(response.angular, &column->push_moment) +
                                  met(response.linear, &column->push_force));
            if (s->kind[i] == STAGE_BALL) { /* x = turn . change of A */
                products += joints * met(state.angular, &s->turn);
                more += joints;
            }
        }
        count->adds += before * (products + more);
        count->muls += before * products;
    }
}

void loops_count_operations(const struct function *function, const struct loop *loop,
                            struct operation_count *count) {
    switch (loop->kind) {
    case LOOP_PAIRS:
        count_pairs(&loop->of.pairs, count);
        return;
    case LOOP_PRODUCT:
        count_product(function, &loop->of.product, count);
        return;
    case LOOP_FACTORING:
        count_factoring(function, &loop->of.factoring, count);
        return;
    case LOOP_SOLVING:
        count_solving(function, &loop->of.solving, count);
        return;
    case LOOP_SWEEPS:
        count_sweeps(&loop->of.sweeps, count);
    }
}

static void list_vectors(struct array_list *list, struct vector_arrays *vectors) {
    for (int a = 0; a < 3; a++)
        list->arrays[list->count++] = &vectors->at[a];
}

static void list_terms(struct array_list *list, struct pair_terms *terms) {
    for (int t = 0; t < terms->count; t++) {
        list_vectors(list, &terms->terms[t].near);
        list_vectors(list, &terms->terms[t].far);
    }
}

static void list_pairs(struct array_list *list, struct pairs *pairs) {
    for (int p = 0; p < pairs->product_count; p++) {
        struct pair_product *product = &pairs->products[p];
        list->arrays[list->count++] = &product->array;
        list_terms(list, &product->turn.rows);
        list_terms(list, &product->turn.columns);
        list_terms(list, &product->slide.rows);
        list_terms(list, &product->slide.columns);
    }
    for (int m = 0; m < pairs->move_count; m++) {
        list_vectors(list, &pairs->moves[m].moment);
        list_vectors(list, &pairs->moves[m].force);
        list_vectors(list, &pairs->moves[m].shift);
    }
}

static void list_sweeps(struct array_list *list, struct sweeps *s) {
    struct vector_arrays *const shared[] = {&s->turn,        &s->shift,         &s->swing,
                                            &s->hold_moment, &s->hold_force,    &s->hold_spin,
                                            &s->hold_turned, &s->start_angular, &s->start_linear};
    for (size_t i = 0; i < sizeof shared / sizeof *shared; i++)
        list_vectors(list, shared[i]);
    for (int c = 0; c < s->column_count; c++) {
        struct sweep_column *column = &s->columns[c];
        struct vector_arrays *const own[] = {&column->spin,          &column->turned,
                                             &column->push_moment,   &column->push_force,
                                             &column->start_angular, &column->start_linear};
        list->arrays[list->count++] = &column->array;
        for (size_t i = 0; i < sizeof own / sizeof *own; i++)
            list_vectors(list, own[i]);
    }
}

struct array_list loops_list_arrays(struct loop *loop) {
    struct product *product = &loop->of.product;
    struct solving *solving = &loop->of.solving;
    struct array_list list = {.count = 0};
    switch (loop->kind) {
    case LOOP_PAIRS:
        list_pairs(&list, &loop->of.pairs);
        return list;
    case LOOP_PRODUCT:
        return (struct array_list){{&product->target, &product->left, &product->right}, 3};
    case LOOP_FACTORING:
        return (struct array_list){{&loop->of.factoring.matrix}, 1};
    case LOOP_SOLVING:
        return (struct array_list){{&solving->matrix, &solving->array}, 2};
    case LOOP_SWEEPS:
        list_sweeps(&list, &loop->of.sweeps);
        return list;
    }
    return list;
}
