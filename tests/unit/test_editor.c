/*
 * models/editor/refdyn.lua, the definitions that an editor's Lua language server reads (the form of LuaLS
 * annotations), says what the tables of fields (gen/fields.def), functions and operators (gen/ops.def) say.
 * With an argument, prints the file: what to write there when a table has changed.
 */
#include "fields.h"
#include "memory.h"
#include "module.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROOM = 1 << 17 };

/* By enum field_type. */
static const char *const types[] = {"string",
                                    "integer",
                                    "refdyn.expression|number",
                                    "refdyn.expression|number",
                                    "(refdyn.expression|number)[]",
                                    "table[]",
                                    "string|string[]",
                                    "table<string, refdyn.expression|number>",
                                    "string|table",
                                    "table",
                                    "string|number[]",
                                    "(refdyn.expression|number)[]",
                                    "table",
                                    "table[]",
                                    "fun(s: table): table"};

static char text[ROOM];

static void add(const char *piece) {
    strncat(text, piece, ROOM - strlen(text) - 1);
}

static void add_lower(const char *piece) {
    for (char letter[2] = {0, 0}; *piece; piece++) {
        letter[0] = (char)tolower((unsigned char)*piece);
        add(letter);
    }
}

static const char *const owner_names[] = {
#define OWNER(name, text, tag) #name,
    OWNERS
#undef OWNER
};

static void add_field(const struct field_rule *rule) {
    add("---@field ");
    if (rule->item > 0) {
        char item[16];
        snprintf(item, sizeof item, "[%d]? ", rule->item);
        add(item);
        add(types[rule->type]);
        add("\n---@field ");
    }
    add(rule->name);
    add(rule->need != NEED_NEEDED || rule->item > 0 ? "? " : " ");
    add(types[rule->type]);
    add(" ");
    add(rule->text);
    if (*rule->unit) {
        add(" [");
        add(rule->unit);
        add("]");
    }
    add("\n");
}

static void add_classes(void) {
    for (int i = 0; i < FIELD_COUNT; i++) {
        if (i == 0 || field_rules[i].owner != field_rules[i - 1].owner) {
            add("\n---@class refdyn.");
            add_lower(owner_names[field_rules[i].owner]);
            add("\n");
        }
        add_field(&field_rules[i]);
    }
}

static void add_function(const char *name, const char *parameter_type, const char *parameters) {
    if (parameter_type) {
        add("---@param fields refdyn.");
        add_lower(parameter_type);
        add("\n");
    }
    add("function rd.");
    add(name);
    add("(");
    add(parameters);
    add(") end\n");
}

static void stop(void *context) {
    (void)context;
    exit(1);
}

static void add_functions(void) {
    static const char *const rows[] = {"position", "velocity", "acceleration"};
    struct memory memory = {.allowance = -1, .fail = stop};
    add("\n---@class refdyn\n---@field pi number\nlocal rd = {}\n\n");
    for (int owner = 0; owner < OWNER_COUNT; owner++)
        if (owner_tag((enum owner)owner))
            add_function(owner_tag((enum owner)owner), owner_names[owner], "fields");
    for (int i = 0; i < 3; i++)
        add_function(rows[i], "row", "fields");
    for (int i = 0; i < module_function_count(); i++)
        add_function(module_function_name(&memory, i), NULL, "...");
    memory_release(&memory);
    add("\nreturn rd\n");
}

int main(int argc, char **argv) {
    static char found[ROOM];
    (void)argv;
    add("---@meta refdyn\n-- Definitions for editors, made from the tables of fields and operators: do not "
        "edit.\n");
    add("\n---@class refdyn.expression\n");
    add_classes();
    add_functions();
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
