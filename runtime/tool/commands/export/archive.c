/*
 * Writes an FMU as a ZIP archive with libzip. Times and owners are the same in every archive, so that equal
 * files make equal bytes. A program that was built without libzip reports that instead.
 */
#include "runtime/tool/commands/export/export.h"

#ifdef REFDYN_HAS_LIBZIP
#include <string.h>
#include <zip.h>

enum { FIRST_DATE = 0x0021, NO_TIME = 0 }; /* 1 January 1980 in the format of DOS, the first day of ZIP */
static const unsigned plain_file = 0100644u << 16;

bool export_archive_is_there(void) {
    return true;
}

static bool complain(const char *path, const char *reason) {
    fprintf(stderr, "refdyn: %s: cannot be put into the archive: %s\n", path, reason);
    return false;
}

static bool add_file(zip_t *archive, const struct fmu_file *file) {
    zip_source_t *source = zip_source_buffer(archive, file->text, file->size, 0);
    if (!source)
        return complain(file->path, zip_strerror(archive));
    const zip_int64_t place = zip_file_add(archive, file->path, source, ZIP_FL_ENC_UTF_8);
    if (place < 0) {
        zip_source_free(source);
        return complain(file->path, zip_strerror(archive));
    }
    const zip_uint64_t index = (zip_uint64_t)place;
    if (zip_set_file_compression(archive, index, ZIP_CM_DEFLATE, 6) ||
        zip_file_set_dostime(archive, index, NO_TIME, FIRST_DATE, 0) ||
        zip_file_set_external_attributes(archive, index, 0, ZIP_OPSYS_UNIX, plain_file))
        return complain(file->path, zip_strerror(archive));
    return true;
}

static bool copy_archive(zip_source_t *source, FILE *out) {
    char block[1 << 14];
    zip_int64_t count = 0;
    if (zip_source_open(source) != 0)
        return false;
    while ((count = zip_source_read(source, block, sizeof block)) > 0)
        if (fwrite(block, 1, (size_t)count, out) != (size_t)count)
            break; /* the disk is full, which system_target_finish reports */
    zip_source_close(source);
    return count >= 0;
}

bool export_archive_put(FILE *out, const struct fmu_files *files) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t *source = zip_source_buffer_create(NULL, 0, 0, &error);
    zip_t *archive = source ? zip_open_from_source(source, ZIP_CREATE | ZIP_TRUNCATE, &error) : NULL;
    if (!archive)
        return complain("FMU", zip_error_strerror(&error));
    zip_source_keep(source);
    bool is_good = true;
    for (int i = 0; i < files->count && is_good; i++)
        is_good = add_file(archive, &files->list[i]);
    if (!is_good)
        zip_discard(archive);
    else if (zip_close(archive) != 0) {
        is_good = complain("FMU", zip_strerror(archive));
        zip_discard(archive);
    }
    is_good = is_good && (copy_archive(source, out) || complain("FMU", "it cannot be read again"));
    zip_source_free(source);
    zip_error_fini(&error);
    return is_good;
}

#else

bool export_archive_is_there(void) {
    fputs("refdyn: this refdyn is built without libzip, which FMUs need\n", stderr);
    return false;
}

/* Never called, because export_archive_is_there returns false. */
bool export_archive_put(FILE *out, const struct fmu_files *files) {
    return out && files && false;
}

#endif
