/*
 * Elimination: P A = L U of dense matrices with pivoting, real and complex, and solutions with it.
 *
 * Factors stand column by column, L_ij or U_ij in A[j n + i], with the inverses of U's diagonal; pivot (k)
 * tells the row that took place k. The imaginary parts of a complex matrix or vector stand behind all its
 * real ones.
 */
#ifndef REFDYN_ELIMINATION_H
#define REFDYN_ELIMINATION_H

/*
 * Eliminates a real matrix that is given column by column: min(rows, columns) pivots, or as many as are not
 * zero; returns how many. The sizes of rows count by scale (rows), which is put into their new order: 0 keeps
 * a row from being a pivot. order NULL: pivot k is the largest entry of column k (partial pivoting); else the
 * largest of all columns that are left (full pivoting), and order (columns) is put into their new order.
 */
int refdyn_eliminate(double *A, int rows, int columns, int *pivot, int *order, double *scale);

/* Puts a list, as the part of an order that no pivot took, into ascending order. */
static inline void refdyn_sort(int *list, int count) {
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && list[j - 1] > list[j]; j--) {
            const int kept = list[j];
            list[j] = list[j - 1];
            list[j - 1] = kept;
        }
}

/*
 * Factors a matrix (n x n, row by row) by partial pivoting, rows divided by their largest entry when pivots
 * are compared (Golub and Van Loan, Matrix Computations, 3.4). scale (n): 1 over the largest entry of the row
 * that took each place. Returns -1, or the first column without a pivot.
 */
int refdyn_lu_factor(int is_complex, double *A, int n, int *pivot, double *scale);
/* x (n) := A^-1 x with the factors. Returns 0. */
int refdyn_lu_solve(int is_complex, const double *A, int n, const int *pivot, double *x);
/* X := A^-T X for real factors and `count` right sides, rows of X `stride` apart. Returns 0. */
int refdyn_lu_solve_transposed(const double *A, int n, const int *pivot, double *X, int stride, int count);

#endif
