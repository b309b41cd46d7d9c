/*
 * Operations of an implicit step in O(n) and with matrices: what the generator chooses by, and the automatic
 * choice of a method counts.
 *
 * n joints, a border of `border` rows and couplings; multiplications and additions of the sweeps of
 * chain_sweeps.c, in which two of three joints in space turn about the origin of the joint before.
 */
#ifndef REFDYN_CHAIN_COST_H
#define REFDYN_CHAIN_COST_H

static inline double refdyn_chain_factor_cost(int n, int border, int is_planar) {
    const double joint = is_planar ? 176 : 630, solution = is_planar ? 44 : 84;
    return n * (joint + border * (solution + 2.0 * border));
}

/* With the products of its right side. */
static inline double refdyn_chain_solve_cost(int n, int border, int is_planar) {
    return n * ((is_planar ? 104 : 204) + 8.0 * border);
}

static inline double refdyn_matrix_factor_cost(int n, int rows) {
    const double size = n + rows;
    return 2 * size * size * size / 3;
}

static inline double refdyn_matrix_solve_cost(int n, int rows) {
    const double size = n + rows;
    return 2 * size * (size + n);
}

/* Products of all pairs of joints in a tangent of matrices. */
static inline double refdyn_pairs_cost(int n, int is_planar) {
    return (is_planar ? 12.5 : 40.0) * n * n;
}

/* Does a step with eight solutions take fewer operations in O(n)? Those on matrices fill vectors and count
 * less. */
static inline int refdyn_chain_pays(int n, int rows, int couplings, int is_planar) {
    const double with_matrices = refdyn_pairs_cost(n, is_planar) + refdyn_matrix_factor_cost(n, rows) +
                                 8 * refdyn_matrix_solve_cost(n, rows);
    return refdyn_chain_factor_cost(n, rows + couplings, is_planar) +
               8 * refdyn_chain_solve_cost(n, rows + couplings, is_planar) <
           0.75 * with_matrices;
}

#endif
