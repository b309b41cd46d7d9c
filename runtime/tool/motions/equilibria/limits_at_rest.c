/*
 * Compares an equilibrium with the limits of the model. Rates and accelerations are 0 there. The force on a
 * held coordinate, of its row or of its drive, is the one that holds it. Other coordinates have the force of
 * the rows that drive them, and other drives the value of their input.
 */
#include <math.h>
#include <string.h>

#include "runtime/record/record.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/support/format/format.h"

static bool begins_with(const char *text, const char *lead) {
    return strncmp(text, lead, strlen(lead)) == 0;
}

/* The coordinate whose holding force the column is; -1 if there is none. */
static int find_held(const struct scene *scene, const struct equilibrium *equilibrium, const char *column) {
    const struct model *model = &scene->generation.model;
    int coordinate =
        begins_with(column, record_force_lead)
            ? refdyn_find_name(scene->model->coordinates, scene->model->n, column + strlen(record_force_lead))
            : -1;
    for (int i = 0; i < model->drive_count; i++)
        if (strcmp(model->inputs[model->drives[i].input].name, column) == 0)
            coordinate = model->drives[i].coordinate;
    return coordinate >= 0 && equilibrium->held[coordinate] ? coordinate : -1;
}

/* The force of the rows that drive a coordinate, whose gradient by it is 1. */
static double row_force(const struct scene *scene, const struct equilibrium *equilibrium,
                        const char *column) {
    const struct refdyn_statics_options *options = &equilibrium->options;
    double force = 0;
    for (int i = 0; i < options->row_count; i++) {
        const int driven = scene->model->rows[options->rows[i]].driven - 1;
        if (driven >= 0 &&
            strcmp(format_text("%s%s", record_force_lead, scene->model->coordinates[driven].name), column) ==
                0)
            force += equilibrium->result.lambda[i];
    }
    return force;
}

static double course_of(const struct scene *scene, int course) {
    const struct refdyn_workspace *work = &scene->work;
    double *values = format_allocate((size_t)scene->model->course_count, sizeof *values);
    scene->model->course(work->p, work->x, scene->state.t, scene->q, scene->qd, values);
    return values[course];
}

/* The component of a point of this name, "E_x"; false if there is none. */
static bool find_position(const struct scene *scene, const char *column, double *value) {
    const struct refdyn_model *model = scene->model;
    double *r = format_allocate((size_t)model->point_count * 3, sizeof *r);
    for (int i = 0; i < 3 * model->point_count; i++)
        if (strcmp(column, format_text("%s_%c", model->points[i / 3], "xyz"[i % 3])) == 0) {
            model->r(scene->work.p, scene->work.x, scene->state.t, scene->q, scene->qd, r);
            *value = r[i];
            return true;
        }
    return false;
}

/* The value of a column of motions at rest. */
static double value_at_rest(const struct scene *scene, const struct equilibrium *equilibrium,
                            const char *column) {
    const struct refdyn_model *model = scene->model;
    const int coordinate = refdyn_find_name(model->coordinates, model->n, column),
              held = find_held(scene, equilibrium, column),
              input = refdyn_find_name(model->inputs, model->input_count, column);
    double value = 0;
    if (coordinate >= 0)
        return scene->q[coordinate];
    if (held >= 0)
        return equilibrium->hold_force[held];
    for (int i = 0; i < model->course_count; i++)
        if (strcmp(model->courses[i], column) == 0)
            return course_of(scene, i);
    if (input >= 0)
        return scene->work.x[input];
    find_position(scene, column, &value);
    return begins_with(column, record_force_lead) ? row_force(scene, equilibrium, column) : value;
}

static void put_bound(struct document *document, const char *key, double bound) {
    if (isfinite(bound))
        format_put_number(document, key, bound);
    else
        format_put_null(document, key);
}

void equilibria_put_limits(const struct scene *scene, const struct equilibrium *equilibrium,
                           struct document *document) {
    const struct model *model = &scene->generation.model;
    if (model->bound_count == 0)
        return;
    format_put_open(document, "limits", '[');
    for (int i = 0; i < model->bound_count; i++) {
        const struct bound *bound = &model->bounds[i];
        const struct record_bound range = {bound->name, bound->column, bound->from, bound->to};
        const double value = value_at_rest(scene, equilibrium, bound->column);
        const bool is_beyond = record_is_beyond(&range, value), is_above = value > bound->to;
        format_put_open(document, NULL, '{');
        format_put_text(document, "name", bound->name);
        format_put_text(document, "column", bound->column);
        put_bound(document, "from", bound->from);
        put_bound(document, "to", bound->to);
        format_put_number(document, "value", value);
        format_put_number(document, "violation",
                          !is_beyond ? 0
                          : is_above ? value - bound->to
                                     : bound->from - value);
        format_put_close(document, '}');
        if (is_beyond)
            fprintf(stderr, "refdyn: warning: %s exceeds its limits: %.6g; allowed is %s %.6g\n", bound->name,
                    value, is_above ? "at most" : "at least", is_above ? bound->to : bound->from);
    }
    format_put_close(document, ']');
}
