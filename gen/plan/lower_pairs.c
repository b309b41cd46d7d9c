/*
 * The form of PAIRS (loops.h): entries for two coordinates, one of which carries the other.
 *
 * Each coordinate has vectors in ground axes: far ones (wrenches about its own origin) and near ones (motions
 * of its joint). The loop visits each coordinate j from the tips. There the far vectors of all coordinates
 * beyond j refer to the origin of j; the entries are their dot products with the near vectors of j. Then they
 * are moved to the origin of j's parent: moment += shift x force. Moving from joint to joint, instead of
 * through the ground's origin, keeps the digits of short elements. Vectors are stored by position, an order
 * in which all coordinates beyond a joint follow it.
 */
#include "gen/plan/plan.h"

/* Columns of one block, the widest vectors of doubles, and of one strip: whole blocks that fit into the
 * first-level cache. */
enum { BLOCK = 8, STRIP = 6 * BLOCK };

/* ---- How the entries are written ---- */

/* Returns whether an array has entries other than 0, `step`, 2 `step` ...; step 0: any entries. */
static bool has_entries(const struct function *function, int array, int step) {
    const struct array *of = &function->arrays[array];
    for (int i = 0; i < of->single_count; i++)
        if (!step || of->singles[i].entry % step)
            return true;
    for (int i = 0; i < function->run_result_count; i++) {
        const struct run_result *result = &function->run_results[i];
        if (result->array == array && (!step || result->entry % step || result->stride % step))
            return true;
    }
    return false;
}

static bool is_in_order(const struct pairs *pairs) {
    for (int i = 0; i < pairs->n; i++)
        if (pairs->order[i] != i)
            return false;
    return true;
}

static bool is_chain(const struct pairs *pairs) {
    for (int i = 0; i < pairs->n; i++)
        if (pairs->end[i] != pairs->n)
            return false;
    return true;
}

/* Returns whether only this product writes its array, with entries in rows. Dot products then go to their
 * places directly. */
static bool is_direct(const struct function *function, const struct pairs *pairs,
                      const struct pair_product *product) {
    return product->is_mirrored && is_in_order(pairs) && !has_entries(function, product->array, 0);
}

/*
 * Whole rows are written at once, in blocks of one length. Each block but the first may begin before j; the
 * entries that it writes there are written again when those coordinates follow. This applies to a chain whose
 * arrays have no other entries off the diagonal and are written by no earlier loop. M alone is faster entry
 * by entry.
 */
static bool fills_rows(const struct function *function, const struct pairs *pairs) {
    if (!is_in_order(pairs) || !is_chain(pairs) || pairs->n < BLOCK || pairs != &function->loops[0].of.pairs)
        return false;
    bool is_mass_alone = true;
    for (int k = 0; k < pairs->product_count; k++) {
        const struct pair_product *product = &pairs->products[k];
        is_mass_alone = is_mass_alone && product->is_mirrored;
        if (has_entries(function, product->array, product->is_mirrored ? 0 : pairs->n + 1))
            return false;
    }
    return !is_mass_alone;
}

/*
 * Whole rows of long chains are written in strips of columns i, since the entries (i, j) of all columns
 * would exceed the first-level cache. Blocks begin at multiples of their length, where vectors are aligned.
 * Only the last block begins earlier, and computes some entries of its neighbour again.
 */
static bool has_strips(const struct function *function, const struct pairs *pairs) {
    return pairs->n >= 2 * STRIP && fills_rows(function, pairs);
}

enum loops_coverage loops_pairs_coverage(const struct function *function, const struct pairs *pairs,
                                         int array) {
    for (int k = 0; k < pairs->product_count; k++)
        if (pairs->products[k].array == array && is_chain(pairs)) {
            if (is_direct(function, pairs, &pairs->products[k]))
                return LOOPS_SET_ALL;
            if (fills_rows(function, pairs))
                return LOOPS_SET_OTHERS;
        }
    return LOOPS_SET_SOME;
}

static int whole_blocks(int count) {
    return (count + BLOCK - 1) / BLOCK * BLOCK;
}

static bool is_moment(const struct pairs *pairs, int array) {
    for (int m = 0; m < pairs->move_count; m++)
        for (int a = 0; a < 3; a++)
            if (pairs->moves[m].moment.at[a] == array)
                return true;
    return false;
}

int loops_length_of_local(const struct function *function, int array) {
    const int count = function->arrays[array].count;
    for (int l = 0; l < function->loop_count; l++) {
        const struct loop *loop = &function->loops[l];
        if (loop->kind == LOOP_PAIRS && has_strips(function, &loop->of.pairs) &&
            is_moment(&loop->of.pairs, array))
            return whole_blocks(count);
    }
    return count;
}

/* ---- One coordinate j ---- */

/* Arrays of the form for one product: dot products until they go to their entries, and the entry (j, j). */
struct product_sums {
    int rows, columns;
    struct loop_entry own;
};

struct lowering {
    struct loop_form *form;
    const struct pairs *pairs;
    bool is_in_strips, fills_rows;
    struct loop_index i, j, begin, end; /* begin: j, or where the strip begins after j */
    int *far;                           /* by array: a copy of it in strips; NOTHING: it is read itself */
    struct product_sums sums[3];
};

static const char *name_of(const struct lowering *l, const struct pair_product *product) {
    return l->form->function->arrays[product->array].name;
}

/* Entry (row, column) of the array of a product. */
static struct loop_entry entry_of(const struct lowering *l, const struct pair_product *product,
                                  struct loop_index row, struct loop_index column) {
    return loop_entry(product->array, loop_plus(loop_times(row, l->pairs->n), column));
}

/* Entry i of an array of far coordinates. */
static struct loop_entry far_entry(const struct lowering *l, int array) {
    return loop_entry(l->is_in_strips && l->far[array] != NOTHING ? l->far[array] : array, l->i);
}

static struct loop_index by_position(const struct lowering *l, const char *name, const int *values,
                                     struct loop_index of) {
    return loop_look_up(l->form, name, values, l->pairs->n, of);
}

static void declare_sums(struct lowering *l) {
    struct memory *memory = l->form->memory;
    const int n = l->pairs->n;
    for (int k = 0; k < l->pairs->product_count; k++) {
        const struct pair_product *product = &l->pairs->products[k];
        const char *name = name_of(l, product);
        struct product_sums *sums = &l->sums[k];
        if (l->fills_rows ? product->is_mirrored : is_direct(l->form->function, l->pairs, product))
            continue;
        sums->rows = loop_declare_array(l->form, memory_format(memory, "%s_rows", name), n);
        if (product->is_mirrored)
            continue;
        if (!l->fills_rows) {
            sums->columns = loop_declare_array(l->form, memory_format(memory, "%s_columns", name), n);
            continue;
        }
        struct loop_sum own = {.count = 0};
        loop_add_entry(&own, 1, entry_of(l, product, l->j, l->j));
        sums->own = loop_declare(l->form, memory_format(memory, "%s_own", name), &own);
    }
}

/* target = near of j . far of i */
static void lower_dot(const struct lowering *l, const struct pair_terms *terms, const char *title,
                      struct loop_entry target) {
    struct loop_sum sum = {.count = 0};
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++) {
            const struct pair_term *term = &terms->terms[t];
            if (!has_component(term, a))
                continue;
            const char *name = memory_format(l->form->memory, "%s_%d%c", title, t + 1, "xyz"[a]);
            loop_add_product(&sum, 1,
                             loop_constant(l->form, name, term->factor, loop_entry(term->near.at[a], l->j)),
                             far_entry(l, term->far.at[a]));
        }
    loop_assign(l->form, target, LOOP_SET, &sum);
}

static void lower_products(const struct lowering *l, bool turns) {
    struct memory *memory = l->form->memory;
    for (int k = 0; k < l->pairs->product_count; k++) {
        const struct pair_product *product = &l->pairs->products[k];
        const struct pair_entries *entries = turns ? &product->turn : &product->slide;
        const struct loop_entry in_place = entry_of(l, product, l->j, l->i);
        const bool is_in_place = is_direct(l->form->function, l->pairs, product);
        lower_dot(l, &entries->rows, memory_format(memory, "%s_rows", name_of(l, product)),
                  is_in_place ? in_place : loop_entry(l->sums[k].rows, l->i));
        if (product->is_mirrored)
            continue;
        lower_dot(l, &entries->columns, memory_format(memory, "%s_columns", name_of(l, product)),
                  l->fills_rows ? in_place : loop_entry(l->sums[k].columns, l->i));
        l->form->at->last->is_unread_at_first = true;
    }
}

static struct loop_statement *open_far(const struct lowering *l, struct loop_index from,
                                       enum loop_blocks blocks) {
    struct loop_statement *loop = loop_open_range(l->form, "i", from, l->end);
    loop->blocks = blocks;
    loop->block = BLOCK;
    loop->limit = l->pairs->n;
    return loop;
}

static void lower_dots(const struct lowering *l, bool turns) {
    loop_open_constants(l->form);
    struct loop_statement *loop = open_far(l, l->begin,
                                           l->is_in_strips ? BLOCKS_WITHIN
                                           : l->fills_rows ? BLOCKS_DOWN
                                                           : NO_BLOCKS);
    lower_products(l, turns);
    loop_close(l->form, loop);
}

static void lower_row_stores(const struct lowering *l) {
    for (int k = 0; k < l->pairs->product_count; k++) {
        if (l->pairs->products[k].is_mirrored)
            continue;
        struct loop_statement *condition = loop_open_if(l->form, l->begin, LOOP_EQUAL, l->j);
        loop_assign_entry(l->form, loop_entry(l->sums[k].rows, l->j), LOOP_ADD, l->sums[k].own);
        loop_close(l->form, condition);
    }
    struct loop_statement *loop = open_far(l, l->begin, NO_BLOCKS);
    for (int k = 0; k < l->pairs->product_count; k++) {
        const struct pair_product *product = &l->pairs->products[k];
        loop_assign_entry(l->form, entry_of(l, product, l->i, l->j), LOOP_SET,
                          product->is_mirrored ? entry_of(l, product, l->j, l->i)
                                               : loop_entry(l->sums[k].rows, l->i));
    }
    loop_close(l->form, loop);
}

static void lower_stores(const struct lowering *l) {
    const struct loop_index row = by_position(l, "order", l->pairs->order, l->i),
                            column = by_position(l, "order", l->pairs->order, l->j);
    for (int k = 0; k < l->pairs->product_count; k++) {
        const struct pair_product *product = &l->pairs->products[k];
        const int rows = l->sums[k].rows, columns = product->is_mirrored ? rows : l->sums[k].columns;
        if (is_direct(l->form->function, l->pairs, product))
            continue;
        struct loop_statement *loop = open_far(l, l->j, NO_BLOCKS);
        loop_assign_entry(l->form, entry_of(l, product, row, column), LOOP_ADD, loop_entry(rows, l->i));
        loop_close(l->form, loop);
        loop = open_far(l, loop_plus_number(l->j, 1), NO_BLOCKS);
        loop_assign_entry(l->form, entry_of(l, product, column, row), LOOP_ADD, loop_entry(columns, l->i));
        loop_close(l->form, loop);
    }
}

/* moment += shift x force */
static void lower_move(const struct lowering *l, const struct pair_move *move) {
    for (int a = 0; a < 3; a++) {
        struct loop_sum sum = {.count = 0};
        for (int sign = 1; sign >= -1; sign -= 2) {
            const int shift = move->shift.at[(a + (sign > 0 ? 1 : 2)) % 3],
                      force = move->force.at[(a + (sign > 0 ? 2 : 1)) % 3];
            if (shift != NOTHING && force != NOTHING)
                loop_add_product(&sum, sign, loop_entry(shift, l->j), far_entry(l, force));
        }
        if (move->moment.at[a] != NOTHING && sum.count)
            loop_assign(l->form, far_entry(l, move->moment.at[a]), LOOP_ADD, &sum);
    }
}

static void lower_moves(const struct lowering *l) {
    if (!l->pairs->move_count)
        return;
    struct loop_statement *condition = loop_open_if(
        l->form, by_position(l, "moves_on", l->pairs->moves_on, l->j), LOOP_EQUAL, loop_number(1));
    open_far(l, l->begin, l->is_in_strips ? BLOCKS_UP : NO_BLOCKS);
    for (int m = 0; m < l->pairs->move_count; m++)
        lower_move(l, &l->pairs->moves[m]);
    loop_close(l->form, condition);
}

static void lower_coordinate(struct lowering *l) {
    declare_sums(l);
    struct loop_statement *condition = loop_open_if(
        l->form, by_position(l, "is_turn", l->pairs->is_revolute, l->j), LOOP_EQUAL, loop_number(1));
    lower_dots(l, true);
    loop_open_else(l->form, condition);
    lower_dots(l, false);
    loop_close(l->form, condition);
    if (l->fills_rows)
        lower_row_stores(l);
    else
        lower_stores(l);
    lower_moves(l);
}

/* ---- The loop ---- */

/* Copies the other triangle of arrays that were written directly, row by row: column by column it would
 * take longer than all products. */
static void lower_mirrors(const struct lowering *l) {
    for (int k = 0; k < l->pairs->product_count; k++) {
        const struct pair_product *product = &l->pairs->products[k];
        if (l->fills_rows || !is_direct(l->form->function, l->pairs, product))
            continue;
        struct loop_statement *rows = loop_open_range(l->form, "i", loop_number(1), loop_number(l->pairs->n));
        loop_open_range(l->form, "j", loop_number(0), l->i);
        loop_assign_entry(l->form, entry_of(l, product, l->i, l->j), LOOP_SET,
                          entry_of(l, product, l->j, l->i));
        loop_close(l->form, rows);
    }
}

static void lower_columns(struct lowering *l) {
    const int n = l->pairs->n;
    struct loop_statement *loop =
        loop_open_for(l->form, l->j, loop_number(n - 1), LOOP_AT_LEAST, loop_number(0), loop_number(-1));
    l->begin = l->j;
    l->end = loop_name_integer(l->form, "end", by_position(l, "ends", l->pairs->end, l->j));
    lower_coordinate(l);
    loop_close(l->form, loop);
    lower_mirrors(l);
}

/* array[i] = 0 for i in [from, to) */
static void lower_zeros(const struct lowering *l, int array, int from, int to) {
    const struct loop_sum zero = {.count = 0};
    if (from == to)
        return;
    struct loop_statement *loop = loop_open_range(l->form, "i", loop_number(from), loop_number(to));
    loop_assign(l->form, loop_entry(array, l->i), LOOP_SET, &zero);
    loop_close(l->form, loop);
}

/* Moments are moved in whole blocks, so the entries after the last coordinate must be 0. Forces are 0 until j
 * reaches their coordinate. */
static void lower_copies(struct lowering *l) {
    const struct pairs *pairs = l->pairs;
    const struct function *function = l->form->function;
    const int n = pairs->n, count = plan_count_arrays(function);
    l->far = memory_get(l->form->memory, ((size_t)count + 1) * sizeof *l->far);
    for (int f = 0; f < count; f++) {
        l->far[f] = NOTHING;
        for (int m = 0; m < 3 * pairs->move_count && l->far[f] == NOTHING; m++)
            if (pairs->moves[m / 3].force.at[m % 3] == f)
                l->far[f] = loop_declare_array(
                    l->form, memory_format(l->form->memory, "far_%s", function->arrays[f].name),
                    whole_blocks(n));
        if (l->far[f] != NOTHING)
            lower_zeros(l, l->far[f], 0, whole_blocks(n));
        if (is_moment(pairs, f))
            lower_zeros(l, f, n, whole_blocks(n));
    }
}

static void lower_strips(struct lowering *l) {
    const int n = l->pairs->n, strips = n / STRIP, count = plan_count_arrays(l->form->function);
    const struct loop_index strip = loop_variable(l->form, "strip"), zero = loop_number(0);
    int *ends = memory_get(l->form->memory, (size_t)strips * sizeof *ends);
    for (int s = 0; s < strips; s++)
        ends[s] = s + 1 < strips ? (s + 1) * STRIP : n;
    lower_copies(l);
    struct loop_statement *loop =
        loop_open_for(l->form, strip, loop_number(strips - 1), LOOP_AT_LEAST, zero, loop_number(-1));
    l->end = loop_name_integer(l->form, "end", loop_look_up(l->form, "strip_ends", ends, strips, strip));
    loop_open_for(l->form, l->j, loop_plus_number(l->end, -1), LOOP_AT_LEAST, zero, loop_number(-1));
    l->begin = loop_declare_integer(l->form, "begin", l->j);
    struct loop_statement *before = loop_open_if(l->form, l->begin, LOOP_LESS, loop_times(strip, STRIP));
    loop_set_integer(l->form, l->begin, loop_times(strip, STRIP));
    loop_close(l->form, before);
    struct loop_statement *own = loop_open_if(l->form, l->begin, LOOP_EQUAL, l->j);
    for (int f = 0; f < count; f++)
        if (l->far[f] != NOTHING)
            loop_assign_entry(l->form, loop_entry(l->far[f], l->j), LOOP_SET, loop_entry(f, l->j));
    loop_close(l->form, own);
    lower_coordinate(l);
    loop_close(l->form, loop);
}

void loops_lower_pairs(struct loop_form *form, const struct pairs *pairs, bool is_in_strips) {
    struct lowering l = {.form = form, .pairs = pairs};
    l.is_in_strips = is_in_strips && has_strips(form->function, pairs);
    l.fills_rows = fills_rows(form->function, pairs);
    l.i = loop_variable(form, "i");
    l.j = loop_variable(form, "j");
    if (l.is_in_strips)
        lower_strips(&l);
    else
        lower_columns(&l);
}
