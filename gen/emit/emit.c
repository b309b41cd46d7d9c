/*
 * Prints the files of a model: from the plan to the text of NAME.h, NAME.c, for a long model NAME_2.c ...,
 * and of companion files on request, which follow the model's own files in the list.
 */
#include "gen/emit/emit.h"

/* ---- Companion files ---- */

static const struct {
    const char *ending, *what;
} companions[] = {{"_lanes.h", "lanes"},
                  {"_lanes.c", "lanes"},
                  {"_step.h", "steps"},
                  {"_step.c", "steps"},
                  {"_casadi.c", "CasADi"}};
enum { COMPANIONS = sizeof companions / sizeof *companions };

bool emit_companion(struct memory *memory, const char *model, int number, struct companion *companion) {
    if (number >= COMPANIONS)
        return false;
    *companion = (struct companion){memory_format(memory, "%s%s", model, companions[number].ending),
                                    emit_lead(memory, model, companions[number].what)};
    return true;
}

static void add_file(struct plan *plan, const char *name, const struct text *text) {
    struct text single;
    if (plan->is_single) {
        single = emit_as_single(plan->memory, text->data, &plan->outside);
        text = &single;
    }
    plan->files[plan->file_count++] = (struct emitted_file){name, text->data, text->length};
}

static void add(struct emission *x, const char *ending, const struct text *text) {
    struct plan *plan = x->plan;
    add_file(plan, memory_format(plan->memory, "%s%s", plan->model->name, ending), text);
    plan->companion_count++;
}

static void add_pair(struct emission *x, const char *what,
                     void (*emit)(struct emission *x, struct text *header, struct text *source)) {
    struct text header = {.memory = x->plan->memory}, source = {.memory = x->plan->memory};
    emit(x, &header, &source);
    add(x, memory_format(x->plan->memory, "_%s.h", what), &header);
    add(x, memory_format(x->plan->memory, "_%s.c", what), &source);
}

static void emit_companions(struct emission *x) {
    if (x->plan->has_casadi) {
        struct text text = {.memory = x->plan->memory};
        emit_casadi(x, &text); /* first, because it includes all files that are in the list */
        add(x, "_casadi.c", &text);
    }
    if (x->plan->has_step)
        add_pair(x, "step", emit_step);
    if (x->plan->has_lanes) /* last, because it changes the name in the emission */
        add_pair(x, "lanes", emit_lanes);
}

/* ---- The files of a model ---- */

enum { LONGEST_FILE = 8000 }; /* statements: a compiler needs seconds for that many */

/* FNV-1a, 64 bits: changes whenever the emitted functions do. */
static uint64_t hash_text(uint64_t hash, const char *text) {
    for (; *text; text++)
        hash = (hash ^ (unsigned char)*text) * 0x100000001B3u;
    return hash;
}

static void open_source(struct emission *x, struct text *text, int part) {
    x->has_sincos = false;
    *text = (struct text){.memory = x->plan->memory};
    text_add(text, "%s", emit_part_lead(x->plan->memory, x->name, part));
    text_add(text, "#include \"%s.h\"\n\n#include <math.h>\n#include <string.h>\n\n", x->name);
    emit_refusal(x->plan, text, emit_part_name(x->plan->memory, x->name, part));
}

static struct emission start_emission(struct plan *plan) {
    struct emission x = {.plan = plan, .g = plan->g, .name = plan->model->name, .number = "double"};
    emit_name_values(&x);
    emit_number_runs(&x);
    x.temporary = memory_get(plan->memory, plan->g->count * sizeof *x.temporary);
    x.piece_of = memory_get(plan->memory, plan->g->count * sizeof *x.piece_of);
    x.is_carried = memory_get(plan->memory, plan->g->count * sizeof *x.is_carried);
    x.slot_piece = memory_get(plan->memory, ((size_t)plan->g->slot_count + 1) * sizeof *x.slot_piece);
    x.is_slot_carried = memory_get(plan->memory, (size_t)plan->g->slot_count + 1);
    x.own_stack = memory_get(plan->memory, ((size_t)plan->function_count + 1) * sizeof *x.own_stack);
    x.is_read = memory_get(plan->memory, plan->g->count * sizeof *x.is_read);
    return x;
}

/* Prints all functions and starts a new file when one becomes long. */
static int emit_sources(struct emission *x, struct text *sources) {
    struct plan *plan = x->plan;
    int parts = 1, statements = 0;
    open_source(x, &sources[0], 1);
    emit_spline_functions(x, &sources[0]);
    if (plan->prepare.out_count)
        emit_function(x, &sources[0], &plan->prepare);
    for (int f = 0; f < plan->function_count; f++) {
        statements += plan->functions[f].statement_count;
        if (f > 0 && statements > LONGEST_FILE) {
            statements = plan->functions[f].statement_count;
            open_source(x, &sources[parts], parts + 1);
            parts++;
        }
        x->own_stack[f] = emit_own_stack(x, emit_function(x, &sources[parts - 1], &plan->functions[f]));
    }
    return parts;
}

void emit_files(struct plan *plan) {
    struct emission x = start_emission(plan);
    struct text header = {.memory = plan->memory};
    const size_t most = (size_t)plan->function_count + 2 + COMPANIONS;
    struct text *sources = memory_get(plan->memory, most * sizeof *sources);
    plan->files = memory_get(plan->memory, most * sizeof *plan->files);
    const int parts = emit_sources(&x, sources);
    emit_header(&x, &header);
    uint64_t hash = hash_text(0xCBF29CE484222325u, header.data);
    for (int i = 0; i < parts; i++)
        hash = hash_text(hash, sources[i].data);
    emit_tables(&x, &sources[0], memory_format(plan->memory, "%016llx", (unsigned long long)hash));
    add_file(plan, memory_format(plan->memory, "%s.h", x.name), &header);
    for (int i = 0; i < parts; i++)
        add_file(plan, emit_part_name(plan->memory, x.name, i + 1), &sources[i]);
    emit_companions(&x);
}
