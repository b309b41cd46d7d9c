/* The sweeps of chain.h over a tree of joints: vectors by position. */
#ifndef REFDYN_CHAIN_WIDE_H
#define REFDYN_CHAIN_WIDE_H

#include "refdyn.h"
#include "wide.h"

enum { REFDYN_LEFT_MOST = 6, REFDYN_RIGHT_MOST = 12 }; /* components of a wrench, and of what it meets */

/* Where vectors stand in the record of a joint, which begins with S, and components in a vector. */
struct refdyn_chain_layout {
    int moments, forces, left, right;
    int shift, shift_rate, W, Z, Y, record; /* in a record, and its length */
    int spin, force, turned;                /* in Y and Z */
};

INLINE struct refdyn_chain_layout refdyn_chain_layout_of(int planar) {
    const int moments = planar ? 1 : 3, forces = planar ? 2 : 3, left = moments + forces,
              right = 3 * moments + forces;
    const int W = left + 2 * forces, Z = W + 3 * left, Y = Z + 3 * right;
    return (struct refdyn_chain_layout){.moments = moments,
                                        .forces = forces,
                                        .left = left,
                                        .right = right,
                                        .shift = left,
                                        .shift_rate = left + forces,
                                        .W = W,
                                        .Z = Z,
                                        .Y = Y,
                                        .record = Y + right,
                                        .spin = moments,
                                        .force = 2 * moments,
                                        .turned = 2 * moments + forces};
}

/* parts 1: real numbers, 2: complex ones, imaginary parts behind real ones. Factors of A for g = re + i im,
 * without its border. Returns -1, or the position of the first joint without a pivot. */
int refdyn_chain_eliminate(const struct refdyn_chain *c, int parts, double re, double im, double *factors);
/* x (n) := A^-1 x without the border. Returns 0, as does the next one. */
int refdyn_chain_solve_tree(const struct refdyn_chain *c, int parts, const double *factors, double *x);
/* y (n) := M x_0 + D x_1 + K x_2 without couplings; NULL: zero. */
int refdyn_chain_multiply(const struct refdyn_chain *c, const double *const x[3], double *y);

#endif
