/* Writes and reads files of many motions, RUNS.h5. */
#include <hdf5_hl.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/hdf5/hdf5_private.h"

#define RUNS_CONTENT "refdyn runs"
#define RUNS_BATCH_COUNT "batch_cases" /* of the whole batch; a file may have a part of it */
#define RUNS_KIND "kind"
#define RUNS_TARGET "target"

enum { RUNS_VERSION = 1, RUNS_KIND_COUNT = 6 };

/* By enum varied_kind. */
static const char *const runs_kinds[RUNS_KIND_COUNT] = {"parameter",  "input",  "start value",
                                                        "start rate", "option", "samples"};

/* The datasets at the top, whose numbers come first in a row. */
enum { RUNS_NUMBER, RUNS_STATUS, RUNS_STEPS, RUNS_CPU, RUNS_HEAD_COUNT };

/* ---- Writing ---- */

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

static void put_varied(struct runs_writer *writer, int i) {
    const struct varied *varied = &writer->layout->cases.columns[i];
    struct hdf5_file *file = &writer->file;
    char *path = format_text("/cases/%s", varied->name);
    add_dataset(writer, path, varied->texts ? file->text : H5T_IEEE_F64LE, RUNS_HEAD_COUNT + i, 0);
    put_unit(file, path, varied->unit);
    hdf5_put_text(file, path, RUNS_KIND, runs_kinds[varied->kind]);
    hdf5_put_text(file, path, RUNS_TARGET, varied->target);
}

static void put_axis(struct runs_writer *writer, const struct kept_axis *axis) {
    struct hdf5_file *file = &writer->file;
    char *path = format_text("/%s", axis->path);
    if (axis->values)
        hdf5_make_scale(file, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, axis->count, axis->values, axis->unit);
    else
        hdf5_make_scale(file, path, file->text, file->text, axis->count, axis->names, axis->unit);
}

static void put_item(struct runs_writer *writer, const struct kept_item *item) {
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
        put_varied(writer, i);
    for (int i = 0; i < layout->axis_count; i++)
        put_axis(writer, &layout->axes[i]);
    for (int i = 0; i < layout->item_count; i++)
        put_item(writer, &layout->items[i]);
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

/* ---- Reading ---- */

struct runs_reader {
    struct hdf5_input input;
    struct runs_layout layout;
    int item_room, axis_room, attribute_room, column_room;
    long count, batch_count;
    long *numbers;
};

/* ---- Datasets ---- */

static bool refuse_form(struct runs_reader *reader, const char *path) {
    return hdf5_input_refuse(&reader->input, "%s: does not have the form of a file of runs", path);
}

static bool is_number(const struct hdf5_object *object) {
    return object->kind == HDF5_NUMBERS || object->kind == HDF5_WHOLES;
}

/* A value, or a row of numbers, for each case. */
static bool check_rows(struct runs_reader *reader, const struct hdf5_object *object) {
    if (object->rank < 1 || object->rank > (is_number(object) ? 2 : 1) ||
        (!is_number(object) && object->kind != HDF5_TEXTS) || object->size[1] > INT_MAX)
        return refuse_form(reader, object->path);
    return object->size[0] == reader->count ||
           hdf5_input_refuse(&reader->input, "%s: has %ld rows and not one for each of %ld cases",
                             object->path, object->size[0], reader->count);
}

/* A dataset that every file of runs has. */
static const struct hdf5_object *find_needed(struct runs_reader *reader, const char *path) {
    const struct hdf5_object *object = hdf5_input_find(&reader->input, path);
    if (!object)
        hdf5_input_refuse(&reader->input, "%s: is missing; every file of runs has it", path);
    return object;
}

/* One value for each case. */
static bool take_head(struct runs_reader *reader, const char *path, bool is_text, int place) {
    const struct hdf5_object *object = find_needed(reader, path);
    if (!object || !check_rows(reader, object))
        return false;
    if (object->rank != 1 || is_number(object) == is_text)
        return refuse_form(reader, path);
    hdf5_input_take(&reader->input, object, place);
    return true;
}

static bool take_heads(struct runs_reader *reader) {
    return take_head(reader, "/status", false, RUNS_STATUS) && take_head(reader, "/reason", true, 0) &&
           take_head(reader, "/steps", false, RUNS_STEPS) && take_head(reader, "/cpu_s", false, RUNS_CPU);
}

/* ---- Numbers of the cases ---- */

static bool check_number(struct runs_reader *reader, long row, double number) {
    const double before = row > 0 ? (double)reader->numbers[row - 1] : -1;
    return (number > before && number < (double)reader->batch_count) ||
           hdf5_input_refuse(&reader->input,
                             "/case: row %ld has number %.0f; numbers must ascend and be below %ld", row,
                             number, reader->batch_count);
}

static bool read_numbers(struct runs_reader *reader) {
    static const char path[] = "/case";
    const struct hdf5_object *object = find_needed(reader, path);
    if (!object)
        return false;
    if (object->kind != HDF5_WHOLES || object->rank != 1 || object->size[0] > INT_MAX)
        return refuse_form(reader, path);
    const double *numbers = hdf5_input_numbers(&reader->input, object);
    reader->count = object->size[0];
    reader->numbers =
        memory_get(&reader->input.memory, ((size_t)reader->count + 1) * sizeof *reader->numbers);
    for (long row = 0; row < reader->count; row++) {
        if (!numbers || !check_number(reader, row, numbers[row]))
            return false;
        reader->numbers[row] = (long)numbers[row];
    }
    return numbers;
}

/* ---- What varied ---- */

static int compare_texts(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* Keeps the different ones of (count) texts, in order, in place; returns how many. */
static int keep_different(const char **texts, long count) {
    int kept = 0;
    qsort(texts, (size_t)count, sizeof *texts, compare_texts);
    for (long i = 0; i < count; i++)
        if (kept == 0 || strcmp(texts[kept - 1], texts[i]) != 0)
            texts[kept++] = texts[i];
    return kept;
}

/* The texts of the rows become indices into the different texts. */
static void number_texts(struct runs_reader *reader, struct varied *varied) {
    const size_t count = (size_t)reader->count;
    const char **by_row = format_allocate_large(count + 1, sizeof *by_row);
    memcpy(by_row, varied->texts, count * sizeof *by_row);
    varied->text_count = keep_different(varied->texts, reader->count);
    for (size_t i = 0; i < count; i++) {
        const char **which =
            bsearch(&by_row[i], varied->texts, (size_t)varied->text_count, sizeof *by_row, compare_texts);
        varied->values[i] = (double)(which - varied->texts);
    }
    free(by_row);
}

static bool has_texts(enum varied_kind kind) {
    return kind == VARIED_OPTION || kind == VARIED_SAMPLES;
}

/* Returns RUNS_KIND_COUNT if the text names no kind. */
static int find_kind(const char *text) {
    int kind = 0;
    while (kind < RUNS_KIND_COUNT && (!text || strcmp(runs_kinds[kind], text) != 0))
        kind++;
    return kind;
}

static bool read_values(struct runs_reader *reader, const struct hdf5_object *object, struct varied *varied) {
    struct hdf5_input *input = &reader->input;
    if (!has_texts(varied->kind)) {
        varied->values = hdf5_input_numbers(input, object);
        return varied->values;
    }
    varied->texts = hdf5_input_texts(input, object);
    if (!varied->texts)
        return false;
    varied->values = memory_get(&input->memory, ((size_t)reader->count + 1) * sizeof *varied->values);
    number_texts(reader, varied);
    return true;
}

static bool add_varied(struct runs_reader *reader, const struct hdf5_object *object) {
    struct cases *cases = &reader->layout.cases;
    const char *target = hdf5_object_text(object, RUNS_TARGET), *unit = hdf5_object_text(object, "units");
    const int kind = find_kind(hdf5_object_text(object, RUNS_KIND));
    if (!check_rows(reader, object))
        return false;
    if (object->rank != 1 || !target || kind == RUNS_KIND_COUNT ||
        is_number(object) == has_texts((enum varied_kind)kind))
        return refuse_form(reader, object->path);
    cases->columns = memory_room(&reader->input.memory, cases->columns, cases->width, &reader->column_room,
                                 sizeof *cases->columns);
    struct varied *varied = &cases->columns[cases->width++];
    *varied = (struct varied){
        .name = object->name, .target = target, .unit = unit ? unit : "", .kind = (enum varied_kind)kind};
    return read_values(reader, object, varied);
}

/* ---- Axes and items ---- */

static bool is_scale(const struct hdf5_object *object) {
    const char *class = hdf5_object_text(object, "CLASS");
    return class && strcmp(class, "DIMENSION_SCALE") == 0;
}

static bool check_axis(struct runs_reader *reader, const struct kept_axis *axis) {
    for (int i = 0; axis->values && i < axis->count; i++)
        if (!isfinite(axis->values[i]) || (i > 0 && axis->values[i] < axis->values[i - 1]))
            return hdf5_input_refuse(&reader->input, "/%s: entry %d is %g; entries must be finite and ascend",
                                     axis->path, i, axis->values[i]);
    return true;
}

static bool add_axis(struct runs_reader *reader, const struct hdf5_object *object) {
    struct runs_layout *layout = &reader->layout;
    struct hdf5_input *input = &reader->input;
    if (object->rank != 1 || object->size[0] > INT_MAX || (!is_number(object) && object->kind != HDF5_TEXTS))
        return refuse_form(reader, object->path);
    struct kept_axis axis = {
        .path = object->path + 1, .unit = hdf5_object_text(object, "units"), .count = (int)object->size[0]};
    if (is_number(object))
        axis.values = hdf5_input_numbers(input, object);
    else
        axis.names = hdf5_input_texts(input, object);
    layout->axes = memory_room(&input->memory, layout->axes, layout->axis_count, &reader->axis_room,
                               sizeof *layout->axes);
    layout->axes[layout->axis_count++] = axis;
    return (axis.values || axis.names) && check_axis(reader, &axis);
}

static bool add_item(struct runs_reader *reader, const struct hdf5_object *object) {
    struct runs_layout *layout = &reader->layout;
    if (!check_rows(reader, object))
        return false;
    const int size = object->rank == 2 ? (int)object->size[1] : 1;
    if (!is_number(object) || (object->rank == 2 && !object->axis) || size > INT_MAX - layout->width)
        return refuse_form(reader, object->path);
    layout->items = memory_room(&reader->input.memory, layout->items, layout->item_count, &reader->item_room,
                                sizeof *layout->items);
    layout->items[layout->item_count++] =
        (struct kept_item){.group = reader->input.objects[object->group].name,
                           .name = object->name,
                           .unit = hdf5_object_text(object, "units"),
                           .size = size,
                           .offset = layout->width,
                           .axis = object->rank == 2 ? object->axis + 1 : NULL};
    hdf5_input_take(&reader->input, object, RUNS_HEAD_COUNT + layout->width);
    layout->width += size;
    return true;
}

/* The datasets in the groups of the file; those at its top are known. */
static bool add_datasets(struct runs_reader *reader) {
    const struct hdf5_object *objects = reader->input.objects, *cases = find_needed(reader, "/cases");
    bool is_good = cases;
    for (int i = 1; is_good && i < reader->input.count; i++) {
        const struct hdf5_object *object = &objects[i];
        if (object->group == 0)
            continue;
        is_good = &objects[object->group] == cases ? add_varied(reader, object)
                  : is_scale(object)               ? add_axis(reader, object)
                                                   : add_item(reader, object);
    }
    return is_good;
}

/* Finds the axis of each item among the axes of its group, by its length. */
static bool check_axes(struct runs_reader *reader) {
    const struct runs_layout *layout = &reader->layout;
    for (int i = 0; i < layout->item_count; i++) {
        const struct kept_item *item = &layout->items[i];
        int axis = 0;
        while (item->axis && axis < layout->axis_count &&
               (strcmp(layout->axes[axis].path, item->axis) != 0 || layout->axes[axis].count != item->size))
            axis++;
        if (item->axis && axis == layout->axis_count)
            return hdf5_input_refuse(&reader->input, "/%s/%s: has no axis for %d numbers a case", item->group,
                                     item->name, item->size);
    }
    return true;
}

/* ---- The whole ---- */

static void add_attributes(struct runs_reader *reader) {
    struct runs_layout *layout = &reader->layout;
    const struct hdf5_object *root = &reader->input.objects[0];
    for (int i = 0; i < root->attribute_count; i++) {
        const char *name = root->attributes[i].name, *text = hdf5_object_text(root, name);
        if (!text || strcmp(name, HDF5_CONTENT) == 0)
            continue;
        layout->attributes = memory_room(&reader->input.memory, layout->attributes, layout->attribute_count,
                                         &reader->attribute_room, sizeof *layout->attributes);
        layout->attributes[layout->attribute_count++] = (struct attribute){.name = name, .text = text};
    }
}

static bool read_all(struct runs_reader *reader, const char *path) {
    struct hdf5_input *input = &reader->input;
    if (!hdf5_input_open(input, path, RUNS_CONTENT, RUNS_VERSION, "file of runs as refdyn batch writes it"))
        return false;
    if (!hdf5_object_whole(&input->objects[0], RUNS_BATCH_COUNT, &reader->batch_count))
        return hdf5_input_refuse(input, "attribute " RUNS_BATCH_COUNT " is missing");
    if (!read_numbers(reader) || !take_heads(reader) || !add_datasets(reader) || !check_axes(reader))
        return false;
    add_attributes(reader);
    reader->layout.cases.count = reader->count;
    hdf5_input_make_room(input, RUNS_HEAD_COUNT + reader->layout.width, 1);
    return true;
}

struct runs_reader *hdf5_runs_open(const char *path) {
    struct runs_reader *reader = format_allocate_large(1, sizeof *reader);
    if (read_all(reader, path))
        return reader;
    hdf5_runs_close(reader);
    return NULL;
}

const struct runs_layout *hdf5_runs_layout(const struct runs_reader *reader) {
    return &reader->layout;
}

long hdf5_runs_count(const struct runs_reader *reader) {
    return reader->count;
}

long hdf5_runs_batch_count(const struct runs_reader *reader) {
    return reader->batch_count;
}

const long *hdf5_runs_numbers(const struct runs_reader *reader) {
    return reader->numbers;
}

static bool check_heads(struct runs_reader *reader, long row, const double *values) {
    const double status = values[RUNS_STATUS], steps = values[RUNS_STEPS];
    if (status != 0 && status != 1 && status != 3)
        return hdf5_input_refuse(&reader->input, "/status: row %ld has %g; must be 0, 1 or 3", row, status);
    return (steps >= 0 && steps <= 0x1p53) ||
           hdf5_input_refuse(&reader->input, "/steps: row %ld has %g; must be a number of steps", row, steps);
}

bool hdf5_runs_get(struct runs_reader *reader, long row, struct case_record *record) {
    const double *values;
    char **texts;
    if (!hdf5_input_row(&reader->input, row, reader->count, &values, &texts) ||
        !check_heads(reader, row, values))
        return false;
    *record = (struct case_record){.number = reader->numbers[row],
                                   .status = (int)values[RUNS_STATUS],
                                   .steps = (long)values[RUNS_STEPS],
                                   .cpu_s = values[RUNS_CPU],
                                   .reason = texts[0],
                                   .values = values + RUNS_HEAD_COUNT};
    return true;
}

const char *hdf5_runs_attribute(const struct runs_reader *reader, const char *name) {
    for (int i = 0; i < reader->layout.attribute_count; i++)
        if (strcmp(reader->layout.attributes[i].name, name) == 0)
            return reader->layout.attributes[i].text;
    return NULL;
}

void hdf5_runs_close(struct runs_reader *reader) {
    hdf5_input_close(&reader->input);
    free(reader);
}
