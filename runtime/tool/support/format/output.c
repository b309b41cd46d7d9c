/* Prints numbers that read back exactly, JSON documents, and texts in memory. */
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void format_number(FILE *out, double value) {
    char text[NUMBER_LENGTH];
    fputs(exact_text(value, text), out);
}

const char *format_near_number(double value, char text[static NUMBER_LENGTH]) {
    const double rounding = 1e-15;
    const int fewest = 15, most = 17; /* number of digits; zeros at the end are not printed */
    for (int digits = fewest; digits <= most; digits++) {
        snprintf(text, NUMBER_LENGTH, "%.*g", digits, value + 0.0); /* no -0 */
        if (fabs(strtod(text, NULL) - value) <= rounding * fabs(value))
            break;
    }
    return text;
}

int format_ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void format_document_open(struct document *document) {
    *document = (struct document){.one_line = false};
    document->out = format_stream(&document->text, &document->size);
}

bool format_document_close(struct document *document, FILE *file) {
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
        format_json_text(document->out, key);
        fputs(": ", document->out);
    }
}

void format_put_open(struct document *document, const char *key, char bracket) {
    start_entry(document, key);
    fputc(bracket, document->out);
    document->depth++;
    document->has_entry = false;
}

void format_put_close(struct document *document, char bracket) {
    document->depth--;
    if (document->depth == 0 && !document->one_line)
        fputc('\n', document->out);
    fputc(bracket, document->out);
    document->has_entry = document->depth > 0;
    if (document->depth == 0)
        fputc('\n', document->out);
}

void format_put_number(struct document *document, const char *key, double value) {
    start_entry(document, key);
    if (isfinite(value)) {
        format_number(document->out, value);
        return;
    }
    fputs("null", document->out);
    if (!document->unfit)
        document->unfit = format_text("%s", document->section);
}

void format_put_whole(struct document *document, const char *key, long value) {
    start_entry(document, key);
    fprintf(document->out, "%ld", value);
}

void format_put_text(struct document *document, const char *key, const char *text) {
    start_entry(document, key);
    format_json_text(document->out, text);
}

void format_put_truth(struct document *document, const char *key, bool value) {
    start_entry(document, key);
    fputs(value ? "true" : "false", document->out);
}

void format_put_null(struct document *document, const char *key) {
    start_entry(document, key);
    fputs("null", document->out);
}

void format_put_array(struct document *document, const char *key, const double *values, int count) {
    format_put_open(document, key, '[');
    for (int i = 0; i < count; i++)
        format_put_number(document, NULL, values[i]);
    format_put_close(document, ']');
}

void format_put_matrix(struct document *document, const char *key, const double *values, int rows,
                       int columns) {
    format_put_open(document, key, '[');
    for (int i = 0; i < rows; i++)
        format_put_array(document, NULL, values + (size_t)i * (size_t)columns, columns);
    format_put_close(document, ']');
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

struct memory format_memory = {.allowance = -1, .fail = out_of_memory};

bool format_names_hdf5(const char *path) {
    return text_ends_with(path, ".h5") || text_ends_with(path, ".hdf5");
}

const char *format_unfit_for_hdf5(const char *name) {
    enum { LONGEST = 1000 /* HDF5 stores a name in less than 64 kB together with the rest of its header */ };
    return !*name                   ? "the name is empty"
           : strchr(name, '/')      ? "HDF5 reserves a slash for groups"
           : strcmp(name, ".") == 0 ? "HDF5 reserves a dot for the group itself"
           : strlen(name) > LONGEST ? "the name is too long for HDF5"
                                    : NULL;
}

struct memory format_arena_start(void) {
    return (struct memory){.allowance = -1, .fail = out_of_memory};
}

void *format_allocate(size_t count, size_t size) {
    return memory_get(&format_memory, count * size);
}

double *format_allocate_matrix(int rows, int columns) {
    return format_allocate((size_t)rows * (size_t)columns, sizeof(double));
}

void *format_allocate_large(size_t count, size_t size) {
    return checked(calloc(count ? count : 1, size));
}

char *format_vtext(const char *format, va_list list) {
    va_list again;
    va_copy(again, list);
    const size_t size = (size_t)vsnprintf(NULL, 0, format, again) + 1;
    va_end(again);
    char *text = format_allocate(size, 1);
    vsnprintf(text, size, format, list);
    return text;
}

char *format_text(const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = format_vtext(format, list);
    va_end(list);
    return text;
}

FILE *format_stream(char **text, size_t *size) {
    return checked(open_memstream(text, size));
}
