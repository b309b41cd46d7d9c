/* The panels of a figure: see panels.h. */
#include "figures/panels.h"
#include "command_line/options.h"
#include "text/output.h"

#include <string.h>

enum {
    LARGEST_FORCES = 4, /* of a run, the others would drown them */
    MOST_INPUTS = 6     /* panels of inputs and courses */
};

/* Columns below this part of the panel's largest value are noise of the solution, and are not drawn. */
static const double noise_part = 1e-9;

/* Residuals below are rounding: terms of a size near 1 cancel. */
static const double rounding = 1e-16;

/* One panel, or one for each input. */
struct view {
    const char *name, *title, *quantity;
    const char *unit; /* NULL: not known by the kind of column */
    void (*add)(struct panels *panels, const struct view *view);
    int which, over; /* of coordinates and forces a group; of points columns y and x, counted from their x */
};

/* ---- One chart in the making */

static struct chart *begin(struct panels *panels) {
    struct chart *chart = &panels->charts[panels->count++];
    *chart = (struct chart){.floor = 0};
    return chart;
}

/* Column y over column x of a run, as the quantity that the first letters of `name` tell. */
static void add_line(struct chart *chart, const struct panels *panels, int r, int x, int y, const char *name,
                     size_t length) {
    const struct run *run = &panels->runs[r];
    chart_add_curve(chart, (struct curve){.x = run->kept + x,
                                          .y = run->kept + y,
                                          .count = run->kept_count,
                                          .stride = run->column_count,
                                          .key = chart_key(chart, name, length),
                                          .run = r});
}

/* "angle [rad]": the unit of the first curve, which all have. */
static const char *y_label(const struct panels *panels, const struct chart *chart, const struct view *view,
                           const char *quantity) {
    const struct run *run = &panels->runs[chart->curves[0].run];
    const json_t *given = json_object_get(panels->units, run->columns[chart->curves[0].y - run->kept]);
    const char *unit = given ? json_string_value(given) : view->unit;
    return unit ? text_format("%s [%s]", quantity, unit) : quantity;
}

/* The chart goes, and the result is false, when nothing is in it. */
static bool end(struct panels *panels, const struct view *view, const char *title, const char *quantity) {
    struct chart *chart = &panels->charts[panels->count - 1];
    if (chart->curve_count == 0) {
        panels->count--;
        return false;
    }
    chart->title = title;
    chart->x_label = "t [s]";
    chart->y_label = y_label(panels, chart, view, quantity);
    for (int i = 0; i < chart->key_count; i++)
        chart->keys[i].stroke = style_quantity(i, chart->key_count, 0, 1);
    for (int i = 0; i < chart->curve_count; i++) {
        struct curve *curve = &chart->curves[i];
        curve->stroke = style_quantity(curve->key, chart->key_count, curve->run, panels->run_count);
    }
    return true;
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

static bool is_turn(enum group group) {
    return group != SLIDES && group != OTHERS;
}

/* Elements that do not bend are left out: a planar motion has many. */
static void add_coordinates(struct panels *panels, const struct view *view) {
    const bool is_of_elements = is_turn(view->which) && view->which != TURNS;
    struct chart *chart = begin(panels);
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = run->coordinates; i < run->coordinates + run->coordinate_count; i++)
            if (group_of(run->columns[i]) == (enum group)view->which &&
                (!is_of_elements || run->largest[i] > 0))
                add_line(chart, panels, r, 0, i, run->columns[i], strlen(run->columns[i]));
    }
    end(panels, view, view->title, view->quantity);
}

/* ---- Points */

enum { OVER_TIME = -1 };

static void add_points(struct panels *panels, const struct view *view) {
    struct chart *chart = begin(panels);
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = 0; i < run->point_count; i++) {
            const int first = run->points[i];
            add_line(chart, panels, r, view->over == OVER_TIME ? 0 : first + view->over, first + view->which,
                     run->columns[first], strlen(run->columns[first]) - strlen("_x"));
        }
    }
    if (!end(panels, view, view->title, view->quantity) || view->over == OVER_TIME)
        return;
    chart->x_label = "x [m]";
    chart->is_path = true;
    chart->is_equal = view->which == 1; /* in the horizontal plane */
}

/* ---- Programme forces, inputs and courses, residuals, energy */

/* How many forces of the same kind in the run are larger than that of column `column`, the earlier first
 * among equals, or far too many where it is noise beside them. */
static int rank_of(const struct run *run, int column, bool wants_turns) {
    int rank = 0;
    for (int i = run->forces; i < run->forces + run->force_count; i++) {
        if (is_turn(group_of(run->columns[i])) != wants_turns)
            continue;
        rank +=
            run->largest[i] > run->largest[column] || (run->largest[i] == run->largest[column] && i < column);
        if (run->largest[column] <= noise_part * run->largest[i])
            return LARGEST_FORCES;
    }
    return rank;
}

static void add_forces(struct panels *panels, const struct view *view) {
    const size_t prefix = strlen("force_");
    const bool wants_turns = view->which == TURNS;
    struct chart *chart = begin(panels);
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = run->forces; i < run->forces + run->force_count; i++)
            if (is_turn(group_of(run->columns[i])) == wants_turns &&
                rank_of(run, i, wants_turns) < LARGEST_FORCES)
                add_line(chart, panels, r, 0, i, run->columns[i] + prefix, strlen(run->columns[i] + prefix));
    }
    end(panels, view, view->title, view->quantity);
}

static void add_column(struct panels *panels, const struct view *view, const char *name, const char *title,
                       const char *quantity) {
    struct chart *chart = begin(panels);
    for (int r = 0; r < panels->run_count; r++) {
        const int column = run_column(&panels->runs[r], name);
        if (column >= 0)
            add_line(chart, panels, r, 0, column, "", 0);
    }
    end(panels, view, title, quantity);
}

/* One panel for each input or course of the first run that has any: their units differ. */
static void add_inputs(struct panels *panels, const struct view *view) {
    const struct run *first = panels->runs;
    for (int r = 0; r < panels->run_count && first->input_count == 0; r++)
        first = &panels->runs[r];
    for (int i = 0; i < first->input_count && i < MOST_INPUTS; i++) {
        const char *name = first->columns[first->inputs + i];
        add_column(panels, view, name, text_format("%s: %s", view->title, name), name);
    }
}

static void add_energy(struct panels *panels, const struct view *view) {
    add_column(panels, view, view->name, view->title, view->quantity);
}

/* The columns whose names begin with that of the view. */
static void add_residuals(struct panels *panels, const struct view *view) {
    const size_t length = strlen(view->name);
    struct chart *chart = begin(panels);
    for (int r = 0; r < panels->run_count; r++) {
        const struct run *run = &panels->runs[r];
        for (int i = 0; i < run->energy; i++)
            if (strncmp(run->columns[i], view->name, length) == 0 && run->columns[i][length] == '_')
                add_line(chart, panels, r, 0, i, run->columns[i], strlen(run->columns[i]));
    }
    if (!end(panels, view, view->title, view->quantity))
        return;
    chart->is_y_logarithmic = true;
    chart->floor = rounding;
}

/* ---- All of them */

static const struct view views[] = {
    {"angles", "Joint angles", "angle", "rad", add_coordinates, TURNS, 0},
    {"slides", "Slides", "position", "m", add_coordinates, SLIDES, 0},
    {"bending-psi", "Bending of the elements, psi", "angle", "rad", add_coordinates, ELEMENT_PSI, 0},
    {"bending-theta", "Bending of the elements, theta", "angle", "rad", add_coordinates, ELEMENT_THETA, 0},
    {"torsion", "Torsion of the elements, phi", "angle", "rad", add_coordinates, ELEMENT_PHI, 0},
    {"others", "Further coordinates", "coordinate", NULL, add_coordinates, OTHERS, 0},
    {"path", "Path seen from above", "y", "m", add_points, 1, 0},
    {"side", "Path seen from the side", "z", "m", add_points, 2, 0},
    {"height", "Height", "z", "m", add_points, 2, OVER_TIME},
    {"velocity", "Vertical velocity", "dz/dt", "m/s", add_points, 5, OVER_TIME},
    {"forces", "Programme forces, the largest", "force", "N", add_forces, SLIDES, 0},
    {"torques", "Programme torques, the largest", "torque", "N m", add_forces, TURNS, 0},
    {"inputs", "Input or course", NULL, NULL, add_inputs, 0, 0},
    {"phi", "Residuals of position constraints", "|phi|", NULL, add_residuals, 0, 0},
    {"psi", "Residuals at velocity level", "|psi|", NULL, add_residuals, 0, 0},
    {"energy", "Kinetic and potential energy", "energy", "J", add_energy, 0, 0},
};

enum { VIEW_COUNT = sizeof views / sizeof views[0] };

_Static_assert(VIEW_COUNT - 1 + MOST_INPUTS <= PANELS_MAX, "room for all panels");

static int find_view(const char *name) {
    int view = 0;
    while (view < VIEW_COUNT && strcmp(views[view].name, name) != 0)
        view++;
    return view;
}

const char *panels_choose(struct panels *panels, const char *names) {
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

const char *panels_names(void) {
    struct text text = {.memory = &program_memory};
    for (int i = 0; i < VIEW_COUNT; i++)
        text_add(&text, "%s%s", i ? ", " : "", views[i].name);
    return text.data;
}

void panels_make(struct panels *panels) {
    for (int i = 0; i < VIEW_COUNT; i++)
        if (panels->is_wanted[i])
            views[i].add(panels, &views[i]);
}
