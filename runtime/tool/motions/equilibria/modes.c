/* `refdyn modes`: computes frequencies, damping ratios and shapes of small motions about a state at rest;
 * prints JSON and a table. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"

/* ---- The command ---- */

struct analysis {
    struct scene *scene;
    const char *at;
    int *held; /* (n) */
    int count; /* modes to print */
    struct record_small_motions motions;
};

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

static void stop(struct scene *scene, const char *path) {
    const int joints = refdyn_joint_count(scene->model);
    bool moves = false;
    for (int i = 0; i < joints; i++)
        moves |= scene->qd[i] != 0;
    if (moves && path)
        fprintf(stderr, "%s: warning: qd: modes are small motions about rest; all rates are set to 0\n",
                path);
    memset(scene->qd, 0, (size_t)joints * sizeof *scene->qd);
    refdyn_anchor(&scene->work, scene->state.t, scene->q, scene->qd, scene->given);
}

static void print_table(const struct analysis *analysis) {
    fputs("mode  frequency [Hz]  omega [rad/s]  damping ratio\n", stderr);
    for (int i = 0; i < analysis->count; i++) {
        const struct record_mode *mode = &analysis->motions.spectrum.modes[i];
        fprintf(stderr, "%4d  %14.6g  %13.6g  %13.6g%s\n", i + 1, record_frequency_of(mode),
                cabs(mode->eigenvalue), record_damping_of(mode),
                creal(mode->eigenvalue) > 0 ? "  unstable" : "");
    }
}

/* ---- JSON ---- */

static enum status print_analysis(const struct analysis *analysis) {
    struct scene *scene = analysis->scene;
    struct document document;
    scene_document_open(&document);
    const struct record_writer writer = scene_writer(&document);
    format_put_text(&document, "name", scene->model->name);
    scene_put_coordinates(&document, "coordinates", scene->model, NULL);
    format_put_text(&document, "at", analysis->at);
    scene_put_state(&document, scene);
    scene_put_positions(&document, scene);
    scene_put_coordinates(&document, "held", scene->model, analysis->held);
    record_put_small_motions(&analysis->motions, analysis->count, &writer);
    format_put_close(&document, '}');
    return scene_finish(scene, &document);
}

/* ---- The command ---- */

static int compute(struct analysis *analysis, const struct options *options) {
    const double modes = options_number(options, "modes");
    struct scene *scene = analysis->scene;
    analysis->motions = (struct record_small_motions){
        .work = &scene->work, .t = scene->state.t, .q = scene->q, .qd = scene->qd, .held = analysis->held};
    const int result = record_find_small_motions(&analysis->motions, &equilibria_algebra);
    analysis->count = analysis->motions.spectrum.count;
    if (modes > 0 && modes < analysis->count)
        analysis->count = (int)modes;
    return result;
}

static enum status analyse(struct scene *scene, const struct options *options) {
    const size_t n = (size_t)scene->model->n;
    struct analysis analysis = {.scene = scene, .at = equilibria_place(options)};
    analysis.held = format_allocate(n, sizeof *analysis.held);
    enum status status = check(scene);
    if (status == STATUS_DONE)
        status = equilibria_choose_state(scene, options, analysis.at, analysis.held);
    if (status == STATUS_DONE)
        stop(scene, options_state_path(analysis.at));
    int result = status == STATUS_DONE ? compute(&analysis, options) : REFDYN_OK;
    if (result != REFDYN_OK)
        status = scene_numbers_failed(scene, result, scene->state.t, scene->q, NULL);
    if (status == STATUS_DONE && result == REFDYN_OK)
        status = print_analysis(&analysis);
    if (status == STATUS_DONE) {
        record_print_small_motions(&analysis.motions, stderr);
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
                                      .options = "output at modes hold release way parameters set fold",
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
