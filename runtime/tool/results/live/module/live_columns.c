/* The columns of a motion in a live page: those of a table but the inputs of the hand. */
#include "runtime/tool/results/live/module/live_module.h"

#include <string.h>

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

/* The kind of curve that the page draws of a column, "" for none. */
static const char *const kinds[RECORD_BLOCKS] = {[RECORD_ENERGY] = "energy",
                                                 [RECORD_FORCES] = "force",
                                                 [RECORD_STATES] = "course",
                                                 [RECORD_INPUTS] = "course",
                                                 [RECORD_COURSES] = "course"};

/* The kind of quantity whose errors are compared, "" for none. */
static const char *const motion_kinds[RECORD_KINDS] = {[RECORD_OTHER] = "",
                                                       [RECORD_RATE] = "rates",
                                                       [RECORD_ACCELERATION] = "accelerations",
                                                       [RECORD_FORCE] = "forces"};

EXPORT(live_column_motion_kind) const char *live_column_motion_kind(struct live *live, int column) {
    return motion_kinds[record_table_kind(&live->table, place_in_table(live, column))];
}

EXPORT(live_column_kind) const char *live_column_kind(struct live *live, int column) {
    const int place = place_in_table(live, column);
    int block = RECORD_STATE;
    while (place >= live->table.ends[block])
        block++;
    if (block == RECORD_RESIDUALS)
        return strncmp(live->table.names[place], "phi_", 4) == 0 ? "phi" : "psi";
    if (block == RECORD_CONTACTS) /* of each contact the force, then the time since which it rests */
        return (place - live->table.ends[block - 1]) % 2 == 0 ? "contact" : "";
    return kinds[block] ? kinds[block] : "";
}
