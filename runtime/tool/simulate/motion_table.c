/* The columns of a motion, and the motion as CSV: see motion_table.h. */
#include "simulate/motion_table.h"
#include "text/output.h"

#include <math.h>
#include <string.h>

static const char *const axes[] = {"x", "y", "z"};
static const char *const rates[] = {"", "d", "dd"};
static const char *const point_units[] = {"m", "m/s", "m/s^2"};

/* ---- Names ---- */

const char table_input_lead[] = "input_";

/* The columns so far; a unit is NULL where the model does not say. */
struct columns {
    const char **names, **units;
    int count;
};

/* Columns from `first` on get their kind before their names, all of them, until no column before has one. */
static void settle(struct columns *columns, int first, const char *lead) {
    for (int i = first; i < columns->count;) {
        if (text_index(columns->names[i++], columns->names, first) < 0)
            continue;
        for (int j = first; j < columns->count; j++)
            columns->names[j] = text_format("%s%s", lead, columns->names[j]);
        i = first;
    }
}

static void add_name(struct columns *columns, const char *name, const char *unit) {
    columns->units[columns->count] = unit;
    columns->names[columns->count++] = name;
}

/* One column, with its kind before its name where that is taken. */
static void add_settled(struct columns *columns, const char *lead, const char *name, const char *unit) {
    add_name(columns, name, unit);
    settle(columns, columns->count - 1, lead);
}

static void name_points(const struct refdyn_model *model, struct columns *columns) {
    for (int point = 0; point < model->point_count; point++) {
        const int first = columns->count;
        for (int rate = 0; rate < 3; rate++)
            for (int axis = 0; axis < 3; axis++)
                add_name(columns, text_format("%s_%s%s", model->points[point], axes[axis], rates[rate]),
                         point_units[rate]);
        settle(columns, first, "point_");
    }
}

static void name_residuals(const struct refdyn_model *model, struct columns *columns) {
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level == REFDYN_POSITION)
            add_name(columns, text_format("phi_%d", i + 1), NULL);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level != REFDYN_ACCELERATION)
            add_name(columns, text_format("psi_%d", i + 1), NULL);
}

static bool is_slide(const struct refdyn_name *coordinate) {
    return strcmp(coordinate->unit, "m") == 0;
}

static void name_columns(const struct refdyn_model *model, struct columns *columns) {
    const int most =
        2 + 3 * model->n + 9 * model->point_count + 2 * model->m + model->input_count + model->course_count;
    columns->names = allocate((size_t)most, sizeof *columns->names);
    columns->units = allocate((size_t)most, sizeof *columns->units);
    const struct refdyn_name *q = model->coordinates;
    add_name(columns, "t", "s");
    for (int i = 0; i < model->n; i++)
        add_name(columns, q[i].name, q[i].unit);
    for (int i = 0; i < model->n; i++)
        add_name(columns, text_format("%s_d", q[i].name), is_slide(&q[i]) ? "m/s" : "rad/s");
    name_points(model, columns);
    name_residuals(model, columns);
    add_name(columns, "energy", "J");
    const int forces = columns->count;
    for (int i = 0; i < model->n; i++)
        add_name(columns, text_format("force_%s", q[i].name), is_slide(&q[i]) ? "N" : "N m");
    settle(columns, forces, "force_");
    for (int i = 0; i < model->input_count; i++)
        add_settled(columns, table_input_lead, model->inputs[i].name, model->inputs[i].unit);
    for (int i = 0; i < model->course_count; i++)
        add_settled(columns, "course_", model->courses[i], NULL);
}

void table_start(struct table *table, struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    const size_t n = (size_t)model->n, rows = 3 * (size_t)model->point_count;
    struct columns columns = {.count = 0};
    name_columns(model, &columns);
    *table = (struct table){.integrator = integrator, .names = columns.names, .count = columns.count};
    table->values = allocate((size_t)table->count, sizeof *table->values);
    table->room = allocate(n + rows * (n + 3) + (size_t)model->course_count, sizeof *table->room);
}

void table_put_units(const struct refdyn_model *model, struct document *document) {
    struct columns columns = {.count = 0};
    name_columns(model, &columns);
    put_open(document, "units", '{');
    for (int i = 0; i < columns.count; i++)
        if (columns.units[i])
            put_text(document, columns.names[i], columns.units[i]);
    put_close(document, '}');
}

/* ---- Values ---- */

static void put_value(struct table *table, double value) {
    table->values[table->filled++] = value;
}

static void put_values(struct table *table, const double *values, int count) {
    for (int i = 0; i < count; i++)
        put_value(table, values[i]);
}

/* rdd = C qdd + d */
static void add_accelerations(const struct refdyn_integrator *integrator, const double *C, double *rdd,
                              int rows) {
    int n = integrator->work->n;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < n; j++)
            rdd[i] += C[i * n + j] * integrator->qdd[j];
}

static void put_points(struct table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    int rows = 3 * model->point_count;
    double *r = table->room, *rd = r + rows, *rdd = rd + rows, *C = rdd + rows;
    if (rows == 0)
        return;
    model->r(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, r);
    model->rd(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, rd);
    model->d(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, rdd);
    model->C(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, C);
    add_accelerations(integrator, C, rdd, rows);
    for (int point = 0; point < model->point_count; point++) {
        put_values(table, r + 3 * point, 3);
        put_values(table, rd + 3 * point, 3);
        put_values(table, rdd + 3 * point, 3);
    }
}

static void put_residuals(struct table *table) {
    const struct refdyn_workspace *work = table->integrator->work;
    for (int i = 0; i < work->m; i++)
        if (work->model->rows[i].level == REFDYN_POSITION)
            put_value(table, work->phi[i]);
    for (int i = 0; i < work->m; i++)
        if (work->model->rows[i].level != REFDYN_ACCELERATION)
            put_value(table, work->psi[i]);
}

static void put_courses(struct table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    if (!model->course_count)
        return;
    model->course(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, table->room);
    put_values(table, table->room, model->course_count);
}

void table_fill(struct table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    int n = integrator->work->n;
    double energy[2] = {0, 0};
    table->filled = 0;
    put_value(table, integrator->t);
    put_values(table, integrator->q, n);
    put_values(table, integrator->qd, n);
    put_points(table);
    put_residuals(table);
    refdyn_energies(integrator->work, integrator->t_right, integrator->q, integrator->qd, energy);
    put_value(table, energy[0] + energy[1]);
    refdyn_integrator_force(table->integrator, table->room);
    put_values(table, table->room, n);
    put_values(table, integrator->work->x, integrator->work->model->input_count);
    put_courses(table);
}

/* ---- CSV ---- */

void table_header(const struct table *table, FILE *out) {
    for (int i = 0; i < table->count; i++)
        fprintf(out, "%s%s", i ? "," : "", table->names[i]);
    fputc('\n', out);
}

const char *table_not_finite(const struct table *table) {
    for (int i = 0; i < table->count; i++)
        if (!isfinite(table->values[i]))
            return table->names[i];
    return NULL;
}

void table_row(struct table *table, FILE *out) {
    for (int i = 0; i < table->count; i++) {
        if (i)
            fputc(',', out);
        print_number(out, table->values[i]);
    }
    fputc('\n', out);
}
