/*
 * Words of `--emit` that represent several quantities, and what an emission for CasADi needs in addition to
 * the named quantities.
 *
 * Input: the list as users write it. Result: a list of quantities alone; the plan records what else is
 * emitted.
 */
#include "gen/plan/plan.h"

#include <string.h>

/* A step calls qdd and its derivatives, with respect to the parameters only on request. */
static const char step[] = "step", step_with_parameters[] = "step.p";
static const char step_calls[] = "qdd,d_qdd.q,d_qdd.qd,d_qdd.t,d_qdd.x", parameters_calls[] = ",d_qdd.p";

bool quantities_is_word(const char *word) {
    return !strcmp(word, step) || !strcmp(word, step_with_parameters);
}

static const struct derivatives_of differentiable[] = {
    {"qdd", "d_qdd", ""},      {"qdd_free", "d_qdd_free", ""}, {"force", "d_force", ""},
    {"phi", "d_rows", "phi_"}, {"psi", "d_rows", "psi_"},      {"k", "d_rows", "k_"}};
enum { DIFFERENTIABLE = sizeof differentiable / sizeof *differentiable };

const struct derivatives_of *quantities_derivatives_of(const char *quantity) {
    for (int i = 0; i < DIFFERENTIABLE; i++)
        if (!strcmp(quantity, differentiable[i].quantity))
            return &differentiable[i];
    return NULL;
}

/* CasADi has the derivatives of a function as a second function. */
static const char *with_derivatives(struct memory *memory, const char *word) {
    const char *list = word;
    for (int i = 0; i < DIFFERENTIABLE; i++)
        if (!strcmp(word, "all") || !strcmp(word, differentiable[i].quantity))
            list = memory_format(memory, "%s,%s", list, differentiable[i].function);
    return list;
}

static const char *meaning_of(struct plan *plan, const char *word) {
    const bool has_parameters = !strcmp(word, step_with_parameters) || plan->has_casadi;
    if (!quantities_is_word(word))
        return plan->has_casadi ? with_derivatives(plan->memory, word) : word;
    plan->has_step = true;
    plan->has_step_parameters |= has_parameters;
    return memory_format(plan->memory, "%s%s", step_calls, has_parameters ? parameters_calls : "");
}

const char *quantities_of_words(struct plan *plan, const char *emit) {
    char *rest = memory_text(plan->memory, emit ? emit : plan->has_casadi ? "all" : "");
    const char *list = plan->has_casadi ? "start" : NULL;
    if (!emit && !plan->has_casadi)
        return NULL;
    while (rest) {
        const char *word = rest;
        rest = strchr(word, ',');
        if (rest)
            *rest++ = 0;
        word = meaning_of(plan, word);
        list = list ? memory_format(plan->memory, "%s,%s", list, word) : word;
    }
    return list;
}
