/*
 * The generator's list of passes: read, check, expand, read the programme, check it; then `passes`; then
 * print.
 */
#include "gen/gen.h"
#include "gen/explain/explain.h"
#include "gen/plan/plan.h"
#include "gen/language/language.h"
#include "gen/model_file/model_file.h"
#include "gen/tree/tree.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The memory that a model may use while it is read, and until its C is complete. The program and the
 * system need some 20 MB more. */
static const size_t bound_of_reading = (size_t)256 << 20, bound_of_all = (size_t)448 << 20;
/* Millions of operations on expressions, which take seconds. 300 links or 4,000 elements need less than
 * half a million operations. */
enum { MILLIONS_OF_WORK = 16 };

static _Noreturn void out_of_memory(void *context) {
    struct generation *generation = context;
    longjmp(generation->out_of_memory, 1);
}

/* A model that exceeds a bound is an error of the model, regardless of the machine's memory. The message
 * needs a little more memory. */
static enum gen_status no_memory(struct generation *gen, const char *to_what_end) {
    struct memory *memory = &gen->memory;
    const int megabytes = (int)(memory->bound >> 20);
    if (gen->messages.are_too_many)
        return GEN_MODEL_ERROR;
    if (!memory->is_over_bound && !memory->is_over_work)
        return GEN_NO_MEMORY;
    memory->bound = 0;
    memory->work_bound = 0;
    if (setjmp(gen->out_of_memory))
        return GEN_NO_MEMORY;
    const char *what =
        memory->is_over_work
            ? memory_format(memory, "more than %d million operations on expressions", MILLIONS_OF_WORK)
            : memory_format(memory, "more than %d MB of memory", megabytes);
    message_error(&gen->messages, (struct place){.file = gen->model.file}, "%s to %s", what, to_what_end);
    return GEN_MODEL_ERROR;
}

static void read_model(struct generation *gen, const struct read_request *request) {
    struct messages *messages = &gen->messages;
    struct script *script = script_open(&gen->memory, &gen->graph, request, messages);
    if (!script)
        return;
    read_scene(script, &gen->model);
    check_scene(&gen->model, messages);
    if (!messages->errors)
        tree_expand(&gen->memory, &gen->model, &gen->tree);
    if (!messages->errors)
        read_programme(script, &gen->tree, &gen->model);
    if (!messages->errors)
        tree_place_points(&gen->memory, &gen->model, &gen->tree);
    if (!messages->errors)
        check_programme(&gen->model, &gen->tree, messages);
    if (!messages->errors)
        state_kinks_list(&gen->memory, &gen->model);
    gen->model.sources = script_sources(script);
}

enum gen_status gen_read(struct generation *gen, const struct read_request *request, long allowance) {
    memset(gen, 0, sizeof *gen);
    gen->memory.allowance = allowance;
    gen->memory.bound = bound_of_reading;
    gen->memory.work_bound = MILLIONS_OF_WORK * 1e6;
    gen->memory.fail = out_of_memory;
    gen->memory.context = gen;
    gen->messages.memory = &gen->memory;
    gen->messages.ends_reading = true;
    gen->model.file = request->file;
    if (setjmp(gen->out_of_memory))
        return no_memory(gen, "read the model");
    graph_start(&gen->graph, &gen->memory);
    gen->model.graph = &gen->graph;
    read_model(gen, request);
    gen->memory.bound = bound_of_all;
    gen->memory.is_over_bound = false; /* Lua may have found memory nevertheless */
    gen->messages.ends_reading = false;
    message_sort(&gen->messages);
    return gen->messages.errors ? GEN_MODEL_ERROR : GEN_OK;
}

/* ---- The passes after reading, in their order ---- */

static bool start_plan(struct generation *gen) {
    gen->plan = memory_get(&gen->memory, sizeof *gen->plan);
    *gen->plan = (struct plan){.memory = &gen->memory,
                               .g = &gen->graph,
                               .model = &gen->model,
                               .tree = &gen->tree,
                               .rolled = &gen->rolled,
                               .has_lanes = gen->has_lanes,
                               .has_casadi = gen->has_casadi,
                               .is_single = gen->is_single};
    return true;
}

static bool roll_elements(struct generation *gen) {
    const bool has_loops = !gen->model.printed_form && gen->model.accelerations != ACCELERATIONS_DENSE;
    roll_tree(&gen->memory, &gen->model, &gen->tree, has_loops ? gen->model.loops : LOOPS_NEVER,
              &gen->rolled);
    return true;
}

/* A step needs derivatives, which the printed form does not have. */
static const char *step_lacks(const struct generation *gen) {
    if (!gen->plan->has_step)
        return NULL;
    return !gen->tree.count ? "no coordinates" : gen->model.printed_form ? "no corrected form" : NULL;
}

static bool has_function(const struct plan *plan) {
    return !plan->has_casadi || plan->has_step || emit_has_casadi_function(plan);
}

static bool derive_quantities(struct generation *gen) {
    const char *quantities = quantities_of_words(gen->plan, gen->emit), *lacks = step_lacks(gen);
    if (lacks)
        message_error(&gen->messages, gen->model.place, "--emit step: nothing to emit; the model has %s",
                      lacks);
    if (lacks || (quantities_list_functions(gen->plan, quantities) && has_function(gen->plan)))
        return !lacks;
    if (gen->plan->left_out)
        message_error(&gen->messages, gen->model.place, "--emit %s: nothing to emit for this model; %s",
                      gen->emit, gen->plan->left_out);
    else
        message_error(&gen->messages, gen->model.place,
                      "--emit %s: no function for CasADi; name a function of the state, such as qdd, "
                      "whose derivatives are emitted with it",
                      gen->emit);
    return false;
}

static bool order_all_sums(struct generation *gen) {
    plan_close_graph(gen->plan);
    order_of_sums(gen->plan);
    return true;
}

static bool plan_all_functions(struct generation *gen) {
    plan_functions(gen->plan);
    return true;
}

/* `expand` made its tree while the model was read, because the programme names coordinates. */
static const struct pass {
    const char *name;
    bool (*run)(struct generation *gen); /* false: an error was reported */
    void (*explain)(const struct generation *gen, struct text *text);
} passes[] = {
    {"expand", start_plan, explain_tree},         {"roll", roll_elements, explain_rolled_tree},
    {"derive", derive_quantities, explain_graph}, {"sums", order_all_sums, explain_graph},
    {"plan", plan_all_functions, explain_plan},
};
enum { PASSES = sizeof passes / sizeof *passes };

#ifdef NDEBUG
enum { HAS_CHECKS = 0 };
#else
enum { HAS_CHECKS = 1 };
#endif

/* Checks the rules between passes. `sums` changes nodes in place, so that the graph is checked before it. */
static const char *violation_after(struct generation *gen, const struct pass *pass) {
    if (pass->run == plan_all_functions)
        return plan_violation(gen->plan);
    return pass->run == order_all_sums ? NULL : graph_violation(&gen->graph);
}

/* The work and memory of the checks do not count against the model. */
static void check_invariants(struct generation *gen, const struct pass *pass) {
    struct memory *memory = &gen->memory;
    const struct memory before = *memory;
    memory->bound = 0;
    const char *broken = violation_after(gen, pass);
    memory->work = before.work;
    memory->bound = before.bound + (memory->taken - before.taken);
    if (!broken)
        return;
    fprintf(stderr, "refdyn: after pass %s of %s: %s\n", pass->name, gen->model.name, broken);
    abort();
}

static bool run_passes(struct generation *gen, int count) {
    for (int i = 0; i < count; i++) {
        if (!passes[i].run(gen))
            return false;
        if (HAS_CHECKS)
            check_invariants(gen, &passes[i]);
    }
    return true;
}

enum gen_status gen_plan(struct generation *gen, const char *emit) {
    gen->emit = emit;
    if (setjmp(gen->out_of_memory))
        return no_memory(gen, "derive its equations");
    if (!run_passes(gen, PASSES))
        return GEN_MODEL_ERROR;
    emit_files(gen->plan);
    if (!gen->plan->outside)
        return GEN_OK;
    message_error(&gen->messages, gen->model.place,
                  "--real float: the C has the constant %s, and floats range from 1.2e-38 to 3.4e+38; choose "
                  "other units",
                  gen->plan->outside);
    return GEN_MODEL_ERROR;
}

static int find_pass(const char *name) {
    int pass = 0;
    while (pass < PASSES && strcmp(passes[pass].name, name))
        pass++;
    return pass;
}

static const char *wrong_pass(struct memory *memory, const char *pass) {
    const char *known = "";
    for (int i = 0; i < PASSES; i++)
        known = memory_format(memory, "%s %s", known, passes[i].name);
    return memory_format(memory, "'%s' is not a pass; use one of%s", pass, known);
}

const char *gen_pass(int number) {
    return number < PASSES ? passes[number].name : NULL;
}

const char *gen_wrong_pass(struct generation *gen, const char *pass) {
    if (setjmp(gen->out_of_memory))
        return "out of memory";
    return find_pass(pass) < PASSES ? NULL : wrong_pass(&gen->memory, pass);
}

enum gen_status gen_explain(struct generation *gen, const char *emit, const char *pass, FILE *out) {
    gen->emit = emit;
    if (setjmp(gen->out_of_memory))
        return no_memory(gen, "derive its equations");
    const int last = find_pass(pass);
    if (!run_passes(gen, last + 1))
        return GEN_MODEL_ERROR;
    struct text text = {.memory = &gen->memory};
    passes[last].explain(gen, &text);
    fputs(text.data, out);
    return GEN_OK;
}

/* ---- Requirements ---- */

struct place gen_requirement_place(const struct generation *gen, int number) {
    return gen->plan->requirements[number].place;
}

bool gen_is_for_lanes(const char *name) {
    static const char ending[] = "_lanes.c";
    const size_t length = strlen(name), end = sizeof ending - 1;
    return length > end && strcmp(name + length - end, ending) == 0;
}

int gen_file_count(const struct generation *gen) {
    return gen->plan->file_count;
}

const struct emitted_file *gen_files(const struct generation *gen) {
    return gen->plan->files;
}

const struct operation_count *gen_count(const struct generation *gen, const char *quantity) {
    return &plan_find_function(gen->plan, quantity)->operations;
}

static int count_given(const struct plan *plan, const struct function *function) {
    const int n = plan->tree->count;
    return function->given == GIVEN_NOTHING         ? 0
           : function->given == GIVEN_ACCELERATIONS ? n
                                                    : n + 1 + plan->model->row_count;
}

/* A composed function has no values itself. */
static bool reads_inputs(const struct generation *gen, const struct function *function) {
    for (expression e = 0; e < gen->graph.count && function->is_needed; e++) {
        const struct symbol *symbol = function->is_needed[e] ? expr_as_symbol(&gen->graph, e) : NULL;
        if (symbol && symbol->kind == SYMBOL_INPUT)
            return true;
    }
    return false;
}

bool gen_function(const struct generation *gen, int number, struct emitted_function *function) {
    if (number >= gen->plan->function_count)
        return false;
    const struct function *from = &gen->plan->functions[number];
    *function = (struct emitted_function){
        from->quantity,          from->about,      count_given(gen->plan, from), plan_is_struct_result(from),
        reads_inputs(gen, from), from->array_count};
    return true;
}

struct result_part gen_result_part(const struct generation *gen, int function, int part) {
    const struct array *array = &gen->plan->functions[function].arrays[part];
    return (struct result_part){array->name, array->about, array->count, array->columns};
}

const char *gen_left_out(const struct generation *gen) {
    return gen->plan->left_out;
}

const char *gen_lack(const struct generation *gen, int number) {
    return gen->plan->lacks[number];
}

/* Returns whether the file was made for a model of another name. Part 2 of the model `arm` has the same
 * file name as the model `arm_2`. */
static bool is_of_other_model(struct generation *gen, const char *path) {
    char head[256] = "";
    FILE *file = fopen(path, "rb");
    if (!file)
        return false;
    head[fread(head, 1, sizeof head - 1, file)] = 0;
    fclose(file);
    const char *name = head + strspn(head, "/* \n");
    const size_t length = strlen(gen->model.name);
    const bool is_own = strncmp(name, gen->model.name, length) == 0 && strchr(":,", name[length]);
    if (is_own || !strstr(head, "generated by refdyn"))
        return false;
    message_error(&gen->messages, (struct place){path, 0}, "belongs to another model; choose another folder");
    return true;
}

static bool is_free_of_other_models(struct generation *gen, const char *directory) {
    bool is_free = true;
    for (int i = 0; i < gen->plan->file_count && is_free; i++)
        is_free = !is_of_other_model(
            gen, memory_format(&gen->memory, "%s/%s", directory, gen->plan->files[i].name));
    return is_free;
}

enum gen_status gen_check_folder(struct generation *gen, const char *directory) {
    if (setjmp(gen->out_of_memory))
        return no_memory(gen, "write it");
    return is_free_of_other_models(gen, directory) ? GEN_OK : GEN_NOT_WRITTEN;
}

static bool begins_with(FILE *file, const char *lead) {
    while (*lead && getc(file) == (unsigned char)*lead)
        lead++;
    return !*lead;
}

/* Removes a file with that name and that first line. False: an error was reported, the file stays. */
static bool remove_stale(struct generation *gen, const char *path, const char *lead, bool *is_there) {
    FILE *file = fopen(path, "rb");
    *is_there = file != NULL;
    if (!file)
        return true;
    const bool is_stale = begins_with(file, lead);
    fclose(file);
    if (!is_stale || !unlink(path))
        return true;
    message_error(&gen->messages, (struct place){path, 0},
                  "cannot remove this part of an earlier emission: %s", strerror(errno));
    return false;
}

static bool is_emitted(const struct plan *plan, const char *name) {
    for (int i = 0; i < plan->file_count; i++)
        if (!strcmp(plan->files[i].name, name))
            return true;
    return false;
}

/* Removes companion files of an earlier emission that this one does not have. */
static bool remove_stale_companions(struct generation *gen, const char *directory) {
    struct memory *memory = &gen->memory;
    struct companion companion;
    bool is_good = true, is_there;
    for (int i = 0; is_good && emit_companion(memory, gen->model.name, i, &companion); i++)
        if (!is_emitted(gen->plan, companion.name))
            is_good = remove_stale(gen, memory_format(memory, "%s/%s", directory, companion.name),
                                   companion.lead, &is_there);
    return is_good;
}

static bool remove_stale_parts(struct generation *gen, const char *directory) {
    struct memory *memory = &gen->memory;
    const char *model = gen->model.name;
    bool is_good = remove_stale_companions(gen, directory), is_there = true;
    /* NAME.h precedes all parts, companions follow them */
    for (int part = gen->plan->file_count - gen->plan->companion_count; is_good && is_there; part++)
        is_good =
            remove_stale(gen, memory_format(memory, "%s/%s", directory, emit_part_name(memory, model, part)),
                         emit_part_lead(memory, model, part), &is_there);
    return is_good;
}

enum gen_status gen_remove_stale_parts(struct generation *gen, const char *directory) {
    if (setjmp(gen->out_of_memory))
        return no_memory(gen, "write it");
    return remove_stale_parts(gen, directory) ? GEN_OK : GEN_NOT_WRITTEN;
}

void gen_release(struct generation *gen) {
    memory_release(&gen->memory);
}
