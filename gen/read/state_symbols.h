/*
 * What an author's function sees as `s` (and `p` outside of functions): names to symbols.
 *
 * s.t  s.q.NAME  s.qd.NAME  s.qdd.NAME  s.points.NAME.x ... zdd  s.points.NAME.axes.x.x ... zdd
 * s.axes.LINK.x.x ... zdd  s.points.NAME.wx ... wzd  s.axes.LINK.wx ... wzd  s.inputs.NAME  s.start.<the
 * same>  p.NAME
 */
#ifndef REFDYN_GEN_STATE_SYMBOLS_H
#define REFDYN_GEN_STATE_SYMBOLS_H

#include "read/declarations.h"

enum view_kind {
    VIEW_PARAMETERS,
    VIEW_STATE,
    VIEW_COORDINATES,
    VIEW_POINTS,
    VIEW_POINT,
    VIEW_INPUTS,
    VIEW_AXES, /* by link */
    VIEW_AXES_OF_POINT,
    VIEW_AXES_OF_LINK,
    VIEW_AXES_OF_TIP,
    VIEW_DIRECTION
};

/* Something with named fields: `order` is that of coordinates, `index` that of a point, direction or link. */
struct view {
    enum view_kind kind;
    int order, index;
    bool at_start;
};

/* The names that a view reaches. */
struct view_names {
    const struct declarations *declarations;
    struct model *model; /* its links and points; directions that are asked for become markers */
    const char *const *coordinates;
    int coordinate_count;
};

struct view_result {
    bool is_view;
    struct view view;
    expression expression;
    const char *fault; /* NULL, or a message that names what is known */
    bool is_told;      /* the same fault has been complained about before */
};

struct view_result state_symbols_field(const struct view_names *names, struct view view, const char *field);

#endif
