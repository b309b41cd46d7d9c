/* Curves on which a programme keeps points, traced numerically: see drawn_shapes.h for who calls this. */
#ifndef REFDYN_TOOL_DRAWN_CURVES_H
#define REFDYN_TOOL_DRAWN_CURVES_H

#include <stdbool.h>

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
