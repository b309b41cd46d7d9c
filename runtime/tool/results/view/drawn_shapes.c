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
#include "runtime/tool/results/view/drawn_shapes.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846, steel = 7850, water = 1000, airy = 100; /* [kg/m^3] */
static const double alike = 1e-6; /* relative difference of values that are equal within rounding */

static bool is_alike(double a, double b) {
    return fabs(a - b) <= alike * fmax(fabs(a), fabs(b));
}

/* Maps the shape from placed axes to the axes in which these are placed. */
static void place(const struct drawn_placement *at, struct shape *shape) {
    const struct shape inner = *shape;
    memset(shape->axes, 0, sizeof shape->axes);
    for (int i = 0; i < 3; i++) {
        shape->origin[i] = at->position[i];
        for (int k = 0; k < 3; k++) {
            const double r = at->rotation[3 * i + k];
            shape->origin[i] += r * inner.origin[k];
            for (int j = 0; j < 3; j++)
                shape->axes[3 * i + j] += r * inner.axes[3 * k + j];
        }
    }
}

/* ---- Beams ---- */

struct shape view_shape_of_element(const struct drawn_element *element) {
    const double A = element->area, Iy = element->Iy, Iz = element->Iz;
    struct shape shape = {.kind = SHAPE_BOX};
    double across[2] = {sqrt(12 * Iz / A), sqrt(12 * Iy / A)};
    if (is_alike(Iy, Iz) && is_alike(element->It, Iy + Iz)) {
        const double sum = 16 * Iy / A, difference = 4 * A / pi;
        const double outer = (sum + difference) / 2, inner = (sum - difference) / 2;
        shape.kind = SHAPE_CYLINDER;
        across[0] = across[1] = sqrt(outer);
        shape.bore = inner > alike * outer ? sqrt(inner / outer) : 0;
    }
    shape.axes[0] = element->end - element->start;
    shape.axes[4] = across[0];
    shape.axes[8] = across[1];
    place(&element->at, &shape);
    return shape;
}

/* ---- Solids ---- */

/* Turns the axes (3 x 3, columns) by the plane rotation that makes J[p][q] zero; J are the moments in these
 * axes (Golub and Van Loan, Matrix Computations, 8.5). */
static void turn_pair(double J[3][3], double axes[9], int p, int q) {
    const double tau = (J[q][q] - J[p][p]) / (2 * J[p][q]);
    const double t = (tau < 0 ? -1 : 1) / (fabs(tau) + sqrt(1 + tau * tau)), c = 1 / sqrt(1 + t * t),
                 s = t * c;
    for (int i = 0; i < 3; i++) {
        const double a = J[i][p], b = J[i][q], x = axes[3 * i + p], y = axes[3 * i + q];
        J[i][p] = c * a - s * b;
        J[i][q] = s * a + c * b;
        axes[3 * i + p] = c * x - s * y;
        axes[3 * i + q] = s * x + c * y;
    }
    for (int i = 0; i < 3; i++) {
        const double a = J[p][i], b = J[q][i];
        J[p][i] = c * a - s * b;
        J[q][i] = s * a + c * b;
    }
    J[p][q] = J[q][p] = 0;
}

/* Computes the principal moments of a symmetric J and their axes, by cyclic rotations of Jacobi. */
static void find_principal(double J[3][3], double axes[9]) {
    enum { SWEEPS = 12 }; /* convergence is quadratic: six sweeps reach rounding */
    for (int i = 0; i < 9; i++)
        axes[i] = i % 4 == 0;
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++)
                if (fabs(J[p][q]) > 1e-16 * (fabs(J[p][p]) + fabs(J[q][q])))
                    turn_pair(J, axes, p, q);
}

/* Computes the principal axes of J as columns of a right-handed system, and S along them. */
static void find_spread(const struct drawn_solid *solid, double axes[9], double S[3]) {
    const int index[9] = {0, 3, 4, 3, 1, 5, 4, 5, 2}; /* xx yy zz xy xz yz */
    double J[3][3];
    for (int i = 0; i < 9; i++)
        J[i / 3][i % 3] = solid->inertia[index[i]];
    find_principal(J, axes);
    const double half_trace = (J[0][0] + J[1][1] + J[2][2]) / 2;
    for (int i = 0; i < 3; i++)
        S[i] = (half_trace - J[i][i]) / solid->mass;
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

/* The largest distance from `centre` to the places. */
static double reach_from(const double *places, int count, const double centre[3]) {
    double reach = 0;
    for (int i = 0; i < count; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++)
            square += (places[3 * i + k] - centre[k]) * (places[3 * i + k] - centre[k]);
        reach = fmax(reach, sqrt(square));
    }
    return reach;
}

static double volume_of(enum shape_kind kind, const double sides[3]) {
    static const double share[] = {[SHAPE_BALL] = 6, [SHAPE_CYLINDER] = 4, [SHAPE_BOX] = 1};
    return sides[0] * sides[1] * sides[2] * (kind == SHAPE_BOX ? 1 : pi / share[kind]);
}

/* Draws a solid of very low density smaller, about its centre; `shape` is in the frame of its link. */
static void bound(const double *places, int count, double mass, const double sides[3], struct shape *shape) {
    const double density = mass / volume_of(shape->kind, sides);
    const double half = fmax(sides[0], fmax(sides[1], sides[2])) / 2;
    const double to_centre = shape->kind == SHAPE_BALL ? 0 : 0.5;
    double centre[3];
    if (!(density < airy))
        return;
    for (int i = 0; i < 3; i++)
        centre[i] = shape->origin[i] + to_centre * shape->axes[3 * i];
    const double scale = fmin(1, fmax(reach_from(places, count, centre) / half, cbrt(density / water)));
    for (int i = 0; i < 9; i++)
        shape->axes[i] *= scale;
    for (int i = 0; i < 3; i++)
        shape->origin[i] = centre[i] - to_centre * shape->axes[3 * i];
}

bool view_shape_of_solid(const struct drawn_solid *solid, const double *places, int count,
                         struct shape *shape) {
    double principal[9], S[3], sides[3];
    *shape = (struct shape){.kind = SHAPE_BALL};
    if (!(solid->mass > 0))
        return false;
    find_spread(solid, principal, S);
    const int odd = odd_axis(S), first = odd < 0 ? 0 : odd;
    shape->kind = kind_of(S, odd);
    find_sides(shape->kind, S, first, solid->mass / steel, sides);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) /* an even permutation keeps the system right-handed */
            shape->axes[3 * i + k] = principal[3 * i + (first + k) % 3] * sides[k];
        shape->origin[i] = solid->centre[i] - (shape->kind == SHAPE_BALL ? 0 : shape->axes[3 * i] / 2);
    }
    place(&solid->in_link, shape);
    place(&solid->link, shape);
    bound(places, count, solid->mass, sides, shape);
    return true;
}
