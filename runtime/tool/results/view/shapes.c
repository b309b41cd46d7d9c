/*
 * Represents the bodies of a model by balls, cylinders and boxes.
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
#include "runtime/tool/results/view/view.h"
#include "gen/tree/tree.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846, steel = 7850, water = 1000, airy = 100; /* [kg/m^3] */
static const double alike = 1e-6; /* relative difference of values that are equal within rounding */

struct giver {
    const struct generation *generation;
    void (*take)(void *context, const struct shape *shape);
    void *context;
};

static double value_of(const struct giver *giver, expression e) {
    const struct model *model = &giver->generation->model;
    return parameters_evaluate(model->graph, model->parameters, e);
}

static bool is_alike(double a, double b) {
    return fabs(a - b) <= alike * fmax(fabs(a), fabs(b));
}

/* Maps the shape from placed axes to the axes in which these are placed. */
static void place(const struct giver *giver, const struct placement *at, struct shape *shape) {
    const struct shape inner = *shape;
    memset(shape->axes, 0, sizeof shape->axes);
    for (int i = 0; i < 3; i++) {
        shape->origin[i] = value_of(giver, at->position[i]);
        for (int k = 0; k < 3; k++) {
            const double r = value_of(giver, at->rotation[3 * i + k]);
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
    const double A = value_of(giver, segment->area), Iy = value_of(giver, segment->Iy),
                 Iz = value_of(giver, segment->Iz), It = value_of(giver, segment->It);
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
            shape.axes[0] =
                value_of(giver, carrier->elements[i + 1].start) - value_of(giver, carrier->elements[i].start);
            give_on(giver, &carrier->elements[i].at, shape);
        }
    }
}

/* ---- Solids ---- */

static double distance_to(const struct giver *giver, const expression place[3], const double from[3]) {
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double apart = value_of(giver, place[i]) - from[i];
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
        axes[i] = value_of(giver, J[index[i]]);
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
    const double mass = value_of(giver, solid->mass);
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
        shape.origin[i] =
            value_of(giver, solid->center[i]) - (shape.kind == SHAPE_BALL ? 0 : shape.axes[3 * i] / 2);
    }
    place(giver, &solid->placement, &shape);
    place(giver, &base->placement, &shape);
    bound(giver, base, mass, sides, &shape);
    giver->take(giver->context, &shape);
}

void view_shapes_give(const struct generation *generation,
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
