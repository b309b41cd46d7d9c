/* Shapes of bodies from their numbers, and curves on which a programme keeps points. `view` computes them
 * when it writes a page, and a live page whenever a parameter changes: its module contains this file, so that
 * it needs the C library only. */
#ifndef REFDYN_TOOL_DRAWN_SHAPES_H
#define REFDYN_TOOL_DRAWN_SHAPES_H

#include <stdbool.h>

/* ---- Shapes (drawn_shapes.c) ---- */

enum shape_kind { SHAPE_BALL, SHAPE_CYLINDER, SHAPE_BOX };

struct shape {
    enum shape_kind kind;
    double bore;      /* for a cylinder, inner over outer diameter */
    double axes[9];   /* row-major: columns are the images of the unit axes [m] */
    double origin[3]; /* [m] */
};

/* The columns of `rotation` are the axes, row by row. */
struct drawn_placement {
    double rotation[9], position[3];
};

/* An element of a beam, from `start` to `end` along the beam, placed in a frame. */
struct drawn_element {
    struct drawn_placement at;
    double start, end, area, Iy, Iz, It;
};

/* A solid, placed in its link, which is placed in a frame. */
struct drawn_solid {
    double mass, centre[3], inertia[6]; /* xx yy zz xy xz yz */
    struct drawn_placement in_link, link;
};

/* Numbers, all double, of the structs above. */
enum {
    DRAWN_ELEMENT_NUMBERS = sizeof(struct drawn_element) / sizeof(double),
    DRAWN_SOLID_NUMBERS = sizeof(struct drawn_solid) / sizeof(double)
};

struct shape view_shape_of_element(const struct drawn_element *element);
/* places (count x 3): in the frame, what shows the size of its links: their origins, joints, points. Returns
 * false if the solid has no mass. */
bool view_shape_of_solid(const struct drawn_solid *solid, const double *places, int count,
                         struct shape *shape);

/* ---- Curves (drawn_curves.c) ---- */

enum {
    DRAWN_CURVE_AXES = 2,
    DRAWN_CURVE_MOST = 800,                       /* steps each way */
    DRAWN_CURVE_PLACES = 2 * DRAWN_CURVE_MOST + 1 /* of a whole curve */
};

/* The caller sets residual, context and size; all others are 0. */
struct drawn_curve {
    double (*residual)(void *context, const double at[DRAWN_CURVE_AXES]);
    void *context;
    double size;                                        /* the largest coordinate of the motion [m] */
    double path[2][DRAWN_CURVE_MOST][DRAWN_CURVE_AXES]; /* forward and backward */
    int count[2];
    bool is_closed;
};

/* Moves start to the nearest place on the curve, and traces the curve from there. Returns false if there is
 * none near. */
bool view_trace_curve(struct drawn_curve *curve, double start[DRAWN_CURVE_AXES]);
/* Lists the places in order; returns their number. */
int view_list_curve(const struct drawn_curve *curve, const double start[DRAWN_CURVE_AXES],
                    double places[][DRAWN_CURVE_AXES]);

#endif
