/* Marks the table constructors of a Lua source: see reader.h. */
#include "gen/read/reader.h"

#include <stdlib.h>
#include <string.h>

/* An open bracket or block; fields of a table are looked for only while the table is innermost. */
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
    const char *copied; /* the source up to here is in the rewritten text */
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

/* Of `[key] = value`, `bracket` being behind its `[`: the key where it is a text or a number as such. */
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

/* `token` begins an entry of the innermost table. */
static void note_entry(struct marker *marker, struct nesting *nesting, const struct token *token) {
    struct scanner ahead = marker->scanner;
    struct token after = scanner_next(&ahead);
    struct table_source *table = &marker->lines->tables[nesting->table];
    struct table_entry entry = {.line = token->line};
    nesting->at_field = false;
    if (token->kind == TOKEN_SYMBOL && *token->start == '[') {
        if (!read_key(marker->memory, marker->scanner, &entry))
            return; /* a key that is computed: the line of its table has to do */
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

/* List items by number, then names; entries of one name by line. */
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

static void complain_of_doubles(struct memory *memory, struct messages *messages, const char *file,
                                const struct table_source *table) {
    const struct table_entry *first = table->entries;
    for (int i = 1; i < table->count; i++) {
        const struct table_entry *entry = &table->entries[i];
        if (is_same_entry(entry, first))
            message_error(messages, (struct place){.file = file, .line = entry->line},
                          "%s: given twice in one table, the first time in line %d",
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
        complain_of_doubles(memory, messages, file, &lines->tables[i]);
}

int source_lines_of_entry(const struct source_lines *lines, int table, const char *name, int index) {
    if (table < 0 || table >= lines->count)
        return 0;
    const struct table_source *source = &lines->tables[table];
    int low = 0, high = source->count; /* the first entry that is not less is among these */
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
