/*
 * Local arrays and loops of one function: from vectors of coordinates to the plan's loops over pairs.
 *
 * Takes vectors by frame, gives arrays by position in the order in which all beyond a joint follow it.
 * Fields of the result come first: locals are added behind the last of them.
 */
#ifndef REFDYN_GEN_PAIRS_H
#define REFDYN_GEN_PAIRS_H

#include "plan.h"
#include "tangent.h"

struct pair_arrays {
    struct memory *memory;
    struct plan *plan;
    struct function *function;
    const struct kinematics *k;
    int *order, *position, *end; /* position: by coordinate */
    bool *is_turn, *moves_on;
    bool is_result; /* arrays are parts of the result, by coordinate */
};

/* shifts: by frame, from the origin of the joint before, ground axes; NULL: no moment is moved. */
struct pair_arrays open_pairs(struct plan *plan, const struct kinematics *k, struct function *function,
                              const struct vector *shifts);
/* The same for arrays that are parts of the result. */
struct pair_arrays open_results(struct plan *plan, const struct kinematics *k, struct function *function);
/* One more local array, under a name of its own: its number. */
int add_local(struct memory *memory, struct function *function, const char *name, int count, int columns);
/* Three arrays NAME_x, NAME_y, NAME_z of a vector by frame; axes that are zero everywhere have none. */
struct vector_arrays add_arrays(struct pair_arrays *p, const char *name, const struct vector *by_frame);
/* The same for a moment that `move` adds to: its other arrays are there already. */
void add_moved(struct pair_arrays *p, const char *name, const struct vector *by_frame,
               struct pair_move *move);
struct loop *add_loop(struct memory *memory, struct function *function, enum loop_kind kind,
                      const char *about);
/* Opens a loop over pairs without products and moves. */
struct pairs *add_pairs(struct pair_arrays *p, const char *about);
/* One more term, unless it is zero. */
void add_term(struct pair_terms *terms, double factor, struct vector_arrays near, struct vector_arrays far);
/* Drops the local arrays that no loop reads, and moves of moments that no product reads: when all loops are
 * there. */
void drop_unread(struct memory *memory, struct function *function);

#endif
