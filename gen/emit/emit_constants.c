/*
 * The constants of a model's header: the numbers of coordinates, rows, inputs ..., and the place of each by
 * its name. Input: the plan. Output: enumerators NAME_n, NAME_COORDINATE_base_z, NAME_ROW_row_1 ...
 */
#include "gen/emit/emit.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

enum {
    FEWEST_BY_MACRO = 24
}; /* coordinates of a run: a longer one has a macro instead of one line for each element */

/* Length of a name without the number at its end. */
static size_t stem_length(const char *name) {
    size_t length = strlen(name);
    while (length > 0 && name[length - 1] >= '0' && name[length - 1] <= '9')
        length--;
    return length;
}

struct stem emit_name_stem(const struct emission *x, const struct element_run *run, int k) {
    const char *name = x->plan->tree->frames[run->first + k].name;
    return (struct stem){name, (int)stem_length(name)};
}

/* Returns the number in the name of a run's first element if the elements' names are consecutive numbers;
 * else -1. */
static int first_number(const struct emission *x, const struct element_run *run) {
    const struct frame *frames = x->plan->tree->frames;
    const char *first = frames[run->first].name;
    const int number = atoi(first + stem_length(first));
    for (int i = 0; i < run->count * run->period; i++) {
        const struct stem stem = emit_name_stem(x, run, i % run->period);
        const char *expected =
            memory_format(x->plan->memory, "%.*s%d", stem.length, stem.text, number + i / run->period);
        if (strcmp(frames[run->first + i].name, expected))
            return -1;
    }
    return number;
}

void emit_number_runs(struct emission *x) {
    const struct tree *rolled = x->plan->rolled;
    x->run_numbers = memory_get(x->plan->memory, ((size_t)rolled->run_count + 1) * sizeof *x->run_numbers);
    for (int r = 0; r < rolled->run_count; r++)
        x->run_numbers[r] = first_number(x, &rolled->runs[r]);
}

int emit_named_run(const struct emission *x, int i) {
    const struct tree *rolled = x->plan->rolled;
    for (int r = 0; r < rolled->run_count; r++)
        if (rolled->runs[r].first == i && x->run_numbers[r] >= 0)
            return r;
    return -1;
}

/* ---- Sizes ---- */

static void emit_sizes(const struct emission *x, struct text *text) {
    const struct plan *plan = x->plan;
    const struct {
        const char *name, *about;
        int count;
    } sizes[] = {{"n", "coordinates", plan->tree->count},
                 {"m", "constraint rows", plan->model->row_count},
                 {"parameter_count", "parameters that are read", plan->parameter_count},
                 {"derived_count", "values that prepare computes after them", plan->prepare.out_count},
                 {"input_count", "inputs", plan->model->input_count},
                 {"point_count", "points of interest", plan->model->point_count},
                 {"course_count", "values to record with a motion", plan->model->course_count}};
    text_add(text, "enum {\n");
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        text_add(text, "    %s_%s = %d, /* %s */\n", x->name, sizes[i].name, sizes[i].count, sizes[i].about);
    text_add(text, "    %s_parameter_bytes = %d /* of struct %s_parameters */\n};\n\n", x->name,
             (plan->parameter_count + plan->prepare.out_count) * emit_real_bytes(plan), x->name);
}

/* ---- Places ---- */

static void emit_run_macro(const struct emission *x, struct text *text, const struct element_run *run,
                           int number) {
    text_add(text, "#define %s_PLACES(e)", x->name);
    for (int k = 0; k < run->period; k++) {
        const struct stem stem = emit_name_stem(x, run, k);
        text_add(text, "%s%s_COORDINATE_%.*s##e = %d + %d * (e - %d)", k ? ", \\\n    " : " \\\n    ",
                 x->name, stem.length, stem.text, run->first + k, run->period, number);
    }
    text_add(text, "\nenum {");
    for (int e = 0; e < run->count; e++)
        text_add(text, "%s%s_PLACES(%d)%s", e % 6 ? " " : "\n    ", x->name, number + e,
                 e < run->count - 1 ? "," : "\n");
    text_add(text, "};\n#undef %s_PLACES\n", x->name);
}

/* The long run that begins with coordinate i, or NULL. */
static const struct element_run *long_run(const struct emission *x, int i) {
    const int r = emit_named_run(x, i);
    const struct element_run *run = r < 0 ? NULL : &x->plan->rolled->runs[r];
    return run && run->count * run->period > FEWEST_BY_MACRO ? run : NULL;
}

static void emit_coordinate_places(const struct emission *x, struct text *text) {
    const struct tree *tree = x->plan->tree;
    text_add(text, "/* Places in q and qd, and in rows and columns of matrices. */\n");
    for (int i = 0; i < tree->count;) {
        const struct element_run *run = long_run(x, i);
        if (run) {
            emit_run_macro(x, text, run, x->run_numbers[emit_named_run(x, i)]);
            i += run->count * run->period;
            continue;
        }
        text_add(text, "enum {\n");
        for (const char *comma = ""; i < tree->count && !long_run(x, i); i++, comma = ",\n")
            text_add(text, "%s    %s_COORDINATE_%s = %d", comma, x->name, tree->frames[i].name, i);
        text_add(text, "\n};\n");
    }
    text_add(text, "\n");
}

/* Names of rows and courses may be any text. A character that no identifier can have becomes _, and a name
 * that is taken already receives a number. */
static const char *constant_name(struct memory *memory, const char *text, const char *const *before,
                                 int count) {
    char *plain = memory_text(memory, text);
    for (char *c = plain; *c; c++)
        if (!isalnum((unsigned char)*c))
            *c = '_';
    const char *name = plain;
    for (int number = 2, i = 0; i < count; i++) {
        if (strcmp(before[i], name))
            continue;
        name = memory_format(memory, "%s_%d", plain, number++);
        i = -1; /* the new name may be taken, too */
    }
    return name;
}

static void emit_places(const struct emission *x, struct text *text, const char *kind, const char *about,
                        const char *const *names, int count) {
    const char **plain = memory_get(x->plan->memory, ((size_t)count + 1) * sizeof *plain);
    if (!count)
        return;
    text_add(text, "/* %s. */\nenum {\n", about);
    for (int i = 0; i < count; i++) {
        plain[i] = constant_name(x->plan->memory, names[i], plain, i);
        text_add(text, "    %s_%s_%s = %d%s\n", x->name, kind, plain[i], i, i < count - 1 ? "," : "");
    }
    text_add(text, "};\n\n");
}

void emit_constants(const struct emission *x, struct text *text) {
    const struct plan *plan = x->plan;
    const struct model *model = plan->model;
    const size_t most = (size_t)model->parameter_count + (size_t)model->input_count +
                        (size_t)model->row_count + (size_t)model->point_count + (size_t)model->course_count +
                        (size_t)model->event_count;
    const char **names = memory_get(plan->memory, (most + 1) * sizeof *names);
    emit_sizes(x, text);
    emit_coordinate_places(x, text);
    for (int i = 0; i < plan->parameter_count; i++)
        names[i] = model->parameters[plan->parameters[i]].name;
    emit_places(x, text, "PARAMETER",
                memory_format(plan->memory, "Places in struct %s_parameters, an array of doubles", x->name),
                names, plan->parameter_count);
    for (int i = 0; i < model->input_count; i++)
        names[i] = model->inputs[i].name;
    emit_places(x, text, "INPUT",
                memory_format(plan->memory, "Places in struct %s_inputs, an array of doubles", x->name),
                names, model->input_count);
    for (int i = 0; i < model->row_count; i++)
        names[i] = model->rows[i].name;
    emit_places(x, text, "ROW", "Constraint rows: places in phi, psi, k, v, lambda, and rows of u", names,
                model->row_count);
    for (int i = 0; i < model->point_count; i++)
        names[i] = model->points[i].name;
    emit_places(x, text, "POINT", "Points of interest: rows of r, rd and d", names, model->point_count);
    for (int i = 0; i < model->course_count; i++)
        names[i] = model->courses[i].name;
    emit_places(x, text, "COURSE", "Places in course", names, model->course_count);
    for (int i = 0; i < model->event_count; i++)
        names[i] = model->events[i].name;
    emit_places(x, text, "EVENT", "Places in event", names, model->event_count);
}
