/* The sweeps of chain.h over a tree of joints: vectors by position. */
#ifndef REFDYN_CHAIN_WIDE_H
#define REFDYN_CHAIN_WIDE_H

#include "refdyn.h"

/* parts 1: real numbers, 2: complex ones, imaginary parts behind real ones. Factors of A for g = re + i im,
 * without its border. Returns -1, or the position of the first joint without a pivot. */
int refdyn_chain_eliminate(const struct refdyn_chain *c, int parts, double re, double im, double *factors);
/* x (n) := A^-1 x without the border. Returns 0, as does the next one. */
int refdyn_chain_solve_tree(const struct refdyn_chain *c, int parts, const double *factors, double *x);
/* y (n) := M x_0 + D x_1 + K x_2 without couplings; NULL: zero. */
int refdyn_chain_multiply(const struct refdyn_chain *c, const double *const x[3], double *y);

#endif
