/*
 * Opens, reads and writes the folder of a batch that Slurm computes:
 *
 *   submitted.txt           identity of the batch, its chunks and jobs; locked while a program reads it
 *   chunk.sh merge.sh       what the jobs run
 *   part_K.h5               the cases of chunk K; part_K.h5.journal while they are computed
 *   chunk_K.txt merge.txt   output of the jobs
 *   merged                  exists once RUNS.h5 is complete
 */
#define _GNU_SOURCE
#include "runtime/tool/batches/slurm/slurm.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

_Static_assert((int)JOURNAL_HASH == 65 && (int)JOURNAL_PARTS == 4,
               "the format of sscanf below expects four hashes of 64 characters");

long slurm_chunks_start(const struct chunks *chunks, long chunk) {
    return chunks->first + (chunks->end - chunks->first) * chunk / chunks->count;
}

char *slurm_path_from_root(const char *path) {
    char *here = *path == '/' ? NULL : realpath(".", NULL);
    char *whole = here ? format_text("%s/%s", here, path) : format_text("%s", path);
    free(here);
    return whole;
}

char *slurm_folder_name(const struct slurm_folder *folder, const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *name = format_vtext(format, list);
    va_end(list);
    return format_text("%s/%s", folder->path, name);
}

static bool complain(const struct slurm_folder *folder, const char *fact) {
    format_complain("refdyn: %s: %s\n", folder->path, fact);
    return false;
}

/* ---- submitted.txt ---- */

static bool open_locked(struct slurm_folder *folder) {
    folder->file =
        open(slurm_folder_name(folder, "submitted.txt"), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (folder->file < 0)
        return complain(folder, strerror(errno));
    if (flock(folder->file, LOCK_EX | LOCK_NB) == 0)
        return true;
    return complain(folder, errno == EWOULDBLOCK ? "another refdyn is submitting it" : strerror(errno));
}

static bool scan(struct slurm_folder *folder, const char *text) {
    struct chunks *chunks = &folder->chunks;
    char(*hash)[JOURNAL_HASH] = folder->key.hash;
    const int found = sscanf(
        text, "model %64s sweep %64s options %64s files %64s cases %ld:%ld chunks %ld array %ld merge %ld",
        hash[0], hash[1], hash[2], hash[3], &chunks->first, &chunks->end, &chunks->count, &folder->array,
        &folder->merge);
    return found == 9 && chunks->first >= 0 && chunks->count > 0 &&
           chunks->end - chunks->first >= chunks->count;
}

static bool read_submitted(struct slurm_folder *folder) {
    char text[1024];
    const ssize_t length = pread(folder->file, text, sizeof text - 1, 0);
    if (length < 0)
        return complain(folder, strerror(errno));
    text[length] = '\0';
    return length == 0 || scan(folder, text) ||
           complain(folder, "submitted.txt is damaged; remove the folder to start again");
}

bool slurm_folder_write(struct slurm_folder *folder) {
    const struct chunks *chunks = &folder->chunks;
    char(*hash)[JOURNAL_HASH] = folder->key.hash;
    char *text = format_text(
        "model %s\nsweep %s\noptions %s\nfiles %s\ncases %ld:%ld\nchunks %ld\narray %ld\nmerge %ld\n",
        hash[0], hash[1], hash[2], hash[3], chunks->first, chunks->end, chunks->count, folder->array,
        folder->merge);
    const size_t length = strlen(text);
    const bool is_written =
        ftruncate(folder->file, 0) == 0 && pwrite(folder->file, text, length, 0) == (ssize_t)length;
    return is_written || complain(folder, "submitted.txt cannot be written");
}

/* ---- The folder ---- */

bool slurm_folder_open(struct slurm_folder *folder, const char *result) {
    *folder =
        (struct slurm_folder){.path = format_text("%s.slurm", slurm_path_from_root(result)), .file = -1};
    if (mkdir(folder->path, 0777) != 0 && errno != EEXIST)
        return complain(folder, strerror(errno));
    return open_locked(folder) && read_submitted(folder);
}

void slurm_folder_close(struct slurm_folder *folder) {
    if (folder->file >= 0)
        close(folder->file);
    folder->file = -1;
}
