/* The catalogue of an FMU: all variables with names, units, roles, start values and dependencies. */
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const energy_names[] = {"energy", "energy_kinetic", "energy_potential"};

/* The role of a kind for importers, if all of its variables have the same. */
struct role {
    enum causality causality;
    enum variability variability;
    enum initial initial;
    const char *lead; /* put before a name that is taken */
    const char *about;
};

static const struct role roles[FMU_KIND_COUNT] = {
    [FMU_TIME] = {AS_INDEPENDENT, IS_CONTINUOUS, INITIAL_NONE, "independent_", "time"},
    [FMU_COORDINATE] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_EXACT, "coordinate_", "coordinate"},
    [FMU_RATE] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_EXACT, "rate_", "rate of a coordinate"},
    [FMU_COORDINATE_CHANGE] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "rate_",
                               "derivative of a coordinate"},
    [FMU_ACCELERATION] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "acceleration_",
                          "acceleration of a coordinate"},
    [FMU_POSITION] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, "point_", "position of a point"},
    [FMU_VELOCITY] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, "point_", "velocity of a point"},
    [FMU_POINT_ACCELERATION] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "point_",
                                "acceleration of a point"},
    [FMU_PHI] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "row_", "residual of a row's position"},
    [FMU_PSI] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "row_", "residual of a row's velocity"},
    [FMU_ENERGY] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, "total_", "energy"},
    [FMU_FORCE] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, record_force_lead,
                   "force of the drive of a coordinate, or of all rows if it has no drive"},
    [FMU_MULTIPLIER] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, "multiplier_", "multiplier of row "},
    [FMU_INPUT] = {AS_INPUT, IS_CONTINUOUS, INITIAL_EXACT, "input_", "input"},
    [FMU_COURSE] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, "course_", "course of the model"},
    [FMU_ANGULAR_VELOCITY] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "point_",
                              "angular velocity at a point"},
    [FMU_ANGULAR_ACCELERATION] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "point_",
                                  "angular acceleration at a point"},
    [FMU_PARAMETER] = {AS_PARAMETER, IS_TUNABLE, INITIAL_EXACT, "parameter_", "parameter"},
    [FMU_CONTACT_FORCE] = {AS_OUTPUT, IS_CONTINUOUS, INITIAL_CALCULATED, "contact_",
                           "force [N, N m where the gap is an angle] of contact "},
    [FMU_CONTACT_SINCE] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "contact_",
                           "end of all rebounds, 0 while it is free: contact "},
    [FMU_INDICATOR] = {AS_LOCAL, IS_CONTINUOUS, INITIAL_CALCULATED, "indicator_", "event indicator"},
};

/* The name of the row of contact i. */
static const char *contact_name(const struct refdyn_model *model, int i) {
    return model->rows[model->m - fmu_count_contacts(model) + i].name;
}

/* ---- Names ---- */

/* The columns of `sim`, from which the names of variables come. */
struct columns {
    struct record_table table;
    const struct refdyn_model *model;
};

static int count_rows(const struct refdyn_model *model, enum fmu_kind kind, int rows) {
    int count = 0;
    for (int i = 0; i < rows; i++)
        count += fmu_has_row(model, kind, i);
    return count;
}

static void find_columns(struct columns *columns, struct scene *scene) {
    static struct refdyn_integrator names_alone;
    names_alone.work = &scene->work;
    simulate_table_start(&columns->table, &names_alone, scene->compiled.spatial);
    columns->model = scene->model;
}

/* Returns the first column of any block after the first one. */
static int first_of(const struct columns *columns, enum record_block block) {
    return columns->table.ends[block - 1];
}

/* A point has nine columns: r, rd and rdd. */
static int point_column(const struct columns *columns, int index, int rate) {
    return first_of(columns, RECORD_POINTS) + 9 * (index / 3) + 3 * rate + index % 3;
}

/* Returns -1 if `sim` has no such column. */
static int column_of(const struct columns *columns, struct fmu_variable variable) {
    const struct refdyn_model *model = columns->model;
    const int i = variable.index, joints = refdyn_joint_count(model);
    switch (variable.kind) {
    case FMU_COORDINATE:
        return 1 + i;
    case FMU_RATE:
        return i < joints ? 1 + joints + i : first_of(columns, RECORD_STATES) + i - joints;
    case FMU_ACCELERATION:
        return i < joints ? first_of(columns, RECORD_ACCELERATIONS) + i : -1;
    case FMU_POSITION:
    case FMU_VELOCITY:
    case FMU_POINT_ACCELERATION:
        return point_column(columns, i, (int)variable.kind - FMU_POSITION);
    case FMU_PHI:
        return first_of(columns, RECORD_RESIDUALS) + count_rows(model, FMU_PHI, i);
    case FMU_PSI:
        return first_of(columns, RECORD_RESIDUALS) + count_rows(model, FMU_PHI, model->m) +
               count_rows(model, FMU_PSI, i);
    case FMU_FORCE:
        return first_of(columns, RECORD_FORCES) + i;
    case FMU_INPUT:
        return first_of(columns, RECORD_INPUTS) + i;
    case FMU_COURSE:
        return first_of(columns, RECORD_COURSES) + i;
    case FMU_CONTACT_FORCE:
    case FMU_CONTACT_SINCE:
        return first_of(columns, RECORD_CONTACTS) + 2 * i + (variable.kind == FMU_CONTACT_SINCE);
    case FMU_ANGULAR_VELOCITY:
    case FMU_ANGULAR_ACCELERATION:
        return first_of(columns, RECORD_ANGULAR) + 6 * (i / 3) +
               3 * (variable.kind == FMU_ANGULAR_ACCELERATION) + i % 3;
    default:
        return -1;
    }
}

static const char *own_name(const struct refdyn_model *model, struct fmu_variable variable) {
    const int i = variable.index;
    switch (variable.kind) {
    case FMU_TIME:
        return "time";
    case FMU_COORDINATE_CHANGE:
    case FMU_ACCELERATION: /* of a state */
        return format_text("der(%s)", model->coordinates[i].name);
    case FMU_ENERGY:
        return energy_names[i];
    case FMU_MULTIPLIER:
        return format_text("lambda_%d", i + 1);
    case FMU_PARAMETER:
        return model->parameters[i].name;
    default:
        return format_text("indicator_%d", i + 1);
    }
}

static bool is_taken(const struct catalogue *catalogue, const char *name) {
    for (int i = 0; i < catalogue->count; i++)
        if (strcmp(catalogue->entries[i].name, name) == 0)
            return true;
    return false;
}

static const char *own_unit(const struct refdyn_model *model, struct fmu_variable variable) {
    const int i = variable.index;
    switch (variable.kind) {
    case FMU_TIME:
        return "s";
    case FMU_COORDINATE_CHANGE:
        return strcmp(model->coordinates[i].unit, "m") == 0 ? "m/s" : "rad/s";
    case FMU_ACCELERATION: /* of a state */
        return *model->coordinates[i].unit ? format_text("%s/s", model->coordinates[i].unit) : NULL;
    case FMU_ENERGY:
        return "J";
    case FMU_MULTIPLIER:
        return model->rows[i].unit;
    case FMU_PARAMETER:
        return model->parameters[i].unit;
    default:
        return NULL;
    }
}

/* ---- Roles ---- */

static bool is_set_by_events(const struct refdyn_model *model, struct fmu_variable variable) {
    const int i = variable.index;
    return (variable.kind == FMU_INPUT && fmu_is_set_by_events(model, REFDYN_CHANGED_INPUT, i)) ||
           (variable.kind == FMU_PARAMETER && fmu_is_set_by_events(model, REFDYN_CHANGED_PARAMETER, i));
}

static void set_role(struct catalogue_entry *entry, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    const struct role *role = &roles[entry->variable.kind];
    const int i = entry->variable.index;
    const bool is_state = entry->variable.kind == FMU_COORDINATE || entry->variable.kind == FMU_RATE;
    entry->causality = role->causality;
    entry->variability = role->variability;
    entry->initial = role->initial;
    entry->about = role->about;
    if (entry->variable.kind == FMU_MULTIPLIER)
        entry->about = format_text("%s%s", role->about, model->rows[i].name);
    if (entry->variable.kind == FMU_CONTACT_FORCE || entry->variable.kind == FMU_CONTACT_SINCE)
        entry->about = format_text("%s%s", role->about, contact_name(model, i));
    if (i >= refdyn_joint_count(model) && entry->variable.kind == FMU_RATE)
        entry->about = "state of a controller or drive";
    if (i >= refdyn_joint_count(model) && entry->variable.kind == FMU_ACCELERATION)
        entry->about = "derivative of a state";
    if (is_state && model->m > 0) /* the start projection may change it */
        entry->initial = INITIAL_APPROXIMATE;
    if (is_set_by_events(model, entry->variable)) {
        entry->causality = AS_LOCAL;
        entry->variability = IS_DISCRETE;
        entry->about = "set by events of the model";
    }
    const int contact = entry->variable.kind == FMU_PARAMETER ? fmu_contact_of_parameter(model, i) : -1;
    if (contact >= 0) {
        entry->initial = INITIAL_CALCULATED;
        entry->about = format_text("1 while contact %s rests", contact_name(model, contact));
    }
}

static void set_start(struct catalogue_entry *entry, const struct scene *scene) {
    const int i = entry->variable.index;
    switch (entry->variable.kind) {
    case FMU_COORDINATE:
        entry->start = scene->q[i];
        break;
    case FMU_RATE:
        entry->start = scene->qd[i];
        break;
    case FMU_INPUT:
        entry->start = scene->work.x[i];
        break;
    case FMU_PARAMETER:
        entry->start = scene->work.p[i];
        if (refdyn_find_anchored(scene->model, i) >= 0 && entry->causality == AS_PARAMETER)
            entry->variability = IS_FIXED;
        break;
    default:
        break;
    }
}

/* ---- The whole ---- */

static void add_entry(struct catalogue *catalogue, const struct scene *scene, const struct columns *columns,
                      struct fmu_variable variable) {
    const struct refdyn_model *model = scene->model;
    const int column = column_of(columns, variable);
    struct catalogue_entry entry = {.variable = variable,
                                    .reference = fmu_reference(model, scene->compiled.spatial, variable),
                                    .state = -1};
    const char *name = column >= 0 ? columns->table.names[column] : own_name(model, variable);
    entry.unit = column >= 0 ? columns->table.units[column] : own_unit(model, variable);
    if (entry.unit && !*entry.unit)
        entry.unit = NULL;
    while (is_taken(catalogue, name))
        name = format_text("%s%s", roles[variable.kind].lead, name);
    entry.name = name;
    if (variable.kind == FMU_COORDINATE_CHANGE || variable.kind == FMU_ACCELERATION)
        entry.state = catalogue->first[variable.kind - 2] + variable.index;
    set_role(&entry, scene);
    set_start(&entry, scene);
    catalogue->entries = memory_room(&format_memory, catalogue->entries, catalogue->count + 1,
                                     &catalogue->room, sizeof *catalogue->entries);
    catalogue->entries[catalogue->count++] = entry;
}

void export_catalogue_make(struct catalogue *catalogue, struct scene *scene, bool has_indicators) {
    struct columns columns;
    find_columns(&columns, scene);
    *catalogue = (struct catalogue){.count = 0};
    for (int kind = 0; kind < FMU_INDICATOR + has_indicators; kind++) {
        catalogue->first[kind] = catalogue->count;
        const int count = fmu_count_variables(scene->model, scene->compiled.spatial, (enum fmu_kind)kind);
        const bool is_of_rows = kind == FMU_PHI || kind == FMU_PSI;
        for (int i = 0; i < count; i++)
            if (!is_of_rows || fmu_has_row(scene->model, (enum fmu_kind)kind, i))
                add_entry(catalogue, scene, &columns, (struct fmu_variable){(enum fmu_kind)kind, i});
    }
}

/* ---- Dependencies ---- */

/* A number between -1 and 1, the same in each call of the program. */
static double scattered(unsigned *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (double)*seed / 2147483648.0 - 1;
}

static void scatter(double *values, const double *about, int count, unsigned *seed) {
    for (int i = 0; i < count; i++)
        values[i] = about[i] + 0.3 * scattered(seed) * (fabs(about[i]) + 1);
}

/* Which coordinates the position of each point depends on. A position is an analytic function of the
 * coordinates. A column of C that is not identically zero is therefore not zero at scattered states with
 * scattered parameters. */
bool *export_catalogue_dependencies(const struct scene *scene) {
    enum { STATES = 3 };
    const struct refdyn_model *model = scene->model;
    const int n = model->n, parameters = model->parameter_count, count = 3 * model->point_count * n;
    double *C = format_allocate_matrix(3 * model->point_count, n), *q = format_allocate_matrix(2, n);
    double *p = format_allocate((size_t)(parameters + model->derived_count), sizeof *p);
    double *x = format_allocate((size_t)model->input_count, sizeof *x);
    bool *depends = format_allocate((size_t)count, sizeof *depends);
    unsigned seed = 20150;
    for (int k = 0; k < STATES && count > 0; k++) {
        scatter(q, scene->q, n, &seed);
        scatter(q + n, scene->qd, n, &seed);
        scatter(p, scene->work.p, parameters, &seed);
        scatter(x, scene->work.x, model->input_count, &seed);
        if (model->prepare)
            model->prepare(p);
        model->C(p, x, 0.1234 + k, q, q + n, C);
        for (int i = 0; i < count; i++)
            depends[i] |= !(C[i] == 0);
    }
    return depends;
}
