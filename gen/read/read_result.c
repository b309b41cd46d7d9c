/*
 * What reading forces, courses and rows has in common: the result of an author's function, its entries, and
 * coordinates that the model does not have. See reader.h.
 */
#include "read/reader.h"

void read_refuse_coordinate(const struct reader *reader, struct place place, const char *path,
                            const char *fact, const char *name) {
    if (message_is_first_mention(reader->check.messages, "coordinate", name))
        fields_refuse_name(&reader->check, place, path, fact, name,
                           tree_coordinate_names(reader->check.memory, reader->tree), reader->tree->count);
}

/* A list in a list, without a tag or names of its own, is part of that list. */
void read_entries(const struct reader *reader, const struct value *list, const char *path, read_entry *read) {
    for (int i = 0; i < list->item_count; i++) {
        const struct value *value = &list->items[i];
        const char *own_path = fields_path_item(&reader->check, path, i);
        if (value->kind == VALUE_NOTHING)
            continue; /* a gap, said before */
        const bool is_list = value->kind == VALUE_TABLE && !value->tag && value->field_count == 0;
        const struct value *first = is_list && value->item_count > 0 ? &value->items[0] : NULL;
        if (is_list && (!first || first->kind == VALUE_TABLE))
            read_entries(reader, value, own_path, read);
        else
            read(reader, value, own_path);
    }
}

bool read_is_result(const struct reader *reader, const struct value *result, const char *name,
                    const char *needed) {
    const struct checker *check = &reader->check;
    if (result->kind != VALUE_TABLE)
        message_error(check->messages, result->place, "%s: the function gives %s, %s is needed", name,
                      value_kind_text(result->kind), needed);
    else if (result->tag)
        message_error(check->messages, result->place, "%s: the function gives rd.%s itself, %s is needed",
                      name, result->tag, needed);
    return result->kind == VALUE_TABLE && !result->tag;
}
