/*
 * Derivatives of applied forces (tangent.h) by q and qd, as entries and as loops over arrays (plan.h):
 * theory, sect. 7.3.
 *
 * Input: applied forces, and the motion at given accelerations. Adds to a function: entries of springs,
 * dampers and forces on coordinates; products of arrays for forces at points that depend on the state;
 * vectors for the loop over pairs, in which joints turn the columns of C.
 *
 * Joint j turns the columns of i beyond it: entry (i, j) gains e_j . rows_i, entry (j, i) gains e_j .
 * columns_i. With the force F at C_i and the torque T on e_i, (e_j x C_i) . F = e_j . (C_i x F). Only nearer
 * joints turn the axis of a torque, so that e_i x T appears in rows only.
 */
#include "gen/quantities/quantities.h"
#include "gen/dynamics/dynamics.h"

#include <string.h>

/* ---- Constant forces while the columns of C turn ---- */

static struct vector *new_vectors(const struct derivation *d, int count) {
    return memory_get(d->memory, ((size_t)count + 1) * sizeof(struct vector));
}

/* sign * force, with symbols replaced by the motion. */
static struct vector felt(const struct builder *b, double sign, struct vector force) {
    const expression factor = expr_number(b->d->g, sign);
    return vector_scale(b->d->g, factor, given_motion_place_vector(b->given, force));
}

/* columns_i = sum of C_i x F, rows_i = columns_i + sum of e_i x T: theory, sect. 7.3. */
struct turned_applied_forces force_derivatives_turned_forces(const struct builder *b, double sign) {
    const struct derivation *d = b->d;
    const struct kinematics *k = &d->kinematics;
    struct graph *g = d->g;
    const int markers = d->model->marker_count;
    struct turned_applied_forces turned = {new_vectors(d, d->frames), new_vectors(d, d->frames)};
    struct vector *forces = new_vectors(d, markers), *torques = new_vectors(d, markers);
    for (int p = 0; p < markers; p++) {
        forces[p] = felt(b, sign, b->applied_forces->points[p]);
        torques[p] = felt(b, sign, b->applied_forces->torques[p]);
    }
    for (int i = -1; recursion_next_joint(g, k->tree, &i);) {
        struct vector *rows = &turned.rows[i], *columns = &turned.columns[i];
        for (int p = 0; p < markers; p++) {
            if (!kinematics_is_on_path(k, i, k->tree->points[p].frame))
                continue;
            *columns = vector_add(g, *columns, vector_cross(g, k->points[p].columns[i], forces[p]));
            if (k->tree->frames[i].joint.is_revolute)
                *rows = vector_add(g, *rows, vector_cross(g, kinematics_joint_axis(k, i), torques[p]));
        }
        *rows = vector_add(g, *columns, *rows);
    }
    return turned;
}

static const struct vector *joint_axes(const struct derivation *d) {
    struct vector *axes = new_vectors(d, d->frames);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        axes[i] = kinematics_joint_axis(&d->kinematics, i);
    return axes;
}

static bool has_vector(const struct vector *by_frame, int frames) {
    for (int i = 0; i < frames; i++)
        if (!vector_is_zero(by_frame[i]))
            return true;
    return false;
}

void force_derivatives_add_turning_pairs(struct builder *b, const struct turned_applied_forces *turned,
                                         int array) {
    const int frames = b->d->frames;
    struct pair_product product = {.array = array};
    if (!has_vector(turned->rows, frames) && !has_vector(turned->columns, frames))
        return;
    product.is_mirrored = !memcmp(turned->rows, turned->columns, (size_t)frames * sizeof *turned->rows);
    const struct vector_arrays axis = pair_loops_add_arrays(&b->arrays, "axis", joint_axes(b->d));
    pair_loops_add_term(&product.turn.rows, 1, axis,
                        pair_loops_add_arrays(&b->arrays, "turned_rows", turned->rows));
    if (!product.is_mirrored)
        pair_loops_add_term(&product.turn.columns, 1, axis,
                            pair_loops_add_arrays(&b->arrays, "turned_columns", turned->columns));
    struct pairs *pairs =
        pair_loops_add_pairs(&b->arrays, "pairs of coordinates (7.3): j turns the forces on i beyond it");
    pairs->products[pairs->product_count++] = product;
}

/* ---- Forces on coordinates ---- */

expression *force_derivatives_scaled(struct derivation *d, double factor, const expression *by_frame) {
    const expression number = expr_number(d->g, factor);
    expression *scaled = derivation_new_values(d, d->frames);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        scaled[i] = expr_mul(d->g, number, by_frame[i]);
    return scaled;
}

/* Derivatives of the spring and damper of frame i, times `sign`: by the three turns that share strains,
 * from frame `first` on, or by i alone. */
struct own_derivatives {
    int first, count;
    expression at[3];
};

static struct own_derivatives own_derivatives_of(const struct builder *b, int i, int order, double sign) {
    const struct kinematics *k = &b->d->kinematics;
    const struct joint *joint = &k->tree->frames[i].joint;
    const expression factor = expr_number(k->g, sign);
    struct own_derivatives own = {.first = i, .count = 1};
    if (!b->applied_forces->has_springs)
        return own;
    if (!k->tree->frames[i].has_strains) {
        own.at[0] = expr_mul(k->g, expr_neg(k->g, factor), order ? joint->damping : joint->stiffness);
        return own;
    }
    own = (struct own_derivatives){.first = element_strains_first(k, i), .count = 3};
    element_strains_derivatives(k, i, order, b->given->is_resting, own.at);
    for (int turn = 0; turn < 3; turn++)
        own.at[turn] = expr_mul(k->g, factor, own.at[turn]);
    return own;
}

/* Sets the row of frame i: with a named force on it, or of its spring and damper alone. */
static void give_derivatives_of(struct builder *b, int i, int order, double sign, int array) {
    struct derivation *d = b->d;
    const struct tree *tree = d->kinematics.tree;
    const struct frame *frame = &tree->frames[i];
    const expression force = b->applied_forces->coordinates[i];
    const struct own_derivatives own = own_derivatives_of(b, i, order, sign);
    if (!force) {
        for (int j = 0; j < own.count; j++)
            plan_set_frame(d->memory, tree, b->f, array,
                           frame->coordinate * d->n + tree->frames[own.first + j].coordinate,
                           frame->step * (d->n + 1), i, own.at[j]);
        return;
    }
    expression *row = force_derivatives_scaled(d, sign, given_motion_derivatives(b->given, force, order));
    for (int j = 0; j < own.count; j++)
        row[own.first + j] = expr_add(d->g, row[own.first + j], own.at[j]);
    derivation_spread(d, b->f, array, frame->coordinate * d->n, 1, row);
}

void force_derivatives_set_coordinate_derivatives(struct builder *b, const struct targets *targets) {
    const struct tree *tree = b->d->kinematics.tree;
    const int arrays[] = {targets->by_q, targets->by_qd};
    for (int order = 0; order < 2; order++)
        for (int i = -1; arrays[order] != NOTHING && recursion_next_joint(b->d->g, tree, &i);)
            give_derivatives_of(b, i, order, targets->sign, arrays[order]);
}

/* ---- Forces at points that depend on the state: C^T dF/dq, theory, sect. 7.3 ---- */

/* One axis of C, and the derivatives of the force along it, by frame. */
struct derivative {
    const expression *column, *by[2]; /* by q, by qd */
};

struct derivatives {
    struct derivative *list;
    int count, capacity;
};

static void append(const struct builder *b, struct derivatives *derivatives, struct derivative derivative) {
    derivatives->list = memory_room(b->d->memory, derivatives->list, derivatives->count,
                                    &derivatives->capacity, sizeof derivative);
    derivatives->list[derivatives->count++] = derivative;
}

static bool is_all_zero(const expression *values, int count) {
    for (int i = 0; i < count; i++)
        if (values[i])
            return false;
    return true;
}

/* One axis of the columns of a point, or of the turns of a body. */
struct column_axis {
    int point, axis;
    bool is_torque;
};

static const expression *column_along(struct derivation *d, const struct column_axis *of) {
    const struct kinematics *k = &d->kinematics;
    expression *column = derivation_new_values(d, d->frames);
    for (int i = -1; recursion_next_joint(d->g, k->tree, &i);)
        if (!of->is_torque)
            column[i] = k->points[of->point].columns[i].at[of->axis];
        else if (k->tree->frames[i].joint.is_revolute &&
                 kinematics_is_on_path(k, i, k->tree->points[of->point].frame))
            column[i] = kinematics_joint_axis(k, i).at[of->axis];
    return column;
}

static void add_derivative(struct builder *b, const struct targets *targets, struct derivatives *derivatives,
                           struct column_axis of) {
    const expression force =
        (of.is_torque ? b->applied_forces->torques : b->applied_forces->points)[of.point].at[of.axis];
    const int arrays[] = {targets->by_q, targets->by_qd};
    struct derivative derivative = {.by = {NULL}};
    if (!force)
        return;
    for (int order = 0; order < 2; order++)
        derivative.by[order] = arrays[order] == NOTHING ? derivation_new_values(b->d, b->d->frames)
                                                        : given_motion_derivatives(b->given, force, order);
    if (is_all_zero(derivative.by[0], b->d->frames) && is_all_zero(derivative.by[1], b->d->frames))
        return;
    derivative.column = column_along(b->d, &of);
    append(b, derivatives, derivative);
}

static struct derivatives derivatives_of_points(struct builder *b, const struct targets *targets) {
    struct derivatives derivatives = {0};
    for (int p = 0; p < b->d->model->marker_count; p++)
        for (int axis = 0; axis < 3; axis++)
            for (int is_torque = 0; is_torque < 2; is_torque++)
                add_derivative(b, targets, &derivatives, (struct column_axis){p, axis, is_torque});
    return derivatives;
}

/* order -1: the columns. */
static const expression *values_of(const struct derivative *derivative, int order) {
    return order < 0 ? derivative->column : derivative->by[order];
}

static int add_derivative_array(struct builder *b, const struct derivatives *derivatives, const char *name,
                                int order) {
    const int n = b->d->n;
    const int array = pair_loops_add_local(b->d->memory, b->f, name, derivatives->count * n, n);
    for (int s = 0; s < derivatives->count; s++)
        derivation_spread(b->d, b->f, array, s * n, 1, values_of(&derivatives->list[s], order));
    return array;
}

void force_derivatives_add_product(struct builder *b, int target, int left, int right, double factor,
                                   const char *about) {
    pair_loops_add_loop(b->d->memory, b->f, LOOP_PRODUCT, about)->of.product =
        (struct product){target, left, right, factor};
}

static bool has_derivative(const struct builder *b, const struct derivatives *derivatives, int order) {
    for (int s = 0; s < derivatives->count; s++)
        if (!is_all_zero(derivatives->list[s].by[order], b->d->frames))
            return true;
    return false;
}

void force_derivatives_add_loops(struct builder *b, const struct targets *targets) {
    static const char *const names[] = {"pull_by_q", "pull_by_qd"};
    static const char *const about[] = {"forces at points that depend on q",
                                        "forces at points that depend on qd"};
    const struct derivatives derivatives = derivatives_of_points(b, targets);
    const int arrays[] = {targets->by_q, targets->by_qd};
    const int left = derivatives.count ? add_derivative_array(b, &derivatives, "pulled", -1) : NOTHING;
    for (int order = 0; order < 2; order++)
        if (has_derivative(b, &derivatives, order))
            force_derivatives_add_product(b, arrays[order], left,
                                          add_derivative_array(b, &derivatives, names[order], order),
                                          targets->sign, about[order]);
}

/* ---- Forces in `tangent_vectors` and in derivatives of accelerations ---- */

static bool is_own(const struct builder *b, const expression *derivatives, int i) {
    for (int j = 0; j < b->d->frames; j++)
        if (j != i && derivatives[j])
            return false;
    return true;
}

/* Returns whether the named force on frame i, which is in no run, also depends on other coordinates. */
static bool couples(const struct builder *b, int i) {
    const expression force = b->applied_forces->coordinates[i];
    return force && !(is_own(b, given_motion_derivatives(b->given, force, 0), i) &&
                      is_own(b, given_motion_derivatives(b->given, force, 1), i));
}

/* The derivative of frame i with respect to its own coordinate. It includes the named force unless that
 * couples coordinates. */
static expression diagonal_derivative(const struct builder *b, int i, int order, double sign) {
    struct graph *g = b->d->g;
    const struct own_derivatives own = own_derivatives_of(b, i, order, sign);
    const expression spring = own.at[i - own.first];
    const expression force = b->applied_forces->coordinates[i];
    if (!force || couples(b, i))
        return spring;
    return expr_add(g, expr_mul(g, expr_number(g, sign), given_motion_derivatives(b->given, force, order)[i]),
                    spring);
}

void force_derivatives_set_own_derivatives(struct builder *b, double sign, int stiffness, int damping) {
    const struct tree *tree = b->d->kinematics.tree;
    const int arrays[] = {stiffness, damping};
    for (int order = 0; order < 2; order++)
        for (int i = -1; recursion_next_joint(b->d->g, tree, &i);)
            plan_set_frame(b->d->memory, tree, b->f, arrays[order], tree->frames[i].coordinate,
                           tree->frames[i].step, i, diagonal_derivative(b, i, order, sign));
}

/* Sets the rows and columns of K, D and the third turns, as refdyn_model.h lists them, for turn i:
 * derivatives by the turns before it. */
static void set_strains(const struct builder *b, int i, double sign, struct vector *rows,
                        struct vector *columns, struct vector *damping) {
    const struct frame *frame = &b->d->kinematics.tree->frames[i];
    const struct own_derivatives by_q = own_derivatives_of(b, i, 0, sign),
                                 by_qd = own_derivatives_of(b, i, 1, sign);
    for (int before = 1; before <= frame->turn; before++) {
        rows[i].at[before - 1] = by_q.at[frame->turn - before];
        columns[i].at[before - 1] = own_derivatives_of(b, i - before, 0, sign).at[frame->turn];
        damping[i].at[before - 1] = by_qd.at[frame->turn - before];
    }
    if (frame->turn == 2)
        rows[i].at[2] = EXPR_ONE;
}

struct strain_derivatives force_derivatives_strains(const struct builder *b, double sign) {
    struct strain_derivatives strains = {new_vectors(b->d, b->d->frames), new_vectors(b->d, b->d->frames),
                                         new_vectors(b->d, b->d->frames)};
    for (int i = -1; recursion_next_joint(b->d->g, b->d->kinematics.tree, &i);)
        if (b->d->kinematics.tree->frames[i].has_strains)
            set_strains(b, i, sign, strains.rows, strains.columns, strains.damping);
    return strains;
}

static void add_coupled_coordinates(struct builder *b, struct derivatives *derivatives) {
    for (int i = 0; i < b->d->frames; i++) {
        if (!couples(b, i))
            continue;
        expression *column = derivation_new_values(b->d, b->d->frames);
        column[i] = EXPR_ONE;
        const expression force = b->applied_forces->coordinates[i];
        append(b, derivatives,
               (struct derivative){column,
                                   {given_motion_derivatives(b->given, force, 0),
                                    given_motion_derivatives(b->given, force, 1)}});
    }
}

int force_derivatives_add_couplings(struct builder *b, double sign) {
    static const char *const names[] = {"pulled", "pull_by_q", "pull_by_qd"};
    static const char *const about[] = {"columns on which the coupling forces act",
                                        "derivatives of these forces by q, part of K",
                                        "the same by qd, part of D"};
    struct derivatives derivatives = derivatives_of_points(b, &(struct targets){0, 0, NOTHING, true, sign});
    add_coupled_coordinates(b, &derivatives);
    for (int order = -1; order < 2 && derivatives.count; order++) {
        const int array =
            plan_open_result(b->d->memory, b->f, names[order + 1],
                             memory_format(b->d->memory, "(%d x n) %s", derivatives.count, about[order + 1]),
                             derivatives.count * b->d->n, b->d->n);
        for (int s = 0; s < derivatives.count; s++)
            derivation_spread(
                b->d, b->f, array, s * b->d->n, 1,
                order < 0 ? values_of(&derivatives.list[s], order)
                          : force_derivatives_scaled(b->d, sign, values_of(&derivatives.list[s], order)));
    }
    return derivatives.count;
}

struct vector *force_derivatives_of_stages(const struct builder *b, const int *firsts, int order,
                                           double sign) {
    struct vector *own = new_vectors(b->d, b->d->frames);
    for (int i = -1; recursion_next_joint(b->d->g, b->d->kinematics.tree, &i);) {
        const struct own_derivatives of = own_derivatives_of(b, i, order, sign);
        for (int turn = 0; turn < of.count; turn++)
            own[i].at[of.first + turn - firsts[i]] = of.at[turn];
        own[i].at[i - firsts[i]] = diagonal_derivative(b, i, order, sign);
    }
    return own;
}

void force_derivatives_add_coupled_accelerations(struct builder *b, const struct targets *targets) {
    static const char *const names[] = {"pull_by_q", "pull_by_qd"};
    const struct derivation *d = b->d;
    const int arrays[] = {targets->by_q, targets->by_qd};
    struct derivatives derivatives = derivatives_of_points(b, targets);
    add_coupled_coordinates(b, &derivatives);
    if (!derivatives.count)
        return;
    const int responses = pair_loops_add_local(d->memory, b->f, "pulled", derivatives.count * d->n, d->n);
    for (int s = 0; s < derivatives.count; s++) {
        const struct right_side side = {.f = derivatives.list[s].column};
        derivation_spread(
            b->d, b->f, responses, s * d->n, 1,
            articulated_body_solve(&d->kinematics, accelerations_elimination(b->d), side, NULL));
    }
    for (int order = 0; order < 2; order++)
        if (arrays[order] != NOTHING && has_derivative(b, &derivatives, order))
            force_derivatives_add_product(
                b, arrays[order], responses, add_derivative_array(b, &derivatives, names[order], order), 1,
                order ? "forces that couple coordinates, by qd" : "forces that couple coordinates, by q");
}
