/* `refdyn statics`: the equilibrium of a model under its loads, with some coordinates held. */
#include "command_line/commands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum status unknown_coordinate(struct scene *scene, const struct options *options, const char *name) {
    const struct refdyn_model *model = scene->model;
    const char **names = allocate((size_t)model->n, sizeof *names);
    for (int i = 0; i < model->n; i++)
        names[i] = model->coordinates[i].name;
    const char *near = message_nearest_name(name, names, model->n);
    if (near)
        return option_error(options, "hold", ": the model has no coordinate '%s', the nearest is %s", name,
                            near);
    return option_error(options, "hold", ": the model has no coordinate '%s'", name);
}

enum status choose_held(struct scene *scene, const struct options *options, int *held) {
    const char *list = options->hold && *options->hold ? options->hold : NULL;
    for (const char **name = options_list(list); *name; name++) {
        const int place = refdyn_find_name(scene->model->coordinates, scene->model->n, *name);
        if (place < 0)
            return unknown_coordinate(scene, options, *name);
        held[place] = 1;
    }
    for (int i = 0; !options->hold && i < scene->model->held_count; i++)
        held[scene->model->held[i]] = 1;
    return STATUS_DONE;
}

/* Rows do not act in statics: a loop would fall apart. */
static bool closes_loop(const struct row *row) {
    return row->is_closure;
}

/* The largest force that neither the coordinate's spring nor a hold bears. */
static void print_imbalance(struct scene *scene, const struct equilibrium *equilibrium) {
    const struct refdyn_model *model = scene->model;
    double *Q = allocate_matrix(model->n, 1), *rest = allocate_matrix(model->n, 1);
    int largest = -1;
    char text[NUMBER_LENGTH];
    model->Q(scene->work.p, scene->work.x, 0, scene->q, rest, Q);
    for (int i = 0; i < model->n; i++)
        if (!equilibrium->held[i] && (largest < 0 || fabs(Q[i]) > fabs(Q[largest])))
            largest = i;
    if (largest >= 0)
        fprintf(stderr, "refdyn: there %s is farthest from balance, by %s %s\n",
                model->coordinates[largest].name, exact_text(Q[largest], text),
                strcmp(model->coordinates[largest].unit, "rad") == 0 ? "N m" : "N");
}

static enum status solve(struct scene *scene, struct equilibrium *equilibrium) {
    size_t n = (size_t)scene->model->n, size = refdyn_statics_size(scene->model);
    struct refdyn_statics_options options = refdyn_statics_default();
    struct refdyn_statics_result result;
    int *list = allocate(n, sizeof *list), count = 0;
    for (int i = 0; i < scene->model->n; i++)
        if (equilibrium->held[i])
            list[count++] = i;
    int answer = refdyn_statics(&scene->work, &options, list, count, scene->q, equilibrium->hold_force,
                                &result, allocate(1, size), size);
    equilibrium->residual = result.residual;
    if (answer == REFDYN_OK && !result.is_followed)
        fputs("refdyn: warning: this equilibrium is not the one that the growing load leads to: "
              "there is a limit point before\n",
              stderr);
    if (answer == REFDYN_OK)
        return STATUS_DONE;
    const enum status status = numbers_failed(scene, answer, 0, scene->q, NULL);
    if (answer != REFDYN_NOT_FINITE)
        print_imbalance(scene, equilibrium);
    fprintf(stderr, "refdyn: equilibrium reached under %.3g of the load only\n", result.load);
    if (answer == REFDYN_TANGENT_SINGULAR)
        fputs("refdyn: --hold keeps coordinates at their start\n", stderr);
    return status;
}

enum status check_statics(struct scene *scene, const struct options *options, int *held) {
    const enum status status = scene_refuse_row(
        scene, closes_loop, "closes a loop, statics takes trees only (rows do not act in it)");
    return status == STATUS_DONE ? choose_held(scene, options, held) : status;
}

enum status find_equilibrium(struct scene *scene, const struct options *options,
                             struct equilibrium *equilibrium) {
    size_t n = (size_t)scene->model->n;
    equilibrium->held = allocate(n, sizeof *equilibrium->held);
    equilibrium->hold_force = allocate(n, sizeof *equilibrium->hold_force);
    enum status status = check_statics(scene, options, equilibrium->held);
    if (status == STATUS_DONE)
        status = solve(scene, equilibrium);
    memset(scene->qd, 0, n * sizeof *scene->qd);
    return status;
}

static enum status find_and_print(struct scene *scene, const struct options *options) {
    const struct refdyn_model *model = scene->model;
    struct equilibrium equilibrium;
    const enum status status = find_equilibrium(scene, options, &equilibrium);
    if (status != STATUS_DONE)
        return status;
    struct document document;
    document_open(&document);
    put_open(&document, NULL, '{');
    put_coordinates(&document, "coordinates", model, NULL);
    put_array(&document, "q", scene->q, model->n);
    put_positions(&document, scene);
    put_open(&document, "hold_force", '[');
    for (int i = 0; i < model->n; i++)
        if (equilibrium.held[i])
            put_number(&document, NULL, equilibrium.hold_force[i]);
    put_close(&document, ']');
    put_number(&document, "residual", equilibrium.residual);
    put_close(&document, '}');
    return scene_finish(scene, &document);
}

enum status run_statics(const struct options *options) {
    return scene_run(options, NEEDS_RESULT | NEEDS_STATICS | NEEDS_POINTS, NULL, find_and_print);
}
