/*
 * Reads what the author's function `events` returns: expressions that cross zero, and what happens then.
 * Fills the model's events and changes.
 */
#include "gen/model_file/reader.h"

#include <string.h>

/* ---- what an event changes ---- */

/* A table of an event or of a sample: what it changes, and the names that may be in it. */
struct changed_kind {
    enum owner owner;
    enum field field;
    enum changed what;
    const char *noun;
    const char **(*names)(const struct reader *reader, int *count);
};

static const char **coordinate_names(const struct reader *reader, int *count) {
    *count = tree_joint_count(reader->tree);
    return tree_coordinate_names(reader->check.memory, reader->tree);
}

static const char **state_names(const struct reader *reader, int *count) {
    const int joints = tree_joint_count(reader->tree);
    *count = reader->tree->count - joints;
    return tree_coordinate_names(reader->check.memory, reader->tree) + joints;
}

static const char **input_names(const struct reader *reader, int *count) {
    const struct declarations *declarations = reader->check.declarations;
    const char **names =
        memory_get(reader->check.memory, ((size_t)declarations->input_count + 1) * sizeof *names);
    for (int i = 0; i < declarations->input_count; i++)
        names[i] = declarations->inputs[i].name;
    *count = declarations->input_count;
    return names;
}

static const char **parameter_names(const struct reader *reader, int *count) {
    const struct declarations *declarations = reader->check.declarations;
    const char **names =
        memory_get(reader->check.memory, ((size_t)declarations->parameter_count + 1) * sizeof *names);
    for (int i = 0; i < declarations->parameter_count; i++)
        names[i] = declarations->parameters[i].name;
    *count = declarations->parameter_count;
    return names;
}

static const struct changed_kind changed_kinds[] = {
    {OWNER_EVENT, FIELD_EVENT_rates, CHANGED_RATE, "coordinate", coordinate_names},
    {OWNER_EVENT, FIELD_EVENT_states, CHANGED_RATE, "state", state_names},
    {OWNER_EVENT, FIELD_EVENT_inputs, CHANGED_INPUT, "input", input_names},
    {OWNER_EVENT, FIELD_EVENT_parameters, CHANGED_PARAMETER, "parameter", parameter_names},
    {OWNER_SAMPLED, FIELD_SAMPLED_inputs, CHANGED_INPUT, "input", input_names},
    {OWNER_SAMPLED, FIELD_SAMPLED_parameters, CHANGED_PARAMETER, "parameter", parameter_names}};

enum { CHANGED_KINDS = sizeof changed_kinds / sizeof *changed_kinds };

/* Whether the parameter is a number in the emitted C, which cannot change. */
static bool is_folded(const struct reader *reader, const struct changed_kind *kind, int index) {
    const struct declarations *declarations = reader->check.declarations;
    return kind->what == CHANGED_PARAMETER &&
           expr_is_number(declarations->graph, declarations_parameter_expression(declarations, index), NULL);
}

static void add_change(const struct reader *reader, const struct changed_kind *kind, int index,
                       const struct value_field *named, const char *path) {
    struct model *model = reader->model;
    const int first =
        kind->field == FIELD_EVENT_states ? tree_joint_count(reader->tree) : 0; /* rates of states */
    struct change change = {
        .what = kind->what, .index = first + index, .path = path, .place = named->value.place};
    if (!value_expression(reader->check.graph, &named->value, &change.value))
        return; /* reported by fields_check */
    model->changes = memory_room(reader->check.memory, model->changes, model->change_count,
                                 &model->change_capacity, sizeof *model->changes);
    model->changes[model->change_count++] = change;
}

static void read_changes(const struct reader *reader, const struct changed_kind *kind,
                         const struct value *table, const char *path) {
    const struct checker *check = &reader->check;
    int count;
    const char **names = kind->names(reader, &count);
    for (int i = 0; i < table->field_count; i++) {
        const struct value_field *named = &table->fields[i];
        const char *own_path = fields_path_name(check, path, named->name);
        const struct place place = named->value.place;
        int index = 0;
        while (index < count && strcmp(names[index], named->name) != 0)
            index++;
        if (index == count)
            fields_refuse_name(check, place, own_path, memory_format(check->memory, "unknown %s", kind->noun),
                               named->name, names, count);
        else if (is_folded(reader, kind, index))
            message_error(check->messages, place,
                          "%s: --fold makes it a number, which no event can change; omit --fold", own_path);
        else
            add_change(reader, kind, index, named, own_path);
    }
}

/* Reads all that an event or a sample changes, and adds it to the model. */
static void add_event(const struct reader *reader, struct event *event, const struct value *value,
                      enum owner owner) {
    struct model *model = reader->model;
    event->first_change = model->change_count;
    for (int i = 0; i < CHANGED_KINDS; i++) {
        const struct value *table =
            changed_kinds[i].owner == owner ? fields_get(value, changed_kinds[i].field) : NULL;
        if (table)
            read_changes(
                reader, &changed_kinds[i], table,
                fields_path_name(&reader->check, event->path, field_rules[changed_kinds[i].field].name));
    }
    event->change_count = model->change_count - event->first_change;
    model->events = memory_room(reader->check.memory, model->events, model->event_count,
                                &model->event_capacity, sizeof *model->events);
    model->events[model->event_count++] = *event;
}

static const char *name_of(const struct reader *reader, const struct value *value, enum field field) {
    const struct value *name = fields_get(value, field);
    return name ? name->text
                : memory_format(reader->check.memory, "event %d", reader->model->event_count + 1);
}

/* ---- events ---- */

static int read_direction_of(const struct reader *reader, const struct value *value, const char *path,
                             bool is_impact) {
    static const char *const names[] = {"down", "both", "up"};
    const struct value *given = fields_get(value, FIELD_EVENT_direction);
    int place = 0;
    if (!given)
        return is_impact ? -1 : 0;
    while (place < 3 && strcmp(names[place], given->text) != 0)
        place++;
    if (place == 3)
        message_error(reader->check.messages, given->place,
                      "%s.direction: \"%s\"; must be \"down\", \"up\" or \"both\"", path, given->text);
    else if (is_impact && place == 1)
        message_error(reader->check.messages, given->place,
                      "%s.direction: \"both\", but an impact comes from one side; must be \"down\" or \"up\"",
                      path);
    return place - 1;
}

static void read_event(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    const struct value *formula = fields_get(value, FIELD_EVENT_value),
                       *ends = fields_get(value, FIELD_EVENT_ends);
    struct event event = {.contact = -1, .path = path, .place = value->place};
    event.is_impact = fields_get(value, FIELD_EVENT_restitution) != NULL;
    event.restitution = fields_get_value(check, value, FIELD_EVENT_restitution);
    event.direction = read_direction_of(reader, value, path, event.is_impact);
    event.ends = ends && ends->truth;
    event.name = name_of(reader, value, FIELD_EVENT_name);
    if (!formula || !value_expression(check->graph, formula, &event.value))
        return;
    if (event.is_impact && fields_has(value, FIELD_EVENT_rates))
        message_error(check->messages, fields_get(value, FIELD_EVENT_restitution)->place,
                      "%s.restitution: given together with rates; give one of them", path);
    add_event(reader, &event, value, OWNER_EVENT);
}

/* ---- samples ---- */

/* Samples are events of sin(pi t/every), which crosses zero at all multiples of `every`. */
static void read_sampled(const struct reader *reader, const struct value *value, const char *path) {
    static const double every_least = 1e-6, pi = 3.14159265358979323846;
    const struct checker *check = &reader->check;
    struct graph *g = check->graph;
    const expression every = fields_get_value(check, value, FIELD_SAMPLED_every);
    const expression t = expr_symbol(g, SYMBOL_TIME, 0, 0);
    struct event event = {.contact = -1, .is_sampled = true, .path = path, .place = value->place};
    double known;
    event.restitution = EXPR_ZERO;
    event.name = name_of(reader, value, FIELD_SAMPLED_name);
    event.value = expr_apply1(g, OP_SIN, expr_div(g, expr_mul(g, expr_number(g, pi), t), every));
    if (parameters_are_known(check->declarations, every, &known) && known > 0 && known < every_least)
        message_error(check->messages, value->place, "%s.every: value %.6g; must be at least %g", path, known,
                      every_least);
    add_event(reader, &event, value, OWNER_SAMPLED);
    if (!fields_has(value, FIELD_SAMPLED_inputs) && !fields_has(value, FIELD_SAMPLED_parameters))
        message_error(check->messages, value->place, "%s: sets nothing; add inputs or parameters", path);
}

static const struct entry_kind kinds[] = {{"event", OWNER_EVENT, read_event},
                                          {"sampled", OWNER_SAMPLED, read_sampled}};

void read_events(const struct reader *reader, const struct value *result) {
    static const char needed[] = "a list of events such as { rd.event { expression } }, or {} for none";
    if (read_is_result(reader, result, "events", needed) &&
        field_types_has_no_names(&reader->check, result, "events", needed))
        read_entries(reader, result, "events", kinds, sizeof kinds / sizeof *kinds,
                     "rd.event { ... } or rd.sampled { ... }");
}
