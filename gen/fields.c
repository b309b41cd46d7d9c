/* Checks that follow from the table of fields: see fields.h. */
#include "fields.h"

#include <math.h>
#include <string.h>

const struct field_rule field_rules[FIELD_COUNT] = {
#define FIELD(owner, name, item, type, need, range, unit, text) \
    {OWNER_##owner, #name, item, TYPE_##type, NEED_##need, RANGE_##range, unit, text},
#include "fields.def"
#undef FIELD
};

static const struct {
    const char *text, *tag;
} owners[] = {
#define OWNER(name, text, tag) {text, tag},
    OWNERS
#undef OWNER
};

const char *owner_text(enum owner owner) {
    return owners[owner].text;
}

const char *owner_tag(enum owner owner) {
    return owners[owner].tag;
}

int list_tags(const char **tags) {
    static const char *const rows[] = {"position", "velocity", "acceleration"};
    int count = 0;
    for (int i = 0; i < OWNER_COUNT; i++)
        if (owners[i].tag)
            tags[count++] = owners[i].tag;
    for (int i = 0; i < 3; i++)
        tags[count++] = rows[i];
    return count;
}

bool has_tag(const struct value *value, const char *tag) {
    return value->kind == VALUE_TABLE && value->tag && tag && strcmp(value->tag, tag) == 0;
}

static const char *type_text(enum field_type type) {
    static const char *const texts[] = {"a text",
                                        "a whole number",
                                        "a number or an expression of parameters",
                                        "a number or an expression",
                                        "a list of 3 numbers",
                                        "a list of { \"x\", angle }",
                                        "a list of names",
                                        "a table by joint such as { z = 1 }",
                                        "the name of a link or point or { on = ..., at = ... }",
                                        "an axis such as { \"arm\", \"z\" }",
                                        "\"x\", \"y\", \"z\" or a list of 3 numbers",
                                        "a list of 3 numbers or expressions",
                                        "a table",
                                        "a list of tables",
                                        "a function"};
    return texts[type];
}

const char *range_text(enum field_range range) {
    static const char *const texts[] = {"", "positive", "not below 0", "above -1, up to 0.5"};
    return texts[range];
}

const char *path_name(const struct checker *checker, const char *path, const char *name) {
    return memory_format(checker->memory, "%s%s%s", path, *path ? "." : "", name);
}

const char *path_item(const struct checker *checker, const char *path, int index) {
    return memory_format(checker->memory, "%s[%d]", path, index + 1);
}

void complain_of_name(const struct checker *checker, struct place place, const char *path, const char *fact,
                      const char *name, const char *const *known, int count) {
    const char *nearest = nearest_name(name, known, count);
    if (nearest) {
        complain(checker->messages, place, "%s: %s, the nearest known one is \"%s\"", path, fact, nearest);
        return;
    }
    const char *list = "";
    for (int i = 0; i < count; i++)
        list = memory_format(checker->memory, "%s %s", list, known[i]);
    complain(checker->messages, place, "%s: %s, known:%s", path, fact, count > 0 ? list : " none");
}

/* ---- one value ---- */

static bool is_of_parameters(const struct checker *checker, expression e) {
    return (checker->graph->nodes[e].depends & ~ON_PARAMETER) == 0;
}

void check_value(const struct checker *checker, const struct value *value, enum field_range range,
                 const char *path) {
    expression e;
    if (!value_expression(checker->graph, value, &e)) {
        complain(checker->messages, value->place, "%s: %s, a number or an expression is needed", path,
                 kind_text(value->kind));
        return;
    }
    if (!is_of_parameters(checker, e)) {
        complain(checker->messages, value->place,
                 "%s: depends on the motion, a number or an expression of parameters is needed", path);
        return;
    }
    double x = value_at_parameters(checker->graph, checker->declarations->parameters, e);
    if (!isfinite(x))
        complain(checker->messages, value->place, "%s: value %s, a finite number is needed", path,
                 isnan(x) ? "nan"
                 : x > 0  ? "inf"
                          : "-inf");
    else if (range == RANGE_POSITIVE && x <= 0)
        complain(checker->messages, value->place, "%s: value %.6g, a positive number is needed", path, x);
    else if (range == RANGE_NOT_NEGATIVE && x < 0)
        complain(checker->messages, value->place, "%s: value %.6g, a number not below 0 is needed", path, x);
    else if (range == RANGE_POISSON && !(x > -1 && x <= 0.5))
        complain(checker->messages, value->place, "%s: value %.6g, a number above -1 and up to 0.5 is needed",
                 path, x);
}

static bool has_three_items(const struct checker *checker, const struct value *value, const char *path) {
    if (value->item_count == 3 && value->field_count == 0)
        return true;
    complain(checker->messages, value->place, "%s: %d numbers, 3 are needed", path, value->item_count);
    return false;
}

static void check_vector(const struct checker *checker, const struct value *value, enum field_range range,
                         const char *path) {
    has_three_items(checker, value, path);
    for (int i = 0; i < value->item_count && i < 3; i++)
        check_value(checker, &value->items[i], range, path_item(checker, path, i));
}

static void check_free_vector(const struct checker *checker, const struct value *value, const char *path) {
    expression e;
    has_three_items(checker, value, path);
    for (int i = 0; i < value->item_count && i < 3; i++)
        if (!value_expression(checker->graph, &value->items[i], &e))
            complain(checker->messages, value->items[i].place, "%s: %s, a number or an expression is needed",
                     path_item(checker, path, i), kind_text(value->items[i].kind));
}

/* A direction has a length: one of its components is not 0. */
static void check_direction(const struct checker *checker, const struct value *value, const char *path) {
    double largest = 0;
    if (value->kind == VALUE_TEXT) {
        if (strlen(value->text) != 1 || !strchr("xyz", *value->text))
            complain(checker->messages, value->place, "%s: \"%s\" is no axis, x y z are", path, value->text);
        return;
    }
    check_vector(checker, value, RANGE_ANY, path);
    for (int i = 0; i < value->item_count; i++) {
        expression e;
        if (value_expression(checker->graph, &value->items[i], &e) && is_of_parameters(checker, e))
            largest = fmax(largest,
                           fabs(value_at_parameters(checker->graph, checker->declarations->parameters, e)));
    }
    if (value->item_count == 3 && largest == 0)
        complain(checker->messages, value->place, "%s: of length 0, a direction is needed", path);
}

/* More than a whole turn is hardly meant. */
static void warn_of_degrees(const struct checker *checker, const struct value *value, const char *path) {
    expression e;
    if (!value_expression(checker->graph, value, &e) || !is_of_parameters(checker, e))
        return;
    const double x = value_at_parameters(checker->graph, checker->declarations->parameters, e);
    if (fabs(x) > 6.3)
        warn(checker->messages, value->place,
             "%s: an angle of %.6g rad: in degrees? rd.pi / 180 makes radians of them", path, x);
}

static void check_turns(const struct checker *checker, const struct value *value, const char *path) {
    for (int i = 0; i < value->item_count; i++) {
        const struct value *turn = &value->items[i];
        const char *turn_path = path_item(checker, path, i);
        if (turn->kind != VALUE_TABLE || turn->item_count != 2 || turn->items[0].kind != VALUE_TEXT) {
            complain(checker->messages, turn->place, "%s: %s, { \"x\", angle } is needed", turn_path,
                     turn->kind == VALUE_TABLE ? "not of that form" : kind_text(turn->kind));
            continue;
        }
        const char *axis = turn->items[0].text;
        if (strlen(axis) != 1 || !strchr("xyz", *axis))
            complain(checker->messages, turn->place, "%s: \"%s\" is no axis, x y z are", turn_path, axis);
        check_value(checker, &turn->items[1], RANGE_ANY, turn_path);
        warn_of_degrees(checker, &turn->items[1], turn_path);
    }
}

static void check_names(const struct checker *checker, const struct value *value, const char *path) {
    for (int i = 0; i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TEXT)
            complain(checker->messages, value->items[i].place, "%s: %s, a text is needed",
                     path_item(checker, path, i), kind_text(value->items[i].kind));
}

static void check_by_joint(const struct checker *checker, const struct value *value, enum field_range range,
                           const char *path) {
    if (value->item_count > 0)
        complain(checker->messages, value->place, "%s: a list, a table by joint such as { z = 1 } is needed",
                 path);
    for (int i = 0; i < value->field_count; i++)
        check_value(checker, &value->fields[i].value, range, path_name(checker, path, value->fields[i].name));
}

static void check_list(const struct checker *checker, const struct value *value, const char *path) {
    for (int i = 0; i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TABLE)
            complain(checker->messages, value->items[i].place, "%s: %s, a table is needed",
                     path_item(checker, path, i), kind_text(value->items[i].kind));
    for (int i = 0; i < value->field_count; i++)
        complain(checker->messages, value->fields[i].value.place, "%s: a named entry, a list is needed",
                 path_name(checker, path, value->fields[i].name));
}

static void check_whole(const struct checker *checker, const struct value *value, const char *path) {
    enum { LARGEST = 10000 };
    if (!(value->number >= 1 && value->number <= LARGEST) || value->number != floor(value->number))
        complain(checker->messages, value->place, "%s: value %.6g, a whole number from 1 to %d is needed",
                 path, value->number, LARGEST);
}

static bool has_type(const struct value *value, enum field_type type) {
    switch (type) {
    case TYPE_TEXT:
        return value->kind == VALUE_TEXT;
    case TYPE_WHOLE:
        return value->kind == VALUE_NUMBER;
    case TYPE_VALUE:
    case TYPE_FREE:
        return value->kind == VALUE_NUMBER || value->kind == VALUE_EXPRESSION;
    case TYPE_NAMES:
    case TYPE_PLACE:
    case TYPE_DIRECTION:
        return value->kind == VALUE_TABLE || value->kind == VALUE_TEXT;
    case TYPE_FUNCTION:
        return value->kind == VALUE_FUNCTION;
    default:
        return value->kind == VALUE_TABLE;
    }
}

static void check_field(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    if (!has_type(value, rule->type)) {
        complain(checker->messages, value->place, "%s: %s, %s is needed", path, kind_text(value->kind),
                 type_text(rule->type));
        return;
    }
    switch (rule->type) {
    case TYPE_WHOLE:
        check_whole(checker, value, path);
        break;
    case TYPE_VALUE:
        check_value(checker, value, rule->range, path);
        break;
    case TYPE_VECTOR:
        check_vector(checker, value, rule->range, path);
        break;
    case TYPE_FREE_VECTOR:
        check_free_vector(checker, value, path);
        break;
    case TYPE_DIRECTION:
        check_direction(checker, value, path);
        break;
    case TYPE_AXIS:
        check_fields(checker, value, OWNER_AXIS, path);
        break;
    case TYPE_PLACE:
        if (value->kind == VALUE_TABLE)
            check_fields(checker, value, OWNER_POINT, path);
        break;
    case TYPE_TURNS:
        check_turns(checker, value, path);
        break;
    case TYPE_NAMES:
        check_names(checker, value, path);
        break;
    case TYPE_BY_JOINT:
        check_by_joint(checker, value, rule->range, path);
        break;
    case TYPE_LIST:
        check_list(checker, value, path);
        break;
    default:
        break;
    }
}

/* ---- all fields of a table ---- */

static const struct value *raw_field(const struct value *table, enum field field) {
    const struct field_rule *rule = &field_rules[field];
    const struct value *value = find_field(table, rule->name);
    if (!value && rule->item > 0 && rule->item <= table->item_count)
        value = &table->items[rule->item - 1];
    return value;
}

/* Names of the owner's fields; the number of fields that may stand without a name in `items`. */
static int owner_names(enum owner owner, const char **names, int *items) {
    int count = 0;
    *items = 0;
    for (int i = 0; i < FIELD_COUNT; i++) {
        if (field_rules[i].owner != owner)
            continue;
        names[count++] = field_rules[i].name;
        *items = field_rules[i].item > *items ? field_rules[i].item : *items;
    }
    return count;
}

static void check_unknown(const struct checker *checker, const struct value *table, enum owner owner,
                          const char *path) {
    const char *known[FIELD_COUNT];
    int items, count = owner_names(owner, known, &items);
    for (int i = 0; i < table->field_count; i++) {
        const char *name = table->fields[i].name;
        int at = 0;
        while (at < count && strcmp(known[at], name) != 0)
            at++;
        if (at == count)
            complain_of_name(checker, table->fields[i].value.place, path_name(checker, path, name),
                             "unknown field", name, known, count);
    }
    for (int i = items; i < table->item_count; i++)
        complain(checker->messages, table->items[i].place, "%s: %s without a name, a field is needed",
                 path_item(checker, path, i), kind_text(table->items[i].kind));
}

void check_fields(const struct checker *checker, const struct value *table, enum owner owner,
                  const char *path) {
    for (int i = 0; i < FIELD_COUNT; i++) {
        const struct field_rule *rule = &field_rules[i];
        if (rule->owner != owner)
            continue;
        const struct value *value = raw_field(table, (enum field)i);
        if (value)
            check_field(checker, value, rule, path_name(checker, path, rule->name));
        else if (rule->need == NEED_NEEDED)
            complain(checker->messages, table->place, "%s: missing, %s needs it",
                     path_name(checker, path, rule->name), owner_text(owner));
    }
    check_unknown(checker, table, owner, path);
}

const struct value *get_field(const struct value *table, enum field field) {
    const struct value *value = raw_field(table, field);
    return value && has_type(value, field_rules[field].type) ? value : NULL;
}

bool has_field(const struct value *table, enum field field) {
    return table && raw_field(table, field);
}

expression get_value(const struct checker *checker, const struct value *table, enum field field) {
    const struct value *value = get_field(table, field);
    expression e = field_rules[field].need != NEED_OPTIONAL ? one(checker->graph) : zero(checker->graph);
    if (value)
        value_expression(checker->graph, value, &e);
    return e;
}

void get_vector(const struct checker *checker, const struct value *table, enum field field,
                expression *vector) {
    const struct value *value = get_field(table, field);
    for (int i = 0; i < 3; i++) {
        vector[i] = zero(checker->graph);
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

int get_names(const struct checker *checker, const struct value *value, const char ***names) {
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
