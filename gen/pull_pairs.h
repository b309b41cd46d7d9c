/*
 * Derivatives of pulls (tangent.h) by q and qd, as loops over arrays (loops.h) and entries.
 *
 * Takes pulls and the motion that they are felt in, adds to a function: entries of springs, dampers and
 * forces on coordinates; products of arrays for forces at points that depend on the state; vectors for the
 * loop over pairs, in which joints turn the columns of C on which the pulls act.
 */
#ifndef REFDYN_GEN_PULL_PAIRS_H
#define REFDYN_GEN_PULL_PAIRS_H

#include "pairs.h"
#include "quantities.h"

/* What becomes of derivatives in one function: fields that they are added to, by number; NOTHING: left out.
 */
struct targets {
    int by_q, by_qd, mass;
    bool has_inertia;
    double sign; /* of the pulls: -1 where they stand on the other side */
};

struct builder {
    struct derivation *d;
    struct function *f;
    struct held *held;
    const struct pulls *pulls;
    struct pair_arrays arrays;
    const struct vector *shifts; /* by frame, ground axes */
};

/*
 * How joint j turns the columns of i beyond it, by frame: entries are e_j . rows_i and e_j . columns_i. With
 * the pull F on C_i and the torque T on e_i, (e_j x C_i) . F = e_j . (C_i x F); a torque's axis is turned by
 * the nearer joints alone, so that e_i x T stands in rows only.
 */
struct turned_pulls {
    struct vector *rows, *columns;
};

/* factor * values, by frame. */
expression *scaled(struct derivation *d, double factor, const expression *by_frame);
struct turned_pulls derive_turned_pulls(const struct builder *b, double sign);
/* The loop of these alone, once b->arrays are open. */
void add_turning_pairs(struct builder *b, const struct turned_pulls *turned, int field);
/* Springs, dampers and forces on coordinates. */
void give_coordinate_slopes(struct builder *b, const struct targets *targets);
/* Of `tangent_vectors`: springs, dampers and forces that depend on their own coordinate alone, by coordinate,
 * and the fields of what couples coordinates, count x n each; returns the count. */
void give_own_slopes(struct builder *b, double sign, int stiffness, int damping);
int add_couplings(struct builder *b, double sign);
/* Forces and torques at points: behind all fields of the result. */
void add_slope_loops(struct builder *b, const struct targets *targets);
void add_product(struct builder *b, int target, int left, int right, double factor, const char *about);

#endif
