/* The columns of a motion in a live page: those of a table but the inputs of the hand. */
#include "runtime/tool/results/live/module/live_module.h"

/* The columns before the hand's. */
int live_columns_before_hand(const struct live *live) {
    return live->table.ends[RECORD_INPUTS] - live_model.hand_input_count;
}

static int place_in_table(const struct live *live, int column) {
    return column < live_columns_before_hand(live) ? column : column + live_model.hand_input_count;
}

EXPORT(live_column_count) int live_column_count(struct live *live) {
    return live->table.count - live_model.hand_input_count;
}

EXPORT(live_column_name) const char *live_column_name(struct live *live, int column) {
    return live->table.names[place_in_table(live, column)];
}

EXPORT(live_column_unit) const char *live_column_unit(struct live *live, int column) {
    const char *unit = live->table.units[place_in_table(live, column)];
    return unit ? unit : "";
}

/* The group of the column, in the order of record.h: 0 state, 1 points, 2 residuals, 3 energy, 4 forces,
 * 5 continuous states, 6 inputs, 7 courses, 8 accelerations ... */
EXPORT(live_column_group) int live_column_group(struct live *live, int column) {
    int group = 0;
    while (place_in_table(live, column) >= live->table.ends[group])
        group++;
    return group;
}
