/*
 * `refdyn completion FORM`: a completion script of a shell, or the manual page.
 */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/system/system.h"

#include <string.h>

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
