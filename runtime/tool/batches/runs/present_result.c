/* What has the name of a batch's result already: see runs.h. */
#include "runtime/tool/batches/runs/runs.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Which part of the batch is another one, in words; NULL: none. */
static const char *other_part(const struct runs_reader *reader, const struct journal_key *key) {
    static const char *const names[JOURNAL_PARTS] = {"model_hash", "sweep_hash", "options_hash",
                                                     "files_hash"};
    for (int part = 0; part < JOURNAL_PARTS; part++) {
        const char *hash = hdf5_runs_attribute(reader, names[part]);
        if (!hash || strcmp(hash, key->hash[part]) != 0)
            return journal_parts[part];
    }
    return NULL;
}

/* All of [first, end), maybe among others. */
static bool has_cases(const struct runs_reader *reader, long first, long end) {
    const long *numbers = hdf5_runs_numbers(reader);
    long found = 0;
    for (long row = 0; row < hdf5_runs_count(reader); row++)
        found += numbers[row] >= first && numbers[row] < end;
    return found == end - first;
}

enum runs_present_result runs_present_result(const struct batch_setup *setup, const char *path, long first,
                                             long end) {
    if (access(path, F_OK) != 0)
        return PRESENT_NONE;
    struct runs_reader *reader = hdf5_runs_open(path);
    if (!reader)
        return PRESENT_OTHER;
    const char *other = other_part(reader, &setup->key);
    const bool is_complete = !other && has_cases(reader, first, end);
    hdf5_runs_close(reader);
    if (other)
        fprintf(stderr, "refdyn: %s: is of another batch: the %s differ\n", path, other);
    return other ? PRESENT_OTHER : is_complete ? PRESENT_COMPLETE : PRESENT_NONE;
}
