/*
 * Lua files: reads them, splits them into tokens, and finds the lines of tables and their entries. Returns a
 * source whose table constructors are marked with numbers, so that messages can name lines.
 */
#include "gen/script/source.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- files ---- */

enum { MARK_LENGTH = 3 }; /* bytes of the byte order mark of UTF-8, which some editors write */

/* Bounds of the files of one model. A file of 4 MB describes 40,000 links. */
enum { SOURCES_BOUND = 100, SOURCE_MEGABYTES = 4 };

static const size_t length_bound = (size_t)SOURCE_MEGABYTES << 20;

/* Opens a regular file, without waiting for the other end of a pipe. Returns -1 and the reason on failure. */
static int open_regular(const char *path, const char **fault) {
    struct stat about;
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (file < 0 || fstat(file, &about) != 0)
        *fault = strerror(errno);
    else if (!S_ISREG(about.st_mode))
        *fault = S_ISDIR(about.st_mode) ? "it is a folder; name a file"
                                        : "it is a device, pipe or socket; name a regular file";
    if (file >= 0 && *fault)
        close(file);
    return *fault ? -1 : file;
}

/* Reads up to `room` bytes. Returns how many, or -1 after an error. */
static ssize_t read_all(int file, char *text, size_t room) {
    size_t length = 0;
    ssize_t count = 1;
    while (count > 0 && length < room) {
        count = read(file, text + length, room - length);
        length += count > 0 ? (size_t)count : 0;
    }
    return count < 0 ? -1 : (ssize_t)length;
}

/* Reads the text into a block of one byte more than the file should have, so that a longer file is noticed.
 */
static const char *read_text(struct memory *memory, int file, size_t bound, struct source_file *source) {
    struct stat about;
    if (fstat(file, &about) == 0 && (about.st_size < 0 || (size_t)about.st_size > bound))
        return "the files of a model are longer than 4 MB";
    const size_t room = (about.st_size > 0 ? (size_t)about.st_size : bound) + 1;
    char *text = memory_try(memory, room);
    const ssize_t length = text ? read_all(file, text, room) : 0;
    if (length < 0)
        return strerror(errno);
    if ((size_t)length == room)
        return room > bound ? "the files of a model are longer than 4 MB" : "it grows while it is read";
    source->text = text;
    source->length = (size_t)length;
    return NULL;
}

/* The error message for a file that begins unlike a text in UTF-8, or NULL. */
static const char *foreign_format(const struct source_file *source) {
    static const struct {
        const char *lead, *fault;
        size_t length;
    } formats[] = {{"\xFF\xFE\0\0", "it is in UTF-32; save it as UTF-8", 4},
                   {"\xFF\xFE", "it is in UTF-16; save it as UTF-8", 2},
                   {"\xFE\xFF", "it is in UTF-16; save it as UTF-8", 2},
                   {"\0\0\xFE\xFF", "it is in UTF-32; save it as UTF-8", 4},
                   {"\x1F\x8B", "it is compressed; unpack it with gunzip", 2},
                   {"PK\3\4", "it is an archive; unpack it with unzip", 4}};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (source->length >= formats[i].length &&
            memcmp(source->text, formats[i].lead, formats[i].length) == 0)
            return formats[i].fault;
    const bool has_zero = source->length > 1 && (!source->text[0] || !source->text[1]);
    return has_zero ? "it is in UTF-16; save it as UTF-8" : NULL;
}

static void skip_mark(struct source_file *source) {
    if (source->length < MARK_LENGTH || memcmp(source->text, "\xEF\xBB\xBF", MARK_LENGTH) != 0)
        return;
    source->text += MARK_LENGTH;
    source->length -= MARK_LENGTH;
}

const char *source_file_add(struct memory *memory, struct sources *sources, const char *path) {
    struct source_file source = {.path = path};
    const char *fault = NULL;
    if (sources->count == SOURCES_BOUND)
        return "a model has more than 100 files";
    const int file = open_regular(path, &fault);
    if (file < 0)
        return fault;
    fault = read_text(memory, file, length_bound - sources->length, &source);
    close(file);
    if (fault)
        return fault;
    if (!source.text)
        memory->fail(memory->context);
    fault = foreign_format(&source);
    if (fault)
        return fault;
    sources->length += source.length;
    skip_mark(&source);
    sources->list =
        memory_room(memory, sources->list, sources->count, &sources->capacity, sizeof *sources->list);
    sources->list[sources->count++] = source;
    return NULL;
}

const char *source_file_path(struct memory *memory, const char *neighbour, const char *name) {
    const char *slash = strrchr(neighbour, '/');
    int folder = slash ? (int)(slash - neighbour) + 1 : 0;
    return memory_format(memory, "%.*s%s.lua", folder, neighbour, name);
}

bool source_file_place(const struct sources *sources, const char *text, struct place *place,
                       const char **rest) {
    const size_t lead = strlen(SOURCE_CHUNK);
    char *end;
    if (strncmp(text, SOURCE_CHUNK, lead) != 0)
        return false;
    const long source = strtol(text + lead, &end, 10);
    if (*end != ':' || source < 0 || source >= sources->count)
        return false;
    place->file = sources->list[source].path;
    place->line = (int)strtol(end + 1, &end, 10);
    *rest = strncmp(end, ": ", 2) == 0 ? end + 2 : end;
    return true;
}

/* ---- tokens of Lua (Lua 5.4 manual, sect. 3.1); the source must be free of syntax errors ---- */

struct scanner scanner_start(const char *source, size_t length) {
    return (struct scanner){.next = source, .end = source + length, .line = 1};
}

bool scanner_token_is(const struct token *token, const char *text) {
    size_t length = strlen(text);
    return (size_t)(token->end - token->start) == length && memcmp(token->start, text, length) == 0;
}

/* Goes over one character and counts lines. */
static void step(struct scanner *scanner) {
    char c = *scanner->next++;
    if (c != '\n' && c != '\r')
        return;
    scanner->line++;
    bool is_pair = scanner->next < scanner->end && (*scanner->next == '\n' || *scanner->next == '\r');
    if (is_pair && *scanner->next != c)
        scanner->next++;
}

static bool looking_at(const struct scanner *scanner, const char *text) {
    size_t length = strlen(text);
    return (size_t)(scanner->end - scanner->next) >= length && memcmp(scanner->next, text, length) == 0;
}

/* The number of '=' if a long bracket opens at p, else -1. */
static int long_bracket(const struct scanner *scanner, const char *p) {
    if (p >= scanner->end || *p != '[')
        return -1;
    int level = 0;
    for (p++; p < scanner->end && *p == '='; p++)
        level++;
    return p < scanner->end && *p == '[' ? level : -1;
}

static bool closes(const struct scanner *scanner, int level) {
    const char *p = scanner->next;
    if (*p++ != ']')
        return false;
    for (; level > 0 && p < scanner->end && *p == '='; p++)
        level--;
    return level == 0 && p < scanner->end && *p == ']';
}

static void skip_long_bracket(struct scanner *scanner, int level) {
    while (scanner->next < scanner->end && !closes(scanner, level))
        step(scanner);
    for (int i = 0; i < level + 2 && scanner->next < scanner->end; i++)
        step(scanner);
}

static void skip_blank(struct scanner *scanner) {
    while (scanner->next < scanner->end) {
        if (isspace((unsigned char)*scanner->next)) {
            step(scanner);
        } else if (looking_at(scanner, "--")) {
            int level = long_bracket(scanner, scanner->next + 2);
            if (level >= 0)
                skip_long_bracket(scanner, level);
            while (level < 0 && scanner->next < scanner->end && *scanner->next != '\n' &&
                   *scanner->next != '\r')
                scanner->next++;
        } else {
            return;
        }
    }
}

static void skip_string(struct scanner *scanner) {
    char quote = *scanner->next++;
    while (scanner->next < scanner->end && *scanner->next != quote) {
        if (*scanner->next == '\\' && scanner->next + 1 < scanner->end)
            scanner->next++;
        step(scanner);
    }
    if (scanner->next < scanner->end)
        scanner->next++;
}

static bool is_name_letter(char c) {
    return isalnum((unsigned char)c) || c == '_';
}

static void skip_number(struct scanner *scanner) {
    while (scanner->next < scanner->end) {
        char c = *scanner->next;
        bool is_sign = (c == '+' || c == '-') && strchr("eEpP", scanner->next[-1]);
        if (!is_name_letter(c) && c != '.' && !is_sign)
            return;
        scanner->next++;
    }
}

static bool is_keyword(const struct token *token) {
    static const char *const keywords[] = {
        "and", "break", "do",  "else", "elseif", "end",    "false",  "for",  "function", "goto",  "if",
        "in",  "local", "nil", "not",  "or",     "repeat", "return", "then", "true",     "until", "while"};
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (scanner_token_is(token, keywords[i]))
            return true;
    return false;
}

static void skip_symbol(struct scanner *scanner) {
    static const char *const pairs[] = {"==", "~=", "<=", ">=", "//", "::", "..", "<<", ">>"};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        if (looking_at(scanner, pairs[i])) {
            scanner->next += 2;
            return;
        }
    }
    scanner->next++;
}

struct token scanner_next(struct scanner *scanner) {
    skip_blank(scanner);
    struct token token = {.start = scanner->next, .line = scanner->line};
    int level = long_bracket(scanner, scanner->next);
    if (scanner->next >= scanner->end) {
        token.kind = TOKEN_END;
    } else if (level >= 0) {
        token.kind = TOKEN_STRING;
        skip_long_bracket(scanner, level);
    } else if (*scanner->next == '"' || *scanner->next == '\'') {
        token.kind = TOKEN_STRING;
        skip_string(scanner);
    } else if (isdigit((unsigned char)*scanner->next)) {
        token.kind = TOKEN_NUMBER;
        skip_number(scanner);
    } else if (is_name_letter(*scanner->next)) {
        while (scanner->next < scanner->end && is_name_letter(*scanner->next))
            scanner->next++;
        token.end = scanner->next;
        token.kind = is_keyword(&token) ? TOKEN_WORD : TOKEN_NAME;
    } else {
        token.kind = TOKEN_SYMBOL;
        skip_symbol(scanner);
    }
    token.end = scanner->next;
    return token;
}

/* Whether `token` is a name that follows `local`, `local function`, `function` or a comma of such a list. */
static bool declares(const struct token *token, bool *is_list) {
    if (token->kind == TOKEN_WORD) {
        *is_list = scanner_token_is(token, "local") || scanner_token_is(token, "function");
        return false;
    }
    if (token->kind == TOKEN_NAME)
        return *is_list;
    *is_list = *is_list && token->kind == TOKEN_SYMBOL &&
               (scanner_token_is(token, ",") || scanner_token_is(token, "("));
    return false;
}

int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room) {
    struct scanner scanner = scanner_start(source, length);
    bool is_list = false;
    int count = 0;
    for (struct token token = scanner_next(&scanner); token.kind != TOKEN_END && count < room;
         token = scanner_next(&scanner))
        if (declares(&token, &is_list))
            names[count++] = memory_format(memory, "%.*s", (int)(token.end - token.start), token.start);
    return count;
}

/* ---- lines of the tables in a source ---- */

/*
 * Lua does not record where a table was written. The source is therefore rewritten: each constructor `{...}`
 * becomes `__at(NUMBER, {...})`, and `f{...}` becomes `f(__at(NUMBER, {...}))`. A local `__at`, the argument
 * of the chunk, is added in front without a line break, so that the lines of Lua's own messages stay the
 * same. `tables[NUMBER]` has the lines of the table and its entries. The source must be free of syntax
 * errors.
 */

/* An entry of a constructor: `name = ...` or `["name"] = ...`, or list item `index` (from 1) if name is NULL.
 */
struct table_entry {
    const char *name;
    int index;
    int line;
};

struct table_source {
    const char *file;
    int line;
    struct table_entry *entries; /* list items in order, then names sorted */
    int count, capacity;
};

#define TABLE_MARK "__at"

/* An open bracket or block. Fields of a table are recorded only while the table is innermost. */
struct nesting {
    bool is_table, is_argument, at_field;
    int table, items;
};

struct marker {
    struct memory *memory;
    struct source_lines *lines;
    const char *file;
    struct scanner scanner;
    struct nesting *stack;
    int depth, capacity;
    const char *copied; /* the source up to this point is in the rewritten text */
    size_t room;
};

static void write_out(struct marker *marker, const char *text, size_t length) {
    struct source_lines *lines = marker->lines;
    if (lines->length + length + 1 > marker->room) {
        size_t room = 2 * (lines->length + length + 1);
        lines->text = memory_grow(marker->memory, lines->text, lines->length, room);
        marker->room = room;
    }
    memcpy(lines->text + lines->length, text, length);
    lines->length += length;
    lines->text[lines->length] = 0;
}

static void copy_up_to(struct marker *marker, const char *end) {
    write_out(marker, marker->copied, (size_t)(end - marker->copied));
    marker->copied = end;
}

static void push(struct marker *marker, struct nesting nesting) {
    marker->stack =
        memory_room(marker->memory, marker->stack, marker->depth, &marker->capacity, sizeof *marker->stack);
    marker->stack[marker->depth++] = nesting;
}

static void open_table(struct marker *marker, const struct token *token, bool is_argument) {
    struct source_lines *lines = marker->lines;
    lines->tables =
        memory_room(marker->memory, lines->tables, lines->count, &lines->capacity, sizeof *lines->tables);
    lines->tables[lines->count] = (struct table_source){.file = marker->file, .line = token->line};
    copy_up_to(marker, token->start);
    const char *text =
        memory_format(marker->memory, "%s" TABLE_MARK "(%d,", is_argument ? "(" : "", lines->count);
    write_out(marker, text, strlen(text));
    push(marker, (struct nesting){
                     .is_table = true, .is_argument = is_argument, .at_field = true, .table = lines->count});
    lines->count++;
}

static void pop(struct marker *marker, const struct token *token) {
    if (marker->depth == 0)
        return;
    struct nesting *closed = &marker->stack[--marker->depth];
    if (!closed->is_table)
        return;
    copy_up_to(marker, token->end);
    write_out(marker, "))", closed->is_argument ? 2 : 1);
}

/* Reads the key of `[key] = value` if it is a plain text or number. `bracket` is after its `[`. */
static bool read_key(struct memory *memory, struct scanner bracket, struct table_entry *entry) {
    const struct token key = scanner_next(&bracket), closing = scanner_next(&bracket);
    const int length = (int)(key.end - key.start);
    if (!scanner_token_is(&closing, "]") || length < 1)
        return false;
    if (key.kind == TOKEN_NUMBER) {
        entry->index = atoi(memory_format(memory, "%.*s", length, key.start));
    } else if (key.kind == TOKEN_STRING && *key.start != '[' && !memchr(key.start, '\\', (size_t)length)) {
        entry->name = memory_format(memory, "%.*s", length - 2, key.start + 1);
    }
    return entry->name || entry->index > 0;
}

/* Records the entry of the innermost table that `token` begins. */
static void note_entry(struct marker *marker, struct nesting *nesting, const struct token *token) {
    struct scanner ahead = marker->scanner;
    struct token after = scanner_next(&ahead);
    struct table_source *table = &marker->lines->tables[nesting->table];
    struct table_entry entry = {.line = token->line};
    nesting->at_field = false;
    if (token->kind == TOKEN_SYMBOL && *token->start == '[') {
        if (!read_key(marker->memory, marker->scanner, &entry))
            return; /* a computed key; messages name the line of its table */
    } else if (token->kind == TOKEN_NAME && scanner_token_is(&after, "=")) {
        entry.name = memory_format(marker->memory, "%.*s", (int)(token->end - token->start), token->start);
    } else {
        entry.index = ++nesting->items;
    }
    table->entries =
        memory_room(marker->memory, table->entries, table->count, &table->capacity, sizeof *table->entries);
    table->entries[table->count++] = entry;
}

static void follow_word(struct marker *marker, const struct token *token) {
    if (scanner_token_is(token, "function") || scanner_token_is(token, "do") ||
        scanner_token_is(token, "if") || scanner_token_is(token, "repeat"))
        push(marker, (struct nesting){.is_table = false});
    else if (scanner_token_is(token, "end") || scanner_token_is(token, "until"))
        pop(marker, token);
}

static void follow_symbol(struct marker *marker, const struct token *token, const struct token *previous) {
    char c = *token->start;
    if (c == '{') {
        bool is_operand = previous->kind == TOKEN_NAME || previous->kind == TOKEN_STRING;
        bool is_closing = previous->kind == TOKEN_SYMBOL && strchr(")]}", *previous->start);
        open_table(marker, token, is_operand || is_closing);
    } else if (c == '(' || c == '[') {
        push(marker, (struct nesting){.is_table = false});
    } else if (c == ')' || c == ']' || c == '}') {
        pop(marker, token);
    } else if ((c == ',' || c == ';') && marker->depth > 0) {
        struct nesting *innermost = &marker->stack[marker->depth - 1];
        innermost->at_field = innermost->is_table;
    }
}

/* Order of entries: list items by number, then names; entries of one name by line. */
static int compare_entries(const void *a, const void *b) {
    const struct table_entry *left = a, *right = b;
    const bool are_names = left->name && right->name;
    if (!are_names && (left->name || right->name))
        return left->name ? 1 : -1;
    const int order = are_names ? strcmp(left->name, right->name) : left->index - right->index;
    return order ? order : left->line - right->line;
}

static void sort_entries(struct source_lines *lines, int first_table) {
    for (int i = first_table; i < lines->count; i++)
        if (lines->tables[i].count > 1)
            qsort(lines->tables[i].entries, (size_t)lines->tables[i].count, sizeof(struct table_entry),
                  compare_entries);
}

static bool is_same_entry(const struct table_entry *a, const struct table_entry *b) {
    return a->name ? b->name && strcmp(a->name, b->name) == 0 : !b->name && a->index == b->index;
}

static void refuse_doubles(struct memory *memory, struct messages *messages, const char *file,
                           const struct table_source *table) {
    const struct table_entry *first = table->entries;
    for (int i = 1; i < table->count; i++) {
        const struct table_entry *entry = &table->entries[i];
        if (is_same_entry(entry, first))
            message_error(messages, (struct place){.file = file, .line = entry->line},
                          "%s: already given in line %d of this table; give it once",
                          entry->name ? entry->name : memory_format(memory, "item %d", entry->index),
                          first->line);
        else
            first = entry;
    }
}

void source_lines_mark_tables(struct memory *memory, struct messages *messages, const char *file,
                              const char *source, size_t length, struct source_lines *lines) {
    const int first_table = lines->count;
    lines->text = NULL;
    lines->length = 0;
    struct marker marker = {.memory = memory,
                            .lines = lines,
                            .file = file,
                            .scanner = scanner_start(source, length),
                            .copied = source};
    struct token previous = {.kind = TOKEN_END};
    write_out(&marker, "local " TABLE_MARK " <const> = ...; ",
              strlen("local " TABLE_MARK " <const> = ...; "));
    for (;;) {
        struct token token = scanner_next(&marker.scanner);
        if (token.kind == TOKEN_END)
            break;
        struct nesting *innermost = marker.depth > 0 ? &marker.stack[marker.depth - 1] : NULL;
        if (innermost && innermost->at_field && *token.start != '}')
            note_entry(&marker, innermost, &token);
        if (token.kind == TOKEN_WORD)
            follow_word(&marker, &token);
        else if (token.kind == TOKEN_SYMBOL)
            follow_symbol(&marker, &token, &previous);
        previous = token;
    }
    copy_up_to(&marker, source + length);
    sort_entries(lines, first_table);
    for (int i = first_table; i < lines->count; i++)
        refuse_doubles(memory, messages, file, &lines->tables[i]);
}

struct place source_lines_of_table(const struct source_lines *lines, int table) {
    return (struct place){lines->tables[table].file, lines->tables[table].line};
}

int source_lines_of_entry(const struct source_lines *lines, int table, const char *name, int index) {
    if (table < 0 || table >= lines->count)
        return 0;
    const struct table_source *source = &lines->tables[table];
    int low = 0, high = source->count; /* the first entry that is not less is between these */
    const struct table_entry sought = {.name = name, .index = index};
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (compare_entries(&source->entries[middle], &sought) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == source->count)
        return 0;
    const struct table_entry *found = &source->entries[low];
    const bool is_it =
        name ? found->name && strcmp(found->name, name) == 0 : !found->name && found->index == index;
    return is_it ? found->line : 0;
}
