/*
 * Words and files that complete an argument.
 *
 * Words are those that the program itself compares with. Endings of files follow from the names in the usage
 * line: "STATE.json".
 */
#include "runtime/tool/commands/shell/shell.h"
#include "runtime/tool/support/format/format.h"

#include <ctype.h>
#include <string.h>

const char *shell_values_operand_words(const struct command *command) {
    char *words = format_text("%s", command->operands), *bar;
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
        *endings = format_text("%.*s", length, dot + 1);
    return *endings ? MEANT_ENDINGS : MEANT_NONE;
}
