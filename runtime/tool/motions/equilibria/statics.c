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
        return options_error(options, option, ": the model has no %s '%s'; the nearest is %s", what, name,
                             near);
    return options_error(options, option, ": the model has no %s '%s'", what, name);
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
    const int count = result->unstable ? result->unstable : result->neutral;
    if (count == 0)
        return "stable";
    return format_text("%s in %d direction%s", result->unstable ? "unstable" : "neutral", count,
                       count > 1 ? "s" : "");
}

/* How stability was determined. */
static const char *const criterion_words[] = {[REFDYN_BY_POTENTIAL] = "potential",
                                              [REFDYN_BY_LINEAR_MOTION] = "linear motion",
                                              [REFDYN_BY_SYMMETRIC_PART] = "symmetric part"};

static const char *const criterion_notes[] = {
    [REFDYN_BY_LINEAR_MOTION] = "its forces have no potential, so the growing modes were counted; refdyn "
                                "modes shows them",
    [REFDYN_BY_SYMMETRIC_PART] =
        "its forces have no potential and the motion no finite tangent, so the symmetric part of the "
        "stiffness was used"};

/* Prints how stability was determined if the forces have no potential. */
static void print_criterion(const struct refdyn_statics_result *result) {
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

/* Prints which rows have no part in statics although they are not released, and why. */
static void print_rows_without_part(const struct scene *scene, const struct refdyn_statics_options *statics) {
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
        record_print_residuals(&scene->work, scene->state.t, scene->q, scene->qd, "the start", stderr);
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
        print_rows_without_part(scene, &equilibrium->options);
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

/* ---- The command ---- */

/* Prints explanations of the result that are no warnings. */
static void print_notes(const struct scene *scene, const struct equilibrium *equilibrium) {
    const struct refdyn_statics_result *result = &equilibrium->result;
    if (result->limit_points)
        fprintf(stderr, "refdyn: %d limit point%s of the load passed\n", result->limit_points,
                result->limit_points > 1 ? "s" : "");
    if (!result->unstable)
        print_criterion(result);
    if (result->is_indeterminate)
        fputs("refdyn: the forces of the contacts are not unique; the smallest ones are printed\n", stderr);
    print_rows_without_part(scene, &equilibrium->options);
}

/* Writes gaps and forces of the contacts, which begin at row `from` of the options. */
static void put_contacts(struct document *document, const struct scene *scene,
                         const struct equilibrium *equilibrium, int from) {
    const struct refdyn_statics_options *options = &equilibrium->options;
    const struct refdyn_statics_result *result = &equilibrium->result;
    const int first = refdyn_programme_rows(scene->model);
    format_put_open(document, "contacts", '[');
    for (int i = from; i < options->row_count; i++) {
        format_put_open(document, NULL, '{');
        format_put_text(document, "name", scene->model->rows[options->rows[i]].name);
        format_put_number(document, "gap", result->contact_gap[options->rows[i] - first]);
        format_put_number(document, "force", result->lambda[i]);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

static void put_rows(struct document *document, const struct scene *scene,
                     const struct equilibrium *equilibrium) {
    const struct refdyn_statics_options *options = &equilibrium->options;
    const int first = refdyn_programme_rows(scene->model);
    int count = 0;
    format_put_open(document, "rows", '[');
    for (; count < options->row_count && options->rows[count] < first; count++)
        format_put_text(document, NULL, scene->model->rows[options->rows[count]].name);
    format_put_close(document, ']');
    format_put_array(document, "lambda", equilibrium->result.lambda, count);
    format_put_number(document, "phi", equilibrium->result.phi);
    if (scene->model->m > first)
        put_contacts(document, scene, equilibrium, count);
}

static void put_stability(struct document *document, const struct refdyn_statics_result *result) {
    format_put_text(document, "stability", equilibria_stability_text(result));
    format_put_whole(document, "unstable", result->unstable);
    format_put_whole(document, "neutral", result->neutral);
    format_put_truth(document, "potential", result->has_potential);
    format_put_text(document, "criterion", criterion_words[result->criterion]);
}

static void put_equilibrium(struct document *document, const struct scene *scene,
                            const struct equilibrium *equilibrium) {
    const struct refdyn_model *model = scene->model;
    scene_put_coordinates(document, "coordinates", model, NULL);
    scene_put_state(document, scene);
    scene_put_positions(document, scene);
    format_put_open(document, "hold_force", '[');
    for (int i = 0; i < model->n; i++)
        if (equilibrium->held[i])
            format_put_number(document, NULL, equilibrium->hold_force[i]);
    format_put_close(document, ']');
    format_put_number(document, "residual", equilibrium->result.residual);
    put_rows(document, scene, equilibrium);
    put_stability(document, &equilibrium->result);
}

static void warn_of_rates(const struct scene *scene, const char *path) {
    for (int i = 0; scene->state.qd && i < scene->model->n; i++) {
        if (scene->state.qd[i] == 0)
            continue;
        fprintf(stderr, "%s: warning: qd: statics sets all rates to 0\n", path);
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
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    put_equilibrium(&document, scene, &equilibrium);
    format_put_close(&document, '}');
    print_notes(scene, &equilibrium);
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
    .options = "output state hold release way set fold",
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
