/* Writes and reads files of one motion, RUN.h5. */
#include <hdf5_hl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/record/record.h"
#include "runtime/tool/support/hdf5/hdf5_private.h"

#define MOTION_CONTENT "refdyn motion"
#define MOTION_COLUMNS "columns" /* of each dataset, by number */

enum { MOTION_VERSION = 1 };

struct motion_writer {
    struct hdf5_file file;
    struct hdf5_rows rows;
};

static bool is_same(const char *a, const char *b) {
    return a == b || (a && b && strcmp(a, b) == 0);
}

/* One text if all numbers of the part have the same unit, otherwise one for each. */
static void put_units(struct hdf5_file *file, const struct record_part *part, const char *const *units) {
    bool is_one = true;
    for (int i = 1; i < part->count; i++)
        is_one = is_one && is_same(units[i], units[0]);
    if (is_one && units[0])
        hdf5_put_text(file, part->path, "units", units[0]);
    if (!is_one)
        hdf5_put_texts(file, part->path, "column_units", units, part->count);
}

/* The scale of names, once for all parts along it. */
static void need_axis(struct hdf5_file *file, const struct record_part *part) {
    if (!file->has_failed && H5Lexists(file->id, part->axis, H5P_DEFAULT) <= 0)
        hdf5_make_scale(file, part->axis, file->text, file->text, part->count, part->axis_names, NULL);
}

static void add_part(struct motion_writer *writer, const struct record_part *part, const char *time) {
    struct hdf5_file *file = &writer->file;
    const struct hdf5_shape shape = {.size = part->axis ? (hsize_t)part->count : 0, .grows = true};
    if (part->axis)
        need_axis(file, part);
    const hid_t dataset = hdf5_make_dataset(file, part->path, H5T_IEEE_F64LE, shape);
    hdf5_rows_add(&writer->rows,
                  (struct hdf5_column){
                      .dataset = dataset, .place = part->first, .size = (int)shape.size, .grows = true});
    if (strcmp(part->path, time) != 0)
        hdf5_attach_scale(file, dataset, time, 0);
    else if (dataset < 0 || H5DSset_scale(dataset, time + 1) < 0)
        hdf5_fail(file, "not all could be written");
    if (part->axis)
        hdf5_attach_scale(file, dataset, part->axis, 1);
}

static void put_fact(struct hdf5_file *file, const struct motion_fact *fact) {
    if (strcmp(fact->object, "/") != 0 && !hdf5_make_group(file, fact->object))
        return;
    if (fact->text)
        hdf5_put_text(file, fact->object, fact->name, fact->text);
    else
        hdf5_put_number(file, fact->object, fact->name, fact->number);
}

static bool add_all(struct motion_writer *writer, const struct motion_layout *layout) {
    for (int i = 0; i < layout->part_count; i++) {
        add_part(writer, &layout->parts[i], layout->parts[0].path);
        put_units(&writer->file, &layout->parts[i], layout->units + layout->parts[i].first);
        if (!layout->parts[i].is_derivative)
            hdf5_put_texts(&writer->file, layout->parts[i].path, MOTION_COLUMNS,
                           layout->names + layout->parts[i].first, layout->parts[i].count);
    }
    for (int i = 0; i < layout->fact_count; i++)
        put_fact(&writer->file, &layout->facts[i]);
    return !writer->file.has_failed;
}

static void release(struct motion_writer *writer) {
    hdf5_rows_release(&writer->rows);
    hdf5_release(&writer->file);
    free(writer);
}

struct motion_writer *hdf5_motion_create(const char *path, const struct motion_layout *layout) {
    struct motion_writer *writer = format_allocate_large(1, sizeof *writer);
    const bool is_open = hdf5_create(&writer->file, path, MOTION_CONTENT, MOTION_VERSION);
    hdf5_rows_start(&writer->rows, &writer->file);
    if (is_open && add_all(writer, layout)) {
        hdf5_rows_make_room(&writer->rows, layout->width, 0);
        return writer;
    }
    release(writer);
    return NULL;
}

bool hdf5_motion_put(struct motion_writer *writer, const double *values) {
    return hdf5_rows_put(&writer->rows, values, NULL);
}

bool hdf5_motion_finish(struct motion_writer *writer) {
    bool is_good = hdf5_rows_flush(&writer->rows);
    hdf5_rows_release(&writer->rows);
    is_good = is_good && hdf5_finish(&writer->file);
    release(writer);
    return is_good;
}

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
        return hdf5_input_refuse(input, "%s: does not have the form of a %s", object->path, what);
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
            return hdf5_input_refuse(input, "%s: does not have the form of a %s", state[i], what);
    const struct hdf5_object *t = hdf5_input_find(input, "/t"), *q = hdf5_input_find(input, "/q"),
                             *qd = hdf5_input_find(input, "/qd");
    return (t->rank == 1 && strcmp(reader->names[0], "t") == 0 && width_of(q) == width_of(qd)) ||
           hdf5_input_refuse(input, "/t: does not have the form of a %s", what);
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

/* Written motions are finite except for forces that are not unique, and their time advances, or stands still
 * at an event. */
static bool check_row(struct motion_reader *reader, const double *row) {
    for (int i = 0; i < reader->count; i++)
        if (!isfinite(row[i]) && !(isnan(row[i]) && record_may_be_open(reader->names[i])))
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
