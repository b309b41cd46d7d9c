/* Prints numbers that read back exactly, JSON documents, and texts in memory. */
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void print_number(FILE *out, double value) {
    char text[NUMBER_LENGTH];
    fputs(exact_text(value, text), out);
}

const char *near_text(double value, char text[static NUMBER_LENGTH]) {
    const double rounding = 1e-15;
    const int fewest = 15, most = 17; /* number of digits; zeros at the end are not printed */
    for (int digits = fewest; digits <= most; digits++) {
        snprintf(text, NUMBER_LENGTH, "%.*g", digits, value + 0.0); /* no -0 */
        if (fabs(strtod(text, NULL) - value) <= rounding * fabs(value))
            break;
    }
    return text;
}

void document_open(struct document *document) {
    *document = (struct document){.one_line = false};
    document->out = text_stream(&document->text, &document->size);
}

bool document_close(struct document *document, FILE *file) {
    const bool is_fit = !document->unfit;
    fclose(document->out);
    if (is_fit)
        fwrite(document->text, 1, document->size, file);
    else
        fprintf(stderr, "refdyn: the result has numbers that are not finite, under \"%s\"\n",
                document->unfit);
    free(document->text);
    return is_fit;
}

/* Puts what precedes an entry: a comma, a new line at the outermost level, the key. */
static void start_entry(struct document *document, const char *key) {
    if (document->has_entry)
        fputc(',', document->out);
    if (document->depth == 1 && !document->one_line)
        fputs("\n  ", document->out);
    else if (document->has_entry)
        fputc(' ', document->out);
    document->has_entry = true;
    if (key && document->depth == 1)
        snprintf(document->section, sizeof document->section, "%s", key);
    if (key) {
        put_json_text(document->out, key);
        fputs(": ", document->out);
    }
}

void put_open(struct document *document, const char *key, char bracket) {
    start_entry(document, key);
    fputc(bracket, document->out);
    document->depth++;
    document->has_entry = false;
}

void put_close(struct document *document, char bracket) {
    document->depth--;
    if (document->depth == 0 && !document->one_line)
        fputc('\n', document->out);
    fputc(bracket, document->out);
    document->has_entry = document->depth > 0;
    if (document->depth == 0)
        fputc('\n', document->out);
}

void put_number(struct document *document, const char *key, double value) {
    start_entry(document, key);
    if (isfinite(value)) {
        print_number(document->out, value);
        return;
    }
    fputs("null", document->out);
    if (!document->unfit)
        document->unfit = text_format("%s", document->section);
}

void put_whole(struct document *document, const char *key, long value) {
    start_entry(document, key);
    fprintf(document->out, "%ld", value);
}

void put_text(struct document *document, const char *key, const char *text) {
    start_entry(document, key);
    put_json_text(document->out, text);
}

void put_truth(struct document *document, const char *key, bool value) {
    start_entry(document, key);
    fputs(value ? "true" : "false", document->out);
}

void put_null(struct document *document, const char *key) {
    start_entry(document, key);
    fputs("null", document->out);
}

void put_array(struct document *document, const char *key, const double *values, int count) {
    put_open(document, key, '[');
    for (int i = 0; i < count; i++)
        put_number(document, NULL, values[i]);
    put_close(document, ']');
}

void put_matrix(struct document *document, const char *key, const double *values, int rows, int columns) {
    put_open(document, key, '[');
    for (int i = 0; i < rows; i++)
        put_array(document, NULL, values + (size_t)i * (size_t)columns, columns);
    put_close(document, ']');
}

static _Noreturn void out_of_memory(void *context) {
    (void)context;
    fputs("refdyn: out of memory\n", stderr);
    exit(1);
}

static void *checked(void *memory) {
    if (!memory)
        out_of_memory(NULL);
    return memory;
}

struct memory program_memory = {.allowance = -1, .fail = out_of_memory};

bool text_names_hdf5(const char *path) {
    return text_ends_with(path, ".h5") || text_ends_with(path, ".hdf5");
}

const char *text_unfit_for_hdf5(const char *name) {
    enum { LONGEST = 1000 /* HDF5 stores a name in less than 64 kB together with the rest of its header */ };
    return !*name                   ? "the name is empty"
           : strchr(name, '/')      ? "HDF5 reserves a slash for groups"
           : strcmp(name, ".") == 0 ? "HDF5 reserves a dot for the group itself"
           : strlen(name) > LONGEST ? "the name is too long for HDF5"
                                    : NULL;
}

struct memory arena_start(void) {
    return (struct memory){.allowance = -1, .fail = out_of_memory};
}

void *allocate(size_t count, size_t size) {
    return memory_get(&program_memory, count * size);
}

double *allocate_matrix(int rows, int columns) {
    return allocate((size_t)rows * (size_t)columns, sizeof(double));
}

void *allocate_large(size_t count, size_t size) {
    return checked(calloc(count ? count : 1, size));
}

char *text_vformat(const char *format, va_list list) {
    va_list again;
    va_copy(again, list);
    const size_t size = (size_t)vsnprintf(NULL, 0, format, again) + 1;
    va_end(again);
    char *text = allocate(size, 1);
    vsnprintf(text, size, format, list);
    return text;
}

char *text_format(const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = text_vformat(format, list);
    va_end(list);
    return text;
}

FILE *text_stream(char **text, size_t *size) {
    return checked(open_memstream(text, size));
}
