/*
 * The wrong models of a folder: each names in its first comments exactly its messages, in order:
 *     -- expect: LINE: TEXT     (LINE 0: the file as a whole)
 *     -- set: NAME=VALUE        (like --set)
 */
#include "gen/gen.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_ROOM = 1000, LIST_ROOM = 64, PATH_ROOM = 2048 };

struct wanted {
    char expected[LIST_ROOM][LINE_ROOM];
    int expected_count;
    char set_text[LIST_ROOM][LINE_ROOM];
    struct setting settings[LIST_ROOM];
    int setting_count;
};

static bool starts(const char *line, const char *lead) {
    return strncmp(line, lead, strlen(lead)) == 0;
}

static void note_line(struct wanted *wanted, char *line) {
    line[strcspn(line, "\n")] = 0;
    if (starts(line, "-- expect: ") && wanted->expected_count < LIST_ROOM) {
        snprintf(wanted->expected[wanted->expected_count++], LINE_ROOM, "%s", line + strlen("-- expect: "));
    } else if (starts(line, "-- set: ") && wanted->setting_count < LIST_ROOM) {
        char *text = wanted->set_text[wanted->setting_count];
        snprintf(text, LINE_ROOM, "%s", line + strlen("-- set: "));
        char *equals = strchr(text, '=');
        if (!equals)
            return;
        *equals = 0;
        wanted->settings[wanted->setting_count++] = (struct setting){.name = text, .value = equals + 1};
    }
}

static bool read_wanted(const char *path, struct wanted *wanted) {
    FILE *file = fopen(path, "r");
    char line[LINE_ROOM];
    memset(wanted, 0, sizeof *wanted);
    while (file && fgets(line, sizeof line, file) && starts(line, "--"))
        note_line(wanted, line);
    if (file)
        fclose(file);
    return wanted->expected_count > 0;
}

static bool compare(const char *name, const struct wanted *wanted, const struct messages *messages) {
    bool same = true;
    int most = wanted->expected_count > messages->count ? wanted->expected_count : messages->count;
    for (int i = 0; i < most; i++) {
        char found[LINE_ROOM] = "nothing";
        const char *expected = i < wanted->expected_count ? wanted->expected[i] : "nothing";
        if (i < messages->count)
            snprintf(found, sizeof found, "%d: %s", messages->list[i].place.line, messages->list[i].text);
        if (strcmp(found, expected) == 0)
            continue;
        printf("%s: message %d is `%s`, expected `%s`\n", name, i + 1, found, expected);
        same = false;
    }
    return same;
}

static bool try_model(const char *folder, const char *name) {
    static struct wanted wanted;
    static struct generation generation;
    char path[PATH_ROOM];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (!read_wanted(path, &wanted)) {
        printf("%s: has no line `-- expect: `\n", name);
        return false;
    }
    const struct read_request request = {
        .file = path, .settings = wanted.settings, .setting_count = wanted.setting_count};
    enum gen_status status = gen_read(&generation, &request, -1);
    bool passed = compare(name, &wanted, &generation.messages);
    if (generation.messages.errors > 0 && status != GEN_MODEL_ERROR) {
        printf("%s: has errors and status %d\n", name, (int)status);
        passed = false;
    }
    gen_release(&generation);
    return passed;
}

static int is_model(const struct dirent *entry) {
    size_t length = strlen(entry->d_name);
    return length > 4 && strcmp(entry->d_name + length - 4, ".lua") == 0;
}

int main(int argc, char **argv) {
    const char *folder = argc > 1 ? argv[1] : SOURCE_FOLDER "/tests/wrong";
    struct dirent **entries;
    int count = scandir(folder, &entries, is_model, alphasort), passed = 0;
    for (int i = 0; i < count; i++) {
        passed += try_model(folder, entries[i]->d_name);
        free(entries[i]);
    }
    if (count < 0)
        printf("%s: cannot be read\n", folder);
    else
        free(entries);
    printf("%d passed, %d failed\n", passed, count - passed);
    return count <= 0 || passed < count;
}
