/*
 * Files in addition to those of a model, on request. They follow the model's own files in the list.
 */
#include "gen/emit/emit.h"

static const struct {
    const char *ending, *what;
} companions[] = {{"_lanes.h", "lanes"},
                  {"_lanes.c", "lanes"},
                  {"_step.h", "steps"},
                  {"_step.c", "steps"},
                  {"_casadi.c", "CasADi"}};
enum { COMPANIONS = sizeof companions / sizeof *companions };
_Static_assert((int)COMPANIONS == (int)MOST_COMPANIONS, "the list of files has room for all");

bool emit_companion(struct memory *memory, const char *model, int number, struct companion *companion) {
    if (number >= COMPANIONS)
        return false;
    *companion = (struct companion){memory_format(memory, "%s%s", model, companions[number].ending),
                                    emit_lead(memory, model, companions[number].what)};
    return true;
}

static void add(struct emission *x, const char *ending, const struct text *text) {
    struct plan *plan = x->plan;
    emit_add_file(plan, memory_format(plan->memory, "%s%s", plan->model->name, ending), text);
    plan->companion_count++;
}

static void add_pair(struct emission *x, const char *what,
                     void (*emit)(struct emission *x, struct text *header, struct text *source)) {
    struct text header = {.memory = x->plan->memory}, source = {.memory = x->plan->memory};
    emit(x, &header, &source);
    add(x, memory_format(x->plan->memory, "_%s.h", what), &header);
    add(x, memory_format(x->plan->memory, "_%s.c", what), &source);
}

void emit_companions(struct emission *x) {
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
