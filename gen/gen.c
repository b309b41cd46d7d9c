/*
 * The pass list of the generator: read, check, expand, read the programme, check it, derive, plan, print.
 */
#include "gen.h"
#include "plan.h"
#include "runs.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

static _Noreturn void out_of_memory(void *context) {
    struct generation *generation = context;
    longjmp(generation->out_of_memory, 1);
}

static void read_model(struct generation *gen, const struct read_request *request) {
    struct messages *messages = &gen->messages;
    struct script *script = script_open(&gen->memory, &gen->graph, request, messages);
    if (!script)
        return;
    read_scene(script, &gen->model);
    check_scene(&gen->model, messages);
    if (!messages->errors)
        expand(&gen->memory, &gen->model, &gen->tree);
    if (!messages->errors)
        read_programme(script, &gen->tree, &gen->model);
    if (!messages->errors)
        place_points(&gen->memory, &gen->model, &gen->tree);
    if (!messages->errors)
        check_programme(&gen->model, &gen->tree, messages);
    gen->model.sources = script_sources(script);
    script_close(script);
}

enum gen_status gen_read(struct generation *gen, const struct read_request *request, long allowance) {
    memset(gen, 0, sizeof *gen);
    gen->memory.allowance = allowance;
    gen->memory.fail = out_of_memory;
    gen->memory.context = gen;
    gen->messages.memory = &gen->memory;
    if (setjmp(gen->out_of_memory))
        return GEN_NO_MEMORY;
    graph_start(&gen->graph, &gen->memory);
    gen->model.graph = &gen->graph;
    read_model(gen, request);
    sort_messages(&gen->messages);
    return gen->messages.errors ? GEN_MODEL_ERROR : GEN_OK;
}

enum gen_status gen_plan(struct generation *gen, const char *emit) {
    if (setjmp(gen->out_of_memory))
        return GEN_NO_MEMORY;
    struct plan *plan = gen->plan = memory_get(&gen->memory, sizeof *plan);
    *plan = (struct plan){.memory = &gen->memory,
                          .g = &gen->graph,
                          .model = &gen->model,
                          .tree = &gen->tree,
                          .rolled = &gen->rolled};
    const bool has_loops = !gen->model.printed_form && gen->model.accelerations != ACCELERATIONS_DENSE;
    roll(&gen->memory, &gen->model, &gen->tree, has_loops ? gen->model.loops : LOOPS_NEVER, &gen->rolled);
    list_functions(plan, emit);
    plan_functions(plan);
    emit_files(plan);
    return GEN_OK;
}

int gen_file_count(const struct generation *gen) {
    return gen->plan->file_count;
}

const struct emitted_file *gen_files(const struct generation *gen) {
    return gen->plan->files;
}

const struct operation_count *gen_count(const struct generation *gen, const char *quantity) {
    const struct function *function = gen->plan->functions;
    while (strcmp(function->quantity, quantity))
        function++;
    return &function->operations;
}

static bool begins_with(FILE *file, const char *lead) {
    while (*lead && getc(file) == (unsigned char)*lead)
        lead++;
    return !*lead;
}

enum gen_status gen_remove_stale_parts(struct generation *gen, const char *directory) {
    if (setjmp(gen->out_of_memory))
        return GEN_NO_MEMORY;
    const char *model = gen->model.name;
    for (int part = gen->plan->file_count;; part++) { /* NAME.h and all parts before it */
        const char *path =
            memory_format(&gen->memory, "%s/%s", directory, part_name(&gen->memory, model, part));
        const char *lead = part_lead(&gen->memory, model, part);
        FILE *file = fopen(path, "rb");
        if (!file)
            return GEN_OK;
        const bool is_stale = begins_with(file, lead);
        fclose(file);
        if (!is_stale || !unlink(path))
            continue;
        complain(&gen->messages, (struct place){path, 0}, "a part of an earlier emission, not removed: %s",
                 strerror(errno));
        return GEN_NOT_WRITTEN;
    }
}

void gen_release(struct generation *gen) {
    memory_release(&gen->memory);
}
