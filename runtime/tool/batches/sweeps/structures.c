/*
 * The structures of a batch: groups cases by their options, compiles one model for each group, and looks up
 * what varies in it.
 */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- Sorting ---- */

/* Returns whether cases a and b have equal options. */
static bool is_same_structure(const struct cases *cases, long a, long b) {
    for (int i = 0; i < cases->width; i++)
        if (cases->columns[i].kind == VARIED_OPTION &&
            cases->columns[i].values[a] != cases->columns[i].values[b])
            return false;
    return true;
}

/* Hash of the options of a case. */
static uint64_t hash_of_options(const struct cases *cases, long number) {
    uint64_t hash = 0;
    for (int i = 0; i < cases->width; i++)
        if (cases->columns[i].kind == VARIED_OPTION)
            hash = (hash ^ (uint64_t)cases->columns[i].values[number]) * UINT64_C(0x9e3779b97f4a7c15) + 1;
    return hash ^ hash >> 32;
}

/* Size of a hash table with the number of a structure plus one, or 0 if a place is free. At most a quarter is
 * used. */
enum { PLACES = 4 * STRUCTURES_MOST };

/* The place of the case's structure in the table, or the free place where it belongs. */
static int *find_structure(const struct structures *structures, int places[static PLACES],
                           const struct cases *cases, long number) {
    size_t place = hash_of_options(cases, number) % PLACES;
    while (places[place] && !is_same_structure(cases, structures->list[places[place] - 1].example, number))
        place = (place + 1) % PLACES;
    return &places[place];
}

static void add_settings(struct structure *structure, struct memory *memory, const struct cases *cases,
                         long number) {
    struct options *options = &structure->options;
    const size_t size = sizeof *options->settings, count = (size_t)options->setting_count;
    options->settings =
        memory_grow(memory, options->settings, count * size, (count + (size_t)cases->width) * size);
    for (int i = 0; i < cases->width; i++) {
        const struct varied *column = &cases->columns[i];
        if (column->kind == VARIED_OPTION)
            options->settings[options->setting_count++] =
                (struct setting){.name = column->target, .value = column->texts[(int)column->values[number]]};
    }
}

static void add_structure(struct structures *structures, struct memory *memory, const struct cases *cases,
                          long number, const struct options *options) {
    structures->list =
        memory_room(memory, structures->list, structures->count, &structures->room, sizeof *structures->list);
    struct structure *structure = &structures->list[structures->count++];
    *structure = (struct structure){.options = *options, .example = number};
    add_settings(structure, memory, cases, number);
}

/* Sets the number of each case's structure; returns false if there are too many. */
static bool find_structures(struct structures *structures, struct memory *memory, const struct cases *cases,
                            const struct options *options, int *structure_of) {
    int *places = memory_get(memory, PLACES * sizeof *places);
    for (long number = 0; number < cases->count; number++) {
        int *place = find_structure(structures, places, cases, number);
        if (!*place && structures->count == STRUCTURES_MOST)
            return false;
        if (!*place) {
            add_structure(structures, memory, cases, number, options);
            *place = structures->count;
        }
        structure_of[number] = *place - 1;
    }
    return true;
}

enum status sweeps_structures_sort(struct structures *structures, struct memory *memory,
                                   const struct cases *cases, long first, long end,
                                   const struct options *options) {
    int *structure_of = memory_get(memory, ((size_t)cases->count + 1) * sizeof *structure_of);
    *structures = (struct structures){.count = 0};
    if (!find_structures(structures, memory, cases, options, structure_of)) {
        fprintf(stderr,
                "refdyn: %s: more than %d structures; split the sweep into several batches, since all models "
                "are compiled and open at once\n",
                options->operands[options->operand_count - 1], STRUCTURES_MOST);
        return STATUS_FAULT;
    }
    for (long number = first; number < end; number++)
        structures->list[structure_of[number]].count++;
    for (int i = 0; i < structures->count; i++) {
        struct structure *structure = &structures->list[i];
        structure->numbers = memory_get(memory, ((size_t)structure->count + 1) * sizeof *structure->numbers);
        structure->count = 0;
    }
    for (long number = first; number < end; number++) {
        struct structure *structure = &structures->list[structure_of[number]];
        structure->numbers[structure->count++] = number;
    }
    return STATUS_DONE;
}

/* ---- Compiling ---- */

static unsigned needs_of(const struct options *options, const struct cases *cases,
                         const struct refdyn_options *integration) {
    unsigned needs = simulate_needs(options) | NEEDS_POINT_RATES | NEEDS_NO_WARNINGS | NEEDS_OPTIMISED;
    for (int i = 0; i < cases->width; i++)
        if (cases->columns[i].kind == VARIED_PARAMETER)
            needs |= NEEDS_EACH_START;
    if (options_has(options, "realise"))
        return needs | REALISE_NEEDS;
    return refdyn_method_is_implicit(integration->method) ? needs | NEEDS_TANGENT : needs;
}

static enum status open_played(struct structure *structure) {
    if (!options_has(&structure->options, "realise"))
        return STATUS_DONE;
    structure->is_played = true;
    return realise_open_played(&structure->played, &structure->options, NEEDS_OPTIMISED);
}

static enum status open_scene(struct structure *structure) {
    structure->is_open = true;
    const enum status status = scene_open(&structure->scene, &structure->options, structure->needs,
                                          realise_state_path(&structure->options));
    return status == STATUS_DONE ? open_played(structure) : status;
}

/* Compiles in a separate process, which leaves the code in the cache. The caller reports errors when it opens
 * the scene itself. */
static pid_t compile_beside(const struct structure *structure) {
    const pid_t pid = fork();
    if (pid != 0)
        return pid;
    struct structure own = *structure;
    const int nowhere = open("/dev/null", O_WRONLY);
    if (nowhere >= 0)
        dup2(nowhere, STDERR_FILENO);
    open_scene(&own);
    scene_close(&own.scene);
    if (own.is_played)
        scene_close(&own.played);
    _exit(0);
}

static void wait_for_one(void) {
    while (wait(NULL) < 0 && errno == EINTR)
        continue;
}

/* Compiles all structures, at most `most` at a time. */
static void compile_all(const struct structures *structures, int most) {
    int running = 0;
    for (int i = 0; i < structures->count && structures->count > 1; i++) {
        if (running == most) {
            wait_for_one();
            running--;
        }
        running += compile_beside(&structures->list[i]) > 0;
    }
    for (; running > 0; running--)
        wait_for_one();
}

/* ---- Where the model has what varies ---- */

static enum refdyn_varied what_of(enum varied_kind kind) {
    switch (kind) {
    case VARIED_INPUT:
        return REFDYN_VARIED_INPUT;
    case VARIED_COORDINATE:
        return REFDYN_VARIED_COORDINATE;
    case VARIED_RATE:
        return REFDYN_VARIED_RATE;
    case VARIED_SAMPLES:
        return REFDYN_VARIED_SAMPLES;
    default:
        return REFDYN_VARIED_PARAMETER;
    }
}

static int place_of(const struct refdyn_model *model, const struct varied *column) {
    if (column->kind == VARIED_PARAMETER)
        return refdyn_find_name(model->parameters, model->parameter_count, column->target);
    if (column->kind == VARIED_INPUT)
        return refdyn_find_name(model->inputs, model->input_count, column->target);
    return refdyn_find_name(model->coordinates, model->n, column->target);
}

static enum status read_samples(struct structure *structure, struct memory *memory,
                                const struct varied *column) {
    structure->samples = memory_get(memory, (size_t)column->text_count * sizeof *structure->samples);
    for (int i = 0; i < column->text_count; i++) {
        struct inputs inputs;
        if (!scene_inputs_read(&inputs, column->texts[i], structure->scene.model))
            return STATUS_FAULT;
        structure->samples[structure->sample_count++] = inputs.samples;
    }
    return STATUS_DONE;
}

static int declared_parameter(const struct model *model, const char *name) {
    for (int i = 0; i < model->parameter_count; i++)
        if (strcmp(model->parameters[i].name, name) == 0)
            return i;
    return -1;
}

/* What a structure lacks has no value (NaN) in its cases. A declared parameter that no function reads keeps
 * its value. */
static void leave_out(const struct structure *structure, const struct varied *column) {
    if (column->kind == VARIED_INPUT ||
        (column->kind == VARIED_PARAMETER &&
         declared_parameter(&structure->scene.generation.model, column->target) >= 0))
        return;
    for (long i = 0; i < structure->count; i++)
        column->values[structure->numbers[i]] = NAN;
}

static enum status find_columns(struct structure *structure, struct memory *memory,
                                const struct cases *cases) {
    structure->columns = memory_get(memory, ((size_t)cases->width + 1) * sizeof *structure->columns);
    for (int i = 0; i < cases->width; i++) {
        const struct varied *column = &cases->columns[i];
        if (column->kind == VARIED_OPTION)
            continue;
        const int place = column->kind == VARIED_SAMPLES ? 0 : place_of(structure->scene.model, column);
        if (place < 0) {
            leave_out(structure, column);
            continue;
        }
        structure->columns[structure->column_count++] =
            (struct refdyn_batch_column){what_of(column->kind), place, column->values};
        if (column->kind == VARIED_SAMPLES && read_samples(structure, memory, column) != STATUS_DONE)
            return STATUS_FAULT;
    }
    return STATUS_DONE;
}

static bool has_input(const struct refdyn_samples *samples, int place) {
    for (int i = 0; i < samples->width; i++)
        if (samples->place[i] == place)
            return true;
    return false;
}

/* Samples of an input would replace the number that varies. */
static enum status check_inputs(const struct structure *structure) {
    for (int i = 0; i < structure->column_count; i++) {
        const struct refdyn_batch_column *column = &structure->columns[i];
        for (int k = 0; k < structure->sample_count && column->what == REFDYN_VARIED_INPUT; k++)
            if (has_input(&structure->samples[k], column->place)) {
                fprintf(
                    stderr,
                    "refdyn: the input %s varies as a number and in files of inputs; remove one of them\n",
                    structure->scene.model->inputs[column->place].name);
                return STATUS_FAULT;
            }
    }
    return STATUS_DONE;
}

/* ---- Statics ---- */

static bool is_held(const struct structure *structure, int place) {
    for (int i = 0; i < structure->held_count; i++)
        if (structure->held[i] == place)
            return true;
    return false;
}

/* The start value of a free coordinate would only be where Newton's method begins. */
static enum status check_held(const struct structure *structure) {
    const struct refdyn_model *model = structure->scene.model;
    for (int i = 0; i < structure->column_count; i++) {
        const struct refdyn_batch_column *column = &structure->columns[i];
        if (column->what != REFDYN_VARIED_COORDINATE || is_held(structure, column->place))
            continue;
        fprintf(stderr,
                "refdyn: the start value of %s varies, but statics moves this coordinate; add it to hold\n",
                model->coordinates[column->place].name);
        return STATUS_FAULT;
    }
    return STATUS_DONE;
}

static enum status find_held(struct structure *structure, struct memory *memory) {
    const int n = structure->scene.model->n;
    int *marks = memory_get(memory, ((size_t)n + 1) * sizeof *marks);
    structure->held = memory_get(memory, ((size_t)n + 1) * sizeof *structure->held);
    const enum status status = equilibria_choose_held(&structure->scene, &structure->options, marks);
    for (int i = 0; i < n; i++)
        if (marks[i])
            structure->held[structure->held_count++] = i;
    return status == STATUS_DONE ? check_held(structure) : status;
}

/* A varied parameter that a row would otherwise read from the start of the motion counts as given. */
static enum status find_statics(struct structure *structure, struct memory *memory) {
    const struct scene *scene = &structure->scene;
    int *is_varied = memory_get(memory, ((size_t)scene->model->parameter_count + 1) * sizeof *is_varied);
    for (int i = 0; i < structure->column_count; i++)
        if (structure->columns[i].what == REFDYN_VARIED_PARAMETER)
            is_varied[structure->columns[i].place] = 1;
    const enum status status = find_held(structure, memory);
    return status == STATUS_DONE
               ? equilibria_choose_options(scene, &structure->options, is_varied, &structure->statics)
               : status;
}

/* ---- All of it ---- */

static enum status open_structure(struct structure *structure, struct memory *memory,
                                  const struct cases *cases, const struct refdyn_options *integration) {
    enum status status = open_scene(structure);
    if (status == STATUS_DONE && structure->is_played)
        status = realise_check_model(&structure->scene);
    if (status == STATUS_DONE)
        status = simulate_fit(&structure->scene, &structure->options, integration);
    if (status == STATUS_DONE)
        status = find_columns(structure, memory, cases);
    if (status == STATUS_DONE)
        status = check_inputs(structure);
    if (status == STATUS_DONE)
        status = structure->needs & NEEDS_STATICS
                     ? find_statics(structure, memory)
                     : equilibria_refuse_options(&structure->options, "--from statics");
    return status;
}

/* ---- All structures ---- */

/* The column of the structure with these values; NULL if its model lacks what varies. */
static const struct refdyn_batch_column *find_column(const struct structure *structure,
                                                     const struct varied *varied) {
    for (int k = 0; k < structure->column_count; k++)
        if (structure->columns[k].values == varied->values)
            return &structure->columns[k];
    return NULL;
}

static bool is_read(const struct structures *structures, const struct varied *column) {
    for (int i = 0; i < structures->count; i++)
        if (find_column(&structures->list[i], column))
            return true;
    return false;
}

/* Cases that differ only in such a parameter have equal results. */
static void warn_of_unread(const struct structures *structures, const struct cases *cases) {
    for (int i = 0; i < cases->width; i++) {
        const struct varied *column = &cases->columns[i];
        if (column->kind == VARIED_PARAMETER && !is_read(structures, column))
            fprintf(stderr, "refdyn: warning: %s: varies, but nothing in this model reads it\n",
                    column->target);
    }
}

static bool is_anchored(const struct refdyn_model *model, const struct refdyn_batch_column *column) {
    return column->what == REFDYN_VARIED_PARAMETER && refdyn_find_anchored(model, column->place) >= 0;
}

bool sweeps_structures_refuse(const struct structure *structure, const struct cases *cases, long number,
                              char fact[static REFUSED_LENGTH]) {
    for (int i = 0; i < cases->width; i++) {
        const double value = cases->columns[i].values[number];
        const struct refdyn_batch_column *column =
            isfinite(value) ? NULL : find_column(structure, &cases->columns[i]);
        const bool may_be_nan = !(structure->needs & NEEDS_STATICS) && isnan(value);
        if (!column || (may_be_nan && is_anchored(structure->scene.model, column)))
            continue;
        snprintf(fact, REFUSED_LENGTH, "%s: value %s; must be finite", cases->columns[i].name,
                 text_not_finite(value));
        return true;
    }
    return false;
}

enum status sweeps_structures_open(struct structures *structures, struct memory *memory,
                                   const struct cases *cases, const struct refdyn_options *integration,
                                   int threads) {
    enum status status = STATUS_DONE;
    for (int i = 0; i < structures->count; i++)
        structures->list[i].needs = needs_of(&structures->list[i].options, cases, integration);
    compile_all(structures, threads);
    for (int i = 0; i < structures->count && status == STATUS_DONE; i++)
        status = open_structure(&structures->list[i], memory, cases, integration);
    if (status == STATUS_DONE)
        warn_of_unread(structures, cases);
    return status;
}

void sweeps_structures_close(struct structures *structures) {
    for (int i = 0; i < structures->count; i++) {
        if (structures->list[i].is_open)
            scene_close(&structures->list[i].scene);
        if (structures->list[i].is_played)
            scene_close(&structures->list[i].played);
    }
}
