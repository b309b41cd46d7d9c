/*
 * The tangent of the equations of motion: its loops, and its vectors of joints.
 *
 * Input: the motion at given qdd, and the forces of model and rows (tangent.h). Output: n^2 entries that
 * loops compute (plan.h): products of vectors of two coordinates, and products of arrays for forces that
 * depend on the state; or the vectors themselves. Theory, sect. 7.4 to 7.6.
 */
#include "gen/quantities/quantities.h"
#include "refdyn_model.h"
#include "gen/dynamics/dynamics.h"

#include <stddef.h>
#include <string.h>

/* ---- Pairs ---- */

/* One member of a list with `size` bytes for each frame. */
static struct vector *gather(const struct builder *b, const void *list, size_t size, size_t offset) {
    struct vector *member = memory_get(b->d->memory, ((size_t)b->d->frames + 1) * sizeof *member);
    for (int i = 0; i < b->d->frames; i++)
        memcpy(&member[i], (const char *)list + (size_t)i * size + offset, sizeof *member);
    return member;
}

/* A member of the vectors of tangent.h, or of the motion at given qdd. */
static struct vector *pair_member(const struct builder *b, const struct pair_vectors *vectors,
                                  size_t offset) {
    return gather(b, vectors, sizeof *vectors, offset);
}

static struct vector *motion_member(const struct builder *b, size_t offset) {
    return gather(b, b->given->frames, sizeof *b->given->frames, offset);
}

static struct vector_arrays pair_arrays(struct builder *b, const struct pair_vectors *vectors, size_t offset,
                                        const char *name) {
    return pair_loops_add_arrays(&b->arrays, name, pair_member(b, vectors, offset));
}

static struct vector_arrays motion_arrays(struct builder *b, const char *name, size_t offset) {
    return pair_loops_add_arrays(&b->arrays, name, motion_member(b, offset));
}

static struct pair_move moved(struct builder *b, const struct vector *moments, struct vector_arrays force,
                              struct vector_arrays shift, const char *name) {
    struct pair_move move = {.force = force, .shift = shift};
    pair_loops_add_moved(&b->arrays, name, moments, &move);
    return move;
}

/* Arrays of the near and far vectors of tangent.h: theory, sect. 7.4. */
struct near_arrays {
    struct vector_arrays axis, rate, rate2;
};

struct far_arrays {
    struct vector_arrays lever, mass_force, stiffness_force, damping_force; /* lever: near */
    struct pair_move mass, spin, stiffness, damping;
};

static struct far_arrays add_far_arrays(struct builder *b, const struct vector *turned) {
    struct derivation *d = b->d;
    struct pair_vectors *v = tangent_pair_vectors(b->given, derivation_composites(d));
    struct far_arrays a;
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        v[i].stiffness.moment = vector_add(d->g, v[i].stiffness.moment, turned[i]);
    a.lever = pair_arrays(b, v, offsetof(struct pair_vectors, less_gravity_lever), "lever");
    const struct vector_arrays shift = pair_loops_add_arrays(&b->arrays, "shift", b->shifts);
    const struct vector_arrays shift_rate =
        motion_arrays(b, "shift_rate", offsetof(struct given_frame_rates, way_rate));
    a.mass_force = pair_arrays(b, v, offsetof(struct pair_vectors, mass.force), "mass_force");
    a.stiffness_force = pair_arrays(b, v, offsetof(struct pair_vectors, stiffness.force), "stiffness_force");
    a.damping_force = pair_arrays(b, v, offsetof(struct pair_vectors, damping.force), "damping_force");
    a.mass = moved(b, pair_member(b, v, offsetof(struct pair_vectors, mass.moment)), a.mass_force, shift,
                   "mass_moment");
    a.spin =
        moved(b, pair_member(b, v, offsetof(struct pair_vectors, spin)), a.mass_force, shift_rate, "spin");
    a.stiffness = moved(b, pair_member(b, v, offsetof(struct pair_vectors, stiffness.moment)),
                        a.stiffness_force, shift, "stiffness_moment");
    a.damping = moved(b, pair_member(b, v, offsetof(struct pair_vectors, damping.moment)), a.damping_force,
                      shift, "damping_moment");
    return a;
}

/* K_ij = e_j'' . N + 2 e_j' . P + lever_j . A, K_ji = e_j . (stiffness moment of i): theory, sect. 7.4. */
static struct pair_product stiffness_product(const struct near_arrays *near, const struct far_arrays *a,
                                             int array) {
    struct pair_product product = {.array = array};
    pair_loops_add_term(&product.turn.rows, 1, near->rate2, a->mass.moment);
    pair_loops_add_term(&product.turn.rows, 2, near->rate, a->spin.moment);
    pair_loops_add_term(&product.turn.rows, 1, a->lever, a->mass_force);
    pair_loops_add_term(&product.turn.columns, 1, near->axis, a->stiffness.moment);
    pair_loops_add_term(&product.slide.rows, 1, near->rate2, a->mass_force);
    pair_loops_add_term(&product.slide.columns, 1, near->axis, a->stiffness_force);
    return product;
}

/* D_ij = 2 e_j' . N + 2 e_j . P, D_ji = 2 e_j . (damping moment of i): theory, sect. 7.4. */
static struct pair_product damping_product(const struct near_arrays *near, const struct far_arrays *a,
                                           int array) {
    struct pair_product product = {.array = array};
    pair_loops_add_term(&product.turn.rows, 2, near->rate, a->mass.moment);
    pair_loops_add_term(&product.turn.rows, 2, near->axis, a->spin.moment);
    pair_loops_add_term(&product.turn.columns, 2, near->axis, a->damping.moment);
    pair_loops_add_term(&product.slide.rows, 2, near->rate, a->mass_force);
    pair_loops_add_term(&product.slide.columns, 2, near->axis, a->damping_force);
    return product;
}

/* M_ij = M_ji = e_j . N: theory, sect. 7.4. */
static struct pair_product mass_product(const struct near_arrays *near, const struct far_arrays *a,
                                        int array) {
    struct pair_product product = {.array = array, .is_mirrored = true};
    pair_loops_add_term(&product.turn.rows, 1, near->axis, a->mass.moment);
    pair_loops_add_term(&product.slide.rows, 1, near->axis, a->mass_force);
    return product;
}

static void add_inertia_products(struct pairs *pairs, const struct near_arrays *near,
                                 const struct far_arrays *a, const struct targets *targets) {
    const struct pair_move moves[] = {a->mass, a->spin, a->stiffness, a->damping};
    if (targets->by_q != NOTHING)
        pairs->products[pairs->product_count++] = stiffness_product(near, a, targets->by_q);
    if (targets->by_qd != NOTHING)
        pairs->products[pairs->product_count++] = damping_product(near, a, targets->by_qd);
    if (targets->mass != NOTHING)
        pairs->products[pairs->product_count++] = mass_product(near, a, targets->mass);
    memcpy(pairs->moves, moves, sizeof moves);
    for (int i = 0; i < pairs->n; i++)
        if (pairs->moves_on[i])
            pairs->move_count = sizeof moves / sizeof *moves;
}

static void add_inertia_pairs(struct builder *b, const struct turned_applied_forces *turned,
                              const struct targets *targets) {
    const struct near_arrays near = {
        .axis = motion_arrays(b, "axis", offsetof(struct given_frame_rates, axis)),
        .rate = motion_arrays(b, "axis_rate", offsetof(struct given_frame_rates, axis_rate)),
        .rate2 = motion_arrays(b, "axis_rate2", offsetof(struct given_frame_rates, axis_rate2))};
    const struct vector_arrays rows = pair_loops_add_arrays(&b->arrays, "turned_rows", turned->rows);
    const struct far_arrays far = add_far_arrays(b, turned->columns);
    struct pairs *pairs =
        pair_loops_add_pairs(&b->arrays, "pairs of coordinates (7.4): j, and i beyond it, from the tips");
    add_inertia_products(pairs, &near, &far, targets);
    if (targets->mass != NOTHING)
        mass_matrix_add_rotors(b->d, b->f, targets->mass);
    if (targets->by_q != NOTHING)
        pair_loops_add_term(&pairs->products[0].turn.rows, 1, near.axis, rows);
}

void tangent_add_loops(struct builder *b, const struct targets *targets) {
    const struct turned_applied_forces turned = force_derivatives_turned_forces(b, targets->sign);
    force_derivatives_set_coordinate_derivatives(b, targets);
    b->shifts = kinematics_ground_shifts(&b->d->kinematics);
    b->arrays = pair_loops_open(b->d->plan, &b->d->kinematics, b->f, b->shifts);
    if (targets->has_inertia)
        add_inertia_pairs(b, &turned, targets);
    else if (targets->by_q != NOTHING)
        force_derivatives_add_turning_pairs(b, &turned, targets->by_q);
    force_derivatives_add_loops(b, targets);
}

/* ---- As vectors of joints, which runtime/core/linear multiplies and eliminates in O(n) ---- */

/* The vectors of the joints that turn, or of those that slide; zero for the others. */
static struct vector *of_joints(const struct builder *b, bool is_revolute, size_t offset) {
    const struct frame *frames = b->d->kinematics.tree->frames;
    struct vector *list = motion_member(b, offset);
    for (int i = 0; i < b->d->frames; i++)
        if (frames[i].kind != FRAME_JOINT || frames[i].joint.is_revolute != is_revolute)
            list[i] = (struct vector){{0, 0, 0}};
    return list;
}

void tangent_add_joint_vectors(struct builder *b) {
    static const size_t axes[] = {offsetof(struct given_frame_rates, axis),
                                  offsetof(struct given_frame_rates, axis_rate),
                                  offsetof(struct given_frame_rates, axis_rate2)};
    static const char *const names[2][3] = {{"slide_axis", "slide_rate", "slide_rate2"},
                                            {"turn_axis", "turn_rate", "turn_rate2"}};
    struct vector_arrays *all = memory_get(b->d->memory, REFDYN_VECTOR_COUNT * sizeof *all), *at = all;
    for (int is_revolute = 1; is_revolute >= 0; is_revolute--)
        for (int order = 0; order < 3; order++)
            *at++ = pair_loops_add_arrays(&b->arrays, names[is_revolute][order],
                                          of_joints(b, is_revolute, axes[order]));
    const struct turned_applied_forces turned = force_derivatives_turned_forces(b, -1);
    const struct strain_derivatives strains = force_derivatives_strains(b, -1);
    const struct far_arrays a = add_far_arrays(b, turned.columns);
    for (int i = 0; i < b->d->frames; i++)
        strains.damping[i].at[2] = b->d->kinematics.tree->frames[i].joint.rotor;
    const struct vector_arrays inertia[] = {
        a.lever,
        a.mass.shift,
        a.spin.shift,
        a.mass.moment,
        a.mass_force,
        a.spin.moment,
        a.stiffness.moment,
        a.stiffness_force,
        a.damping.moment,
        a.damping_force,
        pair_loops_add_arrays(&b->arrays, "turned_rows", turned.rows),
        pair_loops_add_arrays(&b->arrays, "strain_rows", strains.rows),
        pair_loops_add_arrays(&b->arrays, "strain_columns", strains.columns),
        pair_loops_add_arrays(&b->arrays, "strain_damping", strains.damping)};
    memcpy(at, inertia, sizeof inertia);
    int *places = memory_get(b->d->memory, 3 * REFDYN_VECTOR_COUNT * sizeof *places);
    for (int i = 0; i < 3 * REFDYN_VECTOR_COUNT; i++) {
        const int array = all[i / 3].at[i % 3];
        places[i] = array == NOTHING ? -1 : b->f->arrays[array].offset;
    }
    b->d->plan->vector_places = places;
}

bool tangent_is_planar(const struct builder *b) {
    const struct vector *turns = of_joints(b, true, offsetof(struct given_frame_rates, axis));
    const struct vector *slides = of_joints(b, false, offsetof(struct given_frame_rates, axis));
    for (int axis = 0; axis < 3; axis++) {
        bool is_normal = true;
        for (int i = 0; i < b->d->frames; i++)
            is_normal = is_normal && !turns[i].at[(axis + 1) % 3] && !turns[i].at[(axis + 2) % 3] &&
                        !slides[i].at[axis];
        if (is_normal)
            return true;
    }
    return false;
}
