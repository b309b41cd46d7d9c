/*
 * `refdyn view`: a page of runs (view.c) or, with --live, a page that computes the motions of a model itself.
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
extern const char live_css[], live_values_js[], live_pull_js[], live_start_js[], live_worker_js[];

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

enum { STRUCTURES_MOST = 12 }; /* a page of them has some 4 MB */

/* An option of the model with the values among which the page chooses. */
struct choice {
    const char *name;
    const char **values; /* (count) */
    int count;
};

/* The structures of a page: one, or one for each combination of the values that --options states. The values
 * of the last choice follow each other. */
struct structures {
    const struct options *options;
    struct choice *choices; /* (choice_count) */
    int choice_count;
    struct live *list; /* (count) */
    int count, open_count;
};

static bool has_slider(const struct structures *all, const char *name) {
    for (int i = 0; i < all->count; i++)
        if (live_has_slider(&all->list[i], name))
            return true;
    return false;
}

static enum status check_range(const struct structures *all, const char *text, struct live_range *range) {
    if (!read_range(text, range))
        return options_error(all->options, "range", ": '%s' is not of the form NAME=FROM:TO", text);
    if (!(range->from < range->to))
        return options_error(all->options, "range", ": '%s': the range must ascend", text);
    if (live_has_option(&all->list[0].scene.generation.model, range->name))
        return options_error(all->options, "range",
                             ": '%s' is an option of the model; --options %s=VALUE,VALUE,... lets the page "
                             "choose among its values",
                             range->name, range->name);
    if (!has_slider(all, range->name))
        return options_error(all->options, "range",
                             ": '%s' is no parameter, input or start value of the model", range->name);
    return STATUS_DONE;
}

/* Reads all ranges; the list ends with a name NULL. */
static enum status read_ranges(const struct structures *all, struct live_range **ranges) {
    const struct options *options = all->options;
    const char *text;
    enum status status = STATUS_DONE;
    int count = 0;
    *ranges = format_allocate((size_t)options->value_count + 1, sizeof **ranges);
    for (int i = 0; (text = options_repeated(options, "range", i)) && status == STATUS_DONE; i++)
        status = check_range(all, text, &(*ranges)[count++]);
    return status;
}

/* ---- The page ---- */

/* A text as JSON. */
static char *json_text(const char *text) {
    char *json;
    size_t size;
    FILE *out = format_stream(&json, &size);
    format_json_text(out, text);
    fclose(out);
    return json;
}

static void put_page(const struct structures *all, const char *three, const char *data, const char *modules) {
    static const char *const names[] = {"module", "worker", "model", NULL};
    static const char *const styles[] = {live_css, NULL}, *const scripts[] = {live_values_js, live_pull_js,
                                                                              live_start_js, NULL};
    const struct scene *first = &all->list[0].scene;
    char *source = format_read_file(*all->options->operands, "the model");
    char *worker = json_text(live_worker_js), *model = json_text(source ? source : "");
    const char *blocks[] = {modules, worker, model, NULL};
    const struct view_page page = {.title = first->model->name,
                                   .policy = " 'wasm-unsafe-eval'; worker-src blob:",
                                   .styles = styles,
                                   .three = three,
                                   .data = data,
                                   .block_names = names,
                                   .blocks = blocks,
                                   .scripts = scripts};
    view_page_put(first->result->file, &page);
    free(worker);
    free(model);
}

/* Writes the data of all structures: {"choices": [{"name": , "values": }, ...], "structures": }. */
static void put_data(FILE *out, const struct structures *all, const struct live_range *ranges) {
    fputs("{\"choices\":[", out);
    for (int i = 0; i < all->choice_count; i++) {
        fputs(i ? ",{\"name\":" : "{\"name\":", out);
        format_json_text(out, all->choices[i].name);
        fputs(",\"values\":[", out);
        for (int k = 0; k < all->choices[i].count; k++) {
            fputs(k ? "," : "", out);
            format_json_text(out, all->choices[i].values[k]);
        }
        fputs("]}", out);
    }
    fputs("],\"structures\":[", out);
    for (int i = 0; i < all->count; i++) {
        fputs(i ? ",\n" : "\n", out);
        live_find_forces(&all->list[i]);
        live_find_curves(&all->list[i]);
        live_data_put(out, &all->list[i], ranges);
    }
    fputs("]}", out);
}

/* Writes the modules of all structures as a list of texts. Call it after put_data, which fills the tapes. */
static bool put_modules(FILE *out, const struct structures *all) {
    bool is_good = true;
    for (int i = 0; i < all->count && is_good; i++) {
        size_t size;
        char *module = live_module_make(&all->list[i], &size);
        is_good = module != NULL;
        if (is_good) {
            char *text = view_pack(module, size);
            fprintf(out, "%s%s", i ? ",\n" : "[", text);
            free(text);
        }
        free(module);
    }
    fputs("]", out);
    return is_good;
}

static enum status write_page(const struct structures *all, const struct live_range *ranges,
                              const char *three) {
    char *data, *modules;
    size_t size;
    FILE *out = format_stream(&data, &size);
    put_data(out, all, ranges);
    fclose(out);
    out = format_stream(&modules, &size);
    const bool is_good = put_modules(out, all);
    fclose(out);
    if (is_good)
        put_page(all, three, data, modules);
    free(modules);
    free(data);
    return is_good && system_target_finish(all->list[0].scene.result) ? STATUS_DONE : STATUS_FAULT;
}

/* ---- Structures ---- */

static bool is_value(const struct model *model, const char *name) {
    bool is = false;
    for (int i = 0; i < model->parameter_count; i++)
        is = is || strcmp(model->parameters[i].name, name) == 0;
    for (int i = 0; i < model->input_count; i++)
        is = is || strcmp(model->inputs[i].name, name) == 0;
    return is;
}

/* Reads the model to check the name of an option. */
static enum status check_option(const struct options *options, const char *name) {
    struct scene scene;
    enum status status = scene_read(&scene, options, false);
    if (status == STATUS_DONE && is_value(&scene.generation.model, name))
        status = options_error(options, "options",
                               ": '%s' is no option of the model but has a slider; --range %s=FROM:TO states "
                               "its range",
                               name, name);
    else if (status == STATUS_DONE && !live_has_option(&scene.generation.model, name))
        status = options_error(options, "options", ": the model has no option '%s'", name);
    scene_close(&scene);
    return status;
}

static enum status refuse_repeated(const struct structures *all, const char *name) {
    const struct options *options = all->options;
    for (int i = 0; i < options->setting_count; i++)
        if (strcmp(options->settings[i].name, name) == 0)
            return options_error(options, "options", ": --set states '%s', too; omit one of them", name);
    for (int i = 0; i < all->choice_count; i++)
        if (strcmp(all->choices[i].name, name) == 0)
            return options_error(options, "options", ": '%s' is given twice; give it once", name);
    return STATUS_DONE;
}

/* NAME=VALUE,VALUE,... */
static enum status read_choice(struct structures *all, const char *text) {
    const struct options *options = all->options;
    const char *equals = strchr(text, '=');
    if (!equals || equals == text)
        return options_error(options, "options", ": '%s' is not of the form NAME=VALUE,VALUE,...", text);
    struct choice choice = {.name = format_text("%.*s", (int)(equals - text), text)};
    enum status status = refuse_repeated(all, choice.name);
    if (status == STATUS_DONE)
        status = options_check_list(options->command, "options", equals + 1);
    if (status == STATUS_DONE)
        status = check_option(options, choice.name);
    choice.values = options_list(equals + 1);
    while (choice.values[choice.count])
        choice.count++;
    all->choices[all->choice_count++] = choice;
    return status;
}

static enum status read_choices(struct structures *all) {
    const struct options *options = all->options;
    const char *text;
    enum status status = STATUS_DONE;
    all->count = 1;
    all->choices = format_allocate((size_t)options->value_count + 1, sizeof *all->choices);
    for (int i = 0; (text = options_repeated(options, "options", i)) && status == STATUS_DONE; i++) {
        status = read_choice(all, text);
        if (status == STATUS_DONE && all->choices[i].count > STRUCTURES_MOST / all->count)
            status =
                options_error(options, "options",
                              ": more than %d combinations, each of which adds a module to the page; state "
                              "fewer values",
                              STRUCTURES_MOST);
        else
            all->count *= all->choices[i].count;
    }
    return status;
}

/* The options of the call, with the values of one structure as settings. */
static const struct options *options_of(const struct structures *all, int place) {
    const struct options *options = all->options;
    struct options *own = format_allocate(1, sizeof *own);
    *own = *options;
    own->settings =
        format_allocate((size_t)(options->setting_count + all->choice_count), sizeof *own->settings);
    for (int i = 0; i < options->setting_count; i++)
        own->settings[i] = options->settings[i];
    own->setting_count += all->choice_count;
    for (int i = all->choice_count - 1; i >= 0; i--) {
        const struct choice *choice = &all->choices[i];
        own->settings[options->setting_count + i] =
            (struct setting){choice->name, choice->values[place % choice->count], "--options"};
        place /= choice->count;
    }
    return own;
}

/* Reads the model once more, with its options but without values of parameters and inputs. */
static enum status read_drawn(struct live *live) {
    struct options reading = *live->options;
    const struct model *model = &live->scene.generation.model;
    reading.settings = format_allocate((size_t)reading.setting_count, sizeof *reading.settings);
    reading.setting_count = 0;
    for (int i = 0; i < live->options->setting_count; i++)
        if (live_has_option(model, live->options->settings[i].name))
            reading.settings[reading.setting_count++] = live->options->settings[i];
    const enum status status = scene_read(&live->drawn, &reading, false);
    live->drawn.generation.memory.work_bound = 0; /* the model is read; only a few numbers follow */
    return status;
}

/* Opens a structure; the first one has the file of the page. */
static enum status open_structure(struct structures *all, int place) {
    struct live *live = &all->list[place];
    *live = (struct live){.options = options_of(all, place)};
    enum status status =
        scene_open(&live->scene, live->options,
                   NEEDS_STATICS | NEEDS_MOTION | NEEDS_POINTS | NEEDS_POINT_RATES | NEEDS_TANGENT |
                       NEEDS_LINEAR | NEEDS_ONCE | (place == 0 ? NEEDS_RESULT : NEEDS_NO_WARNINGS),
                   NULL);
    if (status == STATUS_DONE) {
        status = read_drawn(live);
        if (status != STATUS_DONE)
            scene_close(&live->drawn);
    }
    if (status != STATUS_DONE)
        scene_close(&live->scene);
    else
        all->open_count++;
    return status;
}

static enum status write_structures(struct structures *all, const char *three) {
    struct live_range *ranges;
    enum status status = read_choices(all);
    all->list = format_allocate((size_t)all->count, sizeof *all->list);
    for (int i = 0; i < all->count && status == STATUS_DONE; i++)
        status = open_structure(all, i);
    if (status == STATUS_DONE)
        status = read_ranges(all, &ranges);
    if (status == STATUS_DONE)
        status = write_page(all, ranges, three);
    for (int i = 0; i < all->open_count; i++) {
        scene_close(&all->list[i].drawn);
        scene_close(&all->list[i].scene);
    }
    return status;
}

static enum status write_live(const struct options *options) {
    struct structures all = {.options = options};
    struct refdyn_options integration;
    enum status status = simulate_options(options, &integration);
    if (status == STATUS_DONE) /* a page without --until must show at least one second */
        status = simulate_check_steps(options, fmax(options_number(options, "until"), 1));
    if (status != STATUS_DONE)
        return status;
    const char *three = view_three_read();
    return three ? write_structures(&all, three) : STATUS_FAULT;
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
    enum status status = refuse(options, of_runs, "is for runs; with --live the operand is the model");
    if (status == STATUS_DONE)
        status = simulate_check_tol_rates(options, options_number(options, "step") > 0);
    if (status != STATUS_DONE)
        return status;
    return options_has(options, "watch")
               ? scene_watch(options, *options->operands, options->operands + 1, 0, write_live)
               : write_live(options);
}

static enum status run_any(const struct options *options) {
    static const char *const of_models[] = {"range", "options", "pull",      "until",
                                            "step",  "tol",     "tol-rates", NULL};
    if (options_has(options, "live"))
        return run_live(options);
    const enum status status = refuse(options, of_models, "needs --live");
    return status == STATUS_DONE ? view_run(options) : status;
}

static const struct option_rule live_rules[] = {
    {"live", NULL, OPTION_FLAG, "RUN is a MODEL.lua: a page that computes its motions itself", NULL, NULL},
    {"range", "NAME=FROM:TO", OPTION_TEXTS,
     "with --live: range of a slider (default: a tenth to ten times its value; repeatable)", NULL, NULL},
    {"options", "NAME=VALUE,...", OPTION_TEXTS,
     "with --live: values of an option of the model, among which the page chooses (repeatable)", NULL, NULL},
    {"pull", NULL, OPTION_FLAG, "with --live: the pointer can pull the points of interest", NULL, NULL},
    {.name = NULL}};

const struct command view_command = {
    .name = "view",
    .run = run_any,
    .operands = "RUN...",
    .options = "output! model watch set live range options pull until step tol tol-rates",
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
