/*
 * `refdyn completion FORM`: a completion script of a shell, or the manual page.
 *
 * Words are those that the program itself compares with. Endings of files follow from the names in the usage
 * line: "STATE.json".
 */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/system/system.h"

#include <ctype.h>
#include <string.h>

const char *shell_values_operand_words(const struct command *command) {
    char *words = text_format("%s", command->operands), *bar;
    if (!strchr(words, '|'))
        return "";
    while ((bar = strchr(words, '|')))
        *bar = ' ';
    return words;
}

/* ---- files ---- */

enum files_meant shell_values_files(const char *argument, const char **endings) {
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
        *endings = text_format("%.*s", length, dot + 1);
    return *endings ? MEANT_ENDINGS : MEANT_NONE;
}

/* ---- The command ---- */

static const struct {
    const char *name;
    void (*put)(FILE *out, const struct command *const *commands);
} forms[] = {{"bash", shell_put_bash_completion},
             {"zsh", shell_put_zsh_completion},
             {"fish", shell_put_fish_completion},
             {"man", shell_put_manual_page}};

enum { FORM_COUNT = sizeof forms / sizeof *forms };

static enum status run_completion(const struct options *options) {
    const char *form = options->operands[0];
    struct targets targets = {.first = NULL};
    int place = 0;
    while (place < FORM_COUNT && strcmp(forms[place].name, form) != 0)
        place++;
    if (place == FORM_COUNT)
        return usage_error(options->command, "'%s' is not one of %s", form, options->command->operands);
    struct target *target = target_open(&targets, options_text(options, "output"));
    if (target)
        forms[place].put(target->file, options->commands);
    const bool is_good = target && target_finish(target);
    targets_release(&targets);
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
