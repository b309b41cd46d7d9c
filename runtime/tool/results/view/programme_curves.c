/*
 * Traces the curves on which a programme keeps points of interest, and writes them as JSON:
 *
 *     "curves": [{"point": , "axes": [0, 1], "closed": true, "path": [x, y, x, y, ...]}, ...]
 *
 * Each position row that is a formula in two components of one point, and in nothing else, defines a curve
 * through the point at the start of the motion. It is computed by steps along the tangent of phi(x, y) = 0,
 * each corrected by Newton's method.
 */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>

/* Steps are a hundredth of the largest coordinate; at most STEPS_MOST each way, OPEN_MOST on an open curve.
 */
enum { STEPS_MOST = 800, OPEN_MOST = 150, STEPS_OF_SIZE = 100, CORRECTIONS = 4, AXES = 2 };

static const double difference = 1e-5; /* step of a numerical derivative, relative to the size */

struct programme_curve {
    struct generation *generation;
    expression residual;
    int point, axes[AXES];
    double at[AXES], size;
    double path[2][STEPS_MOST][AXES]; /* forward and backward */
    int count[2];
    bool is_closed;
};

/* ---- The formula ---- */

/* Returns whether the symbol is a number or a component of the curve's point; the first component determines
 * the point. */
static bool take_symbol(struct programme_curve *curve, const struct symbol *symbol, bool has_axis[static 3]) {
    const struct model *model = &curve->generation->model;
    if (symbol->kind == SYMBOL_PARAMETER) {
        const struct parameter *parameter = &model->parameters[symbol->index];
        return parameter->is_given || !parameter->is_late;
    }
    if (symbol->kind != SYMBOL_POINT || symbol->order > 0 || symbol->index / 3 >= model->point_count)
        return false;
    if (curve->point >= 0 && curve->point != symbol->index / 3)
        return false;
    curve->point = symbol->index / 3;
    has_axis[symbol->index % 3] = true;
    return true;
}

static bool is_curve(struct programme_curve *curve) {
    bool has_axis[3] = {false};
    int count, axes = 0;
    const expression *symbols = rewrite_list_symbols(&curve->generation->graph, curve->residual, &count);
    curve->point = -1;
    for (int i = 0; i < count; i++)
        if (!take_symbol(curve, expr_as_symbol(&curve->generation->graph, symbols[i]), has_axis))
            return false;
    for (int axis = 0; axis < 3; axis++)
        if (has_axis[axis] && axes++ < AXES)
            curve->axes[axes - 1] = axis;
    return axes == AXES;
}

static double symbol_value(void *context, const struct symbol *symbol) {
    const struct programme_curve *curve = context;
    if (symbol->kind == SYMBOL_PARAMETER)
        return curve->generation->model.parameters[symbol->index].value;
    return curve->at[symbol->index % 3 == curve->axes[0] ? 0 : 1];
}

static double residual(struct programme_curve *curve, const double at[AXES]) {
    curve->at[0] = at[0];
    curve->at[1] = at[1];
    return rewrite_evaluate(&curve->generation->graph, curve->residual, symbol_value, curve);
}

static void find_gradient(struct programme_curve *curve, const double at[AXES], double gradient[AXES]) {
    const double h = difference * curve->size;
    for (int i = 0; i < AXES; i++) {
        double above[AXES] = {at[0], at[1]}, below[AXES] = {at[0], at[1]};
        above[i] += h;
        below[i] -= h;
        gradient[i] = (residual(curve, above) - residual(curve, below)) / (2 * h);
    }
}

/* ---- The curve ---- */

/* Moves `at` to the nearest place with phi = 0; returns false if there is none near. */
static bool correct(struct programme_curve *curve, double at[AXES]) {
    const double begin[AXES] = {at[0], at[1]};
    for (int i = 0; i < CORRECTIONS; i++) {
        double g[AXES];
        find_gradient(curve, at, g);
        const double phi = residual(curve, at), square = g[0] * g[0] + g[1] * g[1];
        for (int k = 0; k < AXES; k++)
            at[k] -= phi * g[k] / square;
    }
    return hypot(at[0] - begin[0], at[1] - begin[1]) < curve->size / STEPS_OF_SIZE;
}

/* Takes one step in the direction of the last one. */
static bool step(struct programme_curve *curve, double at[AXES], double way[AXES]) {
    double g[AXES];
    find_gradient(curve, at, g);
    const double length = hypot(g[0], g[1]), sign = -g[1] * way[0] + g[0] * way[1] < 0 ? -1 : 1;
    way[0] = -sign * g[1] / length;
    way[1] = sign * g[0] / length;
    for (int k = 0; k < AXES; k++)
        at[k] += way[k] * curve->size / STEPS_OF_SIZE;
    return correct(curve, at);
}

/* Traces one side from the start, until it returns there or the curve ends. */
static void trace(struct programme_curve *curve, int side, const double start[AXES],
                  const double way_of_start[AXES]) {
    double at[AXES] = {start[0], start[1]}, way[AXES] = {way_of_start[0], way_of_start[1]};
    const double near = 0.6 * curve->size / STEPS_OF_SIZE;
    int count = 0;
    while (count < STEPS_MOST && !curve->is_closed && step(curve, at, way)) {
        curve->path[side][count][0] = at[0];
        curve->path[side][count++][1] = at[1];
        curve->is_closed = count > 2 && hypot(at[0] - start[0], at[1] - start[1]) < near;
    }
    curve->count[side] = count;
}

/* ---- JSON ---- */

static void put_place(FILE *out, const double at[AXES], const char **separator) {
    for (int k = 0; k < AXES; k++) {
        fputs(*separator, out);
        view_put_length(out, at[k]);
        *separator = ",";
    }
}

static void put_curve(FILE *out, const struct programme_curve *curve, const double start[AXES]) {
    const char *separator = "";
    fprintf(out, "{\"point\":%d,\"axes\":[%d,%d],\"closed\":%s,\"path\":[", curve->point, curve->axes[0],
            curve->axes[1], curve->is_closed ? "true" : "false");
    for (int i = curve->count[1] - 1; i >= 0; i--)
        put_place(out, curve->path[1][i], &separator);
    put_place(out, start, &separator);
    for (int i = 0; i < curve->count[0]; i++)
        put_place(out, curve->path[0][i], &separator);
    fputs("]}", out);
}

/* Traces the curve through the first row that is kept, where the motion begins. */
static bool trace_curve(struct programme_curve *curve, const struct run *run, double start[AXES]) {
    double g[AXES];
    curve->size = 0;
    for (int k = 0; k < AXES; k++) {
        const int column = run->points[curve->point] + curve->axes[k];
        start[k] = run->kept[column];
        curve->size = fmax(curve->size, run->largest[column]);
    }
    if (!correct(curve, start))
        return false;
    find_gradient(curve, start, g);
    trace(curve, 0, start, (const double[AXES]){-g[1], g[0]});
    if (curve->is_closed)
        return true;
    trace(curve, 1, start, (const double[AXES]){g[1], -g[0]});
    for (int side = 0; side < 2; side++)
        curve->count[side] = curve->count[side] < OPEN_MOST ? curve->count[side] : OPEN_MOST;
    return true;
}

void view_programme_curves_put(FILE *out, struct generation *generation, const struct run *run) {
    const struct model *model = &generation->model;
    const char *separator = "\n";
    fputs("\"curves\":[", out);
    for (int i = 0; i < model->row_count; i++) {
        struct programme_curve *curve = format_allocate(1, sizeof *curve);
        double start[AXES];
        curve->generation = generation;
        curve->residual = model->rows[i].residual;
        if (model->rows[i].is_closure || model->rows[i].level != ROW_POSITION || !is_curve(curve) ||
            curve->point >= run->point_count || !trace_curve(curve, run, start))
            continue;
        fputs(separator, out);
        put_curve(out, curve, start);
        separator = ",\n";
    }
    fputs("]", out);
}
