/*
 * The linearised equations of several motions side by side: matrices and solutions of linearisation.h.
 *
 * What a file that includes this defines: base/lane.h. Takes the result of `tangent` for lanes; all rows are
 * independent, and factors are those of matrices.
 */
#ifndef REFDYN_LINEARISATION_LANES_H
#define REFDYN_LINEARISATION_LANES_H

#include "linear/elimination_lanes.h"

#include <string.h>

struct NAMED(linear) {
    int n, m, size;                                     /* size: n + m */
    LANE *tangent;                                      /* what the emitted function gives: its parts */
    const LANE *f_t, *g_t, *G_q, *G_qd, *u, *K, *D, *M; /* are these */
    struct NAMED(factors) real, complex[REFDYN_COMPLEXES_MOST]; /* their matrices, */
    LANE g;                                                     /* of the real one [s] */
    LANE *side, *x, *scale;                                     /* room: (n), (2 size), (size) */
    LANE *directions;                                           /* (m x n) */
};

/* Room of the tangent. */
static inline int NAMED(tangent_size)(int n, int m) {
    return n + m * (1 + 3 * n) + 3 * n * n;
}

static inline void NAMED(set_tangent)(struct NAMED(linear) * linear, LANE *tangent) {
    const int n = linear->n, m = linear->m;
    linear->tangent = tangent;
    linear->f_t = tangent;
    linear->g_t = linear->f_t + n;
    linear->G_q = linear->g_t + m;
    linear->G_qd = linear->G_q + m * n;
    linear->u = linear->G_qd + m * n;
    linear->K = linear->u + m * n;
    linear->D = linear->K + n * n;
    linear->M = linear->D + n * n;
}

/* Row i of a matrix of the coordinates (n x n) with rows of the programme (m x n) below it. */
static inline const LANE *NAMED(row_of)(const struct NAMED(linear) * linear, const LANE *coordinates,
                                        const LANE *rows, int i) {
    const int n = linear->n;
    return i < n ? coordinates + i * n : rows + (i - n) * n;
}

/* a x + b y (n each); as one loop, since each sum waits for its last term */
static inline LANE NAMED(dots)(const LANE *a, const LANE *x, const LANE *b, const LANE *y, int n) {
    LANE one = NAMED(every)(0), other = one;
    for (int j = 0; j < n; j++) {
        one += a[j] * x[j];
        other += b[j] * y[j];
    }
    return one + other;
}

static inline LANE NAMED(dot)(const LANE *a, const LANE *x, int n) {
    LANE sum = NAMED(every)(0);
    for (int j = 0; j < n; j++)
        sum += a[j] * x[j];
    return sum;
}

/* y (n + m) = [M; u] x */
static inline void NAMED(times_mass)(const struct NAMED(linear) * linear, const LANE *x, LANE *y) {
    for (int i = 0; i < linear->size; i++)
        y[i] = NAMED(dot)(NAMED(row_of)(linear, linear->M, linear->u, i), x, linear->n);
}

/* The border -u^T, and the zeros in its corner. */
static inline void NAMED(fill_border)(const struct NAMED(linear) * linear, LANE *matrix) {
    const int n = linear->n, size = linear->size;
    for (int k = 0; k < linear->m; k++) {
        for (int i = 0; i < n; i++)
            matrix[i * size + n + k] = -linear->u[k * n + i];
        for (int i = n; i < size; i++)
            matrix[i * size + n + k] = NAMED(every)(0);
    }
}

/* base + g first + g^2 second, rows of the coordinates and then of the programme; g = re + i im */
INLINE void NAMED(fill_matrix)(int is_complex, const struct NAMED(linear) * linear, LANE re, LANE im,
                               LANE *matrix) {
    const int n = linear->n, size = linear->size;
    const LANE square = is_complex ? re * re - im * im : re * re, twice = 2 * re * im;
    LANE *other = matrix + size * size;
    for (int i = 0; i < size; i++) {
        const LANE *M = NAMED(row_of)(linear, linear->M, linear->u, i),
                   *D = NAMED(row_of)(linear, linear->D, linear->G_qd, i),
                   *K = NAMED(row_of)(linear, linear->K, linear->G_q, i);
        for (int j = 0; j < n; j++) {
            matrix[i * size + j] = M[j] + re * D[j] + square * K[j];
            if (is_complex)
                other[i * size + j] = im * D[j] + twice * K[j];
        }
        for (int j = n; j < size && is_complex; j++)
            other[i * size + j] = NAMED(every)(0);
    }
    NAMED(fill_border)(linear, matrix);
}

/* The real matrix for g, the complex ones: gives the motions whose matrix is regular. */
INLINE MASK NAMED(factor_real)(struct NAMED(linear) * linear, LANE g) {
    linear->g = g;
    NAMED(fill_matrix)(0, linear, g, g, linear->real.matrix);
    return NAMED(factor_matrix)(0, &linear->real, linear->scale);
}

INLINE MASK NAMED(factor_complex)(struct NAMED(linear) * linear, int k, LANE re, LANE im) {
    NAMED(fill_matrix)(1, linear, re, im, linear->complex[k].matrix);
    return NAMED(factor_matrix)(1, &linear->complex[k], linear->scale);
}

/* refdyn_linear_solve */
INLINE void NAMED(solve_linear)(const struct NAMED(linear) * linear, const LANE *r_q, const LANE *r_v,
                                LANE dt, LANE *dq, LANE *dqd) {
    const int n = linear->n;
    const LANE g = linear->g;
    LANE *s = linear->side, *x = linear->x;
    for (int j = 0; j < n; j++)
        s[j] = g * r_v[j] + r_q[j];
    for (int i = 0; i < linear->size; i++) {
        const LANE *D = NAMED(row_of)(linear, linear->D, linear->G_qd, i),
                   *K = NAMED(row_of)(linear, linear->K, linear->G_q, i),
                   by_t = i < n ? linear->f_t[i] : linear->g_t[i - n];
        x[i] = -g * (g * NAMED(dots)(D, r_v, K, s, n) + dt * by_t);
    }
    NAMED(solve_factored)(0, &linear->real, x);
    for (int j = 0; j < n; j++) {
        const LANE sum = x[j] + s[j];
        dqd[j] = sum - r_q[j];
        dq[j] = g * sum;
    }
}

/* refdyn_linear_directions */
static inline void NAMED(find_directions)(const struct NAMED(linear) * linear) {
    const int n = linear->n;
    for (int k = 0; k < linear->m; k++) {
        for (int i = 0; i < linear->size; i++)
            linear->x[i] = NAMED(every)(i == n + k);
        NAMED(solve_factored)(0, &linear->real, linear->x);
        memcpy(linear->directions + k * n, linear->x, (size_t)n * sizeof(LANE));
    }
}

/* refdyn_linear_solve_all: changes of accelerations by residuals x, in their place. */
static inline void NAMED(solve_all)(const struct NAMED(linear) * linear, int count, const double *lambda,
                                    LANE *x) {
    const int n = linear->n, size = linear->size;
    for (int k = 0; k < count; k++) {
        const int is_complex = lambda[2 * k + 1] != 0;
        NAMED(times_mass)(linear, x, linear->x);
        if (is_complex)
            NAMED(times_mass)(linear, x + n, linear->x + size);
        if (is_complex)
            NAMED(solve_factored)(1, &linear->complex[k], linear->x);
        else
            NAMED(solve_factored)(0, &linear->real, linear->x);
        memcpy(x, linear->x, (size_t)n * sizeof *x);
        if (is_complex)
            memcpy(x + n, linear->x + size, (size_t)n * sizeof *x);
        x += is_complex ? 2 * n : n;
    }
}

#endif
