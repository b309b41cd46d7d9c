/* Numbers, JSON and output files: see output.h. */
#include "output.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Digits that a double keeps in decimal, and that always bring it back (C11 5.2.4.2.2: DBL_DIG and
 * DBL_DECIMAL_DIG). */
enum { FEWEST_DIGITS = 15, MOST_DIGITS = 17 };

const char *exact_text(double value, char text[static NUMBER_LENGTH]) {
    for (int digits = FEWEST_DIGITS; digits <= MOST_DIGITS; digits++) {
        snprintf(text, NUMBER_LENGTH, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}

void print_number(FILE *out, double value) {
    char text[NUMBER_LENGTH];
    fputs(exact_text(value, text), out);
}

static void print_quoted(FILE *out, const char *text) {
    fputc('"', out);
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if (c < ' ')
            fprintf(out, "\\u%04x", c);
        else
            fputc(c, out);
    }
    fputc('"', out);
}

/* What stands before an entry: a comma, a new line at the outermost level, the key. */
static void start_entry(struct document *document, const char *key) {
    if (document->has_entry)
        fputc(',', document->out);
    if (document->depth == 1 && !document->one_line)
        fputs("\n  ", document->out);
    else if (document->has_entry)
        fputc(' ', document->out);
    document->has_entry = true;
    if (key) {
        print_quoted(document->out, key);
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
    if (isfinite(value))
        print_number(document->out, value);
    else
        fputs("null", document->out);
}

void put_whole(struct document *document, const char *key, long value) {
    start_entry(document, key);
    fprintf(document->out, "%ld", value);
}

void put_text(struct document *document, const char *key, const char *text) {
    start_entry(document, key);
    print_quoted(document->out, text);
}

void put_truth(struct document *document, const char *key, bool value) {
    start_entry(document, key);
    fputs(value ? "true" : "false", document->out);
}

void put_null(struct document *document, const char *key) {
    put_number(document, key, NAN);
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

static bool complain_file(const char *path, const char *what) {
    fprintf(stderr, "refdyn: %s: %s: %s\n", path, what, strerror(errno));
    return false;
}

/* A device, a pipe or a link such as /dev/stdout, which a file of that name must not replace. */
static bool is_written_through(const char *path) {
    struct stat status;
    return lstat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

bool output_open(struct output *output, const char *path) {
    *output = (struct output){.file = stdout, .path = path};
    if (!path)
        return true;
    output->part = text_format(is_written_through(path) ? "%s" : "%s.part", path);
    output->file = fopen(output->part, "w");
    if (output->file)
        return true;
    complain_file(output->part, "cannot be written");
    output_release(output);
    return false;
}

bool output_keep_part(struct output *output) {
    const char *name = output->part ? output->part : "stdout";
    bool is_good = !ferror(output->file) && fflush(output->file) == 0;
    if (!is_good)
        complain_file(name, "not all could be written");
    if (output->part && fclose(output->file) != 0 && is_good)
        is_good = complain_file(name, "not all could be written");
    output->file = NULL;
    return is_good;
}

bool output_close(struct output *output) {
    bool is_good = output_keep_part(output);
    if (is_good && output->part && strcmp(output->part, output->path) != 0 &&
        rename(output->part, output->path) != 0)
        is_good = complain_file(output->path, "cannot be made");
    output_release(output);
    return is_good;
}

void output_release(struct output *output) {
    free(output->part);
    output->part = NULL;
}

static void *checked(void *memory) {
    if (!memory) {
        fputs("refdyn: out of memory\n", stderr);
        exit(1);
    }
    return memory;
}

void *allocate(size_t count, size_t size) {
    return checked(calloc(count ? count : 1, size));
}

char *text_format(const char *format, ...) {
    va_list list;
    va_start(list, format);
    int length = vsnprintf(NULL, 0, format, list);
    va_end(list);
    char *text = checked(malloc((size_t)length + 1));
    va_start(list, format);
    vsnprintf(text, (size_t)length + 1, format, list);
    va_end(list);
    return text;
}

FILE *text_stream(char **text, size_t *size) {
    return checked(open_memstream(text, size));
}

char *file_text(const char *path) {
    char *text = NULL;
    size_t size = 0;
    FILE *file = fopen(path, "r");
    const bool is_read = file && getdelim(&text, &size, '\0', file) > 0;
    if (file)
        fclose(file);
    if (is_read)
        return text;
    free(text);
    fprintf(stderr, "refdyn: %s: cannot be read\n", path);
    return NULL;
}
