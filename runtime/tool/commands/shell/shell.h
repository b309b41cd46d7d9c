/* What this folder offers. */
#ifndef REFDYN_TOOL_SHELL_H
#define REFDYN_TOOL_SHELL_H

#include <stdio.h>

#include "runtime/tool/support/command_line/command_line.h"

/*
 * The commands and options of the program as shells and `man` take them.
 *
 * Takes the table of commands; prints a script of completion, or a manual page, to `out`. All is read from
 * the same tables as --help.
 */

void put_bash_completion(FILE *out, const struct command *const *commands);
void put_zsh_completion(FILE *out, const struct command *const *commands);
void put_fish_completion(FILE *out, const struct command *const *commands);
void put_manual_page(FILE *out, const struct command *const *commands);

/*
 * What may stand behind an option or as an operand: words of a fixed set, and endings of files.
 *
 * Takes an option, or what the usage line names; gives lists with blanks between. Words are those that the
 * program itself compares with; endings are read off the names in the usage line ("STATE.json").
 */

/* Those of an operand "bash|zsh"; "": it is none of a fixed set. */
const char *values_operand_words(const struct command *command);

/* What files are meant by a name such as "MODEL.lua" or "RUN..." */
enum files_meant { MEANT_NONE, MEANT_FOLDER, MEANT_ANY_FILE, MEANT_ENDINGS };
/* MEANT_ENDINGS: they are in *endings, as "csv h5". */
enum files_meant values_files(const char *argument, const char **endings);

extern const struct command completion_command;

#endif
