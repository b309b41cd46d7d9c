/*
 * Common to the results of the author's functions: their kind, their entries, and unknown coordinates. Reads
 * the value that a function has returned; calls the function that reads each entry.
 */
#include "gen/model_file/reader.h"

void read_refuse_coordinate(const struct reader *reader, struct place place, const char *path,
                            const char *fact, const char *name) {
    if (message_is_first_mention(reader->check.messages, "coordinate", name))
        fields_refuse_name(&reader->check, place, path, fact, name,
                           tree_coordinate_names(reader->check.memory, reader->tree),
                           tree_joint_count(reader->tree));
}

static void read_entry(const struct reader *reader, const struct value *value, const char *path,
                       const struct entry_kind *kinds, size_t count, const char *needed) {
    for (size_t i = 0; i < count; i++) {
        if (!fields_has_tag(value, kinds[i].tag))
            continue;
        fields_check(&reader->check, value, kinds[i].owner, path);
        kinds[i].read(reader, value, path);
        return;
    }
    message_error(reader->check.messages, value->place, "%s: %s; must be %s", path,
                  fields_made_text(&reader->check, value), needed);
}

/* The entries of a list within the list belong to the outer list, unless it has a tag or names. */
void read_entries(const struct reader *reader, const struct value *list, const char *path,
                  const struct entry_kind *kinds, size_t count, const char *needed) {
    for (int i = 0; i < list->item_count; i++) {
        const struct value *value = &list->items[i];
        const char *own_path = fields_path_item(&reader->check, path, i);
        if (value->kind == VALUE_NOTHING)
            continue; /* a gap, reported before */
        const bool is_list = value->kind == VALUE_TABLE && !value->tag && value->field_count == 0;
        const struct value *first = is_list && value->item_count > 0 ? &value->items[0] : NULL;
        if (is_list && (!first || first->kind == VALUE_TABLE))
            read_entries(reader, value, own_path, kinds, count, needed);
        else
            read_entry(reader, value, own_path, kinds, count, needed);
    }
}

bool read_is_result(const struct reader *reader, const struct value *result, const char *name,
                    const char *needed) {
    const struct checker *check = &reader->check;
    if (result->kind != VALUE_TABLE)
        message_error(check->messages, result->place, "%s: the function returns %s; must return %s", name,
                      value_kind_text(result->kind), needed);
    else if (result->tag)
        message_error(check->messages, result->place,
                      "%s: the function returns a single rd.%s; must return %s", name, result->tag, needed);
    return result->kind == VALUE_TABLE && !result->tag;
}
