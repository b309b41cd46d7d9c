/*
 * `refdyn batch --slurm`: the cases as an array of jobs, and a job that merges what they have written.
 *
 * Given again after a failure, it submits only the chunks that are missing. Each chunk's journal is begun
 * here, with the hashes of model, sweep and options: a task that finds others in the files refuses.
 */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/batches/slurm/slurm.h"
#include "runtime/tool/support/system/system.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The largest index of an array that Slurm takes unless a site says otherwise is 1000. */
enum { CASES_OF_CHUNK = 16, CHUNKS_DEFAULT_MOST = 100, CHUNKS_MOST = 1000 };

struct submission {
    struct batch_setup setup;
    struct slurm_folder folder;
    const struct options *options;
    bool *is_missing; /* (chunks.count) */
    long missing;     /* how many */
};

/* ---- Options ---- */

/* sbatch options that would make other jobs of these. */
static const char *find_unfit_word(const char *words) {
    static const char *const unfit[] = {"--array", "--dependency", "--wrap"};
    for (size_t i = 0; words && i < sizeof unfit / sizeof unfit[0]; i++)
        if (strstr(words, unfit[i]))
            return unfit[i];
    return NULL;
}

/* Slurm replaces %a and the like also in the folder that a job's output goes to, and reads scripts by lines.
 */
static bool has_fit_name(const struct options *options) {
    return !strpbrk(slurm_path_from_root(options_text(options, "output")), "%\\\n\r");
}

static enum status check_options(const struct options *options) {
    const char *output = options_text(options, "output");
    const double chunks = options_number(options, "chunks");
    const char *unfit = find_unfit_word(options_text(options, "slurm-options"));
    if (!text_names_hdf5(output))
        return usage_error(options->command, "-o %s: --slurm needs a name that ends in .h5", output);
    if (!has_fit_name(options))
        return usage_error(options->command,
                           "-o %s: Slurm takes no %%, backslash or line break in the names of the file "
                           "and its folders",
                           output);
    if (options_text(options, "summary"))
        return usage_error(options->command, "--summary: jobs of Slurm write none");
    if (unfit)
        return usage_error(options->command, "--slurm-options: %s is set by refdyn itself", unfit);
    if (chunks > CHUNKS_MOST)
        return usage_error(options->command, "--chunks %.0f: at most %d are taken", chunks, CHUNKS_MOST);
    if (process_find("sbatch"))
        return STATUS_DONE;
    fprintf(stderr, "refdyn: --slurm: the program sbatch of Slurm is not in PATH; with another scheduler, "
                    "--cases A:B computes a part and refdyn merge joins parts\n");
    return STATUS_FAULT;
}

/* ---- What is there ---- */

static bool complain(const struct submission *submission, const char *fact) {
    fprintf(stderr, "refdyn: %s: %s\n", submission->folder.path, fact);
    return false;
}

/* False where nothing may be submitted; *status then tells whether because all is done. */
static bool check_result(const struct submission *submission, enum status *status) {
    const struct batch_setup *setup = &submission->setup;
    const char *result = options_text(submission->options, "output");
    const enum runs_present_result present = runs_present_result(setup, result, setup->first, setup->end);
    const bool has_journal = access(text_format("%s.journal", result), F_OK) == 0;
    *status = present == PRESENT_COMPLETE ? STATUS_DONE : STATUS_FAULT;
    if (present == PRESENT_COMPLETE)
        fprintf(stderr, "refdyn: %s has all %ld cases: nothing is left to do\n", result,
                setup->end - setup->first);
    else if (present == PRESENT_OTHER)
        fprintf(stderr, "refdyn: --slurm does not replace a file, another name of the result is needed\n");
    else if (has_journal)
        fprintf(stderr,
                "refdyn: %s.journal: a batch without --slurm has left its cases here: --resume without "
                "--slurm goes on with it\n",
                result);
    return present == PRESENT_NONE && !has_journal;
}

static bool check_queue(const struct submission *submission) {
    const struct slurm_folder *folder = &submission->folder;
    bool is_running;
    if (folder->array == 0 && folder->merge == 0)
        return true;
    if (!slurm_ask(folder, &is_running))
        return complain(submission, "whether its jobs still run is not known, nothing was submitted");
    if (!is_running)
        return true;
    fprintf(stderr, "refdyn: %s: its jobs are in the queue already: squeue -j %ld,%ld\n", folder->path,
            folder->array ? folder->array : folder->merge, folder->merge);
    return false;
}

/* The folder's batch is this one, as far as its record tells. */
static bool check_same(const struct submission *submission) {
    const struct batch_setup *setup = &submission->setup;
    const struct chunks *chunks = &submission->folder.chunks;
    const double asked = options_number(submission->options, "chunks");
    for (int part = 0; part < JOURNAL_PARTS; part++)
        if (strcmp(submission->folder.key.hash[part], setup->key.hash[part]) != 0) {
            fprintf(stderr,
                    "refdyn: %s: the %s of this batch are not those of the folder; once the folder is "
                    "removed, the batch begins anew\n",
                    submission->folder.path, journal_parts[part]);
            return false;
        }
    if (chunks->first != setup->first || chunks->end != setup->end)
        return complain(submission, "is of another range of --cases; once it is removed, this one begins");
    if (asked > 0 && (long)asked != chunks->count)
        return complain(submission, "has another number of --chunks; once it is removed, the batch begins "
                                    "anew");
    return true;
}

/* ---- The folder ---- */

static long choose_chunks(const struct submission *submission) {
    const long cases = submission->setup.end - submission->setup.first;
    const double asked = options_number(submission->options, "chunks");
    const long usual = (cases + CASES_OF_CHUNK - 1) / CASES_OF_CHUNK;
    const long wanted = asked > 0 ? (long)asked : usual < CHUNKS_DEFAULT_MOST ? usual : CHUNKS_DEFAULT_MOST;
    return wanted < cases ? wanted : cases;
}

static bool begin_folder(struct submission *submission) {
    struct slurm_folder *folder = &submission->folder;
    unlink(slurm_folder_name(folder, "merged"));
    folder->key = submission->setup.key;
    folder->chunks =
        (struct chunks){submission->setup.first, submission->setup.end, choose_chunks(submission)};
    folder->array = folder->merge = 0;
    struct options options = *submission->options;
    options_set_number(&options, "lanes",
                       submission->setup.lanes); /* the same on all machines, whatever their vectors */
    return slurm_scripts_write(folder, &options) && slurm_folder_write(folder);
}

/* A batch that was merged leaves its folder: when its result has gone, all begins anew. */
static bool prepare_folder(struct submission *submission) {
    struct slurm_folder *folder = &submission->folder;
    if (!slurm_folder_open(folder, options_text(submission->options, "output")) || !check_queue(submission))
        return false;
    const bool is_merged = access(slurm_folder_name(folder, "merged"), F_OK) == 0;
    return folder->chunks.count == 0 || is_merged ? begin_folder(submission) : check_same(submission);
}

/* ---- Chunks ---- */

/* A journal of the chunk that tells of what batch it is, where it has none yet. */
static bool begin_journal(const struct submission *submission, const char *part) {
    const struct batch_setup *setup = &submission->setup;
    struct journal journal;
    const bool is_good =
        journal_open(&journal, part, &setup->key, setup->sweep.cases.count, setup->layout.width, true);
    journal_close(&journal);
    return is_good;
}

static bool find_missing(struct submission *submission) {
    const struct chunks *chunks = &submission->folder.chunks;
    submission->is_missing = allocate((size_t)chunks->count, sizeof *submission->is_missing);
    for (long chunk = 0; chunk < chunks->count; chunk++) {
        char *part = slurm_folder_name(&submission->folder, "part_%ld.h5", chunk);
        const enum runs_present_result present =
            runs_present_result(&submission->setup, part, slurm_chunks_start(chunks, chunk),
                                slurm_chunks_start(chunks, chunk + 1));
        const bool is_missing = present == PRESENT_NONE;
        const bool is_good = present != PRESENT_OTHER && (!is_missing || begin_journal(submission, part));
        if (!is_good)
            return false;
        submission->is_missing[chunk] = is_missing;
        submission->missing += is_missing;
    }
    return true;
}

/* "--array=0-3,7", in heap memory, as it may be long. */
static char *array_option(const struct submission *submission) {
    const long count = submission->folder.chunks.count;
    char *text, separator = '=';
    size_t size;
    FILE *out = text_stream(&text, &size);
    fputs("--array", out);
    for (long first = 0, last; first < count; first = last + 1) {
        last = first;
        if (!submission->is_missing[first])
            continue;
        while (last + 1 < count && submission->is_missing[last + 1])
            last++;
        fprintf(out, last > first ? "%c%ld-%ld" : "%c%ld", separator, first, last);
        separator = ',';
    }
    fclose(out);
    return text;
}

/* ---- Jobs ---- */

static bool submit_array(struct submission *submission) {
    struct slurm_folder *folder = &submission->folder;
    char *option = array_option(submission);
    folder->array =
        slurm_submit(folder, options_text(submission->options, "slurm-options"), option, "chunk.sh");
    free(option);
    return folder->array > 0;
}

/* After the tasks, however they end: it tells which are missing. */
static bool submit_merge(struct submission *submission) {
    struct slurm_folder *folder = &submission->folder;
    const char *option = folder->array ? text_format("--dependency=afterany:%ld", folder->array) : NULL;
    folder->merge =
        slurm_submit(folder, options_text(submission->options, "slurm-options"), option, "merge.sh");
    if (folder->merge == 0 && folder->array) {
        slurm_cancel(folder, folder->array);
        folder->array = 0;
    }
    return folder->merge > 0;
}

static void print_submitted(const struct submission *submission) {
    const struct slurm_folder *folder = &submission->folder;
    const struct chunks *chunks = &folder->chunks;
    fprintf(stderr, "cases        %ld in %ld chunk%s, %ld of these to compute\n", chunks->end - chunks->first,
            chunks->count, chunks->count > 1 ? "s" : "", submission->missing);
    if (folder->array)
        fprintf(stderr, "jobs         %ld (chunks), then %ld (merge)\n", folder->array, folder->merge);
    else
        fprintf(stderr, "jobs         %ld (merge)\n", folder->merge);
    fprintf(stderr, "folder       %s.slurm: scripts, and messages of the jobs\n",
            options_text(submission->options, "output"));
    if (folder->array)
        fprintf(stderr, "watch        squeue -j %ld,%ld\n", folder->array, folder->merge);
    else
        fprintf(stderr, "watch        squeue -j %ld\n", folder->merge);
}

static enum status submit(struct submission *submission) {
    enum status status;
    if (!check_result(submission, &status))
        return status;
    if (!prepare_folder(submission) || !find_missing(submission))
        return STATUS_FAULT;
    submission->folder.array = submission->folder.merge = 0;
    const bool is_submitted =
        (submission->missing == 0 || submit_array(submission)) && submit_merge(submission);
    if (!slurm_folder_write(&submission->folder) || !is_submitted)
        return STATUS_FAULT;
    print_submitted(submission);
    return STATUS_DONE;
}

static enum status run_slurm(const struct options *options) {
    struct submission submission = {.options = options, .folder = {.file = -1}};
    enum status status = check_options(options);
    if (status != STATUS_DONE)
        return status;
    status = batch_setup_open(&submission.setup, options);
    if (status == STATUS_DONE && !kept_fits_hdf5(&submission.setup.sweep.keep, &submission.setup.layout))
        status = STATUS_FAULT;
    if (status == STATUS_DONE)
        status = submit(&submission);
    slurm_folder_close(&submission.folder);
    batch_setup_close(&submission.setup);
    return status;
}

static enum status run_batch_anywhere(const struct options *options) {
    const bool has_slurm = options_has(options, "slurm");
    if (has_slurm && !options_has(options, "dry-run"))
        return run_slurm(options);
    if (!has_slurm && (options_number(options, "chunks") > 0 || options_text(options, "slurm-options")))
        return usage_error(options->command, "--chunks and --slurm-options need --slurm");
    return run_batch(options);
}

static const struct option_rule slurm_rules[] = {
    {"slurm", NULL, OPTION_FLAG, "compute the cases in jobs of Slurm, on as many machines as it assigns",
     NULL, NULL},
    {"chunks", "N", OPTION_COUNT,
     "with --slurm: number of jobs that share the cases (default: one for each 16 cases, at most 100)", NULL,
     NULL},
    {"slurm-options", "TEXT", OPTION_TEXT,
     "with --slurm: options for sbatch, '--partition=long --time=1:00:00'", NULL, NULL},
    {.name = NULL}};

const struct command batch_command = {
    .name = "batch",
    .run = run_batch_anywhere,
    .operands = "MODEL.lua [SWEEP.lua]",
    .options = "output until method step tol step-max every from stabilise singular start hold release way "
               "summary table threads lanes cases resume dry-run slurm chunks slurm-options set",
    .tables = {slurm_rules, batch_rules, motion_rules, statics_rules, scene_rules},
    .output = "RUNS.h5",
    .purpose = "many motions of a model, into one file",
    .help = "The cases are those of SWEEP.lua, or the rows of a table. RUNS.h5 has what varied, and for each "
            "case its status,\n"
            "the reason and the kept results; RUNS.csv has one row for each case. During the batch, "
            "RUNS.h5.journal has the\n"
            "finished cases. With --slurm, jobs of Slurm compute the cases; their scripts and messages are "
            "in RUNS.h5.slurm. The\n"
            "same command again computes the missing cases.\n\n"
            "  refdyn batch models/manipulator.lua sweep.lua -o runs.h5\n"
            "  refdyn batch models/manipulator.lua --table cases.csv --until 1 -o runs.csv\n"
            "  refdyn batch models/manipulator.lua sweep.lua --slurm --slurm-options '--partition=long' -o "
            "runs.h5\n"};
