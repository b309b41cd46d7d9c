/*
 * Cases of a batch whose programmes drives perform: `refdyn batch --realise`.
 *
 * In: the scenes of a structure, and the values of a case. Out: the record of the case, with the numbers of
 * the report of `sim --realise` and what is kept of the motion. The reason of a case that is refused is the
 * message. Each case is computed in a separate process, which begins with the scenes as they were compiled,
 * so that a result depends on no other case.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- One case ---- */

/* The values of a case by name; those that this structure lacks are unknown (NaN) and left out. */
static int list_values(const struct cases *cases, long number, struct named_value *values) {
    int count = 0;
    for (int i = 0; i < cases->width; i++) {
        const struct varied *column = &cases->columns[i];
        if (column->kind != VARIED_OPTION && !isnan(column->values[number]))
            values[count++] = (struct named_value){column->name, column->values[number]};
    }
    return count;
}

enum status runs_realise_case(struct batch_setup *setup, struct structure *structure, long number,
                              struct realise_work *work, struct realise_rows *rows) {
    const struct cases *cases = &setup->sweep.cases;
    const struct seen_times *times = &setup->kept.times;
    struct named_value *values = format_allocate((size_t)cases->width + 1, sizeof *values);
    const int count = list_values(cases, number, values);
    enum status status = scene_set_values(&structure->scene, values, count);
    if (status == STATUS_DONE)
        status = scene_set_values(&structure->played, values, count);
    if (status == STATUS_DONE)
        status = realise_find(work, &structure->scene, &structure->played, &structure->options,
                              &setup->integration);
    rows->times = times->t;
    rows->count = times->count;
    return status == STATUS_DONE ? realise_show(work, rows, NULL) : status;
}

/* ---- Its record ---- */

struct recording {
    struct batch_setup *setup;
    struct structure *structure;
    struct recorder recorder;
};

static int begin(void *context, struct record_table *table) {
    struct recording *recording = context;
    runs_recorder_start(&recording->recorder, &recording->setup->kept, &recording->setup->layout, table,
                        &recording->structure->scene.generation.model);
    runs_recorder_clear(&recording->recorder);
    return REFDYN_OK;
}

static int put(void *context, struct record_table *table, int number) {
    (void)table;
    runs_recorder_take(&((struct recording *)context)->recorder, number);
    return REFDYN_OK;
}

static void put_numbers(struct recording *recording, const struct realise_work *work) {
    const struct runs_layout *layout = &recording->setup->layout;
    const struct kept *kept = &recording->setup->kept;
    struct realise_number *numbers;
    const int count = realise_list_numbers(&recording->structure->scene.generation.model, work, &numbers);
    for (int i = 0; i < layout->item_count; i++)
        for (int k = 0; kept->kinds[i] == KEPT_REALISE && k < count; k++)
            if (strcmp(layout->items[i].name, numbers[k].name) == 0)
                recording->recorder.values[layout->items[i].offset] = numbers[k].value;
}

/* ---- Its process ---- */

/* What a process writes into its file: this head, the numbers of the case (layout.width), and the message. */
struct answer {
    int status;
    size_t reason_length;
};

/* Why the case failed: the last line of standard error that is no warning, without the program's name. */
static void read_reason(FILE *said, char reason[static REASON_LENGTH]) {
    char line[REASON_LENGTH];
    rewind(said);
    *reason = '\0';
    while (fgets(line, sizeof line, said)) {
        line[strcspn(line, "\n")] = '\0';
        if (!strstr(line, "warning: "))
            strcpy(reason, strncmp(line, "refdyn: ", 8) == 0 ? line + 8 : line);
    }
}

static void write_answer(FILE *file, const struct batch_setup *setup, enum status status,
                         const double *values, const char *reason) {
    const struct answer answer = {(int)status, strlen(reason)};
    fwrite(&answer, sizeof answer, 1, file);
    for (int i = 0; i < setup->layout.width; i++) {
        const double value = values ? values[i] : NAN;
        fwrite(&value, sizeof value, 1, file);
    }
    fwrite(reason, 1, answer.reason_length, file);
}

/* The process of one case. It ignores signals, since the process that started it ends it. */
static void compute(struct batch_setup *setup, struct structure *structure, long number, FILE *file) {
    static const int ignored[] = {SIGINT, SIGTERM, SIGHUP};
    struct recording recording = {.setup = setup, .structure = structure};
    struct realise_rows rows = {.context = &recording, .begin = begin, .put = put};
    struct realise_work work;
    char reason[REASON_LENGTH] = "";
    FILE *said = tmpfile();
    for (int i = 0; i < 3; i++)
        signal(ignored[i], SIG_IGN);
    if (said)
        dup2(fileno(said), STDERR_FILENO);
    const enum status status = runs_realise_case(setup, structure, number, &work, &rows);
    if (status == STATUS_DONE)
        put_numbers(&recording, &work);
    else if (said)
        read_reason(said, reason);
    write_answer(file, setup, status, status == STATUS_DONE ? recording.recorder.values : NULL, reason);
    _exit(fflush(file) == 0 ? 0 : 1);
}

/* ---- Several at a time ---- */

/* A process and the file into which it writes its answer; pid 0: none. */
struct worker {
    pid_t pid;
    long number;
    FILE *file;
};

static bool start(struct worker *worker, struct batch_setup *setup, struct structure *structure,
                  long number) {
    worker->number = number;
    worker->file = tmpfile();
    worker->pid = worker->file ? system_process_fork() : -1;
    if (worker->pid == 0)
        compute(setup, structure, number, worker->file);
    if (worker->pid < 0)
        fprintf(stderr, "refdyn: case %ld: cannot start a process: %s\n", number, strerror(errno));
    return worker->pid > 0;
}

static double seconds(struct timeval time) {
    return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
}

/* Passes on the record of a case. `ended`: the status of its process, as wait4 reports it. */
static bool collect(struct worker *worker, const struct batch_setup *setup, int ended,
                    const struct rusage *usage, bool (*take)(void *context, const struct case_record *record),
                    void *context) {
    const size_t width = (size_t)setup->layout.width;
    double *values = format_allocate_large(width + 1, sizeof *values);
    char reason[REASON_LENGTH] = "";
    struct answer answer = {.status = STATUS_NUMBERS};
    rewind(worker->file);
    const bool is_read = ended == 0 && fread(&answer, sizeof answer, 1, worker->file) == 1 &&
                         fread(values, sizeof *values, width, worker->file) == width &&
                         answer.reason_length < REASON_LENGTH &&
                         fread(reason, 1, answer.reason_length, worker->file) == answer.reason_length;
    if (!is_read) {
        answer.status = STATUS_NUMBERS;
        for (size_t i = 0; i < width; i++)
            values[i] = NAN;
        snprintf(reason, sizeof reason,
                 WIFSIGNALED(ended) ? "signal %d ended the process of the case"
                                    : "the process of the case returned no result; its exit status is %d",
                 WIFSIGNALED(ended) ? WTERMSIG(ended) : WEXITSTATUS(ended));
    }
    const struct case_record record = {.number = worker->number,
                                       .status = answer.status,
                                       .cpu_s = seconds(usage->ru_utime) + seconds(usage->ru_stime),
                                       .reason = reason,
                                       .values = values};
    const bool is_taken = take(context, &record);
    free(values);
    return is_taken;
}

static void forget(struct worker *worker) {
    if (worker->file)
        fclose(worker->file);
    *worker = (struct worker){.pid = 0};
}

static void kill_all(struct worker *workers, int count) {
    for (int i = 0; i < count; i++) {
        if (workers[i].pid > 0) {
            kill(workers[i].pid, SIGKILL);
            while (waitpid(workers[i].pid, NULL, 0) < 0 && errno == EINTR)
                continue;
        }
        forget(&workers[i]);
    }
}

/* Polls, because a signal that arrives just before a blocking call would not end this call. */
void runs_realise_cases(struct batch_setup *setup, struct structure *structure, const long *numbers,
                        long count, bool (*take)(void *context, const struct case_record *record),
                        void *context) {
    const struct timespec pause = {.tv_nsec = 1000000}; /* short compared with any case */
    struct worker *workers = format_allocate_large((size_t)setup->threads, sizeof *workers);
    long next = 0, ended = 0;
    bool is_good = true;
    while (ended < count && is_good && !system_interrupted) {
        bool is_idle = true;
        for (int i = 0; i < setup->threads && is_good && !system_interrupted; i++) {
            int result;
            struct rusage usage;
            if (workers[i].pid == 0 && next < count)
                is_good = start(&workers[i], setup, structure, numbers[next++]);
            if (!is_good || workers[i].pid == 0 || wait4(workers[i].pid, &result, WNOHANG, &usage) == 0)
                continue;
            is_idle = false;
            is_good = collect(&workers[i], setup, result, &usage, take, context);
            forget(&workers[i]);
            ended++;
        }
        if (is_idle)
            nanosleep(&pause, NULL);
    }
    kill_all(workers, setup->threads);
    free(workers);
}
