/*
 * `refdyn compile`: compiles the functions of a model for other programs, which load the library
 * themselves.
 *
 * Leaves a library in the cache, and prints as JSON its path and the arguments and results of its
 * functions, so that a caller needs no header of the model.
 */
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "refdyn_batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put_name(struct document *document, const struct refdyn_name *name) {
    format_put_text(document, "name", name->name);
    format_put_text(document, "unit", name->unit);
}

static void put_start(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    format_put_open(document, "coordinates", '[');
    for (int i = 0; i < model->n; i++) {
        format_put_open(document, NULL, '{');
        put_name(document, &model->coordinates[i]);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
    format_put_open(document, "states", '[');
    for (int i = refdyn_joint_count(model); i < model->n; i++)
        format_put_text(document, NULL, model->coordinates[i].name);
    format_put_close(document, ']');
    format_put_array(document, "q", scene->q, model->n);
    format_put_array(document, "qd", scene->qd, model->n);
}

static void put_parameters(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    format_put_open(document, "parameters", '[');
    for (int i = 0; i < model->parameter_count; i++) {
        const int anchored = refdyn_find_anchored(model, i);
        format_put_open(document, NULL, '{');
        put_name(document, &model->parameters[i]);
        format_put_number(document, "value", scene->work.p[i]);
        format_put_truth(document, "anchored", anchored >= 0 && !scene->given[anchored]);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_limit(struct document *document, const char *key, double value) {
    if (isfinite(value))
        format_put_number(document, key, value);
}

/* An object for each coordinate, with its limits. */
static void put_limits(struct document *document, const struct scene *scene) {
    const struct tree *tree = &scene->generation.tree;
    format_put_open(document, "limits", '[');
    for (int i = 0; i < tree->count; i++) {
        const struct limits *limits = tree->frames[i].joint.limits;
        format_put_open(document, NULL, '{');
        if (limits) {
            put_limit(document, "from", limits->from);
            put_limit(document, "to", limits->to);
            put_limit(document, "rate", limits->rate);
            put_limit(document, "force", limits->force);
        }
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_inputs(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    format_put_open(document, "inputs", '[');
    for (int i = 0; i < model->input_count; i++) {
        format_put_open(document, NULL, '{');
        put_name(document, &model->inputs[i]);
        format_put_number(document, "value", scene->work.x[i]);
        format_put_truth(document, "by_events", scene_inputs_are_set_by_event(model, i));
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_texts(struct document *document, const char *key, const char *const *texts, int count) {
    format_put_open(document, key, '[');
    for (int i = 0; i < count; i++)
        format_put_text(document, NULL, texts[i]);
    format_put_close(document, ']');
}

/* Parameters of the model that no function reads; a caller may still give them. */
static void put_unread(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    const struct model *read = &scene->generation.model;
    format_put_open(document, "unread", '[');
    for (int i = 0; i < read->parameter_count; i++)
        if (refdyn_find_name(model->parameters, model->parameter_count, read->parameters[i].name) < 0)
            format_put_text(document, NULL, read->parameters[i].name);
    format_put_close(document, ']');
}

/* Numbers and truth values become JSON values. */
static void put_option(struct document *document, const struct model_option *option) {
    const bool is_true = strcmp(option->value, "true") == 0;
    if (option->is_text)
        format_put_text(document, option->name, option->value);
    else if (is_true || strcmp(option->value, "false") == 0)
        format_put_truth(document, option->name, is_true);
    else
        format_put_number(document, option->name, strtod(option->value, NULL));
}

static void put_names(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    const struct model *read = &scene->generation.model;
    format_put_open(document, "options", '{');
    for (int i = 0; i < read->option_count; i++)
        put_option(document, &read->options[i]);
    format_put_close(document, '}');
    put_start(document, scene);
    put_limits(document, scene);
    put_parameters(document, scene);
    put_unread(document, scene);
    put_inputs(document, scene);
    format_put_open(document, "rows", '[');
    for (int i = 0; i < model->m; i++)
        format_put_text(document, NULL, model->rows[i].name);
    format_put_close(document, ']');
    put_texts(document, "points", model->points, model->point_count);
    put_texts(document, "courses", model->courses, model->course_count);
    format_put_open(document, "held", '[');
    for (int i = 0; i < model->held_count; i++)
        format_put_text(document, NULL, model->coordinates[model->held[i]].name);
    format_put_close(document, ']');
}

static void put_part(struct document *document, const struct result_part *part) {
    format_put_open(document, NULL, '{');
    format_put_text(document, "name", part->name);
    format_put_text(document, "about", part->about);
    format_put_whole(document, "count", part->count);
    format_put_whole(document, "columns", part->columns);
    format_put_close(document, '}');
}

/* Rules that the model has for parameters, with the lines of its file. */
static void put_requirements(struct document *document, const struct scene *scene) {
    format_put_open(document, "requirements", '[');
    for (int i = 0; i < scene->model->requirement_count; i++) {
        const struct place place = gen_requirement_place(&scene->generation, i);
        format_put_text(document, NULL, format_text("%s:%d", place.file, place.line));
    }
    format_put_close(document, ']');
}

/* For each row, the parameters that it reads from the start of a motion. */
static void put_row_starts(struct document *document, const struct scene *scene) {
    const struct model *read = &scene->generation.model;
    format_put_open(document, "row_starts", '[');
    for (int i = 0; i < scene->model->m; i++)
        put_texts(document, NULL, read->rows[i].starts, read->rows[i].start_count);
    format_put_close(document, ']');
}

/* Names, columns and bounds of the limits that motions are compared with. */
static void put_bounds(struct document *document, const struct model *model) {
    format_put_open(document, "bounds", '[');
    for (int i = 0; i < model->bound_count; i++) {
        const struct bound *bound = &model->bounds[i];
        format_put_open(document, NULL, '{');
        format_put_text(document, "name", bound->name);
        format_put_text(document, "column", bound->column);
        put_limit(document, "from", bound->from);
        put_limit(document, "to", bound->to);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_functions(struct document *document, const struct generation *generation) {
    struct emitted_function function;
    format_put_open(document, "functions", '[');
    for (int i = 0; gen_function(generation, i, &function); i++) {
        format_put_open(document, NULL, '{');
        format_put_text(document, "quantity", function.quantity);
        format_put_text(document, "about", function.about);
        format_put_whole(document, "given", function.given_count);
        format_put_truth(document, "is_struct", function.is_struct);
        format_put_truth(document, "reads_inputs", function.reads_inputs);
        format_put_open(document, "parts", '[');
        for (int k = 0; k < function.part_count; k++) {
            const struct result_part part = gen_result_part(generation, i, k);
            put_part(document, &part);
        }
        format_put_close(document, ']');
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
    format_put_open(document, "quantities", '[');
    for (int i = 0; gen_quantity(i); i++)
        format_put_text(document, NULL, gen_quantity(i));
    format_put_close(document, ']');
    format_put_open(document, "lacks", '{');
    for (int i = 0; gen_quantity(i); i++)
        if (gen_lack(generation, i))
            format_put_text(document, gen_quantity(i), gen_lack(generation, i));
    format_put_close(document, '}');
}

static void put_sources(struct document *document, const struct sources *sources) {
    format_put_open(document, "sources", '[');
    for (int i = 0; i < sources->count; i++)
        format_put_text(document, NULL, sources->list[i].path);
    format_put_close(document, ']');
}

static enum status print_library(struct scene *scene, const struct options *options) {
    (void)options;
    struct document document;
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    format_put_text(&document, "name", scene->model->name);
    format_put_text(&document, "library", scene->compiled.path);
    const char *awaited = compile_awaited_path(&scene->compiled);
    if (awaited)
        format_put_text(&document, "optimised", awaited);
    format_put_whole(&document, "lanes", scene->compiled.lanes ? scene->compiled.lanes->width : 0);
    put_names(&document, scene);
    put_requirements(&document, scene);
    put_row_starts(&document, scene);
    put_bounds(&document, &scene->generation.model);
    put_functions(&document, &scene->generation);
    put_sources(&document, scene->generation.model.sources);
    format_put_close(&document, '}');
    return scene_finish(scene, &document);
}

/* What a library is for: the functions that these commands call, from the library that they use. */
static const char *const purposes[] = {"motion", "statics", "modes", NULL};
static const unsigned purpose_needs[] = {NEEDS_MOTION | NEEDS_POINTS | NEEDS_POINT_RATES | NEEDS_TANGENT,
                                         NEEDS_STATICS | NEEDS_POINTS,
                                         NEEDS_STATICS | NEEDS_POINTS | NEEDS_TANGENT | NEEDS_LINEAR};

static const char *list_purposes(const struct command *command) {
    (void)command;
    return message_names(&format_memory, purposes, (int)(sizeof purposes / sizeof purposes[0]) - 1);
}

static enum status choose_needs(const struct options *options, unsigned *needs) {
    const int count = (int)(sizeof purposes / sizeof purposes[0]) - 1;
    *needs = 0;
    for (const char **word = options_list(options_text(options, "for")); *word; word++) {
        const int place = text_index(*word, purposes, count);
        if (place < 0)
            return options_error(options, "for", ": '%s' is not one of %s%s", *word, list_purposes(NULL),
                                 message_nearest_advice(&format_memory, *word, purposes, count));
        *needs |= purpose_needs[place];
    }
    if (*needs && options_text(options, "emit"))
        return options_usage_error(options->command, "--for chooses the quantities itself; omit --emit");
    *needs = *needs ? *needs : NEEDS_ALL;
    return STATUS_DONE;
}

static enum status run_compile(const struct options *options) {
    struct options own = *options;
    unsigned needs;
    const enum status status = choose_needs(options, &needs);
    if (options_has(options, "for-lanes"))
        options_set_number(&own, "lanes", refdyn_batch_widest());
    return status == STATUS_DONE ? scene_run(&own, NEEDS_RESULT | needs, NULL, print_library) : status;
}

static const struct option_rule compile_rules[] = {
    {"for", "motion,...", OPTION_LIST, "only the functions that a command calls: %s", NULL, list_purposes},
    {.name = NULL}};

const struct command compile_command = {
    .name = "compile",
    .run = run_compile,
    .operands = "MODEL.lua",
    .options = "output for emit for-lanes set loops accelerations fold",
    .tables = {compile_rules, scene_rules},
    .output = "FILE",
    .purpose = "compile a model for other programs to load",
    .help =
        "Leaves a shared library in the cache and prints JSON: its path, lanes, the model's names, units "
        "and values,\n"
        "its start, and the parts of the result of each emitted function. The library has NAME_model "
        "(refdyn_model.h).\n"
        "The library may be a first tier, compiled at once. Then `optimised` is the path at which the "
        "optimised "
        "library with the same bits will appear.\n"
        "--for motion compiles the library of `sim`, --for statics and --for modes those of `statics` and "
        "`modes`.\n"
        "With --for-lanes it also has NAME_lanes_W (refdyn_lanes.h), for W motions side by side, the "
        "widest for this processor.\n\n"
        "  refdyn compile models/manipulator.lua --set n_rfe=8\n"
        "  refdyn compile models/manipulator.lua --for motion\n"
        "  refdyn compile models/manipulator.lua --emit qdd,d_qdd --for-lanes\n"};
