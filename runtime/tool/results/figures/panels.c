/* The panels of a figure of motions: which columns each shows, with titles, units and keys. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/format/format.h"

#include <string.h>

enum {
    LARGEST_FORCES = 4, /* of a run; more curves would hide these */
    MOST_INPUTS = 6     /* panels of inputs and courses */
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
    const size_t prefix = view->shows == shows_force ? strlen("force_") : 0;
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
    {"phi", "Residuals of position constraints", "|phi|", NULL, shows_residual, 0, false},
    {"psi", "Residuals at velocity level", "|psi|", NULL, shows_residual, 0, false},
    {"energy", "Kinetic and potential energy", "energy", "J", shows_energy, 0, false},
};

enum { VIEW_COUNT = sizeof views / sizeof views[0] };

_Static_assert(VIEW_COUNT - 1 + MOST_INPUTS <= PANELS_MAX, "PANELS_MAX is too small");

static int find_view(const char *name) {
    int view = 0;
    while (view < VIEW_COUNT && strcmp(views[view].name, name) != 0)
        view++;
    return view;
}

const char *figures_panels_choose(struct panels *panels, const char *names) {
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

const char *figures_panels_names(void) {
    struct text text = {.memory = &format_memory};
    for (int i = 0; i < VIEW_COUNT; i++)
        text_add(&text, "%s%s", i ? ", " : "", views[i].name);
    return text.data;
}

void figures_panels_make(struct panels *panels) {
    for (int i = 0; i < VIEW_COUNT; i++)
        if (panels->is_wanted[i])
            (views[i].shows ? add_chart : add_inputs)(panels, &views[i]);
}
