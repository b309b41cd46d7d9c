/*
 * Writes a model for the page as JSON: frames with their joints, from which the page computes all placements,
 * and what is fixed to them: shapes, sticks, points, ends of closures.
 *
 *     "coordinates": ["base_z", ...]       the names, by frame
 *     "links": ["base", ...]
 *     "frames": [[parent, link, element, joint, x, y, z, (R11 R12 ... R33)], ...]
 *                joint 0 1 2: slides along x y z, 3 4 5: turns; T = T_parent A D(q); without R the axes are
 *                parallel to the parent's
 *     "shapes": [[kind, frame, link, is_solid, bore, m11 m12 ... m33, x, y, z], ...]    struct shape
 *     "sticks": [[frame, link, x, y, z, x, y, z], ...]                                  from, to
 *     "points": [{"name": , "frame": , "at": [x, y, z]}, ...]
 *     "closures": [{"name": , "ends": [{"frame": , "at": }, ...]}, ...]
 */
#include <string.h>

#include "gen/tree/tree.h"
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

struct list {
    FILE *out;
    struct generation *generation;
    struct drawn_tape *tape; /* NULL: none */
    int count;
};

static struct list open_list(FILE *out, struct generation *generation, struct drawn_tape *tape,
                             const char *name) {
    fprintf(out, "\"%s\":[", name);
    return (struct list){out, generation, tape, 0};
}

static void next(struct list *list) {
    fputs(list->count++ ? ",\n" : "\n", list->out);
}

static void close_list(const struct list *list) {
    fputs("]", list->out);
}

double view_tape_value(struct drawn_tape *tape, const struct generation *generation, expression e) {
    const struct model *model = &generation->model;
    if (tape) {
        tape->list =
            memory_room(&format_memory, tape->list, tape->count + 1, &tape->room, sizeof *tape->list);
        tape->list[tape->count++] = e;
    }
    return parameters_evaluate(model->graph, model->parameters, e);
}

static double value_of(const struct list *list, expression e) {
    return view_tape_value(list->tape, list->generation, e);
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

static void put_frames(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    const struct tree *tree = &generation->tree;
    struct list list = open_list(out, generation, tape, "frames");
    for (int i = 0; i < tree_joint_count(tree); i++)
        put_frame(&list, &tree->frames[i]);
    close_list(&list);
}

static void put_names(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    struct list names = open_list(out, generation, tape, "coordinates");
    for (int i = 0; i < tree_joint_count(&generation->tree); i++) {
        fputs(names.count++ ? "," : "", out);
        format_json_text(out, generation->tree.frames[i].name);
    }
    close_list(&names);
    fputs(",\n", out);
    names = open_list(out, generation, tape, "links");
    for (int i = 0; i < generation->model.link_count; i++) {
        fputs(names.count++ ? "," : "", out);
        format_json_text(out, generation->model.links[i].name);
    }
    close_list(&names);
}

/* ---- Shapes and sticks ---- */

static struct drawn_placement placement_of(const struct list *list, const struct placement *placement) {
    struct drawn_placement at;
    for (int i = 0; i < 9; i++)
        at.rotation[i] = value_of(list, placement->rotation[i]);
    for (int i = 0; i < 3; i++)
        at.position[i] = value_of(list, placement->position[i]);
    return at;
}

static void put_shape(struct list *list, const struct shape *shape, int frame, int link, bool is_solid) {
    next(list);
    fprintf(list->out, "[%d,%d,%d,%d,", (int)shape->kind, frame, link, is_solid);
    view_put_length(list->out, shape->bore);
    for (int i = 0; i < 12; i++) {
        fputc(',', list->out);
        view_put_length(list->out, i < 9 ? shape->axes[i] : shape->origin[i - 9]);
    }
    fputc(']', list->out);
}

/* Adds to the tape that the next numbers are those of a solid with `places`, or of an element (-1). */
static void mark_shape(const struct list *list, int places) {
    struct drawn_tape *tape = list->tape;
    if (!tape)
        return;
    if (tape->shape_count == 0)
        tape->shape_start = tape->count;
    tape->places = memory_room(&format_memory, tape->places, tape->shape_count + 1, &tape->shape_room,
                               sizeof *tape->places);
    tape->places[tape->shape_count++] = places;
}

static void put_element(struct list *list, int link, const struct segment *segment, int i) {
    const struct carrier *carrier = &list->generation->tree.carriers[link];
    mark_shape(list, -1);
    struct drawn_element element = {.at = placement_of(list, &carrier->elements[i].at.placement)};
    element.start = value_of(list, carrier->elements[i].start);
    element.end = value_of(list, carrier->elements[i + 1].start);
    element.area = value_of(list, segment->area);
    element.Iy = value_of(list, segment->Iy);
    element.Iz = value_of(list, segment->Iz);
    element.It = value_of(list, segment->It);
    const struct shape shape = view_shape_of_element(&element);
    put_shape(list, &shape, carrier->elements[i].at.frame, link, false);
}

static void put_beam(struct list *list, int link, const struct beam *beam) {
    int i = 0;
    for (int k = 0; k < beam->segment_count; k++)
        for (const int end = i + beam->segments[k].rfe; i < end; i++)
            put_element(list, link, &beam->segments[k], i);
}

/* The places that show the size of the links of a frame: their origins, the joints that they carry, points of
 * interest. Returns their number. */
static int list_places(const struct generation *generation, int frame, const expression **places) {
    const struct tree *tree = &generation->tree;
    const struct model *model = &generation->model;
    int count = 0;
    for (int i = 0; i < model->link_count; i++)
        if (tree->carriers[i].base.frame == frame)
            places[count++] = tree->carriers[i].base.placement.position;
    for (int i = 0; i < tree_joint_count(tree); i++)
        if (tree->frames[i].parent == frame)
            places[count++] = tree->frames[i].placement.position;
    for (int i = 0; i < model->point_count; i++)
        if (!model->points[i].is_direction && tree->points[i].frame == frame)
            places[count++] = tree->points[i].placement.position;
    return count;
}

static void put_solid(struct list *list, int link, const struct solid *solid) {
    const struct generation *generation = list->generation;
    const struct fixed_frame *base = &generation->tree.carriers[link].base;
    const size_t most =
        (size_t)(generation->model.link_count + generation->tree.count + generation->model.point_count);
    const expression **places = format_allocate(most, sizeof *places);
    const int count = list_places(generation, base->frame, places);
    double *numbers = format_allocate_matrix(count, 3);
    struct shape shape;
    mark_shape(list, count);
    struct drawn_solid drawn = {.mass = value_of(list, solid->mass)};
    for (int i = 0; i < 3; i++)
        drawn.centre[i] = value_of(list, solid->center[i]);
    for (int i = 0; i < 6; i++)
        drawn.inertia[i] = value_of(list, solid->inertia[i]);
    drawn.in_link = placement_of(list, &solid->placement);
    drawn.link = placement_of(list, &base->placement);
    for (int i = 0; i < 3 * count; i++)
        numbers[i] = value_of(list, places[i / 3][i % 3]);
    if (view_shape_of_solid(&drawn, numbers, count, &shape) || list->tape)
        put_shape(list, &shape, base->frame, link, true);
}

static void put_shapes(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    struct list list = open_list(out, generation, tape, "shapes");
    for (int i = 0; i < generation->model.link_count; i++) {
        const struct link *link = &generation->model.links[i];
        for (int k = 0; k < link->solid_count; k++)
            put_solid(&list, i, &link->solids[k]);
        if (link->beam.exists)
            put_beam(&list, i, &link->beam);
    }
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
    view_put_length(list->out, value_of(list, generation->model.links[link].beam.exists ? to[0] : EXPR_ZERO));
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

static void put_sticks(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    const struct tree *tree = &generation->tree;
    const struct model *model = &generation->model;
    struct list list = open_list(out, generation, tape, "sticks");
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

static void put_points(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    const struct model *model = &generation->model;
    struct list list = open_list(out, generation, tape, "points");
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
    struct list ends = open_list(list->out, list->generation, list->tape, "ends");
    for (int i = 0; i < generation->model.marker_count; i++) {
        if (!is_marked[i] || generation->model.points[i].is_direction)
            continue;
        fputs(ends.count++ ? ",{" : "{", list->out);
        put_fixed(list, &generation->tree.points[i]);
    }
    close_list(&ends);
}

/* The rows of a closure are consecutive and have its path. */
static void put_closures(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    const struct model *model = &generation->model;
    struct list list = open_list(out, generation, tape, "closures");
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

void view_drawn_model_put(FILE *out, struct generation *generation, struct drawn_tape *tape) {
    static void (*const parts[])(FILE *, struct generation *, struct drawn_tape *) = {
        put_names, put_frames, put_shapes, put_sticks, put_points, put_closures};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        fputs(i ? ",\n" : "", out);
        parts[i](out, generation, tape);
    }
}
