/* Writes a file of many motions. */
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <hdf5_hl.h>
#include <stdlib.h>
#include <string.h>

const char *const runs_kinds[] = {"parameter", "input", "start value", "start rate", "option", "samples"};

static const char case_path[] = "/case", cpu_path[] = "/cpu_s";

struct runs_writer {
    struct hdf5_file file;
    struct hdf5_rows rows;
    const struct runs_layout *layout;
    long count, written, last; /* how many cases there will be, and are; number of the last one */
    int text_count;            /* texts of a row so far */
    double *values;            /* of one row */
    const char **texts;
};

/* ---- The datasets ---- */

/* Adds a dataset along the cases, and its place in the rows. size 0: one number, or a text. */
static hid_t add_dataset(struct runs_writer *writer, const char *path, hid_t type, int place, int size) {
    struct hdf5_file *file = &writer->file;
    const bool is_text = type == file->text;
    const hid_t dataset = hdf5_make_dataset(
        file, path, type, (struct hdf5_shape){.rows = (hsize_t)writer->count, .size = (hsize_t)size});
    const struct hdf5_column column = {.dataset = dataset,
                                       .place = is_text ? writer->text_count++ : place,
                                       .size = size,
                                       .is_text = is_text};
    hdf5_rows_add(&writer->rows, column);
    if (strcmp(path, case_path) != 0)
        hdf5_attach_scale(file, dataset, case_path, 0);
    return dataset;
}

static bool add_heads(struct runs_writer *writer) {
    const hid_t number = add_dataset(writer, case_path, H5T_STD_I64LE, RUNS_NUMBER, 0);
    if (number < 0 || H5DSset_scale(number, case_path + 1) < 0)
        return hdf5_fail(&writer->file, "not all could be written");
    add_dataset(writer, "/status", H5T_STD_I32LE, RUNS_STATUS, 0);
    add_dataset(writer, "/reason", writer->file.text, 0, 0);
    add_dataset(writer, "/steps", H5T_STD_I64LE, RUNS_STEPS, 0);
    add_dataset(writer, cpu_path, H5T_IEEE_F64LE, RUNS_CPU, 0);
    return hdf5_put_text(&writer->file, cpu_path, "units", "s");
}

static void put_unit(struct hdf5_file *file, const char *path, const char *unit) {
    if (unit && *unit)
        hdf5_put_text(file, path, "units", unit);
}

static void add_varied(struct runs_writer *writer, int i) {
    const struct varied *varied = &writer->layout->cases.columns[i];
    struct hdf5_file *file = &writer->file;
    char *path = format_text("/cases/%s", varied->name);
    add_dataset(writer, path, varied->texts ? file->text : H5T_IEEE_F64LE, RUNS_HEAD_COUNT + i, 0);
    put_unit(file, path, varied->unit);
    hdf5_put_text(file, path, RUNS_KIND, runs_kinds[varied->kind]);
    hdf5_put_text(file, path, RUNS_TARGET, varied->target);
}

static void add_axis(struct runs_writer *writer, const struct kept_axis *axis) {
    struct hdf5_file *file = &writer->file;
    char *path = format_text("/%s", axis->path);
    if (axis->values)
        hdf5_make_scale(file, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, axis->count, axis->values, axis->unit);
    else
        hdf5_make_scale(file, path, file->text, file->text, axis->count, axis->names, axis->unit);
}

static void add_item(struct runs_writer *writer, const struct kept_item *item) {
    struct hdf5_file *file = &writer->file;
    const int before = RUNS_HEAD_COUNT + writer->layout->cases.width;
    char *path = format_text("/%s/%s", item->group, item->name);
    const hid_t dataset =
        add_dataset(writer, path, H5T_IEEE_F64LE, before + item->offset, item->axis ? item->size : 0);
    if (item->axis) {
        char *axis = format_text("/%s", item->axis);
        hdf5_attach_scale(file, dataset, axis, 1);
    }
    put_unit(file, path, item->unit);
}

static bool add_all(struct runs_writer *writer) {
    const struct runs_layout *layout = writer->layout;
    struct hdf5_file *file = &writer->file;
    for (int i = 0; i < layout->attribute_count; i++)
        hdf5_put_text(file, "/", layout->attributes[i].name, layout->attributes[i].text);
    hdf5_put_whole(file, "/", RUNS_BATCH_COUNT, layout->cases.count);
    if (!add_heads(writer) || !hdf5_make_group(file, "/cases"))
        return false;
    for (int i = 0; i < layout->cases.width; i++)
        add_varied(writer, i);
    for (int i = 0; i < layout->axis_count; i++)
        add_axis(writer, &layout->axes[i]);
    for (int i = 0; i < layout->item_count; i++)
        add_item(writer, &layout->items[i]);
    return !file->has_failed;
}

/* ---- Cases ---- */

void hdf5_runs_drop(struct runs_writer *writer) {
    hdf5_rows_release(&writer->rows);
    hdf5_release(&writer->file);
    free(writer->values);
    free(writer->texts);
    free(writer);
}

struct runs_writer *hdf5_runs_create(const char *path, const struct runs_layout *layout, long count) {
    struct runs_writer *writer = format_allocate_large(1, sizeof *writer);
    *writer = (struct runs_writer){.layout = layout, .count = count, .last = -1};
    const bool is_open = hdf5_create(&writer->file, path, RUNS_CONTENT, RUNS_VERSION);
    hdf5_rows_start(&writer->rows, &writer->file);
    if (!is_open || !add_all(writer)) {
        hdf5_runs_drop(writer);
        return NULL;
    }
    const int width = RUNS_HEAD_COUNT + layout->cases.width + layout->width;
    hdf5_rows_make_room(&writer->rows, width, writer->text_count);
    writer->values = format_allocate_large((size_t)width, sizeof *writer->values);
    writer->texts = format_allocate_large((size_t)writer->text_count, sizeof *writer->texts);
    return writer;
}

static void fill_row(struct runs_writer *writer, const struct case_record *record) {
    const struct cases *cases = &writer->layout->cases;
    double *values = writer->values;
    const char **texts = writer->texts;
    values[RUNS_NUMBER] = (double)record->number;
    values[RUNS_STATUS] = record->status;
    values[RUNS_STEPS] = (double)record->steps;
    values[RUNS_CPU] = record->cpu_s;
    values += RUNS_HEAD_COUNT;
    *texts++ = record->reason ? record->reason : "";
    for (int i = 0; i < cases->width; i++) {
        const struct varied *varied = &cases->columns[i];
        values[i] = varied->values[record->number];
        if (varied->texts)
            *texts++ = varied->texts[(int)values[i]];
    }
    if (writer->layout->width > 0)
        memcpy(values + cases->width, record->values, (size_t)writer->layout->width * sizeof *values);
}

bool hdf5_runs_put(struct runs_writer *writer, const struct case_record *record) {
    if (writer->file.has_failed)
        return false;
    if (record->number <= writer->last || record->number >= writer->layout->cases.count ||
        writer->written == writer->count)
        return hdf5_refuse(&writer->file, "case %ld comes out of order", record->number);
    writer->last = record->number;
    writer->written++;
    fill_row(writer, record);
    return hdf5_rows_put(&writer->rows, writer->values, writer->texts);
}

bool hdf5_runs_share_time(struct runs_writer *writer, double seconds) {
    struct hdf5_file *file = &writer->file;
    if (writer->count == 0 || !hdf5_rows_flush(&writer->rows))
        return !file->has_failed;
    double *cpu = format_allocate_large((size_t)writer->count, sizeof *cpu);
    const hid_t dataset = H5Dopen2(file->id, cpu_path, H5P_DEFAULT);
    bool is_good =
        dataset >= 0 && H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, cpu) >= 0;
    for (long i = 0; i < writer->count; i++)
        cpu[i] += seconds / (double)writer->count;
    is_good = is_good && H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, cpu) >= 0;
    if (dataset >= 0)
        H5Dclose(dataset);
    free(cpu);
    return is_good || hdf5_fail(file, "not all could be written");
}

bool hdf5_runs_finish(struct runs_writer *writer) {
    bool is_good = hdf5_rows_flush(&writer->rows);
    if (is_good && writer->written != writer->count)
        is_good = hdf5_refuse(&writer->file, "%ld of %ld cases were written", writer->written, writer->count);
    hdf5_rows_release(&writer->rows);
    is_good = is_good && hdf5_finish(&writer->file);
    hdf5_runs_drop(writer);
    return is_good;
}
