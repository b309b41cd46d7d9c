/* Replaces files of HDF5 in a build without HDF5: every call that opens a file reports an error. */
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/format/format.h"

static const char absent[] = "this refdyn is built without HDF5, CSV is what it writes";

struct runs_writer *hdf5_runs_create(const char *path, const struct runs_layout *layout, long count) {
    (void)layout;
    (void)count;
    format_complain_line(path, 0, absent);
    return NULL;
}

/* The other functions are called only with a result of hdf5_runs_create or hdf5_runs_open, which is NULL
 * here. */
bool hdf5_runs_put(struct runs_writer *writer, const struct case_record *record) {
    return writer && record && false;
}

bool hdf5_runs_share_time(struct runs_writer *writer, double seconds) {
    return writer && seconds < 0;
}

bool hdf5_runs_finish(struct runs_writer *writer) {
    return writer && false;
}

void hdf5_runs_drop(struct runs_writer *writer) {
    (void)writer;
}

struct runs_reader *hdf5_runs_open(const char *path) {
    format_complain_line(path, 0, absent);
    return NULL;
}

const struct runs_layout *hdf5_runs_layout(const struct runs_reader *reader) {
    (void)reader;
    return NULL;
}

long hdf5_runs_count(const struct runs_reader *reader) {
    (void)reader;
    return 0;
}

long hdf5_runs_batch_count(const struct runs_reader *reader) {
    (void)reader;
    return 0;
}

const long *hdf5_runs_numbers(const struct runs_reader *reader) {
    (void)reader;
    return NULL;
}

bool hdf5_runs_get(struct runs_reader *reader, long row, struct case_record *record) {
    return reader && record && row < 0;
}

const char *hdf5_runs_attribute(const struct runs_reader *reader, const char *name) {
    (void)reader;
    (void)name;
    return NULL;
}

void hdf5_runs_close(struct runs_reader *reader) {
    (void)reader;
}

struct motion_writer *hdf5_motion_create(const char *path, const struct motion_layout *layout) {
    (void)layout;
    format_complain_line(path, 0, absent);
    return NULL;
}

bool hdf5_motion_put(struct motion_writer *writer, const double *values) {
    return writer && values && false;
}

bool hdf5_motion_finish(struct motion_writer *writer) {
    return writer && false;
}

bool hdf5_motion_is_in(const char *path) {
    return path && false;
}

struct motion_reader *hdf5_motion_open(const char *path) {
    format_complain_line(path, 0, absent);
    return NULL;
}

const char *const *hdf5_motion_names(const struct motion_reader *reader, int *count) {
    (void)reader;
    *count = 0;
    return NULL;
}

int hdf5_motion_next(struct motion_reader *reader, double *values) {
    return reader && values ? -1 : 0;
}

/* Called only with a result of motion_open. */
void hdf5_motion_give_facts(const struct motion_reader *reader, const char *group,
                            void take(void *context, const struct motion_fact *fact), void *context) {
    (void)reader;
    (void)group;
    (void)take;
    (void)context;
}

void hdf5_motion_close(struct motion_reader *reader) {
    (void)reader;
}
