/* The columns of a motion: their names and units, and their values at the integrator's state. */
#include "runtime/record/record.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static const char *const axes[] = {"x", "y", "z"};
static const char *const rates[] = {"", "d", "dd"};
static const char *const point_units[] = {"m", "m/s", "m/s^2"};

/* ---- Names ---- */

const char record_acceleration_lead[] = "acceleration_", record_acceleration_ending[] = "_dd";
const char record_input_lead[] = "input_";
const char record_force_lead[] = "force_";
static const char multiplier_lead[] = "lambda_";

/* A growing list of columns; a unit is NULL where the model has none. */
struct columns {
    const char **names, **units;
    int count;
    struct record_part *parts;
    int part_count;
    struct record_memory memory;
    const struct refdyn_spatial *spatial; /* NULL if no point has angular columns */
};

/* What the values of a block need besides coordinates and rates: the last one, multipliers of rows. */
enum needs { NEEDS_STATE, NEEDS_ACCELERATIONS, NEEDS_ROWS };

/* A group of columns that are computed together. */
struct block {
    void (*name)(const struct refdyn_model *model, struct columns *columns);
    void (*put)(struct record_table *table);
    enum needs needs;
    bool may_be_open; /* NaN where rows depend on each other so that a value is not unique */
};

static char *format_name(const struct columns *columns, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static char *format_name(const struct columns *columns, const char *format, ...) {
    va_list list, again;
    va_start(list, format);
    va_copy(again, list);
    const size_t size = (size_t)vsnprintf(NULL, 0, format, again) + 1;
    va_end(again);
    char *text = columns->memory.get(columns->memory.context, size);
    vsnprintf(text, size, format, list);
    va_end(list);
    return text;
}

/* Begins a dataset for the next columns; with axis NULL it has only the axis of time, and one column. */
static void begin_part(struct columns *columns, const char *path, const char *axis,
                       const char *const *names) {
    columns->parts[columns->part_count++] =
        (struct record_part){.path = path, .axis = axis, .axis_names = names, .first = columns->count};
}

/* Sets the number of columns of each part, which ends where the next begins, and drops empty parts. */
static void end_parts(struct columns *columns) {
    int kept = 0;
    for (int i = 0; i < columns->part_count; i++) {
        struct record_part part = columns->parts[i];
        const int end = i + 1 < columns->part_count ? columns->parts[i + 1].first : columns->count;
        part.count = end - part.first;
        if (part.count > 0)
            columns->parts[kept++] = part;
    }
    columns->part_count = kept;
}

/* Returns whether one of the columns from `from` to before `to` has this name. */
static bool has_name(const struct columns *columns, const char *name, int from, int to) {
    for (int i = from; i < to; i++)
        if (strcmp(columns->names[i], name) == 0)
            return true;
    return false;
}

/* Prefixes all columns from `first` on with their kind until none of their names occurs before. */
static void settle(struct columns *columns, int first, const char *lead) {
    for (int i = first; i < columns->count;) {
        if (!has_name(columns, columns->names[i++], 0, first))
            continue;
        for (int j = first; j < columns->count; j++)
            columns->names[j] = format_name(columns, "%s%s", lead, columns->names[j]);
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
            begin_part(columns, format_name(columns, "/points/%s/r%s", model->points[point], rates[rate]),
                       "/axis", axes);
            for (int axis = 0; axis < 3; axis++)
                add_name(columns,
                         format_name(columns, "%s_%s%s", model->points[point], axes[axis], rates[rate]),
                         point_units[rate]);
        }
        settle(columns, first, "point_");
    }
}

static void name_residuals(const struct refdyn_model *model, struct columns *columns) {
    begin_part(columns, "/phi", "/phi_row", columns->names + columns->count);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level == REFDYN_POSITION)
            add_name(columns, format_name(columns, "phi_%d", i + 1), NULL);
    begin_part(columns, "/psi", "/psi_row", columns->names + columns->count);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level != REFDYN_ACCELERATION)
            add_name(columns, format_name(columns, "psi_%d", i + 1), NULL);
}

/* "loop 1 x" becomes "lambda_loop_1_x"; of rows with one name, all but the first also get their number. */
static void name_multipliers(const struct refdyn_model *model, struct columns *columns) {
    const int first = columns->count;
    begin_part(columns, "/lambda", "/lambda_row", columns->names + first);
    for (int i = 0; i < model->m; i++) {
        char *name = format_name(columns, "%s%s", multiplier_lead, model->rows[i].name);
        for (char *at = name; *at; at++)
            if (!isalnum((unsigned char)*at))
                *at = '_';
        const bool is_taken = has_name(columns, name, first, columns->count);
        add_name(columns, is_taken ? format_name(columns, "%s_%d", name, i + 1) : name,
                 *model->rows[i].unit ? model->rows[i].unit : NULL);
    }
    settle(columns, first, multiplier_lead);
}

static bool is_slide(const struct refdyn_name *coordinate) {
    return strcmp(coordinate->unit, "m") == 0;
}

static void name_state(const struct refdyn_model *model, struct columns *columns) {
    const struct refdyn_name *q = model->coordinates;
    const char *const *coordinates = columns->names + 1;
    const int joints = refdyn_joint_count(model);
    begin_part(columns, "/t", NULL, NULL);
    add_name(columns, "t", "s");
    begin_part(columns, "/q", "/coordinate", coordinates);
    for (int i = 0; i < joints; i++)
        add_name(columns, q[i].name, q[i].unit);
    begin_part(columns, "/qd", "/coordinate", coordinates);
    for (int i = 0; i < joints; i++)
        add_name(columns, format_name(columns, "%s_d", q[i].name), is_slide(&q[i]) ? "m/s" : "rad/s");
}

static void name_energy(const struct refdyn_model *model, struct columns *columns) {
    (void)model;
    begin_part(columns, "/energy", NULL, NULL);
    add_name(columns, "energy", "J");
}

static void name_forces(const struct refdyn_model *model, struct columns *columns) {
    const int first = columns->count;
    begin_part(columns, "/force", "/coordinate", columns->names + 1);
    for (int i = 0; i < refdyn_joint_count(model); i++)
        add_name(columns, format_name(columns, "%s%s", record_force_lead, model->coordinates[i].name),
                 is_slide(&model->coordinates[i]) ? "N" : "N m");
    settle(columns, first, record_force_lead);
}

static void name_states(const struct refdyn_model *model, struct columns *columns) {
    for (int i = refdyn_joint_count(model); i < model->n; i++) {
        begin_part(columns, format_name(columns, "/states/%s", model->coordinates[i].name), NULL, NULL);
        add_settled(columns, "state_", model->coordinates[i].name, model->coordinates[i].unit);
    }
}

static void name_inputs(const struct refdyn_model *model, struct columns *columns) {
    for (int i = 0; i < model->input_count; i++) {
        begin_part(columns, format_name(columns, "/inputs/%s", model->inputs[i].name), NULL, NULL);
        add_settled(columns, record_input_lead, model->inputs[i].name, model->inputs[i].unit);
    }
}

static void name_courses(const struct refdyn_model *model, struct columns *columns) {
    for (int i = 0; i < model->course_count; i++) {
        begin_part(columns, format_name(columns, "/courses/%s", model->courses[i]), NULL, NULL);
        add_settled(columns, "course_", model->courses[i], NULL);
    }
}

/* These columns come after the others, because files of earlier versions do not have them. */
static void name_accelerations(const struct refdyn_model *model, struct columns *columns) {
    const int first = columns->count;
    begin_part(columns, "/qdd", "/coordinate", columns->names + 1);
    for (int i = 0; i < refdyn_joint_count(model); i++)
        add_name(columns,
                 format_name(columns, "%s%s", model->coordinates[i].name, record_acceleration_ending),
                 is_slide(&model->coordinates[i]) ? "m/s^2" : "rad/s^2");
    settle(columns, first, record_acceleration_lead);
}

static void name_angular(const struct refdyn_model *model, struct columns *columns) {
    static const char *const units[] = {"rad/s", "rad/s^2"};
    const struct refdyn_spatial *spatial = columns->spatial;
    for (int i = 0; spatial && i < spatial->count; i++) {
        const char *point = model->points[spatial->points[i]];
        const int first = columns->count;
        for (int rate = 0; rate < 2; rate++) {
            begin_part(columns, format_name(columns, "/points/%s/w%s", point, rates[rate]), "/axis", axes);
            for (int axis = 0; axis < 3; axis++)
                add_name(columns, format_name(columns, "%s_w%s%s", point, axes[axis], rates[rate]),
                         units[rate]);
        }
        settle(columns, first, "point_");
    }
}

static void name_contacts(const struct refdyn_model *model, struct columns *columns) {
    for (int i = refdyn_programme_rows(model); i < model->m; i++) {
        const int first = columns->count;
        begin_part(columns, format_name(columns, "/contacts/%s/force", model->rows[i].name), NULL, NULL);
        add_name(columns, format_name(columns, "contact_%s", model->rows[i].name), NULL);
        begin_part(columns, format_name(columns, "/contacts/%s/rest", model->rows[i].name), NULL, NULL);
        add_name(columns, format_name(columns, "rest_%s", model->rows[i].name), "s");
        settle(columns, first, "contact_");
    }
}

/* ---- Values ---- */

static void put_value(struct record_table *table, double value) {
    table->values[table->filled++] = value;
}

static void put_values(struct record_table *table, const double *values, int count) {
    for (int i = 0; i < count; i++)
        put_value(table, values[i]);
}

/* rdd += C qdd, where rdd is d before */
static void add_accelerations(const struct refdyn_integrator *integrator, const double *C, double *rdd,
                              int rows) {
    int n = integrator->work->n;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < n; j++)
            rdd[i] += C[i * n + j] * integrator->qdd[j];
}

static void put_points(struct record_table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    int rows = 3 * model->point_count;
    double *r = table->scratch, *rd = r + rows, *C = rd + rows, *rdd = C + rows * work->n;
    if (rows == 0)
        return;
    model->point_terms(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, r);
    add_accelerations(integrator, C, rdd, rows);
    for (int point = 0; point < model->point_count; point++) {
        put_values(table, r + 3 * point, 3);
        put_values(table, rd + 3 * point, 3);
        put_values(table, rdd + 3 * point, 3);
    }
}

static void put_residuals(struct record_table *table) {
    const struct refdyn_workspace *work = table->integrator->work;
    for (int i = 0; i < work->m; i++)
        if (work->model->rows[i].level == REFDYN_POSITION)
            put_value(table, work->phi[i]);
    for (int i = 0; i < work->m; i++)
        if (work->model->rows[i].level != REFDYN_ACCELERATION)
            put_value(table, work->psi[i]);
}

static void put_multipliers(struct record_table *table) {
    refdyn_integrator_multipliers(table->integrator, table->scratch);
    put_values(table, table->scratch, table->integrator->work->m);
}

static void put_courses(struct record_table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    if (!model->course_count)
        return;
    model->course(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, table->scratch);
    put_values(table, table->scratch, model->course_count);
}

static void put_accelerations(struct record_table *table) {
    put_values(table, table->integrator->qdd, refdyn_joint_count(table->integrator->work->model));
}

/* w = J qd, wd = J qdd + Jd_qd, the last three rows of each. */
static void put_angular(struct record_table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_spatial *spatial = table->spatial;
    const int n = work->n;
    if (!spatial)
        return;
    double *drift = table->scratch, *J = drift + 6 * spatial->count;
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

static void put_state_cells(struct record_table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const int joints = refdyn_joint_count(integrator->work->model);
    put_value(table, integrator->t);
    put_values(table, integrator->q, joints);
    put_values(table, integrator->qd, joints);
}

static void put_states(struct record_table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    const int joints = refdyn_joint_count(integrator->work->model);
    put_values(table, integrator->qd + joints, integrator->work->n - joints);
}

static void put_energy(struct record_table *table) {
    const struct refdyn_integrator *integrator = table->integrator;
    double energy[2] = {0, 0};
    refdyn_energies(integrator->work, integrator->t_right, integrator->q, integrator->qd, energy);
    put_value(table, energy[0] + energy[1]);
}

static void put_forces(struct record_table *table) {
    refdyn_integrator_force(table->integrator, table->scratch);
    put_values(table, table->scratch, refdyn_joint_count(table->integrator->work->model));
}

static void put_inputs(struct record_table *table) {
    const struct refdyn_workspace *work = table->integrator->work;
    put_values(table, work->x, work->model->input_count);
}

/* The force, and the time since which the contact rests; both are 0 for a free contact. */
static void put_contacts(struct record_table *table) {
    struct refdyn_integrator *integrator = table->integrator;
    if (integrator->contact_count == 0)
        return;
    refdyn_integrator_contact_forces(integrator, table->scratch);
    for (int k = 0; k < integrator->contact_count; k++) {
        put_value(table, table->scratch[k]);
        put_value(table,
                  integrator->contact_mode[k] == REFDYN_CONTACT_FREE ? 0 : integrator->contact_since[k]);
    }
}

/* ---- Blocks ---- */

static const struct block blocks[RECORD_BLOCKS] = {
    [RECORD_STATE] = {name_state, put_state_cells, NEEDS_STATE},
    [RECORD_POINTS] = {name_points, put_points, NEEDS_ACCELERATIONS},
    [RECORD_RESIDUALS] = {name_residuals, put_residuals, NEEDS_STATE},
    [RECORD_MULTIPLIERS] = {name_multipliers, put_multipliers, NEEDS_ROWS, true},
    [RECORD_ENERGY] = {name_energy, put_energy, NEEDS_STATE},
    [RECORD_FORCES] = {name_forces, put_forces, NEEDS_ROWS, true},
    [RECORD_STATES] = {name_states, put_states, NEEDS_STATE},
    [RECORD_INPUTS] = {name_inputs, put_inputs, NEEDS_STATE},
    [RECORD_COURSES] = {name_courses, put_courses, NEEDS_STATE},
    [RECORD_ACCELERATIONS] = {name_accelerations, put_accelerations, NEEDS_ACCELERATIONS},
    [RECORD_ANGULAR] = {name_angular, put_angular, NEEDS_ACCELERATIONS},
    [RECORD_CONTACTS] = {name_contacts, put_contacts, NEEDS_ROWS}};

static void *allocate(struct record_memory memory, size_t count, size_t size) {
    return memory.get(memory.context, (count + 1) * size);
}

static void name_columns(const struct refdyn_model *model, struct columns *columns, int *ends) {
    const int angular = columns->spatial ? columns->spatial->count : 0;
    const size_t most = 6 * (size_t)angular + 2 + 4 * (size_t)model->n + 9 * (size_t)model->point_count +
                        5 * (size_t)model->m + (size_t)model->input_count + (size_t)model->course_count;
    columns->names = allocate(columns->memory, most, sizeof *columns->names);
    columns->units = allocate(columns->memory, most, sizeof *columns->units);
    columns->parts = allocate(columns->memory, most + RECORD_BLOCKS, sizeof *columns->parts);
    for (int block = 0; block < RECORD_BLOCKS; block++) {
        blocks[block].name(model, columns);
        ends[block] = columns->count;
    }
    end_parts(columns);
}

void record_table_start(struct record_table *table, struct record_memory memory,
                        struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial) {
    const struct refdyn_model *model = integrator->work->model;
    const size_t n = (size_t)model->n, rows = 3 * (size_t)model->point_count;
    const size_t angular = spatial ? 6 * (size_t)spatial->count : 0;
    struct columns columns = {.spatial = spatial, .memory = memory};
    *table = (struct record_table){.integrator = integrator, .spatial = spatial};
    name_columns(model, &columns, table->ends);
    table->names = columns.names;
    table->units = columns.units;
    table->count = columns.count;
    table->parts = columns.parts;
    table->part_count = columns.part_count;
    table->values = allocate(memory, (size_t)table->count, sizeof *table->values);
    table->scratch =
        allocate(memory, n + (size_t)model->m + (rows + angular) * (n + 3) + (size_t)model->course_count,
                 sizeof *table->scratch);
    for (int block = 0; block < RECORD_BLOCKS; block++)
        table->is_wanted[block] = true;
    table->needs_accelerations = true;
}

void record_put_array(const struct record_writer *writer, const char *key, const double *values, int count) {
    writer->open(writer->context, key, '[');
    for (int i = 0; i < count; i++)
        writer->number(writer->context, NULL, values[i]);
    writer->close(writer->context, ']');
}

void record_put_state(const struct refdyn_model *model, const double *q, const double *qd, const char *states,
                      const struct record_writer *writer) {
    const int joints = refdyn_joint_count(model);
    record_put_array(writer, "q", q, joints);
    record_put_array(writer, "qd", qd, joints);
    if (joints == model->n)
        return;
    writer->open(writer->context, states, '{');
    for (int j = joints; j < model->n; j++)
        writer->number(writer->context, model->coordinates[j].name, qd[j]);
    writer->close(writer->context, '}');
}

void record_table_put_units(const struct record_table *table, const struct record_writer *writer) {
    writer->open(writer->context, "units", '{');
    for (int i = 0; i < table->count; i++)
        if (table->units[i])
            writer->text(writer->context, table->names[i], table->units[i]);
    writer->close(writer->context, '}');
}

static bool ends_with(const char *text, const char *end) {
    const size_t length = strlen(text), size = strlen(end);
    return length >= size && strcmp(text + length - size, end) == 0;
}

/* Datasets outside points have these paths, those of points and contacts these endings. */
static enum record_kind kind_of_path(const char *path) {
    static const struct {
        const char *start, *end;
        enum record_kind kind;
    } kinds[] = {{"/qd", "/qd", RECORD_RATE},
                 {"/qdd", "/qdd", RECORD_ACCELERATION},
                 {"/force", "/force", RECORD_FORCE},
                 {"/lambda", "/lambda", RECORD_FORCE},
                 {"/contacts/", "/force", RECORD_FORCE},
                 {"/points/", "/rd", RECORD_RATE},
                 {"/points/", "/w", RECORD_RATE},
                 {"/points/", "/rdd", RECORD_ACCELERATION},
                 {"/points/", "/wd", RECORD_ACCELERATION}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strncmp(path, kinds[i].start, strlen(kinds[i].start)) == 0 && ends_with(path, kinds[i].end))
            return kinds[i].kind;
    return RECORD_OTHER;
}

enum record_kind record_table_kind(const struct record_table *table, int column) {
    for (int i = 0; i < table->part_count; i++)
        if (column < table->parts[i].first + table->parts[i].count)
            return kind_of_path(table->parts[i].path);
    return RECORD_OTHER;
}

bool record_table_is_state(const struct record_table *table, int column) {
    return column >= table->ends[RECORD_STATES - 1] && column < table->ends[RECORD_STATES];
}

void record_table_want(struct record_table *table, const bool *wanted) {
    const bool has_rows = table->integrator->work->m > 0;
    table->needs_accelerations = false;
    for (int block = 0, i = 0; block < RECORD_BLOCKS; block++) {
        table->is_wanted[block] = false;
        for (; i < table->ends[block]; i++)
            table->is_wanted[block] |= wanted[i];
        table->needs_accelerations |=
            table->is_wanted[block] &&
            (blocks[block].needs == NEEDS_ACCELERATIONS || (blocks[block].needs == NEEDS_ROWS && has_rows));
    }
}

void record_table_fill(struct record_table *table) {
    table->filled = 0;
    for (int block = 0; block < RECORD_BLOCKS; table->filled = table->ends[block++])
        if (table->is_wanted[block])
            blocks[block].put(table);
}

int record_table_look(struct record_table *table, double t) {
    struct refdyn_integrator *integrator = table->integrator;
    const int status = table->needs_accelerations ? refdyn_integrator_look(integrator, t)
                                                  : refdyn_integrator_look_at_state(integrator, t);
    if (status == REFDYN_OK)
        record_table_fill(table);
    return status;
}

void record_table_fill_row(struct record_table *table) {
    const bool is_after = refdyn_integrator_see_after(table->integrator);
    record_table_fill(table);
    if (is_after)
        refdyn_integrator_see_before(table->integrator);
}

const char *record_table_not_finite(const struct record_table *table) {
    for (int block = 0, i = 0; block < RECORD_BLOCKS; block++)
        for (; i < table->ends[block]; i++)
            if (!isfinite(table->values[i]) && !(isnan(table->values[i]) && blocks[block].may_be_open))
                return table->names[i];
    return NULL;
}

bool record_may_be_open(const char *name) {
    return strncmp(name, multiplier_lead, sizeof multiplier_lead - 1) == 0 ||
           strncmp(name, record_force_lead, sizeof record_force_lead - 1) == 0;
}

int record_table_find(const struct record_table *table, const char *name, size_t length) {
    for (int i = 0; i < table->count; i++)
        if (strncmp(table->names[i], name, length) == 0 && !table->names[i][length])
            return i;
    return -1;
}
