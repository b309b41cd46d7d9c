/*
 * `refdyn view`: of runs as view.c shows them; with --live of a model, as a page that computes its motions
 * itself.
 *
 * The page contains the text of the model, three.js, the style and scripts of view/page and page/, and a
 * module of WebAssembly: the model's C, the runtime core and the records of motions.
 */
#include "runtime/tool/results/live/live.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Texts of page/, embedded by the build. */
extern const char live_css[], live_values_js[], live_start_js[], live_worker_js[];

/* ---- Ranges ---- */

/* NAME=FROM:TO */
static bool read_range(const char *text, struct live_range *range) {
    const char *equals = strchr(text, '=');
    char *end;
    if (!equals || equals == text)
        return false;
    range->name = format_text("%.*s", (int)(equals - text), text);
    range->from = strtod(equals + 1, &end);
    if (end == equals + 1 || *end != ':')
        return false;
    const char *to = end + 1;
    range->to = strtod(to, &end);
    return end != to && !*end && isfinite(range->from) && isfinite(range->to);
}

static enum status check_range(const struct live *live, const char *text, struct live_range *range) {
    if (!read_range(text, range))
        return options_error(live->options, "range", ": '%s' is not of the form NAME=FROM:TO", text);
    if (!(range->from < range->to))
        return options_error(live->options, "range", ": '%s': the range must ascend", text);
    if (!live_has_slider(live, range->name))
        return options_error(live->options, "range",
                             ": '%s' is no parameter, input or start value of the model", range->name);
    return STATUS_DONE;
}

/* Reads all ranges; the list ends with a name NULL. */
static enum status read_ranges(const struct live *live, struct live_range **ranges) {
    const struct options *options = live->options;
    const char *text;
    enum status status = STATUS_DONE;
    int count = 0;
    *ranges = format_allocate((size_t)options->value_count + 1, sizeof **ranges);
    for (int i = 0; (text = options_repeated(options, "range", i)) && status == STATUS_DONE; i++)
        status = check_range(live, text, &(*ranges)[count++]);
    return status;
}

/* ---- The page ---- */

static char *base64(const char *bytes, size_t size) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char *text = format_allocate_large(4 * ((size + 2) / 3) + 3, 1), *at = text;
    *at++ = '"';
    for (size_t i = 0; i < size; i += 3) {
        unsigned long group = 0;
        for (size_t k = 0; k < 3; k++)
            group = group << 8 | (i + k < size ? (unsigned char)bytes[i + k] : 0);
        for (size_t k = 0; k < 4; k++)
            *at++ = i + k > size ? '=' : digits[group >> (18 - 6 * k) & 63];
    }
    *at++ = '"';
    return text;
}

/* A text as JSON. */
static char *json_text(const char *text) {
    char *json;
    size_t size;
    FILE *out = format_stream(&json, &size);
    format_json_text(out, text);
    fclose(out);
    return json;
}

static void put_page(const struct live *live, const char *three, const char *data, const char *module) {
    static const char *const names[] = {"module", "worker", "model", NULL};
    static const char *const styles[] = {live_css, NULL}, *const scripts[] = {live_values_js, live_start_js,
                                                                              NULL};
    char *source = format_read_file(*live->options->operands, "the model");
    char *worker = json_text(live_worker_js), *model = json_text(source ? source : "");
    const char *blocks[] = {module, worker, model, NULL};
    const struct view_page page = {.title = live->scene.model->name,
                                   .policy = " 'wasm-unsafe-eval'; worker-src blob:",
                                   .styles = styles,
                                   .three = three,
                                   .data = data,
                                   .block_names = names,
                                   .blocks = blocks,
                                   .scripts = scripts};
    view_page_put(live->scene.result->file, &page);
    free(worker);
    free(model);
}

static enum status write_page(struct live *live, const struct live_range *ranges, const char *three) {
    char *data;
    size_t size, module_size;
    live_find_forces(live);
    live_find_curves(live);
    FILE *out = format_stream(&data, &size);
    live_data_put(out, live, ranges);
    fclose(out);
    char *module = live_module_make(live, &module_size);
    if (!module) {
        free(data);
        return STATUS_FAULT;
    }
    char *text = base64(module, module_size);
    put_page(live, three, data, text);
    free(text);
    free(module);
    free(data);
    return system_target_finish(live->scene.result) ? STATUS_DONE : STATUS_FAULT;
}

/* Reads the model once more, with its options but without values of parameters and inputs. */
static enum status read_drawn(struct live *live) {
    struct options reading = *live->options;
    const struct model *model = &live->scene.generation.model;
    reading.settings = format_allocate((size_t)reading.setting_count, sizeof *reading.settings);
    reading.setting_count = 0;
    for (int i = 0; i < live->options->setting_count; i++)
        for (int k = 0; k < model->option_count; k++)
            if (strcmp(model->options[k].name, live->options->settings[i].name) == 0)
                reading.settings[reading.setting_count++] = live->options->settings[i];
    const enum status status = scene_read(&live->drawn, &reading, false);
    live->drawn.generation.memory.work_bound = 0; /* the model is read; only a few numbers follow */
    return status;
}

static enum status write_live(const struct options *options) {
    struct live live = {.options = options};
    struct live_range *ranges;
    struct refdyn_options integration;
    enum status status = simulate_options(options, &integration);
    if (status != STATUS_DONE)
        return status;
    char *three = view_three_read();
    status = three ? scene_open(&live.scene, options,
                                NEEDS_RESULT | NEEDS_STATICS | NEEDS_MOTION | NEEDS_POINTS |
                                    NEEDS_POINT_RATES | NEEDS_TANGENT | NEEDS_ONCE,
                                NULL)
                   : STATUS_FAULT;
    if (status == STATUS_DONE)
        status = read_ranges(&live, &ranges);
    if (status == STATUS_DONE) {
        status = read_drawn(&live);
        if (status == STATUS_DONE)
            status = write_page(&live, ranges, three);
        scene_close(&live.drawn);
    }
    if (three)
        scene_close(&live.scene);
    return status;
}

/* ---- The command ---- */

static enum status refuse(const struct options *options, const char *const *names, const char *why) {
    for (; *names; names++)
        if (options_has(options, *names))
            return options_usage_error(options->command, "--%s %s", *names, why);
    return STATUS_DONE;
}

static enum status run_live(const struct options *options) {
    static const char *const of_runs[] = {"model", NULL};
    if (options->operand_count > 1)
        return options_usage_error(options->command, "--live shows one model; omit '%s'",
                                   options->operands[1]);
    const enum status status = refuse(options, of_runs, "is for runs; with --live the operand is the model");
    if (status != STATUS_DONE)
        return status;
    return options_has(options, "watch")
               ? scene_watch(options, *options->operands, options->operands + 1, 0, write_live)
               : write_live(options);
}

static enum status run_any(const struct options *options) {
    static const char *const of_models[] = {"range", "until", "step", "tol", NULL};
    if (options_has(options, "live"))
        return run_live(options);
    const enum status status = refuse(options, of_models, "needs --live");
    return status == STATUS_DONE ? view_run(options) : status;
}

static const struct option_rule live_rules[] = {
    {"live", NULL, OPTION_FLAG, "RUN is a MODEL.lua: a page that computes its motions itself", NULL, NULL},
    {"range", "NAME=FROM:TO", OPTION_TEXTS,
     "with --live: range of a slider (default: a tenth to ten times its value; repeatable)", NULL, NULL},
    {.name = NULL}};

const struct command view_command = {
    .name = "view",
    .run = run_any,
    .operands = "RUN...",
    .options = "output! model watch set live range until step tol",
    .tables = {live_rules, view_rules, simulate_rules, scene_rules},
    .output = "PAGE.html",
    .purpose = "motions as one HTML page, to look at from all sides",
    .help = "Bodies and beams over time, paths of points, programme forces, and figures that follow the "
            "time. The page needs no\n"
            "network and no other file; several runs are shown together. With --live it shows a model: "
            "parameters, inputs and\n"
            "start have sliders, and the page computes each motion itself.\n\n"
            "  refdyn sim models/manipulator.lua --from statics --until 10 -o flexible.h5\n"
            "  refdyn view flexible.h5 -o flexible.html\n"
            "  refdyn view rigid.csv --model models/manipulator.lua --set n_rfe=1 -o rigid.html\n"
            "  refdyn view --live models/crane.lua --until 4 -o crane.html\n"};
