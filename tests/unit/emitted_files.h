/* Writes the files of a generation into a folder, for tests that compile them. */
#ifndef REFDYN_TESTS_UNIT_EMITTED_FILES_H
#define REFDYN_TESTS_UNIT_EMITTED_FILES_H

#include "gen/gen.h"

#include <stdio.h>

static int write_files(const struct generation *generation, const char *folder) {
    const struct emitted_file *files = gen_files(generation);
    int is_good = 1;
    for (int i = 0; i < gen_file_count(generation) && is_good; i++) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", folder, files[i].name);
        FILE *file = fopen(path, "w");
        is_good = file && fwrite(files[i].text, 1, files[i].length, file) == files[i].length;
        is_good = file && fclose(file) == 0 && is_good;
    }
    return is_good;
}

#endif
