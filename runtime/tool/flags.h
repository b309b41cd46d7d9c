/*
 * What emitted C is compiled with.
 */
#ifndef REFDYN_TOOL_FLAGS_H
#define REFDYN_TOOL_FLAGS_H

/* For every compiler; ends with NULL. */
extern const char *const compile_flags[];
/* For gcc, behind those; ends with NULL. */
extern const char *const gcc_flags[];

/* A source that gcc alone compiles. */
extern const char gcc_question[];

#endif
