/* Completion scripts of shells and the manual page, from the same tables as --help. */
#ifndef REFDYN_TOOL_SHELL_H
#define REFDYN_TOOL_SHELL_H

#include <stdio.h>

#include "runtime/tool/support/options/options.h"

/* Prints the manual page for the list of commands. */
void shell_put_manual_page(FILE *out, const struct command *const *commands);

extern const struct command completion_command;

#endif
