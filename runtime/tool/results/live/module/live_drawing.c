/* What a live page draws in addition to the rows of a motion: the numbers of the drawn model, the parts of
 * the applied forces, curves of the programme. */
#include "runtime/tool/results/live/module/live_module.h"

#include <math.h>
#include <string.h>

/* ---- The drawn model ---- */

/* Values of the drawing's parameters, as the motion has them. */
static void read_parameters(struct live *live) {
    const struct refdyn_model *model = live->work.model;
    for (int i = 0; i < live_model.parameter_count; i++) {
        const struct live_parameter *parameter = &live_model.parameters[i];
        const int place = refdyn_find_name(model->parameters, model->parameter_count, parameter->name);
        live->parameters[i] = place < 0 ? parameter->value : live->work.p[place];
    }
}

static void put_shape(const struct shape *shape, bool is_drawn, double *out) {
    out[0] = is_drawn ? (double)shape->kind : -1;
    out[1] = shape->bore;
    memcpy(out + 2, shape->axes, sizeof shape->axes);
    memcpy(out + 11, shape->origin, sizeof shape->origin);
}

/* Returns the numbers that the shape has used. */
static int draw_shape(const double *numbers, int places, double *out) {
    struct shape shape;
    if (places < 0) {
        struct drawn_element element;
        memcpy(&element, numbers, sizeof element);
        shape = view_shape_of_element(&element);
        put_shape(&shape, true, out);
        return DRAWN_ELEMENT_NUMBERS;
    }
    struct drawn_solid solid;
    memcpy(&solid, numbers, sizeof solid);
    const bool is_drawn = view_shape_of_solid(&solid, numbers + DRAWN_SOLID_NUMBERS, places, &shape);
    put_shape(&shape, is_drawn, out);
    return DRAWN_SOLID_NUMBERS + 3 * places;
}

void live_draw(struct live *live) {
    read_parameters(live);
    live_model.numbers(live->parameters, live->numbers);
    const double *numbers = live->numbers + live_model.shape_start;
    double *out = live->numbers + live_model.number_count;
    for (int i = 0; i < live_model.shape_count; i++, out += LIVE_SHAPE_NUMBERS)
        numbers += draw_shape(numbers, live_model.shape_places[i], out);
}

/* The numbers of the drawn model, then LIVE_SHAPE_NUMBERS of each shape. */
EXPORT(live_drawing) const double *live_drawing(struct live *live) {
    return live->numbers;
}

void live_add_applied(struct live *live) {
    const struct refdyn_integrator *integrator = &live->integrator;
    const struct refdyn_workspace *work = &live->work;
    const struct refdyn_model *model = work->model;
    double *r = live->points, *rd = r + 3 * model->point_count;
    if (live_model.applied_count == 0)
        return;
    if (model->point_count > 0) {
        model->r(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, r);
        model->rd(work->p, work->x, integrator->t_right, integrator->q, integrator->qd, rd);
    }
    live_model.applied(live->parameters, work->x, integrator->t, integrator->q, integrator->qd, r, rd,
                       live->applied + live->row_count * live_model.applied_count);
}

/* ---- Curves of the programme ---- */

struct tracing {
    struct live *live;
    int curve;
};

static double curve_residual(void *context, const double at[DRAWN_CURVE_AXES]) {
    const struct tracing *tracing = context;
    struct live *live = tracing->live;
    const struct live_curve *curve = &live_model.curves[tracing->curve];
    for (int k = 0; k < DRAWN_CURVE_AXES; k++)
        live->points[3 * curve->point + curve->axes[k]] = at[k];
    live_model.curve_residuals(live->parameters, live->points, live->residuals);
    return live->residuals[tracing->curve];
}

/* Traces the curve through the point in the first row. Returns the number of places in `places`, 0 without a
 * curve near the point. */
EXPORT(live_trace_curve) int live_trace_curve(struct live *live, int number) {
    const struct live_curve *curve = &live_model.curves[number];
    struct tracing tracing = {live, number};
    double start[DRAWN_CURVE_AXES], size = 0;
    /* Points follow the state: r, rd and rdd of each. */
    const int first = live->table.ends[RECORD_STATE] + 9 * curve->point;
    for (int k = 0; k < DRAWN_CURVE_AXES; k++) {
        start[k] = live->rows[first + curve->axes[k]];
        for (long row = 0; row < live->row_count; row++)
            size = fmax(size, fabs(live->rows[row * live_column_count(live) + first + curve->axes[k]]));
    }
    live->curve = (struct drawn_curve){.residual = curve_residual, .context = &tracing, .size = size};
    return view_trace_curve(&live->curve, start) ? view_list_curve(&live->curve, start, live->places) : 0;
}

EXPORT(live_curve_count) int live_curve_count(struct live *live) {
    (void)live;
    return live_model.curve_count;
}

/* The point, its two axes; 1 if the last curve is closed. */
EXPORT(live_curve_fact) int live_curve_fact(struct live *live, int number, int fact) {
    const struct live_curve *curve = &live_model.curves[number];
    return fact == 0 ? curve->point : fact < 3 ? curve->axes[fact - 1] : live->curve.is_closed;
}

/* Pairs of coordinates of the last curve. */
EXPORT(live_curve_places) const double *live_curve_places(struct live *live) {
    return live->places[0];
}
