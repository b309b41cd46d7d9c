/*
 * What may stand behind an option or as an operand: words of a fixed set, and endings of files.
 *
 * Takes an option, or what the usage line names; gives lists with blanks between. Words are those that the
 * program itself compares with; endings are read off the names in the usage line ("STATE.json").
 */
#ifndef REFDYN_TOOL_SHELL_VALUES_H
#define REFDYN_TOOL_SHELL_VALUES_H

#include "command_line/options.h"

/* "": its values are no fixed set. */
const char *values_words(const struct option_text *option);
/* Those of an operand "bash|zsh"; "": it is none of a fixed set. */
const char *values_operand_words(const struct command *command);

/* What files are meant by a name such as "MODEL.lua" or "RUN..." */
enum files_meant { MEANT_NONE, MEANT_FOLDER, MEANT_ANY_FILE, MEANT_ENDINGS };
/* MEANT_ENDINGS: they are in *endings, as "csv h5". */
enum files_meant values_files(const char *argument, const char **endings);

#endif
