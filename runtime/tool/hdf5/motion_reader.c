/* Reads a file of one motion: see motion_file.h. */
#include "simulate/motion_file.h"
#include "hdf5/hdf5_rows.h"
#include "hdf5/motion_format.h"
#include "text/output.h"

#include <stdlib.h>
#include <string.h>

struct motion_reader {
    struct hdf5_file file;
    struct hdf5_rows rows;
    struct memory memory; /* of the names */
    char **names;
    int count, room;
    long row_count, next;
};

static const char what[] = "motion as refdyn sim writes it";

bool motion_is_in(const char *path) {
    struct hdf5_file file;
    const bool is_one = hdf5_has_content(&file, path, MOTION_CONTENT);
    hdf5_release(&file);
    return is_one;
}

/* ---- Datasets ---- */

/* Their sizes, as they are: rows, and numbers a row. */
static bool find_size(hid_t dataset, hsize_t size[static 2]) {
    const hid_t space = H5Dget_space(dataset);
    const int rank = space < 0 ? -1 : H5Sget_simple_extent_ndims(space);
    size[1] = 0;
    const bool is_good = (rank == 1 || rank == 2) && H5Sget_simple_extent_dims(space, size, NULL) >= 0;
    if (space >= 0)
        H5Sclose(space);
    return is_good;
}

static void add_names(struct motion_reader *reader, char **names, int count) {
    for (int i = 0; i < count; i++) {
        reader->names =
            memory_room(&reader->memory, reader->names, reader->count, &reader->room, sizeof *reader->names);
        reader->names[reader->count++] = memory_text(&reader->memory, names[i]);
    }
}

/* All have as many rows as the first one, the time. */
static bool take_dataset(struct motion_reader *reader, const char *path, char **names, int count) {
    hsize_t size[2];
    const hid_t dataset = H5Dopen2(reader->file.id, path, H5P_DEFAULT);
    struct hdf5_column column = {.dataset = dataset, .place = reader->count};
    if (!hdf5_rows_add(&reader->rows, column))
        return hdf5_fail(&reader->file, "cannot be read");
    if (!find_size(dataset, size) || (hsize_t)count != (size[1] > 0 ? size[1] : 1) ||
        (reader->count > 0 && size[0] != (hsize_t)reader->row_count))
        return hdf5_refuse(&reader->file, "/%s: has no form of a %s", path, what);
    reader->rows.columns[reader->rows.column_count - 1].size = (int)size[1];
    reader->row_count = (long)size[0];
    add_names(reader, names, count);
    return true;
}

/* What has names of columns is one of ours; in the order in which they were made, that of the CSV. */
static herr_t look(hid_t group, const char *path, const H5L_info_t *info, void *where) {
    struct motion_reader *reader = where;
    int count;
    char **names = hdf5_get_texts(&reader->file, path, MOTION_COLUMNS, &count);
    (void)group;
    (void)info;
    const bool is_good = !names || take_dataset(reader, path, names, count);
    hdf5_free_texts(names, count);
    return is_good ? 0 : -1;
}

static bool read_all(struct motion_reader *reader, const char *path) {
    if (!hdf5_open(&reader->file, path, MOTION_CONTENT, MOTION_VERSION, what))
        return false;
    if (H5Lvisit(reader->file.id, H5_INDEX_CRT_ORDER, H5_ITER_INC, look, reader) < 0)
        return hdf5_fail(&reader->file, "cannot be read");
    if (reader->count == 0 || reader->row_count == 0)
        return hdf5_refuse(&reader->file, "there are no rows in it");
    hdf5_rows_make_room(&reader->rows, reader->count, 0);
    return true;
}

struct motion_reader *motion_open(const char *path) {
    struct motion_reader *reader = allocate_large(1, sizeof *reader);
    *reader = (struct motion_reader){.memory = arena_start()};
    hdf5_rows_start(&reader->rows, &reader->file);
    if (read_all(reader, path))
        return reader;
    motion_close(reader);
    return NULL;
}

char **motion_names(const struct motion_reader *reader, int *count) {
    *count = reader->count;
    return reader->names;
}

int motion_next(struct motion_reader *reader, double *values) {
    const double *row;
    char **texts;
    if (reader->next == reader->row_count)
        return 0;
    if (!hdf5_rows_get(&reader->rows, reader->next++, reader->row_count, &row, &texts))
        return -1;
    for (int i = 0; i < reader->count; i++)
        values[i] = row[i];
    return 1;
}

/* ---- Attributes ---- */

struct giving {
    struct motion_reader *reader;
    const char *group;
    void (*take)(void *context, const struct motion_fact *fact);
    void *context;
};

static herr_t give_fact(hid_t group, const char *name, const H5A_info_t *info, void *where) {
    const struct giving *giving = where;
    struct motion_fact fact = {.object = giving->group, .name = name};
    char *text = hdf5_get_text(&giving->reader->file, giving->group, name);
    (void)group;
    (void)info;
    fact.text = text;
    if (text || hdf5_get_number(&giving->reader->file, giving->group, name, &fact.number))
        giving->take(giving->context, &fact);
    free(text);
    return 0;
}

bool motion_give_facts(struct motion_reader *reader, const char *group,
                       void take(void *context, const struct motion_fact *fact), void *context) {
    struct giving giving = {reader, group, take, context};
    const bool is_there = strcmp(group, "/") == 0 || H5Lexists(reader->file.id, group, H5P_DEFAULT) > 0;
    if (!is_there || H5Aiterate_by_name(reader->file.id, group, H5_INDEX_NAME, H5_ITER_INC, NULL, give_fact,
                                        &giving, H5P_DEFAULT) >= 0)
        return true;
    return hdf5_fail(&reader->file, "cannot be read");
}

void motion_close(struct motion_reader *reader) {
    if (!reader)
        return;
    hdf5_rows_release(&reader->rows);
    hdf5_release(&reader->file);
    memory_release(&reader->memory);
    free(reader);
}
