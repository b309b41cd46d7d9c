/*
 * What builders of quantities share: terms of one model, each derived when first asked for.
 */
#ifndef REFDYN_GEN_QUANTITIES_H
#define REFDYN_GEN_QUANTITIES_H

#include "dynamics/dynamics.h"
#include "dynamics/forces.h"
#include "plan/plan.h"
#include "dynamics/constraints.h"

/* What one way of solving M x = f, u x = k gives; NULL: not derived yet. */
struct solution {
    bool is_dense;
    const struct elimination *elimination; /* by the recursion */
    const expression *free;                /* qdd_free */
    expression **responses;                /* M^-1 u^T by row */
    expression *S, *lambda;                /* u M^-1 u^T, multipliers */
    const expression *qdd;
    struct acceleration *frames;  /* of qdd_free, by the recursion */
    struct reference *references; /* beyond which these are */
};

enum { MOST_WRITTEN_OUT = 40 }; /* coordinates: beyond, written-out matrices and runs are not even weighed */

/* How a matrix is computed. */
enum matrix_form { FORM_OPEN, FORM_LOOPS, FORM_WRITTEN };

struct derivation {
    struct derivation *flat; /* the same without runs, once asked for */
    bool is_second;          /* it is one: what it chooses is not said */
    enum matrix_form mass_form, statics_form;
    const char *emit;       /* what was asked for, as in gen_plan */
    unsigned wanted_blocks; /* of the derivatives that are being built: bit k for the one that
                               derivatives_block_name(k) names */
    bool has_vectors;       /* the tangent as vectors of joints takes fewer operations */
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
/* From the rolled tree or, where it is short, one without runs, its axes turned or kept (parallel_axes.h):
 * what is cheaper. */
struct derivation *choice_of_tree(struct plan *plan);
/* The same with every frame alone; d itself when it has no runs. */
struct derivation *derivation_without_runs(struct derivation *d);
expression *derivation_new_values(const struct derivation *d, int count);
const struct inertia *derivation_composites(struct derivation *d);
const struct row_terms *derivation_rows(struct derivation *d);
/* With v and k at the accelerations that loads are taken at instead of those at qdd = 0; NULL: as `rows`. */
const struct row_terms *derivation_rows_beside_loads(struct derivation *d,
                                                     const struct reference *references);
/* n x n, of a tree without runs. */
const expression *derivation_mass_matrix(struct derivation *d);
const struct applied *derivation_applied(struct derivation *d);
/* By frame: Q without gravity, h, Q, h + Q. */
const expression *derivation_applied_total(struct derivation *d);
expression *derivation_bias_forces(struct derivation *d);
expression *derivation_generalized_forces(struct derivation *d);
expression *derivation_all_forces(struct derivation *d);

/* accelerations.c: by frame. */
const expression *accelerations_free(struct derivation *d);
/* qdd_free by recursion, even where the matrix is cheaper. */
const expression *accelerations_recursive(struct derivation *d);
/* With qdd, lambda, responses and S. */
const struct solution *accelerations_constrained(struct derivation *d);
/* S x = rest in place of rest; `what` names x. */
void accelerations_solve_rows(struct derivation *d, const expression *S, expression *rest, const char *what);
/* Operations of a call that computes these values and nothing else; what depends on parameters alone is free.
 */
long operation_cost_of_values(const struct derivation *d, const expression *values, int count);
/* The same of all results and local arrays of a function, without its loops. */
long operation_cost_of_results(const struct derivation *d, const struct function *function);
/* One more choice for the summary and the header. */
void operation_cost_note_choice(struct derivation *d, const char *choice);

/* mass_matrix.c: an array for M, filled when all other arrays are there. */
int mass_matrix_add(struct derivation *d, struct function *f);
void mass_matrix_fill(struct derivation *d, struct function *f, int array);

/* Values by frame into entries first + stride * coordinate of an array. */
void derivation_spread(struct derivation *d, struct function *f, int array, int first, int stride,
                       const expression *by_frame);
/* One more part of a function's result: its number. */
int derivation_add_array(struct derivation *d, struct function *f, const char *name, const char *about,
                         int count, int columns);

/* mass_matrix_loops.c: M into an array of f, n x n, as loops over pairs; pair_loops_drop_unread in the end.
 */
void mass_matrix_loops_add(struct derivation *d, struct function *f, int array);
/* What rotors add to the diagonal of an array of M that loops fill. */
void mass_matrix_add_rotors(struct derivation *d, struct function *f, int array);
/* statics_tangent_loops.c: dQ/dq at qd = 0, in the same way. */
void statics_tangent_loops_add(struct derivation *d, struct function *f, int array);
/* dQ/dq at qd = 0 in the cheaper form: when all other arrays of the result are there. */
void mass_matrix_fill_statics_tangent(struct derivation *d, struct function *f, int array);
/* derivatives.c: what is emitted on request alone. */
void derivatives_build_tangent(struct derivation *d, struct function *f);
void derivatives_build_tangent_vectors(struct derivation *d, struct function *f);
/* Does an implicit step take fewer operations with `tangent_vectors` than with `tangent`? */
bool derivatives_prefer_vectors(struct derivation *d);
/* The name of block 0, 1 ... of such derivatives, "q", "qd", "t", "x" (the inputs) and "p" (the parameters);
 * NULL behind the last one. */
const char *derivatives_block_name(int block);
void derivatives_build_d_qdd(struct derivation *d, struct function *f);
void derivatives_build_d_qdd_free(struct derivation *d, struct function *f);
void derivatives_build_d_force(struct derivation *d, struct function *f);
void derivatives_build_d_statics(struct derivation *d, struct function *f);
void derivatives_build_d_rows(struct derivation *d, struct function *f);
/* Takes the columns of parameters out that nothing reads: when all functions are listed. */
void derivatives_keep_emitted_parameters(struct plan *plan);

#endif
