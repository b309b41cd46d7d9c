/*
 * Local arrays and loops of one function: from vectors of coordinates to the plan's loops over pairs.
 *
 * Takes vectors by frame, gives arrays by position in the order in which all beyond a joint follow it.
 * Arrays of the result come first: locals are added behind the last of them.
 */
#ifndef REFDYN_GEN_PAIR_LOOPS_H
#define REFDYN_GEN_PAIR_LOOPS_H

#include "plan/plan.h"
#include "tangent/force_and_inertia_vectors.h"

struct pair_arrays {
    struct memory *memory;
    struct plan *plan;
    struct function *function;
    const struct kinematics *k;
    int *order, *position, *end; /* position: by coordinate */
    bool *is_revolute, *moves_on;
    bool is_result; /* arrays are parts of the result, by coordinate */
};

/* shifts: by frame, from the origin of the joint before, ground axes; NULL: no moment is moved. */
struct pair_arrays pair_loops_open(struct plan *plan, const struct kinematics *k, struct function *function,
                                   const struct vector *shifts);
/* The same for arrays that are parts of the result. */
struct pair_arrays pair_loops_open_results(struct plan *plan, const struct kinematics *k,
                                           struct function *function);
/* Adds a local array under a name of its own; gives its number. */
int pair_loops_add_local(struct memory *memory, struct function *function, const char *name, int count,
                         int columns);
/* Three arrays NAME_x, NAME_y, NAME_z of a vector by frame; axes that are zero everywhere have none. */
struct vector_arrays pair_loops_add_arrays(struct pair_arrays *p, const char *name,
                                           const struct vector *by_frame);
/* The same for a moment that `move` adds to: its other arrays are there already. */
void pair_loops_add_moved(struct pair_arrays *p, const char *name, const struct vector *by_frame,
                          struct pair_move *move);
struct loop *pair_loops_add_loop(struct memory *memory, struct function *function, enum loop_kind kind,
                                 const char *about);
/* Opens a loop over pairs without products and moves. */
struct pairs *pair_loops_add_pairs(struct pair_arrays *p, const char *about);
/* One more term, unless it is zero. */
void pair_loops_add_term(struct pair_terms *terms, double factor, struct vector_arrays near,
                         struct vector_arrays far);
/* Drops the local arrays that no loop reads, and moves of moments that no product reads: when all loops are
 * there. */
void pair_loops_drop_unread(struct memory *memory, struct function *function);

#endif
