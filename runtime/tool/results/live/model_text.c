/* Writes the data of the model for the module of a live page, as C: numbers of the drawing as functions of
 * the parameters, and applied forces as functions of the state. */
#include "runtime/tool/results/live/live.h"
#include "runtime/tool/support/format/format.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

/* A text of C. Letters, digits and a few signs stay; all other bytes become octal numbers. */
static void put_text(FILE *out, const char *text) {
    fputc('"', out);
    for (; *text; text++)
        if (isalnum((unsigned char)*text) || strchr(" _-./:,;=()[]", *text))
            fputc(*text, out);
        else
            fprintf(out, "\\%03o", (unsigned)(unsigned char)*text);
    fputc('"', out);
}

/* ---- Expressions ---- */

static const struct model *model_of(const struct live *live) {
    return &live->drawn.generation.model;
}

/* Returns whether the functions of the module can read the symbol. */
static bool is_symbol_known(const struct live *live, const struct symbol *symbol) {
    switch (symbol->kind) {
    case SYMBOL_PARAMETER:
    case SYMBOL_INPUT:
    case SYMBOL_TIME:
        return true;
    case SYMBOL_COORDINATE:
        return symbol->order <= 1;
    case SYMBOL_POINT:
        return symbol->order <= 1 && symbol->index / 3 < live->scene.model->point_count;
    default:
        return false;
    }
}

/* Marks the nodes of the expressions. */
static bool *mark(const struct live *live, const expression *list, int count) {
    const struct graph *g = &live->drawn.generation.graph;
    bool *needed = format_allocate(g->count, sizeof *needed);
    for (int i = 0; i < count; i++)
        needed[list[i]] = true;
    rewrite_mark_operands(g, needed, g->count);
    return needed;
}

static bool is_known(const struct live *live, const expression *list, int count) {
    const struct graph *g = &live->drawn.generation.graph;
    const bool *needed = mark(live, list, count);
    for (expression e = 0; e < g->count; e++) {
        const struct symbol *symbol = expr_as_symbol(g, e);
        if (needed[e] && (g->nodes[e].operation == OP_SPLINE || (symbol && !is_symbol_known(live, symbol))))
            return false;
    }
    return true;
}

static void put_symbol(FILE *out, const struct live *live, const struct symbol *symbol) {
    const struct refdyn_model *emitted = live->scene.model;
    const int i = symbol->index;
    if (symbol->kind == SYMBOL_PARAMETER)
        fprintf(out, "parameters[%d]", i);
    else if (symbol->kind == SYMBOL_INPUT)
        fprintf(out, "x[%d]",
                refdyn_find_name(emitted->inputs, emitted->input_count, model_of(live)->inputs[i].name));
    else if (symbol->kind == SYMBOL_COORDINATE)
        fprintf(out, "%s[%d]", symbol->order ? "qd" : "q", i);
    else if (symbol->kind == SYMBOL_POINT)
        fprintf(out, "%s[%d]", symbol->order ? "rd" : "r", i);
    else
        fputc('t', out);
}

/* An operand: a number, a symbol, or the variable of a node. */
static void put_operand(FILE *out, const struct live *live, expression e) {
    const struct graph *g = &live->drawn.generation.graph;
    const struct symbol *symbol = expr_as_symbol(g, e);
    double number;
    if (symbol)
        put_symbol(out, live, symbol);
    else if (!expr_is_number(g, e, &number))
        fprintf(out, "v%u", (unsigned)e);
    else if (isfinite(number))
        fprintf(out, "(%.17e)", number);
    else
        fputs(isnan(number) ? "(double)NAN" : number < 0 ? "(double)-INFINITY" : "(double)INFINITY", out);
}

/* The operator of a node, from ops.def. */
static void put_operation(FILE *out, const struct live *live, const struct node *node) {
    const enum operation operation = (enum operation)node->operation;
    const int arity = operation_arity(operation);
    const char *name = operation_text(operation);
    const bool is_infix = operation <= OP_DIV || operation == OP_LESS;
    const char *separators[] = {"", is_infix ? name : ",", ""};
    if (operation == OP_WHERE) {
        separators[0] = "!= 0 ? ";
        separators[1] = " : ";
        name = "";
    }
    fprintf(out, "%s(", is_infix ? "" : name);
    for (int i = 0; i < arity; i++) {
        put_operand(out, live, node->operand[i]);
        if (i + 1 < arity)
            fprintf(out, " %s ", operation == OP_WHERE ? separators[i] : separators[1]);
    }
    fputs(");\n", out);
}

/* Statements that compute the expressions, into out[0], out[1] ... */
static void put_statements(FILE *out, const struct live *live, const expression *list, int count) {
    const struct graph *g = &live->drawn.generation.graph;
    const bool *needed = mark(live, list, count);
    for (expression e = 0; e < g->count; e++) {
        if (!needed[e] || expr_as_symbol(g, e) || expr_is_number(g, e, NULL))
            continue;
        fprintf(out, "    const double v%u = ", (unsigned)e);
        put_operation(out, live, &g->nodes[e]);
    }
    for (int i = 0; i < count; i++) {
        fprintf(out, "    out[%d] = ", i);
        put_operand(out, live, list[i]);
        fputs(";\n", out);
    }
}

/* ---- Forces ---- */

void live_find_forces(struct live *live) {
    struct applied_force force;
    const struct model *model = model_of(live);
    live->forces = format_allocate((size_t)(model->force_count + model->load_count), sizeof *live->forces);
    for (int i = 0; view_applied_force(&live->drawn.generation, i, &force); i++)
        if (is_known(live, force.values, force.count))
            live->forces[live->force_count++] = force;
}

void live_find_curves(struct live *live) {
    const struct model *model = model_of(live);
    struct programme_curve curve;
    live->curves = format_allocate((size_t)model->row_count, sizeof *live->curves);
    for (int i = 0; i < model->row_count; i++)
        if (view_programme_curve(&live->drawn.generation, i, &curve) && is_known(live, &curve.residual, 1))
            live->curves[live->curve_count++] = curve;
}

/* ---- The tables ---- */

static void put_parameters(FILE *out, const struct live *live) {
    const struct model *model = model_of(live);
    fputs("static const struct live_parameter parameters[] = {\n", out);
    for (int i = 0; i < model->parameter_count; i++) {
        fputs("    {", out);
        put_text(out, model->parameters[i].name);
        fprintf(out, ", %.17e},\n", model->parameters[i].value);
    }
    fputs("    {0, 0}};\n\n", out);
}

static void put_places(FILE *out, const struct live *live) {
    const struct refdyn_model *model = live->scene.model;
    fputs("static const int shape_places[] = {", out);
    for (int i = 0; i < live->tape.shape_count; i++)
        fprintf(out, "%d, ", live->tape.places[i]);
    fputs("0};\n\nstatic const char *const requirement_places[] = {\n", out);
    for (int i = 0; i < model->requirement_count; i++) {
        const struct place place = gen_requirement_place(&live->scene.generation, i);
        fputs("    ", out);
        put_text(out, format_text("%s:%d", place.file, place.line));
        fputs(",\n", out);
    }
    fputs("    0};\n\n", out);
}

/* The anchored parameters that the rows read. */
static void put_row_waits(FILE *out, const struct live *live) {
    const struct refdyn_model *emitted = live->scene.model;
    const struct model *model = &live->scene.generation.model;
    fputs("static const int row_waits[] = {", out);
    for (int i = 0; i < emitted->m; i++)
        for (int k = 0; k < emitted->anchored_count; k++) {
            const char *name = emitted->parameters[emitted->anchored[k]].name;
            bool waits = false;
            for (int j = 0; j < model->rows[i].start_count; j++)
                waits = waits || strcmp(model->rows[i].starts[j], name) == 0;
            fputs(waits ? "1, " : "0, ", out);
        }
    fputs("0};\n\n", out);
}

static int put_applied(FILE *out, const struct live *live) {
    int count = 0;
    for (int i = 0; i < live->force_count; i++)
        count += live->forces[i].count;
    expression *list = format_allocate((size_t)count, sizeof *list), *next = list;
    for (int i = 0; i < live->force_count; i++)
        for (int k = 0; k < live->forces[i].count; k++)
            *next++ = live->forces[i].values[k];
    fputs("static void applied(const double *parameters, const double *x, double t, const double *q, const "
          "double *qd,\n                    const double *r, const double *rd, double *out) {\n"
          "    (void)parameters, (void)x, (void)t, (void)q, (void)qd, (void)r, (void)rd, (void)out;\n",
          out);
    put_statements(out, live, list, count);
    fputs("}\n\n", out);
    return count;
}

static void put_curves(FILE *out, const struct live *live) {
    expression *list = format_allocate((size_t)live->curve_count, sizeof *list);
    for (int i = 0; i < live->curve_count; i++)
        list[i] = live->curves[i].residual;
    fputs("static void curve_residuals(const double *parameters, const double *r, double *out) {\n"
          "    (void)parameters, (void)r, (void)out;\n",
          out);
    put_statements(out, live, list, live->curve_count);
    fputs("}\n\nstatic const struct live_curve curves[] = {", out);
    for (int i = 0; i < live->curve_count; i++)
        fprintf(out, "{%d, {%d, %d}}, ", live->curves[i].point, live->curves[i].axes[0],
                live->curves[i].axes[1]);
    fputs("{0, {0, 0}}};\n\n", out);
}

void live_model_put(FILE *out, const struct live *live) {
    const char *name = live->scene.generation.model.name;
    fprintf(out,
            "/* What the module knows of its model: see live_module.h. Written by refdyn. */\n#include "
            "<math.h>\n#include \"runtime/tool/results/live/module/live_module.h\"\n#include \"%s.h\"\n\n",
            name);
    put_parameters(out, live);
    put_places(out, live);
    put_row_waits(out, live);
    fputs("static void numbers(const double *parameters, double *out) {\n    (void)parameters, (void)out;\n",
          out);
    put_statements(out, live, live->tape.list, live->tape.count);
    fputs("}\n\n", out);
    put_curves(out, live);
    const int applied_count = put_applied(out, live);
    fprintf(out, "const struct live_model live_model = {\n    .model = &%s_model,\n", name);
    if (live->scene.compiled.spatial)
        fprintf(out, "    .spatial = &%s_spatial,\n", name);
    fprintf(out,
            "    .parameters = parameters,\n    .parameter_count = %d,\n    .number_count = %d,\n"
            "    .shape_start = %d,\n    .shape_count = %d,\n    .shape_places = shape_places,\n"
            "    .numbers = numbers,\n    .applied_count = %d,\n    .applied = applied,\n"
            "    .hand_input_count = %d,\n"
            "    .requirement_places = requirement_places,\n    .row_waits = row_waits,\n"
            "    .curves = curves,\n    .curve_count = %d,\n    .curve_residuals = curve_residuals};\n",
            model_of(live)->parameter_count, live->tape.count, live->tape.shape_start, live->tape.shape_count,
            applied_count, live_hand_inputs(live), live->curve_count);
}
