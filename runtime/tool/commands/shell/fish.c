/* The completion script for fish. */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"

static const char beginning[] =
    "# Completion of refdyn in fish, written by `refdyn completion fish`: do not edit.\n\n"
    "# Folders, and files with one of these endings.\n"
    "function __refdyn_files\n"
    "    for ending in $argv\n"
    "        __fish_complete_suffix .$ending | string replace -r -- '^--[^=]*=' '' |\n"
    "            string match -r -- '^.*(?:/|\\.'$ending')(?:\\t.*)?$'\n"
    "    end\n"
    "end\n\n"
    "# A list of such words, whose last item is completed.\n"
    "function __refdyn_list\n"
    "    set -l lead (commandline -ct | string replace -r -- '^--[^=]*=' '' | string match -r -- '^.*,')\n"
    "    printf '%s\\n' \"$lead\"$argv\n"
    "end\n\n"
    "complete -c refdyn -f\n";

/* Puts a text in single quotes of the shell. */
static void put_quoted(FILE *out, const char *text) {
    fputc('\'', out);
    for (; *text; text++)
        fprintf(out, *text == '\'' || *text == '\\' ? "\\%c" : "%c", *text);
    fputc('\'', out);
}

/* Puts the commands that list folders and files with these endings. */
static void put_files(FILE *out, const char *argument) {
    const char *endings;
    switch (shell_values_files(argument, &endings)) {
    case MEANT_FOLDER:
        fputs(" (__fish_complete_directories)", out);
        break;
    case MEANT_ANY_FILE:
        fputs(" (__fish_complete_path)", out);
        break;
    case MEANT_ENDINGS:
        fprintf(out, " (__refdyn_files %s)", endings);
        break;
    default:
        break;
    }
}

static void put_option(FILE *out, const struct command *command, const struct option_text *option) {
    fprintf(out, "complete -c refdyn -n '__fish_seen_subcommand_from %s' -l %s%s", command->name,
            option->name, option->is_output ? " -s o" : "");
    if (*option->argument) {
        const char *words = option->words;
        fprintf(out, option->is_list && *words ? " -x -a \"(__refdyn_list %s)" : " -x -a \"%s", words);
        put_files(out, option->argument);
        fputc('"', out);
    }
    fputs(" -d ", out);
    put_quoted(out, option->help);
    fputc('\n', out);
}

void shell_put_fish_completion(FILE *out, const struct command *const *commands) {
    struct option_text option;
    fputs(beginning, out);
    for (int k = 0; commands[k]; k++) {
        fprintf(out, "complete -c refdyn -n __fish_use_subcommand -a %s -d ", commands[k]->name);
        put_quoted(out, commands[k]->purpose);
        fprintf(out, "\ncomplete -c refdyn -n '__fish_seen_subcommand_from %s' -a \"%s", commands[k]->name,
                shell_values_operand_words(commands[k]));
        put_files(out, commands[k]->operands);
        fputs("\"\n", out);
        for (int i = 0; options_describe(commands[k], i, &option); i++)
            put_option(out, commands[k], &option);
    }
}
