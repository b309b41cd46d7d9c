/* `refdyn new NAME`: a model to begin from, and settings with which the Lua language server of an editor
 * finds the definitions of the model language. Writes NAME.lua and .luarc.json into the current folder. The
 * text is model.lua with NAME as its name. */
#include "runtime/tool/support/options/options.h"
#include "gen/language/values.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

extern const char new_model[];

static const char placeholder[] = "NAME", editor_settings[] = ".luarc.json";

/* What is wrong with the name of a model: it is a path or a file, or the generator refuses it. NULL if
 * nothing is. */
static const char *name_fault(const char *name) {
    struct messages messages = {.memory = &format_memory};
    const char *shown = message_safe_text(&format_memory, name, strlen(name));
    if (strchr(name, '/'))
        return format_text("'%s' is a path; give only the model's name, whose file goes into this folder",
                           shown);
    if (text_ends_with(name, ".lua"))
        return format_text("'%s' is the name of a file; give the name of the model, without .lua", shown);
    names_check_model(&messages, (struct named){.name = name, .place = {.file = ""}});
    return messages.count > 0 ? messages.list[0].text : NULL;
}

static bool complain(const char *path, const char *what, const char *fact) {
    format_plain_text(stderr, path);
    fprintf(stderr, ": output: %s%s\n", what, fact);
    return false;
}

/* Creates a new file; NULL with errno if it exists or cannot be made. */
static FILE *create(const char *path) {
    return fopen(path, "wx");
}

/* Returns false and removes the file if not all could be written. */
static bool finish(FILE *file, const char *path) {
    const bool is_good = !ferror(file);
    if (fclose(file) == 0 && is_good)
        return true;
    complain(path, "not all could be written: ", strerror(errno));
    unlink(path);
    return false;
}

static bool write_model(const char *path, const char *name) {
    FILE *file = create(path);
    if (!file && errno == EEXIST)
        return complain(path, "", "it is there already, and stays as it is");
    if (!file)
        return complain(path, "cannot be made: ", strerror(errno));
    const char *at = new_model;
    for (const char *next; (next = strstr(at, placeholder)); at = next + strlen(placeholder))
        fprintf(file, "%.*s%s", (int)(next - at), at, name);
    fputs(at, file);
    return finish(file, path);
}

/* The settings file of other models in this folder stays. */
static bool write_editor_settings(void) {
    const char *folder = system_shared_path("models/editor"); /* has refdyn.lua */
    struct document document;
    if (!folder) {
        fputs("refdyn new: warning: refdyn.lua, which describes the model language to editors, is not where "
              "the "
              "program is "
              "installed\n",
              stderr);
        return true;
    }
    FILE *file = create(editor_settings);
    if (!file && errno == EEXIST) {
        printf("%s: it was there, and stays as it is\n", editor_settings);
        return true;
    }
    if (!file)
        return complain(editor_settings, "cannot be made: ", strerror(errno));
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    format_put_text(&document, "runtime.version", "Lua 5.4");
    format_put_open(&document, "workspace.library", '[');
    format_put_text(&document, NULL, folder);
    format_put_close(&document, ']');
    format_put_close(&document, '}');
    format_document_close(&document, file);
    if (!finish(file, editor_settings))
        return false;
    printf("%s: an editor with the Lua language server completes fields and functions\n", editor_settings);
    return true;
}

static enum status run_new(const struct options *options) {
    const char *name = options->operands[0], *path = format_text("%s.lua", name), *fault = name_fault(name);
    if (fault)
        return options_usage_error(options->command, "%s", fault);
    if (!write_model(path, name))
        return STATUS_FAULT;
    printf("%s: a small arm with a flexible link, its comments say what to try\n", path);
    return write_editor_settings() ? STATUS_DONE : STATUS_FAULT;
}

const struct command new_command = {
    .name = "new",
    .run = run_new,
    .operands = "NAME",
    .options = "",
    .purpose = "write a model to begin from",
    .help = "Writes NAME.lua, a small arm with a flexible link, a programme, "
            "an input and parameters, with comments that\n"
            "suggest experiments. Also writes .luarc.json, from which "
            "editors with the Lua language server know the model language.\n\n"
            "  refdyn new arm\n"
            "  refdyn check arm.lua\n",
};
