/* `refdyn plot`: draws motions over each other, a file of runs, a fit, or a plan, into one file. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/record/record.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- The panels of a figure of motions: which columns each shows, with titles, units and keys ---- */

enum { PANELS_MAX = 32 };

/* The list of charts for some motions. A panel without values makes no chart. */
struct panels {
    struct run *runs; /* the curves point into their rows */
    int run_count;
    json_t *units;  /* units by name of column; NULL if they are known only by the kind of column */
    json_t *limits; /* of the summary; NULL without one */
    bool is_wanted[PANELS_MAX]; /* set by panels_choose */
    struct chart charts[PANELS_MAX];
    int count;
};

enum {
    LARGEST_FORCES = 4, /* curves of forces of a run; more would hide these */
    MOST_INPUTS = 6,    /* bound on the panels of inputs and courses */
    MOST_LIMITS = 6     /* the same for limits */
};

/* Columns below this part of the panel's largest value are numerical noise and are not drawn. */
static const double noise_part = 1e-9;

/* Smaller residuals are rounding of terms near 1 that cancel. */
static const double rounding = 1e-16;

/* A panel, or one panel for each input. */
struct view {
    const char *name, *title, *quantity;
    const char *unit; /* NULL if the kind of column does not determine it */
    bool (*shows)(const struct view *view, const struct run *run, int column);
    int which;    /* the group of coordinates or forces; for points the column, counted from their x */
    bool is_path; /* drawn over the x of the point instead of time */
};

/* ---- Kinds of coordinates: slides, turns, and the turns of elements */

enum group { SLIDES, TURNS, ELEMENT_PSI, ELEMENT_THETA, ELEMENT_PHI, OTHERS };

/* The group by the name LINK_AXIS or LINK_AXIS_ELEMENT. */
static enum group group_of(const char *name) {
    static const char *const turns[] = {"psi", "theta", "phi"};
    const char *end = name + strlen(name);
    const char *digits = end;
    while (digits > name && digits[-1] >= '0' && digits[-1] <= '9')
        digits--;
    bool is_element = digits < end && digits > name && digits[-1] == '_';
    const char *stop = is_element ? digits - 1 : end;
    for (int i = 0; i < 3; i++) {
        size_t length = strlen(turns[i]);
        if ((size_t)(stop - name) > length && stop[-(long)length - 1] == '_' &&
            strncmp(stop - length, turns[i], length) == 0)
            return is_element ? (enum group)(ELEMENT_PSI + i) : TURNS;
    }
    bool is_slide = stop - name > 2 && stop[-2] == '_' && stop[-1] >= 'x' && stop[-1] <= 'z';
    return is_slide ? SLIDES : OTHERS;
}

static bool is_turn(enum group group) {
    return group != SLIDES && group != OTHERS;
}

/* ---- Which columns a panel shows */

/* Elements that do not bend are omitted, since a planar motion has many. */
static bool shows_coordinate(const struct view *view, const struct run *run, int column) {
    const bool is_of_elements = is_turn(view->which) && view->which != TURNS;
    return column >= run->coordinates && column < run->coordinates + run->coordinate_count &&
           group_of(run->columns[column]) == (enum group)view->which &&
           (!is_of_elements || run->largest[column] > 0);
}

static bool shows_point(const struct view *view, const struct run *run, int column) {
    for (int i = 0; i < run->point_count; i++)
        if (run->points[i] + view->which == column)
            return true;
    return false;
}

/* Shows the LARGEST_FORCES largest forces of the kind in the run, without noise; of equal ones, the first. */
static bool shows_force(const struct view *view, const struct run *run, int column) {
    const bool wants_turns = view->which == TURNS;
    int rank = 0;
    if (column < run->forces || column >= run->inputs ||
        is_turn(group_of(run->columns[column])) != wants_turns)
        return false;
    for (int i = run->forces; i < run->inputs; i++) {
        if (is_turn(group_of(run->columns[i])) != wants_turns)
            continue;
        rank +=
            run->largest[i] > run->largest[column] || (run->largest[i] == run->largest[column] && i < column);
        if (run->largest[column] <= noise_part * run->largest[i])
            return false;
    }
    return rank < LARGEST_FORCES;
}

static bool shows_energy(const struct view *view, const struct run *run, int column) {
    (void)view;
    return column == run->energy;
}

static bool shows_name(const struct view *view, const struct run *run, int column) {
    return strcmp(run->columns[column], view->name) == 0;
}

/* Shows the columns whose names begin with the name of the view. */
static bool shows_residual(const struct view *view, const struct run *run, int column) {
    const size_t length = strlen(view->name);
    const char *name = run->columns[column];
    return column < run->energy && strncmp(name, view->name, length) == 0 && name[length] == '_';
}

/* ---- One chart */

/* Finds the key of a column: named after the point or the force, empty for a single column. */
static int find_key(struct chart *chart, const struct view *view, const char *column) {
    const size_t prefix = view->shows == shows_force ? strlen(record_force_lead) : 0;
    size_t length = strlen(column) - prefix;
    if (view->shows == shows_energy || view->shows == shows_name)
        length = 0;
    if (view->shows == shows_point)
        length = (size_t)(strrchr(column, '_') - column);
    return figures_chart_key(chart, column + prefix, length);
}

static void add_lines(struct chart *chart, const struct view *view, const struct run *run, int r) {
    for (int i = 0; i < run->column_count; i++)
        if (view->shows(view, run, i))
            figures_chart_add_curve(chart,
                                    (struct curve){.x = run->kept + (view->is_path ? i - view->which : 0),
                                                   .y = run->kept + i,
                                                   .count = run->kept_count,
                                                   .stride = run->column_count,
                                                   .key = find_key(chart, view, run->columns[i]),
                                                   .run = r});
}

/* "angle [rad]", with the unit of the first curve, which all curves share. */
static const char *y_label(const struct panels *panels, const struct chart *chart, const struct view *view) {
    const struct run *run = &panels->runs[chart->curves[0].run];
    const json_t *given = json_object_get(panels->units, run->columns[chart->curves[0].y - run->kept]);
    const char *unit = given ? json_string_value(given) : view->unit;
    return unit ? format_text("%s [%s]", view->quantity, unit) : view->quantity;
}

/* Adds the chart of a view if it has a curve. */
static void add_chart(struct panels *panels, const struct view *view) {
    const bool is_residual = view->shows == shows_residual;
    struct chart chart = {.title = view->title,
                          .x_label = view->is_path ? "x [m]" : "t [s]",
                          .is_path = view->is_path,
                          .is_equal = view->is_path && view->which == 1, /* the horizontal plane */
                          .is_y_logarithmic = is_residual,
                          .floor = is_residual ? rounding : 0};
    for (int r = 0; r < panels->run_count; r++)
        add_lines(&chart, view, &panels->runs[r], r);
    if (chart.curve_count == 0)
        return;
    chart.y_label = y_label(panels, &chart, view);
    for (int i = 0; i < chart.key_count; i++)
        chart.keys[i].stroke = figures_style_quantity(i, chart.key_count, 0, 1);
    for (int i = 0; i < chart.curve_count; i++) {
        struct curve *curve = &chart.curves[i];
        curve->stroke = figures_style_quantity(curve->key, chart.key_count, curve->run, panels->run_count);
    }
    panels->charts[panels->count++] = chart;
}

/* Adds a separate chart for each input or course of the first run that has any, since their units differ. */
static void add_inputs(struct panels *panels, const struct view *view) {
    const struct run *first = panels->runs;
    for (int r = 0; r < panels->run_count && first->input_count == 0; r++)
        first = &panels->runs[r];
    for (int i = 0; i < first->input_count && i < MOST_INPUTS; i++) {
        const char *name = first->columns[first->inputs + i];
        const struct view one = {.name = name,
                                 .title = format_text("%s: %s", view->title, name),
                                 .quantity = name,
                                 .shows = shows_name};
        add_chart(panels, &one);
    }
}

/* ---- Limits */

/* A bound as a line over the time of the first run, if it is near the values: a distant one would flatten
 * them. The area beyond it is filled. */
static void add_bound(struct chart *chart, const struct run *run, int column, const json_t *given,
                      double sign) {
    const double away_most = 2; /* ranges of the values */
    if (!json_is_number(given) || run->kept_count < 2)
        return;
    const double bound = json_number_value(given);
    const long count = run->kept_count;
    double *t = format_allocate((size_t)count, sizeof *t), *low = format_allocate((size_t)count, sizeof *low),
           *high = format_allocate((size_t)count, sizeof *high), smallest = INFINITY, largest = -INFINITY;
    for (long i = 0; i < count; i++) {
        const double value = run->kept[i * run->column_count + column];
        smallest = fmin(smallest, value);
        largest = fmax(largest, value);
        t[i] = run->kept[i * run->column_count];
        low[i] = sign > 0 ? bound : fmin(bound, value);
        high[i] = sign > 0 ? fmax(bound, value) : bound;
    }
    if (sign * bound > (sign > 0 ? largest : -smallest) + away_most * (largest - smallest))
        return;
    double *line = format_allocate((size_t)count, sizeof *line);
    for (long i = 0; i < count; i++)
        line[i] = bound;
    figures_chart_add_band(
        chart, (struct band){.x = t, .low = low, .high = high, .count = count, .colour = 0xe8b0b0});
    figures_chart_add_curve(
        chart,
        (struct curve){.x = t, .y = line, .count = count, .stride = 1, .stroke = figures_style_limit()});
}

/* Adds a chart for each limit of the summary: its column with the bounds. */
static void add_limits(struct panels *panels, const struct view *view) {
    size_t i;
    json_t *limit;
    json_array_foreach(panels->limits, i, limit) {
        const char *column = json_string_value(json_object_get(limit, "column"));
        const char *name = json_string_value(json_object_get(limit, "name"));
        const int before = panels->count;
        if (i == MOST_LIMITS || !column || !name)
            return;
        const struct view one = {.name = column,
                                 .title = format_text("%s: %s", view->title, name),
                                 .quantity = column,
                                 .shows = shows_name};
        add_chart(panels, &one);
        if (panels->count == before)
            continue;
        const struct run *run = &panels->runs[panels->charts[before].curves[0].run];
        const int place = text_index(column, (const char *const *)run->columns, run->column_count);
        add_bound(&panels->charts[before], run, place, json_object_get(limit, "from"), -1);
        add_bound(&panels->charts[before], run, place, json_object_get(limit, "to"), 1);
    }
}

/* ---- All of them */

static const struct view views[] = {
    {"angles", "Joint angles", "angle", "rad", shows_coordinate, TURNS, false},
    {"slides", "Slides", "position", "m", shows_coordinate, SLIDES, false},
    {"bending-psi", "Bending of the elements, psi", "angle", "rad", shows_coordinate, ELEMENT_PSI, false},
    {"bending-theta", "Bending of the elements, theta", "angle", "rad", shows_coordinate, ELEMENT_THETA,
     false},
    {"torsion", "Torsion of the elements, phi", "angle", "rad", shows_coordinate, ELEMENT_PHI, false},
    {"others", "Further coordinates", "coordinate", NULL, shows_coordinate, OTHERS, false},
    {"path", "Path seen from above", "y", "m", shows_point, 1, true},
    {"side", "Path seen from the side", "z", "m", shows_point, 2, true},
    {"height", "Height", "z", "m", shows_point, 2, false},
    {"velocity", "Vertical velocity", "dz/dt", "m/s", shows_point, 5, false},
    {"forces", "Programme forces, the largest", "force", "N", shows_force, SLIDES, false},
    {"torques", "Programme torques, the largest", "torque", "N m", shows_force, TURNS, false},
    {"inputs", "Input or course", NULL, NULL, NULL, 0, false},
    {"limits", "Limit", NULL, NULL, NULL, 0, false},
    {"phi", "Residuals of position constraints", "|phi|", NULL, shows_residual, 0, false},
    {"psi", "Residuals at velocity level", "|psi|", NULL, shows_residual, 0, false},
    {"energy", "Kinetic and potential energy", "energy", "J", shows_energy, 0, false},
};

enum { VIEW_COUNT = sizeof views / sizeof views[0] };

_Static_assert(VIEW_COUNT - 2 + MOST_INPUTS + MOST_LIMITS <= PANELS_MAX, "PANELS_MAX is too small");

static int find_view(const char *name) {
    int view = 0;
    while (view < VIEW_COUNT && strcmp(views[view].name, name) != 0)
        view++;
    return view;
}

/* Chooses panels by a list of their names, all for NULL. Returns the first unknown name, or NULL. */
static const char *panels_choose(struct panels *panels, const char *names) {
    for (int i = 0; i < VIEW_COUNT; i++)
        panels->is_wanted[i] = !names;
    for (const char **name = options_list(names); *name; name++) {
        const int view = find_view(*name);
        if (view == VIEW_COUNT)
            return *name;
        panels->is_wanted[view] = true;
    }
    return NULL;
}

/* All names as "a, b, c". */
static const char *panels_names(void) {
    struct text text = {.memory = &format_memory};
    for (int i = 0; i < VIEW_COUNT; i++)
        text_add(&text, "%s%s", i ? ", " : "", views[i].name);
    return text.data;
}

/* Makes the charts of the chosen panels from the runs. */
static void panels_make(struct panels *panels) {
    for (int i = 0; i < VIEW_COUNT; i++)
        if (panels->is_wanted[i])
            (views[i].shows                         ? add_chart
             : strcmp(views[i].name, "limits") == 0 ? add_limits
                                                    : add_inputs)(panels, &views[i]);
}

/* ---- The command ---- */

struct drawing {
    const struct options *options;
    const struct picture_format *format;
    struct panels panels;
    struct targets targets;
    struct target *target;
    bool is_of_runs;   /* the only operand is a file of runs */
    const char *found; /* "fit" or "plan": the only operand is a FIT.json or a PLAN.json; else NULL */
};

static bool is_file_of_runs(const char *path) {
    return figures_run_is_hdf5(path) && !hdf5_motion_is_in(path);
}

static enum status check_runs(struct drawing *drawing) {
    const struct options *options = drawing->options;
    for (int i = 0; i < options->operand_count; i++) {
        drawing->is_of_runs = is_file_of_runs(options->operands[i]);
        if (drawing->is_of_runs && options->operand_count > 1)
            return options_usage_error(options->command, "%s: a file of runs must be the only operand",
                                       options->operands[i]);
    }
    if (drawing->is_of_runs && options_text(options, "units"))
        return options_usage_error(options->command, "--units: a file of runs has its own units; omit it");
    return STATUS_DONE;
}

static enum status check_found(struct drawing *drawing) {
    static const char *const unused[] = {"panel", "units"};
    const struct options *options = drawing->options;
    for (int i = 0; i < options->operand_count; i++)
        if (text_ends_with(options->operands[i], ".json")) {
            drawing->found = figures_is_plan(options->operands[i]) ? "plan" : "fit";
            if (options->operand_count > 1)
                return options_usage_error(options->command, "%s: a %s must be the only operand",
                                           options->operands[i], drawing->found);
        }
    for (int i = 0; i < 2 && drawing->found; i++)
        if (options_text(options, unused[i]))
            return options_usage_error(options->command, "--%s: a %s has its own %s; omit it", unused[i],
                                       drawing->found, i == 0 ? "panels" : "units");
    return STATUS_DONE;
}

static enum status check_usage(struct drawing *drawing) {
    const struct options *options = drawing->options;
    const char *output = options_text(options, "output");
    enum status status = check_runs(drawing);
    if (status == STATUS_DONE)
        status = check_found(drawing);
    const char *unknown =
        drawing->is_of_runs ? NULL : panels_choose(&drawing->panels, options_text(options, "panel"));
    drawing->format = figures_picture_format_of(output);
    if (status == STATUS_DONE && unknown)
        return options_usage_error(options->command, "--panel: '%s' is not one of %s", unknown,
                                   panels_names());
    if (status == STATUS_DONE && !drawing->format)
        return options_usage_error(options->command, "-o: '%s' must end in .svg, .png or .pdf", output);
    return status;
}

/* Reads the object "units" of a summary. */
static bool read_units(struct panels *panels, const char *path) {
    char *text = format_read_file(path, "units");
    json_error_t error;
    json_t *root = text ? json_loads(text, JSON_REJECT_DUPLICATES, &error) : NULL;
    panels->units = json_incref(json_object_get(root, "units"));
    panels->limits = json_incref(json_object_get(root, "limits"));
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
    panels_make(&drawing->panels);
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

/* A file of runs, a fit, or a plan. */
static bool write_results(struct drawing *drawing) {
    const struct options *options = drawing->options;
    char *svg;
    size_t size;
    FILE *out = format_stream(&svg, &size);
    const char *path = options->operands[0];
    bool is_good = !drawing->found ? figures_draw_runs(path, options_text(options, "panel"), out)
                   : strcmp(drawing->found, "plan") == 0 ? figures_draw_plan(path, out)
                                                         : figures_draw_fit(path, out);
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
    for (int i = 0; i < options->operand_count && is_good && !drawing->is_of_runs && !drawing->found; i++)
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
        open_files(&drawing) &&
        (drawing.is_of_runs || drawing.found ? write_results(&drawing) : write_drawing(&drawing));
    system_targets_release(&drawing.targets);
    json_decref(panels->units);
    json_decref(panels->limits);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

static const char *list_panels(const struct command *command) {
    (void)command;
    return panels_names();
}

static const struct option_rule plot_rules[] = {
    {"panel", "a,b", OPTION_LIST, "these panels only: %s", NULL, list_panels},
    {"units", "FILE.json", OPTION_TEXT, "units of columns and limits, from the summary of refdyn sim", NULL,
     NULL},
    {.name = NULL}};

const struct command plot_command = {
    .name = "plot",
    .run = run_plot,
    .operands = "RUN...",
    .options = "output! panel units",
    .tables = {plot_rules},
    .output = "FILE.svg",
    .purpose = "figures of motions, as one SVG, PNG or PDF by the suffix of FILE",
    .help =
        "Coordinates, paths, heights and vertical velocities of points, forces, inputs, courses, "
        "residuals and energy.\n"
        "Colours distinguish quantities; line styles distinguish the runs, which share one set of axes. "
        "rsvg-convert makes\n"
        "PNG and PDF. For RUNS.h5, a file of runs: results over what varied, percentiles over time, the "
        "worst cases; --panel\n"
        "selects items of the file, such as extremes/E_x. For FIT.json: data and model with two standard "
        "deviations of the\n"
        "noise, residuals, and their autocorrelation with the 95 % band of white noise. For PLAN.json: its "
        "limits\n"
        "over the motion.\n\n"
        "  refdyn plot rigid.csv flexible.csv -o motion.svg\n"
        "  refdyn plot rigid.csv --panel path,energy --units rigid.json -o path.pdf\n"
        "  refdyn plot runs.h5 --panel extremes/E_x,history/E_x -o runs.svg\n"
        "  refdyn plot fit.json -o fit.svg\n"
        "  refdyn plot plan.json -o plan.svg\n"};
