/*
 * The C text of one function: takes its plan, gives named values in sections, one statement a line, then its
 * results. Long functions are cut into static pieces; values that later pieces read are carried in a struct
 * on the stack.
 */
#include "emit.h"

enum { FEW_ZEROS = 3 }; /* more zeros than this in a field are written by one loop */

struct writer {
    struct emission *x;
    struct text *text;
    const struct function *function;
    const char *last_remark;
    uint32_t next_remark;
    bool wrote_result;
};

static bool is_prepare(const struct writer *w) {
    return w->function == &w->x->plan->prepare;
}

static bool has_fields(const struct function *function) {
    return function->field_count > 1;
}

static const char *result_name(const struct function *function) {
    return has_fields(function) ? "out" : function->fields[0].name;
}

static void emit_result_type(struct emission *x, struct text *text, const struct function *function) {
    const struct field *field = &function->fields[0];
    if (has_fields(function))
        text_add(text, "struct %s_%s_result *out", x->name, function->quantity);
    else if (field->columns)
        text_add(text, "double %s[%d * %d]", field->name, field->count / field->columns, field->columns);
    else
        text_add(text, "double %s[%d]", field->name, field->count);
}

static void emit_arguments(struct emission *x, struct text *text, const struct function *function) {
    const int n = x->plan->tree->count;
    if (function == &x->plan->prepare) {
        text_add(text, "struct %s_parameters *p", x->name);
        return;
    }
    text_add(text, "const struct %s_parameters *p, const struct %s_inputs *x, double t,\n        ", x->name,
             x->name);
    text_add(text, "const double q[%d], const double qd[%d], ", n, n);
    emit_result_type(x, text, function);
}

void emit_signature(struct emission *x, struct text *text, const struct function *function) {
    text_add(text, "void %s_%s(", x->name, function->quantity);
    emit_arguments(x, text, function);
    text_add(text, ")");
}

static void emit_remark(struct writer *w, expression e) {
    const struct graph *g = w->x->g;
    while (w->next_remark < g->remark_count && g->remarks[w->next_remark].from <= e)
        w->next_remark++;
    const char *remark = w->next_remark ? g->remarks[w->next_remark - 1].text : NULL;
    if (remark && remark != w->last_remark)
        text_add(w->text, "    /* %s */\n", remark);
    w->last_remark = remark;
}

static void emit_statement(struct writer *w, expression e) {
    struct emission *x = w->x;
    emit_remark(w, e);
    text_add(w->text, "    %s", x->plan->is_derived[e] ? "p->derived." : "const double ");
    x->uses_p |= x->plan->is_derived[e];
    emit_name(x, w->text, e);
    if (x->is_carried[e]) {
        x->uses_carried = true;
        text_add(w->text, " = s->");
        emit_name(x, w->text, e);
    }
    text_add(w->text, " = ");
    emit_definition(x, w->text, e);
    text_add(w->text, ";\n");
}

static int count_zeros(const struct function *function, const struct field *field) {
    int zeros = 0;
    for (int i = 0; i < field->count; i++)
        zeros += is_output_copied(field, i) && !function->out[field->offset + i];
    return zeros;
}

static bool fills_zeros(const struct function *function, const struct field *field) {
    return count_zeros(function, field) > FEW_ZEROS;
}

static void emit_field_name(struct writer *w, const struct field *field) {
    text_add(w->text, "%s%s", has_fields(w->function) ? "out->" : "", field->name);
}

static void emit_result(struct writer *w, const struct field *field, int entry) {
    w->wrote_result = true;
    text_add(w->text, "    ");
    emit_field_name(w, field);
    if (field->columns)
        text_add(w->text, "[%d * %d + %d] = ", entry / field->columns, field->columns,
                 entry % field->columns);
    else
        text_add(w->text, "[%d] = ", entry);
    emit_value(w->x, w->text, w->function->out[field->offset + entry]);
    text_add(w->text, ";\n");
}

/* The piece that writes a result: where its value is made, or the last one for what has no name. */
static int piece_of_result(const struct writer *w, expression e) {
    return w->x->plan->is_statement[e] ? w->x->piece_of[e] : w->function->piece_count - 1;
}

static void emit_results(struct writer *w, int piece) {
    const struct function *function = w->function;
    if (is_prepare(w))
        return; /* each statement is a result */
    for (int f = 0; f < function->field_count; f++) {
        const struct field *field = &function->fields[f];
        const bool filled = fills_zeros(function, field);
        for (int i = 0; i < field->count; i++) {
            const expression e = function->out[field->offset + i];
            if (is_output_copied(field, i) && !(filled && !e) && piece_of_result(w, e) == piece)
                emit_result(w, field, i);
        }
    }
}

static void emit_fills(struct writer *w) {
    for (int f = 0; f < w->function->field_count; f++) {
        const struct field *field = &w->function->fields[f];
        if (is_prepare(w) || !fills_zeros(w->function, field))
            continue;
        text_add(w->text, "    for (int i = 0; i < %d; i++)\n        ", field->count);
        emit_field_name(w, field);
        text_add(w->text, "[i] = 0.0;\n");
    }
}

static void emit_mirrors(struct writer *w) {
    for (int f = 0; f < w->function->field_count; f++) {
        const struct field *field = &w->function->fields[f];
        const int n = field->symmetric;
        if (n < 2)
            continue;
        text_add(w->text,
                 "    for (int i = 0; i < %d; i++)\n        for (int j = 0; j < i; j++)\n            ", n);
        emit_field_name(w, field);
        text_add(w->text, "[j * %d + i] = ", n);
        emit_field_name(w, field);
        text_add(w->text, "[i * %d + j];\n", n);
    }
}

/* Statements and results of one piece; notes in the emission which arguments were read. */
static void emit_body(struct writer *w, int piece) {
    struct emission *x = w->x;
    const int begin = piece ? w->function->piece_ends[piece - 1] : 0;
    x->piece = piece;
    w->last_remark = NULL;
    w->wrote_result = false;
    x->uses_p = x->uses_x = x->uses_t = x->uses_q = x->uses_qd = x->uses_carried = false;
    for (int i = begin; i < w->function->piece_ends[piece]; i++)
        emit_statement(w, w->function->statements[i]);
    emit_results(w, piece);
}

static void emit_unused(const struct writer *w, struct text *text) {
    const struct emission *x = w->x;
    const struct {
        bool used;
        const char *name;
    } arguments[] = {
        {x->uses_p, "p"}, {x->uses_x, "x"}, {x->uses_t, "t"}, {x->uses_q, "q"}, {x->uses_qd, "qd"}};
    for (int i = 0; i < (is_prepare(w) ? 1 : 5); i++)
        if (!arguments[i].used)
            text_add(text, "    (void)%s;\n", arguments[i].name);
}

static void number_statements(struct writer *w) {
    struct emission *x = w->x;
    int temporary = 0, piece = 0;
    for (int i = 0; i < w->function->statement_count; i++) {
        const expression e = w->function->statements[i];
        while (i >= w->function->piece_ends[piece])
            piece++;
        x->piece_of[e] = piece;
        x->is_carried[e] = false;
        if (!x->value_names[e])
            x->temporary[e] = ++temporary;
    }
}

static void emit_short_function(struct writer *w) {
    struct text body = {.memory = w->x->plan->memory}, *text = w->text;
    w->text = &body;
    emit_body(w, 0);
    w->text = text;
    w->x->uses_q |= w->x->angle_count > 0;
    emit_signature(w->x, text, w->function);
    text_add(text, " {\n");
    emit_unused(w, text);
    emit_angle_arrays(w->x, text);
    emit_angle_pass(w->x, text);
    emit_fills(w);
    text_add(text, "%s", body.data ? body.data : "");
    emit_mirrors(w);
    text_add(text, "}\n\n");
}

static void emit_carried(struct writer *w) {
    struct emission *x = w->x;
    text_add(w->text, "/* Values of %s_%s that later pieces read. */\nstruct %s_%s_carried {\n", x->name,
             w->function->quantity, x->name, w->function->quantity);
    for (int i = 0; i < w->function->statement_count; i++) {
        const expression e = w->function->statements[i];
        if (!x->is_carried[e])
            continue;
        text_add(w->text, "    double ");
        emit_name(x, w->text, e);
        text_add(w->text, ";\n");
    }
    emit_angle_arrays(x, w->text);
    text_add(w->text, "};\n\n");
}

static void emit_piece(struct writer *w, int piece) {
    struct emission *x = w->x;
    struct text body = {.memory = x->plan->memory}, *text = w->text;
    w->text = &body;
    emit_body(w, piece);
    w->text = text;
    text_add(text, "static void %s_%s_%d(", x->name, w->function->quantity, piece + 1);
    emit_arguments(x, text, w->function);
    text_add(text, ",\n        struct %s_%s_carried *s) {\n", x->name, w->function->quantity);
    emit_unused(w, text);
    if (!x->uses_carried)
        text_add(text, "    (void)s;\n");
    if (!is_prepare(w) && !w->wrote_result)
        text_add(text, "    (void)%s;\n", result_name(w->function));
    text_add(text, "%s}\n\n", body.data);
}

static void emit_calls(struct writer *w) {
    struct emission *x = w->x;
    const char *result = result_name(w->function);
    emit_signature(x, w->text, w->function);
    text_add(w->text, " {\n    struct %s_%s_carried s;\n", x->name, w->function->quantity);
    emit_fills(w);
    emit_angle_pass(x, w->text);
    for (int piece = 0; piece < w->function->piece_count; piece++) {
        text_add(w->text, "    %s_%s_%d(", x->name, w->function->quantity, piece + 1);
        if (is_prepare(w))
            text_add(w->text, "p, &s);\n");
        else
            text_add(w->text, "p, x, t, q, qd, %s, &s);\n", result);
    }
    emit_mirrors(w);
    text_add(w->text, "}\n\n");
}

/* The carried values are known once all pieces have been written: a first writing into the void finds them.
 */
static void find_carried(struct writer *w) {
    struct text unread = {.memory = w->x->plan->memory}, *text = w->text;
    w->text = &unread;
    for (int piece = 0; piece < w->function->piece_count; piece++)
        emit_body(w, piece);
    w->text = text;
    w->next_remark = 0;
}

void emit_function(struct emission *x, struct text *text, const struct function *function) {
    struct writer w = {.x = x, .text = text, .function = function};
    mark_statements(x->plan, function);
    number_statements(&w);
    find_angles(x, function);
    x->is_cut = function->piece_count > 1;
    if (x->angle_count)
        emit_sincos(x, text);
    if (function->piece_count == 1) {
        emit_short_function(&w);
        return;
    }
    find_carried(&w);
    emit_carried(&w);
    for (int piece = 0; piece < function->piece_count; piece++)
        emit_piece(&w, piece);
    emit_calls(&w);
}
