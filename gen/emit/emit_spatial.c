/*
 * The table NAME_spatial of spatial Jacobians: the points that they belong to, and both functions with the
 * signature of refdyn_model.h. The header declares it if points request it.
 */
#include "gen/emit/emit.h"

#include <string.h>

static bool has_function(const struct emission *x, const char *quantity) {
    for (int f = 0; f < x->plan->function_count; f++)
        if (!strcmp(x->plan->functions[f].quantity, quantity))
            return true;
    return false;
}

bool emit_is_spatial(const struct function *function) {
    return !strcmp(function->quantity, "J") || !strcmp(function->quantity, "Jd_qd");
}

static bool has_spatial(const struct emission *x) {
    return has_function(x, "J") || has_function(x, "Jd_qd");
}

void emit_spatial_declaration(const struct emission *x, struct text *text) {
    if (has_spatial(x))
        text_add(text,
                 "/* The points of J and Jd_qd, in their order, and these functions on doubles. */\n"
                 "extern const struct refdyn_spatial %s_spatial;\n\n",
                 x->name);
}

static void put_function(const struct emission *x, struct text *text, const char *quantity) {
    if (has_function(x, quantity))
        text_add(text, ", %s_%s_doubles", x->name, quantity);
    else
        text_add(text, ", 0");
}

void emit_spatial(const struct emission *x, struct text *text) {
    const struct model *model = x->plan->model;
    int count = 0;
    if (!has_spatial(x))
        return;
    text_add(text, "static const int %s_spatial_points[] = {", x->name);
    for (int i = 0; i < model->point_count; i++)
        if (model->points[i].is_angular)
            text_add(text, "%s%d", count++ ? ", " : "", i);
    text_add(text, "};\n\nconst struct refdyn_spatial %s_spatial = {%d, %s_spatial_points", x->name, count,
             x->name);
    put_function(x, text, "J");
    put_function(x, text, "Jd_qd");
    text_add(text, "};\n\n");
}
