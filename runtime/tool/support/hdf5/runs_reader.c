/* Reads a file of many motions. */
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct runs_reader {
    struct hdf5_input input;
    struct runs_layout layout;
    int item_room, axis_room, attribute_room, column_room;
    long count, batch_count;
    long *numbers;
};

/* ---- Datasets ---- */

static bool refuse_form(struct runs_reader *reader, const char *path) {
    return hdf5_input_refuse(&reader->input, "%s: has no form of a file of runs", path);
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
