/*
 * What an author's function sees as `s` (and `p` outside of functions): names to symbols.
 *
 * s.t  s.q.NAME  s.qd.NAME  s.qdd.NAME  s.points.NAME.x ... zdd  s.inputs.NAME  s.start.<the same>  p.NAME
 */
#ifndef REFDYN_GEN_VIEW_H
#define REFDYN_GEN_VIEW_H

#include "declare.h"

enum view_kind { VIEW_PARAMETERS, VIEW_STATE, VIEW_COORDINATES, VIEW_POINTS, VIEW_POINT, VIEW_INPUTS };

/* Something with named fields: `order` is that of coordinates, `index` that of a point. */
struct view {
    enum view_kind kind;
    int order, index;
    bool at_start;
};

/* The names that a view reaches. */
struct view_names {
    const struct declarations *declarations;
    const char *const *coordinates;
    int coordinate_count;
    const char *const *points;
    int point_count;
};

struct view_result {
    bool is_view;
    struct view view;
    expression expression;
    const char *fault; /* NULL, or a message that names what is known */
};

struct view_result view_field(const struct view_names *names, struct view view, const char *field);

#endif
