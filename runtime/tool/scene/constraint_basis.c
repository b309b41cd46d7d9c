/* A basis of the changes that linear rows leave free, by elimination with full pivoting. */
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* [R B] with each row divided by the largest entry of R in it. A row without such an entry becomes 0. */
static double *scaled_rows(const double *R, const double *B, int count, int n) {
    double *rows = format_allocate((size_t)count * 2 * (size_t)n, sizeof *rows);
    for (int i = 0; i < count; i++) {
        double size = 0;
        for (int j = 0; j < n; j++)
            size = fmax(size, fabs(R[i * n + j]));
        for (int j = 0; j < n && size > 0; j++) {
            rows[2 * i * n + j] = R[i * n + j] / size;
            rows[(2 * i + 1) * n + j] = B ? B[i * n + j] / size : 0;
        }
    }
    return rows;
}

/* Moves the largest entry of the rows and columns from k on to place k; returns its size. */
static double choose_pivot(struct freedom *freedom, const double *rows, int k) {
    const int n = freedom->n;
    double largest = 0;
    int row = k, column = k;
    for (int a = k; a < freedom->count; a++)
        for (int b = k; b < n; b++) {
            const double size = fabs(rows[2 * freedom->row[a] * n + freedom->column[b]]);
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

static void eliminate(const struct freedom *freedom, double *rows, int k) {
    const int width = 2 * freedom->n, column = freedom->column[k];
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

static void fill(struct freedom *freedom, const double *rows) {
    const int n = freedom->n, rank = freedom->rank, left = n - rank;
    freedom->basis = format_allocate((size_t)(n * left), sizeof *freedom->basis);
    freedom->drift = format_allocate((size_t)(n * n), sizeof *freedom->drift);
    for (int k = 0; k < rank; k++) {
        const double *row = rows + 2 * freedom->row[k] * n;
        for (int b = 0; b < left; b++)
            freedom->basis[freedom->column[k] * left + b] = -row[freedom->column[rank + b]];
        for (int j = 0; j < n; j++)
            freedom->drift[freedom->column[k] * n + j] = -row[n + j];
    }
    for (int b = 0; b < left; b++)
        freedom->basis[freedom->column[rank + b] * left + b] = 1;
}

void scene_find_freedom(struct freedom *freedom, const double *R, const double *B, int count, int n) {
    *freedom = (struct freedom){.n = n, .count = count};
    freedom->row = format_allocate((size_t)count, sizeof *freedom->row);
    freedom->column = format_allocate((size_t)n, sizeof *freedom->column);
    double *rows = scaled_rows(R, B, count, n);
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
}
