/*
 * Fixed steps of a model's motion with their derivatives. Input: the plan, whose functions qdd and d_qdd a
 * step calls. Output: NAME_step.h and NAME_step.c. The sizes and names of the model come first;
 * text/step_body.c.in, the part that is the same for all models, follows.
 */
#include "gen/emit/emit.h"

#include <string.h>

/* text/step_body.c.in, embedded by the build. */
extern const char step_body[];

/* One part of the derivatives of a step. */
struct step_part {
    const char *name, *about, *column;
    int columns;
};
enum { STEP_PARTS = 5 };

static const struct array *part_of_derivatives(const struct plan *plan, const char *name) {
    const struct function *function = plan_find_function(plan, "d_qdd"); /* a step requests it */
    for (int i = 0; i < function->array_count; i++)
        if (!strcmp(function->arrays[i].name, name))
            return &function->arrays[i];
    return NULL;
}

static int columns_of_parameters(const struct plan *plan) {
    const struct array *array = plan->has_step_parameters ? part_of_derivatives(plan, "p") : NULL;
    return array ? array->columns : 0;
}

static void list_parts(const struct plan *plan, struct step_part parts[STEP_PARTS]) {
    const int n = plan->tree->count;
    const struct step_part all[STEP_PARTS] = {
        {"state", "by q, then qd", "0", 2 * n},
        {"t", "by the time at which it begins", "STEP_COLUMN_T", 1},
        {"h", "by its length", "STEP_COLUMN_H", 1},
        {"x", "by the inputs", "STEP_COLUMN_X", plan->model->input_count},
        {"p", "by the parameters, in the order of the table", "STEP_COLUMN_P", columns_of_parameters(plan)},
    };
    memcpy(parts, all, sizeof all);
}

struct step_place emit_step_place(const struct plan *plan, const char *name) {
    struct step_part parts[STEP_PARTS];
    struct step_place place = {0, 0};
    list_parts(plan, parts);
    for (int i = 0; i < STEP_PARTS; i++) {
        place.columns = parts[i].columns;
        if (name && !strcmp(parts[i].name, name))
            return place;
        place.offset += 2 * plan->tree->count * parts[i].columns;
    }
    return place;
}

/* ---- The header ---- */

static void put_remarks(const struct plan *plan, struct text *text) {
    const struct model *model = plan->model;
    text_add(
        text,
        " * The state advances from t to t + count h in `count` steps of length h; inputs and parameters "
        "stay\n"
        " * constant. Returns 0 if successful; 1 if an implicit step did not converge or a result is not a\n"
        " * number: the results are then invalid.\n");
    if (model->row_count)
        text_add(text, " * Only their gains stabilise the rows, as in the accelerations qdd: nothing is "
                       "projected, so that\n"
                       " * the residual of a row without gains grows. The derivatives are those of these "
                       "steps, also at\n"
                       " * states off the rows.\n");
    if (model->event_count)
        text_add(text, " * Steps do not detect events: the caller must handle them.\n");
    text_add(
        text,
        " * At a kink of a formula the derivatives are those of the branch that is computed. t and h are in\n"
        " * seconds; results must not overlap `work` in memory.\n */\n");
}

static void put_struct(const struct emission *x, struct text *text) {
    struct step_part parts[STEP_PARTS];
    const int rows = 2 * x->plan->tree->count;
    list_parts(x->plan, parts);
    text_add(text, "/* Derivatives of the final state, %d values: q, then qd; one row for each. */\n", rows);
    text_add(text, "struct %s_step_derivatives {\n", x->name);
    for (int i = 0; i < STEP_PARTS; i++)
        if (parts[i].columns)
            text_add(text, "    double %s[%d]; /* (%d x %d) %s */\n", parts[i].name, rows * parts[i].columns,
                     rows, parts[i].columns, parts[i].about);
    text_add(text, "};\n\n");
}

static const struct {
    const char *name, *one, *about;
    bool is_implicit;
} methods[] = {{"rk4", "step_explicit",
                "The classical explicit Runge-Kutta method of order 4; h must be below 2.6 / "
                "(largest |eigenvalue|).",
                false},
               {"gauss", "step_implicit",
                "The implicit two-stage method of Gauss, order 4, stable for all vibrations.", true}};
enum { METHODS = sizeof methods / sizeof *methods };

const char *emit_step_method(int number) {
    return number < METHODS ? methods[number].name : NULL;
}

/* A step with derivatives, or the state alone. */
static void put_step_signature(const struct emission *x, struct text *text, int method, bool is_state) {
    const int n = x->plan->tree->count;
    text_add(text,
             "int %s_step_%s%s(const struct %s_parameters *p, const struct %s_inputs *x, double t, double h, "
             "int count,\n"
             "        const double q[%d], const double qd[%d], double state[%d],\n        ",
             x->name, methods[method].name, is_state ? "_state" : "", x->name, x->name, n, n, 2 * n);
    if (!is_state)
        text_add(text, "struct %s_step_derivatives *derivatives, ", x->name);
    text_add(text, "double *work)");
}

/* Bytes of the functions of text/step_body.c.in, of which two have pivots. */
static long step_stack(const struct emission *x, int method, bool has_derivatives) {
    enum { OWN_BYTES = 544, PIVOT_BYTES = 4 };
    const bool is_implicit = methods[method].is_implicit;
    const long of_state = emit_stack(x, plan_find_function(x->plan, "qdd"));
    const long of_derivatives =
        is_implicit || has_derivatives ? emit_stack(x, plan_find_function(x->plan, "d_qdd")) : 0;
    return OWN_BYTES + (is_implicit ? 4 * PIVOT_BYTES * x->plan->tree->count : 0) +
           (of_state > of_derivatives ? of_state : of_derivatives);
}

/*
 * Each iteration of step_iterate in text/step_body.c.in calls qdd for both stages. The first one also calls
 * d_qdd once; from the third one on, each may call d_qdd for both stages.
 */
enum { MOST_CORRECTIONS = 30, MOST_QDD = 2 * MOST_CORRECTIONS, MOST_D_QDD = 1 + 2 * (MOST_CORRECTIONS - 2) };

static void put_most_calls(struct text *text) {
    text_add(text,
             "\n * A step takes at most %d iterations, in which it calls qdd %d and d_qdd %d times; "
             "derivatives call d_qdd\n * twice more.",
             MOST_CORRECTIONS, MOST_QDD, MOST_D_QDD);
}

/* As step_open in text/step_body.c.in lays it out. */
long emit_step_work(const struct plan *plan, int method, bool has_derivatives) {
    struct step_part parts[STEP_PARTS];
    const long n = plan->tree->count, d = plan_find_function(plan, "d_qdd")->out_count;
    const bool is_implicit = methods[method].is_implicit;
    long width = 0;
    list_parts(plan, parts);
    for (int i = 0; i < STEP_PARTS; i++)
        width += parts[i].columns;
    return 8 * n + (is_implicit ? 4 * n * n : 0) + (is_implicit || has_derivatives ? d : 0) +
           (has_derivatives ? 7 * n * width : 0);
}

static void put_work_sizes(const struct emission *x, struct text *text) {
    long largest = 0;
    text_add(text, "/* Number of doubles at `work`, without and with derivatives. Their contents need not be "
                   "set or kept. */\nenum {\n");
    for (int i = 0; i < METHODS; i++) {
        const long work = emit_step_work(x->plan, i, true);
        text_add(text, "    %s_step_%s_work = %ld,\n    %s_step_%s_derivatives_work = %ld,\n", x->name,
                 methods[i].name, emit_step_work(x->plan, i, false), x->name, methods[i].name, work);
        largest = work > largest ? work : largest;
    }
    text_add(text, "    %s_step_work = %ld /* enough for all */\n};\n\n", x->name, largest);
}

static void put_header(const struct emission *x, struct text *text) {
    text_add(text, "%s", emit_lead(x->plan->memory, x->name, "steps"));
    text_add(text, "/*\n * Fixed steps of the motion, and exact derivatives of their results.\n *\n");
    put_remarks(x->plan, text);
    text_add(text, "#ifndef REFDYN_GENERATED_%s_step_H\n#define REFDYN_GENERATED_%s_step_H\n\n", x->name,
             x->name);
    text_add(text, "#include \"%s.h\"\n\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n", x->name);
    put_work_sizes(x, text);
    put_struct(x, text);
    text_add(
        text,
        "/* state (%d) receives q, then qd, at the end. `derivatives` may be NULL, which saves most of the "
        "time. */\n",
        2 * x->plan->tree->count);
    for (int i = 0; i < METHODS; i++) {
        text_add(text, "\n/* %s", methods[i].about);
        if (methods[i].is_implicit)
            put_most_calls(text);
        text_add(text, " Stack: at most %ld bytes. */\n", step_stack(x, i, true));
        put_step_signature(x, text, i, false);
        text_add(text, ";\n");
        if (methods[i].is_implicit)
            continue;
        text_add(text,
                 "\n/* The same without derivatives: a linker that removes unused sections leaves d_qdd out. "
                 "Stack: at most %ld bytes. */\n",
                 step_stack(x, i, false));
        put_step_signature(x, text, i, true);
        text_add(text, ";\n");
    }
    text_add(text, "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n");
}

/* ---- The source ---- */

/* Access to a part of d_qdd that may be absent. */
static void put_access(const struct emission *x, struct text *text, const char *function, const char *part,
                       bool is_there) {
    text_add(text, "static const double *%s(const step_derivatives *d) {\n", function);
    if (is_there && part_of_derivatives(x->plan, part))
        text_add(text, "    return d->%s;\n}\n\n", part);
    else
        text_add(text, "    (void)d;\n    return 0; /* d_qdd has no such part */\n}\n\n");
}

/* When the corrections of an implicit step are small, as step_is_small in text/step_body.c.in explains. */
static const struct {
    const char *rates, *displacement, *rounding;
} tolerances[] = {[false] = {"1e-10", "1e-12", "1e-17"}, [true] = {"1e-4", "1e-5", "1e-8"}}; /* is_single */

static void put_names(const struct emission *x, struct text *text) {
    const struct plan *plan = x->plan;
    text_add(text,
             "#define STEP_SMALL_RATES %s\n#define STEP_SMALL_DISPLACEMENT %s\n#define STEP_ROUNDING %s\n",
             tolerances[plan->is_single].rates, tolerances[plan->is_single].displacement,
             tolerances[plan->is_single].rounding);
    text_add(text, "#define STEP_N %d\n#define STEP_INPUTS %d\n#define STEP_PARAMETERS %d\n",
             plan->tree->count, plan->model->input_count, columns_of_parameters(plan));
    text_add(text, "#define STEP_CORRECTIONS %d /* of one step, at most */\n", MOST_CORRECTIONS);
    text_add(text, "#define STEP_QDD %s_qdd\n#define STEP_D_QDD %s_d_qdd\n\n", x->name, x->name);
    text_add(text,
             "typedef struct %s_parameters step_parameters;\ntypedef struct %s_inputs step_inputs;\n"
             "typedef struct %s_d_qdd_result step_derivatives;\n\n",
             x->name, x->name, x->name);
    put_access(x, text, "step_by_inputs", "x", true);
    put_access(x, text, "step_by_parameters", "p", plan->has_step_parameters);
}

static void put_derivatives(const struct emission *x, struct text *text) {
    struct step_part parts[STEP_PARTS];
    list_parts(x->plan, parts);
    text_add(text,
             "static void step_give(const struct step *s, double *state, struct %s_step_derivatives *d) {\n",
             x->name);
    text_add(text, "    memcpy(state, s->q, 2 * STEP_N * sizeof *state); /* and qd after it */\n    if (!d)\n"
                   "        return;\n");
    for (int i = 0; i < STEP_PARTS; i++)
        if (parts[i].columns)
            text_add(text,
                     "    step_give_columns(d->%s, s->dq, %s, %d);\n"
                     "    step_give_columns(d->%s + STEP_N * %d, s->dqd, %s, %d);\n",
                     parts[i].name, parts[i].column, parts[i].columns, parts[i].name, parts[i].columns,
                     parts[i].column, parts[i].columns);
    text_add(text, "}\n");
}

static void put_step(const struct emission *x, struct text *text, int method, bool is_state) {
    const char *derivatives = is_state ? "0" : "derivatives";
    text_add(text, "\n");
    put_step_signature(x, text, method, is_state);
    text_add(text,
             " {\n    struct step s;\n    s.p = p;\n    s.x = x;\n    s.derive = %s;\n    s.h = h;\n"
             "    step_open(&s, work, %d, %s != 0);\n"
             "    const int failed = step_run(&s, %s, t, count, q, qd, %s != 0);\n"
             "    step_give(&s, state, %s);\n    return failed;\n}\n",
             is_state ? "0" : "STEP_D_QDD", methods[method].is_implicit, derivatives, methods[method].one,
             derivatives, derivatives);
}

static void put_source(const struct emission *x, struct text *text) {
    text_add(text, "%s#include \"%s_step.h\"\n\n#include <math.h>\n#include <string.h>\n\n",
             emit_lead(x->plan->memory, x->name, "steps"), x->name);
    emit_refusal(x->plan, text, memory_format(x->plan->memory, "%s_step.c", x->name));
    put_names(x, text);
    text_add(text, "%s\n", step_body);
    put_derivatives(x, text);
    for (int i = 0; i < METHODS; i++) {
        put_step(x, text, i, false);
        if (!methods[i].is_implicit)
            put_step(x, text, i, true);
    }
}

void emit_step(struct emission *x, struct text *header, struct text *source) {
    put_header(x, header);
    put_source(x, source);
}
