/* Small motions about a state at rest: their linear equations, warnings, and the results as entries. */
#include "runtime/record/record.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- The linear equations ---- */

/*
 * Linearises the equations of motion about a state at rest, with the multipliers that balance it best.
 *
 * K and D are the derivatives of M qdd - h - Q - u^T lambda at qd = 0 and qdd = 0. There h, quadratic in qd,
 * does not contribute to K, nor does M. phi and psi themselves are linearised; gains of stabilisation do not
 * enter.
 */

/* [rad, m] and [rad/s^2, m/s^2]; equilibria from statics are balanced much better */
static const double distance_tol = 1e-6;
static const double acceleration_tol = 1e-9;

static void call(const struct record_small_motions *motions, refdyn_function *function, const double *qd,
                 double *out) {
    function(motions->work->p, motions->work->x, motions->t, motions->q, qd, out);
}

static double *part_of(const struct record_algebra *algebra, const struct record_linear *linear,
                       const double *whole, int rows, int stride, const int *row_place) {
    double *part = record_allocate_matrix(algebra, rows, linear->n);
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < linear->n; j++)
            part[i * linear->n + j] = whole[(row_place ? row_place[i] : i) * stride + linear->place[j]];
    return part;
}

/* Minimises |force + u^T lambda| in units of sqrt(M_jj), in which the runtime also measures rows. Of several
 * minima it takes the smallest. */
static int find_multipliers(const struct record_algebra *algebra, const struct record_linear *linear,
                            const double *force, double *lambda) {
    const int n = linear->n, m = linear->m;
    double *A = record_allocate_matrix(algebra, n, m), *b = record_allocate_matrix(algebra, n > m ? n : m, 1);
    double *size = record_allocate_matrix(algebra, m, 1);
    for (int j = 0; j < n; j++)
        b[j] = -force[j] / sqrt(linear->M[j * n + j]);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            A[j * m + i] = linear->u[i * n + j] / sqrt(linear->M[j * n + j]);
            size[i] = fmax(size[i], fabs(A[j * m + i]));
        }
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n && size[i] > 0; j++)
            A[j * m + i] /= size[i];
    if (!algebra->least_squares(algebra->context, n, m, A, b, sqrt(DBL_EPSILON), lambda))
        return REFDYN_NOT_FINITE;
    for (int i = 0; i < m; i++)
        lambda[i] = size[i] > 0 ? lambda[i] / size[i] : 0;
    return REFDYN_OK;
}

/* M qdd = f + u^T lambda with u qdd = k for the coordinates that are not held, the others at rest: qdd = N a
 * + c with u c = k and u N = 0, N^T M N a = N^T (f - M c). */
static int find_accelerations(const struct record_algebra *algebra, const struct record_linear *linear,
                              const double *f, const double *k, double *qdd) {
    const int n = linear->n, m = linear->m;
    double *minus_k = record_allocate_matrix(algebra, m, 1), *right = record_allocate_matrix(algebra, n, 1);
    struct record_freedom freedom;
    for (int i = 0; i < m; i++)
        minus_k[i] = -k[i];
    record_find_freedom(&freedom, algebra, linear->u, m, n, minus_k, 1);
    const int free = n - freedom.rank;
    memcpy(right, f, (size_t)n * sizeof *right);
    record_add_product(right, -1, linear->M, freedom.drift, n, n, 1);
    double *a = record_product_of_columns(algebra, freedom.basis, free, right, 1, n);
    double *mass = record_product_of_columns(
        algebra, freedom.basis, free, record_product(algebra, linear->M, freedom.basis, n, n, free), free, n);
    if (!record_factor(mass, free))
        return REFDYN_MASS_NOT_POSITIVE;
    record_solve_factored(mass, free, a, 1);
    memcpy(qdd, freedom.drift, (size_t)n * sizeof *qdd);
    record_add_product(qdd, 1, freedom.basis, a, n, free, 1);
    return REFDYN_OK;
}

/* Sets force: f - M qdd, and with the multipliers f - M qdd + u^T lambda. */
static int balance(const struct record_algebra *algebra, struct record_linear *linear, const double *qdd,
                   double *lambda) {
    const int n = linear->n, m = linear->m;
    record_add_product(linear->force, -1, linear->M, qdd, n, n, 1);
    const int status = m && n ? find_multipliers(algebra, linear, linear->force, lambda) : REFDYN_OK;
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < m; i++)
            linear->force[j] += linear->u[i * n + j] * lambda[i];
        linear->residual = fmax(linear->residual, fabs(linear->force[j]));
    }
    return status;
}

static void choose_places(const struct record_algebra *algebra, struct record_linear *linear,
                          const struct refdyn_model *model, const int *held) {
    *linear = (struct record_linear){.m = model->m};
    linear->place = record_allocate(algebra, (size_t)model->n, sizeof *linear->place);
    linear->level = record_allocate(algebra, (size_t)linear->m, sizeof *linear->level);
    for (int j = 0; j < model->n; j++)
        if (!held[j]) {
            linear->states += j >= refdyn_joint_count(model);
            linear->place[linear->n++] = j;
        }
    for (int i = 0; i < linear->m; i++)
        linear->level[i] = model->rows[i].level;
}

/* A row that is rounding alone becomes 0: held coordinates or the axes of joints take up all of it. */
static void drop_rounding_rows(const struct record_linear *linear, const struct refdyn_workspace *work) {
    const int n = linear->n;
    for (int i = 0; i < linear->m; i++) {
        double *row = linear->u + i * n, largest = 0, size = 0;
        for (int j = 0; j < n; j++) {
            largest = fmax(largest, fabs(row[j]) * work->weight[linear->place[j]]);
            size = fmax(size, work->sizes[i * work->n + linear->place[j]] * work->weight[linear->place[j]]);
        }
        if (largest <= work->rank_tol * size)
            memset(row, 0, (size_t)n * sizeof *row);
    }
}

/* Returns REFDYN_NOT_FINITE, with the fault at the first row of K and D, or of psi_q, that is infinite or
 * NaN. */
static int check_finite(const struct record_linear *linear, struct refdyn_fault *fault) {
    const int n = linear->n;
    for (int i = n * n - 1; i >= 0; i--)
        if (!isfinite(linear->K[i]) || !isfinite(linear->D[i]))
            fault->coordinate = linear->place[i / n];
    for (int i = linear->m * n - 1; i >= 0; i--)
        if (!isfinite(linear->psi_q[i]))
            fault->row = i / n;
    return fault->coordinate < 0 && fault->row < 0 ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* Computes the derivatives over the free coordinates. */
static int finish(struct record_small_motions *motions, const struct record_algebra *algebra) {
    struct record_linear *linear = &motions->linear;
    const struct refdyn_model *model = motions->work->model;
    const int n = linear->n, m = linear->m, all = model->n;
    double *tangent =
        record_allocate_matrix(algebra, 1, all + m + 3 * (all + m) * all); /* f_t g_t G_q G_qd u K D M */
    double *rows =
        record_allocate_matrix(algebra, 3 * m, 2 * all + model->input_count); /* psi_q psi_qd ... */
    call(motions, model->tangent, linear->given, tangent);
    if (m)
        call(motions, model->d_rows, motions->qd, rows);
    const double *G = tangent + all + m, *K = G + 3 * m * all;
    linear->G_q = part_of(algebra, linear, G, m, all, NULL);
    linear->G_qd = part_of(algebra, linear, G + m * all, m, all, NULL);
    linear->K = part_of(algebra, linear, K, n, all, linear->place);
    linear->D = part_of(algebra, linear, K + all * all, n, all, linear->place);
    linear->psi_q = part_of(algebra, linear, rows, m, all, NULL);
    return check_finite(linear, &motions->work->fault);
}

/* Coordinates are measured in 1/sqrt(M_jj). */
static int check_mass(const struct record_linear *linear, struct refdyn_fault *fault) {
    for (int j = 0; j < linear->n; j++)
        if (!(linear->M[j * (linear->n + 1)] > 0)) {
            fault->coordinate = linear->place[j];
            return REFDYN_MASS_NOT_POSITIVE;
        }
    return REFDYN_OK;
}

int record_linearise(struct record_small_motions *motions, const struct record_algebra *algebra) {
    struct record_linear *linear = &motions->linear;
    struct refdyn_workspace *work = motions->work;
    const int all = work->model->n;
    choose_places(algebra, linear, work->model, motions->held);
    int status = refdyn_equations(work, motions->t, motions->q, motions->qd);
    if (status != REFDYN_OK)
        return status;
    work->fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
    double *qdd = record_allocate_matrix(algebra, linear->n, 1);
    linear->given = record_allocate_matrix(algebra, 1, 2 * all + 1 + linear->m);
    memcpy(linear->given, motions->qd, (size_t)all * sizeof *linear->given);
    linear->force = record_allocate_matrix(algebra, linear->n, 1);
    for (int j = 0; j < linear->n; j++)
        linear->force[j] = work->f[linear->place[j]];
    linear->M = part_of(algebra, linear, work->M, linear->n, all, linear->place);
    linear->u = part_of(algebra, linear, work->u, linear->m, all, NULL);
    refdyn_row_sizes(work);
    drop_rounding_rows(linear, work);
    status = check_mass(linear, &work->fault);
    if (motions->given) {
        linear->given = (double *)motions->given;
    } else if (status == REFDYN_OK) {
        if (motions->accelerates)
            status = find_accelerations(algebra, linear, linear->force, work->k, qdd);
        for (int j = 0; j < linear->n; j++)
            linear->given[all + linear->place[j]] = qdd[j];
        if (status == REFDYN_OK)
            status = balance(algebra, linear, qdd, linear->given + 2 * all + 1);
    }
    return status == REFDYN_OK ? finish(motions, algebra) : status;
}

int record_find_unbalanced(const struct record_linear *linear, const double *force) {
    for (int j = 0; j < linear->n; j++) {
        const double *row = linear->K + j * linear->n, *by_states = linear->D + j * linear->n;
        double stiffness = 0;
        for (int i = 0; i < linear->n; i++)
            stiffness = fmax(stiffness, fabs(i < linear->n - linear->states ? row[i] : by_states[i]));
        if (fabs(force[j]) > distance_tol * stiffness &&
            fabs(force[j]) > acceleration_tol * linear->M[j * (linear->n + 1)])
            return j;
    }
    return -1;
}

int record_find_small_motions(struct record_small_motions *motions, const struct record_algebra *algebra) {
    struct refdyn_workspace *work = motions->work;
    const struct refdyn_model *model = work->model;
    motions->C = record_allocate_matrix(algebra, 3 * model->point_count, model->n);
    int status = record_linearise(motions, algebra);
    if (status == REFDYN_OK)
        status = record_find_spectrum(&motions->spectrum, &motions->linear, algebra);
    if (status != REFDYN_OK)
        return status;
    motions->phi = refdyn_residuals(work).phi;
    motions->kink = record_find_kink(motions, algebra);
    if (model->point_count)
        call(motions, model->C, motions->qd, motions->C);
    return REFDYN_OK;
}

/* Largest residual phi of a state on the programme [rad, m]; larger ones are reported. */
static const double programme_tol = 1e-6;

/* ---- Warnings ---- */

void record_print_small_motions(const struct record_small_motions *motions, FILE *out) {
    const struct record_linear *linear = &motions->linear;
    const struct refdyn_model *model = motions->work->model;
    const int off = record_find_unbalanced(linear, linear->force);
    record_print_rows_left_out(model, motions->spectrum.redundant, motions->spectrum.redundant_count, out);
    if (off >= 0)
        fprintf(out, "refdyn: warning: this state is not an equilibrium: %s is out of balance by %.4g\n",
                model->coordinates[linear->place[off]].name, fabs(linear->force[off]));
    record_print_kink(&motions->kink, model, out);
    if (motions->phi > programme_tol)
        fprintf(out, "refdyn: warning: the state is off the programme: largest |phi| %.4g\n", motions->phi);
}

static const double pi = 3.14159265358979323846;

double record_frequency_of(const struct record_mode *mode) {
    return (cimag(mode->eigenvalue) + 0.0) / (2 * pi); /* no -0 */
}

double record_damping_of(const struct record_mode *mode) {
    const double omega = cabs(mode->eigenvalue);
    return omega > 0 ? 0 - creal(mode->eigenvalue) / omega : 0; /* no -0 */
}

/* ---- Entries ---- */

static void put_complex(const struct record_writer *writer, const char *key, const double complex *values,
                        int count) {
    static const char *const parts[] = {"re", "im"};
    writer->open(writer->context, key, '{');
    for (int part = 0; part < 2; part++) {
        writer->open(writer->context, parts[part], '[');
        for (int i = 0; i < count; i++)
            writer->number(writer->context, NULL,
                           (part ? cimag(values[i]) : creal(values[i])) + 0.0); /* no -0 */
        writer->close(writer->context, ']');
    }
    writer->close(writer->context, '}');
}

/* The entries of the coordinates, and those of states by name. */
static void put_shape(const struct record_writer *writer, const struct record_small_motions *motions,
                      const struct record_mode *mode) {
    const struct refdyn_model *model = motions->work->model;
    const int n = model->n;
    double complex *shape = record_allocate(motions->spectrum.algebra, (size_t)n, sizeof *shape);
    for (int j = 0; j < motions->linear.n; j++)
        shape[motions->linear.place[j]] = mode->shape[j];
    const int joints = refdyn_joint_count(model);
    put_complex(writer, "shape", shape, joints);
    if (joints < n)
        put_complex(writer, "shape_of_states", shape + joints, n - joints);
    writer->open(writer->context, "points", '{');
    for (int i = 0; i < model->point_count; i++) {
        double complex moved[3] = {0}; /* C shape */
        for (int axis = 0; axis < 3; axis++)
            for (int j = 0; j < n; j++)
                moved[axis] += motions->C[(3 * i + axis) * n + j] * shape[j];
        put_complex(writer, model->points[i], moved, 3);
    }
    writer->close(writer->context, '}');
}

static void put_mode(const struct record_writer *writer, const struct record_small_motions *motions,
                     const struct record_mode *mode) {
    const double re = creal(mode->eigenvalue) + 0.0, im = cimag(mode->eigenvalue) + 0.0; /* no -0 */
    writer->open(writer->context, NULL, '{');
    writer->number(writer->context, "frequency", record_frequency_of(mode));
    writer->number(writer->context, "omega", cabs(mode->eigenvalue));
    writer->number(writer->context, "damping", record_damping_of(mode));
    record_put_array(writer, "eigenvalue", (const double[]){re, im}, 2);
    put_shape(writer, motions, mode);
    writer->close(writer->context, '}');
}

void record_put_small_motions(const struct record_small_motions *motions, int count,
                              const struct record_writer *writer) {
    const struct record_spectrum *spectrum = &motions->spectrum;
    int unstable = 0;
    for (int i = 0; i < spectrum->count; i++)
        unstable += creal(spectrum->modes[i].eigenvalue) > 0;
    writer->number(writer->context, "phi", motions->phi);
    writer->number(writer->context, "residual", motions->linear.residual);
    writer->whole(writer->context, "unstable", unstable);
    writer->open(writer->context, "modes", '[');
    for (int i = 0; i < count; i++)
        put_mode(writer, motions, &spectrum->modes[i]);
    writer->close(writer->context, ']');
}
