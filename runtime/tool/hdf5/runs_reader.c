/* Reads a file of many motions: see runs_file.h. */
#include "batch/runs_file.h"
#include "hdf5/hdf5_rows.h"
#include "hdf5/runs_format.h"
#include "text/output.h"

#include <hdf5_hl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

struct runs_reader {
    struct hdf5_file file;
    struct hdf5_rows rows;
    struct memory memory; /* of the layout */
    struct runs_layout layout;
    int item_room, axis_room, attribute_room, column_room;
    int text_count;
    long count, batch_count;
    long *numbers;
};

/* ---- Datasets ---- */

/* What is known of a dataset before it is taken. */
struct found {
    hid_t id;
    H5T_class_t class;
    int rank;
    hsize_t size[2];
    bool is_scale;
};

static bool look(struct runs_reader *reader, const char *path, struct found *found) {
    *found = (struct found){.id = H5Dopen2(reader->file.id, path, H5P_DEFAULT)};
    if (found->id < 0)
        return hdf5_fail(&reader->file, "cannot be read");
    const hid_t space = H5Dget_space(found->id), type = H5Dget_type(found->id);
    found->class = H5Tget_class(type);
    found->is_scale = H5DSis_scale(found->id) > 0;
    found->rank = H5Sget_simple_extent_ndims(space);
    const bool is_text = found->class == H5T_STRING && H5Tis_variable_str(type) > 0;
    const bool is_number = found->class == H5T_FLOAT || found->class == H5T_INTEGER;
    const bool is_good = (is_text || is_number) && (found->rank == 1 || found->rank == 2) &&
                         H5Sget_simple_extent_dims(space, found->size, NULL) >= 0;
    H5Tclose(type);
    H5Sclose(space);
    return is_good || hdf5_refuse(&reader->file, "%s: has no form of a file of runs", path);
}

static void forget(struct found *found) {
    if (found->id >= 0)
        H5Dclose(found->id);
    found->id = -1;
}

/* It becomes a column of the rows when it has a value for each case. */
static bool take(struct runs_reader *reader, const char *path, struct found *found, int place) {
    struct hdf5_file *file = &reader->file;
    const bool is_text = found->class == H5T_STRING;
    if (found->size[0] != (hsize_t)reader->count || (is_text && found->rank == 2) || found->size[1] > INT_MAX)
        return hdf5_refuse(file, "%s: has %llu rows and not one for each of %ld cases", path,
                           (unsigned long long)found->size[0], reader->count);
    const struct hdf5_column column = {.dataset = found->id,
                                       .place = is_text ? reader->text_count++ : place,
                                       .size = found->rank == 2 ? (int)found->size[1] : 0,
                                       .is_text = is_text};
    found->id = -1;
    return hdf5_rows_add(&reader->rows, column);
}

/* Of that class, one value a case. */
static bool take_head(struct runs_reader *reader, const char *path, bool is_text, int place) {
    struct found found;
    bool is_good = look(reader, path, &found);
    if (is_good && (found.rank != 1 || (found.class == H5T_STRING) != is_text))
        is_good = hdf5_refuse(&reader->file, "%s: has no form of a file of runs", path);
    is_good = is_good && take(reader, path, &found, place);
    forget(&found);
    return is_good;
}

/* ---- Names in a group ---- */

struct listing {
    struct memory *memory;
    const char **names;
    int count, room;
};

static herr_t add_link(hid_t group, const char *name, const H5L_info_t *info, void *where) {
    struct listing *listing = where;
    (void)group;
    (void)info;
    listing->names =
        memory_room(listing->memory, listing->names, listing->count, &listing->room, sizeof *listing->names);
    listing->names[listing->count++] = memory_text(listing->memory, name);
    return 0;
}

static herr_t add_attribute_name(hid_t object, const char *name, const H5A_info_t *info, void *where) {
    (void)info;
    return add_link(object, name, NULL, where);
}

/* In the order in which they were made, where the file keeps it. */
static bool list(struct runs_reader *reader, const char *path, struct listing *listing) {
    const H5_index_t orders[] = {H5_INDEX_CRT_ORDER, H5_INDEX_NAME};
    for (int i = 0; i < 2; i++) {
        *listing = (struct listing){.memory = &reader->memory};
        if (H5Literate_by_name(reader->file.id, path, orders[i], H5_ITER_INC, NULL, add_link, listing,
                               H5P_DEFAULT) >= 0)
            return true;
    }
    return hdf5_fail(&reader->file, "cannot be read");
}

static bool is_group(struct runs_reader *reader, const char *path) {
    H5O_info_t info;
    return H5Oget_info_by_name2(reader->file.id, path, &info, H5O_INFO_BASIC, H5P_DEFAULT) >= 0 &&
           info.type == H5O_TYPE_GROUP;
}

/* ---- What varied ---- */

static const char *kept_text(struct runs_reader *reader, const char *path, const char *name) {
    char *text = hdf5_get_text(&reader->file, path, name);
    const char *kept = text ? memory_text(&reader->memory, text) : NULL;
    free(text);
    return kept;
}

static enum varied_kind find_kind(const char *text) {
    int kind = 0;
    while (text && kind < RUNS_KIND_COUNT && strcmp(runs_kinds[kind], text) != 0)
        kind++;
    return text && kind < RUNS_KIND_COUNT ? (enum varied_kind)kind : VARIED_PARAMETER;
}

static bool add_varied(struct runs_reader *reader, const char *name) {
    struct cases *cases = &reader->layout.cases;
    const char *path = memory_format(&reader->memory, "/cases/%s", name);
    struct found found;
    bool is_good = look(reader, path, &found);
    cases->columns = memory_room(&reader->memory, cases->columns, cases->width, &reader->column_room,
                                 sizeof *cases->columns);
    struct varied *varied = &cases->columns[cases->width];
    const char *target = kept_text(reader, path, RUNS_TARGET), *unit = kept_text(reader, path, "units");
    char *kind = hdf5_get_text(&reader->file, path, RUNS_KIND);
    *varied = (struct varied){.name = name, .target = target ? target : name, .unit = unit ? unit : ""};
    varied->kind = find_kind(kind);
    free(kind);
    const bool has_texts = varied->kind == VARIED_OPTION || varied->kind == VARIED_SAMPLES;
    if (is_good && (found.class == H5T_STRING) != has_texts)
        is_good = hdf5_refuse(&reader->file, "%s: has no form of a file of runs", path);
    if (is_good && has_texts)
        varied->texts = memory_get(&reader->memory, ((size_t)reader->count + 1) * sizeof *varied->texts);
    varied->values = memory_get(&reader->memory, ((size_t)reader->count + 1) * sizeof *varied->values);
    is_good = is_good && take(reader, path, &found, RUNS_HEAD_COUNT + cases->width++);
    forget(&found);
    return is_good;
}

static bool add_all_varied(struct runs_reader *reader) {
    struct listing listing;
    if (!list(reader, "/cases", &listing))
        return false;
    for (int i = 0; i < listing.count; i++)
        if (!add_varied(reader, listing.names[i]))
            return false;
    return true;
}

/* ---- Axes and items ---- */

static bool read_axis(struct runs_reader *reader, const struct found *found, struct kept_axis *axis) {
    const size_t count = (size_t)axis->count;
    if (found->class != H5T_STRING) {
        double *values = memory_get(&reader->memory, (count + 1) * sizeof *values);
        axis->values = values;
        return H5Dread(found->id, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0;
    }
    char **texts = memory_get(&reader->memory, (count + 1) * sizeof *texts);
    const bool is_read = H5Dread(found->id, reader->file.text, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts) >= 0;
    for (size_t i = 0; i < count && is_read; i++) {
        char *text = texts[i];
        texts[i] = memory_text(&reader->memory, text ? text : "");
        H5free_memory(text);
    }
    axis->names = (const char *const *)texts;
    return is_read;
}

static bool add_axis(struct runs_reader *reader, const char *path, const struct found *found) {
    struct runs_layout *layout = &reader->layout;
    layout->axes = memory_room(&reader->memory, layout->axes, layout->axis_count, &reader->axis_room,
                               sizeof *layout->axes);
    struct kept_axis *axis = &layout->axes[layout->axis_count++];
    *axis = (struct kept_axis){.path = path + 1, .unit = kept_text(reader, path, "units")};
    if (found->rank != 1 || found->size[0] > INT_MAX)
        return hdf5_refuse(&reader->file, "%s: has no form of a file of runs", path);
    axis->count = (int)found->size[0];
    return read_axis(reader, found, axis) || hdf5_fail(&reader->file, "cannot be read");
}

static herr_t take_scale_name(hid_t dataset, unsigned dimension, hid_t scale, void *where) {
    char **name = where;
    const ssize_t length = H5Iget_name(scale, NULL, 0);
    (void)dataset;
    (void)dimension;
    if (length <= 0)
        return -1;
    *name = allocate_large((size_t)length + 1, 1);
    H5Iget_name(scale, *name, (size_t)length + 1);
    return 1;
}

/* The path of the scale along the second axis, without the first slash. */
static const char *find_axis(struct runs_reader *reader, hid_t dataset) {
    char *name = NULL;
    H5DSiterate_scales(dataset, 1, NULL, take_scale_name, &name);
    const char *kept = name ? memory_text(&reader->memory, name + 1) : NULL;
    free(name);
    return kept;
}

static bool add_item(struct runs_reader *reader, const char *group, const char *name, const char *path,
                     struct found *found) {
    struct runs_layout *layout = &reader->layout;
    layout->items = memory_room(&reader->memory, layout->items, layout->item_count, &reader->item_room,
                                sizeof *layout->items);
    struct kept_item *item = &layout->items[layout->item_count++];
    *item = (struct kept_item){.group = group, .name = name, .unit = kept_text(reader, path, "units")};
    item->size = found->rank == 2 ? (int)found->size[1] : 1;
    item->offset = layout->width;
    if (found->rank == 2)
        item->axis = find_axis(reader, found->id);
    if (found->class == H5T_STRING || (found->rank == 2 && !item->axis) ||
        item->size > INT_MAX - layout->width)
        return hdf5_refuse(&reader->file, "%s: has no form of a file of runs", path);
    layout->width += item->size;
    return take(reader, path, found, RUNS_HEAD_COUNT + layout->cases.width + item->offset);
}

static bool add_group(struct runs_reader *reader, const char *group) {
    struct listing listing;
    const char *root = memory_format(&reader->memory, "/%s", group);
    bool is_good = list(reader, root, &listing);
    for (int i = 0; i < listing.count && is_good; i++) {
        const char *path = memory_format(&reader->memory, "/%s/%s", group, listing.names[i]);
        struct found found;
        is_good = look(reader, path, &found);
        if (is_good)
            is_good = found.is_scale ? add_axis(reader, path, &found)
                                     : add_item(reader, group, listing.names[i], path, &found);
        forget(&found);
    }
    return is_good;
}

static bool add_groups(struct runs_reader *reader) {
    struct listing listing;
    bool is_good = list(reader, "/", &listing);
    for (int i = 0; i < listing.count && is_good; i++) {
        const char *path = memory_format(&reader->memory, "/%s", listing.names[i]);
        if (strcmp(listing.names[i], "cases") != 0 && is_group(reader, path))
            is_good = add_group(reader, listing.names[i]);
    }
    return is_good;
}

/* ---- Attributes ---- */

static bool is_own_attribute(const char *name) {
    return strcmp(name, "content") == 0;
}

static bool add_attributes(struct runs_reader *reader) {
    struct runs_layout *layout = &reader->layout;
    struct listing listing = {.memory = &reader->memory};
    if (H5Aiterate_by_name(reader->file.id, "/", H5_INDEX_NAME, H5_ITER_INC, NULL, add_attribute_name,
                           &listing, H5P_DEFAULT) < 0)
        return hdf5_fail(&reader->file, "cannot be read");
    for (int i = 0; i < listing.count; i++) {
        const char *text = kept_text(reader, "/", listing.names[i]);
        if (!text || is_own_attribute(listing.names[i]))
            continue;
        layout->attributes = memory_room(&reader->memory, layout->attributes, layout->attribute_count,
                                         &reader->attribute_room, sizeof *layout->attributes);
        layout->attributes[layout->attribute_count++] =
            (struct attribute){.name = listing.names[i], .text = text};
    }
    return true;
}

/* ---- Numbers, and values of what varied ---- */

static bool read_numbers(struct runs_reader *reader) {
    struct found found;
    bool is_good = look(reader, "/case", &found);
    if (is_good && (found.class != H5T_INTEGER || found.rank != 1 || found.size[0] > INT_MAX))
        is_good = hdf5_refuse(&reader->file, "/case: has no form of a file of runs");
    if (is_good) {
        reader->count = (long)found.size[0];
        reader->numbers = memory_get(&reader->memory, ((size_t)reader->count + 1) * sizeof *reader->numbers);
        is_good = reader->count == 0 ||
                  H5Dread(found.id, H5T_NATIVE_LONG, H5S_ALL, H5S_ALL, H5P_DEFAULT, reader->numbers) >= 0;
        if (!is_good)
            hdf5_fail(&reader->file, "cannot be read");
    }
    forget(&found);
    return is_good;
}

static bool check_numbers(struct runs_reader *reader) {
    for (long i = 0; i < reader->count; i++)
        if (reader->numbers[i] >= reader->batch_count ||
            reader->numbers[i] <= (i > 0 ? reader->numbers[i - 1] : -1))
            return hdf5_refuse(&reader->file,
                               "/case: row %ld has number %ld, ascending ones below %ld are needed", i,
                               reader->numbers[i], reader->batch_count);
    return true;
}

static int compare_texts(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* The different ones of (count) texts, in order, in place; returns how many. */
static int keep_different(const char **texts, long count) {
    int kept = 0;
    qsort(texts, (size_t)count, sizeof *texts, compare_texts);
    for (long i = 0; i < count; i++)
        if (kept == 0 || strcmp(texts[kept - 1], texts[i]) != 0)
            texts[kept++] = texts[i];
    return kept;
}

/* Texts come as they are by row, and become which of the different ones they are. */
static void number_texts(struct runs_reader *reader, struct varied *varied) {
    const size_t count = (size_t)reader->count;
    const char **by_row = allocate_large(count + 1, sizeof *by_row);
    memcpy(by_row, varied->texts, count * sizeof *by_row);
    varied->text_count = keep_different(varied->texts, reader->count);
    for (size_t i = 0; i < count; i++) {
        const char **which =
            bsearch(&by_row[i], varied->texts, (size_t)varied->text_count, sizeof *by_row, compare_texts);
        varied->values[i] = (double)(which - varied->texts);
    }
    free(by_row);
}

/* A row's texts lie behind that of the reason. */
static bool read_varied(struct runs_reader *reader) {
    struct cases *cases = &reader->layout.cases;
    const double *values;
    char **texts;
    for (long row = 0; row < reader->count && cases->width > 0; row++) {
        if (!hdf5_rows_get(&reader->rows, row, reader->count, &values, &texts))
            return false;
        texts++;
        for (int i = 0; i < cases->width; i++) {
            struct varied *varied = &cases->columns[i];
            if (varied->texts)
                varied->texts[row] = memory_text(&reader->memory, *texts ? *texts : "");
            texts += varied->texts != NULL;
            varied->values[row] = values[RUNS_HEAD_COUNT + i];
        }
    }
    for (int i = 0; i < cases->width; i++)
        if (cases->columns[i].texts)
            number_texts(reader, &cases->columns[i]);
    return true;
}

/* ---- The whole ---- */

static bool read_columns(struct runs_reader *reader) {
    return take_head(reader, "/case", false, RUNS_NUMBER) &&
           take_head(reader, "/status", false, RUNS_STATUS) && take_head(reader, "/reason", true, 0) &&
           take_head(reader, "/steps", false, RUNS_STEPS) && take_head(reader, "/cpu_s", false, RUNS_CPU) &&
           add_all_varied(reader);
}

static bool read_all(struct runs_reader *reader, const char *path) {
    struct hdf5_file *file = &reader->file;
    if (!hdf5_open(file, path, RUNS_CONTENT, RUNS_VERSION, "file of runs as refdyn batch writes it"))
        return false;
    if (!hdf5_get_whole(file, "/", RUNS_BATCH_COUNT, &reader->batch_count))
        return hdf5_refuse(file, "attribute " RUNS_BATCH_COUNT " is missing");
    if (!read_numbers(reader) || !check_numbers(reader) || !read_columns(reader))
        return false;
    reader->layout.cases.count = reader->count;
    /* What varied is read before there are columns of the rest, which would be read with it. */
    hdf5_rows_make_room(&reader->rows, RUNS_HEAD_COUNT + reader->layout.cases.width, reader->text_count);
    if (!read_varied(reader) || !add_groups(reader) || !add_attributes(reader))
        return false;
    hdf5_rows_make_room(&reader->rows, RUNS_HEAD_COUNT + reader->layout.cases.width + reader->layout.width,
                        reader->text_count);
    return true;
}

struct runs_reader *runs_open(const char *path) {
    struct runs_reader *reader = allocate_large(1, sizeof *reader);
    *reader = (struct runs_reader){.memory = arena_start()};
    hdf5_rows_start(&reader->rows, &reader->file);
    if (read_all(reader, path))
        return reader;
    runs_close(reader);
    return NULL;
}

const struct runs_layout *runs_layout(const struct runs_reader *reader) {
    return &reader->layout;
}

long runs_count(const struct runs_reader *reader) {
    return reader->count;
}

long runs_batch_count(const struct runs_reader *reader) {
    return reader->batch_count;
}

const long *runs_numbers(const struct runs_reader *reader) {
    return reader->numbers;
}

bool runs_get(struct runs_reader *reader, long row, struct case_record *record) {
    const double *values;
    char **texts;
    if (!hdf5_rows_get(&reader->rows, row, reader->count, &values, &texts))
        return false;
    *record = (struct case_record){.number = reader->numbers[row],
                                   .status = (int)values[RUNS_STATUS],
                                   .steps = (long)values[RUNS_STEPS],
                                   .cpu_s = values[RUNS_CPU],
                                   .reason = texts[0] ? texts[0] : "",
                                   .values = values + RUNS_HEAD_COUNT + reader->layout.cases.width};
    return true;
}

const char *runs_attribute(const struct runs_reader *reader, const char *name) {
    for (int i = 0; i < reader->layout.attribute_count; i++)
        if (strcmp(reader->layout.attributes[i].name, name) == 0)
            return reader->layout.attributes[i].text;
    return NULL;
}

void runs_close(struct runs_reader *reader) {
    hdf5_rows_release(&reader->rows);
    hdf5_release(&reader->file);
    memory_release(&reader->memory);
    free(reader);
}
