/* Writes a file of one motion. */
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <hdf5_hl.h>
#include <stdlib.h>
#include <string.h>

struct motion_writer {
    struct hdf5_file file;
    struct hdf5_rows rows;
};

static bool is_same(const char *a, const char *b) {
    return a == b || (a && b && strcmp(a, b) == 0);
}

/* One text if all numbers of the part have the same unit, otherwise one for each. */
static void put_units(struct hdf5_file *file, const struct motion_part *part, const char *const *units) {
    bool is_one = true;
    for (int i = 1; i < part->count; i++)
        is_one = is_one && is_same(units[i], units[0]);
    if (is_one && units[0])
        hdf5_put_text(file, part->path, "units", units[0]);
    if (!is_one)
        hdf5_put_texts(file, part->path, "column_units", units, part->count);
}

/* The scale of names, once for all parts along it. */
static void need_axis(struct hdf5_file *file, const struct motion_part *part) {
    if (!file->has_failed && H5Lexists(file->id, part->axis, H5P_DEFAULT) <= 0)
        hdf5_make_scale(file, part->axis, file->text, file->text, part->count, part->axis_names, NULL);
}

static void add_part(struct motion_writer *writer, const struct motion_part *part, const char *time) {
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
