/* Writes the rows of a motion: as CSV, as numbers in a temporary file, or as HDF5 with everything that it was
 * computed from. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "gen/read/read.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"

#include <string.h>

static bool is_written(struct row_sink *sink) {
    return !ferror(sink->file);
}

/* ---- CSV ---- */

static bool begin_csv(struct row_sink *sink, const struct table *table) {
    simulate_table_header(table, sink->file);
    return is_written(sink);
}

static bool put_csv(struct row_sink *sink, const struct table *table) {
    simulate_table_row(table, sink->file);
    return is_written(sink);
}

struct row_sink simulate_row_sink_csv(FILE *file) {
    static const struct row_form form = {begin_csv, put_csv, is_written};
    return (struct row_sink){.form = &form, .file = file};
}

/* ---- Numbers ---- */

static bool begin_numbers(struct row_sink *sink, const struct table *table) {
    return table->count > 0 && is_written(sink);
}

static bool put_numbers(struct row_sink *sink, const struct table *table) {
    fwrite(table->values, sizeof *table->values, (size_t)table->count, sink->file);
    return is_written(sink);
}

struct row_sink simulate_row_sink_numbers(FILE *file) {
    static const struct row_form form = {begin_numbers, put_numbers, is_written};
    return (struct row_sink){.form = &form, .file = file};
}

/* ---- HDF5 ---- */

struct facts {
    struct memory *memory;
    struct motion_fact *list;
    int count, room;
};

static void add_fact(struct facts *facts, struct motion_fact fact) {
    facts->list = memory_room(facts->memory, facts->list, facts->count, &facts->room, sizeof *facts->list);
    facts->list[facts->count++] = fact;
}

static void add_text(struct facts *facts, const char *object, const char *name, const char *text) {
    add_fact(facts, (struct motion_fact){.object = object, .name = name, .text = text});
}

static void add_number(struct facts *facts, const char *object, const char *name, double number) {
    add_fact(facts, (struct motion_fact){.object = object, .name = name, .number = number});
}

/* The value that the equations read, or the model's value if no equation reads it. */
static double value_of(const struct scene *scene, const struct parameter *parameter) {
    for (int i = 0; i < scene->model->parameter_count; i++)
        if (strcmp(scene->model->parameters[i].name, parameter->name) == 0)
            return scene->work.p[i];
    return parameter->value;
}

static void add_model(struct facts *facts, const struct scene *scene) {
    const struct model *model = &scene->generation.model;
    add_text(facts, "/", "refdyn", REFDYN_VERSION);
    add_text(facts, "/", "model", scene->model->name);
    add_text(facts, "/", "model_hash", scene->model->hash);
    add_text(facts, "/", "model_file", model->sources->list[0].path);
    for (int i = 0; i < model->sources->count; i++)
        add_text(facts, "/model_files", model->sources->list[i].path, model->sources->list[i].text);
    for (int i = 0; i < model->option_count; i++)
        add_text(facts, "/options", model->options[i].name, model->options[i].value);
    for (int i = 0; i < model->parameter_count; i++)
        add_number(facts, "/parameters", model->parameters[i].name, value_of(scene, &model->parameters[i]));
}

static void add_method(struct facts *facts, const struct task *task,
                       const struct refdyn_integrator *integrator) {
    const char *method = options_text(task->options, "method"), *from = options_text(task->options, "from");
    const struct refdyn_options *options = &integrator->options;
    add_text(facts, "/", "method", method ? method : refdyn_method_name((int)options->method));
    add_text(facts, "/", "stabilise", simulate_stabilise_names[options->stabilise]);
    add_number(facts, "/", options->tol > 0 ? "tol" : "step",
               options->tol > 0 ? options->tol : options->step);
    add_text(facts, "/", "from", from ? from : "initial");
    add_number(facts, "/", "until", task->until);
}

static bool begin_hdf5(struct row_sink *sink, const struct table *table) {
    struct memory memory = format_arena_start();
    struct facts facts = {.memory = &memory};
    add_model(&facts, sink->task->scene);
    add_method(&facts, sink->task, table->integrator);
    const struct motion_layout layout = {.parts = table->parts,
                                         .facts = facts.list,
                                         .names = table->names,
                                         .units = table->units,
                                         .part_count = table->part_count,
                                         .fact_count = facts.count,
                                         .width = table->count};
    sink->writer = hdf5_motion_create(sink->path, &layout);
    sink->is_lost = !sink->writer;
    memory_release(&memory);
    return sink->writer;
}

static bool put_hdf5(struct row_sink *sink, const struct table *table) {
    return hdf5_motion_put(sink->writer, table->values);
}

/* If writing has failed, HDF5 leaves no readable file. */
static bool end_hdf5(struct row_sink *sink) {
    sink->is_lost = !sink->writer || !hdf5_motion_finish(sink->writer);
    sink->writer = NULL;
    return !sink->is_lost;
}

struct row_sink simulate_row_sink_hdf5(const char *path, const struct task *task) {
    static const struct row_form form = {begin_hdf5, put_hdf5, end_hdf5};
    return (struct row_sink){.form = &form, .path = path, .task = task};
}

/* ---- All ---- */

bool simulate_row_sink_begin(struct row_sink *sink, const struct table *table) {
    return sink->form->begin(sink, table);
}

bool simulate_row_sink_put(struct row_sink *sink, const struct table *table) {
    return sink->form->put(sink, table);
}

bool simulate_row_sink_end(struct row_sink *sink) {
    return sink->form->end(sink);
}

bool simulate_row_sink_copy(FILE *numbers, struct row_sink *to, struct table *table) {
    const size_t count = (size_t)table->count;
    bool is_good = simulate_row_sink_begin(to, table);
    rewind(numbers);
    while (is_good && fread(table->values, sizeof *table->values, count, numbers) == count)
        is_good = simulate_row_sink_put(to, table);
    return simulate_row_sink_end(to) && is_good;
}
