/*
 * Derivatives of a motion for `sim --derivatives`: names of values, columns, and messages. `fit` finds its
 * values by the same names.
 *
 * In: a motion that has been computed, and names as in sweeps: parameters, inputs, start values NAME and
 * NAME_d of coordinates. Out: the rows of the motion with a column d_COLUMN_by_NAME for each column and name.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

/* ---- Names ---- */

/* The coordinate whose rate is `name`, -1 if there is none. */
static int find_rate(const struct refdyn_model *model, const char *name) {
    const size_t length = strlen(name);
    if (length < 3 || strcmp(name + length - 2, "_d") != 0)
        return -1;
    return refdyn_find_name(model->coordinates, refdyn_joint_count(model),
                            format_text("%.*s", (int)length - 2, name));
}

/* The coordinate of a state of this name, -1 if there is none. */
static int find_state(const struct refdyn_model *model, const char *name) {
    const int place = refdyn_find_name(model->coordinates, model->n, name);
    return place >= refdyn_joint_count(model) ? place : -1;
}

/* All names by which a motion can be differentiated. */
static const char **known_names(const struct refdyn_model *model, int *count) {
    const char **names =
        format_allocate((size_t)(model->parameter_count + model->input_count + 2 * model->n), sizeof *names);
    *count = 0;
    for (int i = 0; i < model->parameter_count; i++)
        names[(*count)++] = model->parameters[i].name;
    for (int i = 0; i < model->input_count; i++)
        names[(*count)++] = model->inputs[i].name;
    for (int i = 0; i < model->n; i++) {
        names[(*count)++] = model->coordinates[i].name;
        if (i < refdyn_joint_count(model))
            names[(*count)++] = format_text("%s_d", model->coordinates[i].name);
    }
    return names;
}

/* Reports a name that the compiled model lacks. */
static enum status refuse_name(const struct scene *scene, const struct options *options, const char *option,
                               const char *name) {
    const struct model *model = &scene->generation.model;
    for (int i = 0; i < model->option_count; i++)
        if (strcmp(model->options[i].name, name) == 0)
            return options_error(
                options, option,
                ": %s is an option of the model, which fixes its structure; use a parameter, an "
                "input or a start value",
                name);
    for (int i = 0; i < model->parameter_count; i++)
        if (strcmp(model->parameters[i].name, name) == 0)
            return options_error(options, option, ": %s: nothing in this model reads it; omit it", name);
    int count;
    const char **known = known_names(scene->model, &count);
    const char *near = message_nearest_advice(&format_memory, name, known, count);
    return options_error(options, option, ": '%s' is unknown%s", name,
                         *near ? near : "; use a parameter, an input, a coordinate or its rate NAME_d");
}

int simulate_derivatives_find(const struct refdyn_model *model, const char *name,
                              struct refdyn_variable *variable) {
    const struct refdyn_variable meanings[] = {
        {REFDYN_VARIED_PARAMETER, refdyn_find_name(model->parameters, model->parameter_count, name)},
        {REFDYN_VARIED_INPUT, refdyn_find_name(model->inputs, model->input_count, name)},
        {REFDYN_VARIED_COORDINATE, refdyn_find_name(model->coordinates, refdyn_joint_count(model), name)},
        {REFDYN_VARIED_RATE, find_rate(model, name)},
        {REFDYN_VARIED_RATE, find_state(model, name)}};
    int count = 0;
    for (int i = 0; i < (int)(sizeof meanings / sizeof *meanings); i++) {
        if (meanings[i].place < 0)
            continue;
        if (variable && count == 0)
            *variable = meanings[i];
        count++;
    }
    return count;
}

static enum status find_variable(const struct scene *scene, const struct options *options, const char *option,
                                 const char *name, struct refdyn_variable *variable) {
    const int count = simulate_derivatives_find(scene->model, name, variable);
    if (count == 0)
        return refuse_name(scene, options, option, name);
    return count == 1
               ? STATUS_DONE
               : options_error(options, option,
                               ": the model uses the name %s for several values; rename one of them", name);
}

enum status simulate_derivatives_name(struct motion_derivatives *derivatives, const struct scene *scene,
                                      const struct options *options) {
    enum status status = STATUS_DONE;
    derivatives->variables = format_allocate((size_t)derivatives->count, sizeof *derivatives->variables);
    for (int i = 0; i < derivatives->count && status == STATUS_DONE; i++)
        status = find_variable(scene, options, derivatives->option, derivatives->names[i],
                               &derivatives->variables[i]);
    return status;
}

enum status simulate_derivatives_read(struct motion_derivatives *derivatives, const struct scene *scene,
                                      const struct options *options) {
    *derivatives = (struct motion_derivatives){.option = "derivatives",
                                               .names = options_list(options_text(options, "derivatives"))};
    while (derivatives->names[derivatives->count])
        derivatives->count++;
    return simulate_derivatives_name(derivatives, scene, options);
}

/* ---- The motion as a batch ---- */

/* Columns of the motions that compute side by side. */
struct columns {
    struct record_table *tables; /* by room */
    const struct refdyn_spatial *spatial;
    int count;
};

static void write_columns(void *context, const struct refdyn_batch_case *one, double *values) {
    struct columns *columns = context;
    struct record_table *table = &columns->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill_row(table);
    memcpy(values, table->values, (size_t)table->count * sizeof *values);
}

static void start_columns(struct columns *columns, struct refdyn_integrator *integrator,
                          const struct refdyn_spatial *spatial, int rooms) {
    columns->tables = format_allocate((size_t)rooms, sizeof *columns->tables);
    for (int i = 0; i < rooms; i++)
        simulate_table_start(&columns->tables[i], integrator, spatial);
    columns->count = columns->tables[0].count;
}

/* The start in equilibrium, which each changed motion computes again. */
static enum status describe_statics(struct scene *scene, const struct options *options,
                                    const struct motion_derivatives *derivatives,
                                    struct refdyn_batch *batch) {
    const int n = scene->model->n;
    int *marks = format_allocate((size_t)n, sizeof *marks), *held = format_allocate((size_t)n, sizeof *held);
    struct refdyn_statics_options *statics = format_allocate(1, sizeof *statics);
    enum status status = equilibria_choose_held(scene, options, marks);
    if (status == STATUS_DONE)
        status = equilibria_choose_options(scene, options, NULL, statics);
    for (int i = 0; i < n; i++)
        if (marks[i])
            held[batch->held_count++] = i;
    for (int i = 0; i < derivatives->count && status == STATUS_DONE; i++) {
        const struct refdyn_variable *variable = &derivatives->variables[i];
        if (variable->what == REFDYN_VARIED_COORDINATE && !marks[variable->place])
            status = options_error(options, derivatives->option,
                                   ": statics moves the coordinate %s; add it to --hold or omit it",
                                   derivatives->names[i]);
    }
    batch->from_statics = 1;
    batch->held = held;
    batch->statics = statics;
    return status;
}

/* The times of the outputs. If an event has ended the motion, the last output is that event. */
static void describe_times(const struct trial *trial, double until, struct refdyn_batch *batch) {
    const struct track *track = &trial->track;
    const int is_ended = trial->motion.record.events.has_ended;
    double *times = format_allocate((size_t)track->count, sizeof *times);
    for (long i = 1; i < track->count - is_ended; i++)
        times[batch->time_count++] = track->t[i];
    if (is_ended)
        times[batch->time_count++] = until;
    batch->times = times;
}

enum status simulate_derivatives_batch(const struct motion_derivatives *derivatives, struct scene *scene,
                                       const struct options *options,
                                       const struct refdyn_options *integration, struct refdyn_batch *batch) {
    *batch = (struct refdyn_batch){.model = scene->model,
                                   .lanes = scene->compiled.lanes,
                                   .options = *integration,
                                   .p = scene->work.p,
                                   .x = scene->work.x,
                                   .given = scene->given,
                                   .q = scene->state.q,
                                   .qd = scene->state.qd,
                                   .t = scene->state.t,
                                   .threads = 1};
    return options_is(options, "from", "statics") ? describe_statics(scene, options, derivatives, batch)
                                                  : STATUS_DONE;
}

static enum status describe(const struct trial *trial, const struct task *task,
                            const struct refdyn_options *integration,
                            const struct motion_derivatives *derivatives, struct refdyn_batch *batch) {
    static const double first_samples[] = {0};
    static const struct refdyn_batch_column samples = {REFDYN_VARIED_SAMPLES, 0, first_samples};
    struct scene *scene = task->scene;
    const enum status status =
        simulate_derivatives_batch(derivatives, scene, task->options, integration, batch);
    if (scene->inputs) {
        batch->samples = &scene->inputs->samples;
        batch->sample_count = 1;
        batch->columns = &samples;
        batch->column_count = 1;
    }
    describe_times(trial, task->until, batch);
    return status;
}

/* ---- Computation ---- */

enum status simulate_derivatives_run(struct motion_derivatives *derivatives, struct trial *trial,
                                     const struct task *task, const struct refdyn_options *integration) {
    struct refdyn_batch batch;
    struct columns columns;
    struct scene *scene = task->scene;
    enum status status = describe(trial, task, integration, derivatives, &batch);
    if (status != STATUS_DONE)
        return status;
    const int rooms = batch.threads * (batch.lanes ? batch.lanes->width : 1);
    start_columns(&columns, &trial->motion.integrator, scene->compiled.spatial, rooms);
    const size_t rows = (size_t)batch.time_count + 2, count = (size_t)derivatives->count;
    derivatives->width = columns.count;
    derivatives->rows = (int)rows;
    derivatives->values =
        format_allocate_large(count * rows * (size_t)columns.count, sizeof *derivatives->values);
    derivatives->underivable = format_allocate(count, sizeof *derivatives->underivable);
    struct refdyn_derivatives given = {.batch = &batch,
                                       .count = derivatives->count,
                                       .variables = derivatives->variables,
                                       .width = columns.count,
                                       .values = write_columns,
                                       .context = &columns,
                                       .derivatives = derivatives->values,
                                       .underivable = derivatives->underivable};
    const int result = batch.time_count > 0 ? refdyn_derivatives_run(&given) : REFDYN_OK;
    derivatives->copies = given.copies;
    derivatives->cpu_s = given.cpu_s + given.copies_cpu_s;
    derivatives->part = given.copies_cpu_s / given.cpu_s;
    if (result) {
        fprintf(stderr, "refdyn: --derivatives: %s\n", refdyn_status_text(result));
        return STATUS_NUMBERS;
    }
    fprintf(stderr, "derivatives  by %d value%s, from %ld motions in the time of %.3g, %.3g s CPU\n",
            derivatives->count, derivatives->count > 1 ? "s" : "", derivatives->copies, derivatives->part,
            derivatives->cpu_s);
    record_print_underivable(scene->model, derivatives->names, columns.tables[0].names,
                             derivatives->underivable, derivatives->count, stderr);
    return STATUS_DONE;
}

void simulate_derivatives_release(struct motion_derivatives *derivatives) {
    free(derivatives->values);
    derivatives->values = NULL;
}

void simulate_derivatives_put(const struct motion_derivatives *derivatives, struct document *document) {
    format_put_open(document, "derivatives", '{');
    format_put_open(document, "by", '[');
    for (int i = 0; i < derivatives->count; i++)
        format_put_text(document, NULL, derivatives->names[i]);
    format_put_close(document, ']');
    format_put_whole(document, "motions", derivatives->copies);
    format_put_number(document, "cpu_s", derivatives->cpu_s);
    format_put_close(document, '}');
}

/* ---- Rows ---- */

/* Does this column have derivatives? The time has them where an event ends the motion. */
static bool is_derived(const struct trial *trial, int column) {
    return column > 0 || trial->motion.record.events.has_ended;
}

/* The unit of a value by which a motion is differentiated. */
static const char *unit_of_value(const struct refdyn_model *model, const struct refdyn_variable *variable) {
    if (variable->what == REFDYN_VARIED_PARAMETER)
        return model->parameters[variable->place].unit;
    if (variable->what == REFDYN_VARIED_INPUT)
        return model->inputs[variable->place].unit;
    const char *unit = model->coordinates[variable->place].unit;
    const bool is_rate = variable->what == REFDYN_VARIED_RATE && variable->place < refdyn_joint_count(model);
    return is_rate ? format_text("%s/s", unit) : unit;
}

/* The unit of a derivative; NULL if the column has none. */
static const char *unit_of_derivative(const char *column, const char *value) {
    if (!column || !*column || !value || !*value || strcmp(value, "1") == 0)
        return column;
    if (strcmp(column, value) == 0)
        return "1";
    return format_text(strpbrk(value, " /") ? "%s/(%s)" : "%s/%s", column, value);
}

/* A table with the columns of the motion, then those of its derivatives. */
static void extend(const struct motion_derivatives *derivatives, const struct trial *trial,
                   const struct record_table *table, struct record_table *extended) {
    const size_t most = (size_t)table->count * (size_t)(derivatives->count + 1);
    *extended = *table;
    extended->names = format_allocate(most, sizeof *extended->names);
    extended->units = format_allocate(most, sizeof *extended->units);
    extended->values = format_allocate(most, sizeof *extended->values);
    extended->parts = format_allocate(most + (size_t)table->part_count, sizeof *extended->parts);
    memcpy(extended->names, table->names, (size_t)table->count * sizeof *table->names);
    memcpy(extended->units, table->units, (size_t)table->count * sizeof *table->units);
    memcpy(extended->parts, table->parts, (size_t)table->part_count * sizeof *table->parts);
    for (int i = 0; i < derivatives->count; i++) {
        const char *name = derivatives->names[i];
        const char *unit = unit_of_value(trial->motion.scene->model, &derivatives->variables[i]);
        for (int k = 0; k < table->count; k++) {
            if (!is_derived(trial, k))
                continue;
            extended->parts[extended->part_count++] =
                (struct record_part){.path = format_text("/derivatives/%s/%s", table->names[k], name),
                                     .first = extended->count,
                                     .count = 1,
                                     .is_derivative = true};
            extended->units[extended->count] = unit_of_derivative(table->units[k], unit);
            extended->names[extended->count++] = format_text("d_%s_by_%s", table->names[k], name);
        }
    }
}

static void add_derivatives(const struct motion_derivatives *derivatives, const struct trial *trial, long row,
                            struct record_table *extended) {
    int filled = derivatives->width;
    for (int i = 0; i < derivatives->count; i++)
        for (int k = 0; k < derivatives->width; k++)
            if (is_derived(trial, k))
                extended->values[filled++] =
                    derivatives->values[((size_t)i * (size_t)derivatives->rows + (size_t)row) *
                                            (size_t)derivatives->width +
                                        (size_t)k];
}

bool simulate_derivatives_write(const struct motion_derivatives *derivatives, struct trial *trial,
                                FILE *numbers, struct row_sink *to) {
    struct record_table table, extended;
    simulate_table_start(&table, &trial->motion.integrator, trial->motion.scene->compiled.spatial);
    extend(derivatives, trial, &table, &extended);
    const size_t width = (size_t)table.count;
    bool is_good = simulate_row_sink_begin(to, &extended);
    rewind(numbers);
    for (long row = 0; is_good && fread(extended.values, sizeof *extended.values, width, numbers) == width;
         row++) {
        add_derivatives(derivatives, trial, row, &extended);
        is_good = simulate_row_sink_put(to, &extended);
    }
    return simulate_row_sink_end(to) && is_good;
}
