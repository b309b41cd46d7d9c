/* Eigenvalues of symmetric matrices. */
#ifndef REFDYN_EIGENVALUES_H
#define REFDYN_EIGENVALUES_H

/*
 * values (n) and vectors (n x n, one a column) of a symmetric A (n x n), which is overwritten; in no order.
 * By Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5): good to rounding of the largest
 * entry.
 */
void refdyn_symmetric_eigenvalues(double *A, int n, double *values, double *vectors);

#endif
