/* `refdyn plot`: draws motions over each other, or a file of runs, into one file. */
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/system/system.h"

#include <stdlib.h>
#include <string.h>

struct drawing {
    const struct options *options;
    const struct picture_format *format;
    struct panels panels;
    struct targets targets;
    struct target *target;
    bool is_of_runs; /* the only operand is a file of runs */
};

static bool is_file_of_runs(const char *path) {
    return figures_run_is_hdf5(path) && !hdf5_motion_is_in(path);
}

static enum status check_runs(struct drawing *drawing) {
    const struct options *options = drawing->options;
    for (int i = 0; i < options->operand_count; i++) {
        drawing->is_of_runs = is_file_of_runs(options->operands[i]);
        if (drawing->is_of_runs && options->operand_count > 1)
            return usage_error(options->command, "%s: a file of runs must be the only operand",
                               options->operands[i]);
    }
    if (drawing->is_of_runs && options_text(options, "units"))
        return usage_error(options->command, "--units: a file of runs has its own units; omit it");
    return STATUS_DONE;
}

static enum status check_usage(struct drawing *drawing) {
    const struct options *options = drawing->options;
    const char *output = options_text(options, "output");
    const enum status status = check_runs(drawing);
    const char *unknown =
        drawing->is_of_runs ? NULL : figures_panels_choose(&drawing->panels, options_text(options, "panel"));
    drawing->format = figures_picture_format_of(output);
    if (status == STATUS_DONE && unknown)
        return usage_error(options->command, "--panel: '%s' is not one of %s", unknown,
                           figures_panels_names());
    if (status == STATUS_DONE && !drawing->format)
        return usage_error(options->command, "-o: '%s' must end in .svg, .png or .pdf", output);
    return status;
}

/* Reads the object "units" of a summary. */
static bool read_units(struct panels *panels, const char *path) {
    char *text = format_read_file(path, "units");
    json_error_t error;
    json_t *root = text ? json_loads(text, JSON_REJECT_DUPLICATES, &error) : NULL;
    panels->units = json_incref(json_object_get(root, "units"));
    const bool is_good = json_is_object(panels->units);
    if (text && !is_good)
        format_complain_line(
            path, root ? 1 : error.line,
            format_text("units: %s; give a summary of refdyn sim", root ? "no object 'units'" : error.text));
    json_decref(root);
    return is_good;
}

/* The heads are the names of the runs. */
static void draw(const struct panels *panels, FILE *out) {
    enum { WIDTH = 480, HEIGHT = 300, COLUMNS_MAX = 3 };
    const int count = panels->count;
    struct figure figure = {.heads = format_allocate((size_t)panels->run_count, sizeof *figure.heads),
                            .head_count = panels->run_count,
                            .charts = panels->charts,
                            .count = count,
                            .columns = count > 2 * COLUMNS_MAX ? COLUMNS_MAX
                                       : count > 1             ? 2
                                                               : 1,
                            .width = WIDTH,
                            .height = HEIGHT};
    for (int i = 0; i < panels->run_count; i++) {
        figure.heads[i].name = panels->runs[i].name;
        if (panels->run_count > 1)
            figure.heads[i].stroke = figures_style_run(i, panels->run_count);
    }
    figures_draw(out, &figure);
}

static bool write_drawing(struct drawing *drawing) {
    char *svg;
    size_t size;
    FILE *out = format_stream(&svg, &size);
    figures_panels_make(&drawing->panels);
    draw(&drawing->panels, out);
    fclose(out);
    bool is_good = drawing->panels.count > 0;
    if (!is_good)
        format_complain_line(drawing->options->operands[0], 1,
                             "run: no column for these panels; give a file of refdyn sim");
    is_good = is_good && figures_picture_write(drawing->format, svg, drawing->target->file) &&
              system_target_finish(drawing->target);
    free(svg);
    return is_good;
}

static bool write_runs(struct drawing *drawing) {
    const struct options *options = drawing->options;
    char *svg;
    size_t size;
    FILE *out = format_stream(&svg, &size);
    bool is_good = figures_runs_figure_draw(options->operands[0], options_text(options, "panel"), out);
    fclose(out);
    is_good = is_good && figures_picture_write(drawing->format, svg, drawing->target->file) &&
              system_target_finish(drawing->target);
    free(svg);
    return is_good;
}

/* Opens the target and reads all files of single motions. */
static bool open_files(struct drawing *drawing) {
    const struct options *options = drawing->options;
    const char *units = options_text(options, "units");
    for (int i = 0; i < options->operand_count; i++)
        system_targets_spare(&drawing->targets, options->operands[i]);
    if (units)
        system_targets_spare(&drawing->targets, units);
    drawing->target = figures_picture_can_write(drawing->format)
                          ? system_target_open(&drawing->targets, options_text(options, "output"))
                          : NULL;
    bool is_good = drawing->target && (!units || read_units(&drawing->panels, units));
    for (int i = 0; i < options->operand_count && is_good && !drawing->is_of_runs; i++)
        is_good = figures_run_read(&drawing->panels.runs[i], options->operands[i]);
    return is_good;
}

static enum status run_plot(const struct options *options) {
    struct drawing drawing = {.options = options, .panels = {.run_count = options->operand_count}};
    struct panels *panels = &drawing.panels;
    const enum status status = check_usage(&drawing);
    if (status != STATUS_DONE)
        return status;
    panels->runs = format_allocate((size_t)panels->run_count, sizeof *panels->runs);
    const bool is_good =
        open_files(&drawing) && (drawing.is_of_runs ? write_runs(&drawing) : write_drawing(&drawing));
    system_targets_release(&drawing.targets);
    json_decref(panels->units);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

static const char *list_panels(const struct command *command) {
    (void)command;
    return figures_panels_names();
}

static const struct option_rule plot_rules[] = {
    {"panel", "a,b", OPTION_LIST,
     "these panels only: angles, slides, bending-psi, "
     "bending-theta, torsion, others, path, side, height, "
     "velocity, "
     "forces, torques, inputs, phi, psi, energy",
     NULL, list_panels},
    {"units", "FILE.json", OPTION_TEXT, "these panels only: %s", NULL, NULL},
    {.name = NULL}};

const struct command plot_command = {
    .name = "plot",
    .run = run_plot,
    .operands = "RUN...",
    .options = "output! panel units",
    .tables = {plot_rules},
    .output = "FILE.svg",
    .purpose = "figures of motions, as one SVG, PNG or PDF by the suffix of FILE",
    .help = "Coordinates, paths, heights and vertical velocities of points, forces, inputs, courses, "
            "residuals and energy.\n"
            "Colours distinguish quantities; line styles distinguish the runs, which share one set of axes. "
            "rsvg-convert makes\n"
            "PNG and PDF. For RUNS.h5, a file of runs: results over what varied, percentiles over time, the "
            "worst cases; --panel\n"
            "selects items of the file, such as extremes/E_x.\n\n"
            "  refdyn plot rigid.csv flexible.csv -o motion.svg\n"
            "  refdyn plot rigid.csv --panel path,energy --units rigid.json -o path.pdf\n"
            "  refdyn plot runs.h5 --panel extremes/E_x,history/E_x -o runs.svg\n"};
