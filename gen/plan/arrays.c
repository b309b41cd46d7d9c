/*
 * The arrays of a function: its results, those that its loops read, and the entries that straight-line code
 * writes into them; the places in a loop that refer to arrays. sweeps.c has those of SWEEPS.
 */
#include "gen/plan/plan.h"

#include <assert.h>

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

static void list_terms(struct array_list *list, struct pair_terms *terms) {
    for (int t = 0; t < terms->count; t++) {
        array_list_add_vectors(list, &terms->terms[t].near);
        array_list_add_vectors(list, &terms->terms[t].far);
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
        array_list_add_vectors(list, &pairs->moves[m].moment);
        array_list_add_vectors(list, &pairs->moves[m].force);
        array_list_add_vectors(list, &pairs->moves[m].shift);
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
        sweeps_list_arrays(&list, &loop->of.sweeps);
        return list;
    }
    return list;
}
