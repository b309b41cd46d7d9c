/*
 * The rank of a matrix, and the removal of a known eigenvalue.
 *
 * Let full pivoting of B = A - value divide the columns of A into r pivot columns p and dependent ones c with
 * b_c = sum_p b_p X_pc. The vectors e_c - sum_p X_pc e_p have the eigenvalue `value`. With them in place of
 * e_c as a basis, A keeps the block A_pj + sum_c X_pc A_cj of pivot rows and columns, which has the other
 * eigenvalues. Each pass shortens all Jordan chains of `value` by one vector.
 */
#include "runtime/core/linear/linear.h"

#include <math.h>
#include <string.h>

int refdyn_rank(double *A, int n, double tol, const struct refdyn_rank_scratch *scratch) {
    int rank = 0;
    for (int i = 0; i < n; i++) {
        scratch->order[i] = i;
        scratch->scale[i] = 1;
    }
    const int most = refdyn_eliminate(A, n, n, scratch->pivot, scratch->order, scratch->scale);
    while (rank < most && 1 > tol * fabs(A[rank * (n + 1)])) /* the inverse pivot */
        rank++;
    return rank;
}

/* x_c := X_pc in the factors of a matrix of this rank; c is a place in the order of its columns. */
static void solve_dependent(double *factors, int n, int rank, int c) {
    double *x = factors + c * n;
    for (int k = rank - 1; k >= 0; k--) {
        for (int l = k + 1; l < rank; l++)
            x[k] -= factors[l * n + k] * x[l];
        x[k] *= factors[k * (n + 1)];
    }
}

/* Reduces A to its block of `rank` pivot columns. */
static void remove_dependent(double *A, int n, int rank, const struct refdyn_rank_scratch *scratch) {
    int *order = scratch->order;
    for (int c = rank; c < n; c++) {
        solve_dependent(scratch->factors, n, rank, c);
        for (int k = 0; k < rank; k++)
            dense_add(A + order[k] * n, scratch->factors[c * n + k], A + order[c] * n, n);
    }
    refdyn_sort(order, rank);
    for (int i = 0; i < rank; i++)
        for (int j = 0; j < rank; j++)
            A[i * rank + j] = A[order[i] * n + order[j]];
}

int refdyn_deflate(double *A, int n, double value, double tol, const struct refdyn_rank_scratch *scratch) {
    for (;;) {
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                scratch->factors[j * n + i] = A[i * n + j] - (i == j ? value : 0);
        const int rank = refdyn_rank(scratch->factors, n, tol, scratch);
        if (rank == n)
            return n;
        remove_dependent(A, n, rank, scratch);
        n = rank;
    }
}
