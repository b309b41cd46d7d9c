/*
 * Finds the curves on which a programme keeps points of interest, and writes them as JSON:
 *
 *     "curves": [{"point": , "axes": [0, 1], "closed": true, "path": [x, y, x, y, ...]}, ...]
 *
 * Each position row that is a formula in two components of one point, and in nothing else, defines a curve
 * through the point at the start of the motion.
 */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>

enum { AXES = DRAWN_CURVE_AXES };

/* ---- The formula ---- */

/* Returns whether the symbol is a parameter or a component of the curve's point; the first component
 * determines the point. */
static bool take_symbol(struct programme_curve *curve, const struct model *model, const struct symbol *symbol,
                        bool has_axis[static 3]) {
    if (symbol->kind == SYMBOL_PARAMETER)
        return true;
    if (symbol->kind != SYMBOL_POINT || symbol->order > 0 || symbol->index / 3 >= model->point_count)
        return false;
    if (curve->point >= 0 && curve->point != symbol->index / 3)
        return false;
    curve->point = symbol->index / 3;
    has_axis[symbol->index % 3] = true;
    return true;
}

bool view_programme_curve(struct generation *generation, int row, struct programme_curve *curve) {
    const struct model *model = &generation->model;
    bool has_axis[3] = {false};
    int count, axes = 0;
    *curve = (struct programme_curve){.residual = model->rows[row].residual, .point = -1};
    if (model->rows[row].is_closure || model->rows[row].level != ROW_POSITION)
        return false;
    const expression *symbols = rewrite_list_symbols(&generation->graph, curve->residual, &count);
    for (int i = 0; i < count; i++)
        if (!take_symbol(curve, model, expr_as_symbol(&generation->graph, symbols[i]), has_axis))
            return false;
    for (int axis = 0; axis < 3; axis++)
        if (has_axis[axis] && axes++ < AXES)
            curve->axes[axes - 1] = axis;
    return axes == AXES;
}

/* ---- A curve of a run ---- */

struct evaluation {
    struct generation *generation;
    const struct programme_curve *curve;
    const double *at;
};

static double symbol_value(void *context, const struct symbol *symbol) {
    const struct evaluation *evaluation = context;
    if (symbol->kind == SYMBOL_PARAMETER)
        return evaluation->generation->model.parameters[symbol->index].value;
    return evaluation->at[symbol->index % 3 == evaluation->curve->axes[0] ? 0 : 1];
}

static double residual(void *context, const double at[AXES]) {
    struct evaluation *evaluation = context;
    evaluation->at = at;
    return rewrite_evaluate(&evaluation->generation->graph, evaluation->curve->residual, symbol_value,
                            evaluation);
}

/* Returns whether all parameters of the curve have values: not those of a start that was not given. */
static bool is_determined(struct generation *generation, const struct programme_curve *curve) {
    int count;
    const expression *symbols = rewrite_list_symbols(&generation->graph, curve->residual, &count);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(&generation->graph, symbols[i]);
        const struct parameter *parameter = &generation->model.parameters[symbol->index];
        if (symbol->kind == SYMBOL_PARAMETER && !parameter->is_given && parameter->is_late)
            return false;
    }
    return true;
}

static void put_curve(FILE *out, const struct programme_curve *curve, const struct drawn_curve *drawn,
                      const double start[AXES]) {
    double(*places)[AXES] = format_allocate(DRAWN_CURVE_PLACES, sizeof *places);
    const int count = view_list_curve(drawn, start, places);
    fprintf(out, "{\"point\":%d,\"axes\":[%d,%d],\"closed\":%s,\"path\":[", curve->point, curve->axes[0],
            curve->axes[1], drawn->is_closed ? "true" : "false");
    for (int i = 0; i < AXES * count; i++) {
        fputs(i ? "," : "", out);
        view_put_length(out, places[i / AXES][i % AXES]);
    }
    fputs("]}", out);
}

/* Traces the curve through the first row that is kept, where the motion begins. */
static bool trace_curve(struct drawn_curve *drawn, const struct programme_curve *curve, const struct run *run,
                        double start[AXES]) {
    for (int k = 0; k < AXES; k++) {
        const int column = run->points[curve->point] + curve->axes[k];
        start[k] = run->kept[column];
        drawn->size = fmax(drawn->size, run->largest[column]);
    }
    return view_trace_curve(drawn, start);
}

void view_programme_curves_put(FILE *out, struct generation *generation, const struct run *run) {
    const struct model *model = &generation->model;
    const char *separator = "\n";
    fputs("\"curves\":[", out);
    for (int i = 0; i < model->row_count; i++) {
        struct programme_curve curve;
        struct drawn_curve *drawn = format_allocate(1, sizeof *drawn);
        struct evaluation evaluation = {.generation = generation, .curve = &curve};
        double start[AXES];
        drawn->residual = residual;
        drawn->context = &evaluation;
        if (!view_programme_curve(generation, i, &curve) || !is_determined(generation, &curve) ||
            curve.point >= run->point_count || !trace_curve(drawn, &curve, run, start))
            continue;
        fputs(separator, out);
        put_curve(out, &curve, drawn, start);
        separator = ",\n";
    }
    fputs("]", out);
}
