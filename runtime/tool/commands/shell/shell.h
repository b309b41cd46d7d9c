/* Completion scripts of shells and the manual page, from the same tables as --help. */
#ifndef REFDYN_TOOL_SHELL_H
#define REFDYN_TOOL_SHELL_H

#include <stdio.h>

#include "runtime/tool/support/command_line/command_line.h"

/* Each prints a script, or the manual page, for the list of commands to `out`. */

void shell_put_bash_completion(FILE *out, const struct command *const *commands);
void shell_put_zsh_completion(FILE *out, const struct command *const *commands);
void shell_put_fish_completion(FILE *out, const struct command *const *commands);
void shell_put_manual_page(FILE *out, const struct command *const *commands);

/* Values of operands and options, for completion: words of a fixed set, and endings of files, separated by
 * blanks. Endings follow from the names in the usage line ("STATE.json"). */

/* The words of an operand "bash|zsh"; "" if they are no fixed set. */
const char *shell_values_operand_words(const struct command *command);

/* The kind of files that a name such as "MODEL.lua" or "RUN..." means. */
enum files_meant { MEANT_NONE, MEANT_FOLDER, MEANT_ANY_FILE, MEANT_ENDINGS };
/* For MEANT_ENDINGS they are in *endings: "csv h5". */
enum files_meant shell_values_files(const char *argument, const char **endings);

extern const struct command completion_command;

#endif
