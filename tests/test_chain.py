"""The tangent in vectors compared with the tangent in matrices: products, solutions with real and complex g, bordered by rows and
couplings."""
import subprocess

import pytest

from program import CORE_LIBRARY, MODELS, REFERENCE, SOURCE, TESTS, UNOPTIMISED, few_models, few_models_of_tests, refdyn, settings, some

RUNS = TESTS / "models" / "runs.lua"
CASES = {path.stem: (path, {}) for path in few_models() if path != REFERENCE}
CASES |= {f"tests_{path.stem}": (path, {}) for path in few_models_of_tests()}
CASES |= {"rigid": (REFERENCE, dict(n_rfe=1)), "flexible": (REFERENCE, dict(eta=1e-3)), "planar_chain": (MODELS / "planar.lua", dict(n_rfe=6)),
          "fine": (REFERENCE, dict(n_rfe=16, eta=1e-3)), "driven": (REFERENCE, dict(drive="input"))}
CASES |= {f"runs_{kind}": (RUNS, dict(kind=kind, rfe=3)) for kind in ("sides", "segments", "slides", "driven")}
CLOSED = {"bricard"}  # for redundant rows: otherwise they leave nothing free, and the O(n) solver computes u M^-1 u^T for them
EXACT = 1e-12     # of products, relative to the size of the summands
SOLVED = 3e-15    # of solutions, times the condition: the effect of a relative change of all terms, divided by that change

# Prints the largest figures of several states: products with M, D, K; for each g of solutions the error and the condition.
PROGRAM = """
#include "MODEL.h"
#include "runtime/core/implicit/implicit.h"
#include "runtime/core/linear/linear.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 8 };

static unsigned seed = 20240817;

static double uniform(double size) {
    seed = seed * 1664525u + 1013904223u;
    return size * (2.0 * (double)(seed >> 8) / (double)(1u << 24) - 1.0);
}

static double *room_for(int count) {
    return calloc((size_t)count + 1, sizeof(double));
}

/* |A| |x| over all rows: what rounding may reach */
static double size_of(const double *A, const double *x, int rows, int n) {
    double most = 1e-300;
    for (int i = 0; i < rows; i++) {
        double sum = 0;
        for (int j = 0; j < n; j++)
            sum += fabs(A[i * n + j] * x[j]);
        most = fmax(most, sum);
    }
    return most;
}

static double apart(const double *a, const double *b, int count) {
    double most = 0;
    for (int i = 0; i < count; i++)
        most = !(fabs(a[i] - b[i]) <= most) ? fabs(a[i] - b[i]) : most; /* NaN counts */
    return most;
}

struct pair {
    struct refdyn_model model;
    struct refdyn_linear linear;
    int size;
};

static void open_linear(struct pair *of, const struct refdyn_model *model, int is_chain) {
    struct layout layout = {NULL, 0};
    of->model = *model;
    if (is_chain)
        of->model.tangent = NULL;
    else
        of->model.tangent_vectors = NULL;
    refdyn_linear_lay_out(&of->linear, &of->model, 1, 3, &layout);
    layout = (struct layout){calloc(layout.used + 8, 1), 0};
    refdyn_linear_lay_out(&of->linear, &of->model, 1, 3, &layout);
    of->size = of->linear.is_chain;
}

/* |A| |x| of row i of the bordered matrix, and of the right side r: what rounding leaves there is eps of it */
static double row_size(const struct refdyn_linear *l, int i, double g, const double *x, double r) {
    const int n = l->n, size = l->size, a = i < n ? 0 : l->rows[i - n] * n;
    double sum = fabs(r);
    for (int j = 0; j < n; j++) {
        const double base = fabs(i < n ? l->M[i * n + j] : l->u[a + j]), first = fabs(i < n ? l->D[i * n + j] : l->G_qd[a + j]),
                     second = fabs(i < n ? l->K[i * n + j] : l->G_q[a + j]);
        sum += (base + g * first + g * g * second) * fabs(x[j]);
    }
    for (int k = n; i < n && k < size; k++)
        sum += fabs(l->u[l->rows[k - n] * n + i] * x[k]);
    return sum;
}

/* What a matrix is solved with in place: of linear->matrix, or of complex one k. */
static void solve_dense(const struct refdyn_linear *dense, int is_complex, int k, double *z) {
    const int size = dense->size;
    if (is_complex)
        refdyn_lu_solve(1, dense->complex_factors + k * 2 * size * size, size, dense->complex_pivot + k * size, z);
    else
        refdyn_lu_solve(0, dense->matrix, size, dense->pivot, z);
}

/* The largest entry of the solution without rows, which in O(n) comes first: of that size are what rows then take away, and its rounding. */
static double size_without_rows(const struct refdyn_linear *l, int is_complex, double re, double im, const double *r) {
    const int n = l->n;
    double *A = room_for(2 * n * n), *x = room_for(2 * n), *scale = room_for(n), largest = 0;
    int *pivot = calloc((size_t)n + 1, sizeof *pivot);
    for (int i = 0; i < n * n; i++) {
        A[i] = l->M[i] + re * l->D[i] + (re * re - im * im) * l->K[i];
        A[n * n + i] = im * l->D[i] + 2 * re * im * l->K[i];
    }
    memcpy(x, r, (size_t)n * sizeof *x);
    if (is_complex)
        memcpy(x + n, r + l->size, (size_t)n * sizeof *x);
    const int is_regular = refdyn_lu_factor(1, A, n, pivot, scale);
    refdyn_lu_solve(1, A, n, pivot, x);
    for (int i = 0; i < 2 * n && is_regular; i++)
        largest = fmax(largest, fabs(x[i]));
    free(pivot);
    free(scale);
    free(x);
    free(A);
    return largest;
}

/* How far y is from the solution for the right side r, over the largest of its coordinates, and what a change by 1e-9 of all terms makes
 * of that, over 1e-9. Real parts of y stand `imaginary` before the others, those of r `size`. */
static void compare(const struct refdyn_linear *dense, int is_complex, int k, double re, double im, const double *r, const double *y,
                    int imaginary, double *error, double *condition) {
    const double g = hypot(re, im);
    const int n = dense->n, size = dense->size, parts = 1 + is_complex;
    double *x = room_for(2 * size), *z = room_for(2 * size), largest = 1e-300, apart_x = 0, apart_y = 0;
    memcpy(x, r, (size_t)(parts * size) * sizeof *x);
    solve_dense(dense, is_complex, k, x);
    for (int sample = 0; sample < SAMPLES; sample++) {
        for (int i = 0; i < parts * size; i++)
            z[i] = r[i] + uniform(1e-9) * row_size(dense, i % size, g, x + i / size * size, r[i]);
        solve_dense(dense, is_complex, k, z);
        for (int part = 0; part < parts; part++)
            apart_x = fmax(apart_x, apart(x + part * size, z + part * size, n));
    }
    for (int part = 0; part < parts; part++) {
        apart_y = fmax(apart_y, apart(x + part * size, y + part * imaginary, n));
        for (int i = 0; i < n; i++)
            largest = fmax(largest, fabs(x[part * size + i]));
    }
    *error = !(apart_y / largest <= *error) ? apart_y / largest : *error;
    *condition = fmax(*condition, fmax(apart_x / 1e-9, size_without_rows(dense, is_complex, re, im, r)) / largest);
    free(z);
    free(x);
}

/* Real g: right sides at random, those of rows too. */
static int solve_real(struct refdyn_linear *dense, struct refdyn_linear *chain, const struct refdyn_workspace *work, double g, double *error,
                      double *condition) {
    if (refdyn_linear_factor(dense, work, g) || refdyn_linear_factor(chain, work, g))
        return 1;
    double *r = room_for(dense->size), *y = room_for(dense->size);
    for (int i = 0; i < dense->size; i++)
        r[i] = y[i] = uniform(1);
    refdyn_chain_solve(&chain->chain, y);
    compare(dense, 0, 0, g, 0, r, y, 0, error, condition);
    free(y);
    free(r);
    return 0;
}

/* M x and u x of a residual x */
static void right_side(const struct refdyn_linear *dense, const double *x, double *r) {
    const int n = dense->n;
    refdyn_times(dense->M, n, n, x, r);
    for (int i = n; i < dense->size; i++)
        r[i] = dense_dot(dense->u + dense->rows[i - n] * n, x, n);
}

/* Eigenvalues side by side, from number `first` on: all factored, `count` solved. */
static int solve_all(struct refdyn_linear *dense, struct refdyn_linear *chain, const struct refdyn_workspace *work, int first, int count,
                     double *errors, double *conditions) {
    const double all[] = {1.5, 0, 2, 1.5, 10, 5.5}, h = 2e-3, *lambda = all + 2 * first;
    const int n = dense->n, size = dense->size;
    if (refdyn_linear_factor_all(dense, work, 3 - first, lambda, h) || refdyn_linear_factor_all(chain, work, 3 - first, lambda, h))
        return 1;
    double *x = room_for(6 * n), *y = room_for(6 * n), *r = room_for(2 * size), *at = x;
    for (int i = 0; i < 6 * n; i++)
        x[i] = y[i] = uniform(1);
    refdyn_linear_solve_all(chain, count, lambda, y);
    for (int k = 0; k < count; k++) {
        const int is_complex = lambda[2 * k + 1] != 0;
        right_side(dense, at, r);
        if (is_complex)
            right_side(dense, at + n, r + size);
        compare(dense, is_complex, k, h * lambda[2 * k], h * lambda[2 * k + 1], r, y + (at - x), n, errors, conditions);
        at += (1 + is_complex) * n;
    }
    free(r);
    free(y);
    free(x);
    return 0;
}

static int solve(struct refdyn_linear *dense, struct refdyn_linear *chain, const struct refdyn_workspace *work, int which, double *error,
                 double *condition) {
    const double g[] = {0, 3e-4, 0.02};
    if (which < 3)
        return solve_real(dense, chain, work, g[which], error, condition);
    return which == 3 ? solve_all(dense, chain, work, 0, 3, error, condition) : solve_all(dense, chain, work, 1, 1, error, condition);
}

int main(void) {
    const struct refdyn_model *model = &MODEL_model;
    const int n = model->n, m = model->m;
    struct pair dense, chain;
    struct refdyn_workspace work;
    size_t size = refdyn_workspace_size(model);
    if (refdyn_workspace_init(&work, model, calloc(1, size), size))
        return 1;
    open_linear(&dense, model, 0);
    open_linear(&chain, model, 1);
    if (dense.size || !chain.size)
        return 2;
    double *state = room_for(2 * n), *slope = room_for(2 * n + 1 + m), *x = room_for(n), *y = room_for(n + m), *z = room_for(n + m);
    double products = 0, errors[5] = {0}, conditions[5] = {0};
    for (int i = 0; i < model->input_count; i++)
        work.x[i] = model->inputs[i].value + 0.375;
    for (int trial = 0; trial < 4; trial++) {
        for (int i = 0; i < n; i++) {
            state[i] = model->coordinates[i].value + uniform(APART);
            state[n + i] = uniform(1.5);
            slope[i] = state[n + i];
        }
        refdyn_prepare(&work);
        for (int i = n; i < 2 * n + 1 + m; i++)
            slope[i] = uniform(4);
        work.partition.rank = m ? -1 : 0;
        if (refdyn_equations(&work, 0.7, state, state + n))
            return 3;
        double *qdd = room_for(n);
        if (m && refdyn_solve(&work, REFDYN_BAUMGARTE, qdd) && work.partition.rank <= 0) /* chooses the rows */
            return 6;
        free(qdd);
        dense.linear.size = 0;
        if (refdyn_linear_evaluate(&dense.linear, &work, 0.7, state, slope) || refdyn_linear_evaluate(&chain.linear, &work, 0.7, state, slope))
            return 4;
        const double *matrices[3] = {dense.linear.M, dense.linear.D, dense.linear.K};
        for (int of = 0; of < 3; of++) {
            for (int i = 0; i < n; i++)
                x[i] = uniform(1);
            refdyn_times(matrices[of], n, n, x, y);
            refdyn_chain_times(&chain.linear.chain, of == 0 ? x : NULL, of == 1 ? x : NULL, of == 2 ? x : NULL, z);
            products = fmax(products, apart(y, z, n) / size_of(matrices[of], x, n, n));
        }
        for (int g = 0; g < 5; g++)
            if (solve(&dense.linear, &chain.linear, &work, g, &errors[g], &conditions[g]))
                return 5;
    }
    printf("%.3g\\n", products);
    for (int g = 0; g < 5; g++)
        printf("%.3g %.3g\\n", errors[g], conditions[g]);
    return 0;
}
"""


@pytest.mark.parametrize("case", [pytest.param(case, marks=pytest.mark.quick) if case == "flexible" else case for case in CASES])
def test_chain(case, tmp_path):
    model, options = CASES[case]
    refdyn("gen", model, *settings(options), "--emit", "start,equations,tangent,tangent_vectors", "-o", tmp_path)
    name = next(tmp_path.glob("*.h")).stem
    (tmp_path / "program.c").write_text(PROGRAM.replace("MODEL", name).replace("APART", "0" if case in CLOSED else "0.3"))
    for source in some(tmp_path.glob("*.c")):
        subprocess.run([*UNOPTIMISED, "-I", SOURCE, "-I", SOURCE / "runtime", "-c", source, "-o", source.with_suffix(".o")], check=True)
    subprocess.run(["gcc", "-z", "noexecstack", *tmp_path.glob("*.o"), CORE_LIBRARY, "-lm", "-o", tmp_path / "program"], check=True)
    done = subprocess.run([tmp_path / "program"], capture_output=True, text=True, timeout=300)
    print(done.stdout)
    assert done.returncode == 0, done.returncode
    products, *solutions = done.stdout.splitlines()
    assert float(products) < EXACT
    for line in solutions:
        error, condition = map(float, line.split())
        assert condition > 0 and error < SOLVED * max(condition, 10), line


@pytest.mark.parametrize("elements, wanted, other", [(4, "tangent", "tangent_vectors"), (24, "tangent_vectors", "tangent")])
def test_what_takes_fewer_operations(elements, wanted, other, tmp_path):
    """`implicit` is one of the two, and the summary of a motion says when it is the elimination by joints."""
    refdyn("gen", REFERENCE, "--set", f"n_rfe={elements}", "--emit", "implicit", "-o", tmp_path)
    header = (tmp_path / "manipulator.h").read_text()
    assert f"manipulator_{wanted}(" in header and f"manipulator_{other}(" not in header
    done = refdyn("sim", REFERENCE, "--set", f"n_rfe={elements}", "--set", "eta=1e-3", "--method", "rodas5p", "--until", "0.02", "-o",
                  tmp_path / "run.csv")
    assert ("solved joint by joint" in done.stderr) == (wanted == "tangent_vectors")
