/* `refdyn modes`: computes frequencies, damping ratios and shapes of small motions about a state at rest;
 * prints JSON and a table. */
#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"

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

/* d_rows begins with psi_q and psi_qd. Derivatives by t, inputs and parameters, then k and phi follow. */
static size_t rows_room(const struct refdyn_model *model) {
    size_t variables = 2 * (size_t)model->n + 1 + (size_t)model->input_count + (size_t)model->parameter_count;
    return 3 * (size_t)model->m * variables;
}

static void call(const struct scene *scene, refdyn_function *function, const double *qd, double *out) {
    function(scene->work.p, scene->work.x, scene->state.t, scene->q, qd, out);
}

static double *part_of(const struct linear *linear, const double *whole, int rows, int stride,
                       const int *row_place) {
    double *part = format_allocate_matrix(rows, linear->n);
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < linear->n; j++)
            part[i * linear->n + j] = whole[(row_place ? row_place[i] : i) * stride + linear->place[j]];
    return part;
}

/* Minimises |Q + u^T lambda| in units of sqrt(M_jj), in which the runtime also measures rows. */
static int find_multipliers(const struct linear *linear, const double *Q, double *lambda) {
    const int n = linear->n, m = linear->m, larger = n > m ? n : m;
    double *A = format_allocate_matrix(n, m), *b = format_allocate_matrix(larger, 1);
    double *size = format_allocate_matrix(m, 1), *singular = format_allocate_matrix(larger, 1);
    lapack_int rank;
    for (int j = 0; j < n; j++)
        b[j] = -Q[linear->place[j]] / sqrt(linear->M[j * n + j]);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            A[j * m + i] = linear->u[i * n + j] / sqrt(linear->M[j * n + j]);
            size[i] = fmax(size[i], fabs(A[j * m + i]));
        }
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n && size[i] > 0; j++)
            A[j * m + i] /= size[i];
    lapack_int info =
        LAPACKE_dgelsd(LAPACK_ROW_MAJOR, n, m, 1, A, m, b, 1, singular, sqrt(DBL_EPSILON), &rank);
    for (int i = 0; i < m; i++)
        lambda[i] = size[i] > 0 ? b[i] / size[i] : 0;
    return info == 0 ? REFDYN_OK : REFDYN_NOT_FINITE;
}

static void find_residual(struct linear *linear, const double *Q, const double *lambda) {
    linear->force = format_allocate_matrix(linear->n, 1);
    for (int j = 0; j < linear->n; j++) {
        linear->force[j] = Q[linear->place[j]];
        for (int i = 0; i < linear->m; i++)
            linear->force[j] += linear->u[i * linear->n + j] * lambda[i];
        linear->residual = fmax(linear->residual, fabs(linear->force[j]));
    }
}

static void choose_places(struct linear *linear, struct scene *scene, const int *held) {
    *linear = (struct linear){.m = scene->model->m};
    linear->place = format_allocate((size_t)scene->model->n, sizeof *linear->place);
    linear->is_level_q = format_allocate((size_t)linear->m, sizeof *linear->is_level_q);
    for (int j = 0; j < scene->model->n; j++)
        if (!held[j])
            linear->place[linear->n++] = j;
    for (int i = 0; i < linear->m; i++)
        linear->is_level_q[i] = scene->model->rows[i].level == REFDYN_POSITION;
}

/* Returns REFDYN_NOT_FINITE, with the fault at the first row of K and D, or of psi_q, that is infinite or
 * NaN. */
static int check_finite(const struct linear *linear, struct refdyn_fault *fault) {
    const int n = linear->n;
    for (int i = n * n - 1; i >= 0; i--)
        if (!isfinite(linear->K[i]) || !isfinite(linear->D[i]))
            fault->coordinate = linear->place[i / n];
    for (int i = linear->m * n - 1; i >= 0; i--)
        if (!isfinite(linear->psi_q[i]))
            fault->row = i / n;
    return fault->coordinate < 0 && fault->row < 0 ? REFDYN_OK : REFDYN_NOT_FINITE;
}

/* Computes K, D and psi_q over the free coordinates. rest (2 n + 1 + m): rates, accelerations and power,
 * which are 0, and lambda. */
static int finish(struct linear *linear, struct scene *scene, const double *rest) {
    const int n = linear->n, m = linear->m, all = scene->model->n;
    double *tangent = format_allocate_matrix(1, all + m + 3 * (all + m) * all); /* f_t g_t G_q G_qd u K D M */
    double *rows = format_allocate(rows_room(scene->model), sizeof *rows);      /* psi_q psi_qd ... */
    call(scene, scene->model->tangent, rest, tangent);
    if (m)
        call(scene, scene->model->d_rows, scene->qd, rows);
    const double *K = tangent + all + m * (1 + 3 * all);
    linear->K = part_of(linear, K, n, all, linear->place);
    linear->D = part_of(linear, K + all * all, n, all, linear->place);
    linear->psi_q = part_of(linear, rows, m, all, NULL);
    for (int i = 0; i < m; i++)
        if (linear->is_level_q[i])
            memset(linear->psi_q + i * n, 0, (size_t)n * sizeof(double));
    return check_finite(linear, &scene->work.fault);
}

/* Coordinates are measured in 1/sqrt(M_jj). */
static int check_mass(const struct linear *linear, struct scene *scene) {
    for (int j = 0; j < linear->n; j++)
        if (!(linear->M[j * (linear->n + 1)] > 0)) {
            scene->work.fault.coordinate = linear->place[j];
            return REFDYN_MASS_NOT_POSITIVE;
        }
    return REFDYN_OK;
}

/* lambda minimises |Q + u^T lambda|; of several minima, it is the smallest. Returns a status of the runtime.
 */
static int linearise(struct linear *linear, struct scene *scene, const int *held) {
    const int all = scene->model->n;
    choose_places(linear, scene, held);
    int status = refdyn_equations(&scene->work, scene->state.t, scene->q, scene->qd);
    if (status != REFDYN_OK)
        return status;
    scene->work.fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
    double *Q = format_allocate_matrix(all, 1), *rest = format_allocate_matrix(1, 2 * all + 1 + linear->m);
    double *lambda = rest + 2 * all + 1;
    call(scene, scene->model->Q, scene->qd, Q);
    linear->M = part_of(linear, scene->work.M, linear->n, all, linear->place);
    linear->u = part_of(linear, scene->work.u, linear->m, all, NULL);
    status = check_mass(linear, scene);
    if (status == REFDYN_OK && linear->m && linear->n)
        status = find_multipliers(linear, Q, lambda);
    if (status == REFDYN_OK)
        status = finish(linear, scene, rest);
    find_residual(linear, Q, lambda);
    return status;
}

/* The first coordinate that is out of balance by more than 1e-6 rad or m, and by an acceleration of more than
 * 1e-9 rad/s^2 or m/s^2; -1 if the state is an equilibrium. */
static int find_unbalanced(const struct linear *linear) {
    for (int j = 0; j < linear->n; j++) {
        const double *row = linear->K + j * linear->n;
        double stiffness = 0, force = fabs(linear->force[j]);
        for (int i = 0; i < linear->n; i++)
            stiffness = fmax(stiffness, fabs(row[i]));
        if (force > distance_tol * stiffness && force > acceleration_tol * linear->M[j * (linear->n + 1)])
            return j;
    }
    return -1;
}

/* ---- The command ---- */

static const double pi = 3.14159265358979323846;
/* Largest residual phi of a state on the programme [rad, m]; larger ones are reported. */
static const double programme_tol = 1e-6;

struct analysis {
    struct scene *scene;
    const char *at;
    int *held;  /* (n) */
    double phi; /* largest |phi| */
    double *C;  /* (points x 3 x n) */
    int count;  /* modes to print */
    struct linear linear;
    struct spectrum spectrum;
};

static const char *place_of(const struct options *options) {
    return options_text(options, "at") ? options_text(options, "at") : "statics";
}

/* Such a row would need derivatives of its right side v. */
static bool is_in_accelerations(const struct row *row) {
    return row->level == ROW_ACCELERATION;
}

static enum status check(struct scene *scene) {
    if (!scene->model->tangent) {
        fprintf(stderr, "refdyn: %s: modes needs the corrected form\n", scene->model->name);
        return STATUS_FAULT;
    }
    return scene_refuse_row(scene, is_in_accelerations,
                            "is a row in accelerations; modes needs rows of positions or velocities");
}

static void warn_of_rates(const struct scene *scene, const char *path) {
    for (int i = 0; scene->state.qd && i < scene->model->n; i++) {
        if (scene->state.qd[i] == 0)
            continue;
        fprintf(stderr, "%s: warning: qd: modes are small motions about rest; all rates are set to 0\n",
                path);
        return;
    }
}

/* Sets q from --at, qd = 0, and the parameters of a motion that starts there. */
static enum status place(struct analysis *analysis, const struct options *options) {
    struct scene *scene = analysis->scene;
    enum status status = STATUS_DONE;
    if (strcmp(analysis->at, "statics") == 0) {
        struct equilibrium equilibrium;
        status = equilibria_find(scene, options, &equilibrium);
        analysis->held = equilibrium.held;
    } else {
        status = equilibria_refuse_options(options, "--at statics");
        if (status == STATUS_DONE)
            status = equilibria_choose_held(scene, options, analysis->held);
    }
    warn_of_rates(scene, options_text(options, "at"));
    memset(scene->qd, 0, (size_t)scene->model->n * sizeof *scene->qd);
    refdyn_anchor(&scene->work, scene->state.t, scene->q, scene->qd, scene->given);
    return status;
}

/* ---- Warnings ---- */

static void print_warnings(const struct analysis *analysis) {
    const struct linear *linear = &analysis->linear;
    const int off = find_unbalanced(linear);
    record_print_rows_left_out(analysis->scene->model, analysis->spectrum.redundant,
                               analysis->spectrum.redundant_count, stderr);
    if (off >= 0)
        fprintf(stderr, "refdyn: warning: this state is not an equilibrium: %s is out of balance by %.4g\n",
                analysis->scene->model->coordinates[linear->place[off]].name, fabs(linear->force[off]));
    if (analysis->phi > programme_tol)
        fprintf(stderr, "refdyn: warning: the state is off the programme: largest |phi| %.4g\n",
                analysis->phi);
}

/* Damping ratio; -1 for growth without oscillation, 0 for an eigenvalue 0. */
static double damping_of(const struct mode *mode) {
    const double omega = cabs(mode->eigenvalue);
    return omega > 0 ? 0 - creal(mode->eigenvalue) / omega : 0; /* no -0 */
}

static void print_table(const struct analysis *analysis) {
    fputs("mode  frequency [Hz]  omega [rad/s]  damping ratio\n", stderr);
    for (int i = 0; i < analysis->count; i++) {
        const struct mode *mode = &analysis->spectrum.modes[i];
        fprintf(stderr, "%4d  %14.6g  %13.6g  %13.6g%s\n", i + 1, (cimag(mode->eigenvalue) + 0.0) / (2 * pi),
                cabs(mode->eigenvalue), damping_of(mode), creal(mode->eigenvalue) > 0 ? "  unstable" : "");
    }
}

/* ---- JSON ---- */

static void put_complex(struct document *document, const char *key, const double complex *values, int count) {
    static const char *const parts[] = {"re", "im"};
    format_put_open(document, key, '{');
    for (int part = 0; part < 2; part++) {
        format_put_open(document, parts[part], '[');
        for (int i = 0; i < count; i++)
            format_put_number(document, NULL, (part ? cimag(values[i]) : creal(values[i])) + 0.0); /* no -0 */
        format_put_close(document, ']');
    }
    format_put_close(document, '}');
}

static void put_shape(struct document *document, const struct analysis *analysis, const struct mode *mode) {
    const struct refdyn_model *model = analysis->scene->model;
    const int n = model->n;
    double complex *shape = format_allocate((size_t)n, sizeof *shape);
    for (int j = 0; j < analysis->linear.n; j++)
        shape[analysis->linear.place[j]] = mode->shape[j];
    put_complex(document, "shape", shape, n);
    format_put_open(document, "points", '{');
    for (int i = 0; i < model->point_count; i++) {
        double complex moved[3] = {0}; /* C shape */
        for (int axis = 0; axis < 3; axis++)
            for (int j = 0; j < n; j++)
                moved[axis] += analysis->C[(3 * i + axis) * n + j] * shape[j];
        put_complex(document, model->points[i], moved, 3);
    }
    format_put_close(document, '}');
}

static void put_mode(struct document *document, const struct analysis *analysis, const struct mode *mode) {
    const double re = creal(mode->eigenvalue) + 0.0, im = cimag(mode->eigenvalue) + 0.0; /* no -0 */
    format_put_open(document, NULL, '{');
    format_put_number(document, "frequency", im / (2 * pi));
    format_put_number(document, "omega", cabs(mode->eigenvalue));
    format_put_number(document, "damping", damping_of(mode));
    format_put_array(document, "eigenvalue", (const double[]){re, im}, 2);
    put_shape(document, analysis, mode);
    format_put_close(document, '}');
}

static enum status print_analysis(const struct analysis *analysis) {
    struct scene *scene = analysis->scene;
    const struct spectrum *spectrum = &analysis->spectrum;
    struct document document;
    int unstable = 0;
    format_document_open(&document);
    for (int i = 0; i < spectrum->count; i++)
        unstable += creal(spectrum->modes[i].eigenvalue) > 0;
    format_put_open(&document, NULL, '{');
    format_put_text(&document, "name", scene->model->name);
    scene_put_coordinates(&document, "coordinates", scene->model, NULL);
    format_put_text(&document, "at", analysis->at);
    scene_put_state(&document, scene);
    scene_put_positions(&document, scene);
    scene_put_coordinates(&document, "held", scene->model, analysis->held);
    format_put_number(&document, "phi", analysis->phi);
    format_put_number(&document, "residual", analysis->linear.residual);
    format_put_whole(&document, "unstable", unstable);
    format_put_open(&document, "modes", '[');
    for (int i = 0; i < analysis->count; i++)
        put_mode(&document, analysis, &spectrum->modes[i]);
    format_put_close(&document, ']');
    format_put_close(&document, '}');
    return scene_finish(scene, &document);
}

/* ---- The command ---- */

static int compute(struct analysis *analysis, const struct options *options) {
    const double modes = options_number(options, "modes");
    struct scene *scene = analysis->scene;
    const struct refdyn_model *model = scene->model;
    int result = linearise(&analysis->linear, scene, analysis->held);
    if (result == REFDYN_OK)
        result = equilibria_find_spectrum(&analysis->spectrum, &analysis->linear);
    if (result != REFDYN_OK)
        return result;
    analysis->phi = refdyn_residuals(&scene->work).phi;
    analysis->count = analysis->spectrum.count;
    if (modes > 0 && modes < analysis->count)
        analysis->count = (int)modes;
    if (model->point_count)
        model->C(scene->work.p, scene->work.x, scene->state.t, scene->q, scene->qd, analysis->C);
    return REFDYN_OK;
}

static enum status analyse(struct scene *scene, const struct options *options) {
    const size_t n = (size_t)scene->model->n, points = (size_t)scene->model->point_count;
    struct analysis analysis = {.scene = scene, .at = place_of(options)};
    analysis.held = format_allocate(n, sizeof *analysis.held);
    analysis.C = format_allocate(3 * points * n, sizeof *analysis.C);
    enum status status = check(scene);
    if (status == STATUS_DONE)
        status = place(&analysis, options);
    int result = status == STATUS_DONE ? compute(&analysis, options) : REFDYN_OK;
    if (result != REFDYN_OK)
        status = scene_numbers_failed(scene, result, scene->state.t, scene->q, NULL);
    if (status == STATUS_DONE && result == REFDYN_OK)
        status = print_analysis(&analysis);
    if (status == STATUS_DONE) {
        print_warnings(&analysis);
        print_table(&analysis);
    }
    return status;
}

static enum status run_modes(const struct options *options) {
    return scene_run(options, NEEDS_RESULT | NEEDS_STATICS | NEEDS_POINTS | NEEDS_TANGENT | NEEDS_LINEAR,
                     options_state_path(options_text(options, "at")), analyse);
}

static const struct option_rule modes_rules[] = {
    {"at", "WHERE", OPTION_TEXT, "statics (default), initial, or a STATE.json; rates are 0", options_places,
     NULL},
    {"modes", "K", OPTION_COUNT, "the K slowest modes only", NULL, NULL},
    {.name = NULL}};

const struct command modes_command = {.name = "modes",
                                      .run = run_modes,
                                      .operands = "MODEL.lua",
                                      .options = "output at modes hold release way set fold",
                                      .tables = {modes_rules, equilibria_rules, scene_rules},
                                      .output = "FILE",
                                      .purpose =
                                          "frequencies, damping ratios and shapes about an equilibrium",
                                      .help = "Prints JSON: coordinates, at, t, q, points, held, phi, "
                                              "residual, unstable, modes; a table goes to stderr.\n"
                                              "Held coordinates keep their value, constraint rows act; "
                                              "stabilisation does not enter. For a mode e^(lambda t):\n"
                                              "eigenvalue [re, im] [1/s], omega |lambda| [rad/s], frequency "
                                              "im/(2 pi) [Hz], damping -re/|lambda|, shape and\n"
                                              "displacements of the points, as re and im; the largest entry "
                                              "of a shape is 1. A decay without oscillation has\n"
                                              "frequency 0 and damping 1, a growth damping -1, a motion "
                                              "without restoring force omega 0 and damping 0.\n\n"
                                              "  refdyn modes models/pendulum.lua --modes 4\n"
                                              "  refdyn modes models/fourbar.lua --at state.json\n"};
