/* A scanner of Lua's tokens that marks table constructors: see source_lines.h; Lua 5.4 manual, sect. 3.1. */
#include "source_lines.h"

#include <ctype.h>
#include <stdbool.h>
#include <string.h>

enum token_kind { TOKEN_END, TOKEN_NAME, TOKEN_WORD, TOKEN_STRING, TOKEN_NUMBER, TOKEN_SYMBOL };

struct token {
    enum token_kind kind;
    const char *start, *end;
    int line;
};

struct scanner {
    const char *next, *end;
    int line;
};

/* An open bracket or block; fields of a table are looked for only while the table is innermost. */
struct nesting {
    bool is_table, is_argument, at_field;
    int table, items;
};

struct marker {
    struct memory *memory;
    struct source_lines *lines;
    struct scanner scanner;
    struct nesting *stack;
    int depth, capacity;
    const char *copied; /* the source up to here is in the rewritten text */
    size_t room;
};

static bool token_is(const struct token *token, const char *text) {
    size_t length = strlen(text);
    return (size_t)(token->end - token->start) == length && memcmp(token->start, text, length) == 0;
}

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

/* Number of '=' when a long bracket opens at p, -1 otherwise. */
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
        if (token_is(token, keywords[i]))
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

static struct token scan(struct scanner *scanner) {
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
    lines->tables[lines->count] = (struct table_source){.line = token->line};
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

/* `token` begins an entry of the innermost table. */
static void note_entry(struct marker *marker, struct nesting *nesting, const struct token *token) {
    struct scanner ahead = marker->scanner;
    struct token after = scan(&ahead);
    struct table_source *table = &marker->lines->tables[nesting->table];
    nesting->at_field = false;
    if (token->kind == TOKEN_SYMBOL && *token->start == '[')
        return; /* [key] = value: the line of its table has to do */
    struct table_entry entry = {.line = token->line};
    if (token->kind == TOKEN_NAME && token_is(&after, "="))
        entry.name = memory_format(marker->memory, "%.*s", (int)(token->end - token->start), token->start);
    else
        entry.index = ++nesting->items;
    table->entries =
        memory_room(marker->memory, table->entries, table->count, &table->capacity, sizeof *table->entries);
    table->entries[table->count++] = entry;
}

static void follow_word(struct marker *marker, const struct token *token) {
    if (token_is(token, "function") || token_is(token, "do") || token_is(token, "if") ||
        token_is(token, "repeat"))
        push(marker, (struct nesting){.is_table = false});
    else if (token_is(token, "end") || token_is(token, "until"))
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

static void complain_of_doubles(struct messages *messages, const char *file,
                                const struct source_lines *lines) {
    for (int i = 0; i < lines->count; i++) {
        const struct table_source *table = &lines->tables[i];
        for (int j = 0; j < table->count; j++) {
            const struct table_entry *entry = &table->entries[j];
            int first = entry->name ? entry_line(lines, i, entry->name, 0) : entry->line;
            int k = 0;
            while (k < j && !(entry->name && table->entries[k].name &&
                              strcmp(entry->name, table->entries[k].name) == 0))
                k++;
            if (k < j)
                complain(messages, (struct place){.file = file, .line = entry->line},
                         "%s: given twice in one table, the first time in line %d", entry->name, first);
        }
    }
}

void mark_tables(struct memory *memory, struct messages *messages, const char *file, const char *source,
                 size_t length, struct source_lines *lines) {
    struct marker marker = {.memory = memory,
                            .lines = lines,
                            .scanner = {.next = source, .end = source + length, .line = 1},
                            .copied = source};
    struct token previous = {.kind = TOKEN_END};
    for (;;) {
        struct token token = scan(&marker.scanner);
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
    complain_of_doubles(messages, file, lines);
}

int entry_line(const struct source_lines *lines, int table, const char *name, int index) {
    if (table < 0 || table >= lines->count)
        return 0;
    const struct table_source *source = &lines->tables[table];
    for (int i = 0; i < source->count; i++) {
        const struct table_entry *entry = &source->entries[i];
        if (name ? entry->name && strcmp(entry->name, name) == 0 : !entry->name && entry->index == index)
            return entry->line;
    }
    return 0;
}
