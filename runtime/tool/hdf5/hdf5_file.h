/*
 * What all HDF5 files of the project share: how they are made, written and closed, and the messages when that
 * fails.
 *
 * Equal contents give equal bytes: no times are kept. Groups list their members in the order in which they
 * were made. Texts are UTF-8 of variable length. All functions complain once for a file, on stderr, as
 * FILE: fact; after that they do nothing and return false.
 */
#ifndef REFDYN_TOOL_HDF5_FILE_H
#define REFDYN_TOOL_HDF5_FILE_H

#include <hdf5.h>
#include <stdbool.h>

/* Attributes of a file: its content, and the version of its layout. */
#define HDF5_CONTENT "content"
#define HDF5_VERSION "layout_version"

struct hdf5_file {
    hid_t id;
    char *path;      /* as it is named in complaints */
    hid_t text;      /* the type of texts */
    bool has_failed; /* and was complained of */
};

enum { HDF5_MOST_ROOM = 1 << 22 /* bytes of rows that are held at a time */ };

/* A new file in the place of what is there; hdf5_release in any case. `content` and `version` say what is in
 * it: "refdyn runs", 1. */
bool hdf5_create(struct hdf5_file *file, const char *path, const char *content, int version);
/* All is on the disk. */
bool hdf5_finish(struct hdf5_file *file);
void hdf5_release(struct hdf5_file *file);

/* Why the last call of HDF5 failed, in words. */
const char *hdf5_cause(void);
/* Complains with `fact` and the cause that HDF5 has, which it forgets at the next call of it, unless the file
 * has failed before. Returns false. */
bool hdf5_fail(struct hdf5_file *file, const char *fact);
/* The same without a cause of HDF5's: what is in the file is wrong. */
bool hdf5_refuse(struct hdf5_file *file, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Attributes of the group or dataset `object`. */
bool hdf5_put_text(struct hdf5_file *file, const char *object, const char *name, const char *text);
bool hdf5_put_texts(struct hdf5_file *file, const char *object, const char *name, const char *const *texts,
                    int count);
bool hdf5_put_whole(struct hdf5_file *file, const char *object, const char *name, long value);
bool hdf5_put_number(struct hdf5_file *file, const char *object, const char *name, double value);

/* The group and all that lead to it, where they are missing. */
bool hdf5_make_group(struct hdf5_file *file, const char *path);

/* A dataset of `rows` x `size`, or of `rows` numbers where `size` is 0; of rows that come later when it
 * grows. */
struct hdf5_shape {
    hsize_t rows, size;
    bool grows;
};

/* The new dataset, in groups that are made; negative: it could not be made. */
hid_t hdf5_make_dataset(struct hdf5_file *file, const char *path, hid_t type, struct hdf5_shape shape);
/* A dimension scale of `count` numbers or texts, `values` of the memory type `type`; a unit may be NULL. */
bool hdf5_make_scale(struct hdf5_file *file, const char *path, hid_t stored, hid_t type, long count,
                     const void *values, const char *unit);
/* Axis number `axis` of a dataset runs along a scale. */
bool hdf5_attach_scale(struct hdf5_file *file, hid_t dataset, const char *scale, unsigned axis);

#endif
