/*
 * Checks of fields: each value by its type, then the table as a whole. Reads values and the rules of
 * fields.def; reports unknown, missing, doubled and ill-typed fields and numbers out of range.
 */
#include "gen/language/language.h"

#include <math.h>
#include <string.h>

typedef void check_value_of_type(const struct checker *checker, const struct value *value,
                                 const struct field_rule *rule, const char *path);

static check_value_of_type check_whole, check_plain_number, check_number, check_vector, check_values,
    check_turns, check_names, check_by_joint, check_tables_by_joint, check_direction, check_free_vector,
    check_free_by_name, check_points, check_list, check_drives;

/* Checks of a value in addition to its type. */
static check_value_of_type *const checks[TYPE_COUNT] = {
    [TYPE_WHOLE] = check_whole,
    [TYPE_NUMBER] = check_plain_number,
    [TYPE_VALUE] = check_number,
    [TYPE_VECTOR] = check_vector,
    [TYPE_VALUES] = check_values,
    [TYPE_TURNS] = check_turns,
    [TYPE_NAMES] = check_names,
    [TYPE_BY_JOINT] = check_by_joint,
    [TYPE_DIRECTION] = check_direction,
    [TYPE_ROTORS] = check_tables_by_joint,
    [TYPE_LIMITS] = check_tables_by_joint,
    [TYPE_FREE_VECTOR] = check_free_vector,
    [TYPE_FREE_TURNS] = check_turns,
    [TYPE_FREE_BY_NAME] = check_free_by_name,
    [TYPE_POINTS] = check_points,
    [TYPE_LIST] = check_list,
    [TYPE_DRIVES] = check_drives,
};

/* Reports a value that is not of the needed kind. A gap in a list has been reported before. */
static void refuse_kind(const struct checker *checker, const struct value *value, const char *path,
                        const char *needed) {
    if (value->kind != VALUE_NOTHING)
        message_error(checker->messages, value->place, "%s: %s; must be %s", path,
                      is_empty_text(value) ? "an empty text" : value_kind_text(value->kind), needed);
}

static void check_field(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    const enum owner owner = type_rules[rule->type].owner;
    if (is_made_otherwise(value, rule->type))
        message_error(checker->messages, value->place, "%s: made by rd.%s; must be %s", path, value->tag,
                      type_rules[rule->type].text);
    else if (!field_types_matches(value, rule->type))
        refuse_kind(checker, value, path, type_rules[rule->type].text);
    else if (value->kind == VALUE_TABLE && owner != OWNER_COUNT)
        fields_check(checker, value, owner, path);
    else if (checks[rule->type])
        checks[rule->type](checker, value, rule, path);
}

/* ---- lists without names, names without items ---- */

/* The names of the first `count` fields of a table. */
static const char *field_names_text(const struct checker *checker, const struct value *table, int count) {
    const char **names = memory_get(checker->memory, ((size_t)count + 1) * sizeof *names);
    for (int i = 0; i < count; i++)
        names[i] = table->fields[i].name;
    return message_names(checker->memory, names, count);
}

bool field_types_has_no_names(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed) {
    if (value->field_count > 0)
        message_error(checker->messages, value->fields[0].value.place,
                      "%s: has named entries (%s); must be %s", path,
                      field_names_text(checker, value, value->field_count), needed);
    return value->field_count == 0;
}

/* ` ("a", "b")` of a list of texts; "" if an item is of another kind. */
static const char *texts_of_items(const struct checker *checker, const struct value *list) {
    enum { MOST_SHOWN = 3 };
    const char *text = "";
    for (int i = 0; i < list->item_count; i++) {
        if (list->items[i].kind != VALUE_TEXT)
            return "";
        if (i < MOST_SHOWN)
            text = memory_format(checker->memory, "%s%s\"%s\"", text, i ? ", " : "", list->items[i].text);
    }
    return memory_format(checker->memory, " (%s%s)", text, list->item_count > MOST_SHOWN ? " ..." : "");
}

bool field_types_has_no_items(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed) {
    if (value->item_count > 0)
        message_error(checker->messages, value->items[0].place,
                      "%s: has entries without a name%s; must be %s", path, texts_of_items(checker, value),
                      needed);
    return value->item_count == 0;
}

/* ---- numbers ---- */

static bool is_of_parameters(const struct checker *checker, expression e) {
    return (checker->graph->nodes[e].depends & ~ON_PARAMETER) == 0;
}

static void require(const struct checker *checker, struct requirement requirement, const char *path,
                    struct place place) {
    requirement.path = path;
    requirement.place = place;
    const char *fault = declarations_require(checker->declarations, requirement);
    if (fault)
        message_error(checker->messages, requirement.place, "%s", fault);
}

/* The value must be a number or an expression in parameters alone, within its range. */
static void check_value(const struct checker *checker, const struct value *value, enum number_range range,
                        const char *path) {
    expression e;
    if (!value_expression(checker->graph, value, &e)) {
        refuse_kind(checker, value, path, "a number or an expression");
        return;
    }
    if (!is_of_parameters(checker, e)) {
        message_error(checker->messages, value->place,
                      "%s: depends on the motion; must be a number or an expression in parameters", path);
        return;
    }
    require(checker, requirement_field(range, e), path, value->place);
}

static void check_number(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    check_value(checker, value, rule->range, path);
}

/* The value must be a plain number, not an expression. */
static void check_plain_number(const struct checker *checker, const struct value *value,
                               const struct field_rule *rule, const char *path) {
    const char *fault = requirement_fault(checker->memory, rule->range, value->number);
    if (fault)
        message_error(checker->messages, value->place, "%s: %s", path, fault);
}

static void check_whole(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    enum { LARGEST = 10000 };
    (void)rule;
    if (!(value->number >= 1 && value->number <= LARGEST) || value->number != floor(value->number))
        message_error(checker->messages, value->place, "%s: value %.6g; must be a whole number from 1 to %d",
                      path, value->number, LARGEST);
}

/* ---- vectors ---- */

static bool has_three_items(const struct checker *checker, const struct value *value, const char *path,
                            enum field_type type) {
    if (!field_types_has_no_names(checker, value, path, type_rules[type].text))
        return false;
    if (value->item_count != 3)
        message_error(checker->messages, value->place, "%s: %d numbers; must have 3%s", path,
                      value->item_count, value->item_count > 3 ? ", with decimal points" : "");
    return value->item_count == 3;
}

static void check_vector(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    if (!has_three_items(checker, value, path, TYPE_VECTOR))
        return;
    for (int i = 0; i < 3; i++)
        check_value(checker, &value->items[i], rule->range, fields_path_item(checker, path, i));
}

static void check_values(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    if (field_types_has_no_names(checker, value, path, type_rules[TYPE_VALUES].text))
        for (int i = 0; i < value->item_count; i++)
            check_value(checker, &value->items[i], rule->range, fields_path_item(checker, path, i));
}

static void check_free_vector(const struct checker *checker, const struct value *value,
                              const struct field_rule *rule, const char *path) {
    expression e;
    (void)rule;
    if (!has_three_items(checker, value, path, TYPE_FREE_VECTOR))
        return;
    for (int i = 0; i < 3; i++)
        if (!value_expression(checker->graph, &value->items[i], &e))
            refuse_kind(checker, &value->items[i], fields_path_item(checker, path, i),
                        "a number or an expression");
}

/* A direction has a component that is not 0. */
static void check_direction(const struct checker *checker, const struct value *value,
                            const struct field_rule *rule, const char *path) {
    expression components[3];
    if (value->kind == VALUE_TEXT) {
        if (strlen(value->text) != 1 || !strchr("xyz", *value->text))
            message_error(checker->messages, value->place, "%s: \"%s\" is not an axis; use x, y or z", path,
                          value->text);
        return;
    }
    check_vector(checker, value, rule, path);
    if (value->item_count != 3)
        return;
    for (int i = 0; i < 3; i++)
        if (!value_expression(checker->graph, &value->items[i], &components[i]) ||
            !is_of_parameters(checker, components[i]))
            return; /* reported by check_vector */
    require(checker, requirement_direction(components), path, value->place);
}

/* ---- turns ---- */

/* An author hardly means an angle of more than a whole turn. */
static void warn_of_degrees(const struct checker *checker, const struct value *value, const char *path) {
    expression e;
    if (!value_expression(checker->graph, value, &e) || !is_of_parameters(checker, e))
        return;
    const double x = parameters_evaluate(checker->graph, checker->declarations->parameters, e);
    if (fabs(x) > 6.3)
        message_warning(checker->messages, value->place,
                        "%s: angle of %.6g rad; if it is in degrees, multiply by rd.pi / 180", path, x);
}

static void check_angle(const struct checker *checker, const struct value *angle, bool is_free,
                        const char *path) {
    expression e;
    if (is_free && value_expression(checker->graph, angle, &e))
        return;
    check_value(checker, angle, RANGE_ANY, path);
    warn_of_degrees(checker, angle, path);
}

static void check_turn(const struct checker *checker, const struct value *turn, bool is_free,
                       const char *path) {
    if (turn->kind != VALUE_TABLE) {
        refuse_kind(checker, turn, path, "{ \"x\", angle }");
        return;
    }
    if (turn->item_count != 2 || turn->field_count > 0 || turn->items[0].kind != VALUE_TEXT) {
        message_error(checker->messages, turn->place, "%s: not a turn; must be { \"x\", angle }", path);
        return;
    }
    const char *axis = turn->items[0].text;
    if (strlen(axis) != 1 || !strchr("xyz", *axis))
        message_error(checker->messages, turn->place, "%s: \"%s\" is not an axis; use x, y or z", path, axis);
    check_angle(checker, &turn->items[1], is_free, path);
}

static void check_turns(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    if (!field_types_has_no_names(checker, value, path, type_rules[rule->type].text))
        return;
    if (value->item_count > 0 && value->items[0].kind == VALUE_TEXT) {
        message_error(checker->messages, value->place, "%s: a single turn; must be %s", path,
                      type_rules[rule->type].text);
        return;
    }
    for (int i = 0; i < value->item_count; i++)
        check_turn(checker, &value->items[i], rule->type == TYPE_FREE_TURNS,
                   fields_path_item(checker, path, i));
}

/* ---- names ---- */

/* Whether a name is missing before, between or after the commas of a text. */
static bool has_empty_name(const char *text) {
    if (!strchr(text, ','))
        return false;
    for (; text; text = strchr(text, ',')) {
        text += *text == ',';
        if (strchr(",", text[strspn(text, " ")])) /* also true at the end of the text */
            return true;
    }
    return false;
}

static void check_names(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    const char **names;
    if (value->kind == VALUE_TEXT && has_empty_name(value->text))
        message_error(checker->messages, value->place,
                      "%s: \"%s\" has an empty name; write names with commas between them", path,
                      value->text);
    if (value->kind == VALUE_TABLE &&
        !field_types_has_no_names(checker, value, path, type_rules[rule->type].text))
        return;
    for (int i = 0; i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TEXT)
            refuse_kind(checker, &value->items[i], fields_path_item(checker, path, i), "a text");
    const int count = fields_get_names(checker, value, &names);
    for (int i = 0; i < count; i++) {
        int first = 0;
        while (strcmp(names[first], names[i]) != 0)
            first++;
        if (first < i)
            message_error(checker->messages, value->kind == VALUE_TEXT ? value->place : value->items[i].place,
                          "%s: \"%s\" is given twice; give it once", fields_path_item(checker, path, i),
                          names[i]);
    }
}

/* ---- tables and lists ---- */

static void check_by_joint(const struct checker *checker, const struct value *value,
                           const struct field_rule *rule, const char *path) {
    field_types_has_no_items(checker, value, path, type_rules[rule->type].text);
    for (int i = 0; i < value->field_count; i++)
        check_value(checker, &value->fields[i].value, rule->range,
                    fields_path_name(checker, path, value->fields[i].name));
}

static void check_tables_by_joint(const struct checker *checker, const struct value *value,
                                  const struct field_rule *rule, const char *path) {
    const enum owner owner = rule->type == TYPE_ROTORS ? OWNER_ROTOR : OWNER_LIMITS;
    field_types_has_no_items(checker, value, path, type_rules[rule->type].text);
    for (int i = 0; i < value->field_count; i++) {
        const struct value *table = &value->fields[i].value;
        const char *own_path = fields_path_name(checker, path, value->fields[i].name);
        if (table->kind == VALUE_TABLE)
            fields_check(checker, table, owner, own_path);
        else
            refuse_kind(checker, table, own_path, owner_rules[owner].form);
    }
}

static void check_free_by_name(const struct checker *checker, const struct value *value,
                               const struct field_rule *rule, const char *path) {
    expression e;
    field_types_has_no_items(checker, value, path, type_rules[rule->type].text);
    for (int i = 0; i < value->field_count; i++)
        if (!value_expression(checker->graph, &value->fields[i].value, &e))
            refuse_kind(checker, &value->fields[i].value,
                        fields_path_name(checker, path, value->fields[i].name), "a number or an expression");
}

/* Each is a place, which must not name another point. */
static void check_points(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    field_types_has_no_items(checker, value, path, type_rules[rule->type].text);
    for (int i = 0; i < value->field_count; i++) {
        const struct value *place = &value->fields[i].value;
        const char *own_path = fields_path_name(checker, path, value->fields[i].name);
        if (place->kind == VALUE_TABLE)
            fields_check(checker, place, OWNER_POINT, own_path);
        else if (place->kind != VALUE_TEXT)
            refuse_kind(checker, place, own_path, "the name of a link, or { on = ..., at = ... }");
    }
}

static void check_list(const struct checker *checker, const struct value *value,
                       const struct field_rule *rule, const char *path) {
    field_types_has_no_names(checker, value, path, type_rules[rule->type].text);
    for (int i = 0; i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TABLE)
            refuse_kind(checker, &value->items[i], fields_path_item(checker, path, i), "a table");
}

static void check_drives(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    field_types_has_no_names(checker, value, path, type_rules[rule->type].text);
    for (int i = 0; i < value->item_count; i++) {
        const struct value *item = &value->items[i];
        if (item->kind == VALUE_TABLE)
            fields_check(checker, item, OWNER_EFFORT, fields_path_item(checker, path, i));
        else if (item->kind != VALUE_TEXT || is_empty_text(item))
            refuse_kind(checker, item, fields_path_item(checker, path, i),
                        "a coordinate, or { \"arm_psi\", limit = 100 }");
    }
}

/* ---- all fields of a table ---- */

/* An example of such a table, with the function of the module that has made this one. */
static const char *form_of(const struct checker *checker, const struct value *table, enum owner owner) {
    const char *form = owner_rules[owner].form;
    return table->tag ? memory_format(checker->memory, "rd.%s %s", table->tag, form) : form;
}

static void check_unknown(const struct checker *checker, const struct value *table, enum owner owner,
                          const char *path) {
    const char *known[FIELD_COUNT];
    const int items = item_room(owner), count = owner_names(owner, known);
    for (int i = 0; i < table->field_count; i++) {
        const char *name = table->fields[i].name;
        if (text_index(name, known, count) < 0)
            fields_refuse_name(checker, table->fields[i].value.place, fields_path_name(checker, path, name),
                               "unknown field", name, known, count);
    }
    if (items < table->item_count && table->items[items].kind != VALUE_NOTHING)
        message_error(checker->messages, table->items[items].place, "%s: %s without a name; write %s",
                      fields_path_item(checker, path, items), value_kind_text(table->items[items].kind),
                      form_of(checker, table, owner));
}

/* Reports a field that is given by name and as an item, since one of them would have no effect. */
static void check_doubles(const struct checker *checker, const struct value *table,
                          const struct field_rule *rule, const char *path) {
    const struct value *named = value_find_field(table, rule->name);
    if (named && rule->item > 0 && rule->item <= table->item_count &&
        table->items[rule->item - 1].kind != VALUE_NOTHING)
        message_error(checker->messages, named->place, "%s: given by name and as item %d; give it once", path,
                      rule->item);
}

/* Fields that have no meaning without another field. */
static const struct {
    enum field field, other;
} pairs[] = {{FIELD_LINK_rest, FIELD_LINK_spring},
             {FIELD_LINK_center, FIELD_LINK_mass},
             {FIELD_LINK_inertia, FIELD_LINK_mass},
             {FIELD_LINK_along, FIELD_LINK_on},
             {FIELD_LINK_axis, FIELD_LINK_joint},
             {FIELD_DAMPING_mode, FIELD_DAMPING_ratio},
             {FIELD_DAMPING_tip_mass, FIELD_DAMPING_ratio},
             {FIELD_DAMPING_frequency, FIELD_DAMPING_ratio},
             {FIELD_EFFORT_from, FIELD_EFFORT_to},
             {FIELD_EFFORT_to, FIELD_EFFORT_from},
             {FIELD_TIMING_acceleration, FIELD_TIMING_rate},
             {FIELD_TIMING_jerk, FIELD_TIMING_rate},
             {FIELD_TIMING_degree, FIELD_TIMING_knots}};

static void check_pairs(const struct checker *checker, const struct value *table, enum owner owner,
                        const char *path) {
    enum field told = FIELD_COUNT; /* reported as missing, which one message does */
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        const char *other = field_rules[pairs[i].other].name;
        const struct value *value = given_field(table, pairs[i].field);
        if (field_rules[pairs[i].field].owner != owner || !value || given_field(table, pairs[i].other) ||
            pairs[i].other == told || fields_is_misspelled(table, owner, other))
            continue;
        told = pairs[i].other;
        message_error(checker->messages, value->place, "%s: has no effect without %s; add %s",
                      fields_path_name(checker, path, field_rules[pairs[i].field].name), other, other);
    }
}

static void refuse_stranger(const struct checker *checker, const struct value *table, enum owner owner,
                            const char *path) {
    enum { MOST_SHOWN = 5 };
    const char *names =
        field_names_text(checker, table, table->field_count < MOST_SHOWN ? table->field_count : MOST_SHOWN);
    message_error(checker->messages, table->place, "%s: has no field of %s%s%s%s; write %s", path,
                  owner_rules[owner].text, *names ? " (has " : "", names, *names ? ")" : "",
                  form_of(checker, table, owner));
}

void fields_check(const struct checker *checker, const struct value *table, enum owner owner,
                  const char *path) {
    if (!fields_is_made_for(table, owner)) {
        message_error(checker->messages, table->place, "%s: made by rd.%s; must be %s such as %s", path,
                      table->tag, owner_rules[owner].text, owner_rules[owner].form);
        return;
    }
    if (fields_is_stranger(table, owner)) {
        refuse_stranger(checker, table, owner, path);
        return;
    }
    const bool has_stray = table->item_count > item_room(owner); /* possibly the missing field */
    for (int i = 0; i < FIELD_COUNT; i++) {
        const struct field_rule *rule = &field_rules[i];
        if (rule->owner != owner)
            continue;
        const struct value *value = given_field(table, (enum field)i);
        const char *own_path = fields_path_name(checker, path, rule->name);
        check_doubles(checker, table, rule, own_path);
        if (value)
            check_field(checker, value, rule, own_path);
        else if (rule->need == NEED_NEEDED && !has_stray && !fields_is_misspelled(table, owner, rule->name))
            message_error(checker->messages, table->place, "%s: missing; %s needs it", own_path,
                          owner_rules[owner].text);
    }
    check_pairs(checker, table, owner, path);
    check_unknown(checker, table, owner, path);
}
