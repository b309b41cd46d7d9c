/* Answers of the gate process, and its limits of time, memory and texts. */
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- Numbers and texts ---- */

void hdf5_answers_put_whole(struct answers *answers, int64_t number) {
    fwrite(&number, sizeof number, 1, answers->stream);
}

void hdf5_answers_put_bytes(struct answers *answers, const char *text, size_t length) {
    hdf5_answers_put_whole(answers, (int64_t)length);
    fwrite(text, 1, length, answers->stream);
}

void hdf5_answers_begin(struct answers *answers, enum gate_answer answer) {
    answers->stream = format_stream(&answers->text, &answers->length);
    hdf5_answers_put_whole(answers, answer);
}

void hdf5_answers_end(struct answers *answers) {
    fclose(answers->stream);
    if (fwrite(answers->text, 1, answers->length, answers->out) != answers->length ||
        fflush(answers->out) != 0)
        _exit(1);
    free(answers->text);
}

_Noreturn void hdf5_answers_refuse(struct answers *answers, const char *format, ...) {
    va_list list;
    va_start(list, format);
    const char *text = format_vtext(format, list);
    va_end(list);
    hdf5_answers_begin(answers, GATE_FACT);
    hdf5_answers_put_bytes(answers, text, strlen(text));
    hdf5_answers_end(answers);
    _exit(0);
}

hid_t hdf5_answers_good(struct answers *answers, const char *path, hid_t result) {
    if (result < 0)
        hdf5_answers_refuse(answers, "damaged: %s: %s", path, hdf5_cause());
    return result;
}

/* ---- Bounds ---- */

static void bound(int resource, rlim_t most) {
    struct rlimit limit;
    if (getrlimit(resource, &limit) == 0 && (limit.rlim_max == RLIM_INFINITY || most < limit.rlim_max)) {
        limit.rlim_cur = most;
        setrlimit(resource, &limit);
    }
}

/* Lengths in a damaged file may request any amount of memory. If the system does not say how much this
 * process has, only the limits on texts apply. */
static void bound_memory(const struct answers *answers) {
    const double more = 1e9 + 4 * answers->bytes;
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%llu", &pages) == 1)
        bound(RLIMIT_AS, (rlim_t)((double)pages * (double)sysconf(_SC_PAGESIZE) + more));
    if (file)
        fclose(file);
}

void hdf5_answers_bound_work(struct answers *answers) {
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    bound(RLIMIT_CPU, (rlim_t)(used.ru_utime.tv_sec + used.ru_stime.tv_sec + 1 + GATE_SECONDS) +
                          (rlim_t)(answers->bytes / GATE_BYTES_PER_SECOND));
    answers->text_left = answers->bytes;
}

void hdf5_answers_start(struct answers *answers, const char *path, int socket) {
    struct stat status;
    *answers = (struct answers){.out = fdopen(socket, "w")};
    if (!answers->out)
        _exit(1);
    answers->bytes = stat(path, &status) == 0 ? (double)status.st_size : 0;
    bound(RLIMIT_CORE, 0);
    bound_memory(answers);
    hdf5_answers_bound_work(answers);
}
