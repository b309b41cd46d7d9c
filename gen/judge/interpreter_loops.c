/* Runs the loops of a plan (plan.h) over the values of all arrays, in the order of the emitted loops. */
#include "gen/plan/plan.h"

struct values {
    const struct function *function;
    double *all;
};

static double *start_of(const struct values *v, int array) {
    return v->all + v->function->arrays[array].offset;
}

static double dot(const struct values *v, const struct pair_terms *terms, int i, int j) {
    double sum = 0;
    for (int t = 0; t < terms->count; t++)
        for (int a = 0; a < 3; a++)
            if (has_component(&terms->terms[t], a)) {
                const struct pair_term *term = &terms->terms[t];
                sum += term->factor * start_of(v, term->near.at[a])[j] * start_of(v, term->far.at[a])[i];
            }
    return sum;
}

static void add_pair(const struct values *v, const struct pairs *pairs, const struct pair_product *product,
                     int i, int j) {
    const struct pair_entries *entries = pairs->is_revolute[j] ? &product->turn : &product->slide;
    const int row = pairs->order[i], column = pairs->order[j], n = pairs->n;
    double *array = start_of(v, product->array);
    const double below = dot(v, &entries->rows, i, j);
    array[row * n + column] += below;
    if (i != j)
        array[column * n + row] += product->is_mirrored ? below : dot(v, &entries->columns, i, j);
}

static double entry(const struct values *v, int array, int i) {
    return array == NOTHING ? 0 : start_of(v, array)[i];
}

static void move(const struct values *v, const struct pair_move *move, int i, int j) {
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const double more = entry(v, move->shift.at[b], j) * entry(v, move->force.at[c], i) -
                            entry(v, move->shift.at[c], j) * entry(v, move->force.at[b], i);
        if (move->moment.at[a] != NOTHING)
            start_of(v, move->moment.at[a])[i] += more;
    }
}

static void run_pairs(const struct values *v, const struct pairs *pairs) {
    for (int j = pairs->n - 1; j >= 0; j--)
        for (int i = j; i < pairs->end[j]; i++) {
            for (int p = 0; p < pairs->product_count; p++)
                add_pair(v, pairs, &pairs->products[p], i, j);
            for (int m = 0; m < pairs->move_count && pairs->moves_on[j]; m++)
                move(v, &pairs->moves[m], i, j);
        }
}

static void run_product(const struct values *v, const struct product *p) {
    const struct array *arrays = v->function->arrays;
    const int height = plan_columns_of(&arrays[p->left]), width = plan_columns_of(&arrays[p->right]);
    const int sum = arrays[p->left].count / height;
    for (int k = 0; k < sum; k++)
        for (int i = 0; i < height; i++) {
            const double left = p->factor * start_of(v, p->left)[k * height + i];
            for (int j = 0; j < width; j++)
                start_of(v, p->target)[i * width + j] += left * start_of(v, p->right)[k * width + j];
        }
}

static void run_factoring(const struct values *v, const struct factoring *factoring) {
    const int n = plan_columns_of(&v->function->arrays[factoring->matrix]);
    double *A = start_of(v, factoring->matrix);
    for (int k = n - 1; k >= 0; k--) {
        A[k * n + k] = 1 / A[k * n + k];
        for (int i = 0; i < k; i++) {
            const double part = A[k * n + i] * A[k * n + k];
            for (int j = 0; j <= i; j++)
                A[i * n + j] -= part * A[k * n + j];
        }
        for (int i = 0; i < k; i++)
            A[k * n + i] *= A[k * n + k];
    }
}

static void run_solving(const struct values *v, const struct solving *solving) {
    const int n = plan_columns_of(&v->function->arrays[solving->matrix]);
    const int width = v->function->arrays[solving->array].count / n;
    const double *L = start_of(v, solving->matrix);
    double *b = start_of(v, solving->array);
    for (int k = n - 1; k >= 0; k--)
        for (int i = 0; i < k; i++)
            for (int j = 0; j < width; j++)
                b[i * width + j] -= L[k * n + i] * b[k * width + j];
    for (int k = 0; k < n; k++)
        for (int j = 0; j < width; j++)
            b[k * width + j] *= -L[k * n + k];
    for (int k = 0; k < n; k++)
        for (int i = 0; i < k; i++)
            for (int j = 0; j < width; j++)
                b[k * width + j] -= L[k * n + i] * b[i * width + j];
}

void interpreter_run_loop(const struct function *function, const struct loop *loop, double *values) {
    const struct values v = {function, values};
    switch (loop->kind) {
    case LOOP_PAIRS:
        run_pairs(&v, &loop->of.pairs);
        return;
    case LOOP_PRODUCT:
        run_product(&v, &loop->of.product);
        return;
    case LOOP_FACTORING:
        run_factoring(&v, &loop->of.factoring);
        return;
    case LOOP_SOLVING:
        run_solving(&v, &loop->of.solving);
    }
}
