/* Files that a case reads: see runs.h. */
#include "runtime/tool/batches/runs/runs.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { PLACES = 3 };

/* The places where the file may be; their number. */
static int list_places(const struct case_files *files, struct memory *memory, const char *path,
                       const char *places[static PLACES]) {
    const char *slash = strrchr(files->runs, '/');
    int count = 0;
    places[count++] = path;
    if (*path == '/')
        return count;
    if (files->folder)
        places[count++] = memory_format(memory, "%s/%s", files->folder, path);
    if (slash)
        places[count++] = memory_format(memory, "%.*s/%s", (int)(slash - files->runs), files->runs, path);
    return count;
}

/* What is wrong with the last of its places, for all of them. */
static const char *complain(const char *path, const char *const *places, int count, const char *changed) {
    if (changed) {
        fprintf(stderr, "refdyn: %s: it has changed since the batch was computed\n", changed);
        return NULL;
    }
    fprintf(stderr, "refdyn: %s: the case reads this file, which is not there", path);
    for (int i = 1; i < count; i++)
        fprintf(stderr, "%s %s", i == 1 ? ", nor is" : " or", places[i]);
    fputs(count > 1 ? "; it is needed in one of these places\n" : "; it is needed there\n", stderr);
    return NULL;
}

static const char *find_file(const struct case_files *files, struct memory *memory, const char *path) {
    const char *known = json_string_value(json_object_get(files->hashes, path));
    const char *places[PLACES], *changed = NULL;
    const int count = list_places(files, memory, path, places);
    for (int i = 0; i < count; i++) {
        char hash[JOURNAL_HASH];
        if (access(places[i], F_OK) != 0)
            continue;
        if (!batch_hash_file(places[i], hash))
            return NULL;
        if (!known || strcmp(hash, known) == 0)
            return places[i];
        changed = changed ? changed : places[i];
    }
    return complain(path, places, count, changed);
}

bool runs_case_files_find(const struct case_files *files, struct batch_setup *setup) {
    const char *from = options_text(&setup->options, "from");
    struct cases *cases = &setup->sweep.cases;
    if (options_state_path(from)) {
        const char *file = find_file(files, &setup->memory, from);
        if (!file)
            return false;
        options_set_text(&setup->options, "from", file);
    }
    for (int i = 0; i < cases->width; i++) {
        struct varied *column = &cases->columns[i];
        if (column->kind != VARIED_SAMPLES)
            continue;
        const char **texts = memory_get(&setup->memory, (size_t)column->text_count * sizeof *texts);
        for (int k = 0; k < column->text_count; k++)
            if (!(texts[k] = find_file(files, &setup->memory, column->texts[k])))
                return false;
        column->texts = texts;
    }
    return true;
}
