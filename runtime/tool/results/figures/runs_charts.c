/* The charts of a file of runs: see figures.h. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

void runs_charts_add_head(struct runs_charts *figure, char *text) {
    figure->heads = memory_room(&figure->memory, figure->heads, figure->head_count, &figure->head_room,
                                sizeof *figure->heads);
    figure->heads[figure->head_count++] = (struct key){.name = text};
}

char *runs_charts_label(const char *lead, const char *name, const char *unit) {
    return unit && *unit ? text_format("%s%s [%s]", lead, name, unit) : text_format("%s%s", lead, name);
}

bool runs_charts_can_draw(double value) {
    const double largest = 1e150;
    return fabs(value) <= largest;
}

double *runs_charts_read(struct runs_charts *figure, const struct kept_item *item, int place, int count) {
    const long cases = hdf5_runs_count(figure->reader);
    const size_t part = (size_t)count;
    double *values = memory_get(&figure->memory, ((size_t)cases * part + 1) * sizeof *values);
    for (long row = 0; row < cases; row++) {
        struct case_record record;
        if (!hdf5_runs_get(figure->reader, row, &record))
            return NULL;
        memcpy(values + (size_t)row * part, record.values + item->offset + place, part * sizeof *values);
    }
    return values;
}
