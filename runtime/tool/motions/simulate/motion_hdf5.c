/* A motion as HDF5, with all that it was made from: the sink of rows for hdf5_files.h. */
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include "gen/read/read.h"

#include <string.h>

/* What the file tells, in the making. */
struct facts {
    struct memory *memory;
    struct motion_fact *list;
    int count, room;
};

static void add(struct facts *facts, struct motion_fact fact) {
    facts->list = memory_room(facts->memory, facts->list, facts->count, &facts->room, sizeof *facts->list);
    facts->list[facts->count++] = fact;
}

static void add_text(struct facts *facts, const char *object, const char *name, const char *text) {
    add(facts, (struct motion_fact){.object = object, .name = name, .text = text});
}

static void add_number(struct facts *facts, const char *object, const char *name, double number) {
    add(facts, (struct motion_fact){.object = object, .name = name, .number = number});
}

/* The one that the equations read; else what the model says of it. */
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
    add_text(facts, "/", "stabilise", stabilise_names[options->stabilise]);
    add_number(facts, "/", options->tol > 0 ? "tol" : "step",
               options->tol > 0 ? options->tol : options->step);
    add_text(facts, "/", "from", from ? from : "initial");
    add_number(facts, "/", "until", task->until);
}

static bool begin(struct row_sink *sink, const struct table *table) {
    struct memory memory = arena_start();
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

static bool put(struct row_sink *sink, const struct table *table) {
    return hdf5_motion_put(sink->writer, table->values);
}

/* HDF5 leaves no file that can be read when not all could be written. */
static bool end(struct row_sink *sink) {
    sink->is_lost = !sink->writer || !hdf5_motion_finish(sink->writer);
    sink->writer = NULL;
    return !sink->is_lost;
}

struct row_sink row_sink_hdf5(const char *path, const struct task *task) {
    static const struct row_form form = {begin, put, end};
    return (struct row_sink){.form = &form, .path = path, .task = task};
}
