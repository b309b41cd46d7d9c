/*
 * `refdyn completion FORM`: a completion script of a shell, or the manual page.
 *
 * Words that complete an argument are those that the program itself compares with. Endings of files follow
 * from the names in the usage line: "STATE.json".
 */
#include <ctype.h>
#include <string.h>

#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- Words and files ---- */

/* The words of an operand "bash|zsh"; "" if they are no fixed set. */
static const char *operand_words(const struct command *command) {
    char *words = format_text("%s", command->operands), *bar;
    if (!strchr(words, '|'))
        return "";
    while ((bar = strchr(words, '|')))
        *bar = ' ';
    return words;
}

/* The kind of files that a name such as "MODEL.lua" or "RUN..." means. */
enum files_meant { MEANT_NONE, MEANT_FOLDER, MEANT_ANY_FILE, MEANT_ENDINGS };

/* For MEANT_ENDINGS they are in *endings: "csv h5". */
static enum files_meant files_of(const char *argument, const char **endings) {
    static const struct {
        const char *lead, *endings;
    } known[] = {{"RUNS", "h5"}, {"RUN", "csv h5"}, {"FILE.svg", "svg png pdf"}, {"WHERE", "json"}};
    *endings = NULL;
    if (strcmp(argument, "DIR") == 0)
        return MEANT_FOLDER;
    if (strcmp(argument, "FILE") == 0)
        return MEANT_ANY_FILE;
    for (size_t i = 0; i < sizeof known / sizeof *known && !*endings; i++)
        if (strncmp(argument, known[i].lead, strlen(known[i].lead)) == 0)
            *endings = known[i].endings;
    const char *dot = strchr(argument, '.');
    int length = 0;
    while (dot && isalnum((unsigned char)dot[1 + length]))
        length++;
    if (!*endings && length > 0)
        *endings = format_text("%.*s", length, dot + 1);
    return *endings ? MEANT_ENDINGS : MEANT_NONE;
}

/* ---- bash ---- */

/* The completion script for bash. It needs only bash and contains all words that it completes. */

/* $current is the word to complete, $option the one before it. */
static const char bash_beginning[] =
    "# Completion of refdyn in bash, written by `refdyn completion bash`: do not edit.\n\n"
    "# Words; with `,` as first argument of a list, whose last item is completed.\n"
    "_refdyn_words() {\n"
    "    local lead=\n"
    "    if [[ $1 == , ]]; then\n"
    "        shift\n"
    "        [[ $current == *,* ]] && lead=${current%,*},\n"
    "    fi\n"
    "    mapfile -t COMPREPLY < <(compgen -P \"$lead\" -W \"$*\" -- \"${current##*,}\")\n"
    "}\n\n"
    "# Beside what is there already: folders, and files with one of these endings; `*`: all files.\n"
    "_refdyn_files() {\n"
    "    local ending found=()\n"
    "    mapfile -t found < <(compgen -d -- \"$current\"\n"
    "        for ending; do\n"
    "            if [[ $ending == '*' ]]; then compgen -f -- \"$current\"\n"
    "            else compgen -f -X \"!*.$ending\" -- \"$current\"; fi\n"
    "        done | sort -u)\n"
    "    COMPREPLY+=(\"${found[@]}\")\n"
    "    compopt -o filenames 2>/dev/null\n"
    "}\n\n"
    "_refdyn() {\n"
    "    local current=${COMP_WORDS[COMP_CWORD]} option=${COMP_WORDS[COMP_CWORD-1]} "
    "command=${COMP_WORDS[1]}\n"
    "    COMPREPLY=()\n"
    "    if [[ $option == '=' ]]; then option=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
    "    if [[ $current == '=' ]]; then current=; fi\n";

static void put_bash_files(FILE *out, const char *argument) {
    const char *endings;
    switch (files_of(argument, &endings)) {
    case MEANT_FOLDER:
        fputs(" _refdyn_files;", out);
        break;
    case MEANT_ANY_FILE:
        fputs(" _refdyn_files '*';", out);
        break;
    case MEANT_ENDINGS:
        fprintf(out, " _refdyn_files %s;", endings);
        break;
    default:
        break;
    }
}

/* The values of an option, as a branch of `case`. */
static void put_bash_option(FILE *out, const struct command *command, const struct option_text *option) {
    const char *words = option->words;
    if (!*option->argument)
        return;
    fprintf(out, "    %s:--%s%s)", command->name, option->name,
            option->is_output ? format_text("|%s:-o", command->name) : "");
    if (*words)
        fprintf(out, " _refdyn_words %s%s;", option->is_list ? ", " : "", words);
    put_bash_files(out, option->argument);
    fputs(" return ;;\n", out);
}

static void put_commands(FILE *out, const struct command *const *commands) {
    fputs("    if ((COMP_CWORD == 1)); then\n        _refdyn_words", out);
    for (int k = 0; commands[k]; k++)
        fprintf(out, " %s", commands[k]->name);
    fputs(" --help --version\n        return\n    fi\n", out);
}

static void put_option_names(FILE *out, const struct command *command) {
    struct option_text option;
    fprintf(out, "        %s) _refdyn_words", command->name);
    for (int i = 0; options_describe(command, i, &option); i++)
        fprintf(out, " %s--%s", option.is_output ? "-o " : "", option.name);
    fputs(" ;;\n", out);
}

static void put_bash_operand(FILE *out, const struct command *command) {
    const char *words = operand_words(command);
    fprintf(out, "    %s)", command->name);
    if (*words)
        fprintf(out, " _refdyn_words %s;", words);
    put_bash_files(out, command->operands);
    fputs(" ;;\n", out);
}

static void put_bash_completion(FILE *out, const struct command *const *commands) {
    struct option_text option;
    fputs(bash_beginning, out);
    put_commands(out, commands);
    fputs("    case $command:$option in\n", out);
    for (int k = 0; commands[k]; k++)
        for (int i = 0; options_describe(commands[k], i, &option); i++)
            put_bash_option(out, commands[k], &option);
    fputs("    esac\n    if [[ $current == -* ]]; then\n        case $command in\n", out);
    for (int k = 0; commands[k]; k++)
        put_option_names(out, commands[k]);
    fputs("        esac\n        return\n    fi\n    case $command in\n", out);
    for (int k = 0; commands[k]; k++)
        put_bash_operand(out, commands[k]);
    fputs("    esac\n}\n\ncomplete -F _refdyn refdyn\n", out);
}

/* ---- zsh, with its _arguments ---- */

/* A text within single quotes of the shell. A backslash precedes characters that _arguments and _describe
 * would interpret. */
static void put_zsh_quoted(FILE *out, const char *text) {
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

static void put_zsh_files(FILE *out, const char *argument, const char *otherwise) {
    const char *endings;
    const enum files_meant meant = files_of(argument, &endings);
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
        put_zsh_files(out, option->argument, " ");
    } else if (option->is_list) {
        fprintf(out, "_sequence compadd - %s", words);
    } else if (files_of(option->argument, &endings) == MEANT_NONE) {
        fprintf(out, "(%s)", words);
    } else {
        fprintf(out, " _alternative \"words\\:word\\:(%s)\" \"files\\:file\\:_files -g \\\"", words);
        put_pattern(out, endings);
        fputs("\\\"\"", out);
    }
}

static void put_zsh_option(FILE *out, const struct option_text *option) {
    if (option->is_output)
        fputs("            '(-o --output)'{-o,--output=}'", out);
    else
        fprintf(out, "            '%s--%s%s", option->may_repeat ? "*" : "", option->name,
                *option->argument ? "=" : "");
    fputc('[', out);
    put_zsh_quoted(out, option->help);
    fputc(']', out);
    if (*option->argument) {
        fputc(':', out);
        put_zsh_quoted(out, option->argument);
        fputc(':', out);
        put_action(out, option);
    }
    fputs("' \\\n", out);
}

static void put_zsh_operand(FILE *out, const struct command *command) {
    const char *words = operand_words(command);
    fputs("            '*:", out);
    put_zsh_quoted(out, command->operands);
    fputc(':', out);
    if (*words)
        fprintf(out, "(%s)", words);
    else
        put_zsh_files(out, command->operands, " ");
    fputs("'\n", out);
}

static void put_zsh_completion(FILE *out, const struct command *const *commands) {
    struct option_text option;
    fputs(
        "#compdef refdyn\n# Completion of refdyn in zsh, written by `refdyn completion zsh`: do not edit.\n\n"
        "_refdyn() {\n    local -a commands\n    commands=(\n",
        out);
    for (int k = 0; commands[k]; k++) {
        fprintf(out, "        '%s:", commands[k]->name);
        put_zsh_quoted(out, commands[k]->purpose);
        fputs("'\n", out);
    }
    fputs(
        "    )\n    if (( CURRENT == 2 )); then\n        _describe command commands\n        return\n    fi\n"
        "    local command=$words[2]\n    shift words\n    (( CURRENT-- ))\n    case $command in\n",
        out);
    for (int k = 0; commands[k]; k++) {
        fprintf(out, "    %s)\n        _arguments \\\n", commands[k]->name);
        for (int i = 0; options_describe(commands[k], i, &option); i++)
            put_zsh_option(out, &option);
        put_zsh_operand(out, commands[k]);
        fputs("        ;;\n", out);
    }
    /* `source` passes the function to the shell; from a folder of functions it is called. */
    fputs("    esac\n}\n\nif [[ $zsh_eval_context[-1] == loadautofunc ]]; then\n    _refdyn \"$@\"\nelse\n"
          "    compdef _refdyn refdyn\nfi\n",
          out);
}

/* ---- fish ---- */

static const char fish_beginning[] =
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
static void put_fish_quoted(FILE *out, const char *text) {
    fputc('\'', out);
    for (; *text; text++)
        fprintf(out, *text == '\'' || *text == '\\' ? "\\%c" : "%c", *text);
    fputc('\'', out);
}

/* Puts the commands that list folders and files with these endings. */
static void put_fish_files(FILE *out, const char *argument) {
    const char *endings;
    switch (files_of(argument, &endings)) {
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

static void put_fish_option(FILE *out, const struct command *command, const struct option_text *option) {
    fprintf(out, "complete -c refdyn -n '__fish_seen_subcommand_from %s' -l %s%s", command->name,
            option->name, option->is_output ? " -s o" : "");
    if (*option->argument) {
        const char *words = option->words;
        fprintf(out, option->is_list && *words ? " -x -a \"(__refdyn_list %s)" : " -x -a \"%s", words);
        put_fish_files(out, option->argument);
        fputc('"', out);
    }
    fputs(" -d ", out);
    put_fish_quoted(out, option->help);
    fputc('\n', out);
}

static void put_fish_completion(FILE *out, const struct command *const *commands) {
    struct option_text option;
    fputs(fish_beginning, out);
    for (int k = 0; commands[k]; k++) {
        fprintf(out, "complete -c refdyn -n __fish_use_subcommand -a %s -d ", commands[k]->name);
        put_fish_quoted(out, commands[k]->purpose);
        fprintf(out, "\ncomplete -c refdyn -n '__fish_seen_subcommand_from %s' -a \"%s", commands[k]->name,
                operand_words(commands[k]));
        put_fish_files(out, commands[k]->operands);
        fputs("\"\n", out);
        for (int i = 0; options_describe(commands[k], i, &option); i++)
            put_fish_option(out, commands[k], &option);
    }
}

/* ---- The command ---- */

static const struct {
    const char *name;
    void (*put)(FILE *out, const struct command *const *commands);
} forms[] = {{"bash", put_bash_completion},
             {"zsh", put_zsh_completion},
             {"fish", put_fish_completion},
             {"man", shell_put_manual_page}};

enum { FORM_COUNT = sizeof forms / sizeof *forms };

static enum status run_completion(const struct options *options) {
    const char *form = options->operands[0];
    struct targets targets = {.first = NULL};
    int place = 0;
    while (place < FORM_COUNT && strcmp(forms[place].name, form) != 0)
        place++;
    if (place == FORM_COUNT)
        return options_usage_error(options->command, "'%s' is not one of %s", form,
                                   options->command->operands);
    struct target *target = system_target_open(&targets, options_text(options, "output"));
    if (target)
        forms[place].put(target->file, options->commands);
    const bool is_good = target && system_target_finish(target);
    system_targets_release(&targets);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

const struct command completion_command = {.name = "completion",
                                           .run = run_completion,
                                           .operands = "bash|zsh|fish|man",
                                           .options = "output",
                                           .output = "FILE",
                                           .purpose = "completion for a shell, or the manual page",
                                           .help = "Prints the script with which a shell completes commands, "
                                                   "options, their values and files, or the manual page.\n"
                                                   "An installation has them in its share/.\n\n"
                                                   "  eval \"$(refdyn completion bash)\"\n"
                                                   "  refdyn completion man -o refdyn.1\n"};
