/*
 * Derivatives of forces (applied_forces of force_and_inertia_vectors.h) by q and qd, as loops over arrays
 * (loops.h) and entries: theory, sect. 7.3.
 *
 * Input: applied forces, and the motion at given accelerations. Adds to a function: entries of springs,
 * dampers and forces on coordinates; products of arrays for forces at points that depend on the state;
 * vectors for the loop over pairs, in which joints turn the columns of C.
 */
#ifndef REFDYN_GEN_FORCE_DERIVATIVES_H
#define REFDYN_GEN_FORCE_DERIVATIVES_H

#include "quantities/pair_loops.h"
#include "quantities/quantities.h"

/* Arrays of a function to which derivatives are added, by number; NOTHING: left out. */
struct targets {
    int by_q, by_qd, mass;
    bool has_inertia;
    double sign; /* of the applied_forces: -1 where they stand on the other side */
};

struct builder {
    struct derivation *d;
    struct function *f;
    struct given_motion *given;
    const struct applied_forces *applied_forces;
    struct pair_arrays arrays;
    const struct vector *shifts; /* by frame, ground axes */
};

/*
 * Joint j turns the columns of i beyond it: entry (i, j) gains e_j . rows_i, entry (j, i) gains e_j .
 * columns_i. With the force F at C_i and the torque T on e_i, (e_j x C_i) . F = e_j . (C_i x F); the axis of
 * a torque is turned by nearer joints alone, so e_i x T stands in rows only. Theory, sect. 7.3.
 */
struct turned_applied_forces {
    struct vector *rows, *columns;
};

/* factor * values, by frame. */
expression *force_derivatives_scaled(struct derivation *d, double factor, const expression *by_frame);
struct turned_applied_forces force_derivatives_turned_forces(const struct builder *b, double sign);
/* The loop of these alone, once b->arrays are open. */
void force_derivatives_add_turning_pairs(struct builder *b, const struct turned_applied_forces *turned,
                                         int array);
/* Springs, dampers and forces on coordinates. */
void force_derivatives_set_coordinate_derivatives(struct builder *b, const struct targets *targets);
/* Of `tangent_vectors`: springs, dampers and forces that depend on their own coordinate alone, by coordinate,
 * and the arrays of what couples coordinates, count x n each; returns the count. */
void force_derivatives_set_own_derivatives(struct builder *b, double sign, int stiffness, int damping);
/* What turns that share strains have beside those diagonals, by frame: REFDYN_STRAIN_ROWS and those behind it
 * in refdyn_model.h. */
struct strain_derivatives {
    struct vector *rows, *columns, *damping;
};
struct strain_derivatives force_derivatives_strains(const struct builder *b, double sign);
int force_derivatives_add_couplings(struct builder *b, double sign);
/* Forces and torques at points: behind all arrays of the result. */
void force_derivatives_add_loops(struct builder *b, const struct targets *targets);
void force_derivatives_add_product(struct builder *b, int target, int left, int right, double factor,
                                   const char *about);

#endif
