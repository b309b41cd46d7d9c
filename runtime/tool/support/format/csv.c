/* Reads CSV files line by line, opens text files of users, and prints messages. The reader skips blanks
 * around fields, a byte order mark, CR before LF, and empty lines. Other kinds of files are refused by name.
 */
#define _GNU_SOURCE
#include "runtime/tool/support/format/format.h"
#include "gen/base/base.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* a larger file is not a table of this kind, and would take all memory */
enum { LINE_MOST = 16 << 20, TEXT_MOST = 256 << 20, SHOWN_MOST = 40, SHOWN_TEXT = 300 };

static const char byte_order_mark[] =
    "\xEF\xBB\xBF"; /* the byte order mark of UTF-8, which spreadsheets write */

void format_complain_line(const char *path, long line, const char *text) {
    format_plain_text(stderr, path);
    if (line > 0)
        fprintf(stderr, ":%ld", line);
    fputs(": ", stderr);
    if (strlen(text) > 2 * SHOWN_TEXT) {
        format_plain_text(stderr, format_text("%.*s", SHOWN_TEXT, text));
        fputs(" ... ", stderr);
        text += strlen(text) - SHOWN_TEXT;
    }
    format_plain_text(stderr, text);
    fputc('\n', stderr);
}

void format_complain_messages(struct messages *messages, int first) {
    message_count_unknown(messages);
    if (first == 0)
        message_sort(messages);
    for (int i = first; i < messages->count; i++)
        format_complain_line(messages->list[i].place.file, messages->list[i].place.line,
                             messages->list[i].text);
}

void format_vcomplain(const char *format, va_list list) {
    char *text = format_vtext(format, list);
    const size_t length = strlen(text);
    const bool has_end = length > 0 && text[length - 1] == '\n';
    text[length - has_end] = '\0';
    format_plain_text(stderr, text);
    if (has_end)
        fputc('\n', stderr);
}

void format_complain(const char *format, ...) {
    va_list list;
    va_start(list, format);
    format_vcomplain(format, list);
    va_end(list);
}

bool format_csv_complain(const struct csv *csv, const char *format, ...) {
    va_list list;
    va_start(list, format);
    const char *fact = format_vtext(format, list);
    va_end(list);
    format_complain_line(csv->path, csv->line, format_text("%s: %s", csv->what, fact));
    return false;
}

/* ---- Opening ---- */

/* For a descriptor without a name the system shows "pipe:[NUMBER]". */
static bool is_nameless_pipe(int file) {
    char link[64], name[8] = "";
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    const ssize_t length = readlink(link, name, sizeof name - 1);
    return length > 0 && strncmp(name, "pipe:", 5) == 0;
}

static const char *fault_of(int file) {
    struct stat about;
    if (fstat(file, &about) != 0)
        return strerror(errno);
    if (S_ISDIR(about.st_mode))
        return strerror(EISDIR);
    if (S_ISREG(about.st_mode) || (S_ISFIFO(about.st_mode) && is_nameless_pipe(file)))
        return NULL;
    return S_ISFIFO(about.st_mode) ? "it is a named pipe" : "it is a device or a socket";
}

FILE *format_open_input(const char *path, const char **fault) {
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    *fault = file < 0 ? strerror(errno) : fault_of(file);
    if (!*fault && fcntl(file, F_SETFL, 0) == 0)
        return fdopen(file, "r");
    if (file >= 0)
        close(file);
    return NULL;
}

static bool complain_file(const char *path, const char *what, const char *fault) {
    format_complain_line(path, 0, format_text("%s: %s; must be a readable file", what, fault));
    return false;
}

/* ---- Lines ---- */

/* Names the kind of a file that begins with zero bytes. */
static const char *binary_kind(const char *text) {
    return strncmp(text, "\xFF\xFE", 2) == 0 || strncmp(text, "\xFE\xFF", 2) == 0
               ? "it is in UTF-16; must be text in UTF-8"
           : strncmp(text, "PK", 2) == 0 ? "it is a workbook or an archive; must be text"
                                         : "contains a byte 0; must be text";
}

/* Why the reading of a line ended, apart from EOF and the end of the line. */
enum { BYTE_IS_0 = -2, TOO_LONG = -3 };

_Static_assert(EOF == -1, "EOF is none of these");

/* Appends bytes to the text up to `end`, which is left out, up to a refused byte, or up to the end of the
 * file. */
static int take_bytes(FILE *file, int end, int most, char **text, int *size, int *length) {
    int c, count = 0;
    while ((c = getc_unlocked(file)) != EOF && c != end) {
        if (c == '\0' || count == most) {
            c = c ? TOO_LONG : BYTE_IS_0;
            break;
        }
        if (count + 1 >= *size) /* one byte for the zero at the end */
            *text = memory_room(&format_memory, *text, count + 1, size, 1);
        (*text)[count++] = (char)c;
    }
    *text = memory_room(&format_memory, *text, count, size, 1);
    (*text)[count] = '\0';
    *length = count;
    return c;
}

static int failed(bool is_said) {
    return is_said ? 1 : -1;
}

/* Reads the next line into csv->text, without its end. Returns 1, 0 at the end of the file, or -1 after a
 * reported error. */
static int read_line(struct csv *csv) {
    int length = 0;
    const int end = take_bytes(csv->file, '\n', LINE_MOST, &csv->text, &csv->size, &length);
    if (end == EOF && length == 0)
        return ferror(csv->file) ? failed(complain_file(csv->path, csv->what, strerror(errno))) : 0;
    csv->line++;
    if (end == BYTE_IS_0)
        return failed(format_csv_complain(csv, "%s", binary_kind(csv->text)));
    if (end == TOO_LONG)
        return failed(format_csv_complain(csv, "the line has more than %d bytes", LINE_MOST));
    csv->is_cut = end == EOF;
    if (length > 0 && csv->text[length - 1] == '\r')
        csv->text[length - 1] = '\0';
    return 1;
}

/* Cuts the next field off a line, without blanks around it. *rest is NULL after the last field. */
static char *next_field(char **rest) {
    char *field = *rest, *comma = strchr(field, ',');
    *rest = comma ? comma + 1 : NULL;
    if (comma)
        *comma = '\0';
    field += strspn(field, " \t");
    size_t length = strlen(field);
    while (length > 0 && strchr(" \t", field[length - 1]))
        field[--length] = '\0';
    return field;
}

static int count_fields(const char *line) {
    int count = 1;
    for (; *line; line++)
        count += *line == ',';
    return count;
}

static bool is_blank(const char *line) {
    return line[strspn(line, " \t")] == '\0';
}

int format_csv_next(struct csv *csv) {
    int answer;
    do
        answer = read_line(csv);
    while (answer > 0 && is_blank(csv->text));
    if (answer <= 0)
        return answer;
    const int count = count_fields(csv->text);
    if (count != csv->count)
        return failed(format_csv_complain(csv, "%d fields under %d names%s", count, csv->count,
                                          count > csv->count ? "; numbers are written with a point" : ""));
    char *rest = csv->text;
    for (int i = 0; i < count; i++)
        csv->fields[i] = next_field(&rest);
    return 1;
}

/* ---- Names ---- */

static int by_text(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Spreadsheets of some countries separate columns by another character, and some editors write lines without
 * LF. */
static bool check_separators(const struct csv *csv) {
    static const char *const marks[][2] = {{";", "semicolons separate the columns"},
                                           {"\t", "tabs separate the columns"},
                                           {"\r", "lines end with \\r"}};
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        if (!strchr(csv->text, ',') && strstr(csv->text, marks[i][0]))
            return format_csv_complain(
                csv, "%s; write commas between columns, points in numbers, \\n after lines", marks[i][1]);
    return *csv->text != '"' ||
           format_csv_complain(csv, "the names are in quotation marks; remove them, also from numbers");
}

static bool check_names(struct csv *csv) {
    bool is_good = true;
    memcpy(csv->fields, csv->names, (size_t)csv->count * sizeof *csv->fields);
    qsort(csv->fields, (size_t)csv->count, sizeof *csv->fields, by_text);
    for (int i = 1; i < csv->count && is_good; i++)
        if (strcmp(csv->fields[i - 1], csv->fields[i]) == 0)
            is_good = format_csv_complain(csv, "two columns are called '%s'; each needs its own name",
                                          csv->fields[i]);
    for (int i = 0; i < csv->count && is_good; i++)
        for (const char *at = csv->names[i]; *at && is_good; at++)
            if ((unsigned char)*at < ' ' || *at == 0x7F)
                is_good =
                    format_csv_complain(csv, "column %d: a control character in its name; remove it", i + 1);
    return is_good;
}

static bool read_names(struct csv *csv) {
    const int answer = read_line(csv);
    if (answer < 0)
        return false;
    csv->line = 1;
    if (answer == 0)
        return format_csv_complain(csv,
                                   "the file is empty; must have a header and at least one line of numbers");
    if (!check_separators(csv))
        return false;
    const bool is_marked = strncmp(csv->text, byte_order_mark, strlen(byte_order_mark)) == 0;
    csv->header = format_text("%s", csv->text + (is_marked ? strlen(byte_order_mark) : 0));
    csv->count = count_fields(csv->header);
    csv->names = format_allocate((size_t)csv->count, sizeof *csv->names);
    csv->fields = format_allocate((size_t)csv->count, sizeof *csv->fields);
    char *rest = csv->header;
    for (int i = 0; i < csv->count; i++)
        csv->names[i] = next_field(&rest);
    return check_names(csv);
}

bool format_csv_open(struct csv *csv, const char *path, const char *what) {
    *csv = (struct csv){.path = path, .what = what};
    const char *fault;
    csv->file = format_open_input(path, &fault);
    return csv->file ? read_names(csv) : complain_file(path, what, fault);
}

int format_csv_column(const struct csv *csv, const char *name) {
    return text_index(name, (const char *const *)csv->names, csv->count);
}

bool format_csv_number(const struct csv *csv, int i, double *value) {
    const char *field = csv->fields[i];
    if (text_to_number(field, value))
        return true;
    if (!*field)
        return format_csv_complain(csv, "%.*s: the field is empty; must be a finite number", SHOWN_MOST,
                                   csv->names[i]);
    return format_csv_complain(csv, "%.*s: '%.*s' is not a finite number%s", SHOWN_MOST, csv->names[i],
                               SHOWN_MOST, field, message_number_advice(&format_memory, field));
}

void format_csv_close(struct csv *csv) {
    if (csv->file)
        fclose(csv->file);
    csv->file = NULL;
}

/* ---- Whole files ---- */

static bool read_all(FILE *file, char **text, const char *path, const char *what) {
    int size = 0, length;
    const int end = take_bytes(file, EOF, TEXT_MOST, text, &size, &length);
    if (end == EOF)
        return !ferror(file) || complain_file(path, what, strerror(errno));
    format_complain_line(path, 0,
                         end == TOO_LONG
                             ? format_text("%s: larger than %d bytes; must be smaller", what, TEXT_MOST)
                             : format_text("%s: %s", what, binary_kind(*text)));
    return false;
}

char *format_read_file(const char *path, const char *what) {
    char *text = NULL;
    const char *fault;
    FILE *file = format_open_input(path, &fault);
    const bool is_read = file ? read_all(file, &text, path, what) : complain_file(path, what, fault);
    if (file)
        fclose(file);
    return is_read ? text : NULL;
}
