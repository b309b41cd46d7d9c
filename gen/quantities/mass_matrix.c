/*
 * M and dQ/dq as arrays of a function: written out entry by entry, or as loops over pairs of coordinates,
 * whichever counts fewer operations.
 */
#include "gen/quantities/quantities.h"

#include <string.h>

/* ---- The mass matrix in loops ---- */

/*
 * A loop over pairs of coordinates (plan.h): M_ij = e_j . W_i, where W_i is moved from joint to joint toward
 * the ground (theory, sect. 4.6). For trees with runs, and wherever the written-out form
 * (inertia_and_gravity.c) is longer.
 */

struct mass_vectors {
    struct vector *axis, *moment, *force; /* by frame, ground axes */
};

/* e_i and W_i in the ground frame. */
static struct mass_vectors mass_vectors(struct derivation *d) {
    const struct kinematics *k = &d->kinematics;
    const struct inertia *composites = derivation_composites(d);
    const size_t size = ((size_t)d->frames + 1) * sizeof(struct vector);
    const struct mass_vectors x = {memory_get(d->memory, size), memory_get(d->memory, size),
                                   memory_get(d->memory, size)};
    graph_remark(d->g, "e and W = Ic e of each joint, in the ground's axes (4.6)");
    for (int i = -1; recursion_next_joint(d->g, k->tree, &i);) {
        const struct wrench wrench = wrench_of_unit(k, i, &composites[i]);
        x.axis[i] = kinematics_joint_axis(k, i);
        x.moment[i] = matrix_times(k->g, k->frames[i].rotation.at, wrench.moment);
        x.force[i] = matrix_times(k->g, k->frames[i].rotation.at, wrench.force);
    }
    return x;
}

void mass_matrix_add_rotors(struct derivation *d, struct function *f, int array) {
    const struct tree *tree = d->kinematics.tree;
    for (int i = -1; recursion_next_joint(d->g, tree, &i);)
        if (tree->frames[i].joint.rotor)
            plan_set_frame(d->memory, tree, f, array, tree->frames[i].coordinate * (d->n + 1),
                           tree->frames[i].step * (d->n + 1), i, tree->frames[i].joint.rotor);
}

static void mass_matrix_loops_add(struct derivation *d, struct function *f, int array) {
    const struct vector *shifts = kinematics_ground_shifts(&d->kinematics);
    const struct mass_vectors vectors = mass_vectors(d);
    struct pair_arrays p = pair_loops_open(d->plan, &d->kinematics, f, shifts);
    struct pair_product product = {.array = array, .is_mirrored = true};
    const struct vector_arrays axis = pair_loops_add_arrays(&p, "axis", vectors.axis);
    struct pair_move move = {.force = pair_loops_add_arrays(&p, "mass_force", vectors.force),
                             .shift = pair_loops_add_arrays(&p, "shift", shifts)};
    pair_loops_add_moved(&p, "mass_moment", vectors.moment, &move);
    pair_loops_add_term(&product.turn.rows, 1, axis, move.moment);
    pair_loops_add_term(&product.slide.rows, 1, axis, move.force);
    struct pairs *pairs = pair_loops_add_pairs(&p, "M_ij = e_j.W_i (4.6): i beyond j, from the tips");
    pairs->products[pairs->product_count++] = product;
    pairs->moves[pairs->move_count++] = move;
    mass_matrix_add_rotors(d, f, array);
}

/* ---- The tangent of statics ---- */

/*
 * The tangent of statics as loops: dQ_i/dq_j at qd = 0 into an array of a function.
 *
 * Input: the composites and the forces of the model at rest. Gravity acts on the mass moment beyond a joint
 * as a force acts on a column of C: joint j turns its change Delta_i, so that the far vectors are Delta_i x
 * grav (theory, sect. 7.8). For trees with runs and wherever the written-out form is longer.
 */

/* Delta_i, the force part of W_i, times gravity. */
static void add_weights(struct derivation *d, const struct turned_applied_forces *turned) {
    const struct kinematics *k = &d->kinematics;
    struct graph *g = k->g;
    for (int i = -1; recursion_next_joint(g, k->tree, &i);) {
        const struct vector own = wrench_of_unit(k, i, &d->composites[i]).force;
        const struct vector change = matrix_times(g, k->frames[i].rotation.at, own);
        const struct vector felt = vector_cross(g, change, vector_of(k->model->gravity));
        kinematics_name_vector(k, i, "moment_change", change);
        turned->rows[i] = vector_add(g, turned->rows[i], felt);
        turned->columns[i] = vector_add(g, turned->columns[i], felt);
    }
}

static void statics_tangent_loops_add(struct derivation *d, struct function *f, int array) {
    const struct kinematics *k = &d->kinematics;
    const struct targets targets = {.by_q = array, .by_qd = NOTHING, .mass = NOTHING, .sign = 1};
    struct applied_forces *applied_forces = tangent_no_forces(k);
    struct builder b = {.d = d, .f = f, .given = given_motion_at_rest(k), .applied_forces = applied_forces};
    tangent_add_applied_forces(k, applied_forces);
    derivation_composites(d);
    graph_remark(d->g, "dQ/dq at qd = 0: joints turn loads and weights (7.8)");
    const struct turned_applied_forces turned = force_derivatives_turned_forces(&b, targets.sign);
    add_weights(d, &turned);
    force_derivatives_set_coordinate_derivatives(&b, &targets);
    b.arrays = pair_loops_open(d->plan, k, f, NULL);
    force_derivatives_add_turning_pairs(&b, &turned, array);
    force_derivatives_add_loops(&b, &targets);
}

enum { WORTH_TEXT = 4 }; /* written out if that saves a fifth, because it is more text */

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
    const long loops = operation_cost_with_loops(d, &trial);
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
