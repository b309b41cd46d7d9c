/*
 * M and dQ/dq as arrays of a function: written out entry by entry, or as loops over pairs of coordinates,
 * whichever counts fewer operations.
 */
#include "gen/quantities/quantities.h"

#include <string.h>

enum {
    LOOP_ADVANTAGE = 2, /* compilers turn loops over pairs into vector instructions, so that this many of
                           their operations count as one */
    WORTH_TEXT = 4      /* written out if that saves a fifth, because it is more text */
};

/* Operations of loops and of the vectors that they read. */
static long weigh_loops(const struct derivation *d, const struct function *f) {
    struct operation_count count = {.quantity = f->quantity};
    for (int i = 0; i < f->loop_count; i++)
        loops_count_operations(f, &f->loops[i], &count);
    return operation_cost_of_results(d, f) + (count.adds + count.muls) / LOOP_ADVANTAGE;
}

/* An n x n matrix in both forms. */
struct chosen_matrix {
    const char *name;
    void (*add_loops)(struct derivation *d, struct function *f, int array);
    const expression *(*write_out)(struct derivation *d); /* for a tree without runs */
};

static enum matrix_form cheaper_form(struct derivation *d, const struct chosen_matrix *matrix) {
    struct function trial = {.quantity = matrix->name};
    const char *name = matrix->name;
    derivation_add_array(d, &trial, name, "", d->n * d->n, d->n);
    matrix->add_loops(d, &trial, 0);
    pair_loops_drop_unread(d->memory, &trial);
    const long loops = weigh_loops(d, &trial);
    if (d->n > MOST_WRITTEN_OUT) {
        operation_cost_note_choice(d, memory_format(d->memory, "%s in loops, %ld", name, loops));
        return FORM_LOOPS;
    }
    const long written =
        operation_cost_of_values(d, matrix->write_out(derivation_without_runs(d)), d->n * d->n);
    if (WORTH_TEXT * loops < (WORTH_TEXT + 1) * written) {
        operation_cost_note_choice(
            d, memory_format(d->memory, "%s in loops, %ld (written out %ld)", name, loops, written));
        return FORM_LOOPS;
    }
    operation_cost_note_choice(
        d, memory_format(d->memory, "%s written out, %ld (loops %ld)", name, written, loops));
    return FORM_WRITTEN;
}

static bool is_symmetric(const expression *matrix, int n) {
    for (int i = 0; i < n * n; i++)
        if (matrix[i] != matrix[i % n * n + i / n])
            return false;
    return true;
}

/* Call it after all other arrays exist: loops and their local arrays follow them. */
static void fill_matrix(struct derivation *d, struct function *f, int array,
                        const struct chosen_matrix *matrix, enum matrix_form *form) {
    if (*form == FORM_OPEN)
        *form = cheaper_form(d, matrix);
    if (*form == FORM_LOOPS) {
        matrix->add_loops(d, f, array);
        pair_loops_drop_unread(d->memory, f);
        return;
    }
    const expression *entries = matrix->write_out(derivation_without_runs(d));
    f->arrays[array].symmetric = is_symmetric(entries, d->n) ? d->n : 0;
    for (int i = 0; i < d->n * d->n; i++)
        if (plan_is_output_copied(&f->arrays[array], i))
            plan_set_entry(d->memory, f, array, i, entries[i]);
}

int mass_matrix_add(struct derivation *d, struct function *f) {
    return derivation_add_array(d, f, "M", "(n x n) mass matrix [kg, kg m, kg m^2]", d->n * d->n, d->n);
}

void mass_matrix_fill(struct derivation *d, struct function *f, int array) {
    static const struct chosen_matrix mass = {"M", mass_matrix_loops_add, derivation_mass_matrix};
    fill_matrix(d, f, array, &mass, &d->mass_form);
}

static const expression *statics_tangent(struct derivation *d) {
    const int n = d->n;
    if (d->statics_tangent)
        return d->statics_tangent;
    d->statics_tangent = derivation_new_values(d, n * n);
    const expression *gravity = dynamics_gravity_tangent(&d->kinematics, derivation_composites(d));
    const expression *forces = forces_tangent(&d->kinematics);
    for (int i = 0; i < n * n; i++)
        d->statics_tangent[i] = expr_sub(d->g, forces[i], gravity[i]);
    return d->statics_tangent;
}

void mass_matrix_fill_statics_tangent(struct derivation *d, struct function *f, int array) {
    static const struct chosen_matrix tangent = {"Q_q", statics_tangent_loops_add, statics_tangent};
    fill_matrix(d, f, array, &tangent, &d->statics_form);
}
