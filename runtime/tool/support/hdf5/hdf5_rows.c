/* Writes rows of an HDF5 file in blocks. */
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <string.h>

enum { ROWS_MOST = 4096 };

void hdf5_rows_start(struct hdf5_rows *rows, struct hdf5_file *file) {
    *rows = (struct hdf5_rows){.file = file};
}

bool hdf5_rows_add(struct hdf5_rows *rows, struct hdf5_column column) {
    if (column.dataset < 0)
        return false;
    if (rows->column_count == rows->column_room) {
        rows->column_room = 2 * rows->column_room + 16;
        struct hdf5_column *more = format_allocate_large((size_t)rows->column_room, sizeof *more);
        if (rows->column_count)
            memcpy(more, rows->columns, (size_t)rows->column_count * sizeof *more);
        free(rows->columns);
        rows->columns = more;
    }
    rows->columns[rows->column_count++] = column;
    return true;
}

static void drop_texts(struct hdf5_rows *rows) {
    for (long i = 0; i < rows->count * rows->text_width; i++) {
        free(rows->texts[i]);
        rows->texts[i] = NULL;
    }
}

static void drop_block(struct hdf5_rows *rows) {
    drop_texts(rows);
    free(rows->values);
    free(rows->texts);
    rows->first = rows->count = 0;
}

long hdf5_rows_in_block(int width, int text_width) {
    const size_t row = (size_t)width * sizeof(double) + (size_t)text_width * sizeof(char *);
    const size_t fitting = HDF5_MOST_ROOM / (row + 1);
    return fitting < 1 ? 1 : fitting < ROWS_MOST ? (long)fitting : ROWS_MOST;
}

void hdf5_rows_make_room(struct hdf5_rows *rows, int width, int text_width) {
    drop_block(rows);
    rows->width = width;
    rows->text_width = text_width;
    rows->room = hdf5_rows_in_block(width, text_width);
    rows->values = format_allocate_large((size_t)rows->room * (size_t)width + 1, sizeof *rows->values);
    rows->texts = format_allocate_large((size_t)rows->room * (size_t)text_width + 1, sizeof *rows->texts);
}

/* ---- One column of the block ---- */

/* The numbers of one column, from the rows that are held. */
static hid_t space_in_memory(const struct hdf5_rows *rows, const struct hdf5_column *column) {
    const int width = column->is_text ? rows->text_width : rows->width;
    const hsize_t held[2] = {(hsize_t)rows->count, (hsize_t)width}, start[2] = {0, (hsize_t)column->place},
                  count[2] = {(hsize_t)rows->count, column->size > 0 ? (hsize_t)column->size : 1};
    const hid_t space = H5Screate_simple(2, held, NULL);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL);
    return space;
}

static hid_t space_in_file(const struct hdf5_rows *rows, const struct hdf5_column *column) {
    const hsize_t start[2] = {(hsize_t)rows->first, 0},
                  count[2] = {(hsize_t)rows->count, (hsize_t)column->size};
    const hid_t space = H5Dget_space(column->dataset);
    if (space >= 0 && H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL) >= 0)
        return space;
    if (space >= 0)
        H5Sclose(space);
    return -1;
}

static bool make_longer(const struct hdf5_rows *rows, const struct hdf5_column *column) {
    const hsize_t size[2] = {(hsize_t)(rows->first + rows->count), (hsize_t)column->size};
    return H5Dset_extent(column->dataset, size) >= 0;
}

static bool write_column(const struct hdf5_rows *rows, const struct hdf5_column *column) {
    if (column->grows && !make_longer(rows, column))
        return hdf5_fail(rows->file, "not all could be written");
    const hid_t memory = space_in_memory(rows, column), stored = space_in_file(rows, column);
    const hid_t type = column->is_text ? rows->file->text : H5T_NATIVE_DOUBLE;
    const void *block = column->is_text ? (const void *)rows->texts : rows->values;
    const bool is_good =
        stored >= 0 && H5Dwrite(column->dataset, type, memory, stored, H5P_DEFAULT, block) >= 0;
    if (!is_good)
        hdf5_fail(rows->file, "not all could be written");
    if (stored >= 0)
        H5Sclose(stored);
    H5Sclose(memory);
    return is_good;
}

static bool write_columns(const struct hdf5_rows *rows) {
    for (int i = 0; i < rows->column_count; i++)
        if (rows->file->has_failed || !write_column(rows, &rows->columns[i]))
            return false;
    return true;
}

/* ---- Rows ---- */

bool hdf5_rows_flush(struct hdf5_rows *rows) {
    const bool is_good = rows->count == 0 || write_columns(rows);
    drop_texts(rows);
    rows->first += rows->count;
    rows->count = 0;
    return is_good && !rows->file->has_failed;
}

/* In heap memory, because there is one for each row. */
static char *heap_copy(const char *text) {
    return strcpy(format_allocate_large(strlen(text) + 1, 1), text);
}

bool hdf5_rows_put(struct hdf5_rows *rows, const double *values, const char *const *texts) {
    const size_t width = (size_t)rows->width;
    if (rows->count == rows->room && !hdf5_rows_flush(rows))
        return false;
    if (width > 0)
        memcpy(rows->values + (size_t)rows->count * width, values, width * sizeof *values);
    for (int i = 0; i < rows->text_width; i++)
        rows->texts[rows->count * rows->text_width + i] = heap_copy(texts[i]);
    rows->count++;
    return !rows->file->has_failed;
}

void hdf5_rows_release(struct hdf5_rows *rows) {
    drop_block(rows);
    for (int i = 0; i < rows->column_count; i++)
        H5Dclose(rows->columns[i].dataset);
    free(rows->columns);
    *rows = (struct hdf5_rows){.file = NULL};
}
