/*
 * Writes an FMU as a ZIP archive with minizip. Times and owners are the same in every archive, so that equal
 * files make equal bytes. A program that was built without minizip reports that instead.
 */
#include "runtime/tool/commands/export/export.h"

#ifdef REFDYN_HAS_MINIZIP
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <zip.h>

static const zip_fileinfo plain_file = {
    .dosDate = 0x0021u << 16, /* 1 January 1980 in the format of DOS, the first day of ZIP */
    .external_fa = 0100644u << 16,
};

/* Fields of an archive's entries. */
enum { MADE_BY_UNIX = 3 << 8 | 20, NAMES_ARE_UTF8 = 1 << 11, LEVEL = 6 };

bool export_archive_is_there(void) {
    return true;
}

static bool complain(const char *path) {
    format_complain("refdyn: %s: cannot be put into the archive: minizip reports an error\n", path);
    return false;
}

/* An archive in memory: minizip returns to the head of a file, which a pipe would not allow. */
static voidpf open_memory(voidpf memory, const void *name, int mode) {
    (void)name;
    (void)mode;
    return memory;
}

static int leave_open(voidpf memory, voidpf stream) {
    (void)memory;
    (void)stream;
    return 0;
}

static bool add_file(zipFile archive, const struct fmu_file *file) {
    const int opened = zipOpenNewFileInZip4_64(archive, file->path, &plain_file, NULL, 0, NULL, 0, NULL,
                                               Z_DEFLATED, LEVEL, 0, -MAX_WBITS, DEF_MEM_LEVEL,
                                               Z_DEFAULT_STRATEGY, NULL, 0, MADE_BY_UNIX, NAMES_ARE_UTF8, 0);
    return (opened == ZIP_OK && zipWriteInFileInZip(archive, file->text, (unsigned)file->size) == ZIP_OK &&
            zipCloseFileInZip(archive) == ZIP_OK) ||
           complain(file->path);
}

static bool put_files(FILE *memory, const struct fmu_files *files) {
    zlib_filefunc64_def functions;
    fill_fopen64_filefunc(&functions);
    functions.zopen64_file = open_memory;
    functions.zclose_file = leave_open;
    functions.opaque = memory;
    const zipFile archive = zipOpen2_64("FMU", APPEND_STATUS_CREATE, NULL, &functions);
    bool is_good = archive || complain("FMU");
    for (int i = 0; i < files->count && is_good; i++)
        is_good = add_file(archive, &files->list[i]);
    if (archive && zipClose(archive, NULL) != ZIP_OK)
        is_good = is_good && complain("FMU");
    return is_good;
}

bool export_archive_put(FILE *out, const struct fmu_files *files) {
    char *bytes = NULL;
    size_t size = 0;
    FILE *memory = format_stream(&bytes, &size);
    const bool is_good = put_files(memory, files);
    fclose(memory);
    if (is_good)
        fwrite(bytes, 1, size, out); /* system_target_finish reports a full disk */
    free(bytes);
    return is_good;
}

#else

bool export_archive_is_there(void) {
    fputs("refdyn: this refdyn is built without minizip, which FMUs need\n", stderr);
    return false;
}

/* Never called, because export_archive_is_there returns false. */
bool export_archive_put(FILE *out, const struct fmu_files *files) {
    return out && files && false;
}

#endif
