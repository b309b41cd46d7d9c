/* Checks that follow from the table of fields, and look-ups in it: see fields.h. */
#include "read/field_types.h"

#include <string.h>

const struct field_rule field_rules[FIELD_COUNT] = {
#define FIELD(owner, name, item, type, need, range, unit, text) \
    {OWNER_##owner, #name, item, TYPE_##type, NEED_##need, RANGE_##range, unit, text},
#include "read/fields.def"
#undef FIELD
};

static const struct {
    const char *text, *tag, *form;
} owners[] = {
#define OWNER(name, text, tag, form) {text, tag, form},
    OWNERS
#undef OWNER
};

const char *fields_owner_text(enum owner owner) {
    return owners[owner].text;
}

const char *fields_owner_tag(enum owner owner) {
    return owners[owner].tag;
}

static const char *const row_tags[] = {"position", "velocity", "acceleration"};

int fields_list_tags(const char **tags) {
    int count = 0;
    for (int i = 0; i < OWNER_COUNT; i++)
        if (owners[i].tag)
            tags[count++] = owners[i].tag;
    for (int i = 0; i < 3; i++)
        tags[count++] = row_tags[i];
    return count;
}

bool fields_has_tag(const struct value *value, const char *tag) {
    return value->kind == VALUE_TABLE && value->tag && tag && strcmp(value->tag, tag) == 0;
}

const char *fields_range_text(enum field_range range) {
    static const char *const texts[] = {"", "positive", "not below 0", "above -1, up to 0.5"};
    _Static_assert(sizeof texts / sizeof *texts == RANGE_POISSON + 1, "each range has a text");
    return texts[range];
}

const char *fields_path_name(const struct checker *checker, const char *path, const char *name) {
    return memory_format(checker->memory, "%s%s%s", path, *path ? "." : "", name);
}

const char *fields_path_item(const struct checker *checker, const char *path, int index) {
    return memory_format(checker->memory, "%s[%d]", path, index + 1);
}

void fields_refuse_name(const struct checker *checker, struct place place, const char *path, const char *fact,
                        const char *name, const char *const *known, int count) {
    const char *nearest = message_nearest_name(name, known, count);
    if (nearest) {
        message_error(checker->messages, place, "%s: %s, the nearest known one is \"%s\"", path, fact,
                      nearest);
        return;
    }
    const char *list = "";
    for (int i = 0; i < count; i++)
        list = memory_format(checker->memory, "%s %s", list, known[i]);
    message_error(checker->messages, place, "%s: %s, known:%s", path, fact, count > 0 ? list : " none");
}

/* ---- all fields of a table ---- */

static const struct value *raw_field(const struct value *table, enum field field) {
    const struct field_rule *rule = &field_rules[field];
    const struct value *value = value_find_field(table, rule->name);
    if (!value && rule->item > 0 && rule->item <= table->item_count)
        value = &table->items[rule->item - 1];
    return value;
}

/* How many fields may stand without a name. */
static int item_room(enum owner owner) {
    int room = 0;
    for (int i = 0; i < FIELD_COUNT; i++)
        if (field_rules[i].owner == owner && field_rules[i].item > room)
            room = field_rules[i].item;
    return room;
}

/* What such a table looks like, with the function of the module that has made this one. */
static const char *form_of(const struct checker *checker, const struct value *table, enum owner owner) {
    return table->tag ? memory_format(checker->memory, "rd.%s %s", table->tag, owners[owner].form)
                      : owners[owner].form;
}

/* Names of the owner's fields. */
static int owner_names(enum owner owner, const char **names) {
    int count = 0;
    for (int i = 0; i < FIELD_COUNT; i++)
        if (field_rules[i].owner == owner)
            names[count++] = field_rules[i].name;
    return count;
}

/* The field of the owner that a name which it does not have is nearest to, or NULL. */
static const char *meant_field(enum owner owner, const char *name) {
    const char *known[FIELD_COUNT];
    const int count = owner_names(owner, known);
    for (int i = 0; i < count; i++)
        if (strcmp(known[i], name) == 0)
            return NULL;
    return message_nearest_name(name, known, count);
}

bool fields_is_misspelled(const struct value *table, enum owner owner, const char *name) {
    for (int i = 0; i < table->field_count; i++) {
        const char *meant = meant_field(owner, table->fields[i].name);
        if (meant && strcmp(meant, name) == 0)
            return true;
    }
    return false;
}

static void check_unknown(const struct checker *checker, const struct value *table, enum owner owner,
                          const char *path) {
    const char *known[FIELD_COUNT];
    const int items = item_room(owner), count = owner_names(owner, known);
    for (int i = 0; i < table->field_count; i++) {
        const char *name = table->fields[i].name;
        int at = 0;
        while (at < count && strcmp(known[at], name) != 0)
            at++;
        if (at == count)
            fields_refuse_name(checker, table->fields[i].value.place, fields_path_name(checker, path, name),
                               "unknown field", name, known, count);
    }
    if (items < table->item_count && table->items[items].kind != VALUE_NOTHING)
        message_error(checker->messages, table->items[items].place, "%s: %s without a name, %s is needed",
                      fields_path_item(checker, path, items), value_kind_text(table->items[items].kind),
                      form_of(checker, table, owner));
}

/* A field by its name and as an item: one of them would be passed over. */
static void check_doubles(const struct checker *checker, const struct value *table,
                          const struct field_rule *rule, const char *path) {
    const struct value *named = value_find_field(table, rule->name);
    if (named && rule->item > 0 && rule->item <= table->item_count &&
        table->items[rule->item - 1].kind != VALUE_NOTHING)
        message_error(checker->messages, named->place,
                      "%s: given twice, by name and as item %d, once is enough", path, rule->item);
}

/* What a field says nothing without. */
static const struct {
    enum field field, beside;
} pairs[] = {{FIELD_LINK_rest, FIELD_LINK_spring},          {FIELD_LINK_center, FIELD_LINK_mass},
             {FIELD_LINK_inertia, FIELD_LINK_mass},         {FIELD_LINK_along, FIELD_LINK_on},
             {FIELD_DAMPING_mode, FIELD_DAMPING_ratio},     {FIELD_DAMPING_tip_mass, FIELD_DAMPING_ratio},
             {FIELD_DAMPING_frequency, FIELD_DAMPING_ratio}};

static void check_pairs(const struct checker *checker, const struct value *table, enum owner owner,
                        const char *path) {
    enum field told = FIELD_COUNT; /* as missing: one message is enough */
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        const char *beside = field_rules[pairs[i].beside].name;
        const struct value *value = raw_field(table, pairs[i].field);
        if (field_rules[pairs[i].field].owner != owner || !value || raw_field(table, pairs[i].beside) ||
            pairs[i].beside == told || fields_is_misspelled(table, owner, beside))
            continue;
        told = pairs[i].beside;
        message_error(checker->messages, value->place, "%s: given without %s, %s is needed",
                      fields_path_name(checker, path, field_rules[pairs[i].field].name), beside, beside);
    }
}

bool fields_is_stranger(const struct value *table, enum owner owner) {
    enum { COMPLAINTS = 3 };
    int needed = 0;
    if (item_room(owner) > 0 && table->item_count > 0)
        return false;
    for (int i = 0; i < FIELD_COUNT; i++) {
        if (field_rules[i].owner != owner)
            continue;
        if (value_find_field(table, field_rules[i].name))
            return false;
        needed +=
            field_rules[i].need == NEED_NEEDED && !fields_is_misspelled(table, owner, field_rules[i].name);
    }
    return table->field_count + table->item_count > 0 &&
           needed + table->field_count + (table->item_count > 0) >= COMPLAINTS;
}

static void complain_of_stranger(const struct checker *checker, const struct value *table, enum owner owner,
                                 const char *path) {
    const char *names = "";
    for (int i = 0; i < table->field_count && i < 5; i++)
        names = memory_format(checker->memory, "%s%s%s", names, i ? " " : "", table->fields[i].name);
    message_error(checker->messages, table->place, "%s: no field of %s%s%s%s, %s is needed", path,
                  fields_owner_text(owner), *names ? " (" : "", names, *names ? ")" : "",
                  form_of(checker, table, owner));
}

/* Rows of all three levels have the same fields. */
bool fields_is_made_for(const struct value *table, enum owner owner) {
    const char *tag = owner == OWNER_COUNT ? NULL : owners[owner].tag;
    bool is_row = false;
    for (int i = 0; i < 3; i++)
        is_row = is_row || fields_has_tag(table, row_tags[i]);
    return !table->tag || fields_has_tag(table, tag) || (owner == OWNER_ROW && is_row);
}

void fields_check(const struct checker *checker, const struct value *table, enum owner owner,
                  const char *path) {
    if (!fields_is_made_for(table, owner)) {
        message_error(checker->messages, table->place, "%s: made by rd.%s, %s such as %s is needed", path,
                      table->tag, fields_owner_text(owner), owners[owner].form);
        return;
    }
    if (fields_is_stranger(table, owner)) {
        complain_of_stranger(checker, table, owner, path);
        return;
    }
    const bool has_stray = table->item_count > item_room(owner); /* what is missing may stand there */
    for (int i = 0; i < FIELD_COUNT; i++) {
        const struct field_rule *rule = &field_rules[i];
        if (rule->owner != owner)
            continue;
        const struct value *value = raw_field(table, (enum field)i);
        const char *own_path = fields_path_name(checker, path, rule->name);
        check_doubles(checker, table, rule, own_path);
        if (value)
            field_types_check(checker, value, rule, own_path);
        else if (rule->need == NEED_NEEDED && !has_stray && !fields_is_misspelled(table, owner, rule->name))
            message_error(checker->messages, table->place, "%s: missing, %s needs it", own_path,
                          fields_owner_text(owner));
    }
    check_pairs(checker, table, owner, path);
    check_unknown(checker, table, owner, path);
}

const struct value *fields_get(const struct value *table, enum field field) {
    const struct value *value = raw_field(table, field);
    return value && field_types_matches(value, field_rules[field].type) ? value : NULL;
}

const char *fields_made_text(const struct checker *checker, const struct value *value) {
    return value->tag ? memory_format(checker->memory, "made by rd.%s", value->tag)
                      : value_kind_text(value->kind);
}

bool fields_has(const struct value *table, enum field field) {
    return table && raw_field(table, field);
}

expression fields_get_value(const struct checker *checker, const struct value *table, enum field field) {
    const struct value *value = fields_get(table, field);
    expression e =
        field_rules[field].need != NEED_OPTIONAL ? expr_one(checker->graph) : expr_zero(checker->graph);
    if (value)
        value_expression(checker->graph, value, &e);
    return e;
}

void fields_get_vector(const struct checker *checker, const struct value *table, enum field field,
                       expression *vector) {
    const struct value *value = fields_get(table, field);
    for (int i = 0; i < 3; i++) {
        vector[i] = expr_zero(checker->graph);
        if (value && i < value->item_count)
            value_expression(checker->graph, &value->items[i], &vector[i]);
    }
}

static int names_of_text(const struct checker *checker, const char *text, const char **names) {
    int count = 0;
    while (*text) {
        size_t length = strcspn(text, ", ");
        if (length > 0 && names)
            names[count] = memory_format(checker->memory, "%.*s", (int)length, text);
        count += length > 0;
        text += length;
        text += strspn(text, ", ");
    }
    return count;
}

int fields_get_names(const struct checker *checker, const struct value *value, const char ***names) {
    *names = NULL;
    if (!value)
        return 0;
    int count = value->kind == VALUE_TEXT ? names_of_text(checker, value->text, NULL) : value->item_count;
    *names = memory_get(checker->memory, ((size_t)count + 1) * sizeof **names);
    if (value->kind == VALUE_TEXT)
        return names_of_text(checker, value->text, *names);
    int kept = 0;
    for (int i = 0; i < count; i++)
        if (value->items[i].kind == VALUE_TEXT)
            (*names)[kept++] = value->items[i].text;
    return kept;
}
