/* The forms of PRODUCT, FACTORING and SOLVING (loops.h), loops over whole matrices. */
#include "gen/plan/plan.h"

/* Rows that are added at a time: a sum of one row would wait for its entries in memory. */
enum { ROWS_AT_A_TIME = 4 };

/* Entry (row, column) of an array with that many columns. */
static struct loop_entry entry_of(int array, int columns, struct loop_index row, struct loop_index column) {
    return loop_entry(array, loop_plus(loop_times(row, columns), column));
}

/* ---- Product ---- */

/* target += terms [from, to) of the sum over k, `step` at a time. */
static void lower_terms_of_product(struct loop_form *form, const struct product *product, int from, int to,
                                   int step) {
    const struct array *arrays = form->function->arrays;
    const int height = plan_columns_of(&arrays[product->left]),
              width = plan_columns_of(&arrays[product->right]);
    const struct loop_index i = loop_variable(form, "i"), j = loop_variable(form, "j"),
                            k = loop_variable(form, "k");
    const struct loop_entry target = entry_of(product->target, width, i, j);
    struct loop_sum sum = {.count = 0};
    if (from >= to)
        return;
    struct loop_statement *rows =
        loop_open_for(form, k, loop_number(from), LOOP_LESS, loop_number(to), loop_number(step));
    loop_open_range(form, "i", loop_number(0), loop_number(height));
    loop_open_constants(form);
    loop_open_range(form, "j", loop_number(0), loop_number(width));
    loop_add_entry(&sum, 1, target);
    for (int r = 0; r < step; r++) {
        const struct loop_index row = loop_plus_number(k, r);
        loop_add_product(&sum, 1,
                         loop_constant(form, memory_format(form->memory, "left_%d", r), product->factor,
                                       entry_of(product->left, height, row, i)),
                         entry_of(product->right, width, row, j));
    }
    loop_assign(form, target, LOOP_SET, &sum);
    loop_close(form, rows);
}

void loops_lower_product(struct loop_form *form, const struct product *product) {
    const struct array *left = &form->function->arrays[product->left];
    const int sum = left->count / plan_columns_of(left), rest = sum % ROWS_AT_A_TIME;
    lower_terms_of_product(form, product, 0, sum - rest, ROWS_AT_A_TIME);
    lower_terms_of_product(form, product, sum - rest, sum, rest);
}

/* ---- Factoring ---- */

void loops_lower_factoring(struct loop_form *form, const struct factoring *factoring) {
    const int A = factoring->matrix, n = plan_columns_of(&form->function->arrays[A]);
    const struct loop_index i = loop_variable(form, "i"), j = loop_variable(form, "j"),
                            k = loop_variable(form, "k"), zero = loop_number(0);
    const struct loop_entry pivot = entry_of(A, n, k, k);
    struct loop_sum part = {.count = 0}, product = {.count = 0};
    struct loop_statement *steps =
        loop_open_for(form, k, loop_number(n - 1), LOOP_AT_LEAST, zero, loop_number(-1));
    loop_assign_entry(form, pivot, LOOP_INVERT, pivot);
    struct loop_statement *rows = loop_open_range(form, "i", zero, k);
    loop_add_product(&part, 1, entry_of(A, n, k, i), pivot);
    loop_add_product(&product, -1, loop_declare(form, "part", &part), entry_of(A, n, k, j));
    form->at->last->is_constant = true;
    loop_open_range(form, "j", zero, loop_plus_number(i, 1));
    loop_assign(form, entry_of(A, n, i, j), LOOP_ADD, &product);
    loop_close(form, rows);
    rows = loop_open_range(form, "i", zero, k);
    loop_assign_entry(form, entry_of(A, n, k, i), LOOP_MULTIPLY, pivot);
    loop_close(form, steps);
}

/* ---- Solving ---- */

struct solution {
    struct loop_form *form;
    int b, L, n, width;
    bool is_inward; /* from the last row to the first */
    struct loop_index i, j, k;
    int sum;
};

/* sum -= L b_k for `step` rows at a time, as long as that many remain. */
static void subtract_rows(const struct solution *s, int step) {
    const int sign = s->is_inward ? -1 : 1;
    const struct loop_entry target = loop_entry(s->sum, s->j);
    struct loop_sum sum = {.count = 0};
    struct loop_statement *loop =
        loop_open_for(s->form, s->k, loop_number(0), s->is_inward ? LOOP_GREATER : LOOP_LESS,
                      loop_plus_number(s->i, -sign * (step - 1)), loop_number(sign * step));
    loop->is_declared = false;
    loop_open_range(s->form, "j", loop_number(0), loop_number(s->width));
    loop_add_entry(&sum, 1, target);
    for (int r = 0; r < step; r++) {
        const struct loop_index k = loop_plus_number(s->k, sign * r);
        loop_add_product(&sum, -1,
                         s->is_inward ? entry_of(s->L, s->n, k, s->i) : entry_of(s->L, s->n, s->i, k),
                         entry_of(s->b, s->width, k, s->j));
    }
    loop_assign(s->form, target, LOOP_SET, &sum);
    loop_close(s->form, loop);
}

/* b = L^-T b from the last row, b = L^-1 b from the first one. */
static void lower_substitution(struct solution *s, bool is_inward) {
    struct loop_form *form = s->form;
    const struct loop_index zero = loop_number(0), width = loop_number(s->width);
    const struct loop_entry row = entry_of(s->b, s->width, s->i, s->j);
    s->is_inward = is_inward;
    struct loop_statement *rows =
        is_inward ? loop_open_for(form, s->i, loop_number(s->n - 2), LOOP_AT_LEAST, zero, loop_number(-1))
                  : loop_open_range(form, "i", loop_number(1), loop_number(s->n));
    loop_declare_integer(form, "k", loop_number(is_inward ? s->n - 1 : 0));
    s->sum = loop_declare_array(form, "sum", s->width);
    struct loop_statement *columns = loop_open_range(form, "j", zero, width);
    loop_assign_entry(form, loop_entry(s->sum, s->j), LOOP_SET, row);
    loop_close(form, columns);
    subtract_rows(s, ROWS_AT_A_TIME);
    subtract_rows(s, 1);
    loop_open_range(form, "j", zero, width);
    loop_assign_entry(form, row, LOOP_SET, loop_entry(s->sum, s->j));
    loop_close(form, rows);
}

void loops_lower_solving(struct loop_form *form, const struct solving *solving) {
    const int n = plan_columns_of(&form->function->arrays[solving->matrix]);
    const int width = form->function->arrays[solving->array].count / n;
    struct solution s = {form,
                         solving->array,
                         solving->matrix,
                         n,
                         width,
                         true,
                         loop_variable(form, "i"),
                         loop_variable(form, "j"),
                         loop_variable(form, "k"),
                         0};
    struct loop_sum pivot = {.count = 0};
    lower_substitution(&s, true);
    struct loop_statement *rows = loop_open_range(form, "k", loop_number(0), loop_number(n));
    loop_open_range(form, "j", loop_number(0), loop_number(width));
    loop_add_entry(&pivot, -1, entry_of(s.L, n, s.k, s.k));
    loop_assign(form, entry_of(s.b, width, s.k, s.j), LOOP_MULTIPLY, &pivot);
    loop_close(form, rows);
    lower_substitution(&s, false);
}
