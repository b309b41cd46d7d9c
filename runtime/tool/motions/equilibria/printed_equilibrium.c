/* Computes the equilibrium of a scene for a command: reads its options, and reports failure and stability on
 * stderr. */
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/equilibria/equilibria.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Options ---- */

static const char *const way_words[] = {
    [REFDYN_ALONG_LOAD] = "load", [REFDYN_ALONG_PATH] = "path", [REFDYN_DOWNHILL] = "downhill", NULL};

const struct option_rule statics_rules[] = {
    {"hold", "a,b", OPTION_FREEING_LIST,
     "coordinates held in statics and modes, instead of the model's ('' frees all)", NULL, NULL},
    {"release", "a,b", OPTION_LIST, "constraint rows that do not hold in statics", NULL, NULL},
    {"way", "HOW", OPTION_TEXT,
     "how statics finds the equilibrium: load (default) raises the load and jumps where it cannot be "
     "raised further, path passes limit points step by step, downhill leads to a stable one",
     way_words, NULL},
    {.name = NULL}};

static enum status unknown_name(const struct options *options, const char *option, const char *what,
                                const char *name, const char *const *names, int count) {
    const char *near = message_nearest_name(name, names, count);
    if (near)
        return option_error(options, option, ": the model has no %s '%s'; the nearest is %s", what, name,
                            near);
    return option_error(options, option, ": the model has no %s '%s'", what, name);
}

static enum status unknown_coordinate(const struct scene *scene, const struct options *options,
                                      const char *name) {
    const struct refdyn_model *model = scene->model;
    const char **names = format_allocate((size_t)model->n, sizeof *names);
    for (int i = 0; i < model->n; i++)
        names[i] = model->coordinates[i].name;
    return unknown_name(options, "hold", "coordinate", name, names, model->n);
}

static enum status unknown_row(const struct scene *scene, const struct options *options, const char *name) {
    const struct refdyn_model *model = scene->model;
    const char **names = format_allocate((size_t)model->m, sizeof *names);
    for (int i = 0; i < model->m; i++)
        names[i] = model->rows[i].name;
    return unknown_name(options, "release", "constraint row", name, names, model->m);
}

enum status equilibria_choose_held(struct scene *scene, const struct options *options, int *held) {
    const char *hold = options_text(options, "hold");
    const char *list = hold && *hold ? hold : NULL;
    for (const char **name = options_list(list); *name; name++) {
        const int place = refdyn_find_name(scene->model->coordinates, scene->model->n, *name);
        if (place < 0)
            return unknown_coordinate(scene, options, *name);
        held[place] = 1;
    }
    for (int i = 0; !hold && i < scene->model->held_count; i++)
        held[scene->model->held[i]] = 1;
    return STATUS_DONE;
}

/* Returns whether an anchored parameter has a given value. Other parameters always have one. */
static bool is_given(const struct scene *scene, const int *given_beside, const char *name) {
    const struct refdyn_model *model = scene->model;
    for (int i = 0; i < model->anchored_count; i++)
        if (strcmp(model->parameters[model->anchored[i]].name, name) == 0)
            return scene->given[i] || (given_beside && given_beside[model->anchored[i]]);
    return true;
}

/* Returns whether the row begins where the motion does, so that its start follows from the equilibrium. */
static bool waits_for_start(const struct scene *scene, const int *given_beside, const struct row *row) {
    for (int i = 0; i < row->start_count; i++)
        if (!is_given(scene, given_beside, row->starts[i]))
            return true;
    return false;
}

/* Marks in released (m) the rows of --release. */
static enum status choose_released(const struct scene *scene, const struct options *options, bool *released) {
    const char *release = options_text(options, "release");
    const char *list = release && *release ? release : NULL;
    for (const char **name = options_list(list); *name; name++) {
        const int row = refdyn_find_row(scene->model, *name);
        if (row < 0)
            return unknown_row(scene, options, *name);
        if (scene->model->rows[row].level != REFDYN_POSITION)
            return option_error(options, "release",
                                ": %s is not a row of positions and has no part in statics; omit it", *name);
        released[row] = true;
    }
    return STATUS_DONE;
}

static enum status choose_way(const struct options *options, struct refdyn_statics_options *statics) {
    int way;
    const enum status status = options_choose(options, "way", &way);
    statics->way = (enum refdyn_statics_way)way;
    return status;
}

/* Rows that must be satisfied need a tangent, which the printed form lacks. */
static enum status check_tangent(const struct scene *scene, const struct refdyn_statics_options *statics) {
    if (statics->row_count == 0 || refdyn_has_tangent(scene->model))
        return STATUS_DONE;
    fprintf(stderr,
            "refdyn: %s: statics with constraint rows needs the corrected form; release the rows with "
            "--release %s\n",
            scene->model->name, scene->model->rows[statics->rows[0]].name);
    return STATUS_FAULT;
}

enum status equilibria_choose_options(const struct scene *scene, const struct options *options,
                                      const int *given_beside, struct refdyn_statics_options *statics) {
    const struct refdyn_model *model = scene->model;
    bool *released = format_allocate((size_t)model->m, sizeof *released);
    int *rows = format_allocate((size_t)model->m, sizeof *rows);
    *statics = refdyn_statics_default();
    enum status status = choose_released(scene, options, released);
    if (status == STATUS_DONE)
        status = choose_way(options, statics);
    if (status != STATUS_DONE)
        return status;
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level == REFDYN_POSITION && !released[i] &&
            !waits_for_start(scene, given_beside, &scene->generation.model.rows[i]))
            rows[statics->row_count++] = i;
    statics->rows = rows;
    statics->t = scene->state.t;
    return check_tangent(scene, statics);
}

enum status equilibria_refuse_options(const struct options *options, const char *place) {
    const char *given = options_text(options, "release") ? "release"
                        : options_text(options, "way")   ? "way"
                                                         : NULL;
    return given ? option_error(options, given, " needs %s", place) : STATUS_DONE;
}

/* ---- Messages ---- */

const char *equilibria_stability_text(const struct refdyn_statics_result *result) {
    const int count = result->unstable ? result->unstable : result->neutral;
    if (count == 0)
        return "stable";
    return format_text("%s in %d direction%s", result->unstable ? "unstable" : "neutral", count,
                       count > 1 ? "s" : "");
}

const char *const equilibria_criterion_words[] = {[REFDYN_BY_POTENTIAL] = "potential",
                                                  [REFDYN_BY_LINEAR_MOTION] = "linear motion",
                                                  [REFDYN_BY_SYMMETRIC_PART] = "symmetric part"};

static const char *const criterion_notes[] = {
    [REFDYN_BY_LINEAR_MOTION] = "its forces have no potential, so the growing modes were counted; refdyn "
                                "modes shows them",
    [REFDYN_BY_SYMMETRIC_PART] =
        "its forces have no potential and the motion no finite tangent, so the symmetric part of the "
        "stiffness was used"};

void equilibria_print_criterion(const struct refdyn_statics_result *result) {
    if (!result->has_potential)
        fprintf(stderr, "refdyn: the equilibrium is %s; %s\n", equilibria_stability_text(result),
                criterion_notes[result->criterion]);
}

static void warn_of_instability(const struct scene *scene, const struct equilibrium *equilibrium) {
    const struct refdyn_statics_result *result = &equilibrium->result;
    fprintf(stderr, "refdyn: warning: this equilibrium is %s", equilibria_stability_text(result));
    if (result->unstable_coordinate >= 0)
        fprintf(stderr, ", %s moves most", scene->model->coordinates[result->unstable_coordinate].name);
    if (!result->has_potential)
        fprintf(stderr, "; %s", criterion_notes[result->criterion]);
    else if (equilibrium->options.way != REFDYN_DOWNHILL)
        fputs("; --way downhill finds a stable one", stderr);
    fputc('\n', stderr);
}

static void warn(const struct scene *scene, const struct equilibrium *equilibrium) {
    if (!equilibrium->result.is_followed)
        fputs("refdyn: warning: this equilibrium is beyond a limit point; the growing load does not lead to "
              "it\n",
              stderr);
    if (equilibrium->result.unstable)
        warn_of_instability(scene, equilibrium);
}

static const char *unit_of_force(const struct refdyn_model *model, int coordinate) {
    return strcmp(model->coordinates[coordinate].unit, "rad") == 0 ? "N m" : "N";
}

/* Prints the largest force that no spring, row or hold balances. */
static void print_imbalance(struct scene *scene, const struct equilibrium *equilibrium) {
    const struct refdyn_model *model = scene->model;
    const double *force = equilibrium->result.force;
    int largest = -1;
    char text[NUMBER_LENGTH];
    for (int i = 0; i < model->n && force; i++)
        if (!equilibrium->held[i] && (largest < 0 || fabs(force[i]) > fabs(force[largest])))
            largest = i;
    if (largest >= 0)
        fprintf(stderr, "refdyn: the largest imbalance there is at %s: %s %s\n",
                model->coordinates[largest].name, exact_text(force[largest], text),
                unit_of_force(model, largest));
}

void equilibria_print_rows_without_part(const struct scene *scene,
                                        const struct refdyn_statics_options *statics) {
    const struct refdyn_model *model = scene->model;
    int next = 0;
    for (int i = 0; i < model->m; i++) {
        const struct row *row = &scene->generation.model.rows[i];
        if (next < statics->row_count && statics->rows[next] == i)
            next++;
        else if (row->level != ROW_POSITION)
            fprintf(stderr, "refdyn: the row %s is not a row of positions and has no part in statics\n",
                    row->name);
        else if (row->start_count > 0)
            fprintf(
                stderr,
                "refdyn: the row %s begins where the motion does and has no part in statics; --set %s=VALUE "
                "includes it\n",
                row->name, row->starts[0]);
    }
}

static enum status print_failure(struct scene *scene, const struct equilibrium *equilibrium, int answer) {
    const struct refdyn_statics_result *result = &equilibrium->result;
    const enum status status = scene_numbers_failed(scene, answer, scene->state.t, scene->q, NULL);
    if (!result->force && scene->work.fault.row >= 0) {
        scene_print_residuals(&scene->work, scene->state.t, scene->q, scene->qd, "the start");
        return status;
    }
    if (answer != REFDYN_NOT_FINITE)
        print_imbalance(scene, equilibrium);
    if (equilibrium->options.way == REFDYN_DOWNHILL)
        fputs("refdyn: the forces lead to no equilibrium\n", stderr);
    else
        fprintf(stderr, "refdyn: equilibrium reached only up to %.3g of the load\n", result->load);
    if (answer == REFDYN_TANGENT_SINGULAR) {
        fputs("refdyn: --hold keeps free coordinates at their start\n", stderr);
        equilibria_print_rows_without_part(scene, &equilibrium->options);
    }
    if (equilibrium->options.way == REFDYN_ALONG_LOAD)
        fputs("refdyn: --way path passes limit points of the load; --way downhill follows the forces\n",
              stderr);
    return status;
}

/* ---- Computation ---- */

static enum status solve(struct scene *scene, struct equilibrium *equilibrium) {
    const size_t n = (size_t)scene->model->n, size = refdyn_statics_size(scene->model);
    int *list = format_allocate(n, sizeof *list), count = 0;
    for (int i = 0; i < scene->model->n; i++)
        if (equilibrium->held[i])
            list[count++] = i;
    const int answer =
        refdyn_statics(&scene->work, &equilibrium->options, list, count, scene->q, equilibrium->hold_force,
                       &equilibrium->result, format_allocate(1, size), size);
    if (answer != REFDYN_OK)
        return print_failure(scene, equilibrium, answer);
    warn(scene, equilibrium);
    return STATUS_DONE;
}

enum status equilibria_find(struct scene *scene, const struct options *options,
                            struct equilibrium *equilibrium) {
    const size_t n = (size_t)scene->model->n;
    memset(scene->qd, 0, n * sizeof *scene->qd);
    equilibrium->held = format_allocate(n, sizeof *equilibrium->held);
    equilibrium->hold_force = format_allocate(n, sizeof *equilibrium->hold_force);
    enum status status = equilibria_choose_held(scene, options, equilibrium->held);
    if (status == STATUS_DONE)
        status = equilibria_choose_options(scene, options, NULL, &equilibrium->options);
    return status == STATUS_DONE ? solve(scene, equilibrium) : status;
}
