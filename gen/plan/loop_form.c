/*
 * Building the form of a loop (loops.h). Statements go to the end of the list that is open; a loop or a
 * condition opens its own list.
 */
#include "gen/plan/plan.h"

#include <assert.h>
#include <string.h>

/* ---- Integers ---- */

struct loop_index loop_number(int number) {
    return (struct loop_index){.constant = number};
}

struct loop_index loop_variable(struct loop_form *form, const char *name) {
    const int known = text_index(name, form->variables, form->variable_count);
    const int variable = known < 0 ? form->variable_count++ : known;
    assert(variable < MOST_VARIABLES);
    form->variables[variable] = name;
    return (struct loop_index){.count = 1, .parts = {{1, variable, NOTHING}}};
}

struct loop_index loop_plus(struct loop_index a, struct loop_index b) {
    a.constant += b.constant;
    for (int i = 0; i < b.count; i++) {
        assert(a.count < MOST_PARTS);
        a.parts[a.count++] = b.parts[i];
    }
    return a;
}

struct loop_index loop_plus_number(struct loop_index a, int number) {
    a.constant += number;
    return a;
}

struct loop_index loop_times(struct loop_index a, int factor) {
    a.constant *= factor;
    for (int i = 0; i < a.count; i++)
        a.parts[i].factor *= factor;
    return a;
}

static int find_table(struct loop_form *form, const struct loop_table *table) {
    for (int i = 0; i < form->table_count; i++)
        if (!strcmp(form->tables[i].name, table->name))
            return i;
    assert(form->table_count < MOST_TABLES);
    form->tables[form->table_count] = *table;
    return form->table_count++;
}

struct loop_index loop_look_up(struct loop_form *form, const char *name, const int *values, int count,
                               struct loop_index of) {
    bool are_equal = true, are_places = true;
    for (int i = 0; i < count; i++) {
        are_equal = are_equal && values[i] == values[0];
        are_places = are_places && values[i] == i;
    }
    if (are_equal || are_places)
        return are_equal && count ? loop_number(values[0]) : of;
    of.parts[0].table = find_table(form, &(struct loop_table){name, values, count});
    return of;
}

/* ---- Statements ---- */

static struct loop_statement *add_statement(struct loop_form *form, struct loop_list *list,
                                            enum loop_statement_kind kind) {
    struct loop_statement *statement = memory_get(form->memory, sizeof *statement);
    *statement = (struct loop_statement){.kind = kind, .outer = list};
    *(list->first ? &list->last->next : &list->first) = statement;
    list->last = statement;
    return statement;
}

static int add_local(struct loop_form *form, const char *name, int count) {
    form->locals = memory_room(form->memory, form->locals, form->local_count, &form->local_capacity,
                               sizeof *form->locals);
    form->locals[form->local_count] = (struct loop_local){name, count, form->value_count};
    form->value_count += count ? count : 1;
    return plan_count_arrays(form->function) + form->local_count++;
}

struct loop_entry loop_entry(int array, struct loop_index at) {
    return (struct loop_entry){array, at};
}

int loop_declare_array(struct loop_form *form, const char *name, int count) {
    const int array = add_local(form, name, count);
    add_statement(form, form->at, LOOP_ARRAY)->target.array = array;
    return array;
}

static struct loop_term *add_term(struct loop_sum *sum, double factor) {
    assert(sum->count < MOST_TERMS);
    struct loop_term *term = &sum->terms[sum->count++];
    *term = (struct loop_term){.factor = factor, .begins_group = sum->opens_group};
    sum->opens_group = false;
    return term;
}

void loop_add_entry(struct loop_sum *sum, double factor, struct loop_entry a) {
    struct loop_term *term = add_term(sum, factor);
    term->operands[term->operand_count++] = a;
}

void loop_add_product(struct loop_sum *sum, double factor, struct loop_entry a, struct loop_entry b) {
    loop_add_entry(sum, factor, a);
    struct loop_term *term = &sum->terms[sum->count - 1];
    term->operands[term->operand_count++] = b;
}

static struct loop_statement *add_assignment(struct loop_form *form, struct loop_list *list,
                                             struct loop_entry target, const struct loop_sum *sum) {
    struct loop_statement *statement = add_statement(form, list, LOOP_ASSIGN);
    statement->target = target;
    statement->terms = memory_get(form->memory, ((size_t)sum->count + 1) * sizeof *statement->terms);
    statement->term_count = sum->count;
    memcpy(statement->terms, sum->terms, (size_t)sum->count * sizeof *statement->terms);
    return statement;
}

void loop_assign(struct loop_form *form, struct loop_entry target, enum loop_effect effect,
                 const struct loop_sum *sum) {
    add_assignment(form, form->at, target, sum)->effect = effect;
}

void loop_assign_entry(struct loop_form *form, struct loop_entry target, enum loop_effect effect,
                       struct loop_entry value) {
    struct loop_sum sum = {.count = 0};
    loop_add_entry(&sum, 1, value);
    loop_assign(form, target, effect, &sum);
}

struct loop_entry loop_declare(struct loop_form *form, const char *name, const struct loop_sum *sum) {
    const struct loop_entry value = {.array = add_local(form, name, 0)};
    add_assignment(form, form->at, value, sum)->is_declared = true;
    return value;
}

void loop_open_constants(struct loop_form *form) {
    form->constants = &add_statement(form, form->at, LOOP_SEQUENCE)->body;
}

struct loop_entry loop_constant(struct loop_form *form, const char *name, double factor,
                                struct loop_entry value) {
    const int arrays = plan_count_arrays(form->function);
    struct loop_sum sum = {.count = 0};
    for (const struct loop_statement *s = form->constants->first; s; s = s->next)
        if (!strcmp(form->locals[s->target.array - arrays].name, name))
            return s->target;
    loop_add_entry(&sum, factor, value);
    struct loop_statement *statement =
        add_assignment(form, form->constants, (struct loop_entry){.array = add_local(form, name, 0)}, &sum);
    statement->is_declared = statement->is_constant = true;
    return statement->target;
}

static struct loop_statement *add_integer(struct loop_form *form, struct loop_index variable,
                                          struct loop_index value) {
    struct loop_statement *statement = add_statement(form, form->at, LOOP_INTEGER);
    statement->variable = variable.parts[0].variable;
    statement->from = value;
    return statement;
}

struct loop_index loop_declare_integer(struct loop_form *form, const char *name, struct loop_index value) {
    const struct loop_index variable = loop_variable(form, name);
    add_integer(form, variable, value)->is_declared = true;
    return variable;
}

struct loop_index loop_name_integer(struct loop_form *form, const char *name, struct loop_index value) {
    if (!value.count)
        return value;
    const struct loop_index variable = loop_declare_integer(form, name, value);
    form->at->last->is_constant = true;
    return variable;
}

void loop_set_integer(struct loop_form *form, struct loop_index variable, struct loop_index value) {
    add_integer(form, variable, value);
}

struct loop_statement *loop_open_for(struct loop_form *form, struct loop_index variable,
                                     struct loop_index from, enum loop_relation relation,
                                     struct loop_index to, struct loop_index step) {
    struct loop_statement *loop = add_statement(form, form->at, LOOP_FOR);
    loop->variable = variable.parts[0].variable;
    loop->from = from;
    loop->relation = relation;
    loop->to = to;
    loop->step = step;
    loop->is_declared = true;
    form->at = &loop->body;
    return loop;
}

struct loop_statement *loop_open_range(struct loop_form *form, const char *variable, struct loop_index from,
                                       struct loop_index to) {
    return loop_open_for(form, loop_variable(form, variable), from, LOOP_LESS, to, loop_number(1));
}

struct loop_statement *loop_open_if(struct loop_form *form, struct loop_index a, enum loop_relation relation,
                                    struct loop_index b) {
    struct loop_statement *condition = add_statement(form, form->at, LOOP_IF);
    condition->from = a;
    condition->relation = relation;
    condition->to = b;
    form->at = &condition->body;
    return condition;
}

void loop_open_else(struct loop_form *form, struct loop_statement *condition) {
    form->at = &condition->otherwise;
}

void loop_close(struct loop_form *form, struct loop_statement *opened) {
    form->at = opened->outer;
}
