/* The reading side of the program: starts the gate, checks all that the gate sends, and delivers objects and
 * rows. */
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- Complaints ---- */

static bool complain(struct hdf5_input *input, const char *fact) {
    if (!input->has_failed && !input->is_quiet)
        format_complain_line(input->path, 0, fact);
    input->has_failed = true;
    return false;
}

bool hdf5_input_refuse(struct hdf5_input *input, const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = format_vtext(format, list);
    va_end(list);
    return complain(input, text);
}

/* The gate ended without an answer. */
static bool complain_of_end(struct hdf5_input *input) {
    int status = 0;
    if (input->has_failed)
        return false;
    kill(input->gate, SIGKILL);
    while (waitpid(input->gate, &status, 0) < 0 && errno == EINTR)
        continue;
    input->gate = 0;
    return complain(input, WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU
                               ? "damaged: reading it takes too long"
                               : "damaged: HDF5 crashes as it reads it");
}

/* ---- From the gate ---- */

static bool get_block(struct hdf5_input *input, void *block, size_t size, size_t count) {
    return !input->has_failed &&
           (count == 0 || fread(block, size, count, input->answers) == count || complain_of_end(input));
}

/* Receives a number within a range; a gate corrupted by a damaged file may send any number. */
static bool get_within(struct hdf5_input *input, long least, double most, long *number) {
    int64_t found = 0;
    if (!get_block(input, &found, sizeof found, 1))
        return false;
    *number = (long)found;
    return (found >= least && (double)found <= most) || complain(input, "damaged: a number has no sense");
}

/* Texts of objects live in the memory of the input, those of rows in heap memory, one by one. */
static char *get_text(struct hdf5_input *input, bool is_of_row) {
    enum { MORE = 4096 /* facts and paths may be longer than a small file */ };
    long length;
    if (!get_within(input, 0, input->bytes + MORE, &length))
        return NULL;
    const size_t size = (size_t)length + 1;
    char *text = is_of_row ? format_allocate_large(size, 1) : memory_get(&input->memory, size);
    if (get_block(input, text, 1, (size_t)length))
        return text;
    if (is_of_row)
        free(text);
    return NULL;
}

/* Receives an answer in the range first ... last. Returns false if a fact about the file, or nothing, came
 * instead. */
static bool get_answer(struct hdf5_input *input, enum gate_answer first, enum gate_answer last,
                       long *answer) {
    if (!get_within(input, GATE_FACT, GATE_ROWS, answer))
        return false;
    if (*answer == GATE_FACT) {
        const char *fact = get_text(input, false);
        return fact && complain(input, fact);
    }
    return (*answer >= (long)first && *answer <= (long)last) ||
           complain(input, "damaged: an answer is missing");
}

static bool get_attribute(struct hdf5_input *input, struct hdf5_object *object, enum hdf5_kind kind) {
    struct hdf5_attribute attribute = {.kind = kind, .name = get_text(input, false)};
    long count = 0;
    if (!attribute.name || !get_within(input, GATE_SINGLE, INT_MAX, &count))
        return false;
    attribute.is_list = count != GATE_SINGLE;
    attribute.count = attribute.is_list ? (int)count : 1;
    const size_t length = (size_t)attribute.count;
    if (kind == HDF5_TEXTS) {
        attribute.texts = memory_get(&input->memory, (length + 1) * sizeof *attribute.texts);
        for (size_t i = 0; i < length; i++)
            if (!(attribute.texts[i] = get_text(input, false)))
                return false;
    } else {
        attribute.numbers = memory_get(&input->memory, (length + 1) * sizeof *attribute.numbers);
        if (!get_block(input, attribute.numbers, sizeof *attribute.numbers, length))
            return false;
    }
    object->attributes = memory_room(&input->memory, object->attributes, object->attribute_count,
                                     &object->attribute_room, sizeof *object->attributes);
    object->attributes[object->attribute_count++] = attribute;
    return true;
}

static bool get_attributes(struct hdf5_input *input, struct hdf5_object *object) {
    long kind;
    while (get_within(input, GATE_NO_MORE, HDF5_NUMBERS, &kind)) {
        if (kind == GATE_NO_MORE)
            return true;
        if (!get_attribute(input, object, (enum hdf5_kind)kind))
            return false;
    }
    return false;
}

static bool get_object(struct hdf5_input *input) {
    enum { RANK_MOST = 32 };
    long group, kind, rank;
    struct hdf5_object object = {.path = NULL};
    if (!get_within(input, -1, input->count - 1, &group) || !get_within(input, 0, HDF5_OTHER, &kind) ||
        !get_within(input, 0, RANK_MOST, &rank) || !get_within(input, 0, 0x1p53, &object.size[0]) ||
        !get_within(input, 0, 0x1p53, &object.size[1]))
        return false;
    object.group = (int)group;
    object.kind = (enum hdf5_kind)kind;
    object.rank = (int)rank;
    object.path = get_text(input, false);
    object.axis = get_text(input, false);
    if (!object.path || !object.axis || !get_attributes(input, &object))
        return false;
    const char *slash = strrchr(object.path, '/');
    object.name = slash ? slash + 1 : object.path;
    object.axis = *object.axis ? object.axis : NULL;
    input->objects = memory_room(&input->memory, input->objects, input->count, &input->room, sizeof object);
    input->objects[input->count++] = object;
    return true;
}

static bool get_objects(struct hdf5_input *input) {
    long answer;
    while (get_answer(input, GATE_OBJECT, GATE_END, &answer)) {
        if (answer == GATE_END)
            return input->count > 0 || complain(input, "damaged: nothing is in it");
        if (!get_object(input))
            return false;
    }
    return false;
}

/* ---- Opening and closing ---- */

/* HDF5 begins at the start of a file, or after 512, 1024, 2048 ... bytes of other data. */
static bool has_signature(int descriptor, off_t bytes) {
    static const char signature[8] = "\x89HDF\r\n\x1a\n";
    char found[sizeof signature];
    for (off_t at = 0; at < bytes; at = at ? 2 * at : 512)
        if (pread(descriptor, found, sizeof found, at) == (ssize_t)sizeof found &&
            memcmp(found, signature, sizeof found) == 0)
            return true;
    return false;
}

/* Reports errors for which the message of HDF5 would be less clear, and refuses pipes, which would block. */
static bool check_readable(struct hdf5_input *input, const char *what) {
    struct stat status;
    const int descriptor = open(input->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    const bool is_there = descriptor >= 0 && fstat(descriptor, &status) == 0;
    const int number = errno;
    const bool is_hdf5 = is_there && S_ISREG(status.st_mode) && has_signature(descriptor, status.st_size);
    if (descriptor >= 0)
        close(descriptor);
    if (!is_there)
        return hdf5_input_refuse(input, "cannot be read: %s", strerror(number));
    input->bytes = (double)status.st_size;
    return is_hdf5 || hdf5_input_refuse(input, "is no HDF5 file; must be a %s", what);
}

static bool start_gate(struct hdf5_input *input) {
    enum { BUFFER = 1 << 16 };
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) < 0)
        return hdf5_input_refuse(input, "cannot be read: %s", strerror(errno));
    input->gate = fork();
    if (input->gate == 0) {
        close(ends[0]);
        hdf5_gate_serve(input->path, ends[1]);
    }
    close(ends[1]);
    input->socket = ends[0];
    input->answers = fdopen(ends[0], "r");
    if (input->gate > 0 && input->answers) {
        setvbuf(input->answers, NULL, _IOFBF, BUFFER);
        return true;
    }
    input->gate = input->gate > 0 ? input->gate : 0;
    return hdf5_input_refuse(input, "cannot be read: %s", strerror(errno));
}

static bool read_objects(struct hdf5_input *input, const char *path, const char *what) {
    *input = (struct hdf5_input){
        .path = format_text("%s", path), .memory = format_arena_start(), .socket = -1, .is_quiet = !what};
    return check_readable(input, what ? what : "") && start_gate(input) && get_objects(input);
}

static bool has_content(const struct hdf5_input *input, const char *content) {
    const char *found = hdf5_object_text(&input->objects[0], HDF5_CONTENT);
    return found && strcmp(found, content) == 0;
}

bool hdf5_input_open(struct hdf5_input *input, const char *path, const char *content, int version,
                     const char *what) {
    long number = 0;
    if (!read_objects(input, path, what))
        return false;
    if (!has_content(input, content))
        return hdf5_input_refuse(input, "is no %s", what);
    if (!hdf5_object_whole(&input->objects[0], HDF5_VERSION, &number) || number != version)
        return hdf5_input_refuse(input, "is a %s in layout %ld, this refdyn reads layout %d", what, number,
                                 version);
    return true;
}

bool hdf5_input_is(const char *path, const char *content) {
    struct hdf5_input input;
    const bool is_one = read_objects(&input, path, NULL) && has_content(&input, content);
    hdf5_input_close(&input);
    return is_one;
}

static void drop_texts(struct hdf5_input *input) {
    for (long i = 0; i < input->held * input->text_width; i++) {
        free(input->texts[i]);
        input->texts[i] = NULL;
    }
    input->held = 0;
}

/* Another gate may also hold the socket open, so this one is killed. It writes no files. */
void hdf5_input_close(struct hdf5_input *input) {
    drop_texts(input);
    free(input->values);
    free(input->texts);
    if (input->answers)
        fclose(input->answers);
    else if (input->socket >= 0)
        close(input->socket);
    if (input->gate > 0) {
        kill(input->gate, SIGKILL);
        while (waitpid(input->gate, NULL, 0) < 0 && errno == EINTR)
            continue;
    }
    memory_release(&input->memory);
    *input = (struct hdf5_input){.socket = -1};
}

/* ---- Objects ---- */

const struct hdf5_object *hdf5_input_find(const struct hdf5_input *input, const char *path) {
    for (int i = 0; i < input->count; i++)
        if (strcmp(input->objects[i].path, path) == 0)
            return &input->objects[i];
    return NULL;
}

const struct hdf5_attribute *hdf5_object_attribute(const struct hdf5_object *object, const char *name) {
    for (int i = 0; i < object->attribute_count; i++)
        if (strcmp(object->attributes[i].name, name) == 0)
            return &object->attributes[i];
    return NULL;
}

const char *hdf5_object_text(const struct hdf5_object *object, const char *name) {
    const struct hdf5_attribute *attribute = hdf5_object_attribute(object, name);
    return attribute && attribute->kind == HDF5_TEXTS && attribute->count == 1 ? attribute->texts[0] : NULL;
}

bool hdf5_object_whole(const struct hdf5_object *object, const char *name, long *value) {
    const struct hdf5_attribute *attribute = hdf5_object_attribute(object, name);
    if (!attribute || attribute->kind != HDF5_WHOLES || attribute->count != 1 ||
        fabs(attribute->numbers[0]) > 0x1p53)
        return false;
    *value = (long)attribute->numbers[0];
    return true;
}

/* ---- Rows ---- */

/* Checks that the answer has `count` rows of the object from `first` on. */
static bool ask_for_rows(struct hdf5_input *input, int object, long first, long count) {
    const struct gate_request request = {object, first, count};
    long answer;
    if (input->has_failed)
        return false;
    if (send(input->socket, &request, sizeof request, MSG_NOSIGNAL) != (ssize_t)sizeof request)
        return complain_of_end(input);
    return get_answer(input, GATE_ROWS, GATE_ROWS, &answer);
}

double *hdf5_input_numbers(struct hdf5_input *input, const struct hdf5_object *object) {
    const size_t count = (size_t)object->size[0];
    double *numbers = memory_get(&input->memory, (count + 1) * sizeof *numbers);
    const bool is_read = ask_for_rows(input, (int)(object - input->objects), 0, object->size[0]) &&
                         get_block(input, numbers, sizeof *numbers, count);
    return is_read ? numbers : NULL;
}

const char **hdf5_input_texts(struct hdf5_input *input, const struct hdf5_object *object) {
    const size_t count = (size_t)object->size[0];
    const char **texts = memory_get(&input->memory, (count + 1) * sizeof *texts);
    if (!ask_for_rows(input, (int)(object - input->objects), 0, object->size[0]))
        return NULL;
    for (size_t i = 0; i < count; i++)
        if (!(texts[i] = get_text(input, false)))
            return NULL;
    return texts;
}

void hdf5_input_take(struct hdf5_input *input, const struct hdf5_object *object, int place) {
    input->taken = memory_room(&input->memory, input->taken, input->taken_count, &input->taken_room,
                               sizeof *input->taken);
    input->taken[input->taken_count++] = (struct hdf5_taken){(int)(object - input->objects), place};
}

void hdf5_input_make_room(struct hdf5_input *input, int width, int text_width) {
    input->width = width;
    input->text_width = text_width;
    input->block = hdf5_rows_in_block(width, text_width);
    input->values = format_allocate_large((size_t)input->block * (size_t)width + 1, sizeof *input->values);
    input->texts = format_allocate_large((size_t)input->block * (size_t)text_width + 1, sizeof *input->texts);
}

static bool get_numbers(struct hdf5_input *input, const struct hdf5_taken *taken) {
    const long size = input->objects[taken->object].size[1];
    for (long row = 0; row < input->held; row++)
        if (!get_block(input, input->values + row * input->width + taken->place, sizeof *input->values,
                       (size_t)(size > 0 ? size : 1)))
            return false;
    return true;
}

static bool get_texts(struct hdf5_input *input, const struct hdf5_taken *taken) {
    for (long row = 0; row < input->held; row++)
        if (!(input->texts[row * input->text_width + taken->place] = get_text(input, true)))
            return false;
    return true;
}

static bool read_block(struct hdf5_input *input, long first, long total) {
    drop_texts(input);
    input->first = first;
    input->held = total - first < input->block ? total - first : input->block;
    for (int i = 0; i < input->taken_count; i++) {
        const struct hdf5_taken *taken = &input->taken[i];
        const bool is_text = input->objects[taken->object].kind == HDF5_TEXTS;
        if (!ask_for_rows(input, taken->object, first, input->held) ||
            !(is_text ? get_texts : get_numbers)(input, taken)) {
            drop_texts(input);
            return false;
        }
    }
    return true;
}

bool hdf5_input_row(struct hdf5_input *input, long row, long total, const double **values, char ***texts) {
    const bool is_held = row >= input->first && row < input->first + input->held;
    if (!is_held && !read_block(input, row, total))
        return false;
    const long place = row - input->first;
    *values = input->values + place * input->width;
    *texts = input->texts + place * input->text_width;
    return true;
}
