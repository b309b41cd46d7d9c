/* `refdyn completion FORM`: a shell's script of completion, or the manual page. */
#include "command_line/commands.h"
#include "shell/shell.h"

enum { BASH, ZSH, FISH, MAN, FORM_COUNT };

const char *const completion_forms[] = {
    [BASH] = "bash", [ZSH] = "zsh", [FISH] = "fish", [MAN] = "man", [FORM_COUNT] = NULL};

static void (*const put[FORM_COUNT])(FILE *out,
                                     const struct command *commands) = {[BASH] = put_bash_completion,
                                                                        [ZSH] = put_zsh_completion,
                                                                        [FISH] = put_fish_completion,
                                                                        [MAN] = put_manual_page};

enum status run_completion(const struct options *options) {
    const char *form = options->operands[0];
    const int place = text_index(form, completion_forms, FORM_COUNT);
    struct targets targets = {.first = NULL};
    if (place < 0)
        return usage_error(options->command, "'%s' is none of %s", form, options->command->operands);
    struct target *target = target_open(&targets, options->output);
    if (target)
        put[place](target->file, options->commands);
    const bool is_good = target && target_finish(target);
    targets_release(&targets);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}
