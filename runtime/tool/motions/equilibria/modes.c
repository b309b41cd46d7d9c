/* `refdyn modes`: computes frequencies, damping ratios and shapes of small motions about a state at rest;
 * prints JSON and a table. */
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/equilibria/equilibria.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    const int off = scene_linear_out_of_balance(linear);
    scene_print_rows_left_out(analysis->scene->model, analysis->spectrum.redundant,
                              analysis->spectrum.redundant_count);
    if (off >= 0)
        fprintf(stderr, "refdyn: warning: this state is no equilibrium: %s is out of balance by %.4g\n",
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
    int result = scene_linearise(&analysis->linear, scene, analysis->held);
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
                                      .tables = {modes_rules, statics_rules, scene_rules},
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
