/*
 * Checks of a model's table: its version, its counts, the tables with these counts, and indices in them.
 *
 * In: a table that may come from another version of the generator, or be written by hand. Out: a status,
 * before any size is computed from the table.
 */
#include "runtime/core/base/core.h"

#include <string.h>

/* Largest count of parameters, inputs, breaks ...: twice as many still fit into an int. */
enum { COUNT_MOST = 1 << 28 };
/* Largest number of coordinates, rows and couplings together: the largest product in a layout, 9 (m +
 * couplings)^2 for the border of a chain, still fits into an int. */
enum { DENSE_MOST = 15000 };

static int is_count(int count) {
    return count >= 0 && count <= COUNT_MOST;
}

/* Whether requirements have texts, and no more numbers than a text can print. */
static int has_requirements(const struct refdyn_model *model) {
    const int count = model->requirement_count;
    if (!is_count(count) || (count > 0 && !(model->requirements && model->required)))
        return 0;
    for (int i = 0; i < count; i++)
        if (model->requirements[i].count < 1 || model->requirements[i].count > REFDYN_REQUIREMENT_NUMBERS)
            return 0;
    return 1;
}

static int has_counts(const struct refdyn_model *model) {
    const int n = model->n, m = model->m, couplings = model->coupling_count;
    if (n < 1 || !is_count(n) || !is_count(m) || !is_count(couplings) || n + m + couplings > DENSE_MOST)
        return 0;
    return is_count(model->parameter_count) && is_count(model->derived_count) &&
           is_count(model->input_count) && is_count(model->point_count) && is_count(model->course_count) &&
           is_count(model->break_count) && is_count(model->switch_count) && is_count(model->held_count) &&
           is_count(model->anchored_count) && is_count(model->event_count) && is_count(model->kink_count) &&
           is_count(model->change_count) && has_requirements(model);
}

static int has_tables(const struct refdyn_model *model) {
    return model->coordinates && (model->parameters || model->parameter_count == 0) &&
           (model->inputs || model->input_count == 0) && (model->rows || model->m == 0) &&
           (model->points || model->point_count == 0) && (model->held || model->held_count == 0) &&
           (model->anchored || model->anchored_count == 0) &&
           ((model->parent && model->vector_places) || !model->tangent_vectors) &&
           (model->events || model->event_count == 0) &&
           ((model->event && model->event_terms) || model->event_count + model->kink_count == 0) &&
           (model->changes || model->change_count == 0);
}

/* Returns whether all places are in [least, end). */
static int lie_in(const int *places, int count, int least, int end) {
    for (int i = 0; places && i < count; i++)
        if (places[i] < least || places[i] >= end)
            return 0;
    return 1;
}

/* Returns whether each event refers to entries of the list of changes, and each entry to an existing place.
 */
static int have_changes(const struct refdyn_model *model) {
    const int ends[] = {model->n, model->input_count, model->parameter_count};
    for (int i = 0; i < model->event_count; i++) {
        const struct refdyn_event *event = &model->events[i];
        if (!is_count(event->change_count) ||
            !lie_in(&event->first_change, 1, 0, model->change_count - event->change_count + 1) ||
            !lie_in(&event->contact, 1, -1, event->change_count == 1 ? model->m + 1 : 1))
            return 0;
    }
    for (int i = 0; i < model->change_count; i++) {
        const struct refdyn_change *change = &model->changes[i];
        if (change->what > REFDYN_CHANGED_PARAMETER ||
            !lie_in(&change->place, 1, change->what == REFDYN_CHANGED_PARAMETER ? -1 : 0, ends[change->what]))
            return 0;
    }
    return 1;
}

/* Returns whether states are the last coordinates and follow at least one joint. */
static int have_states_last(const struct refdyn_model *model) {
    const int joints = refdyn_joint_count(model);
    for (int j = 0; j < joints; j++)
        if (refdyn_is_state(model, j))
            return 0;
    return joints > 0;
}

static int has_places(const struct refdyn_model *model) {
    const int n = model->n, m = model->m;
    return lie_in(model->parent, n, REFDYN_STATE, n) && have_states_last(model) &&
           lie_in(model->dependent, m, 0, n) && lie_in(model->held, model->held_count, 0, n) &&
           lie_in(model->gains, 2 * m, -1, model->parameter_count + model->derived_count) &&
           lie_in(model->anchored, model->anchored_count, 0, model->parameter_count);
}

int refdyn_required_count(const struct refdyn_model *model) {
    int count = 0;
    for (int i = 0; i < model->requirement_count; i++)
        count += 1 + model->requirements[i].count;
    return count;
}

int refdyn_model_status(const struct refdyn_model *model) {
    if (!model)
        return REFDYN_BAD_MODEL;
    if (!refdyn_model_is_readable(model))
        return REFDYN_OTHER_VERSION;
    return has_counts(model) && has_tables(model) && has_places(model) && have_changes(model)
               ? REFDYN_OK
               : REFDYN_BAD_MODEL;
}

/* The sizes on which layouts and places depend; the hash covers them in emitted tables. */
static int have_equal_sizes(const struct refdyn_model *a, const struct refdyn_model *b) {
    return a->n == b->n && a->m == b->m && a->parameter_count == b->parameter_count &&
           a->derived_count == b->derived_count && a->input_count == b->input_count &&
           a->point_count == b->point_count && a->course_count == b->course_count &&
           a->break_count == b->break_count && a->switch_count == b->switch_count &&
           a->event_count == b->event_count && a->kink_count == b->kink_count &&
           a->change_count == b->change_count && a->anchored_count == b->anchored_count &&
           a->coupling_count == b->coupling_count && refdyn_required_count(a) == refdyn_required_count(b);
}

static int have_equal_texts(const char *a, const char *b) {
    return a == b || (a && b && strcmp(a, b) == 0);
}

int refdyn_models_agree(const struct refdyn_model *a, const struct refdyn_model *b) {
    int has_functions = !a->prepare == !b->prepare;
#define HAS_SAME(name) has_functions &= !a->name == !b->name;
    REFDYN_QUANTITIES(HAS_SAME)
#undef HAS_SAME
    return has_functions && have_equal_sizes(a, b) && have_equal_texts(a->name, b->name) &&
           have_equal_texts(a->hash, b->hash);
}

int refdyn_joint_count(const struct refdyn_model *model) {
    int count = refdyn_model_is_readable(model) ? model->n : 0;
    while (count > 0 && refdyn_is_state(model, count - 1))
        count--;
    return count;
}

int refdyn_programme_rows(const struct refdyn_model *model) {
    if (!refdyn_model_is_readable(model))
        return 0;
    int count = model->m;
    for (int i = 0; i < model->event_count; i++)
        count -= model->events[i].contact > 0;
    return count;
}

int refdyn_is_turn(const struct refdyn_model *model, int j) {
    const char *unit = model->coordinates[j].unit;
    return unit && strcmp(unit, "rad") == 0 && !refdyn_is_state(model, j);
}

double refdyn_coordinate_unit(const struct refdyn_model *model, int j, double length) {
    if (refdyn_is_state(model, j)) /* the entry after those of the coordinates */
        return model->coordinates[model->n + j - refdyn_joint_count(model)].value;
    const char *unit = model->coordinates[j].unit;
    if (!unit || strcmp(unit, "m") != 0)
        return 1;
    return length > 0 ? length : model->length > 0 ? model->length : 1;
}
