/*
 * Chooses the quantities of an emission from the words of `--emit`, builds them in order, and composes
 * functions of others.
 *
 * Input: the model, its tree and the list of --emit. Output: the functions of plan.h. quantities.def says
 * which quantities exist, when a scene has them and when they are emitted. Terms that several quantities
 * share are derived once, when first requested.
 */
#include "gen/quantities/quantities.h"

#include <string.h>

/* ---- The table ---- */

static bool has_events(const struct derivation *d) {
    return d->model->event_count + d->model->kink_count > 0;
}

static bool always(const struct derivation *d) {
    return d->n > 0;
}

static bool is_corrected(const struct derivation *d) {
    return d->n > 0 && !d->model->printed_form;
}

static bool has_rows(const struct derivation *d) {
    return d->m > 0;
}

static bool is_corrected_with_rows(const struct derivation *d) {
    return is_corrected(d) && has_rows(d);
}

static bool is_corrected_with_inputs(const struct derivation *d) {
    return is_corrected(d) && d->model->input_count > 0;
}

static bool has_level(const struct derivation *d, enum row_level highest) {
    for (int i = 0; i < d->m; i++)
        if (d->model->rows[i].level <= highest)
            return true;
    return false;
}

static bool has_position_rows(const struct derivation *d) {
    return has_level(d, ROW_POSITION);
}

static bool has_velocity_rows(const struct derivation *d) {
    return has_level(d, ROW_VELOCITY);
}

static bool has_points(const struct derivation *d) {
    return d->points > 0;
}

static bool has_rows_and_points(const struct derivation *d) {
    return has_rows(d) && has_points(d);
}

static bool has_work(const struct derivation *d) {
    for (int i = 0; i < d->n; i++)
        if (d->plan->tree->frames[i].joint.damping)
            return true;
    return d->model->force_count + d->model->load_count > 0;
}

static bool has_courses(const struct derivation *d) {
    return d->model->course_count > 0;
}

static bool has_breaks(const struct derivation *d) {
    return d->plan->break_count > 0;
}

static bool has_switches(const struct derivation *d) {
    return d->plan->switch_count > 0;
}

static bool has_pace(const struct derivation *d) {
    return d->plan->pace != EXPR_ZERO || d->plan->event_pace != EXPR_ZERO;
}

static bool has_anchors(const struct derivation *d) {
    return d->plan->anchored_count > 0;
}

enum quantity_use { BY_DEFAULT, IF_PRESENT, ALWAYS, ON_REQUEST, IN_BLOCKS };
enum quantity_readers { ANY, START, RUNTIME };

/* quantities.def explains the columns. */
struct quantity {
    const char *name, *about, *lacks;
    bool (*exists)(const struct derivation *d);
    void (*build)(struct derivation *d, struct function *f);
    enum quantity_use use;
    enum quantity_readers readers;
};

#define QUANTITY(name, about, exists, lacks, use, readers) QUANTITY_##name,
enum {
#include "gen/quantities/quantities.def"
    QUANTITY_COUNT
};
#undef QUANTITY

#define QUANTITY(name, about, exists, lacks, use, readers) \
    {#name, about, lacks, exists, quantity_##name, use, readers},
static const struct quantity quantities[] = {
#include "gen/quantities/quantities.def"
};
#undef QUANTITY

static const struct quantity *find_quantity(const char *name) {
    const struct quantity *quantity = quantities;
    while (strcmp(quantity->name, name))
        quantity++;
    return quantity;
}

/* ---- The words of `--emit` ---- */

/* Words for several quantities are replaced by the names of these, with the derivatives that an emission for
 * CasADi needs in addition. The plan records what else is emitted. */

/* A step calls qdd and its derivatives, with respect to the parameters only on request. */
static const char step[] = "step", step_with_parameters[] = "step.p";
static const char step_calls[] = "qdd,d_qdd.q,d_qdd.qd,d_qdd.t,d_qdd.x", parameters_calls[] = ",d_qdd.p";

static bool is_word_for_several(const char *word) {
    return !strcmp(word, step) || !strcmp(word, step_with_parameters);
}

static const struct derivatives_of differentiable[] = {
    {"qdd", "d_qdd", ""},         {"qdd_free", "d_qdd_free", ""}, {"force", "d_force", ""},
    {"inverse", "d_inverse", ""}, {"phi", "d_rows", "phi_"},      {"psi", "d_rows", "psi_"},
    {"k", "d_rows", "k_"}};
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
        if ((!strcmp(word, "all") && find_quantity(differentiable[i].quantity)->use != ON_REQUEST) ||
            !strcmp(word, differentiable[i].quantity))
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

const char *gen_quantity(int number) {
    return number < QUANTITY_COUNT ? quantities[number].name : NULL;
}

/* Returns whether `name` is one of the comma-separated words of `list`. */
static bool is_in_list(const char *list, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = list; (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (at[length] == ',' || !at[length]))
            return true;
    return false;
}

/* The word for the form of the tangent that needs fewer operations. */
static const char implicit[] = "implicit";

/* Returns whether a word names the quantity, as "d_qdd" and its block "d_qdd.q" do. */
static bool is_quantity_of_word(const char *word, const char *end, const char *quantity) {
    const size_t length = strlen(quantity);
    return (size_t)(end - word) >= length && !memcmp(word, quantity, length) &&
           (word + length == end || word[length] == '.');
}

bool gen_is_named(const char *emit, const char *quantity) {
    const bool is_tangent = !strcmp(quantity, "tangent") || !strcmp(quantity, "tangent_vectors");
    if (!emit || is_in_list(emit, "all") || (is_tangent && is_in_list(emit, implicit)))
        return true;
    for (const char *word = emit, *end; word; word = *end ? end + 1 : NULL) {
        end = word + strcspn(word, ",");
        if (is_quantity_of_word(word, end, quantity))
            return true;
    }
    return false;
}

bool gen_has_steps(const char *emit) {
    return is_in_list(emit, step) || is_in_list(emit, step_with_parameters);
}

/* "d_qdd.q" */
static const char *block_word(struct memory *memory, const char *quantity, int block) {
    return memory_format(memory, "%s.%s", quantity, derivatives_block_name(block));
}

/* Only inverse dynamics reads accelerations, so that only it has derivatives by them. */
static bool has_block(const struct quantity *quantity, int block) {
    return derivatives_block_name(block) && (block != BY_QDD || quantity->build == quantity_d_inverse);
}

/* The message about a wrong block of derivatives; NULL: the block exists. */
static const char *wrong_block(struct memory *memory, const char *word) {
    const char *names = "", *parts = "";
    for (int k = 0; k < BLOCK_COUNT; k++)
        parts = memory_format(memory, "%s .%s", parts, derivatives_block_name(k));
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        if (quantities[i].use != IN_BLOCKS)
            continue;
        names = memory_format(memory, "%s%s%s", names, *names ? " " : "", quantities[i].name);
        for (int k = 0; has_block(&quantities[i], k); k++)
            if (!strcmp(block_word(memory, quantities[i].name, k), word))
                return NULL;
    }
    return memory_format(memory,
                         "'%s' is not a part of a quantity; %s have%s, d_inverse also .%s, and step .p", word,
                         names, parts, derivatives_block_name(BY_QDD));
}

/* The message about a word that names no quantity, with the allowed words; NULL: the word is right. */
static const char *wrong_word(struct memory *memory, const char *word) {
    const char *names[QUANTITY_COUNT], *all = "all implicit step step.p";
    if (!strcmp(word, "all") || !strcmp(word, implicit) || is_word_for_several(word))
        return NULL;
    if (strchr(word, '.'))
        return wrong_block(memory, word);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        names[i] = quantities[i].name;
        all = memory_format(memory, "%s %s", all, names[i]);
        if (!strcmp(names[i], word))
            return NULL;
    }
    const char *near = message_nearest_advice(memory, word, names, QUANTITY_COUNT);
    if (*near)
        return memory_format(memory, "'%s' is not a quantity%s", word, near);
    return memory_format(memory, "'%s' is not a quantity; use some of %s", word, all);
}

/* Single precision has no table for the runtime. */
static const char *wrong_in_single(struct memory *memory, const char *word) {
    for (int i = 0; i < QUANTITY_COUNT; i++)
        if (quantities[i].readers == RUNTIME && !strcmp(quantities[i].name, word))
            return memory_format(memory,
                                 "'%s' is only for the runtime, which computes with doubles; leave out this "
                                 "name, or --real float",
                                 word);
    return NULL;
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
        if (!wrong && generation->is_single)
            wrong = wrong_in_single(&generation->memory, word);
    }
    return wrong;
}

/* ---- Functions composed of others ---- */

/* Everything is requested without a list, and by "all" in one. */
static bool asks_for_all(const struct derivation *d) {
    return !d->emit || is_in_list(d->emit, "all");
}

/* Returns the function of a quantity, and builds it first if necessary. */
static const struct function *provide(struct derivation *d, const char *quantity);

static int find_array(const struct function *function, const char *name) {
    int index = 0;
    while (strcmp(function->arrays[index].name, name))
        index++;
    return index;
}

/* The function that computes an array: a composed function copies it from another one. */
static struct composed_array source_of(const struct function *function, int array) {
    for (int i = 0; i < function->part_count; i++)
        if (function->parts[i].to_array == array && !function->loop_count)
            return function->parts[i];
    return (struct composed_array){.from = function, .from_array = array};
}

/* Adds an array of a quantity to the parts of a composed function. The caller sets its place there. */
static struct composed_array *add_part(struct derivation *d, struct function *f, const char *quantity,
                                       const char *array) {
    const struct function *from = provide(d, quantity);
    f->parts = memory_room(d->memory, f->parts, f->part_count, &f->part_capacity, sizeof *f->parts);
    f->parts[f->part_count] = source_of(from, find_array(from, array));
    return &f->parts[f->part_count++];
}

static const struct array *array_of(const struct composed_array *part) {
    return &part->from->arrays[part->from_array];
}

/* Adds an array of a quantity to the results of a composed function. */
static void compose(struct derivation *d, struct function *f, const char *quantity, const char *array) {
    struct composed_array *part = add_part(d, f, quantity, array);
    const struct array *source = array_of(part);
    derivation_add_array(d, f, source->name, source->about, source->count, source->columns);
    part->to_array = f->array_count - 1;
}

/* Adds the values of an array to the previous result. */
static void compose_sum(struct derivation *d, struct function *f, const char *quantity, const char *array) {
    struct composed_array *part = add_part(d, f, quantity, array);
    part->to_array = f->array_count - 1;
    part->is_added = true;
}

/* Copies an array of a quantity to a local array, for loops, and returns its number. */
static int compose_local(struct derivation *d, struct function *f, const char *quantity, const char *array) {
    struct composed_array *part = add_part(d, f, quantity, array);
    const struct array *source = array_of(part);
    return part->to_array = pair_loops_add_local(d->memory, f, source->name, source->count,
                                                 source->columns ? source->columns : 1);
}

/* It exists with and without rows, so that callers need not distinguish these models. */
void quantity_qdd(struct derivation *d, struct function *f) {
    compose(d, f, d->m ? "constrained" : "qdd_free", "qdd");
    if (!d->m)
        f->arrays[f->array_count - 1].about = "(n) accelerations, M qdd = h + Q";
}

/* r = u^T lambda */
void quantity_force(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "force", "(n) programme force r = M qdd - h - Q = u^T lambda [N, N m]", d->n,
                         0);
    const int u = compose_local(d, f, "u", "u"), lambda = compose_local(d, f, "constrained", "lambda");
    pair_loops_add_loop(d->memory, f, LOOP_PRODUCT, "r = u^T lambda")->of.product =
        (struct product){0, u, lambda, 1};
}

/* h + Q is the sum of both functions if everything is requested, because both are emitted then. */
static void compose_f(struct derivation *d, struct function *f) {
    if (!asks_for_all(d)) {
        compose(d, f, "f", "f");
        return;
    }
    compose(d, f, "h", "h");
    f->arrays[f->array_count - 1].name = "f";
    f->arrays[f->array_count - 1].about = "(n) h + Q [N, N m]";
    compose_sum(d, f, "Q", "Q");
}

void quantity_equations(struct derivation *d, struct function *f) {
    compose(d, f, "M", "M");
    compose_f(d, f);
    const struct function *rows = d->m ? provide(d, "row_terms") : NULL;
    for (int i = 0; rows && i < rows->array_count; i++)
        compose(d, f, "row_terms", rows->arrays[i].name);
}

/* A quantity may call a function that computes it together with others. That is less text (the manipulator's
 * would be half as long again), but takes more time than computing the quantity alone. */
struct membership {
    const char *quantity, *group;
    bool in_all; /* the call is made if everything is requested; else with another quantity of the group */
    const char *parts[6]; /* the arrays that it copies */
};

static const struct membership memberships[] = {
    {"u", "row_terms", true, {"u"}},
    {"v", "row_terms", false, {"v"}},
    {"phi", "row_terms", false, {"phi"}},
    {"psi", "row_terms", false, {"psi"}},
    {"k", "row_terms", false, {"k"}},
    {"r", "point_terms", false, {"r"}},
    {"rd", "point_terms", false, {"rd"}},
    {"C", "point_terms", false, {"C"}},
    {"d", "point_terms", false, {"d"}},
    {"row_terms", "terms", true, {"u", "v", "phi", "psi", "k"}},
    {"point_terms", "terms", true, {"r", "rd", "C", "d"}},
    {"qdd_free", "accelerations", true, {"qdd_free"}},
    {"constrained", "accelerations", true, {"qdd", "power", "lambda"}},
};

enum { MEMBERSHIP_COUNT = sizeof memberships / sizeof *memberships };

/* The requested blocks of derivatives, one bit each; all of them if the quantity is named as a whole. */
static unsigned wanted_blocks(const struct derivation *d, const struct quantity *quantity) {
    unsigned wanted = 0;
    if (quantity->use != IN_BLOCKS || !d->emit || is_in_list(d->emit, quantity->name))
        return ~0u;
    for (int k = 0; derivatives_block_name(k); k++)
        if (is_in_list(d->emit, block_word(d->memory, quantity->name, k)))
            wanted |= 1u << k;
    return wanted;
}

static bool is_asked_for(const struct derivation *d, const struct quantity *quantity) {
    const char *emit = d->emit;
    if (emit &&
        (is_in_list(emit, quantity->name) || (quantity->use == IN_BLOCKS && wanted_blocks(d, quantity))))
        return true;
    if (emit && is_in_list(emit, implicit) &&
        quantity->build == (d->has_vectors ? quantity_tangent_vectors : quantity_tangent))
        return true;
    return (quantity->use == BY_DEFAULT || quantity->use == ALWAYS ||
            (quantity->use == IF_PRESENT && quantity->exists(d))) &&
           asks_for_all(d);
}

/* Quantities that are left out, with what the model lacks: "u v k: no constraints; r rd: no points". */
struct left_out {
    const char *before, *names, *lacks; /* finished groups of quantities; the last group, and what it needs */
};

static void say_left_out(struct plan *plan, const char *quantity, const char *lacks, struct left_out *list) {
    if (!list->lacks || strcmp(list->lacks, lacks))
        *list = (struct left_out){plan->left_out ? memory_format(plan->memory, "%s; ", plan->left_out) : "",
                                  "", lacks};
    list->names = memory_format(plan->memory, "%s%s%s", list->names, *list->names ? " " : "", quantity);
    plan->left_out = memory_format(plan->memory, "%s%s: no %s", list->before, list->names, lacks);
}

/* Removes the last function if it has no arrays, as derivatives by variables that the scene does not have. */
static void drop_empty(struct plan *plan, struct left_out *list) {
    const struct function *last = &plan->functions[plan->function_count - 1];
    if (last->array_count)
        return;
    say_left_out(plan, last->quantity, "variables of that kind", list);
    plan->function_count--;
}

static bool is_set_by_anchor(const struct derivation *d, int parameter) {
    return d->model->parameters[parameter].is_anchored && !d->model->parameters[parameter].is_given;
}

/* Lists the anchored parameters that some function listed so far reads. */
static void list_anchored(struct derivation *d) {
    struct plan *plan = d->plan;
    bool *read = memory_get(d->memory, ((size_t)d->model->parameter_count + 1) * sizeof *read);
    const bool *needed = plan_mark_nodes_of_functions(plan);
    for (expression e = 0; e < d->g->count; e++) {
        const struct symbol *s = needed[e] ? expr_as_symbol(d->g, e) : NULL;
        if (s && s->kind == SYMBOL_PARAMETER)
            read[s->index] = true;
    }
    plan->anchored = memory_get(d->memory, ((size_t)d->model->parameter_count + 1) * sizeof *plan->anchored);
    for (int i = 0; i < d->model->parameter_count; i++)
        if (read[i] && is_set_by_anchor(d, i))
            plan->anchored[plan->anchored_count++] = i;
}

/* Parameters that are set by values at the start of a motion need `start`, too. */
static bool is_wanted(const struct derivation *d, const struct quantity *quantity) {
    return is_asked_for(d, quantity) || quantity->use == ALWAYS ||
           (quantity->build == quantity_start && has_anchors(d));
}

static bool is_named(const struct derivation *d, const struct quantity *quantity) {
    return d->emit && is_in_list(d->emit, quantity->name);
}

/* Returns whether the call is made: everything is requested and no member of the group is named, or at least
 * two members are emitted. */
static bool is_called_for(const struct derivation *d, const struct membership *membership) {
    int wanted = 0;
    bool named = false;
    for (int i = 0; i < MEMBERSHIP_COUNT; i++) {
        const struct quantity *member = find_quantity(memberships[i].quantity);
        if (strcmp(memberships[i].group, membership->group))
            continue;
        named |= memberships[i].in_all && is_named(d, member);
        wanted += !memberships[i].in_all && member->exists(d) && is_wanted(d, member);
    }
    return membership->in_all ? asks_for_all(d) && !named : wanted > 1;
}

/* The group that a quantity calls; NULL: it computes its results itself. */
static const struct membership *called_group(const struct derivation *d, const struct quantity *quantity) {
    for (int i = 0; i < MEMBERSHIP_COUNT; i++)
        if (!strcmp(memberships[i].quantity, quantity->name) &&
            find_quantity(memberships[i].group)->exists(d) && is_called_for(d, &memberships[i]))
            return &memberships[i];
    return NULL;
}

static struct function *build_quantity(struct derivation *d, const struct quantity *quantity) {
    struct function *function = &d->plan->functions[d->plan->function_count++];
    *function = (struct function){.quantity = quantity->name,
                                  .about = quantity->about,
                                  .has_blocks = quantity->use == IN_BLOCKS,
                                  .is_for_runtime = quantity->readers != ANY};
    const struct membership *membership = called_group(d, quantity);
    d->wanted_blocks = wanted_blocks(d, quantity);
    for (int i = 0; membership && membership->parts[i]; i++)
        compose(d, function, membership->group, membership->parts[i]);
    if (!membership)
        quantity->build(d, function);
    return function;
}

static const struct function *provide(struct derivation *d, const char *name) {
    const struct function *function = plan_find_function(d->plan, name);
    return function ? function : build_quantity(d, find_quantity(name));
}

/* Returns whether a requested quantity is emitted, and not only functions that others call. */
static bool has_asked_for(const struct derivation *d) {
    for (int i = 0; i < QUANTITY_COUNT; i++)
        if (is_asked_for(d, &quantities[i]) && plan_find_function(d->plan, quantities[i].name))
            return true;
    return false;
}

/* The tables of the model list all gains, including those that no function reads. */
static void make_gains(const struct derivation *d) {
    for (int i = 0; i < d->m; i++) {
        constraints_rate_gain(d->g, &d->model->rows[i]);
        constraints_position_gain(d->g, &d->model->rows[i]);
    }
}

/* What a scene without this quantity does not have; NULL: the scene has it. */
static const char *lack_of(const struct derivation *d, const struct quantity *quantity) {
    if (d->plan->is_single && quantity->readers == RUNTIME)
        return "double precision, which the runtime needs";
    return quantity->exists(d) ? NULL : quantity->lacks;
}

bool quantities_list_functions(struct plan *plan, const char *emit) {
    struct derivation *d = choice_of_tree(plan);
    struct left_out left_out = {NULL};
    d->emit = emit;
    d->has_vectors = emit && is_in_list(emit, implicit) && is_corrected(d) && tangent_prefers_vectors(d);
    plan->functions = memory_get(plan->memory, QUANTITY_COUNT * sizeof *plan->functions);
    plan->lacks = memory_get(plan->memory, QUANTITY_COUNT * sizeof *plan->lacks);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        const struct quantity *quantity = &quantities[i];
        if (i == QUANTITY_breaks)
            time_events_find(d);
        if (i == QUANTITY_anchor)
            list_anchored(d);
        if (i == QUANTITY_required && !plan->is_single)
            required_values_find(d);
        const char *lacks = plan->lacks[i] = lack_of(d, quantity);
        if (lacks) {
            if (is_asked_for(d, quantity))
                say_left_out(plan, quantity->name, lacks, &left_out);
        } else if (is_wanted(d, quantity) && !plan_find_function(plan, quantity->name)) {
            build_quantity(d, quantity);
            drop_empty(plan, &left_out);
        }
    }
    derivatives_keep_emitted_parameters(plan);
    if (!plan->is_single)
        make_gains(d);
    return has_asked_for(d);
}
