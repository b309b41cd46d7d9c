/* Declarations that the files of linear algebra share: compilation for wide vectors, sweeps over trees of
 * joints. */
#ifndef REFDYN_LINEAR_PRIVATE_H
#define REFDYN_LINEAR_PRIVATE_H

#include "runtime/core/base/core.h"

#include "runtime/core/linear/linear.h"

/*
 * ---- Functions compiled for wide vectors and for any processor ----
 *
 * COMPILE(result, name, parameters, arguments) makes refdyn_NAME of the INLINE function NAME: on x86-64 the
 * version for wide vectors runs where the processor has them. No operation is fused or reordered, so that
 * both versions produce the same bits.
 */

#if defined(__x86_64__) && defined(__GNUC__)
#define HAS_WIDE 1
#define WIDE __attribute__((target("avx2")))
#endif
#if defined(__GNUC__) && !defined(__clang__)
#define VECTORISED __attribute__((optimize("O3")))
#else
#define VECTORISED
#endif

#ifdef HAS_WIDE
#define COMPILE(result, name, parameters, arguments)       \
    WIDE VECTORISED static result wide_##name parameters { \
        return name arguments;                             \
    }                                                      \
    VECTORISED result refdyn_##name parameters {           \
        if (__builtin_cpu_supports("avx2"))                \
            return wide_##name arguments;                  \
        return name arguments;                             \
    }
#else
#define COMPILE(result, name, parameters, arguments) \
    VECTORISED result refdyn_##name parameters {     \
        return name arguments;                       \
    }
#endif

/* ---- Sweeps over a tree of joints, vectors by position ---- */

enum { REFDYN_LEFT_MOST = 6, REFDYN_RIGHT_MOST = 12 }; /* components of a wrench, and of Y and Z */

/* Places of vectors in the record of a joint, which begins with S, and of components in a vector. */
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

enum { REFDYN_STRAINS = 6 }; /* doubles of a joint: linear.h */

/* Returns the count of numbers in a joint's factors: W, Y, Z, 1 / A_kk, and with strains A_kl, A_lk for the
 * two turns before. */
INLINE int refdyn_chain_numbers(const struct refdyn_chain *c) {
    return c->left + 2 * c->right + 1 + (c->has_strains ? 4 : 0);
}

/* Numbers are real, or (wide) REFDYN_LANES complex ones side by side, real parts first. Returns the doubles
 * of one. */
enum { REFDYN_LANES = 4 };

INLINE int refdyn_chain_width(int wide) {
    return wide ? 2 * REFDYN_LANES : 1;
}

/* Factors A without its border for the number g. Returns -1, or the position of the first joint without a
 * pivot. */
int refdyn_chain_eliminate(const struct refdyn_chain *c, int wide, const double *g, double *factors);
/* x (n numbers) := A^-1 x without the border. Returns 0, as do the functions below. */
int refdyn_chain_solve_tree(const struct refdyn_chain *c, int wide, const double *factors, double *x);
/* y (n numbers) := M x_0 + D x_1 + K x_2 without couplings; NULL: zero. */
int refdyn_chain_multiply(const struct refdyn_chain *c, int wide, const double *const x[3], double *y);
/* sum := sum_i x_i y_i over n numbers; s (n) real */
int refdyn_chain_dot(int wide, int n, const double *x, const double *y, double *sum);
int refdyn_chain_dot_real(int wide, int n, const double *s, const double *y, double *sum);
/* y += a x over n numbers */
int refdyn_chain_add(int wide, int n, const double *a, const double *x, double *y);

#endif
