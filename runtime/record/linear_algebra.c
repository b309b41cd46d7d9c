/* Linear algebra of small motions: products, Cholesky factors, and the changes that linear rows leave free.
 * Matrices are row by row, in memory of the caller's algebra. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/record/record.h"

void *record_allocate(const struct record_algebra *algebra, size_t count, size_t size) {
    return algebra->memory.get(algebra->memory.context, (count + 1) * size);
}

double *record_allocate_matrix(const struct record_algebra *algebra, int rows, int columns) {
    return record_allocate(algebra, (size_t)rows * (size_t)columns, sizeof(double));
}

/* ---- Products and factors ---- */

void record_add_product(double *out, double factor, const double *left, const double *right, int rows,
                        int inner, int columns) {
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < inner; k++) {
            const double entry = factor * left[i * inner + k];
            for (int j = 0; j < columns && entry != 0; j++)
                out[i * columns + j] += entry * right[k * columns + j];
        }
}

double *record_product(const struct record_algebra *algebra, const double *left, const double *right,
                       int rows, int inner, int columns) {
    double *out = record_allocate_matrix(algebra, rows, columns);
    record_add_product(out, 1, left, right, rows, inner, columns);
    return out;
}

double *record_product_of_columns(const struct record_algebra *algebra, const double *left, int left_columns,
                                  const double *right, int columns, int n) {
    double *out = record_allocate_matrix(algebra, left_columns, columns);
    for (int i = 0; i < n; i++)
        record_add_product(out, 1, left + i * left_columns, right + i * columns, left_columns, 1, columns);
    return out;
}

bool record_factor(double *matrix, int n) {
    for (int j = 0; j < n; j++) {
        for (int i = j; i < n; i++)
            for (int k = 0; k < j; k++)
                matrix[i * n + j] -= matrix[i * n + k] * matrix[j * n + k];
        if (!(matrix[j * n + j] > 0))
            return false;
        const double root = sqrt(matrix[j * n + j]);
        for (int i = j; i < n; i++)
            matrix[i * n + j] /= root;
    }
    return true;
}

void record_solve_factored(const double *factor, int n, double *columns, int count) {
    for (int i = 0; i < n; i++)
        for (int c = 0; c < count; c++) {
            for (int k = 0; k < i; k++)
                columns[i * count + c] -= factor[i * n + k] * columns[k * count + c];
            columns[i * count + c] /= factor[i * (n + 1)];
        }
    for (int i = n - 1; i >= 0; i--)
        for (int c = 0; c < count; c++) {
            for (int k = i + 1; k < n; k++)
                columns[i * count + c] -= factor[k * n + i] * columns[k * count + c];
            columns[i * count + c] /= factor[i * (n + 1)];
        }
}

/* ---- A basis of the changes that linear rows leave free ---- */

/* [R B] with each row divided by the largest entry of R in it. A row without such an entry becomes 0. */
static double *scaled_rows(const struct record_freedom *freedom, const double *R, const double *B) {
    const int n = freedom->n, width = freedom->width, stride = n + width;
    double *rows = record_allocate_matrix(freedom->algebra, freedom->count, stride);
    for (int i = 0; i < freedom->count; i++) {
        double size = 0;
        for (int j = 0; j < n; j++)
            size = fmax(size, fabs(R[i * n + j]));
        for (int j = 0; j < stride && size > 0; j++)
            rows[i * stride + j] = (j < n ? R[i * n + j] : B[i * width + j - n]) / size;
    }
    return rows;
}

/* Moves the largest entry of the rows and columns from k on to place k; returns its size. */
static double choose_pivot(struct record_freedom *freedom, const double *rows, int k) {
    const int n = freedom->n;
    double largest = 0;
    int row = k, column = k;
    for (int a = k; a < freedom->count; a++)
        for (int b = k; b < n; b++) {
            const double size = fabs(rows[freedom->row[a] * (n + freedom->width) + freedom->column[b]]);
            if (size > largest) {
                largest = size;
                row = a;
                column = b;
            }
        }
    const int row_k = freedom->row[row], column_k = freedom->column[column];
    freedom->row[row] = freedom->row[k];
    freedom->column[column] = freedom->column[k];
    freedom->row[k] = row_k;
    freedom->column[k] = column_k;
    return largest;
}

static void eliminate(const struct record_freedom *freedom, double *rows, int k) {
    const int width = freedom->n + freedom->width, column = freedom->column[k];
    double *pivot = rows + freedom->row[k] * width;
    const double size = pivot[column];
    for (int j = 0; j < width; j++)
        pivot[j] /= size;
    for (int i = 0; i < freedom->count; i++) {
        double *row = rows + i * width;
        const double factor = row[column];
        for (int j = 0; j < width && row != pivot; j++)
            row[j] -= factor * pivot[j];
    }
}

static int ascending(const void *a, const void *b) {
    return *(const int *)a - *(const int *)b;
}

static void fill(struct record_freedom *freedom, const double *rows) {
    const int n = freedom->n, width = freedom->width, rank = freedom->rank, left = n - rank;
    freedom->basis = record_allocate_matrix(freedom->algebra, n, left);
    freedom->drift = record_allocate_matrix(freedom->algebra, n, width);
    for (int k = 0; k < rank; k++) {
        const double *row = rows + freedom->row[k] * (n + width);
        for (int b = 0; b < left; b++)
            freedom->basis[freedom->column[k] * left + b] = -row[freedom->column[rank + b]];
        for (int j = 0; j < width; j++)
            freedom->drift[freedom->column[k] * width + j] = -row[n + j];
    }
    for (int b = 0; b < left; b++)
        freedom->basis[freedom->column[rank + b] * left + b] = 1;
}

void record_find_freedom(struct record_freedom *freedom, const struct record_algebra *algebra,
                         const double *R, int count, int n, const double *B, int width) {
    *freedom = (struct record_freedom){.algebra = algebra, .n = n, .count = count, .width = width};
    freedom->row = record_allocate(algebra, (size_t)count, sizeof *freedom->row);
    freedom->column = record_allocate(algebra, (size_t)n, sizeof *freedom->column);
    double *rows = scaled_rows(freedom, R, B);
    for (int i = 0; i < count; i++)
        freedom->row[i] = i;
    for (int j = 0; j < n; j++)
        freedom->column[j] = j;
    /* the tolerance of the runtime's partition of coordinates */
    while (freedom->rank < count && freedom->rank < n &&
           choose_pivot(freedom, rows, freedom->rank) > sqrt(DBL_EPSILON))
        eliminate(freedom, rows, freedom->rank++);
    qsort(freedom->column + freedom->rank, (size_t)(n - freedom->rank), sizeof *freedom->column, ascending);
    qsort(freedom->row + freedom->rank, (size_t)(count - freedom->rank), sizeof *freedom->row, ascending);
    fill(freedom, rows);
    freedom->free = n - freedom->rank;
}

void record_freedom_drop(struct record_freedom *freedom, int count) {
    const int before = freedom->free;
    freedom->free -= count;
    for (int i = 0; i < freedom->n; i++)
        memmove(freedom->basis + i * freedom->free, freedom->basis + i * before,
                (size_t)freedom->free * sizeof *freedom->basis);
}
