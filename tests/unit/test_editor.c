/*
 * Compares models/editor/refdyn.lua with the tables of fields (gen/language/fields.def), functions and operators
 * (gen/graph/ops.def). The file defines the language for editors, as annotations of LuaLS. With an argument,
 * the program prints the file, which a change of a table makes necessary.
 */
#include "gen/language/language.h"
#include "gen/base/base.h"
#include "gen/script/script.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROOM = 1 << 17 };

static const char *const types[TYPE_COUNT] = {
    [TYPE_TEXT] = "string",
    [TYPE_WHOLE] = "integer",
    [TYPE_VALUE] = "refdyn.expression|number",
    [TYPE_FREE] = "refdyn.expression|number",
    [TYPE_VECTOR] = "(refdyn.expression|number)[]",
    [TYPE_VALUES] = "(refdyn.expression|number)[]",
    [TYPE_TURNS] = "table[]",
    [TYPE_NAMES] = "string|string[]",
    [TYPE_BY_JOINT] = "table<string, refdyn.expression|number>",
    [TYPE_NUMBER] = "number",
    [TYPE_ROTORS] = "table<string, table>",
    [TYPE_LIMITS] = "table<string, table>",
    [TYPE_PLACE] = "string|table",
    [TYPE_AXIS] = "table",
    [TYPE_INERTIA] = "table",
    [TYPE_BEAM] = "table",
    [TYPE_SECTION] = "table",
    [TYPE_DAMPING] = "table",
    [TYPE_CURVATURE] = "table",
    [TYPE_DIRECTION] = "string|number[]",
    [TYPE_FREE_VECTOR] = "(refdyn.expression|number)[]",
    [TYPE_FREE_TURNS] = "table[]",
    [TYPE_FREE_BY_NAME] = "table<string, refdyn.expression|number>",
    [TYPE_TRUTH] = "boolean",
    [TYPE_POINTS] = "table",
    [TYPE_LIST] = "table[]",
    [TYPE_DRIVES] = "(string|table)[]",
    [TYPE_FUNCTION] = "fun(s: table): table",
};

static char text[ROOM];

static void put(const char *piece) {
    strncat(text, piece, ROOM - strlen(text) - 1);
}

static void put_lower(const char *piece) {
    for (char letter[2] = {0, 0}; *piece; piece++) {
        letter[0] = (char)tolower((unsigned char)*piece);
        put(letter);
    }
}

static const char *const owner_tags[] = {
#define OWNER(name, text, tag, form) #name,
    OWNERS
#undef OWNER
};

static void put_field(const struct field_rule *rule) {
    put("---@field ");
    if (rule->item > 0) {
        char item[16];
        snprintf(item, sizeof item, "[%d]? ", rule->item);
        put(item);
        put(types[rule->type]);
        put("\n---@field ");
    }
    put(rule->name);
    put(rule->need != NEED_NEEDED || rule->item > 0 ? "? " : " ");
    put(types[rule->type]);
    put(" ");
    put(rule->text);
    if (*rule->unit) {
        put(" [");
        put(rule->unit);
        put("]");
    }
    put("\n");
}

static void put_classes(void) {
    for (int i = 0; i < FIELD_COUNT; i++) {
        if (i == 0 || field_rules[i].owner != field_rules[i - 1].owner) {
            put("\n---@class refdyn.");
            put_lower(owner_tags[field_rules[i].owner]);
            put("\n");
        }
        put_field(&field_rules[i]);
    }
}

static void put_function(const char *name, const char *parameter_type, const char *parameters) {
    if (parameter_type) {
        put("---@param fields refdyn.");
        put_lower(parameter_type);
        put("\n");
    }
    put("function rd.");
    put(name);
    put("(");
    put(parameters);
    put(") end\n");
}

static void stop(void *context) {
    (void)context;
    exit(1);
}

static void put_kind_functions(enum file_kind kind) {
    const char *arguments, *name;
    for (int i = 0; (name = script_kind_function(kind, i, &arguments)); i++)
        put_function(name, NULL, arguments);
}

static void put_functions(void) {
    static const char *const rows[] = {"position", "velocity", "acceleration"};
    struct memory memory = {.allowance = -1, .fail = stop};
    put("\n---@class refdyn\n---@field pi number\nlocal rd = {}\n\n");
    for (int owner = 0; owner < OWNER_COUNT; owner++)
        if (owner_rules[owner].tag)
            put_function(owner_rules[owner].tag, owner_tags[owner], "fields");
    for (int i = 0; i < 3; i++)
        put_function(rows[i], "row", "fields");
    for (int i = 0; i < module_function_count(); i++)
        put_function(module_function_name(&memory, i), NULL, "...");
    memory_release(&memory);
    put("\n-- in sweep files of refdyn batch: docs/batches.md\nfunction rd.sweep(fields) end\n");
    put_kind_functions(FILE_SWEEP);
    put("\n-- in fit files of refdyn fit: docs/fitting.md\nfunction rd.fit(fields) end\n");
    put_kind_functions(FILE_FIT);
    put("\n-- in plan files of refdyn plan: docs/planning.md\nfunction rd.plan(fields) end\n");
    put_kind_functions(FILE_PLAN);
    put("\nreturn rd\n");
}

int main(int argc, char **argv) {
    static char found[ROOM];
    (void)argv;
    put("---@meta refdyn\n-- Definitions for editors, made from the tables of fields and operators: do not "
        "edit.\n");
    put("\n---@class refdyn.expression\n");
    put_classes();
    put_functions();
    if (argc > 1) {
        fputs(text, stdout);
        return 0;
    }
    FILE *file = fopen(SOURCE_FOLDER "/models/editor/refdyn.lua", "rb");
    if (file && fread(found, 1, ROOM - 1, file) == 0)
        puts("models/editor/refdyn.lua is empty");
    if (file)
        fclose(file);
    if (strcmp(found, text) == 0)
        return 0;
    puts("models/editor/refdyn.lua differs from the tables: `test_editor print` writes it");
    return 1;
}
