/*
 * The internal motions that a programme realised by drives leaves: their modes about the start, and how far
 * the rows and the drives act in the same directions.
 *
 * Modes: eigenvalues s of the equations linearised at rest,
 *
 *     [M s^2 + D s + K] dq - B dtau - u_l^T dlambda = 0,   u dq = 0 (s u dq = 0 of velocity rows),
 *
 * as a pencil of first order by the QZ method; the infinite ones belong to the rows. Cosines: singular values
 * of the product of orthonormal bases of M^-1 u^T and M^-1 B in the metric M, after loops (A. Bjorck and
 * G. H. Golub, Math. Comput. 27:579-594, 1973). They are reported, and no method depends on them: of a
 * flexible link they tend to 0 with the number of elements, while the motion hardly changes.
 *
 * With more drives than rows, B is that part of the drives which acts along the rows most, as many as there
 * are rows: the modes are those of a motion without the others. Drives that act on all degrees of freedom
 * leave no internal motion to itself.
 */
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"

/* Modes faster than this belong to the rows: rounding makes their infinite eigenvalues finite [1/s]. */
static const double rate_most = 1e6;
/* A real part below this share of the modulus, or this size, is none [1, 1/s]. */
static const double centre_share = 1e-5, centre_rate = 1e-3;

static void count_mode(struct realise_modes *modes, double re, double im) {
    const double size = hypot(re, im);
    if (!(size < rate_most))
        return;
    if (fabs(re) <= centre_share * size || size <= centre_rate) {
        modes->centre++;
        modes->vibrates = modes->vibrates || fabs(im) > centre_rate;
    } else if (re < 0)
        modes->decaying++;
    else {
        modes->slowest = modes->growing++ ? fmin(modes->slowest, re) : re;
        modes->fastest = fmax(modes->fastest, re);
    }
}

/* A x' ... = s E x with x = (dq, dqd, dtau, dlambda); columns one after the other. `along` (n x rows): B. */
static void put_pencil(const struct realise_problem *problem, const struct realise_place *place,
                       const double *along, int size, double *A, double *E) {
    const int n = problem->n, rows = problem->m - problem->loops;
    const struct refdyn_model *model = problem->scene->model;
    for (int i = 0; i < n; i++) {
        A[(n + i) * size + i] = E[i * size + i] = 1;
        for (int j = 0; j < n; j++) {
            A[j * size + n + i] = -place->K[i * n + j];
            A[(n + j) * size + n + i] = -place->D[i * n + j];
            E[(n + j) * size + n + i] = place->M[i * n + j];
        }
        for (int d = 0; d < rows; d++)
            A[(2 * n + d) * size + n + i] = -along[d * n + i];
        for (int l = 0; l < problem->loops; l++)
            A[(2 * n + rows + l) * size + n + i] = place->u[problem->loop[l] * n + i];
    }
    for (int i = 0; i < problem->m; i++)
        for (int j = 0; j < n; j++)
            A[((model->rows[i].level == REFDYN_POSITION ? 0 : n) + j) * size + 2 * n + i] =
                place->u[i * n + j];
}

static bool find_modes(const struct realise_problem *problem, const struct realise_place *place,
                       const double *along, struct realise_modes *modes) {
    const int size = 2 * problem->n + problem->m;
    double *A = realise_scratch(size, size), *E = realise_scratch(size, size), *re = realise_scratch(size, 1),
           *im = realise_scratch(size, 1), *part = realise_scratch(size, 1);
    put_pencil(problem, place, along, size, A, E);
    if (LAPACKE_dggev(LAPACK_COL_MAJOR, 'N', 'N', size, A, size, E, size, re, im, part, NULL, 1, NULL, 1) !=
        0)
        return false;
    for (int i = 0; i < size; i++)
        count_mode(modes, re[i] / part[i], im[i] / part[i]);
    return true;
}

/* ---- Cosines ---- */

/* x := L^-1 x for the lower factor of M, each of `count` columns. */
static void solve_lower(const double *L, int n, double *x, int count) {
    for (int c = 0; c < count; c++)
        for (int i = 0; i < n; i++) {
            double *column = x + (size_t)c * (size_t)n;
            for (int j = 0; j < i; j++)
                column[i] -= L[j * n + i] * column[j];
            column[i] /= L[i * n + i];
        }
}

/* Orthonormal columns, after those of `before`, by Gram and Schmidt's method, twice. */
static void make_orthonormal(double *x, int count, const double *before, int before_count, int n) {
    for (int c = 0; c < count; c++) {
        double *column = x + (size_t)c * (size_t)n, length = 0;
        for (int pass = 0; pass < 2; pass++)
            for (int b = 0; b < before_count + c; b++) {
                const double *other = b < before_count ? before + (size_t)b * (size_t)n
                                                       : x + (size_t)(b - before_count) * (size_t)n;
                double dot = 0;
                for (int i = 0; i < n; i++)
                    dot += other[i] * column[i];
                for (int i = 0; i < n; i++)
                    column[i] -= dot * other[i];
            }
        for (int i = 0; i < n; i++)
            length += column[i] * column[i];
        for (int i = 0; i < n && length > 0; i++)
            column[i] /= sqrt(length);
    }
}

/* x := L x, each of `count` columns. */
static void multiply_lower(const double *L, int n, double *x, int count) {
    for (int c = 0; c < count; c++)
        for (int i = n - 1; i >= 0; i--) {
            double *column = x + (size_t)c * (size_t)n, sum = 0;
            for (int j = 0; j <= i; j++)
                sum += L[j * n + i] * column[j];
            column[i] = sum;
        }
}

/* The columns of B. */
static void put_drives(const struct realise_problem *problem, const struct realise_place *place, double *B) {
    const int n = problem->n, inputs = problem->scene->model->input_count;
    for (int d = 0; d < problem->drives; d++)
        for (int i = 0; i < n; i++)
            B[d * n + i] = place->f_x[i * inputs + problem->input[d]];
}

/* Also finds the directions of the drives (n x rows) that belong to the cosines. */
static bool find_cosines(const struct realise_problem *problem, const struct realise_place *place,
                         double *along, struct realise_modes *modes) {
    const int n = problem->n, loops = problem->loops, rows = problem->m - loops, drives = problem->drives;
    double *L = realise_scratch(n, n), *closed = realise_scratch(n, loops),
           *wanted = realise_scratch(n, rows), *driven = realise_scratch(n, drives),
           *product = realise_scratch(rows, drives), *turned = realise_scratch(rows, drives),
           *work = realise_scratch(rows + drives, 1);
    memcpy(L, place->M, (size_t)(n * n) * sizeof *L);
    if (LAPACKE_dpotrf(LAPACK_COL_MAJOR, 'L', n, L, n) != 0)
        return false;
    for (int i = 0, l = 0, r = 0; i < problem->m; i++) {
        const bool is_loop = l < loops && problem->loop[l] == i;
        memcpy(is_loop ? closed + (size_t)l++ * (size_t)n : wanted + (size_t)r++ * (size_t)n,
               place->u + i * n, (size_t)n * sizeof *L);
    }
    put_drives(problem, place, driven);
    solve_lower(L, n, closed, loops);
    solve_lower(L, n, wanted, rows);
    solve_lower(L, n, driven, drives);
    make_orthonormal(closed, loops, NULL, 0, n);
    make_orthonormal(wanted, rows, closed, loops, n);
    make_orthonormal(driven, drives, closed, loops, n);
    for (int r = 0; r < rows; r++)
        for (int d = 0; d < drives; d++)
            for (int i = 0; i < n; i++)
                product[d * rows + r] += wanted[r * n + i] * driven[d * n + i];
    modes->cosine_count = rows;
    modes->cosines = format_allocate_matrix(rows, 1);
    if (LAPACKE_dgesvd(LAPACK_COL_MAJOR, 'N', 'S', rows, drives, product, rows, modes->cosines, NULL, 1,
                       turned, rows, work) != 0)
        return false;
    if (drives == rows) {
        put_drives(problem, place, along);
        return true;
    }
    for (int r = 0; r < rows; r++)
        for (int d = 0; d < drives; d++)
            for (int i = 0; i < n; i++)
                along[r * n + i] += driven[d * n + i] * turned[d * rows + r];
    multiply_lower(L, n, along, rows);
    return true;
}

bool realise_modes_find(struct realise_problem *problem, double t, const double *q, const double *unknowns,
                        struct realise_modes *modes) {
    const int n = problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *all = realise_scratch(problem->width, 1), *rates = realise_scratch(n, 1),
           *along = realise_scratch(n, problem->m - problem->loops);
    struct realise_place place = {.residual = realise_scratch(n + problem->m, 1)};
    *modes = (struct realise_modes){.growing = 0};
    memcpy(all + n, unknowns, (size_t)(problem->width - n) * sizeof *all);
    const bool is_found =
        realise_place_find(problem, t, q, rates, all, &place) == REFDYN_OK &&
        find_cosines(problem, &place, along, modes) &&
        (problem->drives + problem->loops >= n || find_modes(problem, &place, along, modes));
    memory_back(&format_memory, mark);
    return is_found;
}
