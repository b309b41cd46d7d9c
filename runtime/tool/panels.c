/* The panels of a figure: see panels.h. */
#include "panels.h"
#include "gnuplot.h"
#include "output.h"

#include <stdlib.h>
#include <string.h>

enum {
    FORCE_KEYS = 4, /* a run's largest forces have names */
    MOST_INPUTS = 6 /* panels of inputs and courses */
};

static const double plain_width = 1.6, thin_width = 0.8;

/* Columns below this part of the panel's largest value are noise of the solution, and are not drawn. */
static const double noise_part = 1e-9;

static struct panel *add_panel(struct panels *panels, const char *title, const char *y_label) {
    struct panel *panel = &panels->list[panels->count++];
    *panel = (struct panel){.title = title, .x_label = "t [s]", .y_label = y_label};
    return panel;
}

/* The panel goes when nothing is in it. */
static void end_panel(struct panels *panels) {
    if (panels->list[panels->count - 1].count == 0)
        panels->count--;
}

static void add_curve(struct panel *panel, struct curve curve) {
    if (panel->count == panel->capacity) {
        int capacity = panel->capacity ? 2 * panel->capacity : 8;
        struct curve *curves = allocate((size_t)capacity, sizeof *curves);
        if (panel->count)
            memcpy(curves, panel->curves, (size_t)panel->count * sizeof *curves);
        free(panel->curves);
        panel->curves = curves;
        panel->capacity = capacity;
    }
    panel->curves[panel->count++] = curve;
}

/* A curve of column y over time, named `name` in the key; thin and nameless once the key is full. */
static void add_named(struct panel *panel, int run, int y, const char *name) {
    int place = 0;
    while (place < panel->name_count && strcmp(panel->names[place], name) != 0)
        place++;
    bool is_new = place == panel->name_count, is_full = place == KEYS_MAX;
    if (is_new && !is_full)
        panel->names[panel->name_count++] = name;
    add_curve(panel, (struct curve){.run = run,
                                    .y = y,
                                    .colour = is_full ? COLOUR_COUNT - 2 : place,
                                    .width = is_full ? thin_width : plain_width,
                                    .title = is_new && !is_full ? name : NULL});
}

static const char *keep_text(struct panels *panels, char *text) {
    if (panels->text_count == panels->text_room) {
        panels->text_room = 2 * panels->text_room + 16;
        char **texts = allocate((size_t)panels->text_room, sizeof *texts);
        if (panels->text_count)
            memcpy(texts, panels->texts, (size_t)panels->text_count * sizeof *texts);
        free(panels->texts);
        panels->texts = texts;
    }
    return panels->texts[panels->text_count++] = text;
}

/* ---- Coordinates: slides, turns, and the turns of elements by kind */

enum group { SLIDES, TURNS, ELEMENT_PSI, ELEMENT_THETA, ELEMENT_PHI, OTHERS };

/* From the name, LINK_AXIS or LINK_AXIS_ELEMENT. */
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

/* Those of elements that do not bend are left out: a planar motion has many. */
static bool is_of_elements(enum group group) {
    return group == ELEMENT_PSI || group == ELEMENT_THETA || group == ELEMENT_PHI;
}

static void add_coordinates(struct panels *panels, enum group group, const char *title, const char *y_label) {
    struct panel *panel = add_panel(panels, title, y_label);
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = run->coordinates; i < run->coordinates + run->coordinate_count; i++)
            if (group_of(run->columns[i]) == group && (!is_of_elements(group) || run->largest[i] > 0))
                add_named(panel, r, i, run->columns[i]);
    }
    end_panel(panels);
}

/* ---- Points */

static const char *point_title(struct panels *panels, const struct run *run, int point) {
    const char *name = run->columns[run->points[point]];
    return keep_text(panels, text_format("%.*s", (int)strlen(name) - 2, name));
}

/* Column `y` over column `x` of each point, counted from its x; x -1: over time. */
static struct panel *add_points(struct panels *panels, const char *title, int x, int y, const char *y_label) {
    struct panel *panel = add_panel(panels, title, y_label);
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = 0; i < run->point_count; i++) {
            int first = run->points[i];
            bool is_only = run->point_count == 1;
            add_curve(panel, (struct curve){.run = r,
                                            .x = x < 0 ? 0 : first + x,
                                            .y = first + y,
                                            .colour = is_only ? -1 : i % COLOUR_COUNT,
                                            .width = plain_width,
                                            .title = is_only || r > 0 ? NULL : point_title(panels, run, i)});
        }
    }
    return panel;
}

static void add_paths(struct panels *panels) {
    struct panel *path = add_points(panels, "Path of the end-effector, seen from above", 0, 1, "y [m]");
    path->x_label = "x [m]";
    path->is_square = true;
    end_panel(panels);
    path = add_points(panels, "Path of the end-effector, seen from the side", 0, 2, "z [m]");
    path->x_label = "x [m]";
    end_panel(panels);
    add_points(panels, "Height of the end-effector", -1, 2, "z [m]");
    end_panel(panels);
    add_points(panels, "Vertical velocity of the end-effector", -1, 5, "dz/dt [m/s]");
    end_panel(panels);
}

/* ---- Courses, residuals, energy */

static double largest_of(const struct run *run, int first, int count) {
    double largest = 0;
    for (int i = first; i < first + count; i++)
        if (run->largest[i] > largest)
            largest = run->largest[i];
    return largest;
}

/* How many of the columns are larger than this one, the earlier first among equals. */
static int rank_of(const struct run *run, int column, int first, int count) {
    int rank = 0;
    for (int i = first; i < first + count; i++)
        rank +=
            run->largest[i] > run->largest[column] || (run->largest[i] == run->largest[column] && i < column);
    return rank;
}

/* The largest columns, by name without its prefix; the rest would only drown them. */
static void add_columns(struct panel *panel, const struct run *run, int r, int first, int count,
                        size_t prefix) {
    double least = noise_part * largest_of(run, first, count);
    for (int i = first; i < first + count; i++)
        if (run->largest[i] > least && rank_of(run, i, first, count) < FORCE_KEYS)
            add_named(panel, r, i, run->columns[i] + prefix);
}

static void add_forces(struct panels *panels) {
    struct panel *panel = add_panel(panels, "Programme forces, the largest", "force [N], torque [N m]");
    for (int r = 0; r < panels->run_count; r++)
        add_columns(panel, &panels->runs[r], r, panels->runs[r].forces, panels->runs[r].force_count,
                    strlen("force_"));
    end_panel(panels);
}

/* One panel for each input or course of the first run that has any: their units differ. */
static void add_inputs(struct panels *panels) {
    const struct run *first = panels->runs;
    for (int r = 0; r < panels->run_count && first->input_count == 0; r++)
        first = &panels->runs[r];
    for (int i = 0; i < first->input_count && i < MOST_INPUTS; i++) {
        const char *name = first->columns[first->inputs + i];
        struct panel *panel =
            add_panel(panels, keep_text(panels, text_format("Input or course: %s", name)), name);
        for (int r = 0; r < panels->run_count; r++) {
            const int column = run_column(&panels->runs[r], name);
            if (column >= 0)
                add_curve(panel, (struct curve){.run = r, .y = column, .colour = -1, .width = plain_width});
        }
        end_panel(panels);
    }
}

static void add_residuals(struct panels *panels, const char *prefix, const char *title, const char *y_label) {
    struct panel *panel = add_panel(panels, title, y_label);
    panel->is_logarithmic = true;
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = 0; i < run->energy; i++)
            if (strncmp(run->columns[i], prefix, strlen(prefix)) == 0 && run->largest[i] > 0)
                add_named(panel, r, i, run->columns[i]);
    }
    end_panel(panels);
}

static void add_energy(struct panels *panels) {
    struct panel *panel = add_panel(panels, "Kinetic and potential energy", "energy [J]");
    for (int r = 0; r < panels->run_count; r++)
        if (panels->runs[r].energy >= 0)
            add_curve(panel, (struct curve){
                                 .run = r, .y = panels->runs[r].energy, .colour = -1, .width = plain_width});
    end_panel(panels);
}

void panels_make(struct panels *panels, const struct run *runs, int run_count) {
    *panels = (struct panels){.runs = runs, .run_count = run_count};
    add_coordinates(panels, TURNS, "Joint angles", "angle [rad]");
    add_coordinates(panels, SLIDES, "Slides", "position [m]");
    add_coordinates(panels, ELEMENT_PSI, "Bending of the elements, psi", "angle [rad]");
    add_coordinates(panels, ELEMENT_THETA, "Bending of the elements, theta", "angle [rad]");
    add_coordinates(panels, ELEMENT_PHI, "Torsion of the elements, phi", "angle [rad]");
    add_coordinates(panels, OTHERS, "Further coordinates", "[m], [rad]");
    add_paths(panels);
    add_forces(panels);
    add_inputs(panels);
    add_residuals(panels, "phi_", "Residuals of position constraints", "|phi|");
    add_residuals(panels, "psi_", "Residuals at velocity level", "|psi|");
    add_energy(panels);
}

void panels_release(struct panels *panels) {
    for (int i = 0; i < panels->count; i++)
        free(panels->list[i].curves);
    for (int i = 0; i < panels->text_count; i++)
        free(panels->texts[i]);
    free(panels->texts);
}
