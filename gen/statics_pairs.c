/*
 * The tangent of statics as loops: dQ_i/dq_j at qd = 0 into a field of a function.
 *
 * Takes the composites and the pulls of the model at rest. Gravity does to the moment of mass beyond a joint
 * what a load does to a column of C: it changes by e_j x (change by q_i), so that far vectors are (change by
 * q_i) x gravity (pull_pairs.h). For trees with runs, and wherever the written-out form is longer.
 */
#include "pull_pairs.h"

struct weight {
    struct derivation *d;
    struct turned_pulls *turned;
};

static void add_weight(void *context, int i) {
    const struct weight *x = context;
    const struct kinematics *k = &x->d->kinematics;
    struct graph *g = k->g;
    const struct vector own = unit_wrench(k, i, &x->d->composites[i]).force;
    const struct vector change = matrix_times(g, k->frames[i].rotation.at, own);
    const struct vector felt = vector_cross(g, change, vector_of(k->model->gravity));
    name_vector(k, i, "moment_change", change);
    x->turned->rows[i] = vector_add(g, x->turned->rows[i], felt);
    x->turned->columns[i] = vector_add(g, x->turned->columns[i], felt);
}

void add_statics_pairs(struct derivation *d, struct function *f, int field) {
    const struct kinematics *k = &d->kinematics;
    const struct targets targets = {.by_q = field, .by_qd = NOTHING, .mass = NOTHING, .sign = 1};
    struct pulls *pulls = no_pulls(k);
    struct builder b = {.d = d, .f = f, .held = hold_still(k), .pulls = pulls};
    add_applied_pulls(k, pulls);
    composites(d);
    remark(d->g, "tangent of statics: how joints turn weights and loads");
    struct turned_pulls turned = derive_turned_pulls(&b, targets.sign);
    struct weight x = {d, &turned};
    visit_joints(d->g, k->tree, add_weight, &x);
    give_coordinate_slopes(&b, &targets);
    b.arrays = open_pairs(d->plan, k, f, NULL);
    add_turning_pairs(&b, &turned, field);
    add_slope_loops(&b, &targets);
}
