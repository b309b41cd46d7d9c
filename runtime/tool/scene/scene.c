/*
 * Makes one model ready to compute with: reads it, emits and compiles the quantities that a command needs,
 * and sets parameters and inputs.
 *
 * Values of parameters do not change the emitted C, except with --fold. Parameters of --set and of a
 * STATE.json are set at run time, so that another value compiles nothing.
 */
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "gen/language/values.h"

#include <stdlib.h>
#include <string.h>

/* Prints the messages of the generator that were not printed yet. */
static void print_messages(struct scene *scene) {
    for (; scene->told < scene->generation.messages.count; scene->told++) {
        const struct message *message = &scene->generation.messages.list[scene->told];
        fputs(message->place.file, stderr);
        if (message->place.line > 0)
            fprintf(stderr, ":%d", message->place.line);
        fprintf(stderr, ": %s\n", message->text);
    }
}

enum status scene_outcome(struct scene *scene, const struct options *options, enum gen_status status) {
    print_messages(scene);
    if (status == GEN_NO_MEMORY)
        format_complain("refdyn: %s: out of memory\n", *options->operands);
    return status == GEN_OK ? STATUS_DONE : STATUS_FAULT;
}

static const char *const acceleration_words[] = {[ACCELERATIONS_AUTO] = "auto",
                                                 [ACCELERATIONS_RECURSIVE] = "recursive",
                                                 [ACCELERATIONS_DENSE] = "dense",
                                                 NULL};
static const char *const loop_words[] = {
    [LOOPS_AUTO] = "auto", [LOOPS_ALWAYS] = "always", [LOOPS_NEVER] = "never", NULL};

static const char *list_quantities(const struct command *command) {
    struct text text = {.memory = &format_memory};
    (void)command;
    text_add(&text, "all implicit step step.p");
    for (int i = 0; gen_quantity(i); i++)
        text_add(&text, " %s", gen_quantity(i));
    return text.data;
}

const struct option_rule scene_rules[] = {
    {"emit", "M,h,...", OPTION_LIST,
     "only these quantities; all: all but derivatives; implicit: the tangent of implicit steps; "
     "step: fixed steps with derivatives; step.p: also by the parameters",
     NULL, list_quantities},
    {"for-lanes", NULL, OPTION_FLAG,
     "also functions for 2, 4 or 8 motions side by side; gen writes them to NAME_lanes.c", NULL, NULL},
    {"state", "STATE.json", OPTION_TEXT, "t, q, qd, inputs, parameters; missing ones have the model's values",
     NULL, NULL},
    {"inputs", "FILE.csv", OPTION_TEXT, "samples of inputs over t, each held until the next", NULL, NULL},
    {"summary", "FILE.json", OPTION_TEXT, "the summary as JSON", NULL, NULL},
    {"lanes", "N", OPTION_COUNT,
     "compute steps of 1, 2, 4 or 8 cases side by side (default: chosen from vectors, model and "
     "number of cases)",
     NULL, NULL},
    {"set", "NAME=VALUE", OPTION_SETTING, "set an option, a parameter or an input of the model (repeatable)",
     NULL, NULL},
    {"loops", "WHEN", OPTION_TEXT,
     "auto (default), always or never: loops over equal elements instead of code for each", loop_words, NULL},
    {"accelerations", "HOW", OPTION_TEXT, "auto (default), recursive or dense: how the C solves M qdd = f",
     acceleration_words, NULL},
    {"parameters", "FIT.json", OPTION_TEXT, "the values that `fit` has found; --set takes precedence", NULL,
     NULL},
    {"watch", NULL, OPTION_FLAG,
     "repeat whenever a file that the command reads is saved: the model, what it requires, a RUN, inputs, a "
     "state",
     NULL, NULL},
    {"fold", NULL, OPTION_FLAG, "turn parameters into numbers in the C", NULL, NULL},
    {.name = NULL}};

static bool read_variant(const struct options *options, struct read_request *request) {
    int place = 0, loop = 0;
    const bool is_known = options_choose(options, "accelerations", &place) == STATUS_DONE &&
                          options_choose(options, "loops", &loop) == STATUS_DONE;
    request->accelerations = (enum accelerations)place;
    request->loops = (enum loops)loop;
    return is_known;
}

/* Prints the messages of a model that cannot be read; other messages only if they are requested. */
static enum status read_with(struct scene *scene, const struct options *options,
                             const struct setting *settings, int count, bool fold, bool is_telling) {
    struct read_request request = {.file = *options->operands,
                                   .settings = settings,
                                   .setting_count = count,
                                   .fold = fold,
                                   .has_pulls = options_has(options, "pull"),
                                   .programme = options_text(options, "play")     ? PROGRAMME_FREE
                                                : options_has(options, "realise") ? PROGRAMME_RESTS
                                                                                  : PROGRAMME_ACTS,
                                   .name = options_text(options, "name")};
    if (!read_variant(options, &request))
        return STATUS_USAGE;
    if (scene->is_read)
        gen_release(&scene->generation);
    scene->is_read = true;
    const enum gen_status status = gen_read(&scene->generation, &request, -1);
    scene->told = is_telling || status != GEN_OK ? 0 : scene->generation.messages.count;
    return scene_outcome(scene, options, status);
}

enum status scene_read(struct scene *scene, const struct options *options, bool is_telling) {
    *scene = (struct scene){.compiled = compile_nothing};
    return read_with(scene, options, options->settings, options->setting_count, options_has(options, "fold"),
                     is_telling);
}

static void add_inputs(struct values *values, const struct model *model) {
    values->inputs = format_allocate((size_t)model->input_count, sizeof *values->inputs);
    for (int i = 0; i < model->input_count; i++)
        if (model->inputs[i].is_given)
            values->inputs[values->input_count++] =
                (struct named_value){format_text("%s", model->inputs[i].name), model->inputs[i].value};
}

static struct values given_values(struct scene *scene) {
    const struct model *model = &scene->generation.model;
    const struct state *state = &scene->state;
    const size_t most = (size_t)(state->parameter_count + model->parameter_count);
    struct values values = {.list = format_allocate(most, sizeof *values.list)};
    for (int i = 0; i < state->parameter_count; i++)
        values.list[values.count++] = state->parameters[i];
    for (int i = 0; i < model->parameter_count; i++)
        if (model->parameters[i].is_given) /* the name must outlive the model, which is read again */
            values.list[values.count++] = (struct named_value){format_text("%s", model->parameters[i].name),
                                                               model->parameters[i].value};
    add_inputs(&values, model);
    return values;
}

static bool is_among(const struct named_value *list, int count, const char *name) {
    for (int i = 0; i < count; i++)
        if (strcmp(list[i].name, name) == 0)
            return true;
    return false;
}

static bool is_given(const struct values *values, const char *name) {
    return is_among(values->list, values->count, name);
}

/* Turns all values into settings, so that the checks of the model see them; with --fold they become numbers
 * in the C. */
static enum status read_valued(struct scene *scene, const struct options *options,
                               const struct values *values) {
    int count = options->setting_count;
    const size_t most = (size_t)(count + values->count);
    struct setting *settings = memory_grow(&format_memory, options->settings,
                                           (size_t)count * sizeof *settings, most * sizeof *settings);
    for (int i = 0; i < values->count; i++)
        settings[count++] =
            (struct setting){.name = values->list[i].name,
                             .value = exact_text(values->list[i].value, format_allocate(NUMBER_LENGTH, 1))};
    return read_with(scene, options, settings, count, options_has(options, "fold"), false);
}

/* Without --fold the C has the default parameters and inputs, so that its text and its library are the same
 * for all values. */
static enum status read_structure(struct scene *scene, const struct options *options,
                                  const struct values *values) {
    struct setting *settings = format_allocate((size_t)options->setting_count, sizeof *settings);
    int count = 0;
    for (int i = 0; i < options->setting_count; i++)
        if (!is_given(values, options->settings[i].name) &&
            !is_among(values->inputs, values->input_count, options->settings[i].name))
            settings[count++] = options->settings[i];
    return read_with(scene, options, settings, count, false, false);
}

/* Checks the model with all given values, then prepares the text of the C. */
static enum status read_for_values(struct scene *scene, const struct options *options,
                                   const struct values *values) {
    enum status status = STATUS_DONE;
    if (scene->state.parameter_count > 0)
        status = read_valued(scene, options, values);
    if (status != STATUS_DONE || options_has(options, "fold") || values->count + values->input_count == 0)
        return status;
    return read_structure(scene, options, values);
}

/* Returns whether a row may hold in statics. A row that begins with the motion may do so if all values that
 * it reads from the start are given. */
static bool may_hold(const struct row *row, unsigned needs, const struct values *values) {
    bool is_known = true;
    for (int i = 0; i < row->start_count; i++)
        is_known = is_known && is_given(values, row->starts[i]);
    return row->level == ROW_POSITION && (is_known || needs & NEEDS_EACH_START);
}

/* Returns whether forces may have no potential or add energy, so that small motions must decide the stability
 * of an equilibrium. Springs have a potential, and dampers are never negative. */
static bool may_lack_potential(const struct model *model) {
    for (int i = 0; i < model->force_count; i++)
        if (model->graph->nodes[model->forces[i].value].depends & (ON_STATE | ON_RATE))
            return true;
    return model->load_count > 0 || model->state_count > 0;
}

/* Statics needs a tangent, of either form, for rows and where the potential alone does not decide stability.
 */
static bool needs_statics_tangent(const struct model *model, unsigned needs, const struct values *values) {
    if (!(needs & NEEDS_STATICS))
        return false;
    for (int i = 0; i < model->row_count; i++)
        if (may_hold(&model->rows[i], needs, values))
            return true;
    return may_lack_potential(model);
}

static bool has_angular_points(const struct model *model) {
    for (int i = 0; i < model->point_count; i++)
        if (model->points[i].is_angular)
            return true;
    return false;
}

/* The list of quantities for gen_plan, limited to those that the scene has. */
static char *emit_list(struct scene *scene, const struct options *options, unsigned needs,
                       const struct values *values) {
    const char *emit = options_text(options, "emit");
    const struct model *model = &scene->generation.model;
    if (needs & NEEDS_ALL)
        return format_text("%s%s%s", emit ? "start,equations," : "all",
                           emit && model->row_count > 0 ? "row_sizes," : "", emit ? emit : "");
    bool rows = model->row_count > 0, points = model->point_count > 0;
    const bool limits = needs & NEEDS_STATICS && !(needs & NEEDS_MOTION) && model->bound_count > 0;
    if (needs_statics_tangent(model, needs, values))
        needs |= NEEDS_TANGENT;
    return format_text(
        "%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s",
        needs & NEEDS_STATE ? "start,M,h,Q,qdd_free" : "start,equations", rows ? ",row_sizes" : "",
        needs & NEEDS_STATE && rows ? ",u,v,phi,psi,k,constrained" : "",
        scene->state.qdd && !model->printed_form ? ",inverse" : "", needs & NEEDS_STATICS ? ",Q,Q_q" : "",
        needs & (NEEDS_STATE | NEEDS_MOTION) ? ",energy,power,course"
        : limits                             ? ",course"
                                             : "",
        !(needs & NEEDS_MOTION) ? ""
        : rows                  ? ",constrained"
                                : ",qdd_free",
        !(needs & NEEDS_TANGENT) ? ""
        : needs & NEEDS_LINEAR   ? ",tangent"
                                 : ",implicit",
        needs & NEEDS_POINTS && points ? ",r" : "", needs & NEEDS_POINT_RATES && points ? ",rd,C,d" : "",
        needs & NEEDS_LINEAR && rows ? ",d_rows.q,d_rows.qd,d_rows.x" : "",
        needs & NEEDS_LINEAR && points ? ",C" : "",
        needs & NEEDS_POINT_RATES && has_angular_points(model) ? ",J,Jd_qd" : "",
        needs & NEEDS_OUTPUTS && points ? ",d_points.q,d_points.qd" : "",
        needs & NEEDS_OUTPUTS && model->course_count ? ",d_course.q,d_course.qd,d_course.x" : "",
        needs & (NEEDS_OUTPUTS | NEEDS_DRIVES) && model->input_count ? ",tangent_x" : "",
        needs & NEEDS_DRIVES ? ",tangent" : "");
}

/* Named events end steps within lanes, which do not check for them. Models with such events compute single
 * motions. */
static int lanes_for(const struct model *model, const struct options *options) {
    const double lanes = options_number(options, "lanes");
    return lanes > 1 && model->event_count == 0 ? (int)lanes : 0;
}

static enum status emit_and_load(struct scene *scene, const struct options *options, unsigned needs,
                                 const struct values *values) {
    const char *emit = options_text(options, "emit");
    struct generation *generation = &scene->generation;
    const char *wrong = emit ? gen_wrong_emit(generation, emit) : NULL;
    if (wrong)
        return options_usage_error(options->command, "--emit: %s", wrong);
    const int lanes = lanes_for(&generation->model, options);
    generation->has_lanes = lanes > 0;
    const enum status status =
        scene_outcome(scene, options, gen_plan(generation, emit_list(scene, options, needs, values)));
    if (status != STATUS_DONE)
        return status;
    const struct emitted emitted = {.name = generation->model.name,
                                    .files = gen_files(generation),
                                    .count = gen_file_count(generation),
                                    .lanes = lanes};
    const enum compile_tier tier = needs & NEEDS_OPTIMISED ? COMPILE_OPTIMISED
                                   : needs & NEEDS_ONCE    ? COMPILE_ONCE
                                                           : COMPILE_FIRST;
    if (!compile_load(&scene->compiled, &emitted, tier))
        return STATUS_FAULT;
    scene->model = scene->compiled.model;
    return STATUS_DONE;
}

static enum status start_workspace(struct scene *scene) {
    size_t size = refdyn_workspace_size(scene->model), n = (size_t)scene->model->n;
    scene->q = format_allocate(n, sizeof *scene->q);
    scene->qd = format_allocate(n, sizeof *scene->qd);
    scene->given = format_allocate((size_t)scene->model->anchored_count, sizeof *scene->given);
    int status = refdyn_workspace_init(&scene->work, scene->model, format_allocate(1, size), size);
    if (status == REFDYN_OK)
        return STATUS_DONE;
    fprintf(stderr, "refdyn: %s: %s\n", scene->model->name, refdyn_status_text(status));
    return STATUS_FAULT;
}

static void apply_inputs(struct scene *scene, const struct named_value *inputs, int count) {
    const struct refdyn_model *model = scene->model;
    for (int i = 0; i < count; i++) {
        const int place = refdyn_find_name(model->inputs, model->input_count, inputs[i].name);
        if (place >= 0)
            scene->work.x[place] = inputs[i].value;
    }
}

/* Skips names that the C does not have: this scene does not read these parameters and inputs. */
static void apply_values(struct scene *scene, const struct values *values) {
    const struct refdyn_model *model = scene->model;
    for (int i = 0; i < values->count; i++) {
        int place = refdyn_find_name(model->parameters, model->parameter_count, values->list[i].name);
        if (place < 0)
            continue;
        scene->work.p[place] = values->list[i].value;
        const int anchored = refdyn_find_anchored(model, place);
        if (anchored >= 0)
            scene->given[anchored] = 1;
    }
    apply_inputs(scene, values->inputs, values->input_count);
    apply_inputs(scene, scene->state.inputs, scene->state.input_count);
}

/* Warns of parameters of --set that nothing reads. With --fold all are numbers in the C; with --play those of
 * the programme have no effect. */
static void warn_of_unread(const struct scene *scene, const struct options *options,
                           const struct values *values) {
    const struct refdyn_model *model = scene->model;
    const bool is_expected = options_has(options, "fold") || options_has(options, "play");
    for (int i = 0; i < options->setting_count && !is_expected; i++) {
        const char *name = options->settings[i].name;
        if (is_given(values, name) && refdyn_find_name(model->parameters, model->parameter_count, name) < 0)
            format_complain("refdyn: warning: --set %s: nothing that this command computes reads it\n", name);
    }
}

/* Start values of --parameters, which other motions from this start have, too. */
static void set_found_start(struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    struct state *state = &scene->state;
    bool is_set = false;
    for (int i = 0; i < state->found_count; i++) {
        const char *name = state->found[i].name;
        const size_t length = strlen(name);
        const int joints = refdyn_joint_count(model),
                  found = refdyn_find_name(model->coordinates, model->n, name),
                  place = found < joints ? found : -1,
                  rate = found >= joints ? found
                         : length > 2 && strcmp(name + length - 2, "_d") == 0
                             ? refdyn_find_name(model->coordinates, joints,
                                                format_text("%.*s", (int)length - 2, name))
                             : -1;
        if (place >= 0)
            scene->q[place] = state->found[i].value;
        if (rate >= 0)
            scene->qd[rate] = state->found[i].value;
        is_set = is_set || place >= 0 || rate >= 0;
    }
    state->q = is_set ? scene->q : state->q;
    state->qd = is_set ? scene->qd : state->qd;
}

/* What a STATE.json leaves out keeps the value of the model. Other motions from this start have the same. */
static void set_given_state(struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    struct state *state = &scene->state;
    const size_t size = (size_t)model->n * sizeof(double);
    const int joints = refdyn_joint_count(model);
    if (state->q)
        memcpy(scene->q, state->q, size);
    if (state->qd)
        memcpy(scene->qd, state->qd, (size_t)joints * sizeof(double));
    for (int i = 0; i < state->state_count; i++) {
        const int place = refdyn_find_name(model->coordinates, model->n, state->states[i].name);
        if (place >= 0)
            scene->qd[place] = state->states[i].value;
    }
    if (!state->qd && state->state_count == 0)
        return;
    state->qd = format_allocate((size_t)model->n, sizeof *state->qd);
    memcpy(state->qd, scene->qd, size);
}

static void set_state(struct scene *scene) {
    refdyn_prepare(&scene->work);
    refdyn_initial_state(&scene->work, scene->q, scene->qd);
    refdyn_anchor(&scene->work, 0, scene->q, scene->qd, scene->given);
    set_given_state(scene);
    set_found_start(scene);
}

const char *scene_refused_fact(const struct scene *scene, const struct refdyn_workspace *work,
                               char text[static REFUSED_LENGTH]) {
    const struct place place = gen_requirement_place(&scene->generation, work->refused);
    const struct refdyn_requirement *requirement = &work->model->requirements[work->refused];
    double x[REFDYN_REQUIREMENT_NUMBERS];
    refdyn_refused_numbers(work, x);
    const int length =
        snprintf(text, REFUSED_LENGTH, "%s:%d: %s: ", place.file, place.line, requirement->subject);
    if (length > 0 && length < REFUSED_LENGTH)
        snprintf(text + length, (size_t)(REFUSED_LENGTH - length), requirement->fact, x[0], x[1], x[2], x[3],
                 x[4], x[5]);
    return text;
}

static enum status complain_of_values(const struct scene *scene) {
    char text[REFUSED_LENGTH];
    fprintf(stderr, "%s\n", scene_refused_fact(scene, &scene->work, text));
    return STATUS_FAULT;
}

static enum status make_ready(struct scene *scene, const struct options *options, unsigned needs,
                              const struct values *values) {
    enum status status = read_for_values(scene, options, values);
    if (status == STATUS_DONE)
        status = emit_and_load(scene, options, needs, values);
    if (status == STATUS_DONE)
        status = start_workspace(scene);
    if (status != STATUS_DONE)
        return status;
    apply_values(scene, values);
    if (refdyn_check_parameters(&scene->work) == REFDYN_REFUSED)
        return complain_of_values(scene);
    warn_of_unread(scene, options, values);
    set_state(scene);
    return STATUS_DONE;
}

enum status scene_set_values(struct scene *scene, struct named_value *values, int count) {
    const struct values given = {.list = values, .count = count};
    apply_values(scene, &given);
    apply_inputs(scene, values, count);
    if (refdyn_check_parameters(&scene->work) == REFDYN_REFUSED)
        return complain_of_values(scene);
    scene->state.found = values;
    scene->state.found_count = count;
    set_state(scene);
    return STATUS_DONE;
}

enum status scene_refuse(struct scene *scene, const struct row *row, const char *fact) {
    message_error(&scene->generation.messages, row->place, "%s: %s", row->name, fact);
    print_messages(scene);
    return STATUS_FAULT;
}

enum status scene_refuse_row(struct scene *scene, bool (*wrong)(const struct row *row), const char *fact) {
    const struct model *model = &scene->generation.model;
    for (int i = 0; i < model->row_count; i++)
        if (wrong(&model->rows[i]))
            return scene_refuse(scene, &model->rows[i], fact);
    return STATUS_DONE;
}

void scene_spare_sources(const struct scene *scene, struct targets *targets) {
    const struct sources *sources = scene->generation.model.sources;
    for (int i = 0; i < sources->count; i++)
        system_targets_spare(targets, sources->list[i].path);
}

/* Opens the files of -o and --summary, which must differ from all files that the command reads. */
static enum status open_targets(struct scene *scene, const struct options *options, const char *state_path) {
    const char *inputs = options_text(options, "inputs"), *summary = options_text(options, "summary");
    struct targets *targets = &scene->targets;
    scene_spare_sources(scene, targets);
    if (state_path)
        system_targets_spare(targets, state_path);
    if (inputs)
        system_targets_spare(targets, inputs);
    for (int i = 0; i < options->operand_count; i++)
        system_targets_spare(targets, options->operands[i]);
    static const char *const read[] = {"play", "parameters"};
    for (int i = 0; i < 2; i++)
        if (options_text(options, read[i]))
            system_targets_spare(targets, options_text(options, read[i]));
    scene->result = system_target_open(targets, options_text(options, "output"));
    if (scene->result && summary)
        scene->summary = system_target_open(targets, summary);
    return scene->result && (scene->summary || !summary) ? STATUS_DONE : STATUS_FAULT;
}

void scene_document_open(struct document *document) {
    format_document_open(document);
    format_put_open(document, NULL, '{');
    format_put_text(document, "refdyn", REFDYN_VERSION);
}

enum status scene_finish(struct scene *scene, struct document *document) {
    if (!format_document_close(document, scene->result->file))
        return scene_numbers_failed(scene, REFDYN_NOT_FINITE, scene->state.t, scene->q, scene->qd);
    return system_target_finish(scene->result) ? STATUS_DONE : STATUS_FAULT;
}

/* Sorts the values of --parameters: parameters and inputs join those of the state, unless --set has them. */
static bool take_found(struct scene *scene, const char *path) {
    struct state *state = &scene->state;
    const struct model *model = &scene->generation.model;
    if (!scene_found_read(state, path, &scene->generation))
        return false;
    const size_t count = (size_t)state->found_count, size = sizeof *state->inputs;
    state->parameters = memory_grow(&format_memory, state->parameters, (size_t)state->parameter_count * size,
                                    ((size_t)state->parameter_count + count) * size);
    state->inputs = memory_grow(&format_memory, state->inputs, (size_t)state->input_count * size,
                                ((size_t)state->input_count + count) * size);
    for (int i = 0; i < state->found_count; i++) {
        for (int k = 0; k < model->parameter_count; k++)
            if (strcmp(model->parameters[k].name, state->found[i].name) == 0)
                state->parameters[state->parameter_count++] = state->found[i];
        for (int k = 0; k < model->input_count; k++)
            if (strcmp(model->inputs[k].name, state->found[i].name) == 0 && !model->inputs[k].is_given)
                state->inputs[state->input_count++] = state->found[i];
    }
    return true;
}

enum status scene_open(struct scene *scene, const struct options *options, unsigned needs,
                       const char *state_path) {
    enum status status = scene_read(scene, options, !(needs & NEEDS_NO_WARNINGS));
    if (status == STATUS_DONE && needs & NEEDS_RESULT)
        status = open_targets(scene, options, state_path);
    if (status != STATUS_DONE || !needs)
        return status;
    if (state_path && !scene_state_read(&scene->state, state_path, &scene->generation, needs & NEEDS_STATE))
        return STATUS_FAULT;
    const char *found = options_text(options, "parameters");
    if (found && !take_found(scene, found))
        return STATUS_FAULT;
    scene->values = given_values(scene);
    return make_ready(scene, options, needs, &scene->values);
}

void scene_close(struct scene *scene) {
    compile_release(&scene->compiled);
    system_targets_release(&scene->targets);
    if (scene->is_read)
        gen_release(&scene->generation);
}

enum status scene_run(const struct options *options, unsigned needs, const char *state_path,
                      enum status (*work)(struct scene *scene, const struct options *options)) {
    struct scene scene;
    enum status status = scene_open(&scene, options, needs, state_path);
    if (status == STATUS_DONE)
        status = work(&scene, options);
    scene_close(&scene);
    return status;
}

enum status scene_numbers_failed(const struct scene *scene, int result, double t, const double *q,
                                 const double *qd) {
    record_print_failed(&scene->work, result, t, q, qd, stderr);
    record_print_value_advice(result, stderr);
    return STATUS_NUMBERS;
}
