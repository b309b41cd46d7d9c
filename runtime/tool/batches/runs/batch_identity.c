/*
 * The identity of a batch: texts and hashes of its model, its sweep and its options, and hashes of the files
 * that its motions read.
 *
 * The head of the journal has the hashes, so that only the same batch can be resumed. The file of runs has
 * texts and hashes as attributes, so that a single case can be computed again.
 */
#include "runtime/tool/batches/runs/runs.h"
#include "gen/read/read.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <jansson.h>
#include <sha2.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool batch_for_each_file(const struct batch_setup *setup, bool call(void *context, const char *path),
                         void *context) {
    const struct cases *cases = &setup->sweep.cases;
    const char *state = options_state_path(options_text(&setup->options, "from"));
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
static const char *const number_options[] = {"until", "every", "step", "step-max", "tol", "lanes"},
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
    for (int i = 0; i < NUMBERS; i++)
        if (options_has(options, number_options[i]))
            format_put_number(document, number_options[i], options_number(options, number_options[i]));
    for (int i = 0; i < TEXTS; i++)
        if (options_has(options, text_options[i]))
            format_put_text(document, text_options[i], options_text(options, text_options[i]));
    format_put_close(document, '}');
}

void batch_read_options(const json_t *from, struct options *options) {
    json_t *set = json_object_get(from, "set"), *value;
    const char *name;
    options->settings = format_allocate(json_object_size(set) + 1, sizeof *options->settings);
    json_object_foreach(set, name, value) options->settings[options->setting_count++] =
        (struct setting){.name = name, .value = json_is_string(value) ? json_string_value(value) : ""};
    for (int i = 0; i < NUMBERS; i++)
        if (json_number_value(json_object_get(from, number_options[i])) > 0)
            options_set_number(options, number_options[i],
                               json_number_value(json_object_get(from, number_options[i])));
    for (int i = 0; i < TEXTS; i++)
        if (json_string_value(json_object_get(from, text_options[i])))
            options_set_text(options, text_options[i],
                             json_string_value(json_object_get(from, text_options[i])));
}

bool batch_hash_file(const char *path, char hash[static JOURNAL_HASH]) {
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
    format_put_text(context, path, batch_hash_file(path, hash) ? hash : "");
    return true;
}

/* {"PATH": "hash", ...} */
static void put_files(struct document *document, const struct batch_setup *setup) {
    format_put_open(document, NULL, '{');
    batch_for_each_file(setup, put_file, document);
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

bool batch_check_texts(const struct runs_reader *runs, const char *path) {
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

void batch_identify(struct batch_setup *setup) {
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
        fprintf(stderr, "refdyn: %s: belongs to another batch: the %s differ\n", path, other);
    return other ? PRESENT_OTHER : is_complete ? PRESENT_COMPLETE : PRESENT_NONE;
}
