/* What emitted files are made from, for programs that build. Takes what was emitted and the folder of its
 * files; gives one rule as make reads it: the files, and behind the colon the model and all that it requires.
 */
#ifndef REFDYN_TOOL_GENERATE_H
#define REFDYN_TOOL_GENERATE_H

#include "gen/gen.h"
#include "runtime/tool/support/command_line/command_line.h"

const char *depfile_text(const struct generation *generation, const char *folder);

/* The commands of this folder. */
extern const struct command gen_command, check_command, compile_command, eval_command, bench_command,
    new_command;

#endif
