/*
 * Memory that runs out: with an allowance of 0, 1, 2, ... blocks, reading and planning fail cleanly until
 * they succeed. The sanitizer preset finds leaks and invalid accesses.
 */
#include "gen/gen.h"

#include <stdio.h>

static const char *const models[] = {
    SOURCE_FOLDER "/models/manipulator.lua",        SOURCE_FOLDER "/tests/models/pendulum_flexible.lua",
    SOURCE_FOLDER "/tests/models/programme.lua",    SOURCE_FOLDER "/tests/models/beams.lua",
    SOURCE_FOLDER "/tests/models/loads.lua",        SOURCE_FOLDER "/tests/models/follow_path.lua",
    SOURCE_FOLDER "/tests/models/beside/model.lua",
};

/* Status of the first step that fails with `allowance` blocks, or GEN_OK. */
static enum gen_status attempt(const char *file, long allowance) {
    struct generation generation;
    struct read_request request = {.file = file};
    enum gen_status status = gen_read(&generation, &request, allowance);
    if (status == GEN_OK)
        status = gen_plan(&generation, NULL);
    gen_release(&generation);
    return status;
}

static int failures(const char *file) {
    enum { ENOUGH = 100000 };
    for (long allowance = 0; allowance < ENOUGH; allowance++) {
        enum gen_status status = attempt(file, allowance);
        if (status == GEN_OK) {
            printf("%s: %ld blocks\n", file, allowance);
            return allowance == 0; /* a model that needs no memory: the allowance has no effect */
        }
        if (status != GEN_NO_MEMORY) {
            printf("%s: status %d with room for %ld blocks, not GEN_NO_MEMORY\n", file, (int)status,
                   allowance);
            return 1;
        }
    }
    printf("%s: %d blocks are not enough\n", file, (int)ENOUGH);
    return 1;
}

int main(void) {
    int failed = 0;
    for (size_t i = 0; i < sizeof models / sizeof *models; i++)
        failed += failures(models[i]);
    return failed != 0;
}
