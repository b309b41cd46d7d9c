/*
 * `refdyn sim --case K --of RUNS.h5`: computes one case of a batch again and writes its motion as CSV.
 *
 * Reads the model, the options and the case's values from the file of runs. The numbers are the same as in
 * the batch, at the times at which it recorded states, with all columns of a motion.
 */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/system/system.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct again {
    struct batch_setup setup;
    struct runs_reader *runs;
    struct scratch folder; /* with the model's files */
    bool has_folder;
    json_t *model, *options, *files;
    struct targets targets;
    struct target *rows;
    struct record_table table;
    bool has_rows; /* the motion has begun */
    int status;    /* status of the runtime */
};

static enum status complain(const char *path, const char *fact) {
    format_complain("refdyn: %s: %s\n", path, fact);
    return STATUS_FAULT;
}

/* ---- The file of runs ---- */

static json_t *load_attribute(const struct runs_reader *runs, const char *name) {
    const char *text = hdf5_runs_attribute(runs, name);
    return text ? json_loads(text, 0, NULL) : NULL;
}

/* Writes the model's files into a temporary folder; *path is the first one, the model. */
static enum status write_model(struct again *again, const char **path) {
    const char *name;
    json_t *text;
    *path = NULL;
    again->has_folder = system_scratch_open(&again->folder, system_scratch_parent(), "refdyn-case-");
    if (!again->has_folder)
        return STATUS_FAULT;
    json_object_foreach(again->model, name, text) {
        const char *file = memory_format(&again->setup.memory, "%s/%s", again->folder.path, name);
        FILE *out = strchr(name, '/') ? NULL : fopen(file, "wx");
        if (!out || fputs(json_string_value(text) ? json_string_value(text) : "", out) < 0 ||
            fclose(out) != 0)
            return complain(file, strerror(errno));
        *path = *path ? *path : file;
    }
    return *path ? STATUS_DONE : STATUS_FAULT;
}

static void read_options(struct again *again, const struct options *given, const char **path) {
    struct options *options = &again->setup.options;
    *options = (struct options){.command = given->command, .operands = path, .operand_count = 1};
    runs_read_options(again->options, options);
}

/* Drops the texts of other cases, whose files may no longer exist. */
static void leave_one_text(struct varied *column) {
    if (!column->texts)
        return;
    column->texts += (int)column->values[0];
    column->text_count = 1;
    column->values[0] = 0;
}

/* Makes the case the only one of a batch, with number 0. */
static enum status read_case(struct again *again, const char *path, double number) {
    struct memory *memory = &again->setup.memory;
    const struct cases *all = &hdf5_runs_layout(again->runs)->cases;
    struct cases *cases = &again->setup.sweep.cases;
    long row = 0;
    while (row < hdf5_runs_count(again->runs) && (double)hdf5_runs_numbers(again->runs)[row] != number)
        row++;
    if (row == hdf5_runs_count(again->runs))
        return complain(path, memory_format(memory, "has no case %.0f", number));
    *cases = (struct cases){.count = 1, .width = all->width};
    cases->columns = memory_get(memory, ((size_t)all->width + 1) * sizeof *cases->columns);
    for (int i = 0; i < all->width; i++) {
        cases->columns[i] = all->columns[i];
        cases->columns[i].values = memory_get(memory, sizeof(double));
        cases->columns[i].values[0] = all->columns[i].values[row];
        leave_one_text(&cases->columns[i]);
    }
    return STATUS_DONE;
}

/* Keeps what makes this motion stop at the times of the batch: its outputs, if anything was kept of them, and
 * the times of `at`. */
static void read_keep(struct again *again, const char *const *of) {
    const struct runs_layout *layout = hdf5_runs_layout(again->runs);
    struct keep *keep = &again->setup.sweep.keep;
    keep->final = true;
    for (int i = 0; i < layout->item_count; i++) {
        const char *group = layout->items[i].group;
        if (strcmp(group, "limits") == 0)
            keep->limits = true;
        if (strcmp(group, "extremes") == 0 || strcmp(group, "norms") == 0 || strcmp(group, "history") == 0)
            keep->history = (struct name_list){&layout->items[i].name, of, 1};
    }
    for (int i = 0; i < layout->axis_count; i++)
        if (strcmp(layout->axes[i].path, "at/t") == 0) {
            keep->at = layout->axes[i].values;
            keep->at_count = layout->axes[i].count;
        }
}

/* ---- Files that the case reads ---- */

/* Where files that the case reads may be: samples of inputs and a STATE.json. */
struct case_files {
    const json_t *hashes; /* by the path as written in the batch */
    const char *folder;   /* working folder of the batch, NULL if unknown */
    const char *runs;     /* the file of runs */
};

enum { PLACES = 3 };

/* Lists the places where the file may be; returns how many there are. */
static int list_places(const struct case_files *files, struct memory *memory, const char *path,
                       const char *places[static PLACES]) {
    const char *slash = strrchr(files->runs, '/');
    int count = 0;
    places[count++] = path;
    if (*path == '/')
        return count;
    if (files->folder)
        places[count++] = memory_format(memory, "%s/%s", files->folder, path);
    if (slash)
        places[count++] = memory_format(memory, "%.*s/%s", (int)(slash - files->runs), files->runs, path);
    return count;
}

/* Reports that the file was not found, or that its content has changed. */
static const char *refuse_file(const char *path, const char *const *places, int count, const char *changed) {
    if (changed) {
        fprintf(stderr, "refdyn: %s: has changed since the batch was computed; restore it\n", changed);
        return NULL;
    }
    format_complain("refdyn: %s: the case reads this file, which does not exist", path);
    for (int i = 1; i < count; i++)
        fprintf(stderr, "%s %s", i == 1 ? ", nor does" : " or", places[i]);
    fputs(count > 1 ? "; put it in one of these places\n" : "; put it there\n", stderr);
    return NULL;
}

static const char *find_file(const struct case_files *files, struct memory *memory, const char *path) {
    const char *known = json_string_value(json_object_get(files->hashes, path));
    const char *places[PLACES], *changed = NULL;
    const int count = list_places(files, memory, path, places);
    for (int i = 0; i < count; i++) {
        char hash[JOURNAL_HASH];
        if (access(places[i], F_OK) != 0)
            continue;
        if (!runs_hash_file(places[i], hash))
            return NULL;
        if (!known || strcmp(hash, known) == 0)
            return places[i];
        changed = changed ? changed : places[i];
    }
    return refuse_file(path, places, count, changed);
}

/*
 * Replaces the paths in the setup's options and cases by those at which the files are now: as written,
 * relative to the folder of the batch, or relative to the folder of the file of runs. A file is accepted if
 * its content has the hash that the batch recorded.
 */
static bool find_files(const struct case_files *files, struct batch_setup *setup) {
    const char *from = realise_state_path(&setup->options);
    struct cases *cases = &setup->sweep.cases;
    if (from) {
        const char *file = find_file(files, &setup->memory, from);
        if (!file)
            return false;
        options_set_text(&setup->options, "from", file);
    }
    for (int i = 0; i < cases->width; i++) {
        struct varied *column = &cases->columns[i];
        if (column->kind != VARIED_SAMPLES)
            continue;
        const char **texts = memory_get(&setup->memory, (size_t)column->text_count * sizeof *texts);
        for (int k = 0; k < column->text_count; k++)
            if (!(texts[k] = find_file(files, &setup->memory, column->texts[k])))
                return false;
        column->texts = texts;
    }
    return true;
}

/* ---- The motion ---- */

static int write_row(void *context, const struct refdyn_batch_case *one, int number) {
    struct again *again = context;
    if (number == 0) {
        again->has_rows = true;
        simulate_table_start(&again->table, one->integrator, NULL);
        simulate_table_header(&again->table, again->rows->file);
    }
    record_table_fill_row(&again->table);
    simulate_table_row(&again->table, again->rows->file);
    return 0;
}

static int is_interrupted(void *context) {
    (void)context;
    return system_interrupted != 0;
}

/* Removes the temporary folder of the model from the text, since it no longer exists when the user reads the
 * message. */
static const char *without_folder(const struct again *again, const char *text) {
    const size_t length = strlen(again->folder.path);
    return strncmp(text, again->folder.path, length) == 0 && text[length] == '/' ? text + length + 1 : text;
}

static int print_refused_values(const struct again *again, const struct refdyn_batch_case *one,
                                const struct refdyn_batch_result *result) {
    const struct scene *scene = &again->setup.structures.list[0].scene;
    char text[REFUSED_LENGTH];
    const char *fact = without_folder(again, scene_refused_fact(scene, one->integrator->work, text));
    if (result->stage == REFDYN_AT_STEPS)
        record_events_print_refused(one->integrator, fact, stderr);
    else
        fprintf(stderr, "%s\n", fact);
    return 0;
}

static int note_end(void *context, const struct refdyn_batch_case *one,
                    const struct refdyn_batch_result *result) {
    struct again *again = context;
    const struct refdyn_integrator *integrator = one->integrator;
    struct scene *scene = &again->setup.structures.list[0].scene;
    if (result->status == REFDYN_EVENT_ENDS) {
        record_table_fill_row(&again->table);
        simulate_table_row(&again->table, again->rows->file);
        return 0;
    }
    again->status = result->status;
    if (!result->status)
        return 0;
    if (result->status == REFDYN_REFUSED)
        return print_refused_values(again, one, result);
    scene->work.fault = integrator->work->fault;
    scene_numbers_failed(scene, result->status, result->t, integrator->q, integrator->qd);
    return 0;
}

/* After a signal, the rows written so far stay readable. */
static enum status leave_part(struct again *again) {
    fputs("refdyn: interrupted\n", stderr);
    if (again->has_rows && system_target_close_part(again->rows) && again->rows->part)
        fprintf(stderr, "refdyn: what was computed until then is in %s\n", again->rows->part);
    return STATUS_NUMBERS;
}

static int begin_realised(void *context, struct record_table *table) {
    struct again *again = context;
    again->has_rows = true;
    simulate_table_header(table, again->rows->file);
    return REFDYN_OK;
}

static int put_realised(void *context, struct record_table *table, int number) {
    (void)number;
    simulate_table_row(table, ((struct again *)context)->rows->file);
    return REFDYN_OK;
}

static enum status realise(struct again *again) {
    struct realise_work work;
    struct realise_rows rows = {.context = again, .begin = begin_realised, .put = put_realised};
    const enum status status =
        runs_realise_case(&again->setup, &again->setup.structures.list[0], 0, &work, &rows);
    if (status != STATUS_DONE)
        return status;
    return system_target_finish(again->rows) ? STATUS_DONE : STATUS_FAULT;
}

static enum status move(struct again *again) {
    struct structure *structure = &again->setup.structures.list[0];
    struct refdyn_batch batch = runs_describe(&again->setup, structure);
    batch.count = batch.threads = 1;
    batch.context = again;
    batch.output = write_row;
    batch.end = note_end;
    batch.stop = is_interrupted;
    system_interrupt_defer(true);
    const int result = refdyn_batch_run(&batch, NULL);
    if (system_interrupted)
        return leave_part(again);
    if (result)
        return complain(structure->scene.model->name, refdyn_status_text(result));
    if (!again->has_rows)
        return again->status == REFDYN_REFUSED ? STATUS_FAULT : STATUS_NUMBERS;
    const enum status status = system_target_finish(again->rows) ? STATUS_DONE : STATUS_FAULT;
    return again->status ? STATUS_NUMBERS : status;
}

static bool spare(void *context, const char *path) {
    system_targets_spare(context, path);
    return true;
}

static enum status refuse_case(const struct batch_setup *setup) {
    char fact[REFUSED_LENGTH];
    if (!sweeps_structures_refuse(&setup->structures.list[0], &setup->sweep.cases, 0, fact))
        return STATUS_DONE;
    fprintf(stderr, "%s\n", fact);
    return STATUS_FAULT;
}

static enum status open_case(struct again *again, const struct options *given, const char **path) {
    const char *of = options_text(given, "of");
    again->model = load_attribute(again->runs, "model");
    again->options = load_attribute(again->runs, "options");
    again->files = load_attribute(again->runs, "files");
    if (json_object_size(again->model) == 0 || !json_is_object(again->options))
        return complain(
            of,
            "has no attributes for its model and options; it must be a file that refdyn batch has written");
    if (!runs_check_texts(again->runs, of))
        return STATUS_FAULT;
    enum status status = write_model(again, path);
    read_options(again, given, path);
    if (status == STATUS_DONE)
        status = read_case(again, of, options_number(given, "case"));
    const struct case_files files = {
        .hashes = again->files, .folder = hdf5_runs_attribute(again->runs, "folder"), .runs = of};
    if (status == STATUS_DONE && !find_files(&files, &again->setup))
        status = STATUS_FAULT;
    read_keep(again, &of);
    if (status == STATUS_DONE)
        status = runs_setup_complete(&again->setup);
    if (status == STATUS_DONE)
        status = refuse_case(&again->setup);
    system_targets_spare(&again->targets, of);
    runs_for_each_file(&again->setup, spare, &again->targets);
    if (status == STATUS_DONE &&
        !(again->rows = system_target_open(&again->targets, options_text(given, "output"))))
        status = STATUS_FAULT;
    return status;
}

enum status runs_case_again(const struct options *options) {
    const char *output = options_text(options, "output");
    if (output && format_names_hdf5(output))
        return options_usage_error(options->command,
                                   "-o %s: a case of --of is written as CSV only; use another name", output);
    struct again again = {.setup = {.memory = format_arena_start()},
                          .runs = hdf5_runs_open(options_text(options, "of"))};
    const char *path;
    enum status status = again.runs ? open_case(&again, options, &path) : STATUS_FAULT;
    if (status == STATUS_DONE)
        status = options_has(&again.setup.options, "realise") ? realise(&again) : move(&again);
    system_targets_release(&again.targets);
    runs_setup_close(&again.setup);
    if (again.has_folder)
        system_scratch_close(&again.folder);
    if (again.runs)
        hdf5_runs_close(again.runs);
    json_decref(again.model);
    json_decref(again.options);
    json_decref(again.files);
    return status;
}
