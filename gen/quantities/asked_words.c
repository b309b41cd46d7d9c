/*
 * The words of `--emit`: checks them, and replaces those that represent several quantities.
 *
 * Input: the list as users write it. Result: a list of quantities alone, with the derivatives that an
 * emission for CasADi needs in addition; the plan records what else is emitted.
 */
#include "gen/quantities/quantities.h"

#include <string.h>

/* A step calls qdd and its derivatives, with respect to the parameters only on request. */
static const char step[] = "step", step_with_parameters[] = "step.p";
static const char step_calls[] = "qdd,d_qdd.q,d_qdd.qd,d_qdd.t,d_qdd.x", parameters_calls[] = ",d_qdd.p";

static bool is_word_for_several(const char *word) {
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
    if (!is_word_for_several(word))
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

/* ---- Checks ---- */

#define QUANTITY(name, about, exists, lacks, use, readers) {#name, use == IN_BLOCKS},
static const struct {
    const char *name;
    bool has_blocks;
} quantities[] = {
#include "gen/quantities/quantities.def"
};
#undef QUANTITY
enum { QUANTITY_COUNT = sizeof quantities / sizeof *quantities };

const char *gen_quantity(int number) {
    return number < QUANTITY_COUNT ? quantities[number].name : NULL;
}

bool quantities_is_in_list(const char *list, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = list; (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (at[length] == ',' || !at[length]))
            return true;
    return false;
}

const char quantities_implicit[] = "implicit";

const char *quantities_block_word(struct memory *memory, const char *quantity, int block) {
    return memory_format(memory, "%s.%s", quantity, derivatives_block_name(block));
}

/* The message about a wrong block of derivatives; NULL: the block exists. */
static const char *wrong_block(struct memory *memory, const char *word) {
    const char *names = "", *parts = "";
    for (int k = 0; derivatives_block_name(k); k++)
        parts = memory_format(memory, "%s .%s", parts, derivatives_block_name(k));
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        if (!quantities[i].has_blocks)
            continue;
        names = memory_format(memory, "%s%s%s", names, *names ? " " : "", quantities[i].name);
        for (int k = 0; derivatives_block_name(k); k++)
            if (!strcmp(quantities_block_word(memory, quantities[i].name, k), word))
                return NULL;
    }
    return memory_format(memory, "'%s' is not a part of a quantity; %s have%s", word, names, parts);
}

/* The message about a word that names no quantity, with the allowed words; NULL: the word is right. */
static const char *wrong_word(struct memory *memory, const char *word) {
    const char *names[QUANTITY_COUNT], *all = "all implicit step step.p";
    if (!strcmp(word, "all") || !strcmp(word, quantities_implicit) || is_word_for_several(word))
        return NULL;
    if (strchr(word, '.'))
        return wrong_block(memory, word);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        names[i] = quantities[i].name;
        all = memory_format(memory, "%s %s", all, names[i]);
        if (!strcmp(names[i], word))
            return NULL;
    }
    const char *near = message_nearest_name(word, names, QUANTITY_COUNT);
    if (near)
        return memory_format(memory, "'%s' is not a quantity; the nearest is %s", word, near);
    return memory_format(memory, "'%s' is not a quantity; use some of %s", word, all);
}

const char *gen_wrong_emit(struct generation *generation, const char *emit) {
    if (setjmp(generation->out_of_memory))
        return "out of memory";
    char *rest = memory_text(&generation->memory, emit);
    const char *wrong = NULL;
    while (rest && !wrong) {
        const char *word = rest;
        rest = strchr(word, ',');
        if (rest)
            *rest++ = 0;
        wrong = *word ? wrong_word(&generation->memory, word)
                      : memory_format(&generation->memory, "a name in '%s' is empty", emit);
    }
    return wrong;
}
