/*
 * `refdyn batch --slurm`: submits the cases as an array of jobs, and a job that merges their results.
 *
 * Called again after a failure, it submits only the chunks that are missing. It also starts each chunk's
 * journal with the hashes of model, sweep and options, so that a task refuses files that have changed since.
 */
#define _GNU_SOURCE
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/batches/slurm/slurm.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* By default Slurm limits the indices of an array to 1000 (MaxArraySize 1001). */
enum { CASES_OF_CHUNK = 16, CHUNKS_DEFAULT_MOST = 100, CHUNKS_MOST = 1000 };

struct submission {
    struct batch_setup setup;
    struct slurm_folder folder;
    const struct options *options;
    bool *is_missing; /* (chunks.count) */
    long missing;     /* number of missing chunks */
};

/* ---- A program and its output ---- */

static bool refuse_program(const char *program, char *said) {
    said[strcspn(said, "\n")] = '\0'; /* the first line has the cause */
    fprintf(stderr, "refdyn: %s failed%s", program, *said ? ": " : "");
    format_plain_text(stderr, said);
    fputc('\n', stderr);
    return false;
}

static bool run_into(const char *const *argv, const char *output, const char *errors) {
    struct process process;
    const int error = system_process_start(&process, NULL, argv, NULL, output, errors);
    if (error) {
        format_complain("refdyn: %s cannot be started: %s\n", argv[0], strerror(error));
        return false;
    }
    if (system_process_wait(&process, 1, NULL) == 0 && process.result == 0)
        return true;
    char *said = format_read_file(errors, argv[0]);
    if (said)
        refuse_program(argv[0], said);
    return false;
}

/* Returns the output of the program, NULL after an error, which is reported. */
static char *run_program(const struct slurm_folder *folder, const char *const *argv) {
    char *output = slurm_folder_name(folder, ".%s.out", argv[0]);
    char *errors = slurm_folder_name(folder, ".%s.err", argv[0]);
    char *said = run_into(argv, output, errors) ? format_read_file(output, argv[0]) : NULL;
    unlink(output);
    unlink(errors);
    return said;
}

/* ---- sbatch, squeue and scancel ---- */

/* sbatch --parsable prints NUMBER or NUMBER;CLUSTER. */
static long job_number(char *said) {
    char *rest;
    const long job = strtol(said, &rest, 10);
    if (job > 0 && (*rest == ';' || *rest == '\n' || *rest == '\0'))
        return job;
    refuse_program("sbatch printed no job number and", said);
    return 0;
}

static long submit_script(const struct slurm_folder *folder, const char *words, const char *option,
                          const char *script) {
    char *copy = format_text("%s", words ? words : ""), *rest;
    char *chdir = format_text("--chdir=%s", folder->path), *path = slurm_folder_name(folder, "%s", script);
    const char **argv = format_allocate(strlen(copy) / 2 + 8, sizeof *argv);
    int count = 0;
    argv[count++] = "sbatch";
    for (char *word = strtok_r(copy, " \t\n", &rest); word; word = strtok_r(NULL, " \t\n", &rest))
        argv[count++] = word;
    argv[count++] = "--parsable";
    argv[count++] = chdir;
    if (option)
        argv[count++] = option;
    argv[count++] = path;
    char *said = run_program(folder, argv);
    return said ? job_number(said) : 0;
}

/* Sets *is_running if a job of the folder is still in the queue; returns false if the queue did not answer.
 * It reads all jobs of the user, since squeue fails for the number of a job that Slurm has forgotten. */
static bool ask_queue(const struct slurm_folder *folder, bool *is_running) {
    char *user = format_text("--user=%ld", (long)getuid());
    const char *const argv[] = {"squeue", "--noheader", "--format=%F", user, NULL};
    char *said = run_program(folder, argv), *at = said, *end;
    *is_running = false;
    for (long job; said && (job = strtol(at, &end, 10)) > 0; at = end)
        *is_running = *is_running || job == folder->array || job == folder->merge;
    return said != NULL;
}

static void cancel_job(const struct slurm_folder *folder, long job) {
    char *number = format_text("%ld", job);
    const char *const argv[] = {"scancel", number, NULL};
    run_program(folder, argv);
}

/* ---- Options ---- */

/* sbatch options that would change the jobs themselves. */
static const char *find_unfit_word(const char *words) {
    static const char *const unfit[] = {"--array", "--dependency", "--wrap"};
    for (size_t i = 0; words && i < sizeof unfit / sizeof unfit[0]; i++)
        if (strstr(words, unfit[i]))
            return unfit[i];
    return NULL;
}

/* Slurm also replaces %a and similar in the folder of a job's output, and reads scripts line by line. */
static bool has_fit_name(const struct options *options) {
    return !strpbrk(slurm_path_from_root(options_text(options, "output")), "%\\\n\r");
}

static enum status check_options(const struct options *options) {
    const char *output = options_text(options, "output");
    const double chunks = options_number(options, "chunks");
    const char *unfit = find_unfit_word(options_text(options, "slurm-options"));
    if (!format_names_hdf5(output))
        return options_usage_error(options->command, "-o %s: with --slurm the name must end in .h5", output);
    if (!has_fit_name(options))
        return options_usage_error(
            options->command,
            "-o %s: the names of the file and its folders must not have %%, a backslash or a line break, "
            "which Slurm replaces",
            output);
    if (options_text(options, "summary"))
        return options_usage_error(options->command, "--summary: jobs of Slurm write no summary; omit it");
    if (unfit)
        return options_usage_error(options->command, "--slurm-options: refdyn sets %s itself; omit it",
                                   unfit);
    if (chunks > CHUNKS_MOST)
        return options_usage_error(options->command, "--chunks %.0f: must be at most %d", chunks,
                                   CHUNKS_MOST);
    if (system_process_find("sbatch"))
        return STATUS_DONE;
    fprintf(stderr, "refdyn: --slurm: the program sbatch of Slurm is not in PATH; with another scheduler, "
                    "--cases A:B computes a part and refdyn merge joins parts\n");
    return STATUS_FAULT;
}

/* ---- What is there ---- */

static bool complain(const struct submission *submission, const char *fact) {
    format_complain("refdyn: %s: %s\n", submission->folder.path, fact);
    return false;
}

/* Returns false if nothing may be submitted; *status is then STATUS_DONE if all cases are done. */
static bool check_result(const struct submission *submission, enum status *status) {
    const struct batch_setup *setup = &submission->setup;
    const char *result = options_text(submission->options, "output");
    const enum runs_present_result present = runs_present_result(setup, result, setup->first, setup->end);
    const bool has_journal = access(format_text("%s.journal", result), F_OK) == 0;
    *status = present == PRESENT_COMPLETE ? STATUS_DONE : STATUS_FAULT;
    if (present == PRESENT_COMPLETE)
        fprintf(stderr, "refdyn: %s already has all %ld cases\n", result, setup->end - setup->first);
    else if (present == PRESENT_OTHER)
        fprintf(stderr, "refdyn: --slurm does not replace a file; use another name for the result\n");
    else if (has_journal)
        fprintf(stderr,
                "refdyn: %s.journal: a batch without --slurm has left its cases here; resume it with "
                "--resume and without --slurm\n",
                result);
    return present == PRESENT_NONE && !has_journal;
}

static bool check_queue(const struct submission *submission) {
    const struct slurm_folder *folder = &submission->folder;
    bool is_running;
    if (folder->array == 0 && folder->merge == 0)
        return true;
    if (!ask_queue(folder, &is_running))
        return complain(submission,
                        "the queue does not say whether its jobs still run; nothing was submitted");
    if (!is_running)
        return true;
    format_complain("refdyn: %s: its jobs are already in the queue: squeue -j %ld,%ld\n", folder->path,
                    folder->array ? folder->array : folder->merge, folder->merge);
    return false;
}

/* Checks that the folder's record describes this batch. */
static bool check_same(const struct submission *submission) {
    const struct batch_setup *setup = &submission->setup;
    const struct chunks *chunks = &submission->folder.chunks;
    const double asked = options_number(submission->options, "chunks");
    for (int part = 0; part < JOURNAL_PARTS; part++)
        if (strcmp(submission->folder.key.hash[part], setup->key.hash[part]) != 0) {
            fprintf(stderr,
                    "refdyn: %s: the %s of this batch differ from those of the folder; remove the folder to "
                    "start again\n",
                    submission->folder.path, runs_journal_parts[part]);
            return false;
        }
    if (chunks->first != setup->first || chunks->end != setup->end)
        return complain(submission, "has another range of --cases; remove it to start again");
    if (asked > 0 && (long)asked != chunks->count)
        return complain(submission, "has another number of --chunks; remove it to start again");
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
    options_set_number(
        &options, "lanes",
        submission->setup.lanes); /* the same on all machines, regardless of their vector width */
    return slurm_scripts_write(folder, &options) && slurm_folder_write(folder);
}

/* A merged batch leaves its folder. If its result has been removed, the batch starts again. */
static bool prepare_folder(struct submission *submission) {
    struct slurm_folder *folder = &submission->folder;
    if (!slurm_folder_open(folder, options_text(submission->options, "output")) || !check_queue(submission))
        return false;
    const bool is_merged = access(slurm_folder_name(folder, "merged"), F_OK) == 0;
    return folder->chunks.count == 0 || is_merged ? begin_folder(submission) : check_same(submission);
}

/* ---- Chunks ---- */

/* Starts the journal of a chunk that has none, with the identity of the batch. */
static bool begin_journal(const struct submission *submission, const char *part) {
    const struct batch_setup *setup = &submission->setup;
    struct journal journal;
    const bool is_good =
        runs_journal_open(&journal, part, &setup->key, setup->sweep.cases.count, setup->layout.width, true);
    runs_journal_close(&journal);
    return is_good;
}

static bool find_missing(struct submission *submission) {
    const struct chunks *chunks = &submission->folder.chunks;
    submission->is_missing = format_allocate((size_t)chunks->count, sizeof *submission->is_missing);
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

/* "--array=0-3,7" in heap memory. */
static char *array_option(const struct submission *submission) {
    const long count = submission->folder.chunks.count;
    char *text, separator = '=';
    size_t size;
    FILE *out = format_stream(&text, &size);
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
        submit_script(folder, options_text(submission->options, "slurm-options"), option, "chunk.sh");
    free(option);
    return folder->array > 0;
}

/* This job runs after the tasks even if they fail, since it reports which are missing. */
static bool submit_merge(struct submission *submission) {
    struct slurm_folder *folder = &submission->folder;
    const char *option = folder->array ? format_text("--dependency=afterany:%ld", folder->array) : NULL;
    folder->merge =
        submit_script(folder, options_text(submission->options, "slurm-options"), option, "merge.sh");
    if (folder->merge == 0 && folder->array) {
        cancel_job(folder, folder->array);
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
    format_complain("folder       %s.slurm: scripts, and messages of the jobs\n",
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
    status = runs_setup_open(&submission.setup, options);
    if (status == STATUS_DONE && !runs_kept_fits_hdf5(&submission.setup.sweep.keep, &submission.setup.layout))
        status = STATUS_FAULT;
    if (status == STATUS_DONE)
        status = submit(&submission);
    slurm_folder_close(&submission.folder);
    runs_setup_close(&submission.setup);
    return status;
}

static enum status run_batch_anywhere(const struct options *options) {
    const bool has_slurm = options_has(options, "slurm");
    if (has_slurm && !options_has(options, "dry-run"))
        return run_slurm(options);
    if (!has_slurm && (options_number(options, "chunks") > 0 || options_text(options, "slurm-options")))
        return options_usage_error(options->command, "--chunks and --slurm-options need --slurm");
    return runs_batch(options);
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
    .options = "output until method step tol tol-rates step-max every from stabilise singular start hold "
               "release way realise before after mesh summary table threads lanes cases resume dry-run slurm "
               "chunks slurm-options set",
    .tables = {slurm_rules, runs_batch_rules, realise_rules, simulate_rules, equilibria_rules, scene_rules},
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
