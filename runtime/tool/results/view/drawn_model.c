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
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "gen/tree/tree.h"
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

/*
 * Represents the bodies of a model by balls, cylinders and boxes.
 *
 * Shapes have unit size (a ball of diameter 1; a cylinder and a box along x with length and width 1) and a
 * map from their axes to those of a frame. A box and a cylinder begin at x = 0 and are centred on the x axis;
 * a ball has its centre at 0.
 *
 * A section is known only by its area and second moments. A round section or a tube, with D^2 - d^2 = 4 A /
 * pi and D^2 + d^2 = 16 I / A, is recognised by It = Iy + Iz. Any other section is drawn as the rectangle
 * with the same radii of gyration.
 *
 * A solid is drawn as the homogeneous one with its mass and inertia. Let S = int x x^T dm / m = (tr J / 2 1 -
 * J) / m in principal axes. If all three S are equal it is a ball (S = D^2 / 20); if two are equal, a
 * cylinder (S = D^2 / 16 across, L^2 / 12 along); otherwise a box (S = L^2 / 12). Sides that the inertia
 * leaves open have the length that gives the mass of steel.
 *
 * A density below a tenth of water's does not look like the link: it comes from guessed inertias or from
 * another unit. Such a solid is drawn no larger than the reach of what its frame carries from its centre, but
 * not smaller than with the density of water.
 */

enum shape_kind { SHAPE_BALL, SHAPE_CYLINDER, SHAPE_BOX };

struct shape {
    enum shape_kind kind;
    int frame; /* of the tree, -1 for the ground */
    int link;
    bool is_solid;    /* otherwise an element of a beam */
    double bore;      /* for a cylinder, inner over outer diameter */
    double axes[9];   /* row-major: columns are the images of the unit axes [m] */
    double origin[3]; /* [m] */
};

static const double pi = 3.14159265358979323846, steel = 7850, water = 1000, airy = 100; /* [kg/m^3] */
static const double alike = 1e-6; /* relative difference of values that are equal within rounding */

struct giver {
    const struct generation *generation;
    void (*take)(void *context, const struct shape *shape);
    void *context;
};

static double value_of(const struct generation *generation, expression e) {
    return parameters_evaluate(generation->model.graph, generation->model.parameters, e);
}

static bool is_alike(double a, double b) {
    return fabs(a - b) <= alike * fmax(fabs(a), fabs(b));
}

/* Maps the shape from placed axes to the axes in which these are placed. */
static void place(const struct giver *giver, const struct placement *at, struct shape *shape) {
    const struct shape inner = *shape;
    memset(shape->axes, 0, sizeof shape->axes);
    for (int i = 0; i < 3; i++) {
        shape->origin[i] = value_of(giver->generation, at->position[i]);
        for (int k = 0; k < 3; k++) {
            const double r = value_of(giver->generation, at->rotation[3 * i + k]);
            shape->origin[i] += r * inner.origin[k];
            for (int j = 0; j < 3; j++)
                shape->axes[3 * i + j] += r * inner.axes[3 * k + j];
        }
    }
}

static void give_on(const struct giver *giver, const struct fixed_frame *at, struct shape shape) {
    place(giver, &at->placement, &shape);
    shape.frame = at->frame;
    giver->take(giver->context, &shape);
}

/* ---- Beams ---- */

static struct shape section_shape(const struct giver *giver, const struct segment *segment) {
    const double A = value_of(giver->generation, segment->area),
                 Iy = value_of(giver->generation, segment->Iy), Iz = value_of(giver->generation, segment->Iz),
                 It = value_of(giver->generation, segment->It);
    struct shape shape = {.kind = SHAPE_BOX};
    double across[2] = {sqrt(12 * Iz / A), sqrt(12 * Iy / A)};
    if (is_alike(Iy, Iz) && is_alike(It, Iy + Iz)) {
        const double sum = 16 * Iy / A, difference = 4 * A / pi;
        const double outer = (sum + difference) / 2, inner = (sum - difference) / 2;
        shape.kind = SHAPE_CYLINDER;
        across[0] = across[1] = sqrt(outer);
        shape.bore = inner > alike * outer ? sqrt(inner / outer) : 0;
    }
    shape.axes[4] = across[0];
    shape.axes[8] = across[1];
    return shape;
}

static void give_beam(const struct giver *giver, int link, const struct beam *beam) {
    const struct carrier *carrier = &giver->generation->tree.carriers[link];
    int i = 0;
    for (int k = 0; k < beam->segment_count; k++) {
        struct shape shape = section_shape(giver, &beam->segments[k]);
        shape.link = link;
        for (const int end = i + beam->segments[k].rfe; i < end; i++) {
            shape.axes[0] = value_of(giver->generation, carrier->elements[i + 1].start) -
                            value_of(giver->generation, carrier->elements[i].start);
            give_on(giver, &carrier->elements[i].at, shape);
        }
    }
}

/* ---- Solids ---- */

static double distance_to(const struct giver *giver, const expression place[3], const double from[3]) {
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double apart = value_of(giver->generation, place[i]) - from[i];
        square += apart * apart;
    }
    return sqrt(square);
}

/* Computes the principal axes of J as columns of a right-handed system, and S along them. */
static void find_spread(const struct giver *giver, const struct solid *solid, double mass, double axes[9],
                        double S[3]) {
    const expression *J = solid->inertia;
    const int index[9] = {0, 3, 4, 3, 1, 5, 4, 5, 2}; /* xx yy zz xy xz yz */
    double moments[3];
    for (int i = 0; i < 9; i++)
        axes[i] = value_of(giver->generation, J[index[i]]);
    if (LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'V', 'U', 3, axes, 3, moments) != 0)
        memset(axes, 0, 9 * sizeof *axes);
    const double half_trace = (moments[0] + moments[1] + moments[2]) / 2;
    for (int i = 0; i < 3; i++)
        S[i] = (half_trace - moments[i]) / mass;
    for (int i = 0; i < 3; i++)
        axes[3 * i + 2] = axes[3 * ((i + 1) % 3)] * axes[3 * ((i + 2) % 3) + 1] -
                          axes[3 * ((i + 2) % 3)] * axes[3 * ((i + 1) % 3) + 1];
}

/* The axis whose S differs from two equal ones, -1 if there is none. */
static int odd_axis(const double S[3]) {
    for (int i = 0; i < 3; i++)
        if (is_alike(S[(i + 1) % 3], S[(i + 2) % 3]))
            return i;
    return -1;
}

/* Chooses the sides that are 0 so that the box has the volume. */
static void fill_sides(double sides[3], double volume) {
    int unknown = 0;
    for (int i = 0; i < 3; i++) {
        unknown += sides[i] == 0;
        volume /= sides[i] > 0 ? sides[i] : 1;
    }
    for (int i = 0; i < 3; i++)
        sides[i] = sides[i] > 0 ? sides[i] : pow(volume, 1.0 / unknown);
}

static enum shape_kind kind_of(const double S[3], int odd) {
    if (odd < 0)
        return SHAPE_BOX;
    return is_alike(S[odd], S[(odd + 1) % 3]) ? SHAPE_BALL : SHAPE_CYLINDER;
}

/* Computes the lengths along the shape's x y z, which are the principal axes from `first` on. */
static void find_sides(enum shape_kind kind, const double S[3], int first, double volume, double sides[3]) {
    static const double spread[] = {[SHAPE_BALL] = 20, [SHAPE_CYLINDER] = 16, [SHAPE_BOX] = 12};
    for (int i = 0; i < 3; i++) {
        const double s = S[(first + i) % 3];
        const double part = spread[kind == SHAPE_CYLINDER && i == 0 ? SHAPE_BOX : kind];
        sides[i] = s > alike * fmax(S[0], fmax(S[1], S[2])) ? sqrt(part * s) : 0;
    }
    fill_sides(sides, volume);
}

/* The largest distance from a place in a frame to places that show the size of its links: their origins, the
 * joints that they carry, points of interest. */
static double reach_from(const struct giver *giver, const struct fixed_frame *base, const double centre[3]) {
    const struct tree *tree = &giver->generation->tree;
    const struct model *model = &giver->generation->model;
    double reach = 0;
    for (int i = 0; i < model->link_count; i++)
        if (tree->carriers[i].base.frame == base->frame)
            reach = fmax(reach, distance_to(giver, tree->carriers[i].base.placement.position, centre));
    for (int i = 0; i < tree->count; i++)
        if (tree->frames[i].parent == base->frame)
            reach = fmax(reach, distance_to(giver, tree->frames[i].placement.position, centre));
    for (int i = 0; i < model->point_count; i++)
        if (!model->points[i].is_direction && tree->points[i].frame == base->frame)
            reach = fmax(reach, distance_to(giver, tree->points[i].placement.position, centre));
    return reach;
}

static double volume_of(enum shape_kind kind, const double sides[3]) {
    static const double share[] = {[SHAPE_BALL] = 6, [SHAPE_CYLINDER] = 4, [SHAPE_BOX] = 1};
    return sides[0] * sides[1] * sides[2] * (kind == SHAPE_BOX ? 1 : pi / share[kind]);
}

/* Draws a solid of very low density smaller, about its centre; `shape` is in the frame of `base`. */
static void bound(const struct giver *giver, const struct fixed_frame *base, double mass,
                  const double sides[3], struct shape *shape) {
    const double density = mass / volume_of(shape->kind, sides);
    const double half = fmax(sides[0], fmax(sides[1], sides[2])) / 2;
    const double to_centre = shape->kind == SHAPE_BALL ? 0 : 0.5;
    double centre[3];
    if (!(density < airy))
        return;
    for (int i = 0; i < 3; i++)
        centre[i] = shape->origin[i] + to_centre * shape->axes[3 * i];
    const double scale = fmin(1, fmax(reach_from(giver, base, centre) / half, cbrt(density / water)));
    for (int i = 0; i < 9; i++)
        shape->axes[i] *= scale;
    for (int i = 0; i < 3; i++)
        shape->origin[i] = centre[i] - to_centre * shape->axes[3 * i];
}

static void give_solid(const struct giver *giver, int link, const struct solid *solid) {
    const double mass = value_of(giver->generation, solid->mass);
    double principal[9], S[3], sides[3];
    if (!(mass > 0))
        return;
    find_spread(giver, solid, mass, principal, S);
    const int odd = odd_axis(S), first = odd < 0 ? 0 : odd;
    const struct fixed_frame *base = &giver->generation->tree.carriers[link].base;
    struct shape shape = {.kind = kind_of(S, odd), .link = link, .is_solid = true, .frame = base->frame};
    find_sides(shape.kind, S, first, mass / steel, sides);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) /* an even permutation keeps the system right-handed */
            shape.axes[3 * i + k] = principal[3 * i + (first + k) % 3] * sides[k];
        shape.origin[i] = value_of(giver->generation, solid->center[i]) -
                          (shape.kind == SHAPE_BALL ? 0 : shape.axes[3 * i] / 2);
    }
    place(giver, &solid->placement, &shape);
    place(giver, &base->placement, &shape);
    bound(giver, base, mass, sides, &shape);
    giver->take(giver->context, &shape);
}

/* Calls `take` for each shape, link by link. */
static void shapes_give(const struct generation *generation,
                        void take(void *context, const struct shape *shape), void *context) {
    const struct giver giver = {generation, take, context};
    for (int i = 0; i < generation->model.link_count; i++) {
        const struct link *link = &generation->model.links[i];
        for (int k = 0; k < link->solid_count; k++)
            give_solid(&giver, i, &link->solids[k]);
        if (link->beam.exists)
            give_beam(&giver, i, &link->beam);
    }
}

struct list {
    FILE *out;
    struct generation *generation;
    int count;
};

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
        view_put_length(list->out, value_of(list->generation, position[i]));
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
        view_put_cosine(list->out, value_of(list->generation, frame->placement.rotation[i]));
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
    shapes_give(generation, put_shape, &list);
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
    view_put_length(list->out,
                    generation->model.links[link].beam.exists ? value_of(list->generation, to[0]) : 0);
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
