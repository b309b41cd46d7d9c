/*
 * Writes a run for the page as JSON: as many rows as one can see, in few digits, and the applied forces.
 *
 *     "t": {"unit": 1e-5, "steps": [0, 5000, ...]}        value = unit times the sum of the steps up to it
 *     "q": [{"unit": , "steps": }, ...]                   by frame; turns to 1e-5 rad or less, slides to five
 *                                                         digits of the largest
 *     "courses": [{"name": , "kind": , "unit": , "steps": }, ...]
 *                                                         residuals, energy, programme forces that are not 0
 *                                                         and always unique, inputs and courses, to four
 *                                                         digits of the largest
 *     "applied": [{"name": , "kind": "drive", "frame": , "parts": [{"unit": , "steps": }]},
 *                 {"name": , "kind": "force" or "torque", "frame": , "at": [x, y, z], "parts": [3 of them]}]
 */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Numbers of a page ---- */

void view_put_length(FILE *out, double value) {
    fprintf(out, "%.7g", isfinite(value) ? value + 0.0 : 0);
}

void view_put_cosine(FILE *out, double value) {
    const double unit = 1e8, rounded = round(value * unit) / unit;
    view_put_length(out, rounded == 0 ? 0 : rounded); /* no -0 */
}

/* The power of ten that leaves `digits` digits of the largest absolute value; 1 if that is 0. */
static double rounded_unit(double largest, int digits) {
    return largest > 0 && isfinite(largest) ? pow(10, floor(log10(largest)) + 1 - digits) : 1;
}

/* Writes values, `stride` apart in memory, as differences in whole units: "[3,0,-1]". The first one is
 * relative to 0. */
static void put_course(FILE *out, const double *values, long count, long stride, double unit) {
    long long before = 0;
    fputc('[', out);
    for (long i = 0; i < count; i++) {
        const long long now = llround(values[i * stride] / unit);
        fprintf(out, "%s%lld", i ? "," : "", now - before);
        before = now;
    }
    fputc(']', out);
}

/* ---- Rows, coordinates and courses ---- */

/* A screen has some thousand columns of pixels. All numbers together take about a megabyte. */
enum { ROWS_MOST = 1200, NUMBERS_MOST = 250000 };
enum { TIME_DIGITS = 7, SLIDE_DIGITS = 5, COURSE_DIGITS = 4 };

static const double turn_unit = 1e-5; /* [rad] */

struct drawn_rows view_drawn_run_rows(const struct run *run, int share) {
    const long width = run->column_count, room = NUMBERS_MOST / width / share;
    const long most = room < RUN_ROWS_LEAST ? RUN_ROWS_LEAST : room < ROWS_MOST ? room : ROWS_MOST;
    const long stride = (run->kept_count + most - 1) / most;
    struct drawn_rows rows = {.width = width};
    rows.values =
        format_allocate((size_t)(run->kept_count / stride + 2) * (size_t)width, sizeof *rows.values);
    for (long i = 0; i < run->kept_count; i++)
        if (i % stride == 0 || i == run->kept_count - 1)
            memcpy(rows.values + rows.count++ * width, run->kept + i * width,
                   (size_t)width * sizeof *rows.values);
    return rows;
}

static void put_numbers(FILE *out, const struct drawn_rows *rows, int column, double unit) {
    fprintf(out, "\"unit\":%.9g,\"steps\":", unit);
    put_course(out, rows->values + column, rows->count, rows->width, unit);
    fputc('}', out);
}

static double unit_of_coordinate(const struct run *run, int column, bool is_revolute) {
    return is_revolute ? fmin(turn_unit, rounded_unit(run->largest[column], COURSE_DIGITS))
                       : rounded_unit(run->largest[column], SLIDE_DIGITS);
}

static void put_coordinate_rows(FILE *out, const struct run *run, const struct tree *tree,
                                const struct drawn_rows *rows) {
    fputs("\"q\":[", out);
    for (int i = 0; i < tree_joint_count(tree); i++) {
        const int column = run->coordinates + i;
        fputs(i ? ",\n{" : "\n{", out);
        put_numbers(out, rows, column, unit_of_coordinate(run, column, tree->frames[i].joint.is_revolute));
    }
    fputs("],\n", out);
}

/* The kind of a column after the points, NULL if it is not drawn. */
static const char *kind_of(const struct run *run, int column) {
    const char *name = run->columns[column];
    const bool is_force = column >= run->forces && column < run->forces + run->force_count;
    if (is_force)
        return run->largest[column] > 0 && !run->is_open[column] ? "force" : NULL;
    if (column == run->energy)
        return "energy";
    if (column >= run->inputs)
        return "course";
    return strncmp(name, "phi_", 4) == 0 ? "phi" : strncmp(name, "psi_", 4) == 0 ? "psi" : NULL;
}

static void put_courses(FILE *out, const struct run *run, const struct drawn_rows *rows) {
    enum { POINT_COLUMNS = 9 };
    const int first = run->coordinates + 2 * run->coordinate_count + POINT_COLUMNS * run->point_count;
    const char *separator = "\n";
    fputs("\"courses\":[", out);
    for (int i = first; i < run->column_count; i++) {
        const char *kind = kind_of(run, i);
        if (!kind)
            continue;
        fprintf(out, "%s{\"name\":", separator);
        format_json_text(out, run->columns[i]);
        fprintf(out, ",\"kind\":\"%s\",", kind);
        put_numbers(out, rows, i, rounded_unit(run->largest[i], COURSE_DIGITS));
        separator = ",\n";
    }
    fputs("]", out);
}

void view_drawn_run_put(FILE *out, const struct run *run, const struct tree *tree,
                        const struct drawn_rows *rows) {
    fputs("\"t\":{", out);
    put_numbers(out, rows, 0, rounded_unit(run->largest[0], TIME_DIGITS));
    fputs(",\n", out);
    put_coordinate_rows(out, run, tree, rows);
    put_courses(out, run, rows);
}

static void put_bound(FILE *out, const char *key, double bound) {
    if (isfinite(bound))
        fprintf(out, ",\"%s\":%.9g", key, bound);
    else
        fprintf(out, ",\"%s\":null", key);
}

void view_bounds_put(FILE *out, const struct model *model) {
    fputs("\"bounds\":[", out);
    for (int i = 0; i < model->bound_count; i++) {
        fprintf(out, "%s{\"column\":", i ? "," : "");
        format_json_text(out, model->bounds[i].column);
        put_bound(out, "from", model->bounds[i].from);
        put_bound(out, "to", model->bounds[i].to);
        fputc('}', out);
    }
    fputc(']', out);
}

/* ---- Applied forces ---- */

/* Drives on coordinates, and forces and torques at points. The model's formulas are evaluated at the
 * coordinates, rates, inputs and points of the rows, to four digits of the largest. A force is omitted if it
 * is 0 throughout, or if its formula needs something else: points that are no points of interest, or values
 * of a start that was not given. */

enum { DIGITS = 4, POINT_RATE = 3 /* columns from a point's position to its velocity */ };

/* The values of formulas, row by row. */
struct valuation {
    struct generation *generation;
    const struct run *run;
    const struct drawn_rows *rows;
    bool *is_needed; /* by node */
    double *node;    /* (number of nodes) values at one row */
    double *list;    /* (rows x formula_count) */
    const expression *formulas;
    int formula_count;
};

/* ---- Values of formulas ---- */

/* The column of an input or, with lead "state", of a state; -1 if there is none. */
static int input_column(const struct run *run, const char *name, const char *lead) {
    const char *const *columns = (const char *const *)run->columns + run->inputs;
    const int plain = text_index(name, columns, run->input_count);
    const int place =
        plain < 0 ? text_index(format_text("%s_%s", lead, name), columns, run->input_count) : plain;
    return place < 0 ? -1 : run->inputs + place;
}

/* Returns whether the rows determine the symbol, and sets *value to its value in `row`. */
static bool symbol_value(const struct valuation *valuation, const struct symbol *symbol, const double *row,
                         double *value) {
    const struct model *model = &valuation->generation->model;
    const struct run *run = valuation->run;
    int column = -1;
    if (symbol->kind == SYMBOL_PARAMETER) {
        const struct parameter *parameter = &model->parameters[symbol->index];
        *value = parameter->value;
        return parameter->is_given || !parameter->is_late;
    }
    if (symbol->kind == SYMBOL_TIME)
        column = 0;
    else if (symbol->kind == SYMBOL_COORDINATE && symbol->index >= run->coordinate_count)
        column = input_column(run, valuation->generation->tree.frames[symbol->index].name, "state");
    else if (symbol->kind == SYMBOL_COORDINATE && symbol->order <= 1)
        column = run->coordinates + symbol->order * run->coordinate_count + symbol->index;
    else if (symbol->kind == SYMBOL_POINT && symbol->order <= 1 && symbol->index / 3 < run->point_count)
        column = run->points[symbol->index / 3] + POINT_RATE * symbol->order + symbol->index % 3;
    else if (symbol->kind == SYMBOL_INPUT)
        column = input_column(run, model->inputs[symbol->index].name, "input");
    *value = column < 0 ? 0 : row[column];
    return column >= 0;
}

static bool is_known(const struct valuation *valuation, expression formula) {
    struct graph *g = &valuation->generation->graph;
    int count;
    double value;
    const expression *symbols = rewrite_list_symbols(g, formula, &count);
    for (int i = 0; i < count; i++)
        if (!symbol_value(valuation, expr_as_symbol(g, symbols[i]), valuation->rows->values, &value))
            return false;
    return true;
}

static void value_row(const struct valuation *valuation, long row) {
    const struct graph *g = &valuation->generation->graph;
    const double *numbers = valuation->rows->values + row * valuation->rows->width;
    for (expression e = 0; e < g->count; e++) {
        const struct symbol *symbol = expr_as_symbol(g, e);
        if (valuation->is_needed[e] && symbol)
            symbol_value(valuation, symbol, numbers, &valuation->node[e]);
        else if (valuation->is_needed[e] && !expr_is_number(g, e, &valuation->node[e]))
            valuation->node[e] = graph_node_value(g, e, valuation->node);
    }
    for (int i = 0; i < valuation->formula_count; i++)
        valuation->list[row * valuation->formula_count + i] = valuation->node[valuation->formulas[i]];
}

static void value_all(struct valuation *valuation) {
    const struct graph *g = &valuation->generation->graph;
    valuation->is_needed = format_allocate_large(g->count, sizeof *valuation->is_needed);
    valuation->node = format_allocate_large(g->count, sizeof *valuation->node);
    valuation->list = format_allocate_large(
        (size_t)valuation->rows->count * (size_t)valuation->formula_count + 1, sizeof *valuation->list);
    for (int i = 0; i < valuation->formula_count; i++)
        valuation->is_needed[valuation->formulas[i]] = true;
    rewrite_mark_operands(g, valuation->is_needed, g->count);
    for (long row = 0; row < valuation->rows->count; row++)
        value_row(valuation, row);
}

static void release(const struct valuation *valuation) {
    free(valuation->is_needed);
    free(valuation->node);
    free(valuation->list);
}

/* ---- Forces ---- */

static double largest_of(const struct valuation *valuation, int first, int count) {
    double largest = 0;
    for (long row = 0; row < valuation->rows->count; row++)
        for (int i = first; i < first + count; i++)
            largest = fmax(largest, fabs(valuation->list[row * valuation->formula_count + i]));
    return largest;
}

/* first: index of its first formula. */
static void put_applied(FILE *out, const struct valuation *valuation, const struct applied_force *applied,
                        int first) {
    struct model *model = &valuation->generation->model;
    const double unit = rounded_unit(largest_of(valuation, first, applied->count), DIGITS);
    fputs("{\"name\":", out);
    format_json_text(out, applied->name);
    fprintf(out, ",\"kind\":\"%s\",\"frame\":%d,\"at\":[", applied->kind, applied->at.frame);
    for (int i = 0; i < 3; i++) {
        fputs(i ? "," : "", out);
        view_put_length(
            out, parameters_evaluate(model->graph, model->parameters, applied->at.placement.position[i]));
    }
    fputs("],\"parts\":[", out);
    for (int i = 0; i < applied->count; i++) {
        fprintf(out, "%s{\"unit\":%.9g,\"steps\":", i ? "," : "", unit);
        put_course(out, valuation->list + first + i, valuation->rows->count, valuation->formula_count, unit);
        fputc('}', out);
    }
    fputs("]}", out);
}

static struct applied_force drive_of(const struct generation *generation, int i) {
    const struct force *force = &generation->model.forces[i];
    return (struct applied_force){.name = generation->tree.frames[force->coordinate].name,
                                  .kind = "drive",
                                  .at = {.frame = force->coordinate},
                                  .values = &force->value,
                                  .count = 1};
}

static struct applied_force load_of(const struct generation *generation, int i) {
    const struct load *load = &generation->model.loads[i];
    return (struct applied_force){.name = generation->model.points[load->point].name,
                                  .kind = load->is_torque ? "torque" : "force",
                                  .at = generation->tree.points[load->point],
                                  .values = load->value,
                                  .count = 3};
}

bool view_applied_force(const struct generation *generation, int i, struct applied_force *force) {
    const int drives = generation->model.force_count - generation->model.state_count,
              all = drives + generation->model.load_count;
    if (i < all)
        *force = i < drives ? drive_of(generation, i) : load_of(generation, i - drives);
    return i < all;
}

/* Lists the forces that the rows determine; *formula_count becomes the number of their formulas. */
static int list_known(const struct valuation *valuation, struct applied_force *list, int *formula_count) {
    struct applied_force applied;
    int count = 0;
    *formula_count = 0;
    for (int i = 0; view_applied_force(valuation->generation, i, &applied); i++) {
        bool is_one = true;
        for (int k = 0; k < applied.count; k++)
            is_one = is_one && is_known(valuation, applied.values[k]);
        if (is_one)
            list[count++] = applied;
        *formula_count += is_one ? applied.count : 0;
    }
    return count;
}

void view_applied_forces_put(FILE *out, struct generation *generation, const struct run *run,
                             const struct drawn_rows *rows) {
    const struct model *model = &generation->model;
    struct valuation valuation = {.generation = generation, .run = run, .rows = rows};
    struct applied_force *list =
        format_allocate((size_t)(model->force_count + model->load_count) + 1, sizeof *list);
    const int count = list_known(&valuation, list, &valuation.formula_count);
    expression *formulas = format_allocate((size_t)valuation.formula_count + 1, sizeof *formulas),
               *next = formulas;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < list[i].count; k++)
            *next++ = list[i].values[k];
    valuation.formulas = formulas;
    value_all(&valuation);
    const char *separator = "\n";
    fputs("\"applied\":[", out);
    for (int i = 0, first = 0; i < count; first += list[i++].count) {
        if (largest_of(&valuation, first, list[i].count) == 0)
            continue;
        fputs(separator, out);
        put_applied(out, &valuation, &list[i], first);
        separator = ",\n";
    }
    fputs("]", out);
    release(&valuation);
}
