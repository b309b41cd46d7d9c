/* `refdyn statics`: computes the equilibrium of a model under its loads and prints it as JSON. */
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/equilibria/equilibria.h"

#include <string.h>

/* Prints explanations of the result that are no warnings. */
static void print_notes(const struct scene *scene, const struct equilibrium *equilibrium) {
    const struct refdyn_statics_result *result = &equilibrium->result;
    if (result->limit_points)
        fprintf(stderr, "refdyn: %d limit point%s of the load passed\n", result->limit_points,
                result->limit_points > 1 ? "s" : "");
    if (!result->unstable)
        equilibria_print_criterion(result);
    if (result->is_indeterminate)
        fputs("refdyn: the forces of the contacts are not unique; the smallest ones are printed\n", stderr);
    equilibria_print_rows_without_part(scene, &equilibrium->options);
}

/* Writes gaps and forces of the contacts, which begin at row `from` of the options. */
static void put_contacts(struct document *document, const struct scene *scene,
                         const struct equilibrium *equilibrium, int from) {
    const struct refdyn_statics_options *options = &equilibrium->options;
    const struct refdyn_statics_result *result = &equilibrium->result;
    const int first = refdyn_programme_rows(scene->model);
    format_put_open(document, "contacts", '[');
    for (int i = from; i < options->row_count; i++) {
        format_put_open(document, NULL, '{');
        format_put_text(document, "name", scene->model->rows[options->rows[i]].name);
        format_put_number(document, "gap", result->contact_gap[options->rows[i] - first]);
        format_put_number(document, "force", result->lambda[i]);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_rows(struct document *document, const struct scene *scene,
                     const struct equilibrium *equilibrium) {
    const struct refdyn_statics_options *options = &equilibrium->options;
    const int first = refdyn_programme_rows(scene->model);
    int count = 0;
    format_put_open(document, "rows", '[');
    for (; count < options->row_count && options->rows[count] < first; count++)
        format_put_text(document, NULL, scene->model->rows[options->rows[count]].name);
    format_put_close(document, ']');
    format_put_array(document, "lambda", equilibrium->result.lambda, count);
    format_put_number(document, "phi", equilibrium->result.phi);
    if (scene->model->m > first)
        put_contacts(document, scene, equilibrium, count);
}

static void put_stability(struct document *document, const struct refdyn_statics_result *result) {
    format_put_text(document, "stability", equilibria_stability_text(result));
    format_put_whole(document, "unstable", result->unstable);
    format_put_whole(document, "neutral", result->neutral);
    format_put_truth(document, "potential", result->has_potential);
    format_put_text(document, "criterion", equilibria_criterion_words[result->criterion]);
}

static void put_equilibrium(struct document *document, const struct scene *scene,
                            const struct equilibrium *equilibrium) {
    const struct refdyn_model *model = scene->model;
    scene_put_coordinates(document, "coordinates", model, NULL);
    scene_put_state(document, scene);
    scene_put_positions(document, scene);
    format_put_open(document, "hold_force", '[');
    for (int i = 0; i < model->n; i++)
        if (equilibrium->held[i])
            format_put_number(document, NULL, equilibrium->hold_force[i]);
    format_put_close(document, ']');
    format_put_number(document, "residual", equilibrium->result.residual);
    put_rows(document, scene, equilibrium);
    put_stability(document, &equilibrium->result);
}

static void warn_of_rates(const struct scene *scene, const char *path) {
    for (int i = 0; scene->state.qd && i < scene->model->n; i++) {
        if (scene->state.qd[i] == 0)
            continue;
        fprintf(stderr, "%s: warning: qd: statics sets all rates to 0\n", path);
        return;
    }
}

static enum status find_and_print(struct scene *scene, const struct options *options) {
    struct equilibrium equilibrium;
    warn_of_rates(scene, options_text(options, "state"));
    const enum status status = equilibria_find(scene, options, &equilibrium);
    if (status != STATUS_DONE)
        return status;
    struct document document;
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    put_equilibrium(&document, scene, &equilibrium);
    format_put_close(&document, '}');
    print_notes(scene, &equilibrium);
    return scene_finish(scene, &document);
}

static enum status run_statics(const struct options *options) {
    return scene_run(options, NEEDS_RESULT | NEEDS_STATICS | NEEDS_POINTS, options_text(options, "state"),
                     find_and_print);
}

const struct command statics_command = {
    .name = "statics",
    .run = run_statics,
    .operands = "MODEL.lua",
    .options = "output state hold release way set fold",
    .tables = {statics_rules, scene_rules},
    .output = "FILE",
    .purpose = "equilibrium",
    .help = "Prints JSON: coordinates, q, points, hold_force of the held coordinates, residual, rows that "
            "hold, their\n"
            "multipliers, phi, stability. Rows of positions hold at t = 0, except rows of a programme that "
            "begins at the start\n"
            "of the motion. Such a row holds, too, if --set gives each value that it reads from there.\n\n"
            "  refdyn statics models/manipulator.lua\n"
            "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi,effector_z\n"
            "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi --set xc=0.54\n"
            "  refdyn statics models/slidercrank.lua --release 'guide y'\n"};
