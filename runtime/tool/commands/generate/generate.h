/* The commands that generate, compile and evaluate a model: gen and check, compile, eval, bench, new. */
#ifndef REFDYN_TOOL_GENERATE_H
#define REFDYN_TOOL_GENERATE_H

#include "runtime/tool/support/options/options.h"

extern const struct command gen_command, check_command, compile_command, eval_command, bench_command,
    new_command;

#endif
