/* The flags of the compiler: see flags.h. */
#include "flags.h"

#include <stddef.h>

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
const char gcc_question[] = "#if !defined(__GNUC__) || defined(__clang__)\n#error not gcc\n#endif\n";
