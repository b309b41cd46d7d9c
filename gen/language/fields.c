/*
 * Values of a model file, and the table of fields (fields.def): what each table may contain, and look-ups of
 * fields by name, item and type.
 */
#include "gen/language/language.h"

#include <string.h>

/* ---- values ---- */

const char *value_kind_text(enum value_kind kind) {
    static const char *const texts[] = {"nothing",       "a number",      "a text",
                                        "a truth value", "an expression", "a function",
                                        "a curve",       "a table",       "a group of values"};
    _Static_assert(sizeof texts / sizeof *texts == VALUE_GROUP + 1, "each kind has a text");
    return texts[kind];
}

const struct value *value_find_field(const struct value *table, const char *name) {
    for (int i = 0; i < table->field_count; i++)
        if (strcmp(table->fields[i].name, name) == 0)
            return &table->fields[i].value;
    return NULL;
}

bool value_expression(struct graph *graph, const struct value *value, expression *result) {
    if (value->kind == VALUE_NUMBER)
        *result = expr_number(graph, value->number);
    else if (value->kind == VALUE_EXPRESSION)
        *result = value->expression;
    else
        return false;
    return true;
}

/* ---- the table of fields ---- */

const struct field_rule field_rules[FIELD_COUNT] = {
#define FIELD(owner, name, item, type, need, range, unit, text) \
    {OWNER_##owner, #name, item, TYPE_##type, NEED_##need, RANGE_##range, unit, text},
#include "gen/language/fields.def"
#undef FIELD
};

const struct owner_rule owner_rules[OWNER_COUNT] = {
#define OWNER(name, text, tag, form) {text, tag, form},
    OWNERS
#undef OWNER
};

enum {
    TAKES_NUMBER = 1 << VALUE_NUMBER,
    TAKES_VALUE = 1 << VALUE_NUMBER | 1 << VALUE_EXPRESSION,
    TAKES_TEXT = 1 << VALUE_TEXT,
    TAKES_TABLE = 1 << VALUE_TABLE,
    TAKES_FUNCTION = 1 << VALUE_FUNCTION,
    TAKES_TRUTH = 1 << VALUE_BOOLEAN
};

const struct type_rule type_rules[TYPE_COUNT] = {
    [TYPE_TEXT] = {"a text", TAKES_TEXT, OWNER_COUNT},
    [TYPE_WHOLE] = {"a whole number", TAKES_NUMBER, OWNER_COUNT},
    [TYPE_NUMBER] = {"a number", TAKES_NUMBER, OWNER_COUNT},
    [TYPE_VALUE] = {"a number or an expression in parameters", TAKES_VALUE, OWNER_COUNT},
    [TYPE_FREE] = {"a number or an expression", TAKES_VALUE, OWNER_COUNT},
    [TYPE_VECTOR] = {"a list of 3 numbers such as { 0, 0, 1 }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_VALUES] = {"a list of numbers such as { 0, 1, 0 }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_TURNS] = {"a list of turns such as { { \"x\", 1.57 } }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_NAMES] = {"a list of names such as { \"a\", \"b\" }", TAKES_TEXT | TAKES_TABLE, OWNER_COUNT},
    [TYPE_BY_JOINT] = {"a table by joint such as { z = 1 }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_ROTORS] = {"a table by joint such as { psi = { inertia = 1e-4, gear = 100 } }", TAKES_TABLE,
                     OWNER_COUNT},
    [TYPE_LIMITS] = {"a table by joint such as { psi = { from = -2, to = 2 } }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_PLACE] = {"the name of a link or point, or { on = ..., at = ... }", TAKES_TEXT | TAKES_TABLE,
                    OWNER_POINT},
    [TYPE_AXIS] = {"an axis such as { \"arm\", \"z\" }", TAKES_TABLE, OWNER_AXIS},
    [TYPE_INERTIA] = {"an inertia such as { zz = 0.05 }", TAKES_TABLE, OWNER_INERTIA},
    [TYPE_BEAM] = {"a beam such as { length = 1, section = rd.round(0.014), ... }", TAKES_TABLE, OWNER_BEAM},
    [TYPE_SECTION] = {"a section such as rd.round(0.014)", TAKES_TABLE, OWNER_SECTION},
    [TYPE_DAMPING] = {"a damping such as { ratio = 0.01 }", TAKES_TABLE, OWNER_DAMPING},
    [TYPE_CURVATURE] = {"a curvature such as { psi = 0.1 }", TAKES_TABLE, OWNER_CURVATURE},
    [TYPE_DIRECTION] = {"\"x\", \"y\", \"z\" or a list of 3 numbers such as { 0, 0, 1 }",
                        TAKES_TEXT | TAKES_TABLE, OWNER_COUNT},
    [TYPE_FREE_VECTOR] = {"a list of 3 numbers or expressions such as { 0, 0, 1 }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_FREE_TURNS] = {"a list of turns such as { { \"x\", s.t } }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_FREE_BY_NAME] = {"a table of values by name such as { arm_psi = 0 }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_TRUTH] = {"true or false", TAKES_TRUTH, OWNER_COUNT},
    [TYPE_POINTS] = {"a table of points such as { E = \"arm\" }", TAKES_TABLE, OWNER_COUNT},
    [TYPE_LIST] = {"a list of tables", TAKES_TABLE, OWNER_COUNT},
    [TYPE_DRIVES] = {"a list of drives such as { \"arm_psi\", { \"effector_z\", limit = 100 } }", TAKES_TABLE,
                     OWNER_COUNT},
    [TYPE_FUNCTION] = {"a function", TAKES_FUNCTION, OWNER_COUNT},
};

static const char *const row_tags[] = {"position", "velocity", "acceleration"};

int fields_list_tags(const char **tags) {
    int count = 0;
    for (int i = 0; i < OWNER_COUNT; i++)
        if (owner_rules[i].tag)
            tags[count++] = owner_rules[i].tag;
    for (int i = 0; i < 3; i++)
        tags[count++] = row_tags[i];
    return count;
}

const char *fields_tag_form(const char *tag) {
    for (int i = 0; i < OWNER_COUNT; i++)
        if (owner_rules[i].tag && strcmp(owner_rules[i].tag, tag) == 0)
            return owner_rules[i].form;
    return "{ expression }"; /* rows */
}

bool fields_has_tag(const struct value *value, const char *tag) {
    return value->kind == VALUE_TABLE && value->tag && tag && strcmp(value->tag, tag) == 0;
}

const char *fields_path_name(const struct checker *checker, const char *path, const char *name) {
    return memory_format(checker->memory, "%s%s%s", path, *path ? "." : "", name);
}

const char *fields_path_item(const struct checker *checker, const char *path, int index) {
    return memory_format(checker->memory, "%s[%d]", path, index + 1);
}

void fields_refuse_name(const struct checker *checker, struct place place, const char *path, const char *fact,
                        const char *name, const char *const *known, int count) {
    message_error(checker->messages, place, "%s: %s%s", path, fact,
                  message_advice_on_name(checker->memory, name, known, count));
}

const struct value *given_field(const struct value *table, enum field field) {
    const struct field_rule *rule = &field_rules[field];
    const struct value *value = value_find_field(table, rule->name);
    if (!value && rule->item > 0 && rule->item <= table->item_count)
        value = &table->items[rule->item - 1];
    return value;
}

int item_room(enum owner owner) {
    int room = 0;
    for (int i = 0; i < FIELD_COUNT; i++)
        if (field_rules[i].owner == owner && field_rules[i].item > room)
            room = field_rules[i].item;
    return room;
}

int owner_names(enum owner owner, const char **names) {
    int count = 0;
    for (int i = 0; i < FIELD_COUNT; i++)
        if (field_rules[i].owner == owner)
            names[count++] = field_rules[i].name;
    return count;
}

/* The field of the owner nearest to an unknown name, or NULL. */
static const char *meant_field(enum owner owner, const char *name) {
    const char *known[FIELD_COUNT];
    const int count = owner_names(owner, known);
    return text_index(name, known, count) < 0 ? message_nearest_name(name, known, count) : NULL;
}

bool fields_is_misspelled(const struct value *table, enum owner owner, const char *name) {
    for (int i = 0; i < table->field_count; i++) {
        const char *meant = meant_field(owner, table->fields[i].name);
        if (meant && strcmp(meant, name) == 0)
            return true;
    }
    return false;
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

/* Rows of all three levels have the same fields. */
bool fields_is_made_for(const struct value *table, enum owner owner) {
    const char *tag = owner == OWNER_COUNT ? NULL : owner_rules[owner].tag;
    bool is_row = false;
    for (int i = 0; i < 3; i++)
        is_row = is_row || fields_has_tag(table, row_tags[i]);
    return !table->tag || fields_has_tag(table, tag) || (owner == OWNER_ROW && is_row);
}

bool is_empty_text(const struct value *value) {
    return value->kind == VALUE_TEXT && !*value->text;
}

bool is_made_otherwise(const struct value *value, enum field_type type) {
    return value->kind == VALUE_TABLE && !fields_is_made_for(value, type_rules[type].owner);
}

bool field_types_matches(const struct value *value, enum field_type type) {
    return type_rules[type].takes & 1u << value->kind && !(type == TYPE_TEXT && is_empty_text(value)) &&
           !is_made_otherwise(value, type);
}

const struct value *fields_get(const struct value *table, enum field field) {
    const struct value *value = given_field(table, field);
    return value && field_types_matches(value, field_rules[field].type) ? value : NULL;
}

const char *fields_made_text(const struct checker *checker, const struct value *value) {
    return value->tag ? memory_format(checker->memory, "made by rd.%s", value->tag)
                      : value_kind_text(value->kind);
}

bool fields_has(const struct value *table, enum field field) {
    return table && given_field(table, field);
}

expression fields_get_value(const struct checker *checker, const struct value *table, enum field field) {
    const struct value *value = fields_get(table, field);
    expression e = field_rules[field].need != NEED_OPTIONAL ? EXPR_ONE : EXPR_ZERO;
    if (value)
        value_expression(checker->graph, value, &e);
    return e;
}

void fields_get_vector(const struct checker *checker, const struct value *table, enum field field,
                       expression *vector) {
    const struct value *value = fields_get(table, field);
    for (int i = 0; i < 3; i++) {
        vector[i] = EXPR_ZERO;
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
