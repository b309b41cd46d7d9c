/* Fills the numbers that a batch keeps of one case from the states of its motion. */
#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

/* Looks up the items' columns in the table, and selects the blocks that it must compute. */
static void find_places(struct recorder *recorder) {
    const struct kept *kept = recorder->kept;
    struct table *table = &recorder->table;
    bool *wanted = format_allocate((size_t)table->count, sizeof *wanted);
    for (int i = 0; i < recorder->layout->item_count; i++) {
        recorder->places[i] = text_index(kept->columns[i], table->names, table->count);
        if (recorder->places[i] >= 0)
            wanted[recorder->places[i]] = true;
    }
    simulate_table_want(table, wanted);
}

void runs_recorder_start(struct recorder *recorder, const struct kept *kept, const struct runs_layout *layout,
                         struct refdyn_integrator *integrator) {
    *recorder = (struct recorder){.kept = kept, .layout = layout};
    simulate_table_start(&recorder->table, integrator, NULL);
    recorder->places = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->places);
    recorder->before = format_allocate((size_t)layout->item_count + 1, sizeof *recorder->before);
    recorder->values = format_allocate((size_t)layout->width + 1, sizeof *recorder->values);
    find_places(recorder);
    recorder->keeps_ends_alone = true;
    for (int i = 0; i < layout->item_count; i++)
        recorder->keeps_ends_alone &= kept->kinds[i] == KEPT_FINAL;
}

void runs_recorder_clear(struct recorder *recorder) {
    for (int i = 0; i < recorder->layout->width; i++)
        recorder->values[i] = NAN;
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
    }
}

void runs_recorder_see(struct recorder *recorder, int number) {
    const struct seen_times *times = &recorder->kept->times;
    if (recorder->keeps_ends_alone && number < times->count - 1)
        return;
    simulate_table_fill(&recorder->table);
    for (int i = 0; i < recorder->layout->item_count; i++)
        if (recorder->places[i] >= 0)
            record(recorder, i, recorder->table.values[recorder->places[i]], number);
    if (times->output[number] >= 0)
        recorder->t_before = times->t[number];
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
}

void runs_recorder_end(struct recorder *recorder, double t) {
    simulate_table_fill(&recorder->table);
    for (int i = 0; i < recorder->layout->item_count; i++)
        if (recorder->places[i] >= 0)
            record_end(recorder, i, recorder->table.values[recorder->places[i]], t);
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
