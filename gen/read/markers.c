/* Markers: see reader.h. */
#include "gen/read/reader.h"
#include "gen/base/base.h"

#include <string.h>

struct attachment markers_ground_attachment(void) {
    return (struct attachment){.link = -1, .placement = placement_identity()};
}

static bool is_same_place(const struct attachment *a, const struct attachment *b) {
    return a->link == b->link && a->where == b->where && a->along == b->along &&
           memcmp(a->placement.position, b->placement.position, sizeof a->placement.position) == 0;
}

static int find_marker(const struct model *model, const struct attachment *at, bool is_direction) {
    for (int i = 0; i < model->marker_count; i++)
        if (model->points[i].is_direction == is_direction && is_same_place(&model->points[i].at, at))
            return i;
    return -1;
}

/* "arm_tip_axis_x" for an axis of a link, "arm_direction_7" and "arm_marker_7" for what has no name. */
static const char *marker_name(const struct model *model, const struct attachment *at, bool is_direction) {
    static const char *const wheres[] = {"", "_tip", "_along"};
    _Static_assert(sizeof wheres / sizeof *wheres == AT_ALONG + 1, "each place has a name");
    struct memory *memory = model->graph->memory;
    const char *link = model->links[at->link].name;
    const expression *c = at->placement.position;
    for (int axis = 0; is_direction && at->where != AT_ALONG && axis < 3; axis++)
        if (c[axis] == expr_one(model->graph) && !c[(axis + 1) % 3] && !c[(axis + 2) % 3])
            return memory_format(memory, "%s%s_axis_%c", link, wheres[at->where], "xyz"[axis]);
    return memory_format(memory, "%s%s_%s_%d", link, wheres[at->where], is_direction ? "direction" : "marker",
                         model->marker_count + 1);
}

static int add_marker(struct model *model, const struct attachment *at, bool is_direction) {
    const int found = find_marker(model, at, is_direction);
    if (found >= 0)
        return found;
    model->points = memory_room(model->graph->memory, model->points, model->marker_count,
                                &model->marker_capacity, sizeof *model->points);
    model->points[model->marker_count] =
        (struct point){.name = marker_name(model, at, is_direction), .at = *at, .is_direction = is_direction};
    return model->marker_count++;
}

int markers_point(struct model *model, const struct attachment *at) {
    return add_marker(model, at, false);
}

int markers_direction(struct model *model, const struct attachment *at, struct vector components) {
    struct attachment fixed = *at;
    const struct vector turned = matrix_times(model->graph, at->placement.rotation, components);
    fixed.placement = placement_identity();
    memcpy(fixed.placement.position, turned.at, sizeof turned.at);
    return add_marker(model, &fixed, true);
}

static struct vector marker_vector(const struct model *model, int marker, int order) {
    struct vector v;
    for (int axis = 0; axis < 3; axis++)
        v.at[axis] = expr_symbol(model->graph, SYMBOL_POINT, 3 * marker + axis, order);
    return v;
}

struct vector markers_point_vector(struct model *model, const struct attachment *at, int order) {
    const struct vector still = {{0, 0, 0}};
    if (at->link < 0)
        return order == 0 ? vector_of(at->placement.position) : still;
    return marker_vector(model, markers_point(model, at), order);
}

struct vector markers_direction_vector(struct model *model, const struct attachment *at,
                                       struct vector components) {
    if (at->link < 0)
        return matrix_times(model->graph, at->placement.rotation, components);
    return marker_vector(model, markers_direction(model, at, components), 0);
}
