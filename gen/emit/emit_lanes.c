/*
 * The files for motions side by side: the functions of the model printed once more, with a vector of LANES
 * doubles, one for each motion, as the type of numbers. Input: the emission of the model's own files. Output:
 * NAME_lanes.h and NAME_lanes.c. The number of lanes is a macro of the compiler's command line; compilers
 * split vectors that the processor lacks.
 *
 * Operators of C apply to two vectors, and to a vector and a number. Everything else is a function at the
 * beginning of the file, exp_lanes, where_lanes ...: it calls libm lane after lane or masks bits, so that no
 * lane depends on another.
 */
#include "gen/emit/emit.h"
#include "gen/graph/graph.h"
#include "refdyn_lanes.h"

#include <string.h>

/* ---- Helpers of the emitted functions ---- */

static void put_types(struct text *text) {
    text_add(
        text,
        "#if !defined(LANES) || (LANES != 1 && LANES != 2 && LANES != 4 && LANES != 8)\n"
        "#error \"define how many motions run side by side: -DLANES=2, 4 or 8, or 1 for tests\"\n#endif\n"
        "/* Only inlined functions pass vectors by value: other conventions differ between "
        "processors. */\n"
        "#pragma GCC diagnostic ignored \"-Wpsabi\"\n#define INLINE static inline "
        "__attribute__((always_inline))\n\n"
        "#if LANES == 1\n"
        "typedef double lane;\ntypedef long long lane_mask;\n#define AT(vector, l) (vector)\n"
        "#else\n"
        "typedef double lane __attribute__((vector_size(LANES * sizeof(double)), may_alias));\n"
        "typedef long long lane_mask __attribute__((vector_size(LANES * sizeof(long long))));\n"
        "#define AT(vector, l) (vector)[l]\n"
        "#endif\n\n");
    text_add(text, "/* A number in all lanes; subtracting 0.0 changes no number. */\n"
                   "INLINE lane every_lane(double number) {\n"
                   "    const lane zero = {0.0};\n    return number - zero;\n}\n\n");
}

/* A choice of one of two values, by a condition in each lane. */
static void put_choice(struct text *text) {
    text_add(text, "INLINE lane choose_lanes(lane_mask which, lane a, lane b) {\n"
                   "#if LANES == 1\n    return which ? a : b;\n#else\n"
                   "    return (lane)((which & (lane_mask)a) | (~which & (lane_mask)b));\n#endif\n}\n\n");
}

/* Operators that need no libm: the condition under which the first value is the result. */
static const struct {
    enum operation operation;
    const char *arguments, *condition, *values;
} choices[] = {
    {OP_LESS, "lane a, lane b", "a < b", "every_lane(1.0), every_lane(0.0)"},
    {OP_WHERE, "lane condition, lane a, lane b", "condition != 0.0", "a, b"},
    {OP_MIN, "lane a, lane b", "(a < b) | (b != b)",
     "a, b"}, /* like those of libm, they prefer a number to NaN */
    {OP_MAX, "lane a, lane b", "(a > b) | (b != b)", "a, b"},
};
enum { CHOICES = sizeof choices / sizeof *choices };

static bool is_choice(enum operation operation) {
    for (int i = 0; i < CHOICES; i++)
        if (choices[i].operation == operation)
            return true;
    return false;
}

static void put_choices(const struct emission *x, struct text *text) {
    bool has_any = false;
    for (int i = 0; i < CHOICES; i++) {
        if (!x->uses_operation[choices[i].operation])
            continue;
        if (!has_any)
            put_choice(text);
        has_any = true;
        text_add(text, "INLINE lane %s_lanes(%s) {\n    return choose_lanes((lane_mask)(%s), %s);\n}\n\n",
                 emit_lane_function(choices[i].operation), choices[i].arguments, choices[i].condition,
                 choices[i].values);
    }
}

/* A function of libm, lane after lane. */
static void put_function(struct text *text, enum operation operation) {
    const char *name = operation_text(operation);
    const bool has_two = operation_arity(operation) == 2;
    text_add(text,
             "INLINE lane %s_lanes(lane a%s) {\n    for (int l = 0; l < LANES; l++)\n"
             "        AT(a, l) = %s(AT(a, l)%s);\n    return a;\n}\n\n",
             name, has_two ? ", lane b" : "", name, has_two ? ", AT(b, l)" : "");
}

static void put_functions(const struct emission *x, struct text *text) {
    for (int i = 0; i < OP_COUNT; i++)
        if (x->uses_operation[i] && !is_choice((enum operation)i) && i != OP_SIN && i != OP_COS)
            put_function(text, (enum operation)i);
}

static void put_splines(const struct emission *x, struct text *text) {
    for (uint32_t i = 0; i < x->g->spline_count; i++)
        if (x->uses_spline[i])
            text_add(text,
                     "INLINE lane %s_spline_%u(lane at, int order) {\n"
                     "    for (int l = 0; l < LANES; l++)\n"
                     "        AT(at, l) = %s_spline_%u(AT(at, l), order);\n    return at;\n}\n\n",
                     x->name, i + 1, x->plan->model->name, i + 1);
}

/* ---- The files ---- */

/* Functions may call each other in any order. */
static void put_prototypes(struct emission *x, struct text *text) {
    for (int f = 0; f < x->plan->function_count; f++) {
        emit_signature(x, text, &x->plan->functions[f]);
        text_add(text, ";\n");
    }
    text_add(text, "\n");
}

static void put_source_begin(const struct emission *x, struct text *text) {
    const char *model = x->plan->model->name;
    text_add(text, "%s#include \"%s.h\"\n#include \"%s.h\"\n\n#include <math.h>\n#include <string.h>\n\n",
             emit_lead(x->plan->memory, model, "lanes"), x->name, model);
    emit_refusal(x->plan, text, memory_format(x->plan->memory, "%s_lanes.c", model));
    put_types(text);
}

static void put_table(struct emission *x, struct text *text) {
    const char *model = x->plan->model->name;
    emit_adapters(x, text);
    emit_before_table(text, model, "LANES", "refdyn_lanes.h", REFDYN_LANES_VERSION);
    text_add(text, "#define NAME_BEFORE(width) %s_##width\n#define NAME_OF(width) NAME_BEFORE(width)\n",
             x->name);
    text_add(text,
             "const struct refdyn_lane_model NAME_OF(LANES) = {\n    SET(interface_version) %d,\n"
             "    SET(width) LANES,\n    SET(model) &%s_model,\n",
             REFDYN_LANES_VERSION, model);
    emit_table_of_functions(x, text);
    text_add(text, "#undef NAME_OF\n#undef NAME_BEFORE\n#undef AT\n#undef INLINE\n");
}

static void put_header(const struct emission *x, struct text *text) {
    const char *model = x->plan->model->name;
    text_add(
        text,
        "%s#ifndef REFDYN_GENERATED_%s_H\n#define REFDYN_GENERATED_%s_H\n\n#include \"refdyn_lanes.h\"\n\n"
        "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n"
        "/* %s.c compiled with -DLANES=1, 2, 4 and 8. */\n"
        "extern const struct refdyn_lane_model %s_1, %s_2, %s_4, %s_8;\n\n"
        "#ifdef __cplusplus\n}\n#endif\n\n#endif\n",
        emit_lead(x->plan->memory, model, "lanes"), x->name, x->name, x->name, x->name, x->name, x->name,
        x->name);
}

void emit_lanes(struct emission *x, struct text *header, struct text *source) {
    struct text body = {.memory = x->plan->memory};
    x->name = memory_format(x->plan->memory, "%s_lanes", x->plan->model->name);
    x->number = "lane";
    x->is_lanes = true;
    x->has_sincos = false;
    x->uses_spline = memory_get(x->plan->memory, (size_t)x->g->spline_count + 1);
    if (x->plan->prepare.out_count)
        emit_function(x, &body, &x->plan->prepare);
    for (int f = 0; f < x->plan->function_count; f++)
        emit_function(x, &body, &x->plan->functions[f]);
    put_header(x, header);
    put_source_begin(x, source);
    emit_lane_sincos(x, source);
    put_choices(x, source);
    put_functions(x, source);
    put_splines(x, source);
    emit_structs(x, source);
    put_prototypes(x, source);
    text_add(source, "%s", body.data ? body.data : "");
    put_table(x, source);
}
