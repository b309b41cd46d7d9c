/*
 * Small motions about the equilibrium in a live page, as `refdyn modes` computes them, with linear algebra
 * that needs no LAPACK: LU factors and eigenvalues of the core, complex eigenvectors by inverse iteration
 * (Golub and Van Loan, Matrix Computations, 7.6), singular values by one-sided rotations (Hestenes, J. SIAM
 * 6:51-90, 1958).
 */
#include "runtime/core/linear/linear.h"
#include "runtime/tool/results/live/module/live_module.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum {
    PARTS = 2,       /* real and imaginary */
    ITERATIONS = 3,  /* of an eigenvector; each divides its error by about the precision of the eigenvalue */
    SWEEPS_MOST = 60 /* of rotations, which converge quadratically; about ten suffice */
};

/* Equal eigenvalues with one vector split by the root of the rounding, measured by themselves. */
static const double split_tol = 1e-6;

static double *new_numbers(struct live *live, int rows, int columns) {
    return live_get_block(live, (size_t)rows * (size_t)columns * sizeof(double));
}

/* ---- Linear equations ---- */

/* LU factors of a matrix (parts x n x n), which they overwrite. Returns whether it is regular. */
static bool factor(struct live *live, int parts, double *matrix, int n, int *pivot) {
    double *scale = new_numbers(live, n, 1);
    for (int i = 0; i < n; i++) {
        double largest = 0;
        for (int part = 0; part < parts; part++)
            for (int j = 0; j < n; j++)
                largest = fmax(largest, fabs(matrix[(part * n + i) * n + j]));
        scale[i] = largest > 0 ? 1 / largest : 0;
    }
    return refdyn_lu_factor(parts > 1, matrix, n, pivot, scale);
}

static bool solve(void *context, int n, const double *matrix, bool is_transposed, double *columns) {
    struct live *live = context;
    double *factors = new_numbers(live, n, n), *column = new_numbers(live, n, 1);
    int *pivot = live_get_block(live, (size_t)n * sizeof *pivot);
    memcpy(factors, matrix, (size_t)(n * n) * sizeof *factors);
    if (!factor(live, 1, factors, n, pivot))
        return false;
    if (is_transposed)
        refdyn_lu_solve_transposed(factors, n, pivot, columns, n, n);
    for (int c = 0; c < n && !is_transposed; c++) {
        for (int i = 0; i < n; i++)
            column[i] = columns[i * n + c];
        refdyn_lu_solve(0, factors, n, pivot, column);
        for (int i = 0; i < n; i++)
            columns[i * n + c] = column[i];
    }
    return true;
}

/* ---- Singular values ---- */

static double product_of_columns(const double *A, int rows, int columns, int p, int q) {
    double sum = 0;
    for (int i = 0; i < rows; i++)
        sum += A[i * columns + p] * A[i * columns + q];
    return sum;
}

static void rotate_columns(double *A, int rows, int columns, int p, int q, double c, double s) {
    for (int i = 0; i < rows; i++) {
        double *row = A + i * columns;
        const double a = row[p], b = row[q];
        row[p] = c * a - s * b;
        row[q] = s * a + c * b;
    }
}

/* Makes all columns of A = U S V^T orthogonal once: A becomes U S. Returns whether there was anything to do.
 */
static bool sweep(double *A, int rows, int columns, double *V) {
    bool has_turned = false;
    for (int p = 0; p < columns; p++)
        for (int q = p + 1; q < columns; q++) {
            const double pp = product_of_columns(A, rows, columns, p, p);
            const double qq = product_of_columns(A, rows, columns, q, q);
            const double pq = product_of_columns(A, rows, columns, p, q);
            if (!(fabs(pq) > DBL_EPSILON * sqrt(pp) * sqrt(qq)))
                continue;
            const double tau = (qq - pp) / (2 * pq);
            const double t = copysign(1, tau) / (fabs(tau) + sqrt(1 + tau * tau)), c = 1 / sqrt(1 + t * t);
            rotate_columns(A, rows, columns, p, q, c, c * t);
            rotate_columns(V, columns, columns, p, q, c, c * t);
            has_turned = true;
        }
    return has_turned;
}

/* A (rows x columns) becomes U S; returns V (columns x columns). */
static double *decompose(struct live *live, double *A, int rows, int columns) {
    double *V = new_numbers(live, columns, columns);
    for (int j = 0; j < columns; j++)
        V[j * (columns + 1)] = 1;
    for (int i = 0; i < SWEEPS_MOST && sweep(A, rows, columns, V); i++)
        continue;
    return V;
}

/* ---- Eigenvectors ---- */

struct iteration {
    struct live *live;
    int n;
    const double *T;    /* (n x n) */
    double size;        /* largest entry of T */
    double *matrix;     /* (2 x n x n) */
    double *x;          /* (2 x n) */
    int *pivot;         /* (n) */
    unsigned long seed; /* of the vectors from which iterations begin */
};

/* Vectors of equal pairs must begin differently, or they would be the same. */
static void begin_vector(struct iteration *iteration) {
    for (int i = 0; i < PARTS * iteration->n; i++) {
        iteration->seed =
            (1103515245UL * iteration->seed + 12345) & 0x7fffffff; /* rand() of the C standard */
        iteration->x[i] = (double)iteration->seed / 0x40000000 - 1;
    }
}

static void normalise(double *x, int count) {
    const double largest = refdyn_largest(x, count, NULL);
    for (int i = 0; i < count; i++)
        x[i] /= largest;
}

/* matrix := T - tau, or T^T - tau */
static void put_shifted(struct iteration *iteration, bool is_transposed, double re, double im) {
    const int n = iteration->n;
    double *matrix = iteration->matrix;
    memset(matrix, 0, (size_t)(PARTS * n * n) * sizeof *matrix);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            matrix[i * n + j] = iteration->T[is_transposed ? j * n + i : i * n + j];
        matrix[i * (n + 1)] -= re;
        matrix[n * n + i * (n + 1)] -= im;
    }
}

/* Iterates with (T - tau)^-1, or with (T^T - tau)^-1, off tau by its rounding, so that the matrix is regular.
 * Returns whether the vector x is finite. */
static bool iterate(struct iteration *iteration, bool is_transposed, double re, double im) {
    const int n = iteration->n;
    double *matrix = iteration->matrix;
    put_shifted(iteration, is_transposed, re + DBL_EPSILON * iteration->size, im);
    if (!factor(iteration->live, PARTS, matrix, n, iteration->pivot))
        return false;
    begin_vector(iteration);
    for (int i = 0; i < ITERATIONS; i++) {
        refdyn_lu_solve(1, matrix, n, iteration->pivot, iteration->x);
        normalise(iteration->x, PARTS * n);
    }
    return refdyn_is_finite(iteration->x, PARTS * n);
}

/* Vectors x with T x = tau x, or T^T x = tau x, for a real tau: those of V with the singular values of T -
 * tau that are 0 within the splitting. Of several equal eigenvalues, number i takes vectors i and i + 1. */
static void choose_real(struct iteration *iteration, bool is_transposed, double tau, int number) {
    const int n = iteration->n;
    double *matrix = iteration->matrix, smallest = INFINITY;
    int count = 0;
    put_shifted(iteration, is_transposed, tau, 0);
    const double *V = decompose(iteration->live, matrix, n, n);
    for (int j = 0; j < n; j++)
        smallest = fmin(smallest, sqrt(product_of_columns(matrix, n, n, j, j)));
    const double most = fmax(smallest, split_tol * fabs(tau));
    int *places = live_get_block(iteration->live, (size_t)n * sizeof *places);
    for (int j = 0; j < n; j++)
        if (sqrt(product_of_columns(matrix, n, n, j, j)) <= most)
            places[count++] = j;
    for (int part = 0; part < PARTS && count > 0; part++)
        for (int i = 0; i < n; i++)
            iteration->x[part * n + i] = V[i * n + places[(number + part) % count]];
}

/* Writes the vector into columns k and, of a pair, k + 1. */
static void put_vector(const struct iteration *iteration, double *vectors, int k, bool is_pair) {
    const int n = iteration->n;
    for (int i = 0; i < n; i++)
        for (int part = 0; part < (is_pair ? 2 : 1); part++)
            vectors[i * n + k + part] = iteration->x[part * n + i];
}

/* A pair with small imaginary parts is a double real eigenvalue that has split. */
static bool is_real(const double *re, const double *im, int k) {
    return fabs(im[k]) <= split_tol * fabs(re[k]);
}

/* The number of real eigenvalues before k that equal it. */
static int count_equal(const double *re, const double *im, int k) {
    int count = 0;
    for (int i = 0; i < k; i++)
        count += is_real(re, im, i) && fabs(re[i] - re[k]) <= split_tol * fabs(re[k]);
    return count;
}

/* Writes the left and the right vector of eigenvalue k. */
static bool put_vectors(struct iteration *iteration, const double *re, const double *im, int k, double *left,
                        double *right) {
    for (int side = 0; side < 2; side++) {
        if (is_real(re, im, k))
            choose_real(iteration, side, re[k], count_equal(re, im, k));
        else if (!iterate(iteration, side, re[k], side ? -im[k] : im[k]))
            return false;
        put_vector(iteration, side ? left : right, k, im[k] != 0);
    }
    return true;
}

static bool find_eigenvectors(void *context, int n, double *T, double *re, double *im, double *left,
                              double *right) {
    struct live *live = context;
    struct iteration iteration = {.live = live,
                                  .n = n,
                                  .T = T,
                                  .size = refdyn_largest(T, n * n, NULL),
                                  .matrix = new_numbers(live, PARTS * n, n),
                                  .x = new_numbers(live, PARTS, n),
                                  .pivot = live_get_block(live, (size_t)n * sizeof(int)),
                                  .seed = 1};
    double *reduced = new_numbers(live, n, n);
    memcpy(reduced, T, (size_t)(n * n) * sizeof *reduced);
    if (!refdyn_eigenvalues(reduced, n, re, im))
        return false;
    for (int k = 0; k < n; k += im[k] != 0 ? 2 : 1)
        if (!put_vectors(&iteration, re, im, k, left, right))
            return false;
    return true;
}

/* ---- Least squares ---- */

/* x = V S^+ U^T b */
static bool solve_least_squares(void *context, int rows, int columns, double *A, double *b, double tol,
                                double *x) {
    const double *V = decompose(context, A, rows, columns);
    double largest = 0;
    for (int j = 0; j < columns; j++)
        largest = fmax(largest, product_of_columns(A, rows, columns, j, j));
    memset(x, 0, (size_t)columns * sizeof *x);
    for (int j = 0; j < columns; j++) {
        const double square = product_of_columns(A, rows, columns, j, j);
        double along = 0;
        for (int i = 0; i < rows && square > tol * tol * largest; i++)
            along += A[i * columns + j] * b[i] / square;
        for (int i = 0; i < columns; i++)
            x[i] += along * V[i * columns + j];
    }
    return refdyn_is_finite(x, columns);
}

/* ---- Small motions ---- */

static bool has_modes(const struct refdyn_model *model) {
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level == REFDYN_ACCELERATION)
            return false;
    return model->tangent != NULL;
}

/* Returns a status of the runtime. */
static int find_modes(struct live *live, struct record_spectrum *spectrum) {
    const struct record_algebra algebra = {.memory = {live_get_block, live},
                                           .context = live,
                                           .solve = solve,
                                           .eigen = find_eigenvectors,
                                           .least_squares = solve_least_squares};
    struct record_small_motions motions = {
        .work = &live->work, .q = live->q, .qd = live->qd, .held = live->held};
    const int status = record_find_small_motions(&motions, &algebra);
    *spectrum = motions.spectrum;
    return status;
}

/* Finds the equilibrium for the values of the last motion, and small motions about it. Ends the motion: call
 * it after its rows are read. Returns their number, or -1 with a message: "" if the model can have none. */
EXPORT(live_find_modes) int live_find_modes(struct live *live) {
    struct record_spectrum spectrum;
    live_clear_message(live);
    if (!has_modes(live->work.model))
        return -1;
    const int status = live_set_equilibrium(live);
    if (status != REFDYN_OK) {
        live_explain_start(live, status);
        return -1;
    }
    if (find_modes(live, &spectrum) != REFDYN_OK)
        return -1;
    live->modes = new_numbers(live, spectrum.count, PARTS);
    for (int i = 0; i < spectrum.count; i++) {
        live->modes[PARTS * i] = record_frequency_of(&spectrum.modes[i]);
        live->modes[PARTS * i + 1] = record_damping_of(&spectrum.modes[i]);
    }
    return spectrum.count;
}

/* (count x 2) frequency [Hz] and damping ratio of each mode, in the order of `refdyn modes`. */
EXPORT(live_modes) const double *live_modes(struct live *live) {
    return live->modes;
}
