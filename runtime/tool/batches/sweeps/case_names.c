/*
 * Resolves varied names: from columns of names and values to columns of cases, which say what part of the
 * model each name is and have values of its type.
 *
 * A varied name is a parameter, an input, an option, a start value or files of samples. Where options vary, a
 * name that the model lacks may exist in another structure of it. Each structure that the cases need is
 * therefore read, which also checks whether the model can have it.
 */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/random/random.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Sets of texts ---- */

/* The place of the text, or the free place where it belongs. */
static int *place_of_text(const struct text_set *set, const char *text) {
    int place = (int)(random_stream(text) % (uint64_t)set->place_count);
    while (set->places[place] && strcmp(set->texts[set->places[place] - 1], text) != 0)
        place = (place + 1) % set->place_count;
    return &set->places[place];
}

/* Doubles the table and enters all texts again. */
static void grow_set(struct text_set *set) {
    set->place_count = set->place_count ? 2 * set->place_count : 64;
    set->places = memory_get(set->memory, (size_t)set->place_count * sizeof *set->places);
    for (int i = 0; i < set->count; i++)
        *place_of_text(set, set->texts[i]) = i + 1;
}

int sweeps_text_set_add(struct text_set *set, const char *text) {
    if (2 * set->count >= set->place_count)
        grow_set(set);
    int *place = place_of_text(set, text);
    if (*place)
        return *place - 1;
    set->texts = memory_room(set->memory, set->texts, set->count, &set->room, sizeof *set->texts);
    set->texts[set->count++] = memory_text(set->memory, text);
    *place = set->count;
    return set->count - 1;
}

/* ---- What a name is ---- */

static const char *const kind_texts[] = {
    [VARIED_PARAMETER] = "a parameter",   [VARIED_INPUT] = "an input",
    [VARIED_COORDINATE] = "a coordinate", [VARIED_RATE] = "a coordinate's rate",
    [VARIED_OPTION] = "an option",        [VARIED_SAMPLES] = "files of samples"};
enum { KINDS = sizeof kind_texts / sizeof *kind_texts };

/* The coordinate whose rate is `name` = COORDINATE_d; NULL if the name has no such ending. */
static const char *coordinate_of_rate(struct memory *memory, const char *name) {
    const size_t length = strlen(name);
    if (length < 3 || strcmp(name + length - 2, "_d") != 0)
        return NULL;
    return memory_format(memory, "%.*s", (int)length - 2, name);
}

/* What a name means in one structure of the model: its target of each kind. */
struct meanings {
    const char *targets[KINDS], *units[KINDS]; /* NULL: no meaning of that kind */
};

static void add_coordinate(struct meanings *meanings, const struct generation *gen, const char *name,
                           bool is_rate) {
    const int i = name ? tree_find_coordinate(&gen->tree, name) : -1;
    if (i < 0)
        return;
    const bool is_angle = gen->tree.frames[i].joint.is_revolute;
    const enum varied_kind kind = is_rate ? VARIED_RATE : VARIED_COORDINATE;
    meanings->targets[kind] = gen->tree.frames[i].name;
    meanings->units[kind] = is_rate ? (is_angle ? "rad/s" : "m/s") : (is_angle ? "rad" : "m");
}

static void add_state(struct meanings *meanings, const struct generation *gen, const char *name) {
    const int i = tree_find_state(&gen->tree, name) - tree_joint_count(&gen->tree);
    if (i < 0)
        return;
    meanings->targets[VARIED_RATE] = gen->model.states[i].name;
    meanings->units[VARIED_RATE] = gen->model.states[i].unit;
}

static struct meanings meanings_of(struct memory *memory, const struct generation *gen, const char *name) {
    const struct model *model = &gen->model;
    struct meanings meanings = {.targets = {NULL}};
    for (int i = 0; i < model->parameter_count; i++)
        if (strcmp(model->parameters[i].name, name) == 0) {
            meanings.targets[VARIED_PARAMETER] = model->parameters[i].name;
            meanings.units[VARIED_PARAMETER] = model->parameters[i].unit;
        }
    for (int i = 0; i < model->input_count; i++)
        if (strcmp(model->inputs[i].name, name) == 0) {
            meanings.targets[VARIED_INPUT] = model->inputs[i].name;
            meanings.units[VARIED_INPUT] = model->inputs[i].unit;
        }
    for (int i = 0; i < model->option_count; i++)
        if (strcmp(model->options[i].name, name) == 0)
            meanings.targets[VARIED_OPTION] = model->options[i].name;
    add_coordinate(&meanings, gen, name, false);
    add_coordinate(&meanings, gen, coordinate_of_rate(memory, name), true);
    add_state(&meanings, gen, name);
    if (strcmp(name, "inputs") == 0)
        meanings.targets[VARIED_SAMPLES] = "inputs";
    return meanings;
}

/* Sets the only meaning of the name, if any; two meanings are an error. */
static bool take_meaning(const struct case_names *names, const char *path, struct place place,
                         const struct meanings *meanings, struct varied *varied) {
    for (int kind = 0; kind < KINDS; kind++) {
        if (!meanings->targets[kind])
            continue;
        if (varied->target) {
            message_error(names->messages, place,
                          "%s: the model uses this name for %s and for %s; rename one of them", path,
                          kind_texts[varied->kind], kind_texts[kind]);
            return false;
        }
        varied->kind = (enum varied_kind)kind;
        varied->target = memory_text(names->memory, meanings->targets[kind]);
        varied->unit = memory_text(names->memory, meanings->units[kind] ? meanings->units[kind] : "");
    }
    return true;
}

/* All names that may vary, to suggest the nearest one. */
static const char **known_names(const struct case_names *names, int *count) {
    const struct model *model = &names->generation->model;
    const struct tree *tree = &names->generation->tree;
    const size_t most =
        (size_t)(model->parameter_count + model->input_count + model->option_count + 2 * tree->count + 1);
    const char **known = memory_get(names->memory, most * sizeof *known);
    *count = 0;
    for (int i = 0; i < model->parameter_count; i++)
        known[(*count)++] = model->parameters[i].name;
    for (int i = 0; i < model->input_count; i++)
        known[(*count)++] = model->inputs[i].name;
    for (int i = 0; i < model->option_count; i++)
        known[(*count)++] = model->options[i].name;
    for (int i = 0; i < tree->count; i++)
        known[(*count)++] = tree->frames[i].name;
    for (int i = 0; i < tree_joint_count(tree); i++)
        known[(*count)++] = memory_format(names->memory, "%s_d", tree->frames[i].name);
    known[(*count)++] = "inputs";
    return known;
}

static void refuse_unknown(const struct case_names *names, const char *path, struct place place,
                           const char *name) {
    int count;
    if (!message_shows_unknown(names->messages))
        return;
    const char **known = known_names(names, &count);
    const char *nearest = message_nearest_name(name, known, count);
    if (nearest)
        message_error(names->messages, place, "%s: unknown name; the nearest known one is \"%s\"", path,
                      nearest);
    else
        message_error(
            names->messages, place,
            "%s: unknown name; use a parameter, an input, an option, a coordinate, its rate NAME_d or "
            "inputs%s",
            path, strpbrk(name, "[(") ? ", without a unit" : "");
}

static bool is_set(const struct case_names *names, const char *name) {
    for (int i = 0; i < names->options->setting_count; i++)
        if (strcmp(names->options->settings[i].name, name) == 0)
            return true;
    return false;
}

bool sweeps_names_is_option(const struct case_names *names, const char *name) {
    return meanings_of(names->memory, names->generation, name).targets[VARIED_OPTION] != NULL;
}

bool sweeps_names_find(const struct case_names *names, const char *path, const struct case_column *column,
                       bool options_vary, struct varied *varied) {
    const struct meanings meanings = meanings_of(names->memory, names->generation, column->name);
    *varied = (struct varied){.name = column->name, .unit = ""};
    if (!take_meaning(names, path, column->place, &meanings, varied))
        return false;
    if (is_set(names, column->name)) {
        message_error(names->messages, column->place, "%s: --set sets it, too; remove one of them", path);
        return false;
    }
    if (!varied->target && !options_vary)
        refuse_unknown(names, path, column->place, column->name);
    return varied->target || options_vary;
}

/* ---- Values ---- */

static const char *value_text(const struct case_column *column, long i, char number[static NUMBER_LENGTH]) {
    if (column->kind == CASES_TEXTS)
        return column->texts[(int)column->values[i]];
    if (column->kind == CASES_TRUTHS)
        return column->values[i] != 0 ? "true" : "false";
    return exact_text(column->values[i], number);
}

/* Adds a path relative to the folder, or the text alone if it is an absolute path or there is no folder. */
static int add_text(struct text_set *set, const char *folder, const char *text) {
    if (!*folder || *text == '/')
        return sweeps_text_set_add(set, text);
    char *path = format_allocate_large(strlen(folder) + strlen(text) + 1, 1);
    strcat(strcpy(path, folder), text);
    const int number = sweeps_text_set_add(set, path);
    free(path);
    return number;
}

/* Replaces values by numbers of texts. A value equal to the one before it is not looked up again. */
static void convert_to_texts(const struct case_names *names, const struct case_column *column, long count,
                             const char *folder, struct varied *varied) {
    struct text_set set = {.memory = names->memory};
    double *values = memory_get(names->memory, (size_t)count * sizeof *values);
    for (long i = 0; i < count; i++) {
        if (i > 0 && column->values[i] == column->values[i - 1]) {
            values[i] = values[i - 1];
            continue;
        }
        char number[NUMBER_LENGTH];
        values[i] = add_text(&set, folder, value_text(column, i, number));
    }
    varied->values = values;
    varied->texts = set.texts;
    varied->text_count = set.count;
}

bool sweeps_names_convert(const struct case_names *names, const char *path, const struct case_column *column,
                          long count, struct varied *varied) {
    const bool are_texts = column->kind == CASES_TEXTS;
    if (varied->target && varied->kind == VARIED_OPTION) {
        convert_to_texts(names, column, count, "", varied);
    } else if (varied->target && varied->kind == VARIED_SAMPLES) {
        if (!are_texts)
            message_error(names->messages, column->place, "%s: %s; must be names of files", path,
                          column->kind == CASES_TRUTHS ? "true or false" : "a number");
        else
            convert_to_texts(names, column, count, names->folder, varied);
        return are_texts;
    } else if (are_texts || column->kind == CASES_TRUTHS) {
        message_error(names->messages, column->place, "%s: %s; must be a number", path,
                      are_texts ? "a text" : "true or false");
        return false;
    } else {
        varied->values = column->values;
    }
    return true;
}

/* ---- Files of samples ---- */

static void check_files(const struct case_names *names, struct place place, const struct varied *varied) {
    for (int i = 0; i < varied->text_count; i++) {
        const char *fault;
        FILE *file = format_open_input(varied->texts[i], &fault);
        if (!file)
            message_error(names->messages, place, "inputs: %s: %s; name a readable file", varied->texts[i],
                          fault);
        else
            fclose(file);
    }
}

/* ---- Structures ---- */

/* Further structures are read here only while a name is unresolved: each is read anyway when it is compiled.
 */
enum { STRUCTURES_SEEN_MOST = 64 };

/* Writes the settings of the command line, then the options of a case; returns how many there are. */
static int settings_of(const struct case_names *names, const struct cases *cases, long i,
                       struct setting *settings) {
    int count = names->options->setting_count;
    if (count)
        memcpy(settings, names->options->settings, (size_t)count * sizeof *settings);
    for (int c = 0; c < cases->width; c++) {
        const struct varied *varied = &cases->columns[c];
        if (varied->target && varied->kind == VARIED_OPTION)
            settings[count++] =
                (struct setting){.name = varied->target, .value = varied->texts[(int)varied->values[i]]};
    }
    return count;
}

static const char *settings_text(const struct case_names *names, const struct setting *settings, int count) {
    const char *text = "";
    for (int i = names->options->setting_count; i < count; i++)
        text = memory_format(names->memory, "%s%s%s = %s", text, *text ? ", " : "", settings[i].name,
                             settings[i].value);
    return text;
}

/* The place of the first varied option. */
static struct place place_of_options(const struct case_table *table, const struct cases *cases) {
    int c = 0;
    while (c < cases->width - 1 && !(cases->columns[c].target && cases->columns[c].kind == VARIED_OPTION))
        c++;
    return table->columns[c].place;
}

static const char *first_error(const struct generation *gen) {
    for (int i = 0; i < gen->messages.count; i++)
        if (gen->messages.list[i].is_error)
            return gen->messages.list[i].text;
    return "out of memory";
}

/* Looks up the unresolved names in this structure. */
static void find_rest(const struct case_names *names, const struct case_table *table,
                      const struct generation *gen, struct cases *cases) {
    for (int c = 0; c < cases->width; c++) {
        if (cases->columns[c].target)
            continue;
        const struct meanings meanings = meanings_of(names->memory, gen, table->columns[c].name);
        take_meaning(names, table->columns[c].name, table->columns[c].place, &meanings, &cases->columns[c]);
    }
}

static void read_structure(const struct case_names *names, const struct case_table *table,
                           const struct setting *settings, int count, const char *text, struct cases *cases) {
    struct generation gen;
    const struct read_request request = {
        .file = names->generation->model.file, .settings = settings, .setting_count = count};
    if (gen_read(&gen, &request, -1) == GEN_OK)
        find_rest(names, table, &gen, cases);
    else
        message_error(names->messages, place_of_options(table, cases), "with %s the model has an error: %s",
                      text, first_error(&gen));
    gen_release(&gen);
}

/* Returns whether the options of a case differ from those of the case before it. */
static bool differs(const struct cases *cases, long i) {
    for (int c = 0; c < cases->width && i > 0; c++) {
        const struct varied *varied = &cases->columns[c];
        if (varied->target && varied->kind == VARIED_OPTION && varied->values[i] != varied->values[i - 1])
            return true;
    }
    return i == 0;
}

static bool is_any_sought(const struct cases *cases) {
    for (int c = 0; c < cases->width; c++)
        if (!cases->columns[c].target)
            return true;
    return false;
}

static void read_structures(const struct case_names *names, const struct case_table *table,
                            struct cases *cases) {
    struct text_set seen = {.memory = names->memory};
    const size_t most = (size_t)(names->options->setting_count + cases->width);
    struct setting *settings = memory_get(names->memory, most * sizeof *settings);
    for (long i = 0; i < cases->count && (seen.count < STRUCTURES_SEEN_MOST || is_any_sought(cases)); i++) {
        if (!differs(cases, i))
            continue;
        const int count = settings_of(names, cases, i, settings), before = seen.count;
        const char *text = settings_text(names, settings, count);
        if (count > names->options->setting_count && sweeps_text_set_add(&seen, text) == before)
            read_structure(names, table, settings, count, text, cases);
    }
}

bool sweeps_names_check(const struct case_names *names, const struct case_table *table, struct cases *cases) {
    const int errors = names->messages->errors;
    read_structures(names, table, cases);
    for (int c = 0; c < cases->width; c++) {
        const struct case_column *column = &table->columns[c];
        if (!cases->columns[c].target && names->messages->errors == errors)
            refuse_unknown(names, column->name, column->place, column->name);
        else if (cases->columns[c].kind == VARIED_SAMPLES)
            check_files(names, column->place, &cases->columns[c]);
    }
    return names->messages->errors == errors;
}
