/* Writes a model for the page as JSON: frames, shapes, sticks, points and closures. */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"
#include "gen/tree/tree.h"

#include <string.h>

struct list {
    FILE *out;
    struct generation *generation;
    int count;
};

static double value_of(const struct list *list, expression e) {
    return parameters_evaluate(list->generation->model.graph, list->generation->model.parameters, e);
}

static struct list open_list(FILE *out, struct generation *generation, const char *name) {
    fprintf(out, "\"%s\":[", name);
    return (struct list){out, generation, 0};
}

static void next(struct list *list) {
    fputs(list->count++ ? ",\n" : "\n", list->out);
}

static void close_list(const struct list *list) {
    fputs("]", list->out);
}

static void put_position(const struct list *list, const expression position[3]) {
    for (int i = 0; i < 3; i++) {
        fputs(i ? "," : "", list->out);
        view_put_length(list->out, value_of(list, position[i]));
    }
}

static void put_fixed(const struct list *list, const struct fixed_frame *at) {
    fprintf(list->out, "\"frame\":%d,\"at\":[", at->frame);
    put_position(list, at->placement.position);
    fputs("]}", list->out);
}

/* ---- Frames ---- */

static bool is_turned(const struct placement *placement) {
    const struct placement identity = placement_identity();
    return memcmp(placement->rotation, identity.rotation, sizeof identity.rotation) != 0;
}

static void put_frame(struct list *list, const struct frame *frame) {
    next(list);
    fprintf(list->out, "[%d,%d,%d,%d,", frame->parent, frame->link, frame->element,
            frame->joint.axis + (frame->joint.is_revolute ? 3 : 0));
    put_position(list, frame->placement.position);
    for (int i = 0; i < 9 && is_turned(&frame->placement); i++) {
        fputc(',', list->out);
        view_put_cosine(list->out, value_of(list, frame->placement.rotation[i]));
    }
    fputc(']', list->out);
}

static void put_frames(FILE *out, struct generation *generation) {
    const struct tree *tree = &generation->tree;
    struct list list = open_list(out, generation, "frames");
    for (int i = 0; i < tree->count; i++)
        put_frame(&list, &tree->frames[i]);
    close_list(&list);
}

static void put_names(FILE *out, struct generation *generation) {
    struct list names = open_list(out, generation, "coordinates");
    for (int i = 0; i < generation->tree.count; i++) {
        fputs(names.count++ ? "," : "", out);
        format_json_text(out, generation->tree.frames[i].name);
    }
    close_list(&names);
    fputs(",\n", out);
    names = open_list(out, generation, "links");
    for (int i = 0; i < generation->model.link_count; i++) {
        fputs(names.count++ ? "," : "", out);
        format_json_text(out, generation->model.links[i].name);
    }
    close_list(&names);
}

/* ---- Shapes and sticks ---- */

static void put_shape(void *context, const struct shape *shape) {
    struct list *list = context;
    next(list);
    fprintf(list->out, "[%d,%d,%d,%d,", (int)shape->kind, shape->frame, shape->link, shape->is_solid);
    view_put_length(list->out, shape->bore);
    for (int i = 0; i < 12; i++) {
        fputc(',', list->out);
        view_put_length(list->out, i < 9 ? shape->axes[i] : shape->origin[i - 9]);
    }
    fputc(']', list->out);
}

static void put_shapes(FILE *out, struct generation *generation) {
    struct list list = open_list(out, generation, "shapes");
    view_shapes_give(generation, put_shape, &list);
    close_list(&list);
}

/* A line from the frame's origin, or from the axis of a beam, to a place in the frame. */
static void put_stick(struct list *list, int frame, const expression to[3]) {
    const struct generation *generation = list->generation;
    if (frame < 0 || (to[0] == 0 && to[1] == 0 && to[2] == 0))
        return;
    const int link = generation->tree.frames[frame].link;
    next(list);
    fprintf(list->out, "[%d,%d,", frame, link);
    view_put_length(list->out, generation->model.links[link].beam.exists ? value_of(list, to[0]) : 0);
    fputs(",0,0,", list->out);
    put_position(list, to);
    fputc(']', list->out);
}

static void put_stick_to_solid(struct list *list, const struct fixed_frame *base, const struct solid *solid) {
    struct graph *g = list->generation->model.graph;
    struct placement centre = placement_identity();
    memcpy(centre.position, solid->center, sizeof centre.position);
    struct placement at = placement_compose(g, &base->placement, &solid->placement);
    at = placement_compose(g, &at, &centre);
    put_stick(list, base->frame, at.position);
}

static void put_sticks(FILE *out, struct generation *generation) {
    const struct tree *tree = &generation->tree;
    const struct model *model = &generation->model;
    struct list list = open_list(out, generation, "sticks");
    for (int i = 0; i < tree->count; i++)
        if (tree->frames[i].element == 0)
            put_stick(&list, tree->frames[i].parent, tree->frames[i].placement.position);
    for (int i = 0; i < model->marker_count; i++)
        if (!model->points[i].is_direction)
            put_stick(&list, tree->points[i].frame, tree->points[i].placement.position);
    for (int i = 0; i < model->link_count; i++)
        for (int k = 0; k < model->links[i].solid_count; k++)
            put_stick_to_solid(&list, &tree->carriers[i].base, &model->links[i].solids[k]);
    close_list(&list);
}

/* ---- Points and closures ---- */

static void put_points(FILE *out, struct generation *generation) {
    const struct model *model = &generation->model;
    struct list list = open_list(out, generation, "points");
    for (int i = 0; i < model->point_count; i++) {
        if (model->points[i].is_direction)
            continue;
        next(&list);
        fputs("{\"name\":", out);
        format_json_text(out, model->points[i].name);
        fputc(',', out);
        put_fixed(&list, &generation->tree.points[i]);
    }
    close_list(&list);
}

/* Marks the points in the formula of a row. */
static void mark_points(struct generation *generation, const struct row *row, bool *is_marked) {
    int count;
    const expression *symbols = rewrite_list_symbols(&generation->graph, row->residual, &count);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(&generation->graph, symbols[i]);
        if (symbol->kind == SYMBOL_POINT)
            is_marked[symbol->index / 3] = true;
    }
}

static void put_ends(struct list *list, const bool *is_marked) {
    const struct generation *generation = list->generation;
    struct list ends = open_list(list->out, list->generation, "ends");
    for (int i = 0; i < generation->model.marker_count; i++) {
        if (!is_marked[i] || generation->model.points[i].is_direction)
            continue;
        fputs(ends.count++ ? ",{" : "{", list->out);
        put_fixed(list, &generation->tree.points[i]);
    }
    close_list(&ends);
}

/* The rows of a closure are consecutive and have its path. */
static void put_closures(FILE *out, struct generation *generation) {
    const struct model *model = &generation->model;
    struct list list = open_list(out, generation, "closures");
    for (int first = 0, end; first < model->row_count; first = end) {
        bool *is_marked = memory_get(&generation->memory, (size_t)model->marker_count + 1);
        for (end = first; end < model->row_count && model->rows[end].path == model->rows[first].path; end++)
            mark_points(generation, &model->rows[end], is_marked);
        if (!model->rows[first].is_closure)
            continue;
        next(&list);
        fputs("{\"name\":", out);
        format_json_text(out, model->rows[first].name);
        fputc(',', out);
        put_ends(&list, is_marked);
        fputc('}', out);
    }
    close_list(&list);
}

void view_drawn_model_put(FILE *out, struct generation *generation) {
    static void (*const parts[])(FILE *, struct generation *) = {put_names,  put_frames, put_shapes,
                                                                 put_sticks, put_points, put_closures};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        fputs(i ? ",\n" : "", out);
        parts[i](out, generation);
    }
}
