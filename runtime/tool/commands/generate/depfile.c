/* A rule of make for emitted files: see generate.h. */
#include "runtime/tool/commands/generate/generate.h"
#include "gen/read/read.h"
#include "runtime/tool/support/format/format.h"

/* A path as make reads it. */
static void add_path(struct text *rule, const char *path) {
    for (; *path; path++)
        text_add(rule, *path == ' ' || *path == '#' ? "\\%c" : *path == '$' ? "$%c" : "%c", *path);
}

const char *depfile_text(const struct generation *generation, const char *folder) {
    struct text rule = {.memory = &program_memory};
    const struct emitted_file *files = gen_files(generation);
    const struct sources *sources = generation->model.sources;
    for (int i = 0; i < gen_file_count(generation); i++) {
        text_add(&rule, i ? " " : "");
        add_path(&rule, text_format("%s/%s", folder, files[i].name));
    }
    text_add(&rule, ":");
    for (int i = 0; i < sources->count; i++) {
        text_add(&rule, " ");
        add_path(&rule, sources->list[i].path);
    }
    text_add(&rule, "\n");
    return rule.data;
}
