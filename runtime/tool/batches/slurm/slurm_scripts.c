/*
 * Writes the shell scripts of a batch that Slurm computes, for people to read and to edit.
 *
 * Each task of the array runs chunk.sh: `refdyn batch --cases A:B --resume` into the chunk's part. A task
 * that fails puts itself back into the queue a few times. When all tasks have ended, merge.sh joins the
 * parts, or reports which are missing.
 */
#define _GNU_SOURCE
#include "runtime/tool/batches/slurm/slurm.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { RETRIES = 3 };

/* A script. All texts of users come after its first command, where sbatch no longer reads options. */
struct script {
    FILE *out;
    const struct slurm_folder *folder;
    const struct options *options;
    char *program; /* path of this program */
};

/* ---- Parts of both ---- */

static void put_header(const struct script *script, const char *name, const char *output) {
    fprintf(script->out,
            "#!/bin/sh\n"
            "#SBATCH --job-name=%s\n"
            "#SBATCH --output=%s\n"
            "#SBATCH --open-mode=append\n"
            "#SBATCH --requeue\n",
            name, output);
}

static void put_numbers(const struct script *script) {
    const struct chunks *chunks = &script->folder->chunks;
    fprintf(script->out, "first_case=%ld\ncases=%ld\nchunks=%ld\n", chunks->first,
            chunks->end - chunks->first, chunks->count);
}

/* Sets the shell variable NAME to this path. */
static void put_path(const struct script *script, const char *name, const char *path) {
    fprintf(script->out, "%s=", name);
    format_shell_text(script->out, path);
    fputc('\n', script->out);
}

static void put_bounds(const struct script *script, const char *indent) {
    fprintf(script->out,
            "%sfirst=$((first_case + cases * chunk / chunks))\n"
            "%send=$((first_case + cases * (chunk + 1) / chunks))\n",
            indent, indent);
}

/* ---- chunk.sh ---- */

/* Returns whether the script sets the option itself, or the option concerns the submission. */
static bool is_of_task(const char *name) {
    static const char *const others[] = {"output", "cases",  "threads", "summary",      "resume",
                                         "slurm",  "chunks", "dry-run", "slurm-options"};
    return text_index(name, others, sizeof others / sizeof others[0]) < 0;
}

static void put_option(void *context, const char *name, const char *value) {
    const struct script *script = context;
    if (!is_of_task(name))
        return;
    fprintf(script->out, " --%s", name);
    if (value) {
        fputc('=', script->out);
        format_shell_text(script->out, value);
    }
}

static void put_command(struct script *script) {
    fputs("\"$refdyn\" batch --cases=\"$first:$end\" --resume --threads=\"${SLURM_CPUS_PER_TASK:-1}\" \\\n"
          "    --output=\"$folder/part_$chunk.h5\"",
          script->out);
    options_give(script->options, put_option, script);
    fputs(" --", script->out);
    for (int i = 0; i < script->options->operand_count; i++) {
        fputc(' ', script->out);
        format_shell_text(script->out, script->options->operands[i]);
    }
    fputc('\n', script->out);
}

static void put_retry(const struct script *script) {
    fprintf(
        script->out,
        "status=$?\n"
        "[ $status -eq 0 ] && exit 0\n"
        "\n"
        "retries=${SLURM_RESTART_COUNT:-0}\n"
        "echo \"chunk $chunk, cases $first to $((end - 1)): exit status $status after $retries retries\" "
        ">&2\n"
        "# No retry after wrong usage (2), which stays wrong, nor after SIGTERM (143), from scancel or at "
        "the time limit.\n"
        "# The journal of the part has the cases that are done; a retry computes the others.\n"
        "if [ $status -ne 2 ] && [ $status -ne 143 ] && [ \"$retries\" -lt %d ]; then\n"
        "    scontrol requeue \"$SLURM_JOB_ID\"\n"
        "fi\n"
        "exit $status\n",
        RETRIES);
}

static void put_chunk_script(struct script *script) {
    char *here = realpath(".", NULL);
    const double threads = options_number(script->options, "threads");
    put_header(script, "refdyn", "chunk_%a.txt");
    fprintf(script->out,
            "#SBATCH --array=0-%ld\n"
            "#SBATCH --cpus-per-task=%.0f\n"
            "# One chunk of the cases of a batch, written by refdyn batch --slurm. Edits stay when that is\n"
            "# called again. By hand, from this folder: sbatch --array=2 chunk.sh\n",
            script->folder->chunks.count - 1, threads > 0 ? threads : 1);
    put_path(script, "refdyn", script->program);
    put_path(script, "folder", script->folder->path);
    put_path(script, "start", here ? here : ".");
    put_numbers(script);
    fputs("chunk=$SLURM_ARRAY_TASK_ID\n", script->out);
    put_bounds(script, "");
    fputs("\ncd -- \"$start\" || exit\n", script->out);
    put_command(script);
    put_retry(script);
    free(here);
}

/* ---- merge.sh ---- */

static void put_merge_script(struct script *script) {
    char *result = slurm_path_from_root(options_text(script->options, "output"));
    put_header(script, "refdyn-merge", "merge.txt");
    fputs("# Joins the parts of a batch once all chunks have ended, written by refdyn batch --slurm.\n",
          script->out);
    put_path(script, "refdyn", script->program);
    put_path(script, "folder", script->folder->path);
    put_path(script, "result", result);
    put_numbers(script);
    fputs("\ncd -- \"$folder\" || exit\n"
          "set --\n"
          "missing=0\n"
          "chunk=0\n"
          "while [ $chunk -lt $chunks ]; do\n"
          "    if [ -e part_$chunk.h5 ]; then\n"
          "        set -- \"$@\" part_$chunk.h5\n"
          "    else\n",
          script->out);
    put_bounds(script, "        ");
    fputs(
        "        [ -e merged ] || echo \"cases $first to $((end - 1)) are missing: chunk $chunk has "
        "failed, see chunk_$chunk.txt\" >&2\n"
        "        missing=$((missing + 1))\n"
        "    fi\n"
        "    chunk=$((chunk + 1))\n"
        "done\n"
        "\n"
        "# The file 'merged' protects a job that is queued again while it removes the parts.\n"
        "if [ ! -e merged ]; then\n"
        "    if [ $missing -gt 0 ]; then\n"
        "        printf '%s is not written: %d of %d chunks are missing. The parts stay; "
        "calling refdyn batch --slurm again computes what is missing.\\n' \"$result\" $missing $chunks >&2\n"
        "        exit 1\n"
        "    fi\n"
        "    \"$refdyn\" merge --output=\"$result\" -- \"$@\" || exit\n"
        "    : > merged\n"
        "fi\n"
        "rm -f -- \"$@\"\n",
        script->out);
}

/* ---- Files ---- */

static bool write_script(struct script *script, const char *name, void put(struct script *script)) {
    char *path = slurm_folder_name(script->folder, "%s", name);
    script->out = fopen(path, "w");
    bool is_written = script->out != NULL;
    if (script->out) {
        put(script);
        is_written = !ferror(script->out);
        is_written = fclose(script->out) == 0 && is_written;
    }
    if (!is_written)
        format_complain("refdyn: %s: %s\n", path, strerror(errno));
    return is_written;
}

bool slurm_scripts_write(const struct slurm_folder *folder, const struct options *options) {
    struct script script = {
        .folder = folder, .options = options, .program = realpath("/proc/self/exe", NULL)};
    if (!script.program) {
        fprintf(stderr, "refdyn: /proc/self/exe, the name of this program: %s\n", strerror(errno));
        return false;
    }
    const bool is_written = write_script(&script, "chunk.sh", put_chunk_script) &&
                            write_script(&script, "merge.sh", put_merge_script);
    free(script.program);
    return is_written;
}
