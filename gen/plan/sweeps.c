/*
 * SWEEPS, the loop that computes derivatives of accelerations column by column (loops.h): the components that
 * it carries, and its arrays. lower_sweeps.c explains the loop.
 */
#include "gen/plan/plan.h"

static bool has_kind(const struct sweeps *s, enum stage_kind kind) {
    for (int i = 0; i < s->n; i++)
        if (s->kind[i] == (int)kind)
            return true;
    return false;
}

static bool is_there(const struct vector_arrays *arrays, int axis) {
    return arrays->at[axis] != NOTHING;
}

static const struct vector_arrays *start_of(const struct sweeps *s, int column, bool is_angular) {
    if (column < 0)
        return is_angular ? &s->start_angular : &s->start_linear;
    return is_angular ? &s->columns[column].start_angular : &s->columns[column].start_linear;
}

/* Returns whether component `axis` of a cross product a x b reads both b and component `of` of a. */
static bool crosses(const struct vector_arrays *b, int axis, int of) {
    return axis != of && is_there(b, 3 - axis - of);
}

/* Components that may become nonzero. In the branches after the one of its joint, a column has those of the
 * response. */
static struct sweep_state set_components(const struct sweeps *s, int column) {
    struct sweep_state state = {.angular = {false}};
    if (column >= 0 && s->branches.count)
        state = set_components(s, -1);
    for (int a = 0; a < 3; a++) {
        state.spin[a] = column >= 0 && is_there(&s->columns[column].spin, a);
        state.turned[a] = column >= 0 && is_there(&s->columns[column].turned, a);
        state.angular[a] = state.angular[a] || has_kind(s, STAGE_BALL) ||
                           is_there(start_of(s, column, true), a) || is_there(&s->unit_angular, a) ||
                           (has_kind(s, STAGE_TURN) && is_there(&s->turn, a));
    }
    for (int a = 0; a < 3; a++) {
        state.linear[a] = state.linear[a] || is_there(start_of(s, column, false), a) ||
                          is_there(&s->unit_linear, a) || (has_kind(s, STAGE_SLIDE) && is_there(&s->turn, a));
        for (int of = 0; of < 3; of++)
            state.linear[a] = state.linear[a] || (state.angular[of] && crosses(&s->shift, a, of)) ||
                              (state.spin[of] && crosses(&s->swing, a, of));
    }
    return state;
}

static bool pushes(const struct sweeps *s, bool is_moment, int axis) {
    for (int c = 0; c < s->column_count; c++)
        if (is_there(is_moment ? &s->columns[c].push_moment : &s->columns[c].push_force, axis))
            return true;
    return false;
}

/* Components that are read. */
static struct sweep_state read_components(const struct sweeps *s, int column) {
    struct sweep_state state = {.angular = {false}};
    for (int a = 0; a < 3; a++) {
        state.linear[a] = is_there(&s->hold_force, a) || (column < 0 && pushes(s, false, a));
        state.angular[a] =
            has_kind(s, STAGE_BALL) || is_there(&s->hold_moment, a) || (column < 0 && pushes(s, true, a));
        state.spin[a] = is_there(&s->hold_spin, a);
        state.turned[a] = is_there(&s->hold_turned, a);
    }
    for (int a = 0; a < 3; a++)
        for (int of = 0; of < 3; of++) {
            state.angular[of] = state.angular[of] || (state.linear[a] && crosses(&s->shift, a, of));
            state.spin[of] = state.spin[of] || (state.linear[a] && crosses(&s->swing, a, of));
        }
    return state;
}

struct sweep_state sweeps_state(const struct sweeps *s, int column) {
    struct sweep_state state = set_components(s, column);
    const struct sweep_state read = read_components(s, column);
    for (int a = 0; a < 3; a++) {
        state.angular[a] = state.angular[a] && read.angular[a];
        state.linear[a] = state.linear[a] && read.linear[a];
        state.spin[a] = state.spin[a] && read.spin[a];
        state.turned[a] = state.turned[a] && read.turned[a];
    }
    return state;
}

/* Drops the components that multiply only zeros. Returns whether it has dropped any. */
static bool keep(struct vector_arrays *arrays, const bool is_read[3]) {
    bool dropped = false;
    for (int a = 0; a < 3; a++) {
        dropped = dropped || (is_there(arrays, a) && !is_read[a]);
        arrays->at[a] = is_read[a] ? arrays->at[a] : NOTHING;
    }
    return dropped;
}

static bool drop_once(struct sweeps *s) {
    const struct sweep_state response = sweeps_state(s, -1);
    struct sweep_state any = response; /* of all states */
    bool shift[3] = {false}, swing[3] = {false}, turn[3], dropped = false;
    for (int k = -1; k < s->column_count; k++) {
        const struct sweep_state state = sweeps_state(s, k);
        for (int a = 0; a < 3; a++) {
            any.angular[a] = any.angular[a] || state.angular[a];
            any.linear[a] = any.linear[a] || state.linear[a];
            any.spin[a] = any.spin[a] || state.spin[a];
            any.turned[a] = any.turned[a] || state.turned[a];
            for (int of = 0; of < 3; of++)
                if (of != a && state.linear[a]) {
                    shift[3 - a - of] = shift[3 - a - of] || state.angular[of];
                    swing[3 - a - of] = swing[3 - a - of] || state.spin[of];
                }
        }
        dropped |= keep((struct vector_arrays *)start_of(s, k, true), state.angular);
        dropped |= keep((struct vector_arrays *)start_of(s, k, false), state.linear);
        if (k < 0)
            continue;
        dropped |= keep(&s->columns[k].spin, state.spin);
        dropped |= keep(&s->columns[k].turned, state.turned);
        dropped |= keep(&s->columns[k].push_moment, response.angular);
        dropped |= keep(&s->columns[k].push_force, response.linear);
    }
    for (int a = 0; a < 3; a++)
        turn[a] = has_kind(s, STAGE_BALL) || (has_kind(s, STAGE_TURN) && any.angular[a]) ||
                  (has_kind(s, STAGE_SLIDE) && any.linear[a]);
    dropped |= keep(&s->turn, turn);
    dropped |= keep(&s->unit_angular, response.angular);
    dropped |= keep(&s->unit_linear, response.linear);
    dropped |= keep(&s->hold_moment, any.angular);
    dropped |= keep(&s->hold_force, any.linear);
    dropped |= keep(&s->hold_spin, any.spin);
    dropped |= keep(&s->hold_turned, any.turned);
    dropped |= keep(&s->shift, shift);
    dropped |= keep(&s->swing, swing);
    return dropped;
}

void sweeps_drop_unread(struct sweeps *s) {
    bool moves = false;
    for (int i = 0; i < s->n; i++)
        moves = moves || s->moves_on[i];
    for (int a = 0; a < 3 && !moves; a++)
        s->shift.at[a] = s->swing.at[a] = NOTHING;
    while (drop_once(s))
        continue;
    const struct sweep_state response = sweeps_state(s, -1);
    bool responds = false;
    for (int a = 0; a < 3; a++)
        responds = responds || response.angular[a] || response.linear[a];
    s->levels = responds ? s->levels : 0; /* slides that do not accelerate each other have no spin either */
}

void sweeps_list_arrays(struct array_list *list, struct sweeps *s) {
    struct vector_arrays *const shared[] = {
        &s->turn,        &s->shift,         &s->swing,        &s->hold_moment,  &s->hold_force, &s->hold_spin,
        &s->hold_turned, &s->start_angular, &s->start_linear, &s->unit_angular, &s->unit_linear};
    for (size_t i = 0; i < sizeof shared / sizeof *shared; i++)
        array_list_add_vectors(list, shared[i]);
    for (int c = 0; c < s->column_count; c++) {
        struct sweep_column *column = &s->columns[c];
        struct vector_arrays *const own[] = {&column->spin,          &column->turned,
                                             &column->push_moment,   &column->push_force,
                                             &column->start_angular, &column->start_linear};
        list->arrays[list->count++] = &column->array;
        for (size_t i = 0; i < sizeof own / sizeof *own; i++)
            array_list_add_vectors(list, own[i]);
    }
}
