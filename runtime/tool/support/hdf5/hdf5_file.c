/*
 * The parts that all HDF5 files of the project share: creation, attributes, datasets, scales, messages.
 *
 * Equal contents give equal bytes, because no times are kept. Groups list their members in the order of
 * creation. Texts are UTF-8 of variable length.
 */
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <fcntl.h>
#include <hdf5_hl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- Complaints ---- */

/* The messages of HDF5's stack of errors, from the outermost function to the cause. */
struct cause {
    int number; /* errno of the system; 0: none */
    bool is_cut_off;
    char text[256];
};

static herr_t look_at_error(unsigned depth, const H5E_error2_t *error, void *where) {
    struct cause *cause = where;
    const char *number = strstr(error->desc, "errno = ");
    (void)depth;
    snprintf(cause->text, sizeof cause->text, "%s", error->desc);
    cause->is_cut_off = cause->is_cut_off || strstr(error->desc, "truncated file");
    if (number)
        cause->number = atoi(number + strlen("errno = "));
    return 0;
}

const char *hdf5_cause(void) {
    struct cause cause = {.number = 0};
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, look_at_error, &cause);
    return cause.is_cut_off ? "the file is cut off"
           : cause.number   ? strerror(cause.number)
                            : format_text("%s", cause.text);
}

static void complain(struct hdf5_file *file, const char *fact, const char *cause) {
    char *text = format_text("%s%s%s", fact, *cause ? ": " : "", cause);
    format_complain_line(file->path, 0, text);
    file->has_failed = true;
}

bool hdf5_fail(struct hdf5_file *file, const char *fact) {
    if (!file->has_failed)
        complain(file, fact, hdf5_cause());
    return false;
}

bool hdf5_refuse(struct hdf5_file *file, const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = format_vtext(format, list);
    va_end(list);
    if (!file->has_failed)
        complain(file, text, "");
    return false;
}

static bool check(struct hdf5_file *file, bool is_good) {
    return is_good || hdf5_fail(file, "not all could be written");
}

/* ---- Opening and closing ---- */

/* The library prints nothing. It does not clean up at the exit either, where it would try again to write data
 * that did not fit. */
static bool begin(struct hdf5_file *file, const char *path) {
    H5dont_atexit();
    *file = (struct hdf5_file){.id = -1, .path = format_text("%s", path), .text = -1};
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    file->text = H5Tcopy(H5T_C_S1);
    return H5Tset_size(file->text, H5T_VARIABLE) >= 0 && H5Tset_cset(file->text, H5T_CSET_UTF8) >= 0;
}

/* HDF5's own locks would conflict with the lock of the output, and some file systems refuse them. Attributes
 * of more than 64 KB, which the scales of many columns need, exist since the form of HDF5 1.8. */
static hid_t access_to_files(void) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_file_locking(access, false, true);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    return access;
}

/* The order of creation is kept for all groups; the root of the file is one. */
static hid_t in_order_without_times(hid_t kind) {
    const hid_t creation = H5Pcreate(kind);
    H5Pset_obj_track_times(creation, false);
    H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    return creation;
}

bool hdf5_create(struct hdf5_file *file, const char *path, const char *content, int version) {
    if (!begin(file, path))
        return hdf5_fail(file, "cannot be written");
    const hid_t access = access_to_files(), creation = in_order_without_times(H5P_FILE_CREATE);
    file->id = H5Fcreate(path, H5F_ACC_TRUNC, creation, access);
    if (file->id < 0)
        hdf5_fail(file, "cannot be written");
    H5Pclose(access);
    H5Pclose(creation);
    return hdf5_put_text(file, "/", HDF5_CONTENT, content) &&
           hdf5_put_whole(file, "/", HDF5_VERSION, version);
}

static bool synchronise(const char *path) {
    const int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    const bool is_good = descriptor >= 0 && fsync(descriptor) == 0;
    if (descriptor >= 0)
        close(descriptor);
    return is_good;
}

bool hdf5_finish(struct hdf5_file *file) {
    if (file->has_failed)
        return false;
    if (!check(file, H5Fflush(file->id, H5F_SCOPE_LOCAL) >= 0))
        return false;
    const hid_t id = file->id;
    file->id = -1;
    if (!check(file, H5Fclose(id) >= 0))
        return false;
    return synchronise(file->path) || hdf5_refuse(file, "not all could be written: %s", strerror(errno));
}

/* Data that could not be written are left in memory: closing would try again. */
void hdf5_release(struct hdf5_file *file) {
    if (file->id >= 0)
        H5Fclose(file->id);
    if (file->text >= 0)
        H5Tclose(file->text);
    *file = (struct hdf5_file){.id = -1, .text = -1};
}

/* ---- Attributes ---- */

/* count 0: a single value */
static bool put_attribute(struct hdf5_file *file, const char *object, const char *name, hid_t stored,
                          hid_t type, const void *values, int count) {
    const hsize_t size = (hsize_t)count;
    if (file->has_failed)
        return false;
    const hid_t space = count > 0 ? H5Screate_simple(1, &size, NULL) : H5Screate(H5S_SCALAR);
    const hid_t creation = H5Pcreate(H5P_ATTRIBUTE_CREATE);
    H5Pset_char_encoding(creation, H5T_CSET_UTF8);
    const hid_t attribute =
        H5Acreate_by_name(file->id, object, name, stored, space, creation, H5P_DEFAULT, H5P_DEFAULT);
    const bool is_good = attribute >= 0 && H5Awrite(attribute, type, values) >= 0;
    const bool is_written = check(file, is_good);
    if (attribute >= 0)
        H5Aclose(attribute);
    H5Pclose(creation);
    H5Sclose(space);
    return is_written;
}

bool hdf5_put_text(struct hdf5_file *file, const char *object, const char *name, const char *text) {
    return put_attribute(file, object, name, file->text, file->text, &text, 0);
}

bool hdf5_put_texts(struct hdf5_file *file, const char *object, const char *name, const char *const *texts,
                    int count) {
    return put_attribute(file, object, name, file->text, file->text, texts, count);
}

bool hdf5_put_whole(struct hdf5_file *file, const char *object, const char *name, long value) {
    return put_attribute(file, object, name, H5T_STD_I64LE, H5T_NATIVE_LONG, &value, 0);
}

bool hdf5_put_number(struct hdf5_file *file, const char *object, const char *name, double value) {
    return put_attribute(file, object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value, 0);
}

/* ---- Groups and datasets ---- */

static bool make_one_group(struct hdf5_file *file, const char *path) {
    if (H5Lexists(file->id, path, H5P_DEFAULT) > 0)
        return true;
    const hid_t creation = in_order_without_times(H5P_GROUP_CREATE), link = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_char_encoding(link, H5T_CSET_UTF8);
    const hid_t group = H5Gcreate2(file->id, path, link, creation, H5P_DEFAULT);
    const bool is_made = check(file, group >= 0 && H5Gclose(group) >= 0);
    H5Pclose(creation);
    H5Pclose(link);
    return is_made;
}

/* Makes the groups before each slash of a path. */
static bool make_groups_above(struct hdf5_file *file, const char *path) {
    const char *slash = path + 1;
    bool is_good = !file->has_failed;
    while (is_good && (slash = strchr(slash, '/'))) {
        char *group = format_text("%.*s", (int)(slash++ - path), path);
        is_good = make_one_group(file, group);
    }
    return is_good;
}

bool hdf5_make_group(struct hdf5_file *file, const char *path) {
    return make_groups_above(file, path) && make_one_group(file, path);
}

/* Rows of a fixed number are contiguous. Growing datasets are chunked; chunks need no cache, because rows
 * come in large blocks. */
static hid_t dataset_creation(struct hdf5_shape shape) {
    enum { CHUNK_ROWS = 256 };
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    const hsize_t chunk[2] = {CHUNK_ROWS, shape.size};
    H5Pset_obj_track_times(creation, false);
    H5Pset_fill_time(creation, H5D_FILL_TIME_IFSET);
    if (shape.grows)
        H5Pset_chunk(creation, shape.size > 0 ? 2 : 1, chunk);
    return creation;
}

hid_t hdf5_make_dataset(struct hdf5_file *file, const char *path, hid_t type, struct hdf5_shape shape) {
    const hsize_t size[2] = {shape.rows, shape.size},
                  most[2] = {shape.grows ? H5S_UNLIMITED : shape.rows, shape.size};
    if (!make_groups_above(file, path))
        return -1;
    const hid_t creation = dataset_creation(shape), link = H5Pcreate(H5P_LINK_CREATE);
    const hid_t access = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_char_encoding(link, H5T_CSET_UTF8);
    H5Pset_chunk_cache(access, 0, 0, 0);
    const hid_t space = H5Screate_simple(shape.size > 0 ? 2 : 1, size, most);
    const hid_t dataset = H5Dcreate2(file->id, path, type, space, link, creation, access);
    check(file, dataset >= 0);
    H5Sclose(space);
    H5Pclose(access);
    H5Pclose(link);
    H5Pclose(creation);
    return dataset;
}

bool hdf5_make_scale(struct hdf5_file *file, const char *path, hid_t stored, hid_t type, long count,
                     const void *values, const char *unit) {
    const hid_t dataset = hdf5_make_dataset(file, path, stored, (struct hdf5_shape){.rows = (hsize_t)count});
    if (dataset < 0)
        return false;
    const bool is_good =
        (count == 0 || H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0) &&
        H5DSset_scale(dataset, strrchr(path, '/') + 1) >= 0;
    const bool is_written = check(file, is_good);
    H5Dclose(dataset);
    return is_written && (!unit || !*unit || hdf5_put_text(file, path, "units", unit));
}

bool hdf5_attach_scale(struct hdf5_file *file, hid_t dataset, const char *scale, unsigned axis) {
    if (file->has_failed || dataset < 0)
        return false;
    const hid_t along = H5Dopen2(file->id, scale, H5P_DEFAULT);
    const bool is_attached = check(file, along >= 0 && H5DSattach_scale(dataset, along, axis) >= 0);
    if (along >= 0)
        H5Dclose(along);
    return is_attached;
}
