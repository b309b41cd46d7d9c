/* `refdyn gen` and `refdyn check`: the C files of a model, with their rule of make, and its tree of links. */
#include "runtime/tool/commands/generate/generate.h"
#include "gen/language/values.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/results/view/view.h"

#include <stdlib.h>
#include <string.h>

/* ---- A rule of make for the emitted files ---- */

/* A path in the syntax of make. */
static void add_path(struct text *rule, const char *path) {
    for (; *path; path++)
        text_add(rule, *path == ' ' || *path == '#' ? "\\%c" : *path == '$' ? "$%c" : "%c", *path);
}

static const char *depfile_text(const struct generation *generation, const char *folder) {
    struct text rule = {.memory = &format_memory};
    const struct emitted_file *files = gen_files(generation);
    const struct sources *sources = generation->model.sources;
    for (int i = 0; i < gen_file_count(generation); i++) {
        text_add(&rule, i ? " " : "");
        add_path(&rule, format_text("%s/%s", folder, files[i].name));
    }
    text_add(&rule, ":");
    for (int i = 0; i < sources->count; i++) {
        text_add(&rule, " ");
        add_path(&rule, sources->list[i].path);
    }
    text_add(&rule, "\n");
    return rule.data;
}

/* All files are written before the first one gets its name; `depfile`, if it is not NULL, is the last of
 * them. */
static bool write_files(struct scene *scene, const char *folder, const char *depfile) {
    const struct emitted_file *files = gen_files(&scene->generation);
    const int emitted = gen_file_count(&scene->generation), count = emitted + (depfile != NULL);
    struct target **open = format_allocate((size_t)count, sizeof *open);
    sigset_t before;
    bool is_good = true;
    for (int i = 0; i < emitted && is_good; i++) {
        open[i] = system_target_open(&scene->targets, format_text("%s/%s", folder, files[i].name));
        is_good = open[i] && system_target_write(open[i], files[i].text, files[i].length);
    }
    if (depfile && is_good) {
        const char *rule = depfile_text(&scene->generation, folder);
        open[emitted] = system_target_open(&scene->targets, depfile);
        is_good = open[emitted] && system_target_write(open[emitted], rule, strlen(rule));
    }
    system_interrupt_hold(&before); /* all or none */
    for (int i = 0; i < count && is_good; i++)
        is_good = system_target_finish(open[i]);
    system_interrupt_release(&before);
    return is_good;
}

/* Writes into the folder of -o, which exists. */
static enum status emit_into_folder(struct scene *scene, const struct options *options) {
    struct generation *generation = &scene->generation;
    const char *folder = options_text(options, "output");
    const enum status status = scene_outcome(scene, options, gen_check_folder(generation, folder));
    if (status != STATUS_DONE)
        return status;
    if (!write_files(scene, folder, options_text(options, "depfile")))
        return STATUS_FAULT;
    return scene_outcome(scene, options, gen_remove_stale_parts(generation, folder));
}

static enum status emit_scene(struct scene *scene, const struct options *options) {
    struct generation *generation = &scene->generation;
    generation->has_lanes = options_has(options, "for-lanes");
    generation->has_casadi = options_has(options, "for-casadi");
    scene_spare_sources(scene, &scene->targets);
    if (!system_targets_make_folder(&scene->targets,
                                    options_text(options, "output"))) /* reported before the work */
        return STATUS_FAULT;
    enum status status = scene_outcome(scene, options, gen_plan(generation, options_text(options, "emit")));
    if (status == STATUS_DONE)
        status = emit_into_folder(scene, options);
    if (status == STATUS_DONE)
        gen_print_summary(generation, stdout);
    return status;
}

static enum status explain_pass(struct scene *scene, const struct options *options) {
    const char *explain = options_text(options, "explain"), *output = options_text(options, "output");
    struct generation *generation = &scene->generation;
    const char *wrong = gen_wrong_pass(generation, explain);
    if (wrong)
        return options_usage_error(options->command, "--explain: %s", wrong);
    if (output || options_text(options, "depfile"))
        return options_usage_error(options->command, "--explain prints and writes no files; leave out %s",
                                   output ? "-o" : "--depfile");
    return scene_outcome(scene, options,
                         gen_explain(generation, options_text(options, "emit"), explain, stdout));
}

/* The types of real numbers. */
enum { REAL_DOUBLE, REAL_FLOAT };
static const char *const real_words[] = {[REAL_DOUBLE] = "double", [REAL_FLOAT] = "float", NULL};

/* Files for lanes and for CasADi call the functions with doubles. */
static enum status read_real(const struct options *options, bool *is_single) {
    static const char *const others[] = {"for-lanes", "for-casadi"};
    int place;
    const enum status status = options_choose(options, "real", &place);
    *is_single = place == REAL_FLOAT;
    for (int i = 0; i < 2 && status == STATUS_DONE && *is_single; i++)
        if (options_has(options, others[i]))
            return options_usage_error(options->command,
                                       "--real float: is for NAME.c and its steps only; leave out --%s",
                                       others[i]);
    return status;
}

static enum status generate(struct scene *scene, const struct options *options) {
    const char *emit = options_text(options, "emit");
    const enum status status = read_real(options, &scene->generation.is_single);
    if (status != STATUS_DONE)
        return status;
    const char *wrong = emit ? gen_wrong_emit(&scene->generation, emit) : NULL;
    if (wrong)
        return options_usage_error(options->command, "--emit: %s", wrong);
    return options_text(options, "explain") ? explain_pass(scene, options) : emit_scene(scene, options);
}

/* A name of --name follows the rules for the name of a model. */
static enum status run_gen(const struct options *options) {
    struct messages messages = {.memory = &format_memory};
    const char *name = options_text(options, "name");
    if (name)
        names_check_model(&messages, (struct named){name, {.file = ""}});
    if (messages.count)
        return options_error(options, "name", ": %s", messages.list->text);
    return scene_run(options, 0, NULL, generate);
}

/* Draws the picture of --draw. */
static enum status draw_model(struct scene *scene, const struct options *options) {
    const char *draw = options_text(options, "draw");
    const struct picture_format *format = figures_picture_format_of(draw);
    char *svg;
    size_t size;
    if (!format)
        return options_usage_error(options->command, "--draw: '%s' must end in .svg, .png or .pdf", draw);
    scene_spare_sources(scene, &scene->targets);
    struct target *target =
        figures_picture_can_write(format) ? system_target_open(&scene->targets, draw) : NULL;
    if (!target)
        return STATUS_FAULT;
    FILE *out = format_stream(&svg, &size);
    view_model_drawing_put(out, &scene->generation);
    fclose(out);
    const bool is_good = figures_picture_write(format, svg, target->file) && system_target_finish(target);
    free(svg);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

static enum status check(struct scene *scene, const struct options *options) {
    const enum status status = options_text(options, "draw") ? draw_model(scene, options) : STATUS_DONE;
    if (status == STATUS_DONE)
        gen_print_model(&scene->generation, stdout);
    return status;
}

static enum status run_check(const struct options *options) {
    return scene_run(options, 0, NULL, check);
}

static const char *list_passes(const struct command *command) {
    struct text text = {.memory = &format_memory};
    (void)command;
    for (int i = 0; gen_pass(i); i++)
        text_add(&text, "%s%s", i ? " " : "", gen_pass(i));
    return text.data;
}

static const struct option_rule gen_rules[] = {
    {"name", "NAME", OPTION_TEXT,
     "the name of the files and of all names in the C, instead of the model's: for two structures in one "
     "program",
     NULL, NULL},
    {"real", "TYPE", OPTION_TEXT,
     "double (default) or float: the type of numbers in the C; float: single precision for "
     "microcontrollers, without the table for the runtime",
     real_words, NULL},
    {"for-casadi", NULL, OPTION_FLAG,
     "also functions and their derivatives for CasADi: NAME_casadi.c, to be compiled alone into a "
     "shared library",
     NULL, NULL},
    {"depfile", "FILE.d", OPTION_TEXT,
     "write a rule for make: the emitted files depend on the model and all files that it requires", NULL,
     NULL},
    {"explain", "PASS", OPTION_TEXT,
     "without -o: print the result of a pass: expand, roll, derive, sums or plan", NULL, list_passes},
    {.name = NULL}};

const struct command gen_command = {
    .name = "gen",
    .run = run_gen,
    .operands = "MODEL.lua",
    .options = "output! name emit real for-lanes for-casadi depfile explain set loops accelerations fold",
    .tables = {gen_rules, scene_rules},
    .replaces_needed = "explain",
    .output = "DIR",
    .purpose = "write the C code of a model",
    .help = "Writes NAME.h and NAME.c, and further .c files if they are long, into the folder of -o. Prints "
            "what was emitted. docs/commands.md lists the quantities of --emit.\n\n"
            "  refdyn gen models/manipulator.lua -o out\n"
            "  refdyn gen models/manipulator.lua --set n_rfe=8 --emit qdd -o out\n"
            "  refdyn gen models/manipulator.lua --emit qdd_free,constrained --for-lanes -o out\n"
            "  refdyn gen models/puma.lua --emit qdd,step --real float -o out\n"
            "  refdyn gen models/manipulator.lua --emit M --explain plan\n"};

static const struct option_rule check_rules[] = {
    {"draw", "FILE.svg", OPTION_TEXT,
     "draw the tree of links, with rows and drives, as SVG, PNG or PDF by the suffix of FILE", NULL, NULL},
    {.name = NULL}};

const struct command check_command = {
    .name = "check",
    .run = run_check,
    .operands = "MODEL.lua",
    .options = "draw set fold",
    .tables = {check_rules, scene_rules},
    .output = "FILE",
    .purpose = "read and check a model, and show it",
    .help = "Prints the tree of links, the coordinates, constraints and parameters.\n\n"
            "  refdyn check models/manipulator.lua --draw manipulator.svg\n"
            "  refdyn check models/manipulator.lua --set n_rfe=1\n"};
