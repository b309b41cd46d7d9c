/*
 * Reads what the author's function `states` returns: continuous states z of controllers and drives.
 * Fills the model's states; adds the rates z' to its forces, as forces on the frames of the states (tree.h).
 */
#include "gen/model_file/reader.h"

#include <string.h>

static int count_declared(const struct model *model) {
    int count = 0;
    for (int i = 0; i < model->state_count; i++)
        count += model->states[i].path != NULL;
    return count;
}

static void read_state(const struct reader *reader, const struct value *value, const char *path) {
    const struct checker *check = &reader->check;
    struct model *model = reader->model;
    const struct value *name = fields_get(value, FIELD_STATE_name),
                       *rate = fields_get(value, FIELD_STATE_rate),
                       *unit = fields_get(value, FIELD_STATE_unit),
                       *scale = fields_get(value, FIELD_STATE_scale);
    if (!name || name->kind != VALUE_TEXT || is_empty_text(name))
        return; /* reported by fields_check */
    const int index = state_symbols_find_state(model, name->text, true);
    struct model_state *state = &model->states[index];
    if (state->path) {
        message_error(check->messages, value->place,
                      "%s.name: \"%s\" is already taken in line %d; choose another name", path, state->name,
                      state->place.line);
        return;
    }
    *state = (struct model_state){.name = state->name,
                                  .unit = unit ? unit->text : "",
                                  .start = fields_get_value(check, value, FIELD_STATE_start),
                                  .scale = scale ? scale->number : 1,
                                  .number = count_declared(model),
                                  .path = path,
                                  .place = value->place};
    if (rate)
        value_expression(check->graph, rate, &state->rate);
}

/* Returns whether the rate of a declared state reads state `number`. */
static bool is_read_by(const struct reader *reader, const struct model_state *state, int number) {
    const int joints = tree_joint_count(reader->tree);
    int count;
    const expression *symbols = rewrite_list_symbols(reader->check.graph, state->rate, &count);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(reader->check.graph, symbols[i]);
        if (symbol->kind == SYMBOL_COORDINATE && symbol->index == joints + number)
            return true;
    }
    return false;
}

/* Reports a state that the function reads and does not declare, at the first rate that reads it. */
static void refuse_undeclared(const struct reader *reader, const struct value *result, int number) {
    const struct model *model = reader->model;
    struct memory *memory = reader->check.memory;
    const char **declared = memory_get(memory, ((size_t)model->state_count + 1) * sizeof *declared);
    struct place place = result->place;
    const char *path = "states";
    int count = 0;
    for (int i = model->state_count - 1; i >= 0; i--) {
        if (!model->states[i].path)
            continue;
        declared[count++] = model->states[i].name;
        if (is_read_by(reader, &model->states[i], number)) {
            place = model->states[i].place;
            path = memory_format(memory, "%s.rate", model->states[i].path);
        }
    }
    message_error(reader->check.messages, place, "%s: unknown state \"%s\"%s", path,
                  model->states[number].name,
                  message_advice_on_name(memory, model->states[number].name, declared, count));
}

/* Puts the states, which are in the order in which the function first named them, in the order of its list.
 */
static void put_in_order(const struct reader *reader) {
    struct model *model = reader->model;
    const int count = model->state_count;
    struct model_state *states = memory_get(reader->check.memory, ((size_t)count + 1) * sizeof *states);
    int *to = memory_get(reader->check.memory, ((size_t)count + 1) * sizeof *to);
    for (int i = 0; i < count; i++) {
        to[i] = model->states[i].number;
        states[to[i]] = model->states[i];
    }
    graph_exchange_symbols(reader->check.graph, SYMBOL_COORDINATE, 1, tree_joint_count(reader->tree), to,
                           count);
    model->states = states;
    model->state_capacity = count;
}

static const struct entry_kind kinds[] = {{"state", OWNER_STATE, read_state}};

void read_states(const struct reader *reader, const struct value *result) {
    static const char needed[] =
        "a list of states such as { rd.state { \"z\", rate = expression } }, or {} for none";
    const struct model *model = reader->model;
    const int errors = reader->check.messages->errors;
    if (read_is_result(reader, result, "states", needed) &&
        field_types_has_no_names(&reader->check, result, "states", needed))
        read_entries(reader, result, "states", kinds, sizeof kinds / sizeof *kinds, "rd.state { ... }");
    for (int i = 0; i < model->state_count && reader->check.messages->errors == errors; i++)
        if (!model->states[i].path)
            refuse_undeclared(reader, result, i);
    if (reader->check.messages->errors == errors)
        put_in_order(reader);
}

void read_rates_of_states(const struct reader *reader) {
    struct model *model = reader->model;
    const int joints = tree_joint_count(reader->tree);
    struct force *forces = memory_get(reader->check.memory,
                                      (size_t)(model->force_count + model->state_count + 1) * sizeof *forces);
    for (int i = 0; i < model->force_count; i++)
        forces[i] = model->forces[i];
    model->forces = forces;
    for (int i = 0; i < model->state_count; i++)
        forces[model->force_count++] = (struct force){
            .coordinate = joints + i, .value = model->states[i].rate, .place = model->states[i].place};
}
