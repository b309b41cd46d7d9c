/* Reads a file of one motion. */
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct motion_reader {
    struct hdf5_input input;
    const char **names;
    int count, room;
    long row_count, next;
    double t; /* time of the previous row */
};

static const char what[] = "motion as refdyn sim writes it";

bool hdf5_motion_is_in(const char *path) {
    return hdf5_input_is(path, MOTION_CONTENT);
}

/* ---- Datasets ---- */

/* How many numbers a row has. */
static int width_of(const struct hdf5_object *object) {
    return object->size[1] > 0 ? (int)object->size[1] : 1;
}

/* All datasets have as many rows as the first one, the time. */
static bool take_dataset(struct motion_reader *reader, const struct hdf5_object *object,
                         const struct hdf5_attribute *names) {
    struct hdf5_input *input = &reader->input;
    if (object->kind != HDF5_NUMBERS || names->kind != HDF5_TEXTS || object->rank < 1 || object->rank > 2 ||
        names->count != (object->size[1] > 0 ? object->size[1] : 1) ||
        (reader->count > 0 && object->size[0] != reader->row_count))
        return hdf5_input_refuse(input, "%s: has no form of a %s", object->path, what);
    hdf5_input_take(input, object, reader->count);
    reader->row_count = object->size[0];
    for (int i = 0; i < names->count; i++) {
        reader->names =
            memory_room(&input->memory, reader->names, reader->count, &reader->room, sizeof *reader->names);
        reader->names[reader->count++] = names->texts[i];
    }
    return true;
}

/* refdyn wrote the datasets that have names of columns. They come in the order of creation, which is that of
 * the CSV. */
static bool take_datasets(struct motion_reader *reader) {
    for (int i = 0; i < reader->input.count; i++) {
        const struct hdf5_object *object = &reader->input.objects[i];
        const struct hdf5_attribute *names = hdf5_object_attribute(object, MOTION_COLUMNS);
        if (names && !take_dataset(reader, object, names))
            return false;
    }
    return true;
}

/* Each row begins with the time, the coordinates and their rates. */
static bool check_state(struct motion_reader *reader) {
    static const char *const state[] = {"/t", "/q", "/qd"};
    struct hdf5_input *input = &reader->input;
    const int count = (int)(sizeof state / sizeof state[0]);
    for (int i = 0; i < count; i++)
        if (!hdf5_input_find(input, state[i]))
            return hdf5_input_refuse(input, "%s: is missing; every %s has it", state[i], what);
    for (int i = 0; i < count; i++)
        if (i >= input->taken_count || strcmp(input->objects[input->taken[i].object].path, state[i]) != 0)
            return hdf5_input_refuse(input, "%s: has no form of a %s", state[i], what);
    const struct hdf5_object *t = hdf5_input_find(input, "/t"), *q = hdf5_input_find(input, "/q"),
                             *qd = hdf5_input_find(input, "/qd");
    return (t->rank == 1 && strcmp(reader->names[0], "t") == 0 && width_of(q) == width_of(qd)) ||
           hdf5_input_refuse(input, "/t: has no form of a %s", what);
}

static bool read_all(struct motion_reader *reader, const char *path) {
    struct hdf5_input *input = &reader->input;
    if (!hdf5_input_open(input, path, MOTION_CONTENT, MOTION_VERSION, what) || !take_datasets(reader) ||
        !check_state(reader))
        return false;
    if (reader->row_count == 0)
        return hdf5_input_refuse(input, "there are no rows in it");
    hdf5_input_make_room(input, reader->count, 0);
    return true;
}

struct motion_reader *hdf5_motion_open(const char *path) {
    struct motion_reader *reader = format_allocate_large(1, sizeof *reader);
    *reader = (struct motion_reader){.t = -INFINITY};
    if (read_all(reader, path))
        return reader;
    hdf5_motion_close(reader);
    return NULL;
}

const char *const *hdf5_motion_names(const struct motion_reader *reader, int *count) {
    *count = reader->count;
    return reader->names;
}

/* Written motions are finite, and their time advances, or stands still at an event. */
static bool check_row(struct motion_reader *reader, const double *row) {
    for (int i = 0; i < reader->count; i++)
        if (!isfinite(row[i]))
            return hdf5_input_refuse(&reader->input, "%s: row %ld has no finite number", reader->names[i],
                                     reader->next);
    if (row[0] < reader->t)
        return hdf5_input_refuse(&reader->input, "t: row %ld is at %g s, before the row above it at %g s",
                                 reader->next, row[0], reader->t);
    reader->t = row[0];
    return true;
}

int hdf5_motion_next(struct motion_reader *reader, double *values) {
    const double *row;
    char **texts;
    if (reader->next == reader->row_count)
        return 0;
    if (!hdf5_input_row(&reader->input, reader->next, reader->row_count, &row, &texts) ||
        !check_row(reader, row))
        return -1;
    reader->next++;
    for (int i = 0; i < reader->count; i++)
        values[i] = row[i];
    return 1;
}

/* ---- Attributes ---- */

void hdf5_motion_give_facts(const struct motion_reader *reader, const char *group,
                            void take(void *context, const struct motion_fact *fact), void *context) {
    const struct hdf5_object *object = hdf5_input_find(&reader->input, group);
    for (int i = 0; object && i < object->attribute_count; i++) {
        const struct hdf5_attribute *attribute = &object->attributes[i];
        const bool is_text = attribute->kind == HDF5_TEXTS;
        const struct motion_fact fact = {.object = group,
                                         .name = attribute->name,
                                         .text = is_text ? attribute->texts[0] : NULL,
                                         .number = is_text ? 0 : attribute->numbers[0]};
        if (attribute->count == 1)
            take(context, &fact);
    }
}

void hdf5_motion_close(struct motion_reader *reader) {
    if (!reader)
        return;
    hdf5_input_close(&reader->input);
    free(reader);
}
