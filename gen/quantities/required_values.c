/*
 * The quantity `required`: the rules for parameters whose values may still change.
 *
 * Input: the requirements that the reader has kept (model.h) and the functions of the plan so far. A
 * parameter that no function reads is replaced by its value. A requirement that depends only on such
 * parameters is left out.
 */
#include "gen/quantities/quantities.h"

#include <string.h>

struct reading {
    const struct model *model;
    bool *reads; /* by parameter */
};

static expression value_if_unread(void *context, struct graph *g, expression e) {
    const struct reading *reading = context;
    const struct symbol *s = expr_as_symbol(g, e);
    const bool is_unread = s->kind == SYMBOL_PARAMETER && !reading->reads[s->index];
    return is_unread ? expr_number(g, reading->model->parameters[s->index].value) : e;
}

static struct reading find_read(const struct derivation *d) {
    struct reading reading = {.model = d->model};
    const bool *needed = plan_mark_nodes_of_functions(d->plan);
    reading.reads = memory_get(d->memory, (size_t)d->model->parameter_count + 1);
    for (expression e = 0, count = d->g->count; e < count; e++) {
        const struct symbol *s = needed[e] ? expr_as_symbol(d->g, e) : NULL;
        if (s && s->kind == SYMBOL_PARAMETER)
            reading.reads[s->index] = true;
    }
    return reading;
}

/* The reader reads some formulas twice and then lists their rule twice; one is enough. */
static bool is_listed(const struct plan *plan, const struct requirement *requirement) {
    const size_t bytes = (size_t)requirement->count * sizeof *requirement->values;
    for (int i = 0; i < plan->requirement_count; i++) {
        const struct requirement *other = &plan->requirements[i];
        if (other->holds == requirement->holds && strcmp(other->path, requirement->path) == 0 &&
            strcmp(other->fact, requirement->fact) == 0 && other->place.line == requirement->place.line &&
            memcmp(other->values, requirement->values, bytes) == 0)
            return true;
    }
    return false;
}

void required_values_find(struct derivation *d) {
    struct plan *plan = d->plan;
    const struct model *model = d->model;
    const size_t most = (size_t)model->requirement_count + 1;
    struct reading reading = find_read(d);
    graph_remark(d->g, "the model's rules for parameters: 1 if a rule holds");
    plan->requirements = memory_get(d->memory, most * sizeof *plan->requirements);
    plan->required = memory_get(d->memory, most * sizeof *plan->required);
    for (int i = 0; i < model->requirement_count; i++) {
        struct requirement own = model->requirements[i];
        rewrite_substitute(d->g, value_if_unread, &reading, model->requirements[i].values, own.values,
                           own.count);
        const expression holds = own.holds(d->g, &own, own.values);
        if (expr_is_number(d->g, holds, NULL) || is_listed(plan, &own))
            continue;
        plan->required[plan->requirement_count] = holds;
        plan->requirements[plan->requirement_count++] = own;
    }
}

bool required_values_exist(const struct derivation *d) {
    return d->plan->requirement_count > 0;
}

void quantity_required(struct derivation *d, struct function *f) {
    const struct plan *plan = d->plan;
    int count = 0, place = 0;
    for (int i = 0; i < plan->requirement_count; i++)
        count += 1 + plan->requirements[i].count;
    const int array = derivation_add_array(
        d, f, "required", "for each of NAME_model.requirements: 1 if it holds, then its numbers", count, 0);
    for (int i = 0; i < plan->requirement_count; i++) {
        const struct requirement *requirement = &plan->requirements[i];
        plan_set_entry(d->memory, f, array, place, plan->required[i]);
        plan_set_entries(d->memory, f, array, place + 1, requirement->values, requirement->count);
        place += 1 + requirement->count;
    }
    f->keeps_parameters = true;
}
