/*
 * One build of emitted C in a folder of its own: files written, objects compiled two at a time, linked.
 */
#ifndef REFDYN_TOOL_BUILD_JOB_H
#define REFDYN_TOOL_BUILD_JOB_H

#include "compile/compile.h"
#include "system/temporary_folder.h"

#include <stddef.h>

/* The texts of runtime/refdyn_model.h and refdyn_lanes.h, put in at build time. */
extern const char refdyn_model_header[], refdyn_lanes_header[];
extern const size_t refdyn_model_header_size, refdyn_lanes_header_size;

/* What emitted C is compiled with, by every compiler, and by gcc beside that; both end with NULL. */
extern const char *const compile_flags[], *const gcc_flags[];

/* $CC: its words and the program's file. */
struct toolchain {
    const char *program;
    const char *const *words; /* end with NULL */
};

/* What the files of lanes are compiled with beside that: how many there are, and for which vectors. */
const char *const *lanes_flags(int width);

/* Complains on stderr when there is none. */
bool toolchain_find(struct toolchain *chain);
/* Is it gcc, and one that knows all of gcc_flags? clang says that it is gcc, too. */
bool toolchain_is_gcc(const struct toolchain *chain, const struct scratch *scratch);

struct build {
    struct scratch scratch; /* open: all that is made lies in it */
    const char *library;    /* the linked library in it */
    bool is_gcc;            /* what compiles it */
    int lanes;              /* of files for lanes; 0: there are none */
};

/* Complains on stderr, with the compiler's own output, and returns false when it fails. cost may be NULL. */
bool build_run(struct build *build, const struct toolchain *chain, const struct emitted_file *files,
               int count, struct build_cost *cost);

#endif
