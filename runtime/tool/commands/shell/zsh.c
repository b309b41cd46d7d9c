/* The completion script for zsh, with its _arguments. */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"

#include <string.h>

/* A text within single quotes of the shell. A backslash precedes characters that _arguments and _describe
 * would interpret. */
static void put_quoted(FILE *out, const char *text) {
    for (; *text; text++)
        if (*text == '\'')
            fputs("'\\''", out);
        else
            fprintf(out, strchr("[]:\\", *text) ? "\\%c" : "%c", *text);
}

/* "*.(csv|h5)"; parentheses around a single ending would be qualifiers. */
static void put_pattern(FILE *out, const char *endings) {
    const bool has_several = strchr(endings, ' ') != NULL;
    fputs(has_several ? "*.(" : "*.", out);
    for (; *endings; endings++)
        fputc(*endings == ' ' ? '|' : *endings, out);
    fputs(has_several ? ")" : "", out);
}

static void put_files(FILE *out, const char *argument, const char *otherwise) {
    const char *endings;
    const enum files_meant meant = shell_values_files(argument, &endings);
    if (meant == MEANT_FOLDER)
        fputs("_files -/", out);
    else if (meant == MEANT_ANY_FILE)
        fputs("_files", out);
    else if (meant == MEANT_ENDINGS) {
        fputs("_files -g \"", out);
        put_pattern(out, endings);
        fputc('"', out);
    } else
        fputs(otherwise, out);
}

/* How an argument is completed: words, files, or both; a single blank if it is not. A blank at the beginning
 * keeps _arguments from adding its own words. */
static void put_action(FILE *out, const struct option_text *option) {
    const char *words = option->words, *endings;
    if (!*words) {
        put_files(out, option->argument, " ");
    } else if (option->is_list) {
        fprintf(out, "_sequence compadd - %s", words);
    } else if (shell_values_files(option->argument, &endings) == MEANT_NONE) {
        fprintf(out, "(%s)", words);
    } else {
        fprintf(out, " _alternative \"words\\:word\\:(%s)\" \"files\\:file\\:_files -g \\\"", words);
        put_pattern(out, endings);
        fputs("\\\"\"", out);
    }
}

static void put_option(FILE *out, const struct option_text *option) {
    if (option->is_output)
        fputs("            '(-o --output)'{-o,--output=}'", out);
    else
        fprintf(out, "            '%s--%s%s", option->may_repeat ? "*" : "", option->name,
                *option->argument ? "=" : "");
    fputc('[', out);
    put_quoted(out, option->help);
    fputc(']', out);
    if (*option->argument) {
        fputc(':', out);
        put_quoted(out, option->argument);
        fputc(':', out);
        put_action(out, option);
    }
    fputs("' \\\n", out);
}

static void put_operand(FILE *out, const struct command *command) {
    const char *words = shell_values_operand_words(command);
    fputs("            '*:", out);
    put_quoted(out, command->operands);
    fputc(':', out);
    if (*words)
        fprintf(out, "(%s)", words);
    else
        put_files(out, command->operands, " ");
    fputs("'\n", out);
}

void shell_put_zsh_completion(FILE *out, const struct command *const *commands) {
    struct option_text option;
    fputs(
        "#compdef refdyn\n# Completion of refdyn in zsh, written by `refdyn completion zsh`: do not edit.\n\n"
        "_refdyn() {\n    local -a commands\n    commands=(\n",
        out);
    for (int k = 0; commands[k]; k++) {
        fprintf(out, "        '%s:", commands[k]->name);
        put_quoted(out, commands[k]->purpose);
        fputs("'\n", out);
    }
    fputs(
        "    )\n    if (( CURRENT == 2 )); then\n        _describe command commands\n        return\n    fi\n"
        "    local command=$words[2]\n    shift words\n    (( CURRENT-- ))\n    case $command in\n",
        out);
    for (int k = 0; commands[k]; k++) {
        fprintf(out, "    %s)\n        _arguments \\\n", commands[k]->name);
        for (int i = 0; options_describe(commands[k], i, &option); i++)
            put_option(out, &option);
        put_operand(out, commands[k]);
        fputs("        ;;\n", out);
    }
    /* `source` passes the function to the shell; from a folder of functions it is called. */
    fputs("    esac\n}\n\nif [[ $zsh_eval_context[-1] == loadautofunc ]]; then\n    _refdyn \"$@\"\nelse\n"
          "    compdef _refdyn refdyn\nfi\n",
          out);
}
