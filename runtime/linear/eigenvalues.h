/* Eigenvalues of symmetric and of general matrices. */
#ifndef REFDYN_EIGENVALUES_H
#define REFDYN_EIGENVALUES_H

/*
 * values (n) and vectors (n x n, one a column) of a symmetric A (n x n), which is overwritten; in no order.
 * By Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5): good to rounding of the largest
 * entry.
 */
void refdyn_symmetric_eigenvalues(double *A, int n, double *values, double *vectors);

/*
 * re and im (n) of the eigenvalues of any A (n x n), which is overwritten. Complex pairs are neighbours, the
 * one with im > 0 first. By Householder's reflections to Hessenberg form and Francis's double shifts (Golub
 * and Van Loan, Matrix Computations, 7.4, 7.5). Returns 0 where they do not converge.
 */
int refdyn_eigenvalues(double *A, int n, double *re, double *im);

#endif
