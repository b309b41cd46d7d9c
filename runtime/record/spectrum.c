/*
 * Eigenvalues and shapes of small motions, from the linear equations of a model at rest.
 *
 * Coordinates are measured in 1/sqrt(M_jj). Motions satisfy x = Z y by the position rows and x' = N w + G x
 * by all rows (struct record_freedom); y leaves out states of controllers. The equations are the pencil
 *
 *     y' = (N w + G Z y)_independent,
 *     N^T M N w' = -N^T ((K + (D + M G) G) Z y + (D + M G) N w),
 *
 * or E z' = A z, with a time unit 1/s between those of stiff and soft coordinates. The eigenvalues tau of
 * (A - E)^-1 E, with balancing (as LAPACK dgeev), give mu = 1 + 1/tau. So both ends of a wide spectrum keep
 * their digits, while E^-1 A loses those of the low end. Each is then improved by the generalized Rayleigh
 * quotient of its left and right vectors (Ostrowski, Arch. Rational Mech. Anal. 3:325-340, 1959), whose error
 * is the product of theirs.
 */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/record/record.h"

/* ---- Eigenvalues and shapes ---- */

/* Smaller eigenvalues are 0, in units of the scale s. A double eigenvalue 0 with one vector splits by
 * sqrt(DBL_EPSILON). */
static const double zero_tol = 1e-6;
/* Smaller damping ratios are rounding. */
static const double axis_tol = 1e-10;
/* Pairs with a smaller relative distance are double: a critically damped eigenvalue splits by
 * sqrt(DBL_EPSILON). */
static const double pair_tol = 1e-7;
/* Shapes of equal eigenvalues that differ by less are the same shape. */
static const double same_tol = 1e-4;
/* Sizes of eigenvalues, or of entries of a shape, that differ by less are equal. */
static const double equal_tol = 1e-9;
/* Largest relative improvement of an eigenvalue; larger ones mean that its left and right vectors are nearly
 * orthogonal. */
static const double improvement_limit = 1e-3;
/* Smaller parts of the largest entry of a shape are rounding. */
static const double part_tol = 1e-12;
/* Rates below this part of the highest one do not affect the scale. */
static const double low_share = 1e-6;
/* Shift as a part of the scale; an irrational number (the golden ratio less 1) meets no eigenvalue of a
 * closed form. */
static const double shift_share = 0.6180339887498949;

struct pencil {
    const struct record_algebra *algebra;
    const struct record_linear *linear;
    int n, position_count, size; /* of x, y, z */
    double *unit;                /* (n) 1/sqrt(M_jj) */
    double *M, *D, *K;           /* (n x n) scaled */
    struct record_freedom position, velocity;
    double scale;                           /* s [1/s] */
    double *A, *E;                          /* (size x size) */
    double *tau_re, *tau_im, *left, *right; /* (size), (size x size): as dgeev returns them */
};

/* ---- The pencil ---- */

static double *scaled(const struct pencil *pencil, const double *matrix, int rows, bool both) {
    const int n = pencil->n;
    double *out = record_allocate_matrix(pencil->algebra, rows, n);
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < n; j++)
            out[i * n + j] = (both ? pencil->unit[i] : 1) * matrix[i * n + j] * pencil->unit[j];
    return out;
}

/* The geometric mean of the largest and the smallest sqrt(K_jj / M_jj), or of D_jj / M_jj if nothing is
 * stiff, times the shift. */
static void choose_scale(struct pencil *pencil) {
    double low = INFINITY, high = 0;
    for (int order = 0; order < 2 && high == 0; order++)
        for (int j = 0; j < pencil->n; j++) {
            const double entry = fabs((order ? pencil->D : pencil->K)[j * (pencil->n + 1)]);
            const double rate = order ? entry : sqrt(entry);
            low = rate > 0 ? fmin(low, rate) : low;
            high = fmax(high, rate);
        }
    pencil->scale = shift_share * (high > 0 ? sqrt(fmax(low, low_share * high)) * sqrt(high) : 1);
}

static void find_freedoms(struct pencil *pencil) {
    const struct record_linear *linear = pencil->linear;
    const int n = pencil->n;
    double *u = scaled(pencil, linear->u, linear->m, false);
    double *psi_q = scaled(pencil, linear->psi_q, linear->m, false);
    double *level_q = record_allocate_matrix(pencil->algebra, linear->m, n);
    int count = 0;
    for (int i = 0; i < linear->m; i++)
        if (linear->level[i] == REFDYN_POSITION) {
            memcpy(level_q + count++ * n, u + i * n, (size_t)n * sizeof *u);
            memset(psi_q + i * n, 0, (size_t)n * sizeof *psi_q);
        }
    record_find_freedom(&pencil->position, pencil->algebra, level_q, count, n, NULL, 0);
    record_find_freedom(&pencil->velocity, pencil->algebra, u, linear->m, n, psi_q, n);
    record_freedom_drop(&pencil->position, linear->states);
    pencil->position_count = pencil->position.free;
    pencil->size = pencil->position_count + n - pencil->velocity.rank;
}

static void put_block(const struct pencil *pencil, double *matrix, int row, int column, const double *block,
                      int rows, int columns, double factor) {
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++)
            matrix[(row + i) * pencil->size + column + j] = factor * block[i * columns + j];
}

/* y' : rows of x' that are independent in position. */
static void put_rates(struct pencil *pencil, const double *drift, int rates) {
    const int positions = pencil->position_count;
    for (int i = 0; i < positions; i++) {
        const int row = pencil->position.column[pencil->position.rank + i];
        put_block(pencil, pencil->A, i, 0, drift + row * positions, 1, positions, 1 / pencil->scale);
        put_block(pencil, pencil->A, i, positions, pencil->velocity.basis + row * rates, 1, rates, 1);
        pencil->E[i * (pencil->size + 1)] = 1;
    }
}

/* Returns REFDYN_MASS_NOT_POSITIVE if the mass of the free motion has no Cholesky factor. */
static int put_motion(struct pencil *pencil, const double *drift, int rates) {
    const int n = pencil->n, positions = pencil->position_count;
    const double *N = pencil->velocity.basis, s = pencil->scale;
    double *damping = record_product(pencil->algebra, pencil->M, pencil->velocity.drift, n, n, n);
    double *stiffness = record_product(pencil->algebra, pencil->K, pencil->position.basis, n, n, positions);
    for (int i = 0; i < n * n; i++)
        damping[i] += pencil->D[i];
    record_add_product(stiffness, 1, damping, drift, n, n, positions);
    double *on_rates = record_product(pencil->algebra, damping, N, n, n, rates),
           *mass = record_product(pencil->algebra, pencil->M, N, n, n, rates);
    double *mass_part = record_product_of_columns(pencil->algebra, N, rates, mass, rates, n);
    double *stiffness_part = record_product_of_columns(pencil->algebra, N, rates, stiffness, positions, n);
    double *damping_part = record_product_of_columns(pencil->algebra, N, rates, on_rates, rates, n);
    put_block(pencil, pencil->E, positions, positions, mass_part, rates, rates, 1);
    put_block(pencil, pencil->A, positions, 0, stiffness_part, rates, positions, -1 / (s * s));
    put_block(pencil, pencil->A, positions, positions, damping_part, rates, rates, -1 / s);
    return record_factor(mass_part, rates) ? REFDYN_OK : REFDYN_MASS_NOT_POSITIVE;
}

static int build_pencil(struct pencil *pencil, const struct record_algebra *algebra,
                        const struct record_linear *linear) {
    const int n = linear->n;
    *pencil = (struct pencil){.algebra = algebra, .linear = linear, .n = n};
    pencil->unit = record_allocate_matrix(pencil->algebra, n, 1);
    for (int j = 0; j < n; j++)
        pencil->unit[j] = 1 / sqrt(linear->M[j * (n + 1)]);
    pencil->M = scaled(pencil, linear->M, n, true);
    pencil->D = scaled(pencil, linear->D, n, true);
    pencil->K = scaled(pencil, linear->K, n, true);
    choose_scale(pencil);
    find_freedoms(pencil);
    pencil->A = record_allocate_matrix(pencil->algebra, pencil->size, pencil->size);
    pencil->E = record_allocate_matrix(pencil->algebra, pencil->size, pencil->size);
    const int positions = pencil->position_count, rates = pencil->size - positions;
    double *drift =
        record_product(pencil->algebra, pencil->velocity.drift, pencil->position.basis, n, n, positions);
    put_rates(pencil, drift, rates);
    return put_motion(pencil, drift, rates);
}

/* ---- Eigenvalues ---- */

static int solve_pencil(struct pencil *pencil) {
    const struct record_algebra *algebra = pencil->algebra;
    const int size = pencil->size;
    double *T = record_allocate_matrix(algebra, size, size),
           *shifted = record_allocate_matrix(algebra, size, size);
    pencil->tau_re = record_allocate_matrix(algebra, size, 1);
    pencil->tau_im = record_allocate_matrix(algebra, size, 1);
    pencil->left = record_allocate_matrix(algebra, size, size);
    pencil->right = record_allocate_matrix(algebra, size, size);
    for (int i = 0; i < size * size; i++) {
        shifted[i] = pencil->A[i] - pencil->E[i];
        T[i] = pencil->E[i];
    }
    bool is_solved = algebra->solve(algebra->context, size, shifted, false, T) &&
                     algebra->eigen(algebra->context, size, T, pencil->tau_re, pencil->tau_im, pencil->left,
                                    pencil->right);
    /* T^H w = conj(tau) w and w = (A - E)^H v: v is the pencil's left vector; it is real-linear in w */
    is_solved = is_solved && algebra->solve(algebra->context, size, shifted, true, pencil->left);
    return is_solved ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* Entry i of vector k: dgeev keeps real and imaginary parts of a pair in two columns. */
static double complex entry(const struct pencil *pencil, const double *vectors, int i, int k) {
    const double *row = vectors + i * pencil->size;
    return pencil->tau_im[k] == 0 ? row[k] : row[k] + I * row[k + 1];
}

/* mu - v^H (mu E - A) z / (v^H E z) */
static double complex improved(const struct pencil *pencil, double complex mu, int k) {
    double complex residual = 0, weight = 0;
    for (int i = 0; i < pencil->size; i++) {
        const double complex v = conj(entry(pencil, pencil->left, i, k));
        double complex on_A = 0, on_E = 0;
        for (int j = 0; j < pencil->size; j++) {
            const double complex z = entry(pencil, pencil->right, j, k);
            on_A += pencil->A[i * pencil->size + j] * z;
            on_E += pencil->E[i * pencil->size + j] * z;
        }
        residual += v * (mu * on_E - on_A);
        weight += v * on_E;
    }
    const double complex correction = residual / weight;
    return cabs(correction) <= improvement_limit * cabs(mu) ? mu - correction : mu;
}

/* Sets a real part that is rounding to 0. */
static double complex rounded(double complex mu) {
    const double size = cabs(mu);
    return fabs(creal(mu)) <= axis_tol * size ? I * cimag(mu) : mu;
}

/* ---- Shapes ---- */

/* Index of the largest entry of x; of entries equal within rounding, the first. */
static int largest_entry(const double complex *x, int n) {
    double largest = 0;
    for (int j = 0; j < n; j++)
        largest = fmax(largest, cabs(x[j]));
    for (int j = 0; j < n; j++)
        if (cabs(x[j]) >= (1 - equal_tol) * largest)
            return j;
    return -1;
}

static double complex without_rounding(double complex value) {
    const double re = creal(value), im = cimag(value);
    return (fabs(re) > part_tol ? re : 0) + I * (fabs(im) > part_tol ? im : 0);
}

/* Divides by the largest entry of the coordinates or, where they are at rest, of the states after them. */
static void normalise(double complex *x, int n, int joints) {
    const int of_all = largest_entry(x, n), of_joints = largest_entry(x, joints);
    const int at = of_joints >= 0 && cabs(x[of_joints]) > part_tol * cabs(x[of_all]) ? of_joints : of_all;
    const double complex size = at < 0 ? 1 : x[at];
    for (int j = 0; j < n && size != 0; j++)
        x[j] = j == at ? 1 : without_rounding(x[j] / size);
}

/* x = Z y of vector k, of states their own values s N w, in the model's units. */
static double complex *shape_of(const struct pencil *pencil, int k) {
    const int positions = pencil->position_count, rates = pencil->size - positions;
    const int joints = pencil->n - pencil->linear->states;
    double complex *x = record_allocate(pencil->algebra, (size_t)pencil->n, sizeof *x);
    for (int i = 0; i < pencil->n; i++) {
        for (int j = 0; j < positions; j++)
            x[i] += pencil->position.basis[i * positions + j] * entry(pencil, pencil->right, j, k);
        for (int j = 0; j < rates && i >= joints; j++)
            x[i] += pencil->scale * pencil->velocity.basis[i * rates + j] *
                    entry(pencil, pencil->right, positions + j, k);
        x[i] *= pencil->unit[i];
    }
    normalise(x, pencil->n, joints);
    return x;
}

static void add_mode(struct record_spectrum *spectrum, double complex eigenvalue,
                     const double complex *shape) {
    spectrum->modes[spectrum->count++] = (struct record_mode){eigenvalue, shape};
}

/* ---- Eigenvalues 0 ---- */

/* Real and imaginary parts of vectors with eigenvalue 0, one a row. A motion at constant speed and the rest
 * at its start have the same positions within rounding, so elimination keeps one of both. */
struct resting {
    double *vectors; /* (count x n) */
    int count;
};

static void add_resting(struct resting *resting, const double complex *x, int n, bool is_real) {
    for (int part = 0; part < (is_real ? 1 : 2); part++, resting->count++)
        for (int j = 0; j < n; j++)
            resting->vectors[resting->count * n + j] = part ? cimag(x[j]) : creal(x[j]);
}

/* Size, row and column of the largest entry from row `from` on; of entries equal within rounding, the first.
 */
static double find_largest(const struct resting *resting, int n, int from, int *row, int *column) {
    double largest = 0;
    for (int i = from; i < resting->count; i++)
        for (int j = 0; j < n; j++)
            if (fabs(resting->vectors[i * n + j]) > (1 + equal_tol) * largest) {
                largest = fabs(resting->vectors[i * n + j]);
                *row = i;
                *column = j;
            }
    return largest;
}

static void exchange_rows(double *a, double *b, int n) {
    for (int j = 0; j < n; j++) {
        const double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

static void clear_column(struct resting *resting, int n, int row, int column) {
    double *pivot = resting->vectors + row * n;
    const double size = pivot[column];
    for (int j = 0; j < n; j++)
        pivot[j] /= size;
    for (int i = 0; i < resting->count; i++) {
        double *vector = resting->vectors + i * n;
        const double factor = vector[column];
        for (int j = 0; j < n && i != row; j++)
            vector[j] -= factor * pivot[j];
    }
}

/* Adds one mode for each pivot coordinate of the vectors, in the order of the coordinates. */
static void add_resting_modes(struct record_spectrum *spectrum, struct resting *resting, int n, int joints) {
    int *row_of = record_allocate(spectrum->algebra, (size_t)n, sizeof *row_of), count = 0, row, column;
    while (count < resting->count && find_largest(resting, n, count, &row, &column) > same_tol) {
        exchange_rows(resting->vectors + row * n, resting->vectors + count * n, n);
        clear_column(resting, n, count, column);
        row_of[column] = ++count;
    }
    for (int j = 0; j < n; j++) {
        if (!row_of[j])
            continue;
        const double *vector = resting->vectors + (row_of[j] - 1) * n;
        double complex *x = record_allocate(spectrum->algebra, (size_t)n, sizeof *x);
        for (int i = 0; i < n; i++)
            x[i] = fabs(vector[i]) > zero_tol ? vector[i] : 0;
        normalise(x, n, joints);
        add_mode(spectrum, 0, x);
    }
}

/* ---- All modes ---- */

static bool stands_before(const struct record_mode *a, const struct record_mode *b) {
    const double size_a = cabs(a->eigenvalue), size_b = cabs(b->eigenvalue);
    if (fabs(size_a - size_b) > equal_tol * fmax(size_a, size_b))
        return size_a < size_b;
    return creal(a->eigenvalue) > creal(b->eigenvalue);
}

static void sort_modes(struct record_spectrum *spectrum) {
    for (int i = 1; i < spectrum->count; i++)
        for (int j = i; j > 0 && stands_before(&spectrum->modes[j], &spectrum->modes[j - 1]); j--) {
            const struct record_mode kept = spectrum->modes[j];
            spectrum->modes[j] = spectrum->modes[j - 1];
            spectrum->modes[j - 1] = kept;
        }
}

/* Adds a pair that is real within rounding as two modes. Their shapes differ unless the system is defective.
 */
static void add_real_pair(struct record_spectrum *spectrum, double eigenvalue, const double complex *x, int n,
                          int joints) {
    double complex *parts = record_allocate(spectrum->algebra, 2 * (size_t)n, sizeof *parts);
    double apart = 0;
    for (int j = 0; j < n; j++) {
        parts[j] = creal(x[j]);
        parts[n + j] = cimag(x[j]);
        apart = fmax(apart, fabs(cimag(x[j])));
    }
    normalise(parts, n, joints);
    normalise(parts + n, n, joints);
    add_mode(spectrum, eigenvalue, parts);
    add_mode(spectrum, eigenvalue, apart > same_tol ? parts + n : parts);
}

/* dgeev lists the tau with positive imaginary part first; its mu = 1 + 1/tau has a negative one. */
static void add_vector(struct record_spectrum *spectrum, const struct pencil *pencil, struct resting *resting,
                       int k) {
    const int n = pencil->n;
    const bool is_real = pencil->tau_im[k] == 0;
    const double complex mu = 1 + 1 / (pencil->tau_re[k] + I * pencil->tau_im[k]);
    double complex *x = shape_of(pencil, k);
    if (cabs(mu) <= zero_tol)
        add_resting(resting, x, n, is_real);
    else {
        const double complex eigenvalue = pencil->scale * rounded(conj(improved(pencil, mu, k)));
        for (int j = 0; j < n; j++)
            x[j] = conj(x[j]);
        if (!is_real && fabs(cimag(eigenvalue)) <= pair_tol * cabs(eigenvalue))
            add_real_pair(spectrum, creal(eigenvalue), x, n, n - pencil->linear->states);
        else
            add_mode(spectrum, eigenvalue, x);
    }
}

static void collect(struct record_spectrum *spectrum, const struct pencil *pencil) {
    const int n = pencil->n;
    struct resting resting = {.vectors = record_allocate_matrix(pencil->algebra, pencil->size, n)};
    spectrum->modes = record_allocate(pencil->algebra, (size_t)pencil->size, sizeof *spectrum->modes);
    for (int k = 0; k < pencil->size; k += pencil->tau_im[k] == 0 ? 1 : 2)
        add_vector(spectrum, pencil, &resting, k);
    add_resting_modes(spectrum, &resting, n, n - pencil->linear->states);
    sort_modes(spectrum);
}

int record_find_spectrum(struct record_spectrum *spectrum, const struct record_linear *linear,
                         const struct record_algebra *algebra) {
    struct pencil pencil;
    *spectrum = (struct record_spectrum){.algebra = algebra};
    int status = build_pencil(&pencil, algebra, linear);
    if (status == REFDYN_OK && pencil.size > 0)
        status = solve_pencil(&pencil);
    if (status == REFDYN_OK) {
        collect(spectrum, &pencil);
        spectrum->redundant = pencil.velocity.row + pencil.velocity.rank;
        spectrum->redundant_count = pencil.velocity.count - pencil.velocity.rank;
    }
    return status;
}
