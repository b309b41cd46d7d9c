/* Linear algebra by LAPACK for small motions and linear models. */
#include <lapacke.h>
#include <string.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/support/format/format.h"

static void *allocate(void *arena, size_t size) {
    return memory_get(arena, size);
}

static bool solve(void *context, int size, const double *matrix, bool is_transposed, double *columns) {
    double *factor = format_allocate_matrix(size, size);
    lapack_int *pivots = format_allocate((size_t)size, sizeof *pivots);
    (void)context;
    memcpy(factor, matrix, (size_t)size * (size_t)size * sizeof *factor);
    lapack_int info = LAPACKE_dgetrf(LAPACK_ROW_MAJOR, size, size, factor, size, pivots);
    if (info == 0)
        info = LAPACKE_dgetrs(LAPACK_ROW_MAJOR, is_transposed ? 'T' : 'N', size, size, factor, size, pivots,
                              columns, size);
    return info == 0;
}

static bool find_eigenvalues(void *context, int size, double *T, double *re, double *im, double *left,
                             double *right) {
    (void)context;
    return LAPACKE_dgeev(LAPACK_ROW_MAJOR, 'V', 'V', size, T, size, re, im, left, size, right, size) == 0;
}

static bool solve_least_squares(void *context, int rows, int columns, double *A, double *b, double tol,
                                double *x) {
    double *singular = format_allocate_matrix(rows > columns ? rows : columns, 1);
    lapack_int rank;
    (void)context;
    const lapack_int info =
        LAPACKE_dgelsd(LAPACK_ROW_MAJOR, rows, columns, 1, A, columns, b, 1, singular, tol, &rank);
    memcpy(x, b, (size_t)columns * sizeof *x);
    return info == 0;
}

const struct record_algebra equilibria_algebra = {.memory = {allocate, &format_memory},
                                                  .solve = solve,
                                                  .eigen = find_eigenvalues,
                                                  .least_squares = solve_least_squares};
