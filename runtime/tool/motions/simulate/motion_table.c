/* The columns of a motion: their names and units, their values at the integrator's state, and their output as
 * CSV. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const axes[] = {"x", "y", "z"};
static const char *const rates[] = {"", "d", "dd"};
static const char *const point_units[] = {"m", "m/s", "m/s^2"};

/* ---- Names ---- */

const char simulate_acceleration_lead[] = "acceleration_", simulate_acceleration_ending[] = "_dd";

/* A growing list of columns; a unit is NULL where the model has none. */
struct columns {
    const char **names, **units;
    int count;
    struct motion_part *parts;
    int part_count, part_room;
    const struct refdyn_spatial *spatial; /* NULL if no point has angular columns */
};

/* A group of columns that are computed together. */
struct block {
    void (*name)(const struct refdyn_model *model, struct columns *columns);
    void (*put)(struct table *table);
};

/* Begins a dataset for the next columns; with axis NULL it has only the axis of time, and one column. */
static void begin_part(struct columns *columns, const char *path, const char *axis,
                       const char *const *names) {
    columns->parts = memory_room(&format_memory, columns->parts, columns->part_count, &columns->part_room,
                                 sizeof *columns->parts);
    columns->parts[columns->part_count++] =
        (struct motion_part){.path = path, .axis = axis, .axis_names = names, .first = columns->count};
}

/* Sets the number of columns of each part, which ends where the next begins, and drops empty parts. */
static void end_parts(struct columns *columns) {
    int kept = 0;
    for (int i = 0; i < columns->part_count; i++) {
        struct motion_part part = columns->parts[i];
        const int end = i + 1 < columns->part_count ? columns->parts[i + 1].first : columns->count;
        part.count = end - part.first;
        if (part.count > 0)
            columns->parts[kept++] = part;
    }
    columns->part_count = kept;
}

/* Prefixes all columns from `first` on with their kind until none of their names occurs before. */
static void settle(struct columns *columns, int first, const char *lead) {
    for (int i = first; i < columns->count;) {
        if (text_index(columns->names[i++], columns->names, first) < 0)
            continue;
        for (int j = first; j < columns->count; j++)
            columns->names[j] = format_text("%s%s", lead, columns->names[j]);
        i = first;
    }
}

static void add_name(struct columns *columns, const char *name, const char *unit) {
    columns->units[columns->count] = unit;
    columns->names[columns->count++] = name;
}

/* Adds one column, prefixed with its kind if its name is already used. */
static void add_settled(struct columns *columns, const char *lead, const char *name, const char *unit) {
    add_name(columns, name, unit);
    settle(columns, columns->count - 1, lead);
}

static void name_points(const struct refdyn_model *model, struct columns *columns) {
    for (int point = 0; point < model->point_count; point++) {
        const int first = columns->count;
        for (int rate = 0; rate < 3; rate++) {
            begin_part(columns, format_text("/points/%s/r%s", model->points[point], rates[rate]), "/axis",
                       axes);
            for (int axis = 0; axis < 3; axis++)
                add_name(columns, format_text("%s_%s%s", model->points[point], axes[axis], rates[rate]),
                         point_units[rate]);
        }
        settle(columns, first, "point_");
    }
}

static void name_residuals(const struct refdyn_model *model, struct columns *columns) {
    begin_part(columns, "/phi", "/phi_row", columns->names + columns->count);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level == REFDYN_POSITION)
            add_name(columns, format_text("phi_%d", i + 1), NULL);
    begin_part(columns, "/psi", "/psi_row", columns->names + columns->count);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level != REFDYN_ACCELERATION)
            add_name(columns, format_text("psi_%d", i + 1), NULL);
}

static bool is_slide(const struct refdyn_name *coordinate) {
    return strcmp(coordinate->unit, "m") == 0;
}

static void name_state(const struct refdyn_model *model, struct columns *columns) {
    const struct refdyn_name *q = model->coordinates;
    const char *const *coordinates = columns->names + 1;
    begin_part(columns, "/t", NULL, NULL);
    add_name(columns, "t", "s");
    begin_part(columns, "/q", "/coordinate", coordinates);
    for (int i = 0; i < model->n; i++)
        add_name(columns, q[i].name, q[i].unit);
    begin_part(columns, "/qd", "/coordinate", coordinates);
    for (int i = 0; i < model->n; i++)
        add_name(columns, format_text("%s_d", q[i].name), is_slide(&q[i]) ? "m/s" : "rad/s");
}

static void name_energy(const struct refdyn_model *model, struct columns *columns) {
    (void)model;
    begin_part(columns, "/energy", NULL, NULL);
    add_name(columns, "energy", "J");
}

static void name_forces(const struct refdyn_model *model, struct columns *columns) {
    const int first = columns->count;
    begin_part(columns, "/force", "/coordinate", columns->names + 1);
    for (int i = 0; i < model->n; i++)
        add_name(columns, format_text("force_%s", model->coordinates[i].name),
                 is_slide(&model->coordinates[i]) ? "N" : "N m");
    settle(columns, first, "force_");
}

static void name_inputs(const struct refdyn_model *model, struct columns *columns) {
    for (int i = 0; i < model->input_count; i++) {
        begin_part(columns, format_text("/inputs/%s", model->inputs[i].name), NULL, NULL);
        add_settled(columns, scene_input_lead, model->inputs[i].name, model->inputs[i].unit);
    }
}

static void name_courses(const struct refdyn_model *model, struct columns *columns) {
    for (int i = 0; i < model->course_count; i++) {
        begin_part(columns, format_text("/courses/%s", model->courses[i]), NULL, NULL);
        add_settled(columns, "course_", model->courses[i], NULL);
    }
}

/* These columns come after the others, because files of earlier versions do not have them. */
static void name_accelerations(const struct refdyn_model *model, struct columns *columns) {
    const int first = columns->count;
    begin_part(columns, "/qdd", "/coordinate", columns->names + 1);
    for (int i = 0; i < model->n; i++)
        add_name(columns, format_text("%s%s", model->coordinates[i].name, simulate_acceleration_ending),
                 is_slide(&model->coordinates[i]) ? "m/s^2" : "rad/s^2");
    settle(columns, first, simulate_acceleration_lead);
}

static void name_angular(const struct refdyn_model *model, struct columns *columns) {
    static const char *const units[] = {"rad/s", "rad/s^2"};
    const struct refdyn_spatial *spatial = columns->spatial;
    for (int i = 0; spatial && i < spatial->count; i++) {
        const char *point = model->points[spatial->points[i]];
        const int first = columns->count;
        for (int rate = 0; rate < 2; rate++) {
            begin_part(columns, format_text("/points/%s/w%s", point, rates[rate]), "/axis", axes);
            for (int axis = 0; axis < 3; axis++)
                add_name(columns, format_text("%s_w%s%s", point, axes[axis], rates[rate]), units[rate]);
        }
        settle(columns, first, "point_");
    }
}

static void name_contacts(const struct refdyn_model *model, struct columns *columns) {
    for (int i = refdyn_programme_rows(model); i < model->m; i++) {
        const int first = columns->count;
        begin_part(columns, format_text("/contacts/%s/force", model->rows[i].name), NULL, NULL);
        add_name(columns, format_text("contact_%s", model->rows[i].name), NULL);
        begin_part(columns, format_text("/contacts/%s/rest", model->rows[i].name), NULL, NULL);
        add_name(columns, format_text("rest_%s", model->rows[i].name), "s");
        settle(columns, first, "contact_");
    }
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

static void put_accelerations(struct table *table) {
    put_values(table, table->integrator->qdd, table->integrator->work->n);
}

/* w = J qd, wd = J qdd + Jd_qd, the last three rows of each. */
static void put_angular(struct table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_spatial *spatial = table->spatial;
    const int n = work->n;
    if (!spatial)
        return;
    double *drift = table->room, *J = drift + 6 * spatial->count;
    spatial->Jd_qd(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, drift);
    spatial->J(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, J);
    for (int i = 0; i < spatial->count; i++)
        for (int rate = 0; rate < 2; rate++)
            for (int row = 6 * i + 3; row < 6 * i + 6; row++) {
                double sum = rate ? drift[row] : 0;
                for (int j = 0; j < n; j++)
                    sum += J[row * n + j] * (rate ? integrator->qdd : integrator->qd)[j];
                put_value(table, sum);
            }
}

static void put_state_cells(struct table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    put_value(table, integrator->t);
    put_values(table, integrator->q, integrator->work->n);
    put_values(table, integrator->qd, integrator->work->n);
}

static void put_energy(struct table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    double energy[2] = {0, 0};
    refdyn_energies(integrator->work, integrator->t_right, integrator->q, integrator->qd, energy);
    put_value(table, energy[0] + energy[1]);
}

static void put_forces(struct table *table) {
    refdyn_integrator_force(table->integrator, table->room);
    put_values(table, table->room, table->integrator->work->n);
}

static void put_inputs(struct table *table) {
    const struct refdyn_workspace *work = table->integrator->work;
    put_values(table, work->x, work->model->input_count);
}

/* The force, and the time since which the contact rests; both are 0 for a free contact. */
static void put_contacts(struct table *table) {
    struct refdyn_integrator *integrator = table->integrator;
    if (integrator->contact_count == 0)
        return;
    refdyn_integrator_contact_forces(integrator, table->room);
    for (int k = 0; k < integrator->contact_count; k++) {
        put_value(table, table->room[k]);
        put_value(table,
                  integrator->contact_mode[k] == REFDYN_CONTACT_FREE ? 0 : integrator->contact_since[k]);
    }
}

/* ---- Blocks ---- */

static const struct block blocks[TABLE_BLOCKS] = {
    {name_state, put_state_cells},   {name_points, put_points},
    {name_residuals, put_residuals}, {name_energy, put_energy},
    {name_forces, put_forces},       {name_inputs, put_inputs},
    {name_courses, put_courses},     {name_accelerations, put_accelerations},
    {name_angular, put_angular},     {name_contacts, put_contacts}};

static void name_columns(const struct refdyn_model *model, struct columns *columns, int *ends) {
    const int angular = columns->spatial ? columns->spatial->count : 0;
    const int most = 6 * angular + 2 + 4 * model->n + 9 * model->point_count + 4 * model->m +
                     model->input_count + model->course_count;
    columns->names = format_allocate((size_t)most, sizeof *columns->names);
    columns->units = format_allocate((size_t)most, sizeof *columns->units);
    for (int block = 0; block < TABLE_BLOCKS; block++) {
        blocks[block].name(model, columns);
        ends[block] = columns->count;
    }
    end_parts(columns);
}

void simulate_table_start(struct table *table, struct refdyn_integrator *integrator,
                          const struct refdyn_spatial *spatial) {
    const struct refdyn_model *model = integrator->work->model;
    const size_t n = (size_t)model->n, rows = 3 * (size_t)model->point_count;
    const size_t angular = spatial ? 6 * (size_t)spatial->count : 0;
    struct columns columns = {.spatial = spatial};
    *table = (struct table){.integrator = integrator, .spatial = spatial};
    name_columns(model, &columns, table->ends);
    table->names = columns.names;
    table->units = columns.units;
    table->count = columns.count;
    table->parts = columns.parts;
    table->part_count = columns.part_count;
    table->values = format_allocate((size_t)table->count, sizeof *table->values);
    table->room = format_allocate(
        n + (size_t)model->m + (rows + angular) * (n + 3) + (size_t)model->course_count, sizeof *table->room);
    for (int block = 0; block < TABLE_BLOCKS; block++)
        table->is_wanted[block] = true;
}

void simulate_table_put_units(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                              struct document *document) {
    struct columns columns = {.spatial = spatial};
    int ends[TABLE_BLOCKS];
    name_columns(model, &columns, ends);
    format_put_open(document, "units", '{');
    for (int i = 0; i < columns.count; i++)
        if (columns.units[i])
            format_put_text(document, columns.names[i], columns.units[i]);
    format_put_close(document, '}');
}

void simulate_table_want(struct table *table, const bool *wanted) {
    for (int block = 0, i = 0; block < TABLE_BLOCKS; block++) {
        table->is_wanted[block] = false;
        for (; i < table->ends[block]; i++)
            table->is_wanted[block] |= wanted[i];
    }
}

void simulate_table_fill(struct table *table) {
    table->filled = 0;
    for (int block = 0; block < TABLE_BLOCKS; table->filled = table->ends[block++])
        if (table->is_wanted[block])
            blocks[block].put(table);
}

/* ---- CSV ---- */

void simulate_table_header(const struct table *table, FILE *out) {
    for (int i = 0; i < table->count; i++)
        fprintf(out, "%s%s", i ? "," : "", table->names[i]);
    fputc('\n', out);
}

const char *simulate_table_not_finite(const struct table *table) {
    for (int i = 0; i < table->count; i++)
        if (!isfinite(table->values[i]))
            return table->names[i];
    return NULL;
}

void simulate_table_row(const struct table *table, FILE *out) {
    for (int i = 0; i < table->count; i++) {
        if (i)
            fputc(',', out);
        format_number(out, table->values[i]);
    }
    fputc('\n', out);
}
