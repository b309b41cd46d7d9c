/*
 * `refdyn view RUN...`: writes motions as one HTML page, which shows them from all sides.
 *
 * The page needs no other file and no network. It contains three.js with its licence, the style and the
 * scripts of page/, and the data.
 */
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/results/view/view.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- The page ---- */

/* Texts of page/, embedded by the build. */
extern const char view_body[], view_style[], view_three_licence[], view_load[], view_motion[], view_camera[],
    view_shapes[], view_scene[], view_charts[], view_controls[], view_page_script[], view_start[];

/* The file that the user names, the one in the installation, or Debian's. */
static const char *page_three_path(void) {
    const char *own = getenv("REFDYN_THREE");
    const char *shared = own && *own ? own : system_shared_path("three.min.js");
    return shared ? shared : "/usr/share/javascript/three/three.min.js";
}

char *view_three_read(void) {
    const char *path = page_three_path();
    if (access(path, R_OK) == 0)
        return format_read_file(path, "three.js");
    fprintf(stderr,
            "refdyn: %s: %s; install three.js (Debian: apt install libjs-three), or name its file in "
            "REFDYN_THREE\n",
            path, strerror(errno));
    return NULL;
}

/* Escapes "<", which could end the script element; JSON has it only in texts. */
static void put_data_script(FILE *out, const char *name, const char *data) {
    fprintf(out, "<script type=\"application/json\" id=\"%s\">\n", name);
    for (const char *at = data; *at; at++)
        if (*at == '<')
            fputs("\\u003c", out);
        else
            fputc(*at, out);
    fputs("\n</script>\n", out);
}

/* The texts of both lists, one after another. */
static char *join(const char *const *texts, const char *const *more) {
    char *joined;
    size_t size;
    FILE *out = format_stream(&joined, &size);
    for (; *texts; texts++)
        fputs(*texts, out);
    for (; *more; more++)
        fputs(*more, out);
    fclose(out);
    return joined;
}

/* The page must not load anything, and runs only the scripts with these hashes. */
static void put_policy(FILE *out, const struct view_page *page, const char *program, const char *style) {
    fprintf(out,
            "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src %s %s%s; "
            "style-src %s\">\n",
            view_hash(view_load), view_hash(program), page->policy, view_hash(style));
}

void view_page_put(FILE *out, const struct view_page *page) {
    const char *const scripts[] = {"\"use strict\";\n", page->three,      "\n",       view_motion,
                                   view_camera,         view_shapes,      view_scene, view_charts,
                                   view_controls,       view_page_script, NULL};
    const char *const styles[] = {view_style, NULL};
    char *program = join(scripts, page->scripts), *style = join(styles, page->styles);
    char *packed = view_pack(program, strlen(program));
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n", out);
    put_policy(out, page, program, style);
    fputs("<meta name=\"viewport\" content=\"width=device-width\">\n"
          "<meta name=\"generator\" content=\"refdyn " REFDYN_VERSION "\">\n<title>",
          out);
    format_xml_text(out, page->title);
    fprintf(out, "</title>\n<style>%s</style>\n</head>\n<body>\n%s", style, view_body);
    put_data_script(out, "data", page->data);
    for (int i = 0; page->blocks[i]; i++)
        put_data_script(out, page->block_names[i], page->blocks[i]);
    fprintf(out, "<!--\n%s-->\n", view_three_licence);
    put_data_script(out, "program", packed);
    fprintf(out, "<script>%s</script>\n</body>\n</html>\n", view_load);
    free(packed);
    free(style);
    free(program);
}

/* ---- The command ---- */

struct viewing {
    const struct options *options;
    struct run *runs; /* (run_count) */
    int run_count;
    struct targets targets;
    struct target *target;
    char *three;
};

static enum status check_usage(const struct options *options) {
    const char *model = options_text(options, "model");
    bool has_csv = false;
    for (int i = 0; i < options->operand_count; i++) {
        const char *path = options->operands[i];
        const bool is_hdf5 = figures_run_is_hdf5(path);
        has_csv = has_csv || !is_hdf5;
        if (!is_hdf5 && !model)
            return options_usage_error(options->command, "%s: a CSV does not contain its model; add --model",
                                       path);
    }
    if (!has_csv && (model || options->setting_count > 0))
        return options_usage_error(options->command,
                                   "%s: all runs are HDF5 files, which contain their models; omit it",
                                   model ? "--model" : "--set");
    return STATUS_DONE;
}

/* ---- Data ---- */

int view_upward(const struct generation *generation) {
    const struct model *model = &generation->model;
    for (int axis = AXIS_X; axis <= AXIS_Z; axis++)
        if (parameters_evaluate(model->graph, model->parameters, model->gravity[axis]) < 0 &&
            model->gravity[(axis + 1) % 3] == 0 && model->gravity[(axis + 2) % 3] == 0)
            return axis;
    return AXIS_Z;
}

void view_palette_put(FILE *out) {
    enum { COLOURS = 10 };
    fputs("\"palette\":[", out);
    for (int i = 0; i < COLOURS; i++)
        fprintf(out, "%s\"#%06x\"", i ? "," : "", figures_style_quantity(i, COLOURS, 0, 1).colour);
    fputs("],\n", out);
}

static void put_read_run(FILE *out, const struct viewing *viewing, const struct run *run,
                         struct generation *generation) {
    const struct drawn_rows rows = view_drawn_run_rows(run, viewing->run_count);
    fputs("{\"name\":", out);
    format_json_text(out, run->name);
    fputs(",\"model\":", out);
    format_json_text(out, generation->model.name);
    fprintf(out, ",\"up\":%d,\n", view_upward(generation));
    view_drawn_model_put(out, generation, NULL);
    fputs(",\n", out);
    view_bounds_put(out, &generation->model);
    fputs(",\n", out);
    view_drawn_run_put(out, run, &generation->tree, &rows);
    fputs(",\n", out);
    view_applied_forces_put(out, generation, run, &rows);
    fputs(",\n", out);
    view_programme_curves_put(out, generation, run);
    fputc('}', out);
}

static enum status put_run(FILE *out, const struct viewing *viewing, const struct run *run) {
    struct viewed_model viewed;
    const enum status status = view_model_read(&viewed, run, viewing->options);
    if (status == STATUS_DONE)
        put_read_run(out, viewing, run, &viewed.scene.generation);
    view_model_release(&viewed);
    return status;
}

static enum status put_data(FILE *out, const struct viewing *viewing) {
    enum status status = STATUS_DONE;
    fputs("{\n", out);
    view_palette_put(out);
    fputs("\"runs\":[", out);
    for (int i = 0; i < viewing->run_count && status == STATUS_DONE; i++) {
        fputs(i ? ",\n" : "\n", out);
        status = put_run(out, viewing, &viewing->runs[i]);
    }
    fputs("]}", out);
    return status;
}

/* ---- Files ---- */

static bool open_files(struct viewing *viewing) {
    const struct options *options = viewing->options;
    const char *model = options_text(options, "model");
    for (int i = 0; i < options->operand_count; i++)
        system_targets_spare(&viewing->targets, options->operands[i]);
    if (model)
        system_targets_spare(&viewing->targets, model);
    viewing->three = view_three_read();
    viewing->target =
        viewing->three ? system_target_open(&viewing->targets, options_text(options, "output")) : NULL;
    bool is_good = viewing->target;
    for (int i = 0; i < viewing->run_count && is_good; i++)
        is_good = figures_run_read(&viewing->runs[i], options->operands[i]);
    return is_good;
}

static const char *title_of(const struct viewing *viewing) {
    const char *title = viewing->runs[0].name;
    for (int i = 1; i < viewing->run_count; i++)
        title = format_text("%s, %s", title, viewing->runs[i].name);
    return title;
}

static enum status write_page(const struct viewing *viewing) {
    char *data;
    size_t size;
    FILE *out = format_stream(&data, &size);
    enum status status = put_data(out, viewing);
    fclose(out);
    if (status == STATUS_DONE) {
        static const char *const none[] = {NULL}, *const scripts[] = {view_start, NULL};
        const struct view_page page = {.title = title_of(viewing),
                                       .policy = "",
                                       .styles = none,
                                       .three = viewing->three,
                                       .data = data,
                                       .block_names = none,
                                       .blocks = none,
                                       .scripts = scripts};
        view_page_put(viewing->target->file, &page);
        status = system_target_finish(viewing->target) ? STATUS_DONE : STATUS_FAULT;
    }
    free(data);
    return status;
}

static enum status write_view(const struct options *options) {
    struct viewing viewing = {.options = options, .run_count = options->operand_count};
    enum status status = check_usage(options);
    if (status != STATUS_DONE)
        return status;
    viewing.runs = format_allocate((size_t)viewing.run_count, sizeof *viewing.runs);
    status = open_files(&viewing) ? write_page(&viewing) : STATUS_FAULT;
    system_targets_release(&viewing.targets);
    return status;
}

enum status view_run(const struct options *options) {
    return options_has(options, "watch") ? scene_watch(options, options_text(options, "model"),
                                                       options->operands, options->operand_count, write_view)
                                         : write_view(options);
}

const struct option_rule view_rules[] = {{"model", "MODEL.lua", OPTION_TEXT,
                                          "model of the runs that are CSV files; HDF5 files contain theirs",
                                          NULL, NULL},
                                         {.name = NULL}};
