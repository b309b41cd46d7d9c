/* The options that a command knows; usage lines, --help and the messages of wrong usage, from their tables.
 */
#include "runtime/tool/support/command_line/command_line.h"
#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- The options of a command ---- */

static const struct option_rule common_rules[] = {
    {"output", "FILE", OPTION_TEXT, "where results go", NULL, NULL},
    {"help", NULL, OPTION_HELP, "this text", NULL, NULL},
    {.name = NULL}};

static const struct option_rule *find_in(const struct option_rule *table, const char *name, size_t length) {
    for (; table && table->name; table++)
        if (strlen(table->name) == length && strncmp(table->name, name, length) == 0)
            return table;
    return NULL;
}

const struct option_rule *option_find(const struct command *command, const char *name, size_t length) {
    const struct option_rule *rule = find_in(common_rules, name, length);
    for (int i = 0; i < OPTION_TABLES && !rule; i++)
        rule = find_in(command->tables[i], name, length);
    return rule;
}

int command_options(const struct command *command, struct known_option list[static OPTIONS_MOST]) {
    int count = 0;
    for (const char *at = command->options; *at; at += strspn(at, " ")) {
        const size_t length = strcspn(at, " !");
        list[count].rule = option_find(command, at, length);
        assert(list[count].rule && count < OPTIONS_MOST - 2);
        at += length;
        list[count].is_needed = *at == '!';
        at += list[count++].is_needed;
    }
    list[count++] = (struct known_option){&common_rules[1], false};
    return count;
}

bool option_is_output(const struct option_rule *rule) {
    return rule == &common_rules[0];
}

bool option_may_repeat(const struct option_rule *rule) {
    return rule->kind == OPTION_SETTING || rule->kind == OPTION_TEXTS;
}

const char *option_shown(const struct option_rule *rule) {
    return option_is_output(rule) ? "-o" : format_text("--%s", rule->name);
}

/* ---- Usage and help ---- */

static const char *argument_of(const struct command *command, const struct option_rule *rule) {
    if (option_is_output(rule))
        return command->output;
    return rule->argument ? rule->argument : "";
}

/* The help; a list takes the place of its "%s". */
static const char *help_of(const struct command *command, const struct option_rule *rule) {
    const char *mark = rule->list ? strstr(rule->help, "%s") : NULL;
    return mark ? format_text("%.*s%s%s", (int)(mark - rule->help), rule->help, rule->list(command), mark + 2)
                : rule->help;
}

static const char *words_of(const struct command *command, const struct option_rule *rule) {
    struct text text = {.memory = &format_memory};
    for (int i = 0; rule->words && rule->words[i]; i++)
        text_add(&text, "%s%s", i ? " " : "", rule->words[i]);
    for (const char *at = rule->list ? rule->list(command) : ""; *at; at++)
        if (*at != ',')
            text_add(&text, "%c", *at);
    return text.length ? text.data : "";
}

bool options_describe(const struct command *command, int number, struct option_text *text) {
    struct known_option known[OPTIONS_MOST];
    if (number >= command_options(command, known))
        return false;
    const struct option_rule *rule = known[number].rule;
    *text = (struct option_text){.name = rule->name,
                                 .argument = argument_of(command, rule),
                                 .help = help_of(command, rule),
                                 .words = words_of(command, rule),
                                 .is_output = option_is_output(rule),
                                 .is_needed = known[number].is_needed,
                                 .may_repeat = option_may_repeat(rule),
                                 .is_list = rule->kind == OPTION_LIST || rule->kind == OPTION_FREEING_LIST};
    return true;
}

static void print_usage(const struct command *command, FILE *out) {
    struct known_option known[OPTIONS_MOST];
    const int count = command_options(command, known) - 1; /* without --help */
    fprintf(out, "usage: refdyn %s %s", command->name, command->operands);
    for (int i = 0; i < count; i++) {
        const char *argument = argument_of(command, known[i].rule);
        fprintf(out, known[i].is_needed ? " %s%s%s" : " [%s%s%s]", option_shown(known[i].rule),
                *argument ? " " : "", argument);
    }
    fputc('\n', out);
}

void print_command_help(const struct command *command) {
    enum { WIDTH = 28 };
    struct option_text option;
    print_usage(command, stdout);
    printf("\n%s\n\n%s\noptions:\n", command->purpose, command->help);
    for (int i = 0; options_describe(command, i, &option); i++) {
        const int width = printf("  %s--%s %s", option.is_output ? "-o, " : "", option.name, option.argument);
        printf("%*s%s\n", width < WIDTH ? WIDTH - width : 1, "", option.help);
    }
    puts("\nexit status: 0 done; 1 error in the model, the state or a file; 2 wrong usage; 3 the numbers "
         "failed");
}

void print_help(const struct command *const *commands) {
    puts("usage: refdyn COMMAND ARGUMENTS\n\n"
         "Refdyn turns a Lua model of a robot with flexible links into C code of its dynamics,\n"
         "and computes its equilibria, frequencies and programme-constrained motions.\n\ncommands:");
    for (; *commands; commands++)
        printf("  %-11s%s\n", (*commands)->name, (*commands)->purpose);
    puts("\nrefdyn COMMAND --help explains a command; --version prints the version.");
}

/* ---- Wrong usage ---- */

enum status usage_error(const struct command *command, const char *format, ...) {
    va_list list;
    va_start(list, format);
    fprintf(stderr, "refdyn %s: ", command->name);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    print_usage(command, stderr);
    return STATUS_USAGE;
}

static const struct option_origin *find_origin(const struct options *options, const char *option) {
    for (int i = 0; i < options->origin_count; i++)
        if (strcmp(options->origins[i].option, option) == 0)
            return &options->origins[i];
    return NULL;
}

enum status option_error(const struct options *options, const char *option, const char *format, ...) {
    const struct option_origin *origin = find_origin(options, option);
    va_list list;
    if (origin)
        fprintf(stderr, "%s: %s", origin->place, origin->field);
    else
        fprintf(stderr, "refdyn %s: --%s", options->command->name, option);
    va_start(list, format);
    vfprintf(stderr, format, list);
    va_end(list);
    fputc('\n', stderr);
    if (origin)
        return STATUS_FAULT;
    print_usage(options->command, stderr);
    return STATUS_USAGE;
}

/* The command that differs from `name` only by its end, such as "sim" for "simulate", or by capitals. */
static const char *meant_command(const struct command *const *commands, const char *name) {
    for (; *commands; commands++) {
        const size_t own = strlen((*commands)->name), given = strlen(name);
        if (given > 1 && strncasecmp((*commands)->name, name, own < given ? own : given) == 0)
            return (*commands)->name;
    }
    return NULL;
}

enum status command_error(const struct command *const *commands, const char *name) {
    const char *meant = meant_command(commands, name), *dot = strrchr(name, '.');
    fprintf(stderr, "refdyn: unknown command '%s', the commands are", name);
    for (int i = 0; commands[i]; i++)
        fprintf(stderr, "%s %s", i ? "," : "", commands[i]->name);
    if (dot && strcmp(dot, ".lua") == 0)
        fprintf(stderr, "; a command comes first: refdyn check %s", name);
    else if (meant)
        fprintf(stderr, "; write refdyn %s", meant);
    fputs("\nusage: refdyn COMMAND ARGUMENTS\n", stderr);
    return STATUS_USAGE;
}
