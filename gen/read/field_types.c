/* Checks of one value by its type: see fields.h. One table says what each type takes. */
#include "read/field_types.h"
#include "base/text.h"

#include <math.h>
#include <string.h>

enum {
    TAKES_NUMBER = 1 << VALUE_NUMBER,
    TAKES_VALUE = 1 << VALUE_NUMBER | 1 << VALUE_EXPRESSION,
    TAKES_TEXT = 1 << VALUE_TEXT,
    TAKES_TABLE = 1 << VALUE_TABLE,
    TAKES_FUNCTION = 1 << VALUE_FUNCTION
};

typedef void check_value_of_type(const struct checker *checker, const struct value *value,
                                 const struct field_rule *rule, const char *path);

static check_value_of_type check_whole, check_number, check_vector, check_turns, check_names, check_by_joint,
    check_direction, check_free_vector, check_points, check_list;

/* `owner`: of a table of that type, OWNER_COUNT for none; `check`: what is to be said of it beside, or NULL.
 */
static const struct {
    const char *text;
    unsigned takes;
    enum owner owner;
    check_value_of_type *check;
} types[TYPE_COUNT] = {
    [TYPE_TEXT] = {"a text", TAKES_TEXT, OWNER_COUNT, NULL},
    [TYPE_WHOLE] = {"a whole number", TAKES_NUMBER, OWNER_COUNT, check_whole},
    [TYPE_VALUE] = {"a number or an expression of parameters", TAKES_VALUE, OWNER_COUNT, check_number},
    [TYPE_FREE] = {"a number or an expression", TAKES_VALUE, OWNER_COUNT, NULL},
    [TYPE_VECTOR] = {"a list of 3 numbers such as { 0, 0, 1 }", TAKES_TABLE, OWNER_COUNT, check_vector},
    [TYPE_TURNS] = {"a list of turns such as { { \"x\", 1.57 } }", TAKES_TABLE, OWNER_COUNT, check_turns},
    [TYPE_NAMES] = {"a list of names such as { \"a\", \"b\" }", TAKES_TEXT | TAKES_TABLE, OWNER_COUNT,
                    check_names},
    [TYPE_BY_JOINT] = {"a table by joint such as { z = 1 }", TAKES_TABLE, OWNER_COUNT, check_by_joint},
    [TYPE_PLACE] = {"the name of a link or point or { on = ..., at = ... }", TAKES_TEXT | TAKES_TABLE,
                    OWNER_POINT, NULL},
    [TYPE_AXIS] = {"an axis such as { \"arm\", \"z\" }", TAKES_TABLE, OWNER_AXIS, NULL},
    [TYPE_INERTIA] = {"an inertia such as { zz = 0.05 }", TAKES_TABLE, OWNER_INERTIA, NULL},
    [TYPE_BEAM] = {"a beam such as { length = 1, section = rd.round(0.014), ... }", TAKES_TABLE, OWNER_BEAM,
                   NULL},
    [TYPE_SECTION] = {"a section such as rd.round(0.014)", TAKES_TABLE, OWNER_SECTION, NULL},
    [TYPE_DAMPING] = {"a damping such as { ratio = 0.01 }", TAKES_TABLE, OWNER_DAMPING, NULL},
    [TYPE_CURVATURE] = {"a curvature such as { psi = 0.1 }", TAKES_TABLE, OWNER_CURVATURE, NULL},
    [TYPE_DIRECTION] = {"\"x\", \"y\", \"z\" or a list of 3 numbers such as { 0, 0, 1 }",
                        TAKES_TEXT | TAKES_TABLE, OWNER_COUNT, check_direction},
    [TYPE_FREE_VECTOR] = {"a list of 3 numbers or expressions such as { 0, 0, 1 }", TAKES_TABLE, OWNER_COUNT,
                          check_free_vector},
    [TYPE_POINTS] = {"a table of points such as { E = \"arm\" }", TAKES_TABLE, OWNER_COUNT, check_points},
    [TYPE_LIST] = {"a list of tables", TAKES_TABLE, OWNER_COUNT, check_list},
    [TYPE_FUNCTION] = {"a function", TAKES_FUNCTION, OWNER_COUNT, NULL},
};

static bool is_empty_text(const struct value *value) {
    return value->kind == VALUE_TEXT && !*value->text;
}

static bool is_made_otherwise(const struct value *value, enum field_type type) {
    return value->kind == VALUE_TABLE && !fields_is_made_for(value, types[type].owner);
}

bool field_types_matches(const struct value *value, enum field_type type) {
    return types[type].takes & 1u << value->kind && !(type == TYPE_TEXT && is_empty_text(value)) &&
           !is_made_otherwise(value, type);
}

void field_types_refuse_kind(const struct checker *checker, const struct value *value, const char *path,
                             const char *needed) {
    if (value->kind != VALUE_NOTHING)
        message_error(checker->messages, value->place, "%s: %s, %s is needed", path,
                      is_empty_text(value) ? "an empty text" : value_kind_text(value->kind), needed);
}

void field_types_check(const struct checker *checker, const struct value *value,
                       const struct field_rule *rule, const char *path) {
    const enum owner owner = types[rule->type].owner;
    if (is_made_otherwise(value, rule->type))
        message_error(checker->messages, value->place, "%s: made by rd.%s, %s is needed", path, value->tag,
                      types[rule->type].text);
    else if (!field_types_matches(value, rule->type))
        field_types_refuse_kind(checker, value, path, types[rule->type].text);
    else if (value->kind == VALUE_TABLE && owner != OWNER_COUNT)
        fields_check(checker, value, owner, path);
    else if (types[rule->type].check)
        types[rule->type].check(checker, value, rule, path);
}

/* ---- lists without names, names without items ---- */

bool field_types_has_no_names(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed) {
    const char *names = "";
    for (int i = 0; i < value->field_count; i++)
        names = memory_format(checker->memory, "%s%s%s", names, i ? " " : "", value->fields[i].name);
    if (value->field_count > 0)
        message_error(checker->messages, value->fields[0].value.place,
                      "%s: has named entries (%s), %s is needed", path, names, needed);
    return value->field_count == 0;
}

bool field_types_has_no_items(const struct checker *checker, const struct value *value, const char *path,
                              const char *needed) {
    if (value->item_count > 0)
        message_error(checker->messages, value->items[0].place,
                      "%s: has entries without a name, %s is needed", path, needed);
    return value->item_count == 0;
}

/* ---- numbers ---- */

static bool is_of_parameters(const struct checker *checker, expression e) {
    return (checker->graph->nodes[e].depends & ~ON_PARAMETER) == 0;
}

void field_types_check_value(const struct checker *checker, const struct value *value, enum field_range range,
                             const char *path) {
    expression e;
    if (!value_expression(checker->graph, value, &e)) {
        field_types_refuse_kind(checker, value, path, "a number or an expression");
        return;
    }
    if (!is_of_parameters(checker, e)) {
        message_error(checker->messages, value->place,
                      "%s: depends on the motion, a number or an expression of parameters is needed", path);
        return;
    }
    double x = parameters_evaluate(checker->graph, checker->declarations->parameters, e);
    if (!isfinite(x))
        message_error(checker->messages, value->place, "%s: value %s, a finite number is needed", path,
                      text_not_finite(x));
    else if (range == RANGE_POSITIVE && x <= 0)
        message_error(checker->messages, value->place, "%s: value %.6g, a positive number is needed", path,
                      x);
    else if (range == RANGE_NOT_NEGATIVE && x < 0)
        message_error(checker->messages, value->place, "%s: value %.6g, a number not below 0 is needed", path,
                      x);
    else if (range == RANGE_POISSON && !(x > -1 && x <= 0.5))
        message_error(checker->messages, value->place,
                      "%s: value %.6g, a number above -1 and up to 0.5 is needed", path, x);
}

static void check_number(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    field_types_check_value(checker, value, rule->range, path);
}

static void check_whole(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    enum { LARGEST = 10000 };
    (void)rule;
    if (!(value->number >= 1 && value->number <= LARGEST) || value->number != floor(value->number))
        message_error(checker->messages, value->place,
                      "%s: value %.6g, a whole number from 1 to %d is needed", path, value->number, LARGEST);
}

/* ---- vectors ---- */

static bool has_three_items(const struct checker *checker, const struct value *value, const char *path,
                            enum field_type type) {
    if (!field_types_has_no_names(checker, value, path, types[type].text))
        return false;
    if (value->item_count != 3)
        message_error(checker->messages, value->place, "%s: %d numbers, 3 are needed", path,
                      value->item_count);
    return value->item_count == 3;
}

static void check_vector(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    if (!has_three_items(checker, value, path, TYPE_VECTOR))
        return;
    for (int i = 0; i < 3; i++)
        field_types_check_value(checker, &value->items[i], rule->range, fields_path_item(checker, path, i));
}

static void check_free_vector(const struct checker *checker, const struct value *value,
                              const struct field_rule *rule, const char *path) {
    expression e;
    (void)rule;
    if (!has_three_items(checker, value, path, TYPE_FREE_VECTOR))
        return;
    for (int i = 0; i < 3; i++)
        if (!value_expression(checker->graph, &value->items[i], &e))
            field_types_refuse_kind(checker, &value->items[i], fields_path_item(checker, path, i),
                                    "a number or an expression");
}

static double size_of(const struct checker *checker, const struct value *value) {
    expression e;
    if (!value_expression(checker->graph, value, &e) || !is_of_parameters(checker, e))
        return INFINITY; /* said already */
    return fabs(parameters_evaluate(checker->graph, checker->declarations->parameters, e));
}

/* A direction has a length: one of its components is not 0. */
static void check_direction(const struct checker *checker, const struct value *value,
                            const struct field_rule *rule, const char *path) {
    double largest = 0;
    if (value->kind == VALUE_TEXT) {
        if (strlen(value->text) != 1 || !strchr("xyz", *value->text))
            message_error(checker->messages, value->place, "%s: \"%s\" is no axis, x y z are", path,
                          value->text);
        return;
    }
    check_vector(checker, value, rule, path);
    for (int i = 0; i < value->item_count; i++)
        largest = fmax(largest, size_of(checker, &value->items[i]));
    if (value->item_count == 3 && largest == 0)
        message_error(checker->messages, value->place, "%s: of length 0, a direction is needed", path);
}

/* ---- turns ---- */

/* More than a whole turn is hardly meant. */
static void warn_of_degrees(const struct checker *checker, const struct value *value, const char *path) {
    expression e;
    if (!value_expression(checker->graph, value, &e) || !is_of_parameters(checker, e))
        return;
    const double x = parameters_evaluate(checker->graph, checker->declarations->parameters, e);
    if (fabs(x) > 6.3)
        message_warning(checker->messages, value->place,
                        "%s: an angle of %.6g rad: in degrees? rd.pi / 180 makes radians of them", path, x);
}

static void check_turn(const struct checker *checker, const struct value *turn, const char *path) {
    if (turn->kind != VALUE_TABLE) {
        field_types_refuse_kind(checker, turn, path, "{ \"x\", angle }");
        return;
    }
    if (turn->item_count != 2 || turn->field_count > 0 || turn->items[0].kind != VALUE_TEXT) {
        message_error(checker->messages, turn->place, "%s: not of that form, { \"x\", angle } is needed",
                      path);
        return;
    }
    const char *axis = turn->items[0].text;
    if (strlen(axis) != 1 || !strchr("xyz", *axis))
        message_error(checker->messages, turn->place, "%s: \"%s\" is no axis, x y z are", path, axis);
    field_types_check_value(checker, &turn->items[1], RANGE_ANY, path);
    warn_of_degrees(checker, &turn->items[1], path);
}

static void check_turns(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    if (!field_types_has_no_names(checker, value, path, types[rule->type].text))
        return;
    if (value->item_count > 0 && value->items[0].kind == VALUE_TEXT) {
        message_error(checker->messages, value->place, "%s: one turn by itself, %s is needed", path,
                      types[rule->type].text);
        return;
    }
    for (int i = 0; i < value->item_count; i++)
        check_turn(checker, &value->items[i], fields_path_item(checker, path, i));
}

/* ---- names ---- */

/* Between two commas, and before and behind them, stands a name. */
static bool has_empty_name(const char *text) {
    if (!strchr(text, ','))
        return false;
    for (; text; text = strchr(text, ',')) {
        text += *text == ',';
        if (strchr(",", text[strspn(text, " ")])) /* the end of the text, too */
            return true;
    }
    return false;
}

static void check_names(const struct checker *checker, const struct value *value,
                        const struct field_rule *rule, const char *path) {
    const char **names;
    if (value->kind == VALUE_TEXT && has_empty_name(value->text))
        message_error(checker->messages, value->place,
                      "%s: \"%s\" has an empty name, names between commas are needed", path, value->text);
    if (value->kind == VALUE_TABLE && !field_types_has_no_names(checker, value, path, types[rule->type].text))
        return;
    for (int i = 0; i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TEXT)
            field_types_refuse_kind(checker, &value->items[i], fields_path_item(checker, path, i), "a text");
    const int count = fields_get_names(checker, value, &names);
    for (int i = 0; i < count; i++) {
        int first = 0;
        while (strcmp(names[first], names[i]) != 0)
            first++;
        if (first < i)
            message_error(checker->messages, value->kind == VALUE_TEXT ? value->place : value->items[i].place,
                          "%s: \"%s\" is there twice, once is enough", fields_path_item(checker, path, i),
                          names[i]);
    }
}

/* ---- tables and lists ---- */

static void check_by_joint(const struct checker *checker, const struct value *value,
                           const struct field_rule *rule, const char *path) {
    field_types_has_no_items(checker, value, path, types[rule->type].text);
    for (int i = 0; i < value->field_count; i++)
        field_types_check_value(checker, &value->fields[i].value, rule->range,
                                fields_path_name(checker, path, value->fields[i].name));
}

/* Each is a place, which may name no other point. */
static void check_points(const struct checker *checker, const struct value *value,
                         const struct field_rule *rule, const char *path) {
    field_types_has_no_items(checker, value, path, types[rule->type].text);
    for (int i = 0; i < value->field_count; i++) {
        const struct value *place = &value->fields[i].value;
        const char *own_path = fields_path_name(checker, path, value->fields[i].name);
        if (place->kind == VALUE_TABLE)
            fields_check(checker, place, OWNER_POINT, own_path);
        else if (place->kind != VALUE_TEXT)
            field_types_refuse_kind(checker, place, own_path, "the name of a link or { on = ..., at = ... }");
    }
}

static void check_list(const struct checker *checker, const struct value *value,
                       const struct field_rule *rule, const char *path) {
    field_types_has_no_names(checker, value, path, types[rule->type].text);
    for (int i = 0; i < value->item_count; i++)
        if (value->items[i].kind != VALUE_TABLE)
            field_types_refuse_kind(checker, &value->items[i], fields_path_item(checker, path, i), "a table");
}
