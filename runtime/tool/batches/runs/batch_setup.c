/*
 * Prepares a batch: reads and checks options and cases, chooses threads and lanes, compiles, and lays out
 * what is kept. Identifies it by texts and hashes of its model, its sweep and its options, and by hashes of
 * the files that its motions read.
 *
 * The head of the journal has the hashes, so that only the same batch can be resumed. The file of runs has
 * texts and hashes as attributes, so that a single case can be computed again.
 */
#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <sha2.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

/* ---- Identity ---- */

bool runs_for_each_file(const struct batch_setup *setup, bool call(void *context, const char *path),
                        void *context) {
    const struct cases *cases = &setup->sweep.cases;
    const char *state = realise_state_path(&setup->options);
    if (state && !call(context, state))
        return false;
    for (int i = 0; i < cases->width; i++)
        for (int k = 0; cases->columns[i].kind == VARIED_SAMPLES && k < cases->columns[i].text_count; k++)
            if (!call(context, cases->columns[i].texts[k]))
                return false;
    return true;
}

_Static_assert((int)JOURNAL_HASH == (int)SHA256_DIGEST_STRING_LENGTH, "a hash fits");

static void hash_text(const char *text, char *hash) {
    SHA2_CTX sha;
    SHA256Init(&sha);
    SHA256Update(&sha, (const uint8_t *)text, strlen(text));
    SHA256End(&sha, hash);
}

/* {"NAME.lua": "text", ...}, first the model. */
static void put_sources(struct document *document, const struct batch_setup *setup) {
    const struct sources *sources = setup->base.generation.model.sources;
    format_put_open(document, NULL, '{');
    for (int i = 0; i < sources->count; i++) {
        const char *slash = strrchr(sources->list[i].path, '/');
        format_put_text(document, slash ? slash + 1 : sources->list[i].path, sources->list[i].text);
    }
    format_put_close(document, '}');
}

/* The options of the motions, by their names on the command line. */
static const char *const number_options[] = {"until",     "every", "step",   "step-max", "tol",
                                             "tol-rates", "lanes", "before", "after",    "mesh"},
                         *const text_options[] = {"method",    "from",     "hold",  "release",       "way",
                                                  "stabilise", "singular", "start", "accelerations", "loops"};
enum {
    NUMBERS = sizeof number_options / sizeof number_options[0],
    TEXTS = sizeof text_options / sizeof text_options[0]
};

static void put_options(struct document *document, const struct batch_setup *setup) {
    const struct options *options = &setup->options;
    format_put_open(document, NULL, '{');
    format_put_open(document, "set", '{');
    for (int i = 0; i < options->setting_count; i++)
        format_put_text(document, options->settings[i].name, options->settings[i].value);
    format_put_close(document, '}');
    if (options_has(options, "realise"))
        format_put_truth(document, "realise", true);
    for (int i = 0; i < NUMBERS; i++)
        if (options_has(options, number_options[i]))
            format_put_number(document, number_options[i], options_number(options, number_options[i]));
    for (int i = 0; i < TEXTS; i++)
        if (options_has(options, text_options[i]))
            format_put_text(document, text_options[i], options_text(options, text_options[i]));
    format_put_close(document, '}');
}

void runs_read_options(const json_t *from, struct options *options) {
    json_t *set = json_object_get(from, "set"), *value;
    const char *name;
    options->settings = format_allocate(json_object_size(set) + 1, sizeof *options->settings);
    json_object_foreach(set, name, value) options->settings[options->setting_count++] =
        (struct setting){.name = name, .value = json_is_string(value) ? json_string_value(value) : ""};
    if (json_is_true(json_object_get(from, "realise")))
        options_set_flag(options, "realise");
    for (int i = 0; i < NUMBERS; i++)
        if (json_number_value(json_object_get(from, number_options[i])) > 0)
            options_set_number(options, number_options[i],
                               json_number_value(json_object_get(from, number_options[i])));
    for (int i = 0; i < TEXTS; i++)
        if (json_string_value(json_object_get(from, text_options[i])))
            options_set_text(options, text_options[i],
                             json_string_value(json_object_get(from, text_options[i])));
}

bool runs_hash_file(const char *path, char hash[static JOURNAL_HASH]) {
    uint8_t block[4096];
    SHA2_CTX sha;
    const char *fault;
    FILE *file = format_open_input(path, &fault);
    SHA256Init(&sha);
    for (size_t length; file && (length = fread(block, 1, sizeof block, file)) > 0;)
        SHA256Update(&sha, block, length);
    const bool is_read = file && !ferror(file);
    if (!is_read)
        format_complain_line(path, 0,
                             format_text("%s; name a readable file", file ? strerror(errno) : fault));
    if (file)
        fclose(file);
    SHA256End(&sha, hash);
    return is_read;
}

/* A missing file has the hash "". */
static bool put_file(void *context, const char *path) {
    char hash[JOURNAL_HASH];
    format_put_text(context, path, runs_hash_file(path, hash) ? hash : "");
    return true;
}

/* {"PATH": "hash", ...} */
static void put_files(struct document *document, const struct batch_setup *setup) {
    format_put_open(document, NULL, '{');
    runs_for_each_file(setup, put_file, document);
    format_put_close(document, '}');
}

/* The text of a document, in the setup's memory. */
static const char *text_of(struct batch_setup *setup,
                           void put(struct document *document, const struct batch_setup *setup)) {
    struct document document;
    char *text = NULL;
    size_t size;
    FILE *stream = format_stream(&text, &size);
    format_document_open(&document);
    put(&document, setup);
    format_document_close(&document, stream);
    fclose(stream);
    const char *copy = memory_text(&setup->memory, text);
    free(text);
    return copy;
}

/* Adds a word of a shell command, in single quotes if it is empty or has a special character. */
static void add_word(struct text *text, const char *word) {
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+./,:=@%";
    if (*word && word[strspn(word, plain)] == '\0') {
        text_add(text, "%s", word);
        return;
    }
    text_add(text, "'");
    for (; *word; word++)
        text_add(text, "%.*s", *word == '\'' ? 4 : 1, *word == '\'' ? "'\\''" : word);
    text_add(text, "'");
}

static const char *command_of(struct batch_setup *setup) {
    const struct options *options = &setup->options;
    struct text text = {.memory = &setup->memory};
    for (int i = 0; i < options->argument_count; i++) {
        text_add(&text, "%s", i ? " " : "");
        add_word(&text, options->arguments[i]);
    }
    return text.data;
}

/* The folder that relative paths of options and cases start from; "." if it is unknown. */
static const char *present_folder(struct batch_setup *setup) {
    char *folder = getcwd(NULL, 0);
    const char *copy = memory_text(&setup->memory, folder ? folder : ".");
    free(folder);
    return copy;
}

static void add(struct batch_setup *setup, const char *name, const char *text) {
    setup->layout.attributes[setup->layout.attribute_count++] = (struct attribute){name, text};
}

static const char *const part_names[JOURNAL_PARTS] = {"model", "sweep", "options", "files"};

bool runs_check_texts(const struct runs_reader *runs, const char *path) {
    char hash[JOURNAL_HASH], name[16];
    for (int part = 0; part < JOURNAL_PARTS; part++) {
        snprintf(name, sizeof name, "%s_hash", part_names[part]);
        const char *text = hdf5_runs_attribute(runs, part_names[part]),
                   *kept = hdf5_runs_attribute(runs, name);
        hash_text(text ? text : "", hash);
        if (!text || !kept || strcmp(hash, kept) != 0) {
            format_complain_line(
                path, 0, format_text("damaged: attribute %s does not match %s", part_names[part], name));
            return false;
        }
    }
    return true;
}

/* Computes the key of the journal and the attributes of the file of runs. */
static void identify(struct batch_setup *setup) {
    enum { ATTRIBUTES = 5 + 2 * JOURNAL_PARTS };
    const char *model = text_of(setup, put_sources), *options = text_of(setup, put_options),
               *files = text_of(setup, put_files);
    const char *sweep = setup->sweep.text;
    const char *const texts[JOURNAL_PARTS] = {model, sweep, options, files};
    for (int part = 0; part < JOURNAL_PARTS; part++)
        hash_text(texts[part], setup->key.hash[part]);
    setup->layout.attributes = memory_get(&setup->memory, ATTRIBUTES * sizeof *setup->layout.attributes);
    add(setup, "refdyn", REFDYN_VERSION);
    add(setup, "model_name", memory_text(&setup->memory, setup->base.generation.model.name));
    for (int part = 0; part < JOURNAL_PARTS; part++) {
        add(setup, part_names[part], texts[part]);
        add(setup, memory_format(&setup->memory, "%s_hash", part_names[part]), setup->key.hash[part]);
    }
    add(setup, "command", command_of(setup));
    add(setup, "folder", present_folder(setup));
    add(setup, "lanes", memory_format(&setup->memory, "%d", setup->lanes));
}

/* ---- A file that already has the name of the result ---- */

/* Words for the first part of the batch that differs, NULL if all are equal. */
static const char *other_part(const struct runs_reader *reader, const struct journal_key *key) {
    static const char *const names[JOURNAL_PARTS] = {"model_hash", "sweep_hash", "options_hash",
                                                     "files_hash"};
    for (int part = 0; part < JOURNAL_PARTS; part++) {
        const char *hash = hdf5_runs_attribute(reader, names[part]);
        if (!hash || strcmp(hash, key->hash[part]) != 0)
            return runs_journal_parts[part];
    }
    return NULL;
}

/* Returns whether the file has all cases of [first, end). */
static bool has_cases(const struct runs_reader *reader, long first, long end) {
    const long *numbers = hdf5_runs_numbers(reader);
    long found = 0;
    for (long row = 0; row < hdf5_runs_count(reader); row++)
        found += numbers[row] >= first && numbers[row] < end;
    return found == end - first;
}

enum runs_present_result runs_present_result(const struct batch_setup *setup, const char *path, long first,
                                             long end) {
    if (access(path, F_OK) != 0)
        return PRESENT_NONE;
    struct runs_reader *reader = hdf5_runs_open(path);
    if (!reader)
        return PRESENT_OTHER;
    const char *other = other_part(reader, &setup->key);
    const bool is_complete = !other && has_cases(reader, first, end);
    hdf5_runs_close(reader);
    if (other)
        format_complain("refdyn: %s: belongs to another batch: the %s differ\n", path, other);
    return other ? PRESENT_OTHER : is_complete ? PRESENT_COMPLETE : PRESENT_NONE;
}

enum { THREADS_MAX = 1024 };

/* ---- Setup ---- */

static enum status choose_threads(struct batch_setup *setup) {
    const double asked = options_number(&setup->options, "threads");
    if (asked > THREADS_MAX)
        return options_usage_error(setup->options.command, "--threads: %.0f; must be at most %d", asked,
                                   THREADS_MAX);
    setup->threads = asked > 0 ? (int)asked : system_processors();
    if (setup->threads > THREADS_MAX)
        setup->threads = THREADS_MAX;
    return STATUS_DONE;
}

/* Fixed steps, steps with gains that depend on their length, and programmes that drives perform are computed
 * one motion at a time. */
static bool may_use_lanes(const struct batch_setup *setup) {
    return setup->integration.tol > 0 && setup->integration.gain_share == 0 &&
           !options_has(&setup->options, "realise");
}

/* By default each lane has at least two cases, since a step in lanes takes as long for one case as for all.
 * Only the sweep decides the number of lanes, not the cases or threads of this call, because one lane rounds
 * differently. */
static int suitable_lanes(const struct batch_setup *setup) {
    const long cases = setup->sweep.cases.count / setup->structures.count;
    int lanes = refdyn_batch_widest();
    while (lanes > 1 && cases < 2 * lanes)
        lanes /= 2;
    return lanes;
}

/* Call it after the structures are sorted. */
static void choose_lanes(struct batch_setup *setup) {
    const double asked = options_number(&setup->options, "lanes");
    setup->lanes = !may_use_lanes(setup) ? 1 : asked > 0 ? (int)asked : suitable_lanes(setup);
    options_set_number(&setup->options, "lanes", setup->lanes);
    for (int i = 0; i < setup->structures.count; i++)
        options_set_number(&setup->structures.list[i].options, "lanes", setup->lanes);
}

/* Reads "A:B", the cases A to B - 1; either number may be omitted. */
static enum status choose_range(struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const long count = setup->sweep.cases.count;
    const char *text = options_text(options, "cases");
    char *rest;
    setup->first = 0;
    setup->end = count;
    if (!text)
        return STATUS_DONE;
    if (*text != ':')
        setup->first = strtol(text, &rest, 10);
    else
        rest = (char *)text;
    const bool has_colon = *rest == ':';
    if (has_colon && rest[1])
        setup->end = strtol(rest + 1, &rest, 10);
    else if (has_colon)
        rest++;
    if (!has_colon || *rest || rest == text || text[0] == ' ')
        return options_usage_error(options->command,
                                   "--cases: '%s' is not of the form A:B, the cases A to B - 1", text);
    if (setup->first >= 0 && setup->first < setup->end && setup->end <= count)
        return STATUS_DONE;
    return options_usage_error(options->command,
                               "--cases %s: the batch has the cases 0 to %ld; choose a range of these", text,
                               count - 1);
}

static enum status read_cases(struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const char *table = options_text(options, "table");
    struct generation *generation = &setup->base.generation;
    if (options->operand_count == 1 && !table)
        return options_usage_error(options->command, "no cases; add SWEEP.lua or --table CASES.csv");
    if (options->operand_count > 1 && table)
        return options_usage_error(options->command, "--table replaces the sweep; remove '%s'",
                                   options->operands[1]);
    return table ? sweeps_read_table(&setup->sweep, &setup->memory, table, generation, options)
                 : sweeps_read(&setup->sweep, &setup->memory, options->operands[1], generation,
                               &setup->options);
}

/* Checks what --realise excludes in a batch: options, derivatives and files of inputs. */
static enum status check_realise(const struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const struct cases *cases = &setup->sweep.cases;
    const enum status status = realise_check_options(options);
    if (status != STATUS_DONE || !options_has(options, "realise"))
        return status;
    if (setup->sweep.keep.derivatives.count > 0)
        return options_error(options, "keep", ": --realise excludes keep.derivatives");
    for (int i = 0; i < cases->width; i++)
        if (cases->columns[i].kind == VARIED_SAMPLES)
            return options_usage_error(options->command, "--realise excludes files of inputs");
    return STATUS_DONE;
}

static enum status check_motion(struct batch_setup *setup) {
    struct options *options = &setup->options;
    const char *method = options_text(options, "method");
    if (!(options_number(options, "until") > 0))
        return options_usage_error(options->command, "--until is missing; add the end of the motions");
    if (method && simulate_gsl_has(method))
        return options_error(options, "method", ": %s computes single motions (refdyn sim), not batches",
                             method);
    if (options_text(options, "hold") && !options_is(options, "from", "statics"))
        return options_error(options, "hold", ": needs --from statics");
    enum status status = check_realise(setup);
    if (status == STATUS_DONE)
        status = simulate_options(options, &setup->integration);
    setup->integration.balance = 0; /* no result has it, and it needs the power at each stage */
    return status;
}

/* ---- Times and items ---- */

static enum status check_times(const struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const double until = options_number(options, "until");
    const struct scene *scene = &setup->structures.list[0].scene;
    const struct keep *keep = &setup->sweep.keep;
    const double t = scene->state.t, every = options_number(options, "every");
    const enum status status = simulate_check_times(scene, options, RECORD_KEPT_MAX);
    if (status != STATUS_DONE)
        return status;
    if (every > (until - t) * (1 + 1e-9))
        return options_error(options, "every",
                             " %g: longer than the motions, which last %g s; must not be longer", every,
                             until - t);
    for (int i = 0; i < keep->at_count; i++)
        if (!(keep->at[i] >= t && keep->at[i] <= until))
            return options_error(options, "keep", ": time %g is outside the motions, from %g to %g",
                                 keep->at[i], t, until);
    return STATUS_DONE;
}

static enum status lay_out(struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const double t = setup->structures.list[0].scene.state.t, until = options_number(options, "until");
    double every = options_number(options, "every"), before = 0, after = 0;
    const int count = setup->structures.count;
    const enum status status = check_times(setup);
    if (status != STATUS_DONE)
        return status;
    setup->sweep.keep.realise = options_has(options, "realise");
    if (setup->sweep.keep.realise) { /* an output is where a cell of the drive forces begins */
        every = record_distance(until - t, every);
        const enum status checked = realise_tails(options, until - t, every, &before, &after);
        if (checked != STATUS_DONE)
            return checked;
    }
    setup->kept.times =
        runs_seen_times_make(&setup->memory, &setup->sweep.keep, t - before, until + after, every);
    const struct refdyn_model **models = memory_get(&setup->memory, (size_t)count * sizeof *models);
    const struct model **read = memory_get(&setup->memory, (size_t)count * sizeof *read);
    for (int i = 0; i < count; i++) {
        models[i] = setup->structures.list[i].scene.model;
        read[i] = &setup->structures.list[i].scene.generation.model;
    }
    setup->layout.cases = setup->sweep.cases;
    return runs_kept_lay_out(&setup->memory, &setup->sweep.keep, models, read, count, &setup->kept,
                             &setup->layout)
               ? STATUS_DONE
               : STATUS_FAULT;
}

/* ---- All of it ---- */

enum status runs_setup_complete(struct batch_setup *setup) {
    enum status status = check_motion(setup);
    if (status == STATUS_DONE)
        status = choose_threads(setup);
    if (status == STATUS_DONE)
        status = simulate_check_lanes(&setup->options);
    if (status == STATUS_DONE)
        status = choose_range(setup);
    if (status != STATUS_DONE)
        return status;
    status = sweeps_structures_sort(&setup->structures, &setup->memory, &setup->sweep.cases, setup->first,
                                    setup->end, &setup->options);
    if (status != STATUS_DONE)
        return status;
    choose_lanes(setup);
    status = sweeps_structures_open(&setup->structures, &setup->memory, &setup->sweep.cases,
                                    &setup->integration, setup->threads);
    return status == STATUS_DONE ? lay_out(setup) : status;
}

enum status runs_setup_open(struct batch_setup *setup, const struct options *options) {
    *setup = (struct batch_setup){.memory = format_arena_start(), .options = *options};
    enum status status = scene_read(&setup->base, options, true);
    if (status == STATUS_DONE)
        status = read_cases(setup);
    if (status == STATUS_DONE)
        status = runs_setup_complete(setup);
    if (status == STATUS_DONE)
        identify(setup);
    return status;
}

void runs_setup_close(struct batch_setup *setup) {
    sweeps_structures_close(&setup->structures);
    scene_close(&setup->base);
    memory_release(&setup->memory);
}
