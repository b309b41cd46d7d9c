/*
 * 3-vectors, rotations and inertia tensors of expressions: the algebra that kinematics and dynamics are
 * written in. Everything folds in the graph, so that a zero component costs nothing.
 */
#ifndef REFDYN_GEN_VECTOR_H
#define REFDYN_GEN_VECTOR_H

#include "graph/graph.h"
#include "tree/tree.h"

struct vector vector_of(const expression at[3]);
struct vector vector_unit(struct graph *g, int axis);
struct vector vector_add(struct graph *g, struct vector a, struct vector b);
struct vector vector_sub(struct graph *g, struct vector a, struct vector b);
struct vector vector_scale(struct graph *g, expression s, struct vector a);
struct vector vector_cross(struct graph *g, struct vector a, struct vector b);
expression vector_dot(struct graph *g, struct vector a, struct vector b);
bool vector_is_zero(struct vector a);
struct vector matrix_times(struct graph *g, const expression matrix[9], struct vector a);
struct vector matrix_transpose_times(struct graph *g, const expression matrix[9], struct vector a);
struct matrix matrix_product(struct graph *g, const expression a[9], const expression b[9]);

int tensor_index(int row, int column);
struct vector tensor_times(struct graph *g, struct tensor t, struct vector a);
struct tensor tensor_add(struct graph *g, struct tensor a, struct tensor b);
/* R T R^T */
struct tensor tensor_turn(struct graph *g, const expression rotation[9], struct tensor t);
/*
 * What an inertia gains when it is seen from r away (Steiner, both origins off the centre), from the moments
 * before, mc, and after, mc + m r: 2 (r.d) 1 - r d^T - d r^T with d = mc + m r / 2.
 */
struct tensor tensor_of_shift(struct graph *g, struct vector r, struct vector before, struct vector after);

struct placement placement_identity(void);
/* First `outer`, in it `inner`. */
struct placement placement_compose(struct graph *g, const struct placement *outer,
                                   const struct placement *inner);
struct placement placement_shift_x(expression distance);

/* Inertia given in a placed frame, seen from the frame in which it is placed. */
struct inertia inertia_place(struct graph *g, const struct placement *placement, struct inertia inner);
struct inertia inertia_add(struct graph *g, struct inertia a, struct inertia b);
bool inertia_is_zero(const struct inertia *inertia);

#endif
