/* The layout of the numbers that a batch keeps of a case, and the times at which it records states. */
#include "runtime/tool/batches/runs/runs.h"
#include "gen/base/base.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include <math.h>
#include <string.h>

static const char *const extremes_names[] = {"smallest", "time of the smallest", "largest",
                                             "time of the largest"};
static const char *const limit_names[] = {"smallest",
                                          "time of the smallest",
                                          "largest",
                                          "time of the largest",
                                          "first time beyond the limit",
                                          "time beyond the limit"};
enum { EXTREMES = 4 };

/* ---- Times ---- */

static bool needs_outputs(const struct keep *keep) {
    return keep->limits || keep->extremes.count > 0 || keep->norms.count > 0 || keep->history.count > 0;
}

struct seen_times runs_seen_times_make(struct memory *memory, const struct keep *keep, double t, double until,
                                       double every) {
    const bool is_seen = needs_outputs(keep) || every > 0;
    const double distance = record_distance(until - t, every);
    const long outputs = is_seen ? record_count_outputs(until - t, distance) - 1 : 1;
    const size_t most = (size_t)outputs + (size_t)keep->at_count + 2;
    double *times = memory_get(memory, most * sizeof *times);
    int *output = memory_get(memory, most * sizeof *output), *at = memory_get(memory, most * sizeof *at);
    struct seen_times seen = {.t = times, .output = output, .at = at, .output_count = (int)outputs + 1};
    int next_at = 0;
    for (long i = 0; i <= outputs;) {
        const double t_output = i == outputs ? until : t + (double)i * distance;
        const double t_at = next_at < keep->at_count ? keep->at[next_at] : INFINITY;
        times[seen.count] = fmin(t_output, t_at);
        at[seen.count] = t_at <= t_output ? next_at++ : -1;
        output[seen.count++] = t_output <= t_at ? (int)i++ : -1;
    }
    return seen;
}

/* ---- Items ---- */

struct listing {
    struct memory *memory;
    struct kept *kept;
    struct runs_layout *layout;
    int capacity, kind_capacity, column_capacity;
};

static void add_item(struct listing *listing, enum kept_kind kind, const char *column, const char *unit) {
    static const char *const groups[] = {"final",   "at",          "extremes", "norms",
                                         "history", "derivatives", "limits",   "realise"};
    static const char *const axes[] = {NULL,        "at/t", "extremes/which", NULL,
                                       "history/t", NULL,   "limits/which",   NULL};
    struct runs_layout *layout = listing->layout;
    struct kept *kept = listing->kept;
    const int sizes[] = {1, 0, EXTREMES, 1, kept->times.output_count, 1, RUNS_LIMIT_SIZE, 1};
    int size = sizes[kind];
    for (int i = 0; kind == KEPT_AT && i < kept->times.count; i++)
        size += kept->times.at[i] >= 0;
    const int count = layout->item_count++;
    layout->items =
        memory_room(listing->memory, layout->items, count, &listing->capacity, sizeof *layout->items);
    kept->kinds =
        memory_room(listing->memory, kept->kinds, count, &listing->kind_capacity, sizeof *kept->kinds);
    kept->columns =
        memory_room(listing->memory, kept->columns, count, &listing->column_capacity, sizeof *kept->columns);
    kept->kinds[count] = kind;
    kept->columns[count] = memory_text(listing->memory, column);
    layout->items[count] = (struct kept_item){.group = groups[kind],
                                              .name = kept->columns[count],
                                              .unit = unit ? memory_text(listing->memory, unit) : NULL,
                                              .size = size,
                                              .offset = layout->width,
                                              .axis = axes[kind]};
    layout->width += size;
}

static bool has_item(const struct listing *listing, enum kept_kind kind, const char *column) {
    for (int i = 0; i < listing->layout->item_count; i++)
        if (listing->kept->kinds[i] == kind && strcmp(listing->kept->columns[i], column) == 0)
            return true;
    return false;
}

/* Adds the state. The first columns of the table are t, coordinates, rates and points; the last are the
 * forces and times of rest of contacts. Continuous states are between them. */
static void add_state(struct listing *listing, enum kept_kind kind, const struct record_table *table,
                      const struct refdyn_model *model) {
    const int first = 1 + 2 * refdyn_joint_count(model) + 9 * model->point_count;
    const int last = table->count - 2 * (model->m - refdyn_programme_rows(model));
    for (int i = kind == KEPT_AT; i < table->count; i++) /* the axis of `at` already has its times */
        if ((i < first || i >= last || record_table_is_state(table, i)) &&
            !has_item(listing, kind, table->names[i]))
            add_item(listing, kind, table->names[i], table->units[i]);
}

/* Adds the names that the model has. */
static void add_named(struct listing *listing, enum kept_kind kind, const struct name_list *list,
                      const struct record_table *table) {
    for (int i = 0; i < list->count; i++) {
        const int column = text_index(list->names[i], table->names, table->count);
        if (column >= 0 && !has_item(listing, kind, list->names[i]))
            add_item(listing, kind, list->names[i], table->units[column]);
    }
}

/* Adds the derivatives of each final value except the time. */
static void add_derivatives(struct listing *listing, const struct name_list *by,
                            const struct record_table *table, const struct refdyn_model *model) {
    const int last = 1 + 2 * refdyn_joint_count(model) + 9 * model->point_count;
    for (int k = 0; k < by->count; k++)
        for (int i = 1; i < table->count; i++) {
            if (i >= last && !record_table_is_state(table, i))
                continue;
            const char *name = runs_derivative_name(table->names[i], by->names[k]);
            if (!has_item(listing, KEPT_DERIVATIVE, name))
                add_item(listing, KEPT_DERIVATIVE, name, NULL);
        }
}

static void add_limits(struct listing *listing, const struct model *read, const struct record_table *table) {
    for (int i = 0; i < read->bound_count; i++) {
        const int column = text_index(read->bounds[i].column, table->names, table->count);
        if (!has_item(listing, KEPT_LIMIT, read->bounds[i].name))
            add_item(listing, KEPT_LIMIT, read->bounds[i].name, column < 0 ? NULL : table->units[column]);
    }
}

static void add_realised(struct listing *listing, const struct model *read) {
    struct realise_number *numbers;
    const int count = realise_list_numbers(read, NULL, &numbers);
    for (int i = 0; i < count; i++)
        if (!has_item(listing, KEPT_REALISE, numbers[i].name))
            add_item(listing, KEPT_REALISE, numbers[i].name, numbers[i].unit);
}

static void add_model(struct listing *listing, const struct keep *keep, const struct refdyn_model *model,
                      const struct model *read) {
    struct refdyn_workspace work = {.model = model, .n = model->n, .m = model->m};
    struct refdyn_integrator integrator = {.work = &work};
    struct record_table table;
    simulate_table_start(&table, &integrator, NULL);
    if (keep->final)
        add_state(listing, KEPT_FINAL, &table, model);
    if (keep->at_count > 0)
        add_state(listing, KEPT_AT, &table, model);
    add_named(listing, KEPT_EXTREMES, &keep->extremes, &table);
    add_named(listing, KEPT_NORM, &keep->norms, &table);
    add_named(listing, KEPT_HISTORY, &keep->history, &table);
    add_derivatives(listing, &keep->derivatives, &table, model);
    if (keep->limits)
        add_limits(listing, read, &table);
    if (keep->realise)
        add_realised(listing, read);
}

/* ---- Axes ---- */

static double *times_of(struct memory *memory, const struct seen_times *times, const int *which, int *count) {
    double *values = memory_get(memory, (size_t)times->count * sizeof *values);
    *count = 0;
    for (int i = 0; i < times->count; i++)
        if (which[i] >= 0)
            values[(*count)++] = times->t[i];
    return values;
}

static void add_axes(struct memory *memory, const struct keep *keep, const struct kept *kept,
                     struct runs_layout *layout) {
    struct kept_axis *axes = memory_get(memory, 4 * sizeof *axes);
    layout->axes = axes;
    if (keep->at_count > 0) {
        struct kept_axis *axis = &axes[layout->axis_count++];
        *axis = (struct kept_axis){.path = "at/t", .unit = "s"};
        axis->values = times_of(memory, &kept->times, kept->times.at, &axis->count);
    }
    if (keep->extremes.count > 0)
        axes[layout->axis_count++] =
            (struct kept_axis){.path = "extremes/which", .count = EXTREMES, .names = extremes_names};
    if (keep->limits)
        axes[layout->axis_count++] =
            (struct kept_axis){.path = "limits/which", .count = RUNS_LIMIT_SIZE, .names = limit_names};
    if (keep->history.count > 0) {
        struct kept_axis *axis = &axes[layout->axis_count++];
        *axis = (struct kept_axis){.path = "history/t", .unit = "s"};
        axis->values = times_of(memory, &kept->times, kept->times.output, &axis->count);
    }
}

/* ---- Names that no model has ---- */

/* Reports the first name that no model has, and returns false. */
static bool are_known(const struct name_list *list, const struct listing *listing, enum kept_kind kind,
                      const struct refdyn_model *model, const char *field) {
    for (int i = 0; i < list->count; i++) {
        if (has_item(listing, kind, list->names[i]))
            continue;
        struct refdyn_workspace work = {.model = model, .n = model->n, .m = model->m};
        struct refdyn_integrator integrator = {.work = &work};
        struct record_table table;
        simulate_table_start(&table, &integrator, NULL);
        const char *near = message_nearest_name(list->names[i], table.names, table.count);
        fprintf(stderr, "%s: keep.%s: a motion has no column '%s'%s%s\n", list->places[i], field,
                list->names[i], near ? "; the nearest is " : "", near ? near : "");
        return false;
    }
    return true;
}

/* Reports the first name by which no model can be differentiated, and returns false. */
static bool are_variables(const struct name_list *list, const struct refdyn_model *const *models, int count) {
    for (int i = 0; i < list->count; i++) {
        bool is_known = false;
        for (int k = 0; k < count && !is_known; k++)
            is_known = simulate_derivatives_find(models[k], list->names[i], NULL) == 1;
        if (is_known)
            continue;
        fprintf(stderr,
                "%s: keep.derivatives: '%s' is no parameter that the model reads, input, coordinate or rate "
                "NAME_d; "
                "leave it out\n",
                list->places[i], list->names[i]);
        return false;
    }
    return true;
}

/* ---- Names that HDF5 does not allow ---- */

static const char *find_unfit(const char *group, const char *name, const struct runs_layout *layout) {
    const char *path = format_text("%s/%s", group, name);
    for (int i = 0; i < layout->axis_count; i++)
        if (strcmp(layout->axes[i].path, path) == 0)
            return format_text("an HDF5 file has its axis /%s under this name", path);
    return format_unfit_for_hdf5(name);
}

static bool check_fit(const struct name_list *list, const char *group, const struct runs_layout *layout) {
    for (int i = 0; i < list->count; i++) {
        const char *why = find_unfit(group, list->names[i], layout);
        if (why) {
            format_complain("%s: keep.%s: '%s': %s; leave it out, or rename the column\n", list->places[i],
                            group, list->names[i], why);
            return false;
        }
    }
    return true;
}

bool runs_kept_fits_hdf5(const struct keep *keep, const struct runs_layout *layout) {
    return check_fit(&keep->extremes, "extremes", layout) && check_fit(&keep->norms, "norms", layout) &&
           check_fit(&keep->history, "history", layout);
}

/* ---- The whole ---- */

bool runs_kept_lay_out(struct memory *memory, const struct keep *keep,
                       const struct refdyn_model *const *models, const struct model *const *read,
                       int model_count, struct kept *kept, struct runs_layout *layout) {
    struct listing listing = {.memory = memory, .kept = kept, .layout = layout};
    for (int i = 0; i < model_count; i++)
        add_model(&listing, keep, models[i], read[i]);
    add_axes(memory, keep, kept, layout);
    kept->derivatives = &keep->derivatives;
    return are_variables(&keep->derivatives, models, model_count) &&
           are_known(&keep->extremes, &listing, KEPT_EXTREMES, models[0], "extremes") &&
           are_known(&keep->norms, &listing, KEPT_NORM, models[0], "norms") &&
           are_known(&keep->history, &listing, KEPT_HISTORY, models[0], "history");
}
