/*
 * The compilers of emitted C: $CC, which makes the optimised library, and the compiler of the first tier;
 * their flags, and their runs.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "refdyn_batch.h"
#include "runtime/tool/support/compile/compile.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- Flags ---- */

/* -ffp-contract=off: a multiplication and an addition are rounded twice on every machine and by every
 * compiler, as in the generator's interpreter. -fno-math-errno: sqrt is one instruction; nothing reads errno.
 * Neither -ffast-math nor -march=native is used: the first changes results, the second breaks a cache that
 * two machines share. */
const char *const compile_flags[] = {"-std=c11",        "-O2", "-fPIC", "-ffp-contract=off",
                                     "-fno-math-errno", NULL};

/* These passes of gcc find nothing in emitted C, which already shares common values. Without them it compiles
 * in 0.6 of the time, and the result is as fast. The search for vectors in long blocks of scalars takes -O3
 * minutes and makes them slower; loops over arrays stay vectors. */
const char *const compile_gcc_flags[] = {"-fno-tree-slp-vectorize",
                                         "-fno-tree-pre",
                                         "-fno-gcse",
                                         "-fno-rerun-cse-after-loop",
                                         "-fno-tree-dominator-opts",
                                         "-fno-tree-vrp",
                                         "-fno-code-hoisting",
                                         "-fno-schedule-insns2",
                                         "-fno-ivopts",
                                         "-fno-tree-ccp",
                                         "-fno-dse",
                                         "-fno-cprop-registers",
                                         "-fno-forward-propagate",
                                         "-fira-region=one",
                                         "-fno-lra-remat",
                                         "-fno-caller-saves",
                                         "-fno-peephole2",
                                         "-fno-ree",
                                         "-fno-tree-dse",
                                         "-fno-ipa-cp",
                                         "-fno-ipa-icf",
                                         "-fno-ipa-sra",
                                         NULL};

const char *const *compile_lanes_flags(int width) {
    static const char *const two[] = {"-DLANES=2", NULL}, *const four[] = {"-DLANES=4", "-mavx2", NULL},
                             *const eight[] = {"-DLANES=8", "-mavx512f", NULL};
    static const char *const four_apart[] = {"-DLANES=4", NULL}, *const eight_apart[] = {"-DLANES=8", NULL};
    const bool is_apart = width > refdyn_batch_widest(); /* the compiler splits the vectors */
    return width == 8 ? is_apart ? eight_apart : eight : width == 4 ? is_apart ? four_apart : four : two;
}

/* ---- $CC ---- */

static const char blanks[] = " \t\n";

/* $CC is the file of a program, which may contain blanks, or a command of words separated by blanks ("ccache
 * gcc"). */
bool compile_toolchain_find(struct toolchain *chain) {
    const char *command = getenv("CC");
    if (!command || command[strspn(command, blanks)] == '\0')
        command = "cc";
    char *text = format_text("%s", command), *rest = NULL;
    const char **words = format_allocate(strlen(command) / 2 + 2, sizeof *words);
    int count = 0;
    if (strchr(command, '/') && access(command, X_OK) == 0)
        words[count++] = text;
    else
        for (char *word = strtok_r(text, blanks, &rest); word; word = strtok_r(NULL, blanks, &rest))
            words[count++] = word;
    chain->words = words;
    chain->program = system_process_find(chain->words[0]);
    if (!chain->program)
        format_complain("refdyn: no C compiler '%s' is installed; $CC names another one\n", chain->words[0]);
    return chain->program;
}

/* clang also defines __GNUC__ */
static const char gcc_question[] = "#if !defined(__GNUC__) || defined(__clang__)\n#error not gcc\n#endif\n";

/* Applies to gcc only, and to a version that knows all of its flags. */
static void question_job(struct job *job, const struct toolchain *chain, const struct scratch *scratch) {
    *job = (struct job){.source = system_scratch_file(scratch, "question.c")};
    compile_job_add_words(job, chain->words);
    job->log = format_text("%s.log", job->source);
    compile_job_add_words(job, compile_gcc_flags);
    compile_job_add_words(job, (const char *[]){"-fsyntax-only", job->source, NULL});
}

bool compile_toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch) {
    struct job job;
    question_job(&job, chain, scratch);
    return system_scratch_write(scratch, "question.c", gcc_question, strlen(gcc_question)) &&
           compile_job_succeeds(scratch, &job, format_text("asking %s whether it is gcc", chain->words[0]));
}

/* ---- The first tier ---- */

/*
 * The compilers of the first tier, the fastest one first, with the flags for one run that compiles and links.
 * Without optimisation they round as the generator's interpreter does, so that results are equal to the bit.
 * tcc does so on x86-64 only: elsewhere its sines are those of libm (gen/emit/emit_sincos.c).
 */
static const char *const first_compilers[][7] = {
#if defined(__x86_64__)
    {"tcc", "-shared", NULL},
#endif
    {"clang", "-std=c11", "-O0", "-fPIC", "-ffp-contract=off", "-shared", NULL},
    {"gcc", "-std=c11", "-O0", "-fPIC", "-ffp-contract=off", "-shared", NULL}};

bool compile_toolchain_first(struct toolchain *first, const struct toolchain *chain) {
    if (chain->words[1]) /* its own flags may change arithmetic */
        return false;
    for (size_t i = 0; i < sizeof first_compilers / sizeof *first_compilers; i++) {
        first->words = first_compilers[i];
        first->program = system_process_find(first->words[0]);
        if (first->program)
            return true;
    }
    return false;
}

/* ---- Runs of a compiler ---- */

enum { PROCESSES = 2 };

void compile_job_add_word(struct job *job, const char *word) {
    job->argv = memory_room(&format_memory, job->argv, job->argc + 1, &job->room, sizeof *job->argv);
    job->argv[job->argc++] = word;
}

void compile_job_add_words(struct job *job, const char *const *words) {
    for (; *words; words++)
        compile_job_add_word(job, *words);
}

bool compile_job_succeeds(const struct scratch *scratch, const struct job *job, const char *what) {
    struct process process;
    struct notice notice;
    system_notice_start(&notice, what);
    const bool is_good = system_process_start(&process, scratch, job->argv, NULL, job->log, NULL) == 0 &&
                         system_process_wait(&process, 1, &notice) == 0 && process.result == 0;
    system_notice_end(&notice);
    return is_good;
}

static void show_log(const struct job *job) {
    fputs("refdyn: the compiler failed:", stderr);
    for (int i = 0; i < job->argc; i++)
        format_complain(" %s", job->argv[i]);
    fputc('\n', stderr);
    system_copy_file(job->log, stderr);
}

static bool start(struct process *process, const struct scratch *scratch, const struct job *job) {
    const int error = system_process_start(process, scratch, job->argv, NULL, job->log, NULL);
    if (error)
        format_complain("refdyn: the compiler '%s' could not be started: %s\n", job->argv[0],
                        strerror(error));
    return error == 0;
}

/* What a notice calls these jobs. */
static const char *describe(const struct job *jobs, int count) {
    const char *source = jobs[0].source, *slash = source ? strrchr(source, '/') : NULL;
    if (!slash)
        return count > 1 ? format_text("compiling %d files", count) : "linking";
    return count > 1 ? format_text("compiling %s and %d more", slash + 1, count - 1)
                     : format_text("compiling %s", slash + 1);
}

bool compile_jobs_run(const struct scratch *scratch, const struct job *jobs, int count, long *peak_kb) {
    struct process running[PROCESSES] = {{.pid = 0}};
    const struct job *of[PROCESSES] = {NULL};
    struct notice notice;
    bool is_good = true;
    system_notice_start(&notice, describe(jobs, count));
    for (int next = 0, active = 0; active > 0 || (is_good && next < count);) {
        while (is_good && next < count && active < PROCESSES) {
            int free_place = running[0].pid == 0 ? 0 : 1;
            of[free_place] = &jobs[next++];
            is_good = start(&running[free_place], scratch, of[free_place]);
            active += is_good;
        }
        int done = active ? system_process_wait(running, PROCESSES, &notice) : -1;
        is_good = is_good && done >= 0;
        if (done < 0)
            break;
        active--;
        if (running[done].result != 0) {
            system_notice_end(&notice);
            show_log(of[done]);
            is_good = false;
        }
        if (running[done].peak_kb > *peak_kb)
            *peak_kb = running[done].peak_kb;
    }
    system_notice_end(&notice);
    return is_good;
}
