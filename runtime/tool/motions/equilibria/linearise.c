/* `refdyn linearise`: the linear model about a state, in independent coordinates under the rows; prints JSON.
 */
#include <math.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/options/options.h"

static enum status refuse_moved_row(struct scene *scene, const struct record_linear_model *linear) {
    const struct model *model = &scene->generation.model;
    return scene_refuse(
        scene, &model->rows[linear->moved_row],
        format_text("the input %s moves this row, so that its rates would be inputs, too; use a "
                    "parameter or a function of time",
                    model->inputs[linear->moving_input].name));
}

/* An input without effect usually acts on a held coordinate. */
static void warn_of_idle_inputs(const struct record_linear_model *linear, const struct refdyn_model *model) {
    for (int k = 0; k < model->input_count; k++) {
        double largest = 0;
        for (int i = 0; i < linear->size; i++)
            largest = fmax(largest, fabs(linear->B[i * model->input_count + k]));
        if (largest == 0)
            fprintf(
                stderr,
                "refdyn: warning: the input %s moves no state: it acts on held coordinates (--move-held lets "
                "them move), or on nothing\n",
                model->inputs[k].name);
    }
}

static enum status print_model(struct scene *scene, const struct record_linear_model *linear, const char *at,
                               const int *held) {
    struct document document;
    scene_document_open(&document);
    const struct record_writer writer = scene_writer(&document);
    format_put_text(&document, "name", scene->model->name);
    scene_put_coordinates(&document, "coordinates", scene->model, NULL);
    format_put_text(&document, "at", at);
    scene_put_coordinates(&document, "held", scene->model, held);
    record_put_linear_model(linear, &writer);
    format_put_close(&document, '}');
    return scene_finish(scene, &document);
}

static enum status find_and_print(struct scene *scene, const struct options *options) {
    const char *at = equilibria_place(options);
    int *held = format_allocate((size_t)scene->model->n, sizeof *held);
    if (!scene->model->tangent) {
        fprintf(stderr, "refdyn: %s: linearise needs the corrected form\n", scene->model->name);
        return STATUS_FAULT;
    }
    const enum status status = equilibria_choose_state(scene, options, at, held);
    if (status != STATUS_DONE)
        return status;
    refdyn_anchor(&scene->work, scene->state.t, scene->q, scene->qd, scene->given);
    struct record_linear_model linear = {
        .motions = {.work = &scene->work, .t = scene->state.t, .q = scene->q, .qd = scene->qd, .held = held},
        .moves_held = options_has(options, "move-held")};
    const int result = record_find_linear_model(&linear, &equilibria_algebra);
    if (result != REFDYN_OK)
        return scene_numbers_failed(scene, result, scene->state.t, scene->q, scene->qd);
    if (linear.moved_row >= 0)
        return refuse_moved_row(scene, &linear);
    warn_of_idle_inputs(&linear, scene->model);
    const struct record_kink kink = record_find_kink(&linear.motions, &equilibria_algebra);
    record_print_kink(&kink, scene->model, stderr);
    return print_model(scene, &linear, at, held);
}

static enum status run_linearise(const struct options *options) {
    return scene_run(options, NEEDS_RESULT | NEEDS_STATICS | NEEDS_TANGENT | NEEDS_LINEAR | NEEDS_OUTPUTS,
                     options_state_path(equilibria_place(options)), find_and_print);
}

static const struct option_rule linearise_rules[] = {
    {"at", "WHERE", OPTION_TEXT, "statics (default), initial, or a STATE.json", options_places, NULL},
    {"move-held", NULL, OPTION_FLAG,
     "held coordinates may move, while the forces that hold them stay as they are", NULL, NULL},
    {.name = NULL}};

const struct command linearise_command = {
    .name = "linearise",
    .run = run_linearise,
    .operands = "MODEL.lua",
    .options = "output at move-held hold release way parameters set fold",
    .tables = {linearise_rules, equilibria_rules, scene_rules},
    .output = "FILE",
    .purpose = "linear state-space model about a state",
    .help = "Prints JSON: states (independent coordinates, independent rates, continuous states), inputs, "
            "outputs\n"
            "(points with rates and accelerations, courses), A, B, C, D, rate, q, qd, t, eigenvalues [re, "
            "im]. For small changes s of "
            "the "
            "states, x of the\n"
            "inputs and y of the outputs: s' = A s + B x + rate, y = C s + D x. rate is 0 at an equilibrium. "
            "Held "
            "coordinates keep\n"
            "their value, constraint rows act without stabilisation.\n\n"
            "  refdyn linearise models/crane.lua\n"
            "  refdyn linearise models/manipulator.lua --set drive=input --move-held -o linear.json\n"};
