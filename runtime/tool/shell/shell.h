/*
 * The commands and options of the program as shells and `man` take them.
 *
 * Takes the table of commands; prints a script of completion, or a manual page, to `out`. All is read from
 * the same tables as --help.
 */
#ifndef REFDYN_TOOL_SHELL_H
#define REFDYN_TOOL_SHELL_H

#include "command_line/options.h"

#include <stdio.h>

void put_bash_completion(FILE *out, const struct command *commands);
void put_zsh_completion(FILE *out, const struct command *commands);
void put_fish_completion(FILE *out, const struct command *commands);
void put_manual_page(FILE *out, const struct command *commands);

#endif
