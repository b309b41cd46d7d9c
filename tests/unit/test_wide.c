/*
 * The kernels of elimination.c and dense.c compared with plain triple loops in long double, and with
 * themselves compiled for any processor: results do not depend on wide vectors.
 *
 * Bounds on rounding are from Higham, Accuracy and Stability of Numerical Algorithms, 3.1 and 9.3: |P A - L
 * U| <= n eps |L| |U| and |A x - b| <= 3 n eps |L| |U| |x|, entry by entry; four times as much for complex
 * numbers.
 */
#include <float.h>
#include <math.h>
#include <string.h>

#include "check.h"
#include "runtime/core/linear/linear.h"

/* Both files again, without wide vectors, under separate names. */
#undef __x86_64__
#define refdyn_eliminate plain_eliminate
#define refdyn_lu_factor plain_lu_factor
#define refdyn_lu_solve plain_lu_solve
#define refdyn_lu_solve_transposed plain_lu_solve_transposed
#include "runtime/core/linear/elimination.c"
#undef refdyn_eliminate
#undef refdyn_lu_factor
#undef refdyn_lu_solve
#undef refdyn_lu_solve_transposed
#define refdyn_largest plain_largest
#define refdyn_is_finite plain_is_finite
#define refdyn_factor plain_factor
#define refdyn_factor_solve plain_factor_solve
#define refdyn_factor_half_forward plain_factor_half_forward
#define refdyn_factor_half_backward plain_factor_half_backward
#define refdyn_times plain_times
#define refdyn_add_all plain_add_all
#include "runtime/core/linear/dense.c"
#undef refdyn_times
#undef refdyn_add_all

enum { MOST = 70, VECTORS = 9 };

static double given[2 * MOST * MOST], factors[2 * MOST * MOST], others[2 * MOST * MOST], scale[MOST];
static int pivot[MOST], pivot_of_other[MOST];

/* Between -1 and 1, with a size that changes from entry to entry. */
static double random_number(void) {
    static unsigned long long seed = 20250711;
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(seed >> 11) / 4503599627370496.0 - 1;
}

static void fill(double *values, int count) {
    for (int i = 0; i < count; i++)
        values[i] = random_number();
}

static int is_equal(const void *a, const void *b, size_t bytes) {
    return memcmp(a, b, bytes) == 0;
}

/* A complex number in long double; real matrices have no imaginary part. */
struct number {
    long double re, im;
};

static struct number times_number(struct number a, struct number b) {
    return (struct number){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

static long double size_of(struct number a) {
    return fabsl(a.re) + fabsl(a.im);
}

static struct number entry(const double *A, int n, int i, int j, int is_complex) {
    return (struct number){A[i * n + j], is_complex ? A[n * n + i * n + j] : 0};
}

/* Factors are stored by columns, with the inverses of U's diagonal. */
static struct number of_L(int n, int i, int k, int is_complex) {
    return i == k ? (struct number){1, 0} : entry(factors, n, k, i, is_complex);
}

static struct number of_U(int n, int k, int j, int is_complex) {
    const struct number found = entry(factors, n, j, k, is_complex);
    const long double square = found.re * found.re + found.im * found.im;
    return k == j ? (struct number){found.re / square, -found.im / square} : found;
}

/* The rows of `given` in the order of the pivots. */
static void order_rows(int n, int *order) {
    for (int i = 0; i < n; i++)
        order[i] = i;
    for (int k = 0; k < n; k++) {
        const int kept = order[pivot[k]];
        order[pivot[k]] = order[k];
        order[k] = kept;
    }
}

/* Largest |P A - L U| / (|L| |U|), in units of n eps. */
static double factor_error(int n, int is_complex) {
    int order[MOST];
    long double worst = 0;
    order_rows(n, order);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            struct number sum = entry(given, n, order[i], j, is_complex);
            long double size = 0;
            for (int k = 0; k <= (i < j ? i : j); k++) {
                const struct number l = of_L(n, i, k, is_complex), u = of_U(n, k, j, is_complex);
                const struct number product = times_number(l, u);
                sum = (struct number){sum.re - product.re, sum.im - product.im};
                size += size_of(l) * size_of(u);
            }
            worst = fmaxl(worst, size > 0 ? size_of(sum) / size : size_of(sum));
        }
    return (double)(worst / (n * (long double)DBL_EPSILON));
}

/* Largest |A x - b| / (|L| |U| |x|), row by row in the order of the pivots, in units of n eps. */
static double solution_error(int n, int is_complex, const double *x, const double *b) {
    int order[MOST];
    long double inner[MOST], worst = 0;
    order_rows(n, order);
    for (int k = 0; k < n; k++) {
        inner[k] = 0;
        for (int j = k; j < n; j++)
            inner[k] += size_of(of_U(n, k, j, is_complex)) *
                        size_of((struct number){x[j], is_complex ? x[n + j] : 0});
    }
    for (int i = 0; i < n; i++) {
        struct number sum = {b[order[i]], is_complex ? b[n + order[i]] : 0};
        long double size = 0;
        for (int j = 0; j < n; j++) {
            const struct number product = times_number(entry(given, n, order[i], j, is_complex),
                                                       (struct number){x[j], is_complex ? x[n + j] : 0});
            sum = (struct number){sum.re - product.re, sum.im - product.im};
        }
        for (int k = 0; k <= i; k++)
            size += size_of(of_L(n, i, k, is_complex)) * inner[k];
        worst = fmaxl(worst, size > 0 ? size_of(sum) / size : size_of(sum));
    }
    return (double)(worst / (n * (long double)DBL_EPSILON));
}

static int factor_given(int n) {
    memcpy(factors, given, (size_t)(n * n) * sizeof *given);
    return refdyn_lu_factor(0, factors, n, pivot, scale);
}

static int factor_given_complex(int n) {
    memcpy(factors, given, (size_t)(2 * n * n) * sizeof *given);
    return refdyn_lu_factor(1, factors, n, pivot, scale);
}

static void check_real(int n) {
    double b[MOST], x[MOST], y[MOST], other_scale[MOST];
    fill(b, n);
    memcpy(x, b, sizeof b);
    memcpy(y, b, sizeof b);
    CHECK(factor_given(n));
    CHECK(factor_error(n, 0) <= 1);
    refdyn_lu_solve(0, factors, n, pivot, x);
    CHECK(solution_error(n, 0, x, b) <= 3);
    memcpy(others, given, (size_t)(n * n) * sizeof *given);
    CHECK(plain_lu_factor(0, others, n, pivot_of_other, other_scale));
    plain_lu_solve(0, others, n, pivot_of_other, y);
    CHECK(is_equal(factors, others, (size_t)(n * n) * sizeof *factors));
    CHECK(is_equal(pivot, pivot_of_other, (size_t)n * sizeof *pivot));
    CHECK(is_equal(x, y, (size_t)n * sizeof *x));
}

static void check_complex(int n) {
    double b[2 * MOST], x[2 * MOST], y[2 * MOST], other_scale[MOST];
    fill(b, 2 * n);
    memcpy(x, b, sizeof b);
    memcpy(y, b, sizeof b);
    CHECK(factor_given_complex(n));
    CHECK(factor_error(n, 1) <= 4);
    refdyn_lu_solve(1, factors, n, pivot, x);
    CHECK(solution_error(n, 1, x, b) <= 12);
    memcpy(others, given, (size_t)(2 * n * n) * sizeof *given);
    CHECK(plain_lu_factor(1, others, n, pivot_of_other, other_scale));
    plain_lu_solve(1, others, n, pivot_of_other, y);
    CHECK(is_equal(factors, others, (size_t)(2 * n * n) * sizeof *factors));
    CHECK(is_equal(pivot, pivot_of_other, (size_t)n * sizeof *pivot));
    CHECK(is_equal(x, y, (size_t)(2 * n) * sizeof *x));
}

static void test_random_matrices(void) {
    for (int n = 1; n <= MOST; n++) {
        fill(given, 2 * n * n);
        check_real(n);
        check_complex(n);
    }
}

/* Rows and columns of many sizes, like coordinates in metres and radians with rows of a programme. */
static void test_rows_of_many_sizes(void) {
    for (int n = 2; n <= MOST; n += 7) {
        fill(given, 2 * n * n);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                for (int part = 0; part < 2; part++)
                    given[part * n * n + i * n + j] *= pow(10, i % 9 - 4) * pow(10, j % 7 - 3);
        check_real(n);
        check_complex(n);
    }
}

/* Zeros on the diagonal: without another row as pivot there is no result. */
static void test_pivots(void) {
    for (int n = 2; n <= MOST; n += 3) {
        fill(given, 2 * n * n);
        for (int i = 0; i < n; i++)
            given[i * n + i] = given[n * n + i * n + i] = 0;
        check_real(n);
        check_complex(n);
        CHECK(pivot[0] != 0);
    }
    for (int n = 2; n <= 9; n++) { /* a permutation: its factors are exact */
        double x[MOST];
        memset(given, 0, sizeof given);
        for (int i = 0; i < n; i++) {
            given[i * n + (i + 1) % n] = 1;
            x[i] = i + 1;
        }
        CHECK(factor_given(n));
        refdyn_lu_solve(0, factors, n, pivot, x);
        for (int i = 0; i < n; i++)
            CHECK(x[(i + 1) % n] == i + 1);
    }
}

/* The first row is large only in its second entry: as pivot it would lose all digits of the other row. */
static void test_pivots_for_their_size(void) {
    const double large = 1e17, matrix[] = {1, large, 1, 1};
    double x[] = {large, 2};
    memcpy(given, matrix, sizeof matrix);
    CHECK(factor_given(2));
    CHECK(pivot[0] == 1);
    refdyn_lu_solve(0, factors, 2, pivot, x);
    CHECK_NEAR(x[0], 1, 4 * DBL_EPSILON);
    CHECK_NEAR(x[1], 1, 4 * DBL_EPSILON);
}

/* Rows in other units, powers of two, change no pivot and no digit of a solution. */
static void test_units_of_rows(void) {
    for (int n = 2; n <= MOST; n += 4) {
        double b[MOST], x[MOST], y[MOST];
        fill(given, n * n);
        fill(b, n);
        CHECK(factor_given(n));
        memcpy(pivot_of_other, pivot, sizeof pivot);
        memcpy(x, b, sizeof b);
        refdyn_lu_solve(0, factors, n, pivot, x);
        for (int i = 0; i < n; i++) {
            const int unit = (7 * i) % 23 - 11;
            y[i] = ldexp(b[i], unit);
            for (int j = 0; j < n; j++)
                given[i * n + j] = ldexp(given[i * n + j], unit);
        }
        CHECK(factor_given(n));
        CHECK(is_equal(pivot, pivot_of_other, (size_t)n * sizeof *pivot));
        refdyn_lu_solve(0, factors, n, pivot, y);
        CHECK(is_equal(x, y, (size_t)n * sizeof *x));
    }
}

/* The first column without a pivot, whose inverse is not finite. */
static int refused_column(int n) {
    int k = 0;
    while (k < n && isfinite(factors[k * n + k]))
        k++;
    return k;
}

/* The first column without a pivot; or the last column, if a row is at fault. */
static void check_refused(int n, int column) {
    CHECK(!factor_given(n));
    CHECK(refused_column(n) == column);
    CHECK(!factor_given_complex(n));
    CHECK(refused_column(n) == column);
}

static void test_singular(void) {
    for (int n = 1; n <= MOST; n += 5)
        for (int at = 0; at < n; at += 3) {
            fill(given, 2 * n * n);
            for (int i = 0; i < n; i++)
                given[i * n + at] = given[n * n + i * n + at] = 0;
            check_refused(n, at);
            fill(given, 2 * n * n);
            for (int j = 0; j < n; j++)
                given[at * n + j] = given[n * n + at * n + j] = 0;
            check_refused(n, n - 1);
        }
    for (int i = 0; i < 6; i++) /* two rows alike */
        for (int j = 0; j < 6; j++) {
            given[i * 6 + j] = i == 4 ? given[6 + j] : random_number();
            given[36 + i * 6 + j] = i == 4 ? given[36 + 6 + j] : random_number();
        }
    CHECK(!factor_given(6));
    CHECK(refused_column(6) == 5);
}

/* One NaN anywhere is detected, in a real and in an imaginary part. */
static void test_not_a_number(void) {
    for (int n = 1; n <= 17; n++)
        for (int at = 0; at < n * n; at++) {
            fill(given, 2 * n * n);
            given[at] = NAN;
            CHECK(!factor_given(n));
            CHECK(!factor_given_complex(n));
            fill(given, 2 * n * n);
            given[n * n + at] = NAN;
            CHECK(!factor_given_complex(n));
        }
}

/* A^T X = B, residuals compared with their terms; right sides in longer rows. */
static void test_transposed(void) {
    enum { COUNT = 3, STRIDE = 5 };
    double B[MOST * STRIDE], X[MOST * STRIDE], Y[MOST * STRIDE];
    for (int n = 1; n <= MOST; n += 3) {
        fill(given, n * n);
        fill(B, n * STRIDE);
        memcpy(X, B, sizeof B);
        memcpy(Y, B, sizeof B);
        CHECK(factor_given(n));
        refdyn_lu_solve_transposed(factors, n, pivot, X, STRIDE, COUNT);
        plain_lu_solve_transposed(factors, n, pivot, Y, STRIDE, COUNT);
        CHECK(is_equal(X, Y, sizeof X));
        for (int j = 0; j < n * STRIDE; j++) {
            const int i = j / STRIDE, side = j % STRIDE;
            long double sum = -(long double)B[j], size = fabs(B[j]);
            for (int k = 0; k < n && side < COUNT; k++) {
                sum += (long double)given[k * n + i] * X[k * STRIDE + side];
                size += fabsl((long double)given[k * n + i] * X[k * STRIDE + side]);
            }
            CHECK(side < COUNT ? fabsl(sum) <= 3 * n * (long double)DBL_EPSILON * size : X[j] == B[j]);
        }
    }
}

/* Columns of two vectors and their sums: two pivots, the first the largest of all candidate rows. */
static void test_full_pivoting(void) {
    enum { ROWS = 9, COLUMNS = 5, FORBIDDEN = 4 };
    for (int sample = 0; sample < 50; sample++) {
        double A[ROWS * COLUMNS], marks[ROWS], largest = 0;
        int order[COLUMNS], row = 0, column = 0;
        fill(A, ROWS * COLUMNS);
        for (int i = 0; i < ROWS * COLUMNS; i++)
            A[i] = floor(8 * A[i]);
        for (int j = 0; j < COLUMNS; j++)
            order[j] = j;
        for (int i = 0; i < ROWS; i++) {
            marks[i] = i != FORBIDDEN;
            A[2 * ROWS + i] = A[i];
            A[3 * ROWS + i] = -A[ROWS + i];
            A[4 * ROWS + i] = 0;
        }
        for (int j = 0; j < COLUMNS * ROWS; j++)
            if (fabs(A[j]) * marks[j % ROWS] > largest) {
                largest = fabs(A[j]);
                row = j % ROWS;
                column = j / ROWS;
            }
        const int count = refdyn_eliminate(A, ROWS, COLUMNS, pivot, order, marks);
        CHECK(count >= 2 && count < COLUMNS);
        for (int k = 2; k < count; k++) /* remaining rounding */
            CHECK(fabs(1 / A[k * ROWS + k]) <= 16 * DBL_EPSILON * largest);
        CHECK(pivot[0] == row && order[0] == column && pivot[1] != FORBIDDEN);
        CHECK(marks[0] == 1 && marks[1] == 1 && fabs(1 / A[0]) == largest);
        for (int i = 1; i < ROWS; i++)
            CHECK(fabs(A[i]) <= 1 || i == FORBIDDEN);
    }
}

static void test_times(void) {
    double x[MOST], y[MOST], z[MOST];
    for (int rows = 1; rows <= MOST; rows += 6)
        for (int columns = 0; columns <= MOST; columns++) {
            fill(given, rows * columns);
            fill(x, columns);
            refdyn_times(given, rows, columns, x, y);
            plain_times(given, rows, columns, x, z);
            CHECK(is_equal(y, z, (size_t)rows * sizeof *y));
            long double worst = 0;
            for (int i = 0; i < rows; i++) {
                long double sum = -(long double)y[i], size = 0;
                for (int j = 0; j < columns; j++) {
                    const long double product = (long double)given[i * columns + j] * x[j];
                    sum += product;
                    size += fabsl(product);
                }
                worst = fmaxl(worst, fabsl(sum) - columns * (long double)DBL_EPSILON * size);
            }
            CHECK(worst <= 0);
        }
}

static void test_add_all(void) {
    double weights[VECTORS], x[VECTORS * (MOST + 3)], y[MOST + 1], z[MOST + 1], before[MOST + 1];
    for (int n = 1; n <= MOST; n++)
        for (int count = 0; count <= VECTORS; count++) {
            const int stride = n + count % 4;
            const double factor = random_number();
            fill(weights, count);
            fill(x, count * stride);
            fill(before, n + 1);
            memcpy(y, before, sizeof before);
            memcpy(z, before, sizeof before);
            refdyn_add_all(y, factor, weights, count, x, stride, n);
            plain_add_all(z, factor, weights, count, x, stride, n);
            CHECK(is_equal(y, z, (size_t)(n + 1) * sizeof *y));
            CHECK(y[n] == before[n]);
            long double worst = 0;
            for (int i = 0; i < n; i++) {
                long double sum = (long double)before[i] - y[i], size = fabs(before[i]);
                for (int j = 0; j < count; j++) {
                    const long double product = (long double)factor * weights[j] * x[j * stride + i];
                    sum += product;
                    size += fabsl(product);
                }
                worst = fmaxl(worst, fabsl(sum) - (count + 2) * (long double)DBL_EPSILON * size);
            }
            CHECK(worst <= 0);
        }
}

int main(void) {
    test_random_matrices();
    test_rows_of_many_sizes();
    test_pivots();
    test_pivots_for_their_size();
    test_units_of_rows();
    test_singular();
    test_not_a_number();
    test_transposed();
    test_full_pivoting();
    test_times();
    test_add_all();
    return check_summary();
}
