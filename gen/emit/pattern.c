/*
 * Determines which entries of an array may be nonzero. Input: a planned function and the number of one of its
 * arrays. Result: a flag for each entry. Straight-line code is examined entry by entry. Loops over pairs of
 * coordinates leave an entry zero if neither coordinate carries the other. All other loops are assumed to
 * fill their array.
 */
#include "gen/emit/emit.h"

#include <string.h>

static void mark_entries(bool *is_there, const struct array *array, int entry) {
    const int n = array->symmetric;
    is_there[entry] = true;
    if (n > 0) /* only the lower half is computed */
        is_there[entry % n * n + entry / n] = true;
}

static bool leads_to(const struct tree *tree, int i, int j) {
    while (j > i)
        j = tree->frames[j].parent;
    return i == j;
}

static void mark_pairs(const struct plan *plan, bool *is_there) {
    const int n = plan->tree->count;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            is_there[i * n + j] |= leads_to(plan->tree, i, j) || leads_to(plan->tree, j, i);
}

static bool is_filled(const struct loop *loop, int array) {
    switch (loop->kind) {
    case LOOP_PRODUCT:
        return loop->of.product.target == array;
    case LOOP_FACTORING:
        return loop->of.factoring.matrix == array;
    case LOOP_SOLVING:
        return loop->of.solving.array == array;
    default:
        return false;
    }
}

static void mark_loop(const struct plan *plan, const struct loop *loop, int array, bool *is_there,
                      int count) {
    for (int i = 0; loop->kind == LOOP_PAIRS && i < loop->of.pairs.product_count; i++)
        if (loop->of.pairs.products[i].array == array)
            mark_pairs(plan, is_there);
    if (is_filled(loop, array))
        memset(is_there, true, (size_t)count * sizeof *is_there);
}

static void mark_straight_code(const struct plan *plan, const struct function *function, int number,
                               bool *is_there) {
    const struct array *array = &function->arrays[number];
    for (int i = 0; i < array->single_count; i++)
        mark_entries(is_there, array, array->singles[i].entry);
    for (int i = 0; i < function->run_result_count; i++) {
        const struct run_result *result = &function->run_results[i];
        for (int e = 0; result->array == number && e < plan->rolled->runs[result->run].count; e++)
            mark_entries(is_there, array, result->entry + e * result->stride);
    }
}

static void mark(const struct plan *plan, const struct function *function, int number, bool *is_there) {
    mark_straight_code(plan, function, number, is_there);
    for (int i = 0; i < function->part_count; i++)
        if (function->parts[i].to_array == number)
            mark(plan, function->parts[i].from, function->parts[i].from_array, is_there);
    for (int l = 0; l < function->loop_count; l++)
        mark_loop(plan, &function->loops[l], number, is_there, function->arrays[number].count);
}

const bool *emit_pattern(const struct plan *plan, const struct function *function, int array) {
    bool *is_there = memory_get(plan->memory, (size_t)function->arrays[array].count + 1);
    mark(plan, function, array, is_there);
    return is_there;
}
