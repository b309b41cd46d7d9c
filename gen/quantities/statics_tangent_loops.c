/*
 * The tangent of statics as loops: dQ_i/dq_j at qd = 0 into an array of a function.
 *
 * Takes the composites and the forces of the model at rest. Gravity does to the mass moment beyond a joint
 * what a force does to a column of C: joint j turns its change Delta_i, so the far vectors are Delta_i x grav
 * (theory, sect. 7.8). For trees with runs, and wherever the written-out form is longer.
 */
#include "gen/quantities/quantities.h"

/* Delta_i, the force slot of W_i, times gravity. */
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

void statics_tangent_loops_add(struct derivation *d, struct function *f, int array) {
    const struct kinematics *k = &d->kinematics;
    const struct targets targets = {.by_q = array, .by_qd = NOTHING, .mass = NOTHING, .sign = 1};
    struct applied_forces *applied_forces = tangent_no_forces(k);
    struct builder b = {.d = d, .f = f, .given = given_motion_at_rest(k), .applied_forces = applied_forces};
    tangent_add_applied_forces(k, applied_forces);
    derivation_composites(d);
    graph_remark(d->g, "dQ/dq at qd = 0: how joints turn loads and weights (7.8)");
    const struct turned_applied_forces turned = force_derivatives_turned_forces(&b, targets.sign);
    add_weights(d, &turned);
    force_derivatives_set_coordinate_derivatives(&b, &targets);
    b.arrays = pair_loops_open(d->plan, k, f, NULL);
    force_derivatives_add_turning_pairs(&b, &turned, array);
    force_derivatives_add_loops(&b, &targets);
}
