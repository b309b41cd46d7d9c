/*
 * Compares models/README.md with the table of fields (gen/language/fields.def): each field must be a row of a
 * table in the page. With an argument, prints the rows: paste them into the page after a change of the table
 * of fields.
 */
#include "gen/language/language.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROW_ROOM = 1000 };

/* Names of the types in the page. */
static const char *const types[TYPE_COUNT] = {
    [TYPE_TEXT] = "text",
    [TYPE_WHOLE] = "whole number",
    [TYPE_VALUE] = "value",
    [TYPE_FREE] = "expression",
    [TYPE_VECTOR] = "3 values",
    [TYPE_VALUES] = "list of values",
    [TYPE_TURNS] = "turns",
    [TYPE_NAMES] = "names",
    [TYPE_BY_JOINT] = "values by joint",
    [TYPE_NUMBER] = "number",
    [TYPE_ROTORS] = "tables by joint",
    [TYPE_LIMITS] = "tables by joint",
    [TYPE_PLACE] = "place",
    [TYPE_AXIS] = "axis",
    [TYPE_INERTIA] = "table",
    [TYPE_BEAM] = "table",
    [TYPE_SECTION] = "table",
    [TYPE_DAMPING] = "table",
    [TYPE_CURVATURE] = "table",
    [TYPE_DIRECTION] = "direction",
    [TYPE_FREE_VECTOR] = "3 expressions",
    [TYPE_FREE_TURNS] = "turns by expressions",
    [TYPE_FREE_BY_NAME] = "expressions by name",
    [TYPE_TRUTH] = "true or false",
    [TYPE_POINTS] = "table",
    [TYPE_LIST] = "list of tables",
    [TYPE_DRIVES] = "list of names and tables",
    [TYPE_FUNCTION] = "function",
};

/* "positive", or "" */
static const char *range_text(enum number_range range) {
    static const char *const texts[] = {"", "positive", "not below 0", "above -1, up to 0.5", "from 0 to 1"};
    _Static_assert(sizeof texts / sizeof *texts == RANGE_SHARE + 1, "each range has a text");
    return texts[range];
}

static void write_row(const struct field_rule *rule, char *row) {
    const char *range = range_text(rule->range);
    char first[64] = "";
    if (rule->item > 0)
        snprintf(first, sizeof first, ", or item %d", rule->item);
    char unit[64] = "";
    if (*rule->unit)
        snprintf(unit, sizeof unit, " [%s]", rule->unit);
    snprintf(row, ROW_ROOM, "| `%s`%s%s | %s%s%s%s | %s |\n", rule->name, first,
             rule->need != NEED_OPTIONAL ? ", needed" : "", types[rule->type], *range ? ", " : "", range,
             unit, rule->text);
}

static char *read_page(void) {
    FILE *file = fopen(SOURCE_FOLDER "/models/README.md", "rb");
    size_t room = (size_t)1 << 20;
    char *text = calloc(room, 1);
    if (file && text && fread(text, 1, room - 1, file) == 0)
        printf("models/README.md cannot be read\n");
    if (file)
        fclose(file);
    return text;
}

int main(int argc, char **argv) {
    (void)argv;
    char *page = read_page(), row[ROW_ROOM];
    int missing = 0;
    for (int i = 0; i < FIELD_COUNT; i++) {
        write_row(&field_rules[i], row);
        if (argc > 1 && (i == 0 || field_rules[i].owner != field_rules[i - 1].owner))
            printf("\n%s\n\n| field | type | what it is |\n|---|---|---|\n",
                   owner_rules[field_rules[i].owner].text);
        if (argc > 1) {
            printf("%s", row);
        } else if (!page || !strstr(page, row)) {
            printf("models/README.md lacks the row %s", row);
            missing++;
        }
    }
    free(page);
    printf("%d fields, %d missing\n", (int)FIELD_COUNT, missing);
    return missing > 0;
}
