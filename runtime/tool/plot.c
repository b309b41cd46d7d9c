/* `refdyn plot`: the figures of some motions over each other, in one file. */
#include "commands.h"
#include "csv.h"
#include "output.h"
#include "panels.h"
#include "picture.h"
#include "target.h"

#include <stdlib.h>

/* What a call draws. */
struct drawing {
    const struct picture_format *format;
    struct targets targets;
    struct target *target;
    json_t *units;
    struct run *runs;
    int run_count;
};

static enum status check_usage(const struct options *options) {
    char *unknown = panels_unknown(options->panel), *names = panels_names();
    enum status status = STATUS_DONE;
    if (unknown)
        status = usage_error(options->command, "--panel: '%s' is none of %s", unknown, names);
    else if (!picture_format_of(options->output))
        status = usage_error(options->command, "-o: '%s' ends in none of .svg, .png, .pdf", options->output);
    free(unknown);
    free(names);
    return status;
}

/* The object "units" of a summary. */
static bool read_units(struct drawing *drawing, const char *path) {
    char *text = read_text(path, "units");
    json_error_t error;
    json_t *root = text ? json_loads(text, JSON_REJECT_DUPLICATES, &error) : NULL;
    drawing->units = json_incref(json_object_get(root, "units"));
    const bool is_good = json_is_object(drawing->units);
    if (text && !is_good) {
        char *said = text_format("units: %s, a summary of refdyn sim is needed",
                                 root ? "no object 'units'" : error.text);
        complain_line(path, root ? 1 : error.line, said);
        free(said);
    }
    json_decref(root);
    free(text);
    return is_good;
}

/* Heads are the names of the runs. */
static void draw(const struct drawing *drawing, const struct panels *panels, FILE *out) {
    enum { WIDTH = 480, HEIGHT = 300, COLUMNS_MAX = 3 };
    const int count = panels->count;
    struct figure figure = {.heads = allocate((size_t)drawing->run_count, sizeof *figure.heads),
                            .head_count = drawing->run_count,
                            .charts = panels->charts,
                            .count = count,
                            .columns = count > 2 * COLUMNS_MAX ? COLUMNS_MAX
                                       : count > 1             ? 2
                                                               : 1,
                            .width = WIDTH,
                            .height = HEIGHT};
    for (int i = 0; i < drawing->run_count; i++) {
        figure.heads[i].name = text_format("%s", drawing->runs[i].name);
        if (drawing->run_count > 1)
            figure.heads[i].stroke = style_run(i, drawing->run_count);
    }
    figure_draw(out, &figure);
    for (int i = 0; i < drawing->run_count; i++)
        free(figure.heads[i].name);
    free(figure.heads);
}

static bool write_drawing(const struct drawing *drawing, const struct panels *panels) {
    char *svg;
    size_t size;
    FILE *out = text_stream(&svg, &size);
    draw(drawing, panels, out);
    fclose(out);
    const bool is_good =
        picture_write(drawing->format, svg, drawing->target->file) && target_finish(drawing->target);
    free(svg);
    return is_good;
}

static bool plot(const struct drawing *drawing, const char *names) {
    struct panels panels = {.runs = drawing->runs, .run_count = drawing->run_count, .units = drawing->units};
    panels_make(&panels, names);
    if (panels.count == 0)
        complain_line(drawing->runs[0].path, 1,
                      names ? "run: no column that these panels draw, a CSV file of refdyn sim is needed"
                            : "run: no column that plot draws, a CSV file of refdyn sim is needed");
    const bool is_good = panels.count > 0 && write_drawing(drawing, &panels);
    panels_release(&panels);
    return is_good;
}

/* The target is opened before the work. */
static bool open_files(struct drawing *drawing, const struct options *options) {
    for (int i = 0; i < options->operand_count; i++)
        targets_spare(&drawing->targets, options->operands[i]);
    if (options->units)
        targets_spare(&drawing->targets, options->units);
    if (!picture_can_write(drawing->format))
        return false;
    drawing->target = target_open(&drawing->targets, options->output);
    return drawing->target && (!options->units || read_units(drawing, options->units));
}

enum status run_plot(const struct options *options) {
    struct drawing drawing = {.run_count = options->operand_count};
    enum status status = check_usage(options);
    if (status != STATUS_DONE)
        return status;
    drawing.format = picture_format_of(options->output);
    drawing.runs = allocate((size_t)drawing.run_count, sizeof *drawing.runs);
    bool is_good = open_files(&drawing, options);
    for (int i = 0; i < drawing.run_count && is_good; i++)
        is_good = run_read(&drawing.runs[i], options->operands[i]);
    is_good = is_good && plot(&drawing, options->panel);
    targets_release(&drawing.targets);
    json_decref(drawing.units);
    for (int i = 0; i < drawing.run_count; i++)
        run_release(&drawing.runs[i]);
    free(drawing.runs);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}
