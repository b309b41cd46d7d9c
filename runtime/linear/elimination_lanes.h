/*
 * Elimination of the matrices of several motions side by side: P A = L U with partial pivoting, real and
 * complex, and solutions with it.
 *
 * What a file that includes this defines: base/lane.h. Matrices stand row by row, the imaginary parts of a
 * complex one behind all its real ones. Each motion has pivots of its own, chosen as in elimination.c; rows
 * are exchanged by masks, for each row that is the pivot of some motion.
 */
#ifndef REFDYN_ELIMINATION_LANES_H
#define REFDYN_ELIMINATION_LANES_H

#include "base/lane.h"

#include <float.h>

/* Factors of a matrix: L below the diagonal, U with the inverses of its diagonal. */
struct NAMED(factors) {
    int n;
    LANE *matrix; /* (n x n), of a complex one twice */
    int *pivot;   /* (n x LANES) the row that took place k */
    int *moves;   /* (n) some motion has exchanged rows there */
};

/* (x, y) -= (a + i b) (u, v); of real rows x -= a u */
INLINE void NAMED(subtract_row)(int is_complex, LANE *restrict x, LANE *restrict y, LANE a, LANE b,
                                const LANE *restrict u, const LANE *restrict v, int count) {
    for (int j = 0; j < count; j++) {
        x[j] -= is_complex ? u[j] * a - v[j] * b : u[j] * a;
        if (is_complex)
            y[j] -= u[j] * b + v[j] * a;
    }
}

INLINE void NAMED(exchange_rows)(LANE *restrict a, LANE *restrict b, MASK where, int count) {
    for (int j = 0; j < count; j++) {
        const LANE x = a[j], y = b[j];
        a[j] = NAMED(select)(where, y, x);
        b[j] = NAMED(select)(where, x, y);
    }
}

/* Exchanges row k with the pivot of each motion, which `row` tells, and their scales. */
INLINE void NAMED(exchange_pivots)(int is_complex, const struct NAMED(factors) * factors, int k, LANE row,
                                   LANE *scale) {
    const int n = factors->n;
    LANE *re = factors->matrix, *im = re + n * n;
    factors->moves[k] = 0;
    for (int lane = 0; lane < LANES; lane++) {
        const int pivot = (int)row[lane];
        int is_done = pivot == k;
        factors->pivot[k * LANES + lane] = pivot;
        for (int other = 0; other < lane; other++)
            is_done |= row[other] == row[lane];
        if (is_done)
            continue;
        const MASK where = row == NAMED(every)(pivot);
        factors->moves[k] = 1;
        NAMED(exchange_rows)(re + k * n, re + pivot * n, where, n);
        if (is_complex)
            NAMED(exchange_rows)(im + k * n, im + pivot * n, where, n);
        NAMED(exchange_rows)(scale + k, scale + pivot, where, 1);
    }
}

/* The largest entry of column k from row k on, for the size of its row: its row, and whether there is one. */
static inline LANE NAMED(find_pivots)(int is_complex, const struct NAMED(factors) * factors, int k,
                                      const LANE *scale, MASK *has) {
    const int n = factors->n;
    const LANE *re = factors->matrix, *im = re + n * n;
    LANE largest = NAMED(every)(0), row = NAMED(every)(k);
    for (int i = k; i < n; i++) {
        LANE entry = NAMED(size)(re[i * n + k]);
        if (is_complex)
            entry += NAMED(size)(im[i * n + k]);
        const LANE size = entry * scale[i];
        const MASK is_larger = size > largest;
        largest = NAMED(select)(is_larger, size, largest);
        row = NAMED(select)(is_larger, NAMED(every)(i), row);
    }
    *has &= largest > NAMED(every)(0);
    return row;
}

/* 1 over the pivot, in its place. */
static inline void NAMED(invert_pivot)(int is_complex, LANE *x, LANE *y, MASK *has) {
    if (!is_complex) {
        *x = 1 / *x;
        return;
    }
    const LANE square = *x * *x + *y * *y;
    *has &= (square > NAMED(every)(0)) & (square <= NAMED(every)(DBL_MAX));
    *x = *x / square;
    *y = -*y / square;
}

static inline void NAMED(find_scale)(int is_complex, const struct NAMED(factors) * factors, LANE *scale) {
    const int n = factors->n;
    const LANE *re = factors->matrix, *im = re + n * n;
    for (int i = 0; i < n; i++) {
        LANE largest = NAMED(every)(0);
        for (int j = i * n; j < i * n + n; j++) {
            LANE size = NAMED(size)(re[j]);
            if (is_complex)
                size += NAMED(size)(im[j]);
            largest = NAMED(select)(size > largest, size, largest);
        }
        scale[i] = 1 / largest;
    }
}

static inline void NAMED(eliminate_below)(int is_complex, const struct NAMED(factors) * factors, int k) {
    const int n = factors->n;
    LANE *re = factors->matrix, *im = re + (is_complex ? n * n : 0), *row = re + k * n, *other = im + k * n;
    for (int i = k + 1; i < n; i++) {
        LANE *x = re + i * n, *y = im + i * n;
        const LANE a = x[k], b = y[k];
        x[k] = is_complex ? a * row[k] - b * other[k] : a * row[k];
        if (is_complex)
            y[k] = a * other[k] + b * row[k];
        NAMED(subtract_row)
        (is_complex, x + k + 1, y + k + 1, x[k], y[k], row + k + 1, other + k + 1, n - k - 1);
    }
}

/* Factors the matrix. Gives the motions whose matrix is regular; scale (n) is room. */
static inline MASK NAMED(factor_matrix)(int is_complex, const struct NAMED(factors) * factors, LANE *scale) {
    const int n = factors->n;
    LANE *re = factors->matrix, *im = re + (is_complex ? n * n : 0);
    MASK has = NAMED(every)(0) == NAMED(every)(0);
    NAMED(find_scale)(is_complex, factors, scale);
    for (int k = 0; k < n; k++) {
        const LANE row = NAMED(find_pivots)(is_complex, factors, k, scale, &has);
        NAMED(exchange_pivots)(is_complex, factors, k, row, scale);
        NAMED(invert_pivot)(is_complex, re + k * n + k, im + k * n + k, &has);
        NAMED(eliminate_below)(is_complex, factors, k);
    }
    return has;
}

/* (*a, *b) -= (u_k + i v_k) (x_k, y_k) for k from `first` on, up or down, until `end` */
INLINE void NAMED(subtract_solved)(int is_complex, const LANE *u, const LANE *v, int first, int end, int step,
                                   LANE *a, LANE *b, const LANE *x, const LANE *y) {
    LANE re = *a, im = *b;
    for (int k = first; k != end; k += step) {
        re -= is_complex ? u[k] * x[k] - v[k] * y[k] : u[k] * x[k];
        if (is_complex)
            im -= u[k] * y[k] + v[k] * x[k];
    }
    *a = re;
    if (is_complex)
        *b = im;
}

/* x (n, of complex ones twice) := A^-1 x */
static inline void NAMED(solve_factored)(int is_complex, const struct NAMED(factors) * factors, LANE *x) {
    const int n = factors->n;
    const LANE *re = factors->matrix, *im = re + (is_complex ? n * n : 0);
    LANE *y = x + (is_complex ? n : 0);
    for (int k = 0; k < n; k++)
        for (int lane = 0; lane < LANES && factors->moves[k]; lane++) {
            const int pivot = factors->pivot[k * LANES + lane];
            const double a = x[k][lane], b = y[k][lane];
            x[k][lane] = x[pivot][lane];
            x[pivot][lane] = a;
            if (is_complex) {
                y[k][lane] = y[pivot][lane];
                y[pivot][lane] = b;
            }
        }
    for (int i = 0; i < n; i++)
        NAMED(subtract_solved)(is_complex, re + i * n, im + i * n, 0, i, 1, x + i, y + i, x, y);
    for (int i = n - 1; i >= 0; i--) {
        NAMED(subtract_solved)(is_complex, re + i * n, im + i * n, n - 1, i, -1, x + i, y + i, x, y);
        const LANE a = x[i], b = y[i], u = re[i * n + i], v = im[i * n + i];
        x[i] = is_complex ? a * u - b * v : a * u;
        if (is_complex)
            y[i] = a * v + b * u;
    }
}

#endif
