/*
 * Lines of the tables in a Lua source.
 *
 * Lua forgets where a table was written. The source is rewritten so that each constructor `{...}` becomes
 * `__at(NUMBER, {...})` (`f{...}` becomes `f(__at(NUMBER, {...}))`), with a local `__at`, the argument of the
 * chunk, in front of it, but without a line break added, so that the lines of Lua's own messages stay;
 * `tables[NUMBER]` says where the table and its entries begin. The source must be free of syntax errors.
 */
#ifndef REFDYN_GEN_SOURCE_LINES_H
#define REFDYN_GEN_SOURCE_LINES_H

#include "base/memory.h"
#include "base/message.h"

#define TABLE_MARK "__at"

/* An entry of a constructor: `name = ...` or `["name"] = ...`, or the list item `index` (from 1) when name is
 * NULL.
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

struct source_lines {
    struct table_source *tables;
    int count, capacity;
    char *text; /* the rewritten source */
    size_t length;
};

/* Numbers go on where those of an earlier source ended. What is given twice in one constructor is complained
 * about: Lua would silently take the last. */
void source_lines_mark_tables(struct memory *memory, struct messages *messages, const char *file,
                              const char *source, size_t length, struct source_lines *lines);
/* Line of entry `name` (NULL: of list item `index`) in table number `table`; 0 when unknown. */
int source_lines_of_entry(const struct source_lines *lines, int table, const char *name, int index);

#endif
