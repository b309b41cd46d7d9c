/* The completion script for bash. It needs only bash and contains all words that it completes. */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"

/* $current is the word to complete, $option the one before it. */
static const char beginning[] =
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

static void put_files(FILE *out, const char *argument) {
    const char *endings;
    switch (shell_values_files(argument, &endings)) {
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
static void put_option(FILE *out, const struct command *command, const struct option_text *option) {
    const char *words = option->words;
    if (!*option->argument)
        return;
    fprintf(out, "    %s:--%s%s)", command->name, option->name,
            option->is_output ? format_text("|%s:-o", command->name) : "");
    if (*words)
        fprintf(out, " _refdyn_words %s%s;", option->is_list ? ", " : "", words);
    put_files(out, option->argument);
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

static void put_operand(FILE *out, const struct command *command) {
    const char *words = shell_values_operand_words(command);
    fprintf(out, "    %s)", command->name);
    if (*words)
        fprintf(out, " _refdyn_words %s;", words);
    put_files(out, command->operands);
    fputs(" ;;\n", out);
}

void shell_put_bash_completion(FILE *out, const struct command *const *commands) {
    struct option_text option;
    fputs(beginning, out);
    put_commands(out, commands);
    fputs("    case $command:$option in\n", out);
    for (int k = 0; commands[k]; k++)
        for (int i = 0; options_describe(commands[k], i, &option); i++)
            put_option(out, commands[k], &option);
    fputs("    esac\n    if [[ $current == -* ]]; then\n        case $command in\n", out);
    for (int k = 0; commands[k]; k++)
        put_option_names(out, commands[k]);
    fputs("        esac\n        return\n    fi\n    case $command in\n", out);
    for (int k = 0; commands[k]; k++)
        put_operand(out, commands[k]);
    fputs("    esac\n}\n\ncomplete -F _refdyn refdyn\n", out);
}
