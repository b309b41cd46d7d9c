/* The runtime core without motion: kernels, workspace, index partitioning, accelerations, projection. */
#include <float.h>
#include <string.h>

#include "check.h"
#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"
#include "runtime_models.h"

/* ---- Equations given as numbers: M f u v phi psi k of the current case ---- */

enum { N_MOST = 13, M_MOST = 4, EQUATIONS_MOST = N_MOST * N_MOST + N_MOST + M_MOST * N_MOST + 4 * M_MOST };

static double given[EQUATIONS_MOST];
static int given_count;

static void given_equations(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)t, (void)q, (void)qd;
    memcpy(out, given, (size_t)given_count * sizeof *out);
}

static const struct refdyn_name given_coordinates[N_MOST];
static const struct refdyn_row given_rows[M_MOST] = {{"one", REFDYN_POSITION, 0, ""},
                                                     {"two", REFDYN_VELOCITY, 0, ""},
                                                     {"three", REFDYN_POSITION, 0, ""},
                                                     {"four", REFDYN_ACCELERATION, 0, ""}};

static struct refdyn_model given_model(int n, int m, const int *dependent) {
    given_count = n * n + n + m * n + 4 * m;
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "given",
        .hash = "",
        .n = n,
        .m = m,
        .coordinates = given_coordinates,
        .rows = given_rows,
        .dependent = dependent,
        .equations = given_equations,
    };
}

/* Uniform in (-1, 1), the same numbers in every run (Park and Miller, CACM 31:1192-1201, 1988). */
static double random_number(void) {
    static long state = 20231;
    state = state * 48271 % 2147483647;
    return 2 * (double)state / 2147483647 - 1;
}

/* M = G^T G scaled so that its diagonal spans 10^(2 decades), all other data random; k = -v. */
static void random_case(int n, int m, double decades) {
    double G[N_MOST * N_MOST], scale[N_MOST];
    for (int i = 0; i < n * n; i++)
        G[i] = random_number();
    for (int j = 0; j < n; j++)
        scale[j] = pow(10, decades * random_number());
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = i == j ? 0.3 : 0;
            for (int l = 0; l < n; l++)
                sum += G[l * n + i] * G[l * n + j];
            given[i * n + j] = sum * scale[i] * scale[j];
        }
    for (int i = n * n; i < given_count; i++)
        given[i] = random_number();
    for (int a = 0; a < m; a++)
        given[given_count - m + a] = -given[given_count - 4 * m + a];
}

/* [M -u^T; u 0] [qdd; lambda] = [f; k] in long double, Gaussian elimination with row pivoting. */
static void multiplier_form(int n, int m, double *qdd, double *lambda) {
    enum { MOST = N_MOST + M_MOST };
    static long double A[MOST][MOST + 1];
    const int size = n + m;
    const double *f = given + n * n, *u = f + n, *k = given + given_count - m;
    memset(A, 0, sizeof A);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            A[i][j] = given[i * n + j];
        A[i][size] = f[i];
    }
    for (int a = 0; a < m; a++) {
        for (int j = 0; j < n; j++) {
            A[n + a][j] = u[a * n + j];
            A[j][n + a] = -(long double)u[a * n + j];
        }
        A[n + a][size] = k[a];
    }
    for (int c = 0; c < size; c++) {
        int pivot = c;
        for (int i = c + 1; i < size; i++)
            if (fabsl(A[i][c]) > fabsl(A[pivot][c]))
                pivot = i;
        for (int j = 0; j <= size; j++) {
            const long double kept = A[c][j];
            A[c][j] = A[pivot][j];
            A[pivot][j] = kept;
        }
        for (int i = 0; i < size; i++)
            if (i != c) {
                const long double factor = A[i][c] / A[c][c];
                for (int j = c; j <= size; j++)
                    A[i][j] -= factor * A[c][j];
            }
    }
    for (int i = 0; i < size; i++)
        *(i < n ? qdd + i : lambda + i - n) = (double)(A[i][size] / A[i][i]);
}

static double largest_difference(const double *a, const double *b, int count) {
    double largest = 0;
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i] - b[i]));
    return largest;
}

/* ---- Kernels ---- */

static void test_factor(void) {
    const int n = 11;
    double A[11 * 11], x[11], b[11], half[11];
    given_model(n, 0, NULL);
    random_case(n, 0, 3);
    memcpy(A, given, sizeof A);
    for (int i = 0; i < n; i++) {
        x[i] = random_number();
        b[i] = 0;
    }
    for (int i = 0; i < n; i++)
        b[i] = dense_dot(A + i * n, x, n);
    CHECK(refdyn_factor(A, n, n) == -1);
    memcpy(half, b, sizeof half);
    refdyn_factor_solve(A, n, n, b);
    CHECK_NEAR(largest_difference(b, x, n), 0, 1e-9);
    /* both halves in sequence equal the whole, and the first keeps x^T A^-1 x */
    double energy = 0, b_x = 0;
    double right[11];
    memcpy(right, half, sizeof right);
    refdyn_factor_half_forward(A, n, n, half);
    energy = dense_dot(half, half, n);
    refdyn_factor_half_backward(A, n, n, half);
    CHECK_NEAR(largest_difference(half, b, n), 0, 1e-9);
    b_x = dense_dot(right, b, n);
    CHECK_NEAR(energy, b_x, 1e-12 * b_x);
}

static void test_factor_refuses(void) {
    double singular[9] = {2.385, 1.1, 0.7, 1.1, 3.3, 0.2, 0.7, 0.2, 0};
    /* third row: a combination of the others, so that its pivot is a rounding error */
    singular[2] = 0.3 * singular[0] + 0.9 * singular[1];
    singular[5] = 0.3 * singular[1] + 0.9 * singular[4];
    singular[8] = 0.3 * singular[2] + 0.9 * singular[5];
    CHECK(refdyn_factor(singular, 3, 3) == 2);
    double negative[4] = {1.7, 0.3, 0.3, -0.1}, undefined[4] = {1.7, 0.3, 0.3, NAN};
    CHECK(refdyn_factor(negative, 2, 2) == 1);
    CHECK(refdyn_factor(undefined, 2, 2) == 1);
    int at;
    const double values[] = {0.3, -2.7, 1.1};
    CHECK_NEAR(refdyn_largest(values, 3, &at), 2.7, 0);
    CHECK(at == 1);
    CHECK(isnan(refdyn_largest(undefined, 4, &at)) && isnan(undefined[at]));
    refdyn_largest(values, 0, &at);
    CHECK(at == -1);
    CHECK(refdyn_is_finite(values, 3) && !refdyn_is_finite(undefined, 4));
}

static void test_version(void) {
    char text[64];
    snprintf(text, sizeof text, "%d.%d.%d", REFDYN_VERSION_MAJOR, REFDYN_VERSION_MINOR, REFDYN_VERSION_PATCH);
    CHECK(strcmp(REFDYN_VERSION, text) == 0);
    CHECK(strcmp(refdyn_version(), REFDYN_VERSION) == 0);
}

/* ---- Workspace
 * ------------------------------------------------------------------------------------------------- */

static void test_workspace(void) {
    struct rig rig;
    rig_open(&rig, rod_model(NULL));
    CHECK_NEAR(rig.work.p[0], 9.81, 0);
    CHECK_NEAR(rig.q[0], -1, 0);
    CHECK(refdyn_find_name(rod_coordinates, 2, "y") == 1);
    CHECK(refdyn_find_name(rod_coordinates, 2, "z") == -1);
    struct refdyn_workspace work;
    void *memory = inside(rig.work_memory);
    const size_t size = rig.work_memory.size;
    CHECK(refdyn_workspace_init(&work, &rig.model, memory, size - 1) == REFDYN_MEMORY_TOO_SMALL);
    CHECK(refdyn_workspace_init(&work, &rig.model, NULL, size) == REFDYN_BAD_MEMORY);
    CHECK(refdyn_workspace_init(&work, &rig.model, (char *)memory + 1, size) == REFDYN_BAD_MEMORY);
    struct refdyn_model bare = rig.model;
    bare.equations = NULL;
    CHECK(refdyn_workspace_init(&work, &bare, memory, size) == REFDYN_FUNCTION_MISSING);
    CHECK(rig_close(&rig));
    for (int status = -20; status < 20; status++)
        CHECK(refdyn_status_text(status) != NULL);
}

static void double_parameter(double *p) {
    p[1] = 2 * p[0];
}

static void start_from_parameter(const double *p, const double *x, double t, const double *q,
                                 const double *qd, double *out) {
    (void)x, (void)t, (void)q, (void)qd;
    const double state[] = {p[0], p[1], 0.1 * p[0], 0.1 * p[1]};
    memcpy(out, state, sizeof state);
}

static void anchor_at_start(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)qd;
    out[0] = q[0] + t;
}

static void test_parameters(void) {
    static const int anchored[] = {0};
    struct refdyn_model model = rod_model(NULL);
    model.derived_count = 1;
    model.prepare = double_parameter;
    model.start = start_from_parameter;
    model.anchor = anchor_at_start;
    model.anchored = anchored;
    model.anchored_count = 1;
    struct rig rig;
    rig_open(&rig, model);
    CHECK_NEAR(rig.work.p[1], 19.62, 0);
    CHECK_NEAR(rig.q[1], 19.62, 0);
    CHECK_NEAR(rig.qd[0], 0.981, 1e-15);
    const int is_given[] = {1};
    refdyn_anchor(&rig.work, 0.25, rig.q, rig.qd, is_given);
    CHECK_NEAR(rig.work.p[0], 9.81, 0);
    refdyn_anchor(&rig.work, 0.25, rig.q, rig.qd, NULL);
    CHECK_NEAR(rig.work.p[0], 10.06, 1e-14);
    CHECK_NEAR(rig.work.p[1], 20.12, 1e-14);
    CHECK(rig_close(&rig));
}

/* ---- Accelerations ---- */

/* qdd, force and multipliers compared with the multiplier form; the GPME residual multiplied by P^T. */
static void check_case(int n, int m, const int *dependent, double tolerance) {
    struct rig rig;
    double qdd[N_MOST], force[N_MOST], lambda[M_MOST], exact[N_MOST], multipliers[M_MOST];
    rig_open(&rig, given_model(n, m, dependent));
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
    refdyn_multipliers(&rig.work, qdd, lambda);
    refdyn_programme_force(&rig.work, lambda, force);
    multiplier_form(n, m, exact, multipliers);
    const double size = refdyn_largest(exact, n, NULL), most = refdyn_largest(multipliers, m, NULL);
    CHECK_NEAR(largest_difference(qdd, exact, n), 0, tolerance * size);
    CHECK_NEAR(largest_difference(lambda, multipliers, m), 0, tolerance * (most + 1));
    CHECK(rig.work.partition.rank == m);
    const struct refdyn_workspace *work = &rig.work;
    for (int b = 0; b < n - m; b++) { /* independent column b of [P^T 1] (M qdd - f) */
        double sum = 0, largest = 0;
        for (int i = 0; i < n; i++) {
            int place = 0;
            while (work->partition.column[place] != i)
                place++;
            const double share = place < m ? work->P[place * (n - m + 1) + b] : place == m + b;
            sum += share * (dense_dot(work->M + i * n, qdd, n) - work->f[i]);
            for (int j = 0; j < n; j++)
                largest = fmax(largest, fabs(share * work->M[i * n + j] * qdd[j]));
            largest = fmax(largest, fabs(share * work->f[i]));
        }
        CHECK_NEAR(sum, 0, 1e-12 * largest);
    }
    CHECK(rig_close(&rig));
}

static void test_accelerations(void) {
    static const int declared[] = {4, 1};
    for (int trial = 0; trial < 40; trial++) {
        given_model(13, 2, NULL);
        random_case(13, 2, trial % 4);
        check_case(13, 2, NULL, 1e-10);
        given_model(7, 3, NULL);
        random_case(7, 3, 1);
        check_case(7, 3, NULL, 1e-10);
        given_model(6, 2, declared);
        random_case(6, 2, 0.5);
        check_case(6, 2, declared, 1e-9);
        given_model(5, 0, NULL);
        random_case(5, 0, 2);
        check_case(5, 0, NULL, 1e-10);
        given_model(4, 4, NULL); /* no free coordinate remains */
        random_case(4, 4, 1);
        check_case(4, 4, NULL, 1e-9);
    }
}

static void test_stabilise(void) {
    struct rig rig;
    double qdd[3], terms[2];
    rig_open(&rig, spring_model(2));
    const double qd[] = {0.2317, -0.713, 0.617};
    for (int stabilise = REFDYN_NONE; stabilise <= REFDYN_PROJECT; stabilise++) {
        CHECK(refdyn_accelerate(&rig.work, 0.317, rig.q, qd, (enum refdyn_stabilise)stabilise, qdd) ==
              REFDYN_OK);
        for (int a = 0; a < 2; a++) {
            const double wanted = stabilise == REFDYN_BAUMGARTE ? rig.work.k[a] : -rig.work.v[a];
            terms[a] = dense_dot(rig.work.u + 3 * a, qdd, 3);
            CHECK_NEAR(terms[a], wanted, 1e-12 * (1 + fabs(wanted)));
        }
    }
    double force[3];
    double lambda[M_MOST], power = 0;
    refdyn_multipliers(&rig.work, qdd, lambda);
    refdyn_programme_force(&rig.work, lambda, force);
    for (int a = 0; a < 2; a++)
        power += lambda[a] * dense_dot(rig.work.u + 3 * a, qd, 3);
    CHECK_NEAR(power, dense_dot(force, qd, 3), 1e-11);
    CHECK(rig_close(&rig));
}

/* ---- Partition ---- */

static void test_partition_declared(void) {
    static const int declared[] = {4, 1};
    struct rig rig;
    double qdd[6], again[6];
    struct refdyn_model model = given_model(6, 2, declared);
    random_case(6, 2, 0.5);
    rig_open(&rig, model);
    struct refdyn_partition *partition = &rig.work.partition;
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
    CHECK(partition->is_declared && partition->rank == 2 && partition->changes == 0);
    CHECK((partition->column[0] == 4 && partition->column[1] == 1) ||
          (partition->column[0] == 1 && partition->column[1] == 4));
    for (int b = 3; b < 6; b++)
        CHECK(partition->column[b - 1] < partition->column[b]);
    /* the same rows with coordinates 1 and 4 acting alike: K_d is singular, but K is not */
    double *u = given + 36 + 6;
    u[1] = u[4] * 0.77;
    u[7] = u[10] * 0.77;
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
    CHECK(!partition->is_declared && partition->changes == 1 && partition->rank == 2);
    multiplier_form(6, 2, again, rig.qdd);
    CHECK_NEAR(largest_difference(qdd, again, 6), 0, 1e-10 * refdyn_largest(again, 6, NULL));
    /* singular from the start: never chosen, and not counted as a change */
    refdyn_partition_reset(&rig.work);
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, again) == REFDYN_OK);
    CHECK(!partition->is_declared && partition->changes == 0);
    CHECK_NEAR(largest_difference(qdd, again, 6), 0, 1e-12 * refdyn_largest(qdd, 6, NULL));
    CHECK(rig_close(&rig));
}

static void test_partition_choice(void) {
    /* one row, two coordinates: the heavier one has the smaller u/sqrt(M) */
    struct rig rig;
    double qdd[2];
    struct refdyn_model model = given_model(2, 1, NULL);
    const double heavy[] = {1e4, 0, 0, 1.3, 0.7, -0.2, 3.1, 1.7, 0.3, 0, 0, -0.3};
    memcpy(given, heavy, sizeof heavy);
    rig_open(&rig, model);
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_NONE, qdd) == REFDYN_OK);
    CHECK(rig.work.partition.column[0] == 1);
    /* its coefficient fades: kept until the condition number is ten times worse, then changed */
    const double kept = rig.work.partition.condition_chosen;
    for (double fade = 1; fade > 1e-7; fade /= 1.5) {
        given[7] = 1.7 * fade;
        CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_NONE, qdd) == REFDYN_OK);
        CHECK_NEAR(given[6] * qdd[0] + given[7] * qdd[1], -0.3, 1e-13);
        CHECK(rig.work.partition.condition <= 10 * fmax(kept, rig.work.partition.condition_chosen));
    }
    CHECK(rig.work.partition.column[0] == 0 && rig.work.partition.changes == 1);
    CHECK(rig.work.partition.condition_max <= 10 * kept);
    CHECK(rig_close(&rig));
}

/* Row 3 = 0.7 row 1 - 1.9 row 2, times a unit far from that of the others. */
static void make_dependent(double unit) {
    double *u = given + 25 + 5, *v = u + 15, *k = v + 9;
    for (int j = 0; j < 5; j++)
        u[10 + j] = unit * (0.7 * u[j] - 1.9 * u[5 + j]);
    k[2] = unit * (0.7 * k[0] - 1.9 * k[1]);
    v[2] = -k[2];
}

static void test_redundant(void) {
    struct rig rig;
    double qdd[5], exact[5], lambda[3];
    for (int trial = 0; trial < 20; trial++) {
        struct refdyn_model model = given_model(5, 3, NULL);
        random_case(5, 3, 1);
        make_dependent(trial % 2 ? 1e6 : 1e-6);
        rig_open(&rig, model);
        const struct refdyn_partition *partition = &rig.work.partition;
        CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
        CHECK(partition->rank == 2);
        for (int a = 0; a < 3; a++) {
            const double *u = rig.work.u + 5 * a, k = rig.work.k[a];
            CHECK_NEAR(dense_dot(u, qdd, 5), k, 1e-9 * fmax(fabs(k), refdyn_largest(u, 5, NULL)));
        }
        double force[5];
        refdyn_multipliers(&rig.work, qdd, lambda);
        refdyn_programme_force(&rig.work, lambda, force);
        CHECK(lambda[partition->row[2]] == 0);
        for (int i = 0; i < 5; i++)
            CHECK_NEAR(dense_dot(rig.work.M + 5 * i, qdd, 5) - rig.work.f[i], force[i],
                       1e-10 * (1 + refdyn_largest(force, 5, NULL)));
        /* a row that contradicts the others on the programme; off the programme this cannot be detected */
        for (int a = 0; a < 3; a++)
            given[25 + 5 + 15 + 3 + a] = 0;
        given[given_count - 1] *= 1.01;
        CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, exact) ==
              REFDYN_ROWS_INCONSISTENT);
        CHECK(rig.work.fault.row == partition->row[2] && rig.work.fault.coordinate == -1);
        CHECK(rig_close(&rig));
    }
}

/* Rows that are dependent at first and independent later, and the other way round. */
static void test_rank_changes(void) {
    struct rig rig;
    double qdd[5], exact[5], lambda[3];
    struct refdyn_model model = given_model(5, 3, NULL);
    random_case(5, 3, 1);
    make_dependent(1);
    rig_open(&rig, model);
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
    CHECK(rig.work.partition.rank == 2);
    given[25 + 5 + 10] += 0.1;
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
    CHECK(rig.work.partition.rank == 3);
    multiplier_form(5, 3, exact, lambda);
    CHECK_NEAR(largest_difference(qdd, exact, 5), 0, 1e-9 * refdyn_largest(exact, 5, NULL));
    given[25 + 5 + 10] -= 0.1;
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
    CHECK(rig.work.partition.rank == 2);
    /* rows that fade to zero one after the other: 0 = 0 requires nothing, 0 = k is a contradiction */
    for (int a = 0; a < 3; a++) {
        for (int j = 0; j < 5; j++)
            given[25 + 5 + 5 * a + j] = 0;
        CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) ==
              REFDYN_ROWS_INCONSISTENT);
        CHECK(rig.work.fault.row == a);
        given[given_count - 3 + a] = 0;
        CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_OK);
        CHECK(rig.work.partition.rank == (a == 0 ? 2 : 2 - a));
    }
    for (int i = 0; i < 5; i++)
        CHECK_NEAR(dense_dot(rig.work.M + 5 * i, qdd, 5), rig.work.f[i], 1e-12 * (1 + fabs(rig.work.f[i])));
    CHECK(rig_close(&rig));
}

/* ---- Errors are reported ---- */

static void test_faults(void) {
    struct rig rig;
    double qdd[5];
    struct refdyn_model model = given_model(5, 2, NULL);
    /* entries of M, f, u, v, psi, k; place of the fault */
    static const struct {
        int entry, row, coordinate;
    } places[] = {{13, -1, 2}, {25 + 3, -1, 3}, {30 + 7, 1, -1}, {40, 0, -1}, {44 + 1, 1, -1}, {46, 0, -1}};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        for (int infinite = 0; infinite < 2; infinite++) {
            random_case(5, 2, 1);
            given[places[i].entry] = infinite ? -INFINITY : NAN;
            rig_open(&rig, model);
            CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_BAUMGARTE, qdd) == REFDYN_NOT_FINITE);
            CHECK(rig.work.fault.row == places[i].row && rig.work.fault.coordinate == places[i].coordinate);
            CHECK(rig_close(&rig));
        }
    random_case(5, 2, 0);
    for (int j = 0; j < 5; j++)
        given[3 * 5 + j] = given[j * 5 + 3] = 0;
    given[30 + 3] = given[35 + 3] = 0; /* coordinate 3 has no mass and no row */
    rig_open(&rig, model);
    CHECK(refdyn_accelerate(&rig.work, 0, rig.q, rig.qd, REFDYN_NONE, qdd) == REFDYN_MASS_NOT_POSITIVE);
    CHECK(rig.work.fault.coordinate == 3 && rig.work.fault.row == -1);
    CHECK(refdyn_project(&rig.work, 0, rig.q, rig.qd, NULL) == REFDYN_MASS_NOT_POSITIVE);
    CHECK(rig_close(&rig));
}

/* ---- Projection ---- */

static void test_residuals(void) {
    struct rig rig;
    rig_open(&rig, spring_model(2));
    CHECK(refdyn_equations(&rig.work, 0.317, rig.q, rig.qd) == REFDYN_OK);
    const struct refdyn_residual off = refdyn_residuals(&rig.work);
    CHECK(off.phi_row == 0 && off.psi_row == 1);
    CHECK_NEAR(off.phi, fabs(rig.work.phi[0]), 0);
    CHECK(!refdyn_is_consistent(&rig.work, 1e-8, rig.q, rig.qd));
    CHECK(rig_close(&rig));
    rig_open(&rig, film_model());
    CHECK(refdyn_equations(&rig.work, 0, rig.q, rig.qd) == REFDYN_OK);
    CHECK(refdyn_residuals(&rig.work).phi_row == -1 && refdyn_is_consistent(&rig.work, 0, rig.q, rig.qd));
    CHECK(rig_close(&rig));
}

static void test_project(void) {
    struct rig rig;
    struct refdyn_residual before;
    rig_open(&rig, spring_model(2));
    double q[3], qd[3] = {0.2317, -0.713, 0.617};
    memcpy(q, rig.q, sizeof q);
    CHECK(refdyn_project(&rig.work, 0.317, q, qd, &before) == REFDYN_OK);
    CHECK(before.phi > 1e-2 && before.psi > 1e-2);
    double left[2];
    spring_phi(NULL, NULL, 0.317, q, qd, left);
    CHECK_NEAR(left[0], 0, 4 * DBL_EPSILON);
    spring_psi(NULL, NULL, 0.317, q, qd, left);
    CHECK_NEAR(left[0], 0, 8 * DBL_EPSILON);
    CHECK_NEAR(left[1], 0, 16 * DBL_EPSILON);
    CHECK(refdyn_is_consistent(&rig.work, 1e-14, q, qd));
    /* a state on the programme is unchanged to the bit, after one evaluation */
    const long evaluations = rig.work.evaluations;
    const double q_kept[] = {q[0], q[1], q[2]};
    CHECK(refdyn_project(&rig.work, 0.317, q, qd, NULL) == REFDYN_OK);
    CHECK(memcmp(q, q_kept, sizeof q) == 0);
    CHECK(rig.work.evaluations <= evaluations + 2);
    CHECK(rig_close(&rig));
}

/* Velocities with linear rows: M dqd is in the space of the rows, so no smaller change exists. */
static void test_project_metric(void) {
    struct rig rig;
    rig_open(&rig, cranks_model());
    const double qd_start[] = {0.713, 0.317, -0.413, 0.217};
    double qd[4], change[4], push[4], pull[4];
    memcpy(qd, qd_start, sizeof qd);
    CHECK(refdyn_project(&rig.work, 0, rig.q, qd, NULL) == REFDYN_OK); /* rank 3 of 4 rows */
    for (int j = 0; j < 4; j++)
        change[j] = qd[j] - qd_start[j];
    for (int i = 0; i < 4; i++)
        push[i] = dense_dot(rig.work.M + 4 * i, change, 4);
    /* the only motion of the cranks: all alike, with a level coupler */
    const double motion[] = {1, 0, 1, 1};
    CHECK_NEAR(dense_dot(push, motion, 4), 0, 1e-14);
    for (int j = 0; j < 4; j++)
        pull[j] = qd[0] * motion[j];
    CHECK_NEAR(largest_difference(qd, pull, 4), 0, 1e-14);
    CHECK(rig_close(&rig));
}

static void test_project_fails(void) {
    struct rig rig;
    double q[2] = {0, 0}, qd[2] = {0.3, 0.7}; /* the middle of the circle: u = 0 while phi = -1 */
    rig_open(&rig, rod_model(NULL));
    CHECK(refdyn_project(&rig.work, 0, q, qd, NULL) == REFDYN_NO_CONVERGENCE);
    CHECK(rig.work.fault.row == 0);
    CHECK(rig_close(&rig));
}

int main(void) {
    test_version();
    test_factor();
    test_factor_refuses();
    test_workspace();
    test_parameters();
    test_accelerations();
    test_stabilise();
    test_partition_declared();
    test_partition_choice();
    test_redundant();
    test_rank_changes();
    test_faults();
    test_residuals();
    test_project();
    test_project_metric();
    test_project_fails();
    return check_summary();
}
