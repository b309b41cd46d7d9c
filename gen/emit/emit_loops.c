/* The C text of the loops of a plan (plan.h): loops over local arrays and results. */
#include "gen/emit/emit.h"

#include <stdlib.h>

struct printer {
    struct emission *x;
    struct text *text;
    const struct function *function;
    const char *local; /* precedes the names of local arrays */
    bool *is_copied;   /* by array: a loop in strips reads far_ARRAY instead; NULL: no strips */
};

static const char *name(const struct printer *p, int array) {
    return emit_array_text(p->x, p->function, array, p->local);
}

/* The name of an array whose entries i belong to the far coordinates of pairs. */
static const char *far_name(const struct printer *p, int array) {
    if (!p->is_copied || !p->is_copied[array])
        return name(p, array);
    return memory_format(p->x->plan->memory, "far_%s", p->function->arrays[array].name);
}

static void put_flags(const struct printer *p, const char *title, const bool *flags, int count) {
    int *values = memory_get(p->x->plan->memory, ((size_t)count + 1) * sizeof *values);
    for (int i = 0; i < count; i++)
        values[i] = flags[i];
    emit_local_table(p->text, "unsigned char", title, values, count);
}

static bool all(const bool *flags, int count, bool value) {
    for (int i = 0; i < count; i++)
        if (flags[i] != value)
            return false;
    return true;
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

static void put_tables(const struct printer *p, const struct pairs *pairs) {
    if (!is_in_order(pairs))
        emit_local_table(p->text, "int", "order", pairs->order, pairs->n);
    if (!is_chain(pairs))
        emit_local_table(p->text, "int", "ends", pairs->end, pairs->n);
    if (!all(pairs->is_revolute, pairs->n, true) && !all(pairs->is_revolute, pairs->n, false))
        put_flags(p, "is_turn", pairs->is_revolute, pairs->n);
    if (pairs->move_count && !all(pairs->moves_on, pairs->n, false))
        put_flags(p, "moves_on", pairs->moves_on, pairs->n);
}

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

/* Returns whether only this product writes its array, with entries in rows. Dot products then go to their
 * places directly. */
static bool is_direct(const struct function *function, const struct pairs *pairs,
                      const struct pair_product *product) {
    return product->is_mirrored && is_in_order(pairs) && !has_entries(function, product->array, 0);
}

bool emit_is_written_by_loops(const struct function *function, int array) {
    for (int l = 0; l < function->loop_count; l++) {
        const struct pairs *pairs = &function->loops[l].of.pairs;
        for (int i = 0; function->loops[l].kind == LOOP_PAIRS && i < pairs->product_count; i++)
            if (pairs->products[i].array == array && is_chain(pairs) &&
                is_direct(function, pairs, &pairs->products[i]))
                return true;
    }
    return false;
}

/* Columns of one block, the widest vectors of doubles, and of one strip: whole blocks that fit into the
 * first-level cache. */
enum { BLOCK = 8, STRIP = 6 * BLOCK };

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

bool emit_is_written_to_diagonal(const struct function *function, int array) {
    for (int l = 0; l < function->loop_count; l++) {
        const struct pairs *pairs = &function->loops[l].of.pairs;
        for (int i = 0; function->loops[l].kind == LOOP_PAIRS && i < pairs->product_count; i++)
            if (pairs->products[i].array == array && fills_rows(function, pairs))
                return true;
    }
    return emit_is_swept(function, array);
}

/*
 * Whole rows of long chains are written in strips of columns i, since the entries (i, j) of all columns
 * would exceed the first-level cache. Blocks begin at multiples of their length, where vectors are aligned.
 * Only the last block begins earlier, and computes some entries of its neighbour again.
 */
static bool is_in_strips(const struct emission *x, const struct function *function,
                         const struct pairs *pairs) {
    return !x->is_lanes && pairs->n >= 2 * STRIP && fills_rows(function, pairs);
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

int emit_length_of_local(const struct emission *x, const struct function *function, int array) {
    const int count = function->arrays[array].count;
    for (int l = 0; l < function->loop_count; l++) {
        const struct loop *loop = &function->loops[l];
        if (loop->kind == LOOP_PAIRS && is_in_strips(x, function, &loop->of.pairs) &&
            is_moment(&loop->of.pairs, array))
            return whole_blocks(count);
    }
    return count;
}

/* Sums of the rows, and the diagonal. */
static void put_row_sums(const struct printer *p, const struct pairs *pairs) {
    const char *number = p->x->number;
    for (int i = 0; i < pairs->product_count; i++) {
        const struct pair_product *product = &pairs->products[i];
        const char *array = p->function->arrays[product->array].name;
        if (product->is_mirrored)
            continue;
        text_add(p->text, "            %s %s_rows[%d];\n", number, array, pairs->n);
        text_add(p->text, "            const %s %s_own = %s[j * %d];\n", number, array,
                 name(p, product->array), pairs->n + 1);
    }
}

static void put_row_stores(const struct printer *p, const struct pairs *pairs) {
    for (int k = 0; k < pairs->product_count; k++) {
        const char *array = p->function->arrays[pairs->products[k].array].name;
        if (!pairs->products[k].is_mirrored)
            text_add(p->text, "            %s%s_rows[j] += %s_own;\n", p->is_copied ? "if (begin == j) " : "",
                     array, array);
    }
    text_add(p->text, "            for (int i = %s; i < end; i++) {\n", p->is_copied ? "begin" : "j");
    for (int k = 0; k < pairs->product_count; k++) {
        const struct pair_product *product = &pairs->products[k];
        const char *place = name(p, product->array);
        text_add(p->text, "                %s[i * %d + j] = ", place, pairs->n);
        if (product->is_mirrored)
            text_add(p->text, "%s[j * %d + i];\n", place, pairs->n);
        else
            text_add(p->text, "%s_rows[i];\n", p->function->arrays[product->array].name);
    }
    text_add(p->text, "            }\n");
}

/* Declares the place of the dot products of one product until they are added to their entries. */
static void put_sums(const struct printer *p, const struct pairs *pairs) {
    for (int i = 0; i < pairs->product_count; i++) {
        const struct pair_product *product = &pairs->products[i];
        const char *array = p->function->arrays[product->array].name;
        if (is_direct(p->function, pairs, product))
            continue;
        text_add(p->text, "            %s %s_rows[%d]", p->x->number, array, pairs->n);
        text_add(p->text, product->is_mirrored ? ";\n" : ", %s_columns[%d];\n", array, pairs->n);
    }
}

static void put_near(const struct printer *p, const struct pair_terms *terms, const char *title) {
    char digits[32];
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++) {
            const struct pair_term *term = &terms->terms[t];
            if (!has_component(term, a))
                continue;
            text_add(p->text, "                const %s %s_%d%c = ", p->x->number, title, t + 1, "xyz"[a]);
            if (term->factor != 1)
                text_add(p->text, "%s * ", text_of_number(term->factor, digits));
            text_add(p->text, "%s[j];\n", name(p, term->near.at[a]));
        }
}

static void put_dot(const struct printer *p, const struct pair_terms *terms, const char *title,
                    const char *target) {
    int count = 0;
    text_add(p->text, "                    %s =", target);
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++) {
            if (!has_component(&terms->terms[t], a))
                continue;
            if (count)
                text_add(p->text, " +%s", count % 3 ? "" : "\n                       ");
            text_add(p->text, " %s_%d%c * %s[i]", title, t + 1, "xyz"[a],
                     far_name(p, terms->terms[t].far.at[a]));
            count++;
        }
    text_add(p->text, "%s%s;\n", count ? "" : " ", count ? "" : emit_zero(p->x));
}

static void put_near_vectors(const struct printer *p, const struct pairs *pairs, bool turns) {
    for (int i = 0; i < pairs->product_count; i++) {
        const struct pair_product *product = &pairs->products[i];
        const struct pair_entries *entries = turns ? &product->turn : &product->slide;
        const char *array = p->function->arrays[product->array].name;
        put_near(p, &entries->rows, memory_format(p->x->plan->memory, "%s_rows", array));
        if (!product->is_mirrored)
            put_near(p, &entries->columns, memory_format(p->x->plan->memory, "%s_columns", array));
    }
}

static void put_products(const struct printer *p, const struct pairs *pairs, bool turns) {
    struct memory *memory = p->x->plan->memory;
    for (int i = 0; i < pairs->product_count; i++) {
        const struct pair_product *product = &pairs->products[i];
        const struct pair_entries *entries = turns ? &product->turn : &product->slide;
        const char *array = p->function->arrays[product->array].name;
        const char *rows = memory_format(memory, "%s_rows", array);
        const char *columns = memory_format(memory, "%s_columns", array);
        const char *in_place = memory_format(memory, "%s[j * %d + i]", name(p, product->array), pairs->n);
        put_dot(p, &entries->rows, rows,
                is_direct(p->function, pairs, product) ? in_place : memory_format(memory, "%s[i]", rows));
        if (!product->is_mirrored)
            put_dot(p, &entries->columns, columns,
                    fills_rows(p->function, pairs) ? in_place : memory_format(memory, "%s[i]", columns));
    }
}

/* Blocks are for numbers that compilers turn into vectors; lanes are vectors already. There is always a
 * complete block: only in this form does a compiler that looks for uninitialised values see that all are
 * set. */
static void put_dots(const struct printer *p, const struct pairs *pairs, bool turns) {
    put_near_vectors(p, pairs, turns);
    if (p->is_copied) {
        text_add(p->text, "                int block = begin / %d * %d;\n                do {\n", BLOCK,
                 BLOCK);
        text_add(p->text, "                    const int first = block < %d ? block : %d;\n",
                 pairs->n - BLOCK, pairs->n - BLOCK);
        text_add(p->text, "                    for (int i = first; i < first + %d; i++) {\n", BLOCK);
        put_products(p, pairs, turns);
        text_add(p->text, "                    }\n                    block += %d;\n", BLOCK);
        text_add(p->text, "                } while (block < end);\n");
        return;
    }
    if (fills_rows(p->function, pairs) && !p->x->is_lanes) {
        text_add(p->text, "                int top = end;\n                do {\n");
        text_add(p->text, "                    const int first = top > %d ? top - %d : 0;\n", BLOCK, BLOCK);
        text_add(p->text, "                    for (int i = first; i < first + %d; i++) {\n", BLOCK);
        put_products(p, pairs, turns);
        text_add(p->text, "                    }\n                    top -= %d;\n", BLOCK);
        text_add(p->text, "                } while (top > j);\n");
        return;
    }
    text_add(p->text, "                for (int i = j; i < end; i++) {\n");
    put_products(p, pairs, turns);
    text_add(p->text, "                }\n");
}

static void put_stores(const struct printer *p, const struct pairs *pairs) {
    const bool ordered = is_in_order(pairs);
    const char *i = ordered ? "i" : "order[i]", *j = ordered ? "j" : "order[j]";
    const int n = pairs->n;
    for (int k = 0; k < pairs->product_count; k++) {
        const struct pair_product *product = &pairs->products[k];
        const char *array = p->function->arrays[product->array].name, *place = name(p, product->array);
        if (is_direct(p->function, pairs, product))
            continue;
        text_add(p->text, "            for (int i = j; i < end; i++)\n");
        text_add(p->text, "                %s[%s * %d + %s] += %s_rows[i];\n", place, i, n, j, array);
        text_add(p->text, "            for (int i = j + 1; i < end; i++)\n");
        text_add(p->text, "                %s[%s * %d + %s] += %s_%s[i];\n", place, j, n, i, array,
                 product->is_mirrored ? "rows" : "columns");
    }
}

/* Copies the other triangle of arrays that were written directly, row by row: column by column it would
 * take longer than all products. */
static void put_mirrors(const struct printer *p, const struct pairs *pairs) {
    const int n = pairs->n;
    for (int k = 0; k < pairs->product_count; k++) {
        const char *place = name(p, pairs->products[k].array);
        if (!is_direct(p->function, pairs, &pairs->products[k]))
            continue;
        text_add(p->text, "        for (int i = 1; i < %d; i++)\n            for (int j = 0; j < i; j++)\n",
                 n);
        text_add(p->text, "                %s[i * %d + j] = %s[j * %d + i];\n", place, n, place, n);
    }
}

static void put_factors(const struct printer *p, int shift, int force) {
    text_add(p->text, "%s[j] * %s[i]", name(p, shift), far_name(p, force));
}

static void put_move(const struct printer *p, const struct pair_move *move) {
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const bool plus = move->shift.at[b] != NOTHING && move->force.at[c] != NOTHING;
        const bool minus = move->shift.at[c] != NOTHING && move->force.at[b] != NOTHING;
        if (move->moment.at[a] == NOTHING || (!plus && !minus))
            continue;
        text_add(p->text, "                    %s[i] %s= ", far_name(p, move->moment.at[a]),
                 plus ? "+" : "-");
        if (plus)
            put_factors(p, move->shift.at[b], move->force.at[c]);
        text_add(p->text, plus && minus ? " - " : "");
        if (minus)
            put_factors(p, move->shift.at[c], move->force.at[b]);
        text_add(p->text, ";\n");
    }
}

static void put_moves(const struct printer *p, const struct pairs *pairs) {
    if (!pairs->move_count || all(pairs->moves_on, pairs->n, false))
        return;
    text_add(p->text, "            if (moves_on[j])\n");
    if (p->is_copied)
        text_add(p->text,
                 "                for (int block = begin / %d * %d; block < end; block += %d)\n"
                 "                for (int i = block; i < block + %d; i++) {\n",
                 BLOCK, BLOCK, BLOCK, BLOCK);
    else
        text_add(p->text, "                for (int i = j; i < end; i++) {\n");
    for (int m = 0; m < pairs->move_count; m++)
        put_move(p, &pairs->moves[m]);
    text_add(p->text, "                }\n");
}

/* Marks the arrays of forces whose moments move with j. */
static bool *forces_of_moves(const struct printer *p, const struct pairs *pairs) {
    const size_t count = (size_t)plan_count_arrays(p->function) + 1;
    bool *is_force = memory_get(p->x->plan->memory, count * sizeof *is_force);
    for (int m = 0; m < pairs->move_count; m++)
        for (int a = 0; a < 3; a++)
            if (pairs->moves[m].force.at[a] != NOTHING)
                is_force[pairs->moves[m].force.at[a]] = true;
    return is_force;
}

static void put_columns(const struct printer *p, const struct pairs *pairs) {
    text_add(p->text, "        for (int j = %d; j >= 0; j--) {\n", pairs->n - 1);
    if (is_chain(pairs))
        text_add(p->text, "            const int end = %d;\n", pairs->n);
    else
        text_add(p->text, "            const int end = ends[j];\n");
}

/* Moments are moved in whole blocks, so the entries after the last coordinate must be 0. */
static void put_last_block(const struct printer *p, const struct pairs *pairs) {
    const int n = pairs->n, end = whole_blocks(n), count = plan_count_arrays(p->function);
    if (end == n)
        return;
    text_add(p->text, "        for (int i = %d; i < %d; i++)\n           ", n, end);
    for (int f = 0, printed = 0; f < count; f++)
        if (is_moment(pairs, f))
            text_add(p->text, "%s%s[i] =", printed++ % 4 || printed == 1 ? " " : "\n                ",
                     name(p, f));
    text_add(p->text, " 0.0;\n");
}

/* Starts the loops over strips and over j. Forces are 0 until j reaches their coordinate, so that whole
 * blocks of moments can move. */
static void put_strips(const struct printer *p, const struct pairs *pairs) {
    const int n = pairs->n, top = (n / STRIP - 1) * STRIP, count = plan_count_arrays(p->function);
    if (pairs->move_count)
        put_last_block(p, pairs);
    for (int f = 0; f < count; f++)
        if (p->is_copied[f])
            text_add(p->text, "        %s %s[%d] = {0};\n", p->x->number, far_name(p, f), whole_blocks(n));
    text_add(p->text, "        for (int low = %d; low >= 0; low -= %d) /* strips of columns [low, end) */\n",
             top, STRIP);
    text_add(p->text, "        for (int j = low < %d ? low + %d : %d; j >= 0; j--) {\n", top, STRIP - 1,
             n - 1);
    text_add(p->text, "            const int begin = j > low ? j : low, end = low < %d ? low + %d : %d;\n",
             top, STRIP, n);
    if (pairs->move_count)
        text_add(p->text,
                 "            if (begin == j) { /* forces of coordinate j join those beyond it */\n");
    for (int f = 0; f < count; f++)
        if (p->is_copied[f])
            text_add(p->text, "                %s[j] = %s[j];\n", far_name(p, f), name(p, f));
    if (pairs->move_count)
        text_add(p->text, "            }\n");
}

static void put_pairs(const struct printer *whole, const struct pairs *pairs) {
    struct printer printer = *whole;
    const struct printer *p = &printer;
    if (is_in_strips(whole->x, whole->function, pairs))
        printer.is_copied = forces_of_moves(whole, pairs);
    const bool turns = all(pairs->is_revolute, pairs->n, true),
               slides = all(pairs->is_revolute, pairs->n, false);
    put_tables(p, pairs);
    if (p->is_copied)
        put_strips(p, pairs);
    else
        put_columns(p, pairs);
    if (fills_rows(p->function, pairs))
        put_row_sums(p, pairs);
    else
        put_sums(p, pairs);
    text_add(p->text, "            %s{\n", turns || slides ? "" : "if (is_turn[j]) ");
    put_dots(p, pairs, !slides);
    text_add(p->text, "            }\n");
    if (!turns && !slides) {
        text_add(p->text, "            else {\n");
        put_dots(p, pairs, false);
        text_add(p->text, "            }\n");
    }
    if (fills_rows(p->function, pairs))
        put_row_stores(p, pairs);
    else
        put_stores(p, pairs);
    put_moves(p, pairs);
    text_add(p->text, "        }\n");
    if (!fills_rows(p->function, pairs))
        put_mirrors(p, pairs);
}

/* Rows that are added at a time: a sum of one row would wait for its entries in memory. */
enum { ROWS_AT_A_TIME = 4 };

/* "k" or "(k + 1)" */
static const char *index_text(const struct printer *p, const char *index, int offset) {
    if (!offset)
        return index;
    return memory_format(p->x->plan->memory, "(%s %c %d)", index, offset < 0 ? '-' : '+', abs(offset));
}

/* target += terms [from, to) of the sum over k, `step` at a time. */
static void put_terms_of_product(const struct printer *p, const struct product *product, int from, int to,
                                 int step) {
    const struct array *arrays = p->function->arrays;
    const int height = plan_columns_of(&arrays[product->left]),
              width = plan_columns_of(&arrays[product->right]);
    const char *target = memory_format(p->x->plan->memory, "%s[i * %d + j]", name(p, product->target), width);
    char digits[32];
    if (from >= to)
        return;
    text_add(p->text, "        for (int k = %d; k < %d; k += %d)\n", from, to, step);
    text_add(p->text, "            for (int i = 0; i < %d; i++) {\n", height);
    for (int r = 0; r < step; r++)
        text_add(p->text, "                const %s left_%d = %s * %s[%s * %d + i];\n", p->x->number, r,
                 text_of_number(product->factor, digits), name(p, product->left), index_text(p, "k", r),
                 height);
    text_add(p->text, "                for (int j = 0; j < %d; j++)\n                    %s = %s", width,
             target, target);
    for (int r = 0; r < step; r++)
        text_add(p->text, "%s + left_%d * %s[%s * %d + j]", r % 2 ? "\n                       " : "", r,
                 name(p, product->right), index_text(p, "k", r), width);
    text_add(p->text, ";\n            }\n");
}

static void put_product(const struct printer *p, const struct product *product) {
    const struct array *left = &p->function->arrays[product->left];
    const int sum = left->count / plan_columns_of(left), rest = sum % ROWS_AT_A_TIME;
    put_terms_of_product(p, product, 0, sum - rest, ROWS_AT_A_TIME);
    put_terms_of_product(p, product, sum - rest, sum, rest);
}

static void put_factoring(const struct printer *p, const struct factoring *factoring) {
    const int n = plan_columns_of(&p->function->arrays[factoring->matrix]);
    const char *A = name(p, factoring->matrix);
    text_add(p->text, "        for (int k = %d; k >= 0; k--) {\n", n - 1);
    text_add(p->text, "            %s[k * %d + k] = 1.0 / %s[k * %d + k];\n", A, n, A, n);
    text_add(p->text, "            for (int i = 0; i < k; i++) {\n");
    text_add(p->text, "                const %s part = %s[k * %d + i] * %s[k * %d + k];\n", p->x->number, A,
             n, A, n);
    text_add(p->text, "                for (int j = 0; j <= i; j++)\n");
    text_add(p->text, "                    %s[i * %d + j] -= part * %s[k * %d + j];\n            }\n", A, n,
             A, n);
    text_add(p->text, "            for (int i = 0; i < k; i++)\n");
    text_add(p->text, "                %s[k * %d + i] *= %s[k * %d + k];\n        }\n", A, n, A, n);
}

/* Row i of one sweep: of the completed rows k, from the last one or the first one on. */
struct sweep {
    const char *b, *L;
    int n, width;
    bool inward;
};

/* sum -= L b_k for `step` rows at a time, as long as that many remain. */
static void put_rows_of_sweep(const struct printer *p, const struct sweep *s, int step) {
    const char *before = s->inward ? "k > i" : "k < i", sign = s->inward ? '-' : '+';
    text_add(p->text, "            for (; %s", before);
    if (step > 1)
        text_add(p->text, " %c %d", s->inward ? '+' : '-', step - 1);
    text_add(p->text, "; k %c= %d)", sign, step);
    text_add(p->text, "\n                for (int j = 0; j < %d; j++)\n", s->width);
    text_add(p->text, "                    sum[j] = sum[j]");
    for (int r = 0; r < step; r++) {
        const char *k = index_text(p, "k", s->inward ? -r : r);
        const char *entry = s->inward ? memory_format(p->x->plan->memory, "%s * %d + i", k, s->n)
                                      : memory_format(p->x->plan->memory, "i * %d + %s", s->n, k);
        text_add(p->text, "%s - %s[%s] * %s[%s * %d + j]", r % 2 ? "\n                       " : "", s->L,
                 entry, s->b, k, s->width);
    }
    text_add(p->text, ";\n");
}

/* b = L^-T b from the last row, b = L^-1 b from the first one. */
static void put_sweep(const struct printer *p, const struct solving *solving, int n, bool inward) {
    const int width = p->function->arrays[solving->array].count / n;
    const struct sweep s = {name(p, solving->array), name(p, solving->matrix), n, width, inward};
    if (inward)
        text_add(p->text, "        for (int i = %d; i >= 0; i--) {\n            int k = %d;\n", n - 2, n - 1);
    else
        text_add(p->text, "        for (int i = 1; i < %d; i++) {\n            int k = 0;\n", n);
    text_add(p->text, "            %s sum[%d];\n", p->x->number, width);
    text_add(p->text, "            for (int j = 0; j < %d; j++)\n", width);
    text_add(p->text, "                sum[j] = %s[i * %d + j];\n", s.b, width);
    put_rows_of_sweep(p, &s, ROWS_AT_A_TIME);
    put_rows_of_sweep(p, &s, 1);
    text_add(p->text, "            for (int j = 0; j < %d; j++)\n", width);
    text_add(p->text, "                %s[i * %d + j] = sum[j];\n        }\n", s.b, width);
}

static void put_solving(const struct printer *p, const struct solving *solving) {
    const int n = plan_columns_of(&p->function->arrays[solving->matrix]);
    const int width = p->function->arrays[solving->array].count / n;
    const char *b = name(p, solving->array);
    put_sweep(p, solving, n, true);
    text_add(p->text, "        for (int k = 0; k < %d; k++)\n            for (int j = 0; j < %d; j++)\n", n,
             width);
    text_add(p->text, "                %s[k * %d + j] *= -%s[k * %d + k];\n", b, width,
             name(p, solving->matrix), n);
    put_sweep(p, solving, n, false);
}

static void put_loop(const struct printer *p, const struct loop *loop) {
    text_add(p->text, "    { /* %s */\n", loop->about);
    switch (loop->kind) {
    case LOOP_PAIRS:
        put_pairs(p, &loop->of.pairs);
        break;
    case LOOP_PRODUCT:
        put_product(p, &loop->of.product);
        break;
    case LOOP_FACTORING:
        put_factoring(p, &loop->of.factoring);
        break;
    case LOOP_SOLVING:
        put_solving(p, &loop->of.solving);
        break;
    case LOOP_SWEEPS:
        emit_sweeps(p->x, p->text, p->function, p->local, &loop->of.sweeps);
        break;
    }
    text_add(p->text, "    }\n");
}

void emit_loops(struct emission *x, struct text *text, const struct function *function, const char *local) {
    const struct printer p = {x, text, function, local, NULL};
    for (int i = 0; i < function->loop_count; i++)
        put_loop(&p, &function->loops[i]);
}
