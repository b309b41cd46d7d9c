/* The flags of the compiler: see flags.h. */
#include "flags.h"
#include "build.h"
#include "output.h"
#include "process.h"

#include <stdio.h>
#include <stdlib.h>

/*
 * -ffp-contract=off: a multiplication and an addition are two roundings on every machine and with every
 * compiler, as in the generator's interpreter. -fno-math-errno: sqrt is one instruction; nothing reads errno.
 * Neither -ffast-math nor -march=native: the first changes results, the second breaks a cache that two
 * machines share.
 */
const char *const compile_flags[] = {"-std=c11",        "-O2", "-fPIC", "-ffp-contract=off",
                                     "-fno-math-errno", NULL};

/*
 * Passes of gcc that find nothing in emitted C, which shares its common values already: without them it
 * compiles in 0.6 of the time, and what comes out is as fast. Vectors in long blocks of scalars take -O3
 * minutes to find and are slower; loops over arrays stay vectors.
 */
const char *const gcc_flags[] = {"-fno-tree-slp-vectorize",
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

/* clang says that it is a GNU compiler, too. */
static const char question[] = "#if !defined(__GNUC__) || defined(__clang__)\n#error not gcc\n#endif\n";

static bool write_question(const char *path) {
    FILE *file = fopen(path, "w");
    const bool is_written = file && fputs(question, file) >= 0;
    return file && fclose(file) == 0 && is_written;
}

static bool runs_well(const struct build *build, const char *const *argv, const char *log) {
    struct process process;
    return process_start(&process, &build->scratch, argv, NULL, log, NULL) == 0 &&
           process_wait(&process, 1) == 0 && process.result == 0;
}

bool is_gcc(const struct toolchain *chain, const struct build *build) {
    const size_t flag_count = sizeof gcc_flags / sizeof *gcc_flags - 1;
    const char **argv = allocate((size_t)chain->word_count + flag_count + 3, sizeof *argv);
    char *source = text_format("%s/question.c", build->scratch.path);
    char *log = text_format("%s/question.log", build->scratch.path);
    int argc = 0;
    for (int i = 0; i < chain->word_count; i++)
        argv[argc++] = chain->words[i];
    for (size_t i = 0; i < flag_count; i++)
        argv[argc++] = gcc_flags[i];
    argv[argc++] = "-fsyntax-only";
    argv[argc] = source;
    const bool answer = write_question(source) && runs_well(build, argv, log);
    free(log);
    free(source);
    free(argv);
    return answer;
}
