/* What may stand behind an option or as an operand: see values.h. */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include <ctype.h>
#include <string.h>

/* ---- words ---- */

static const char *join(const char *const *list) {
    struct text text = {.memory = &program_memory};
    for (int i = 0; list[i]; i++)
        text_add(&text, "%s%s", i ? " " : "", list[i]);
    return text.data;
}

/* "a, b, c" with blanks alone between. */
static const char *without_commas(const char *list) {
    char *words = text_format("%s", list), *to = words;
    for (const char *from = words; *from; from++)
        if (*from != ',')
            *to++ = *from;
    *to = '\0';
    return words;
}

/* Of the help of --method, which is its list up to a remark in brackets. */
static const char *methods_of(const char *help) {
    return without_commas(text_format("%.*s", (int)strcspn(help, "("), help));
}

static const char *quantities(void) {
    struct text text = {.memory = &program_memory};
    text_add(&text, "all implicit step step.p");
    for (int i = 0; gen_quantity(i); i++)
        text_add(&text, " %s", gen_quantity(i));
    return text.data;
}

static const char *passes(void) {
    struct text text = {.memory = &program_memory};
    for (int i = 0; gen_pass(i); i++)
        text_add(&text, "%s%s", i ? " " : "", gen_pass(i));
    return text.data;
}

static const char *const places[] = {"initial", "statics", NULL}; /* or a file */

const char *values_words(const struct option_text *option) {
    static const struct {
        const char *option;
        const char *const *words;
    } lists[] = {{"stabilise", motion_stabilise_words},
                 {"start", motion_start_words},
                 {"singular", motion_singular_words},
                 {"way", statics_way_words},
                 {"accelerations", scene_acceleration_words},
                 {"loops", scene_loop_words},
                 {"fmu", fmu_version_words},
                 {"from", places},
                 {"at", places}};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        if (strcmp(lists[i].option, option->name) == 0)
            return join(lists[i].words);
    if (strcmp(option->name, "method") == 0)
        return methods_of(option->help);
    if (strcmp(option->name, "methods") == 0)
        return without_commas(options_methods(false));
    if (strcmp(option->name, "platform") == 0)
        return without_commas(platform_names());
    if (strcmp(option->name, "panel") == 0)
        return without_commas(panels_names());
    if (strcmp(option->name, "emit") == 0)
        return quantities();
    return strcmp(option->name, "explain") == 0 ? passes() : "";
}

const char *values_operand_words(const struct command *command) {
    char *words = text_format("%s", command->operands), *bar;
    if (!strchr(words, '|'))
        return "";
    while ((bar = strchr(words, '|')))
        *bar = ' ';
    return words;
}

/* ---- files ---- */

enum files_meant values_files(const char *argument, const char **endings) {
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
