/* Completion in fish: see shell.h. */
#include "shell/shell.h"
#include "shell/values.h"
#include "text/output.h"

/* Within single quotes of the shell. */
static void put_quoted(FILE *out, const char *text) {
    fputc('\'', out);
    for (; *text; text++)
        fprintf(out, *text == '\'' || *text == '\\' ? "\\%c" : "%c", *text);
    fputc('\'', out);
}

/* What gives folders, and files with these endings. */
static void put_files(FILE *out, const char *argument) {
    const char *endings;
    switch (values_files(argument, &endings)) {
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
        fprintf(out, " -x -a \"%s", values_words(option));
        put_files(out, option->argument);
        fputc('"', out);
    }
    fputs(" -d ", out);
    put_quoted(out, option->help);
    fputc('\n', out);
}

void put_fish_completion(FILE *out, const struct command *commands) {
    struct option_text option;
    fputs("# Completion of refdyn in fish, written by `refdyn completion fish`: do not edit.\n\n"
          "function __refdyn_files\n    for ending in $argv\n        __fish_complete_suffix .$ending\n    "
          "end\nend\n\n"
          "complete -c refdyn -f\n",
          out);
    for (const struct command *command = commands; command->name; command++) {
        fprintf(out, "complete -c refdyn -n __fish_use_subcommand -a %s -d ", command->name);
        put_quoted(out, command->purpose);
        fprintf(out, "\ncomplete -c refdyn -n '__fish_seen_subcommand_from %s' -a \"%s", command->name,
                values_operand_words(command));
        put_files(out, command->operands);
        fputs("\"\n", out);
        for (int i = 0; options_describe(command, i, &option); i++)
            put_option(out, command, &option);
    }
}
