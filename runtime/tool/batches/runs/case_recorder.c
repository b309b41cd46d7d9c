/* In: the states of a case's motion at the recorded times. Out: the numbers that the batch keeps of it. */
#include <math.h>
#include <string.h>

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/format/format.h"

static const struct bound *find_bound(const struct model *read, const char *name) {
    for (int i = 0; i < read->bound_count; i++)
        if (strcmp(read->bounds[i].name, name) == 0)
            return &read->bounds[i];
    return NULL;
}

/* Looks up the items' columns in the table, and selects the blocks that it must compute. */
static void find_places(struct recorder *recorder, const struct model *read) {
    const struct kept *kept = recorder->kept;
    struct record_table *table = recorder->table;
    bool *wanted = format_allocate((size_t)table->count, sizeof *wanted);
    for (int i = 0; i < recorder->layout->item_count; i++) {
        const struct bound *bound = kept->kinds[i] == KEPT_LIMIT ? find_bound(read, kept->columns[i]) : NULL;
        const char *column = bound ? bound->column : kept->columns[i];
        if (bound)
            recorder->bounds[i] = (struct record_bound){bound->name, bound->column, bound->from, bound->to};
        recorder->places[i] =
            kept->kinds[i] == KEPT_LIMIT && !bound ? -1 : text_index(column, table->names, table->count);
        if (recorder->places[i] >= 0)
            wanted[recorder->places[i]] = true;
    }
    record_table_want(table, wanted);
}

void runs_recorder_start(struct recorder *recorder, const struct kept *kept, const struct runs_layout *layout,
                         struct record_table *table, const struct model *read) {
    *recorder = (struct recorder){.kept = kept, .layout = layout, .table = table};
    recorder->places = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->places);
    recorder->before = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->before);
    recorder->values = format_allocate((size_t)layout->width + 1, sizeof *recorder->values);
    recorder->bounds = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->bounds);
    recorder->tracks = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->tracks);
    find_places(recorder, read);
    recorder->keeps_ends_alone = true;
    for (int i = 0; i < layout->item_count; i++)
        recorder->keeps_ends_alone &= kept->kinds[i] == KEPT_FINAL || kept->kinds[i] == KEPT_DERIVATIVE ||
                                      kept->kinds[i] == KEPT_REALISE;
}

void runs_recorder_clear(struct recorder *recorder) {
    for (int i = 0; i < recorder->layout->width; i++)
        recorder->values[i] = NAN;
    for (int i = 0; i < recorder->layout->item_count; i++)
        recorder->tracks[i].count = 0;
}

/* extremes: smallest value, its time, largest value, its time. A NaN stays. */
static void widen(double *extremes, double value, double t, bool is_first) {
    if (is_first || !(value >= extremes[0])) {
        extremes[0] = value;
        extremes[1] = t;
    }
    if (is_first || !(value <= extremes[2])) {
        extremes[2] = value;
        extremes[3] = t;
    }
}

/* Root mean square: integrates x^2 by the trapezoidal rule, and at the end divides by the time and takes the
 * root. */
static void add_square(struct recorder *recorder, int item, double value, double t, bool is_first,
                       bool is_last) {
    double *sum = recorder->values + recorder->layout->items[item].offset;
    const double square = value * value;
    *sum = is_first ? 0 : *sum + (t - recorder->t_before) * (square + recorder->before[item]) / 2;
    recorder->before[item] = square;
    if (is_last && t > recorder->kept->times.t[0])
        *sum = sqrt(*sum / (t - recorder->kept->times.t[0]));
}

/* The vertex of the parabola through three outputs, if the middle one is the largest or the smallest. Where
 * one of the two slopes is far steeper than the other, the value may jump, and the output itself counts. */
static bool vertex(const struct limit_track *track, double t, double value, double *t_vertex,
                   double *vertex) {
    const double steepest = 0.1, h0 = track->t[1] - track->t[0], h1 = t - track->t[1];
    const double s0 = (track->value[1] - track->value[0]) / h0, s1 = (value - track->value[1]) / h1;
    const double curvature = (s1 - s0) / (h0 + h1), slope = (s0 * h1 + s1 * h0) / (h0 + h1);
    const double away = -slope / (2 * curvature);
    *t_vertex = track->t[1] + away;
    *vertex = track->value[1] + away * (slope + away * curvature);
    return track->count == 2 && s0 * s1 < 0 && fabs(s0) > steepest * fabs(s1) &&
           fabs(s1) > steepest * fabs(s0);
}

/* Adds an output to a limit: extremes by parabolas through three outputs, times beyond it by straight lines.
 */
static void add_to_limit(struct recorder *recorder, int item, double value, double t) {
    double *to = recorder->values + recorder->layout->items[item].offset, t_vertex, at_vertex;
    struct limit_track *track = &recorder->tracks[item];
    const struct record_bound *bound = &recorder->bounds[item];
    widen(to, value, t, track->count == 0);
    if (track->count == 2 && vertex(track, t, value, &t_vertex, &at_vertex))
        widen(to, at_vertex, t_vertex, false);
    const bool is_out = record_is_beyond(bound, value);
    if (track->count == 0)
        to[5] = 0;
    if (track->count == 0 && is_out)
        to[4] = t;
    if (track->count > 0) {
        const double t0 = track->t[1], v0 = track->value[1],
                     bound_near = fmax(v0, value) > bound->to ? bound->to : bound->from;
        const bool was_out = record_is_beyond(bound, v0);
        const double crossing =
            is_out == was_out ? t : fmin(fmax(t0 + (t - t0) * (bound_near - v0) / (value - v0), t0), t);
        if (!was_out && is_out && isnan(to[4]))
            to[4] = crossing;
        if (was_out || is_out)
            to[5] += is_out == was_out ? t - t0 : was_out ? crossing - t0 : t - crossing;
    }
    *track = (struct limit_track){.t = {track->t[1], t},
                                  .value = {track->value[1], value},
                                  .count = track->count < 2 ? track->count + 1 : 2};
}

static void record(struct recorder *recorder, int item, double value, int number) {
    const struct seen_times *times = &recorder->kept->times;
    double *to = recorder->values + recorder->layout->items[item].offset;
    const int output = times->output[number], at = times->at[number];
    switch (recorder->kept->kinds[item]) {
    case KEPT_FINAL:
        *to = value;
        break;
    case KEPT_AT:
        if (at >= 0)
            to[at] = value;
        break;
    case KEPT_EXTREMES:
        if (output >= 0)
            widen(to, value, times->t[number], number == 0);
        break;
    case KEPT_NORM:
        if (output >= 0)
            add_square(recorder, item, value, times->t[number], number == 0, number == times->count - 1);
        break;
    case KEPT_HISTORY:
        if (output >= 0)
            to[output] = value;
        break;
    case KEPT_LIMIT:
        if (output >= 0)
            add_to_limit(recorder, item, value, times->t[number]);
        break;
    case KEPT_DERIVATIVE: /* runs_derive */
    case KEPT_REALISE:    /* realised_cases.c */
        break;
    }
}

void runs_recorder_take(struct recorder *recorder, int number) {
    const struct seen_times *times = &recorder->kept->times;
    for (int i = 0; i < recorder->layout->item_count; i++)
        if (recorder->places[i] >= 0)
            record(recorder, i, recorder->table->values[recorder->places[i]], number);
    if (times->output[number] >= 0)
        recorder->t_before = times->t[number];
}

void runs_recorder_see(struct recorder *recorder, int number) {
    if (recorder->keeps_ends_alone && number < recorder->kept->times.count - 1)
        return;
    record_table_fill_row(recorder->table);
    runs_recorder_take(recorder, number);
}

/* Records the state at which an event has ended the case, between two recorded times. */
static void record_end(struct recorder *recorder, int item, double value, double t) {
    double *to = recorder->values + recorder->layout->items[item].offset;
    const enum kept_kind kind = recorder->kept->kinds[item];
    if (kind == KEPT_FINAL)
        *to = value;
    else if (kind == KEPT_EXTREMES)
        widen(to, value, t, false);
    else if (kind == KEPT_NORM)
        add_square(recorder, item, value, t, false, true);
    else if (kind == KEPT_LIMIT)
        add_to_limit(recorder, item, value, t);
}

void runs_recorder_end(struct recorder *recorder, double t) {
    record_table_fill_row(recorder->table);
    for (int i = 0; i < recorder->layout->item_count; i++)
        if (recorder->places[i] >= 0)
            record_end(recorder, i, recorder->table->values[recorder->places[i]], t);
}

void runs_recorder_fail(struct recorder *recorder, double t) {
    for (int i = 0; i < recorder->layout->item_count; i++) {
        const struct kept_item *item = &recorder->layout->items[i];
        const enum kept_kind kind = recorder->kept->kinds[i];
        if (kind == KEPT_AT || kind == KEPT_HISTORY)
            continue;
        for (int k = 0; k < item->size; k++)
            recorder->values[item->offset + k] = NAN;
        if (kind == KEPT_FINAL && strcmp(item->name, "t") == 0)
            recorder->values[item->offset] = t;
    }
}
