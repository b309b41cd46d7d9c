/*
 * Adds springs and dampers by which a hand pulls the points of interest of a model: at each point the force
 * pull (hand - r) - brake r'. Its inputs follow those of the author: for each point `live_pull_POINT` [N/m]
 * and `live_brake_POINT` [N s/m], and then for all of them the place of the hand, `live_hand_x`, `_y` and
 * `_z` [m]. All are 0 by default, so that no force acts.
 */
#include "gen/model_file/reader.h"

#include <string.h>

static expression add_input(const struct reader *reader, struct place place, const char *kind, const char *of,
                            const char *unit) {
    return declarations_add_input(reader->check.declarations, place,
                                  memory_format(reader->check.memory, "live_%s_%s", kind, of), 0, unit);
}

static void add_load(const struct reader *reader, int point, struct vector force) {
    struct model *model = reader->model;
    struct load load = {.point = point, .path = "live", .place = model->points[point].place};
    memcpy(load.value, force.at, sizeof load.value);
    model->loads = memory_room(reader->check.memory, model->loads, model->load_count, &model->load_capacity,
                               sizeof *model->loads);
    model->loads[model->load_count++] = load;
}

void read_pulls(const struct reader *reader) {
    static const char *const axes[] = {"x", "y", "z"};
    struct graph *g = reader->check.graph;
    struct model *model = reader->model;
    const int count = model->point_count;
    expression *pull = memory_get(reader->check.memory, 2 * ((size_t)count + 1) * sizeof *pull);
    struct vector hand;
    for (int i = 0; i < count; i++) {
        const struct point *point = &model->points[i];
        pull[2 * i] = add_input(reader, point->place, "pull", point->name, "N/m");
        pull[2 * i + 1] = add_input(reader, point->place, "brake", point->name, "N s/m");
    }
    for (int axis = 0; axis < 3 && count > 0; axis++)
        hand.at[axis] = add_input(reader, model->points[0].place, "hand", axes[axis], "m");
    for (int i = 0; i < count; i++) {
        struct vector force;
        for (int axis = 0; axis < 3; axis++) {
            const expression r = expr_symbol(g, SYMBOL_POINT, 3 * i + axis, 0);
            const expression rd = expr_symbol(g, SYMBOL_POINT, 3 * i + axis, 1);
            force.at[axis] = expr_sub(g, expr_mul(g, pull[2 * i], expr_sub(g, hand.at[axis], r)),
                                      expr_mul(g, pull[2 * i + 1], rd));
        }
        add_load(reader, i, force);
    }
}
