/*
 * What emitted C is compiled with.
 */
#ifndef REFDYN_TOOL_FLAGS_H
#define REFDYN_TOOL_FLAGS_H

#include <stdbool.h>

struct build;
struct toolchain;

/* For every compiler; ends with NULL. */
extern const char *const compile_flags[];
/* For gcc, behind those; ends with NULL. */
extern const char *const gcc_flags[];

/* Is $CC gcc, and does it know all of gcc_flags? Asks it, in the folder of the build. */
bool is_gcc(const struct toolchain *chain, const struct build *build);

#endif
