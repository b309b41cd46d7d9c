/* Computes the equilibrium of a scene for a command: reads its options, and reports failure and stability on
 * stderr. `refdyn statics` prints the equilibrium of a model under its loads as JSON. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/options/options.h"

/* ---- Options ---- */

static const char *const way_words[] = {
    [REFDYN_ALONG_LOAD] = "load", [REFDYN_ALONG_PATH] = "path", [REFDYN_DOWNHILL] = "downhill", NULL};

const struct option_rule equilibria_rules[] = {
    {"hold", "a,b", OPTION_FREEING_LIST,
     "coordinates held in statics, modes and linear models, instead of the model's ('' frees all)", NULL,
     NULL},
    {"release", "a,b", OPTION_LIST, "constraint rows that do not hold in statics", NULL, NULL},
    {"way", "HOW", OPTION_TEXT,
     "how statics finds the equilibrium: load (default) raises the load and jumps where it cannot be "
     "raised further, path passes limit points step by step, downhill leads to a stable one",
     way_words, NULL},
    {.name = NULL}};

/* "; use one of a, b": the names of the model. */
static const char *all_names(const char *const *names, int count) {
    enum { MOST_SHOWN = 40 };
    const char *text =
        count > 0 ? format_text("; use %s%s", count > 1 ? "one of " : "", names[0]) : "; there are none";
    for (int i = 1; i < count && i < MOST_SHOWN; i++)
        text = format_text("%s, %s", text, names[i]);
    return count > MOST_SHOWN ? format_text("%s ...", text) : text;
}

static enum status unknown_name(const struct options *options, const char *option, const char *what,
                                const char *name, const char *const *names, int count) {
    const char *near = message_nearest_name(name, names, count);
    if (near)
        return options_error(options, option, ": the model has no %s '%s'; the nearest is %s", what, name,
                             near);
    return options_error(options, option, ": the model has no %s '%s'%s", what, name,
                         all_names(names, count));
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
            return options_error(options, "release",
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
    return given ? options_error(options, given, " needs %s", place) : STATUS_DONE;
}

/* ---- Messages ---- */

const char *equilibria_stability_text(const struct refdyn_statics_result *result) {
    char text[RECORD_STABILITY_LENGTH];
    return format_text("%s", record_stability_text(result, text));
}

/* The equilibrium as the record of it. */
static struct record_equilibrium record_of(struct scene *scene, const struct equilibrium *equilibrium) {
    const struct model *model = &scene->generation.model;
    const char **starts = format_allocate((size_t)scene->model->m, sizeof *starts);
    for (int i = 0; i < scene->model->m; i++)
        starts[i] = model->rows[i].start_count > 0 ? model->rows[i].starts[0] : NULL;
    return (struct record_equilibrium){.work = &scene->work,
                                       .options = &equilibrium->options,
                                       .result = &equilibrium->result,
                                       .held = equilibrium->held,
                                       .hold_force = equilibrium->hold_force,
                                       .q = scene->q,
                                       .qd = scene->qd,
                                       .starts = starts};
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
    refdyn_leave_statics(scene->model, scene->q, scene->qd);
    const struct record_equilibrium record = record_of(scene, equilibrium);
    if (answer != REFDYN_OK)
        record_print_no_equilibrium(&record, answer, stderr);
    else
        record_print_equilibrium(&record, stderr);
    return answer == REFDYN_OK ? STATUS_DONE : STATUS_NUMBERS;
}

enum status equilibria_find(struct scene *scene, const struct options *options,
                            struct equilibrium *equilibrium) {
    const size_t n = (size_t)scene->model->n;
    refdyn_enter_statics(scene->model, scene->q, scene->qd);
    equilibrium->held = format_allocate(n, sizeof *equilibrium->held);
    equilibrium->hold_force = format_allocate(n, sizeof *equilibrium->hold_force);
    enum status status = equilibria_choose_held(scene, options, equilibrium->held);
    if (status == STATUS_DONE)
        status = equilibria_choose_options(scene, options, NULL, &equilibrium->options);
    return status == STATUS_DONE ? solve(scene, equilibrium) : status;
}

const char *equilibria_place(const struct options *options) {
    return options_text(options, "at") ? options_text(options, "at") : "statics";
}

enum status equilibria_choose_state(struct scene *scene, const struct options *options, const char *at,
                                    int *held) {
    struct equilibrium equilibrium;
    enum status status;
    if (strcmp(at, "statics") != 0) {
        status = equilibria_refuse_options(options, "--at statics");
        return status == STATUS_DONE ? equilibria_choose_held(scene, options, held) : status;
    }
    status = equilibria_find(scene, options, &equilibrium);
    if (status == STATUS_DONE)
        memcpy(held, equilibrium.held, (size_t)scene->model->n * sizeof *held);
    return status;
}

/* ---- The command ---- */

static void put_equilibrium(struct document *document, const struct scene *scene,
                            const struct record_equilibrium *equilibrium) {
    const struct record_writer writer = scene_writer(document);
    scene_put_coordinates(document, "coordinates", scene->model, NULL);
    scene_put_state(document, scene);
    scene_put_positions(document, scene);
    record_put_equilibrium(equilibrium, &writer);
}

static void warn_of_rates(const struct scene *scene, const char *path) {
    for (int i = 0; scene->state.qd && i < refdyn_joint_count(scene->model); i++) {
        if (scene->state.qd[i] == 0)
            continue;
        format_complain("%s: warning: qd: statics sets all rates to 0\n", path);
        return;
    }
}

static enum status find_and_print(struct scene *scene, const struct options *options) {
    struct equilibrium equilibrium;
    warn_of_rates(scene, options_text(options, "state"));
    const enum status status = equilibria_find(scene, options, &equilibrium);
    if (status != STATUS_DONE)
        return status;
    struct document document;
    const struct record_equilibrium record = record_of(scene, &equilibrium);
    scene_document_open(&document);
    put_equilibrium(&document, scene, &record);
    equilibria_put_limits(scene, &equilibrium, &document);
    format_put_close(&document, '}');
    record_print_notes(&record, stderr);
    return scene_finish(scene, &document);
}

static enum status run_statics(const struct options *options) {
    return scene_run(options, NEEDS_RESULT | NEEDS_STATICS | NEEDS_POINTS, options_text(options, "state"),
                     find_and_print);
}

const struct command statics_command = {
    .name = "statics",
    .run = run_statics,
    .operands = "MODEL.lua",
    .options = "output state hold release way parameters set fold",
    .tables = {equilibria_rules, scene_rules},
    .output = "FILE",
    .purpose = "equilibrium",
    .help = "Prints JSON: coordinates, q, points, hold_force of the held coordinates, residual, rows that "
            "hold, their\n"
            "multipliers, phi, stability. Rows of positions hold at t = 0, except rows of a programme that "
            "begins at the start\n"
            "of the motion. Such a row holds, too, if --set gives each value that it reads from there.\n\n"
            "  refdyn statics models/manipulator.lua\n"
            "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi,effector_z\n"
            "  refdyn statics models/manipulator.lua --hold column_psi,arm_psi --set xc=0.54\n"
            "  refdyn statics models/slidercrank.lua --release 'guide y'\n"};
