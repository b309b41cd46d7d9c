/*
 * Elimination of the matrices of one motion, and of rows by full pivoting. elimination.inc has the formulas.
 *
 * refdyn_lu_factor divides rows by their largest entry when it compares pivots (Golub and Van Loan, Matrix
 * Computations, 3.4). COMPILE (linear_private.h) compiles it twice, and is_complex becomes a constant.
 */
#include "runtime/core/linear/linear.h"

#include <stddef.h>

#include "runtime/core/linear/linear_private.h"

#define LANES 1
#define NAMED(name) name##_of_one
#include "runtime/core/linear/elimination.inc"

/* Of factors that are read only. */
INLINE struct factors_of_one factors_of(const double *A, int n, const int *pivot) {
    return (struct factors_of_one){n, n, (double *)A, (int *)pivot};
}

/* Finds the largest entry of columns [k, last) from row k on. Returns 0 if all are zero or NaN. */
INLINE int find_pivot_in(const struct factors_of_one *factors, int k, int last, const double *scale,
                         double *row, int *column) {
    double largest = 0;
    for (int j = k; j < last; j++) {
        const double before = largest;
        find_pivot_of_one(0, factors, k, j, scale, &largest, row);
        *column = largest > before ? j : *column;
    }
    return largest > 0;
}

INLINE void swap_columns(double *A, int rows, int a, int b) {
    for (int i = 0; i < rows && a != b; i++)
        exchange_of_one(A + a * rows + i, A + b * rows + i, 1);
}

INLINE int eliminate(double *A, int rows, int columns, int *pivot, int *order, double *scale) {
    const struct factors_of_one factors = {rows, columns, A, pivot};
    double row = 0;
    int k = 0, column = 0;
    for (; k < rows && k < columns; k++) {
        if (!find_pivot_in(&factors, k, order ? columns : k + 1, scale, &row, &column))
            break;
        if (order) {
            swap_columns(A, rows, k, column);
            const int kept = order[k];
            order[k] = order[column];
            order[column] = kept;
        }
        eliminate_column_of_one(0, &factors, k, row, scale);
    }
    return k;
}

INLINE int lu_factor(int is_complex, double *A, int n, int *pivot, double *scale) {
    const struct factors_of_one factors = {n, n, A, pivot};
    return is_complex ? factor_matrix_of_one(1, &factors, scale) : factor_matrix_of_one(0, &factors, scale);
}

INLINE int lu_solve(int is_complex, const double *A, int n, const int *pivot, double *x) {
    const struct factors_of_one factors = factors_of(A, n, pivot);
    if (is_complex)
        solve_factored_of_one(1, &factors, x);
    else
        solve_factored_of_one(0, &factors, x);
    return 0;
}

/* A^T = U^T L^T P */
INLINE int lu_solve_transposed(const double *A, int n, const int *pivot, double *X, int stride, int count) {
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < k; i++)
            dense_add(X + k * stride, -A[k * n + i], X + i * stride, count);
        for (int j = 0; j < count; j++)
            X[k * stride + j] *= A[k * n + k];
    }
    for (int k = n - 1; k >= 0; k--)
        for (int i = k + 1; i < n; i++)
            dense_add(X + k * stride, -A[k * n + i], X + i * stride, count);
    for (int k = n - 1; k >= 0; k--)
        for (int j = 0; j < count && pivot[k] != k; j++)
            exchange_of_one(X + k * stride + j, X + pivot[k] * stride + j, 1);
    return 0;
}

COMPILE(int, eliminate, (double *A, int rows, int columns, int *pivot, int *order, double *scale),
        (A, rows, columns, pivot, order, scale))
COMPILE(int, lu_factor, (int is_complex, double *A, int n, int *pivot, double *scale),
        (is_complex, A, n, pivot, scale))
COMPILE(int, lu_solve, (int is_complex, const double *A, int n, const int *pivot, double *x),
        (is_complex, A, n, pivot, x))
COMPILE(int, lu_solve_transposed,
        (const double *A, int n, const int *pivot, double *X, int stride, int count),
        (A, n, pivot, X, stride, count))
