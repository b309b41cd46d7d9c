/*
 * Quantities: the emitted functions, built from the terms of kinematics, dynamics and rows.
 *
 * quantities.def is the table of them; plan.h declares the call that lists the requested ones. The parts in
 * order: the table; shared terms and their costs; matrices; derivatives; loops over pairs; derivatives of
 * forces; other terms.
 */
#ifndef REFDYN_GEN_QUANTITIES_H
#define REFDYN_GEN_QUANTITIES_H

#include "gen/plan/plan.h"
#include "gen/tangent/tangent.h"

/* ---- The table ---- */

struct derivation;
/* The function that fills the arrays of each quantity. */
#define QUANTITY(name, about, exists, lacks, use, readers) \
    void quantity_##name(struct derivation *d, struct function *f);
#include "gen/quantities/quantities.def"
#undef QUANTITY

/* ---- Shared terms of one model, each derived when first requested ---- */

/* The terms of one way of solving M x = f, u x = k. NULL: not derived yet. */
struct solution {
    bool is_dense;
    const struct elimination *elimination; /* set if the recursion is used */
    const expression *free;                /* qdd_free */
    expression **responses;                /* M^-1 u^T by row */
    expression *S, *lambda;                /* u M^-1 u^T, multipliers */
    const expression *free_responses;      /* the diagonal of S if no joint held the bodies */
    const expression *qdd;
    struct acceleration *frames;  /* of qdd_free, by the recursion */
    struct reference *references; /* the accelerations of the frames are relative to these */
};

/* Coordinates: for more, written-out matrices and runs are not even counted. */
enum { MOST_WRITTEN_OUT = 40 };

struct derivation {
    struct derivation *flat; /* the same model without runs, once requested */
    bool is_second;          /* it is such a second derivation: its choices are not reported */
    enum matrix_form { FORM_OPEN, FORM_LOOPS, FORM_WRITTEN } mass_form, statics_form;
    const char *emit;       /* the requested quantities, as in gen_plan */
    unsigned wanted_blocks; /* of the derivatives that are being built: bit k selects the block that
                               derivatives_block_name(k) names */
    bool has_vectors;       /* the tangent as vectors of joints has fewer operations */
    struct plan *plan;
    struct memory *memory;
    struct graph *g;
    const struct model *model;
    int n, m, points; /* coordinates, rows, points */
    int frames;       /* of the rolled tree: values of coordinates are kept by frame */
    struct kinematics kinematics;
    struct inertia *composites;
    expression *M, *statics_tangent, *bias, *less_gravity;
    struct applied applied;
    struct row_terms *rows;
    struct factors *factors;
    struct solution by_method[2];              /* recursive, dense */
    struct solution *free_solution, *solution; /* chosen for qdd_free and for qdd */
};

/* shared_terms.c */
struct derivation *derivation_start(struct plan *plan, const struct tree *tree);
/* Derives from the rolled tree or, if it is short, from a tree without runs, with axes turned or kept
 * (tree.h): the cheapest form. */
struct derivation *choice_of_tree(struct plan *plan);
/* The same with every frame written out; d itself if it has no runs. */
struct derivation *derivation_without_runs(struct derivation *d);
expression *derivation_new_values(const struct derivation *d, int count);
const struct inertia *derivation_composites(struct derivation *d);
const struct row_terms *derivation_rows(struct derivation *d);
/* The rows with v and k at the accelerations at which loads are taken instead of those at qdd = 0; NULL:
 * as `rows`. */
const struct row_terms *derivation_rows_beside_loads(struct derivation *d,
                                                     const struct reference *references);
/* n x n, for a tree without runs. */
const expression *derivation_mass_matrix(struct derivation *d);
const struct applied *derivation_applied(struct derivation *d);
/* By frame: Q without gravity, h, Q, h + Q. */
const expression *derivation_applied_total(struct derivation *d);
expression *derivation_bias_forces(struct derivation *d);
expression *derivation_generalized_forces(struct derivation *d);
expression *derivation_all_forces(struct derivation *d);

/* Returns whether a joint moves no mass: solutions joint by joint divide by the mass that a joint carries. */
bool derivation_has_massless_joint(const struct derivation *d);

/* accelerations.c: by frame. */
const expression *accelerations_free(struct derivation *d);
/* qdd_free by recursion, even where the matrix is cheaper. */
const expression *accelerations_recursive(struct derivation *d);
/* The articulated inertias of this recursion. */
const struct elimination *accelerations_elimination(struct derivation *d);
/* With qdd, lambda, the responses and S. */
const struct solution *accelerations_constrained(struct derivation *d);
/* Replaces rest by the solution x of S x = rest; `what` names x. */
void accelerations_solve_rows(struct derivation *d, const struct solution *solution, expression *rest,
                              const char *what);
/* Operations of a call that computes these values and nothing else. Values of parameters alone cost
 * nothing. */
long operation_cost_of_values(const struct derivation *d, const expression *values, int count);
/* Operations of all results and local arrays of a function, without its loops. */
long operation_cost_of_results(const struct derivation *d, const struct function *function);
/* The same with its loops, whose operations count less. */
long operation_cost_with_loops(const struct derivation *d, const struct function *function);
/* Adds a choice to the summary and the header. */
void operation_cost_note_choice(struct derivation *d, const char *choice);

/* ---- Matrices ---- */

/* mass_matrix.c: adds an array for M. Fill it after all other arrays exist. */
int mass_matrix_add(struct derivation *d, struct function *f);
void mass_matrix_fill(struct derivation *d, struct function *f, int array);
/* Spreads values by frame to entries first + stride * coordinate of an array. */
void derivation_spread(struct derivation *d, struct function *f, int array, int first, int stride,
                       const expression *by_frame);
/* Adds one part to a function's result and returns its number. */
int derivation_add_array(struct derivation *d, struct function *f, const char *name, const char *about,
                         int count, int columns);
/* Adds the rotors' inertias to the diagonal of an array of M that loops fill. */
void mass_matrix_add_rotors(struct derivation *d, struct function *f, int array);
/* dQ/dq at qd = 0 in the cheaper form. Call it after all other arrays of the result exist. */
void mass_matrix_fill_statics_tangent(struct derivation *d, struct function *f, int array);

/* ---- Derivatives ---- */

/* derivatives.c: derivatives by q, qd, t, inputs and parameters, side by side in one function. BY_QDD is a
 * block of `d_inverse` alone. */
enum block { BY_Q, BY_QD, BY_T, BY_X, BY_P, BLOCK_COUNT, BY_QDD = BLOCK_COUNT, NAMED_BLOCKS };

/* Values at given accelerations and multipliers, and their derivatives: one row of `count` for each
 * variable. */
struct terms {
    expression *values;
    int count;
    expression *derivatives[BLOCK_COUNT];
};

/* The rows of a set of blocks: the prefix of their names, the differentiated values, the number of rows as
 * text and as a number. what: NULL for local arrays. */
struct block_rows {
    const char *before, *what, *shape;
    int count;
};

struct builder;
/* Lists the columns of all blocks, and opens their derivatives. */
void derivatives_open_blocks(struct derivation *d, struct terms *terms, int widths[BLOCK_COUNT]);
/* Adds arrays "q", "qd" ..., results or local ones. */
void derivatives_add_blocks(struct derivation *d, struct function *f, const struct block_rows *rows,
                            const int widths[BLOCK_COUNT], int arrays[BLOCK_COUNT]);
/* Writes factor * derivatives by t, inputs or parameters of the terms from `first` on. */
void derivatives_fill_block(const struct builder *b, const struct terms *terms, int first, enum block block,
                            double factor, int array);
/* Writes factor * derivatives of values in symbols by q (order 0) or qd (order 1). */
void derivatives_fill_by_state(const struct builder *b, const expression *in_symbols, int order,
                               double factor, int array);
/* Returns whether an implicit step needs fewer operations with `tangent_vectors` than with `tangent`. */
bool tangent_prefers_vectors(struct derivation *d);
/* The name of block 0, 1 ... of these derivatives, "q", "qd", "t", "x" (the inputs) and "p" (the
 * parameters); NULL after the last one. */
const char *derivatives_block_name(int block);
/* Removes the columns of parameters that nothing reads. Call it after all functions are listed. */
void derivatives_keep_emitted_parameters(struct plan *plan);

/* ---- Loops over pairs of coordinates ---- */

struct pair_arrays {
    struct memory *memory;
    struct plan *plan;
    struct function *function;
    const struct kinematics *k;
    int *order, *position, *end; /* position: by coordinate */
    int *is_revolute, *moves_on; /* by position, 0 or 1 */
    bool is_result;              /* the arrays are parts of the result, by coordinate */
};

/* shifts: by frame, from the origin of the previous joint, ground axes; NULL: no moment is moved. */
struct pair_arrays pair_loops_open(struct plan *plan, const struct kinematics *k, struct function *function,
                                   const struct vector *shifts);
/* The same in an order in which the longest branch of each body follows its other branches. */
struct pair_arrays pair_loops_open_sweeps(struct plan *plan, const struct kinematics *k,
                                          struct function *function, const struct vector *shifts);
/* For arrays that are parts of the result. */
struct pair_arrays pair_loops_open_results(struct plan *plan, const struct kinematics *k,
                                           struct function *function);
/* Adds a local array under a unique name and returns its number. */
int pair_loops_add_local(struct memory *memory, struct function *function, const char *name, int count,
                         int columns);
/* Three arrays NAME_x, NAME_y, NAME_z of a vector by frame. An axis that is zero everywhere has no array. */
struct vector_arrays pair_loops_add_arrays(struct pair_arrays *p, const char *name,
                                           const struct vector *by_frame);
/* The same for a moment that `move` adds to; the other arrays of `move` exist already. */
void pair_loops_add_moved(struct pair_arrays *p, const char *name, const struct vector *by_frame,
                          struct pair_move *move);
struct loop *pair_loops_add_loop(struct memory *memory, struct function *function, enum loop_kind kind,
                                 const char *about);
/* Opens a loop over pairs without products and moves. */
struct pairs *pair_loops_add_pairs(struct pair_arrays *p, const char *about);
/* Adds a term unless it is zero. */
void pair_loops_add_term(struct pair_terms *terms, double factor, struct vector_arrays near,
                         struct vector_arrays far);
/* Drops the local arrays that no loop reads, and the moves of moments that no product reads. Call it after
 * all loops exist. */
void pair_loops_drop_unread(struct memory *memory, struct function *function);

/* ---- Derivatives of applied forces (tangent.h) by q and qd: theory, sect. 7.3 ---- */

/* The numbers of the arrays to which derivatives are added; NOTHING: left out. */
struct targets {
    int by_q, by_qd, mass;
    bool has_inertia;
    double sign; /* of the applied forces: -1 if they are on the other side of the equation */
};

struct builder {
    struct derivation *d;
    struct function *f;
    struct given_motion *given;
    const struct applied_forces *applied_forces;
    struct pair_arrays arrays;
    const struct vector *shifts; /* by frame, ground axes */
};

/* By frame: the wrenches that nearer joints turn, as force_derivatives.c explains. */
struct turned_applied_forces {
    struct vector *rows, *columns;
};

/* factor * values, by frame. */
expression *force_derivatives_scaled(struct derivation *d, double factor, const expression *by_frame);
struct turned_applied_forces force_derivatives_turned_forces(const struct builder *b, double sign);
/* Adds the loop of these terms alone, once b->arrays are open. */
void force_derivatives_add_turning_pairs(struct builder *b, const struct turned_applied_forces *turned,
                                         int array);
/* Sets the entries of springs, dampers and forces on coordinates. */
void force_derivatives_set_coordinate_derivatives(struct builder *b, const struct targets *targets);
/* For `tangent_vectors`: sets the derivatives, by coordinate, of springs, dampers and forces that depend
 * on their own coordinate alone. */
void force_derivatives_set_own_derivatives(struct builder *b, double sign, int stiffness, int damping);
/* The derivatives of turns that share strains, apart from these diagonals, by frame: REFDYN_STRAIN_ROWS
 * and the following entries in refdyn_model.h. */
struct strain_derivatives {
    struct vector *rows, *columns, *damping;
};
struct strain_derivatives force_derivatives_strains(const struct builder *b, double sign);
/* Adds the arrays of forces that couple coordinates, count x n each, and returns the count. */
int force_derivatives_add_couplings(struct builder *b, double sign);
/* By frame: derivatives of the forces on joint i by the coordinates of its stage (order 0) or their rates,
 * without forces that couple coordinates; `firsts`: the first frame of the stage of each frame. */
struct vector *force_derivatives_of_stages(const struct builder *b, const int *firsts, int order,
                                           double sign);
/* Adds products for all forces that couple coordinates, times M^-1: derivatives of accelerations. */
void force_derivatives_add_coupled_accelerations(struct builder *b, const struct targets *targets);
/* Adds forces and torques at points, after all arrays of the result. */
void force_derivatives_add_loops(struct builder *b, const struct targets *targets);
void force_derivatives_add_product(struct builder *b, int target, int left, int right, double factor,
                                   const char *about);

/* Adds all loops and straight-line entries of M qdd - h - Q by q and qd, and of M. */
void tangent_add_loops(struct builder *b, const struct targets *targets);
/* Adds the arrays of `tangent_vectors`, once b->arrays are open. */
void tangent_add_joint_vectors(struct builder *b);
/* Returns whether all joints turn about one axis of the ground or slide perpendicular to it. */
bool tangent_is_planar(const struct builder *b);

/* ---- Derivatives of accelerations in sweeps over the tree: theory, sect. 7.7 ---- */

/* Returns whether all joints carry mass, turns that share strains are eliminated together, and no applied
 * force acts on a body between turns that are eliminated together. */
bool acceleration_sweeps_fit(struct derivation *d, const struct applied_forces *applied);
/* Adds -M^-1 times the derivatives of the equations of motion by q and qd, for the builder's applied forces,
 * to these arrays of its function; NOTHING: left out. */
void acceleration_sweeps_add(struct builder *b, int by_q, int by_qd);

/* ---- Rules for parameters, spatial Jacobians, times of kinks ---- */

/* Lists the rules of the quantity `required`, which the runtime evaluates before a motion. Call it after all
 * other functions are listed. */
void required_values_find(struct derivation *d);
bool required_values_exist(const struct derivation *d);
bool spatial_jacobian_exists(const struct derivation *d);
/* Excludes a comparison e that only detects rounding and is not a kink of the model. Call it before
 * time_events_find. */
void time_events_leave_out(struct plan *plan, expression e);
/* Sets breaks, switches and paces of the plan from its functions. */
void time_events_find(struct derivation *d);

#endif
