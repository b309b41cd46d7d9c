/* Conditions that end a motion. */
#include "runtime/record/record.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void record_stops_start(struct record_stops *stops, struct record_memory memory, int most,
                        struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial) {
    *stops = (struct record_stops){.count = 0};
    stops->list = memory.get(memory.context, ((size_t)most + 1) * sizeof *stops->list);
    record_table_start(&stops->table, memory, integrator, spatial);
}

/* Reads a finite number in decimal digits such as "-1.5e3". */
static bool read_number(const char *text, double *value) {
    char *end;
    *value = strtod(text, &end);
    return end != text && !*end && !text[strspn(text, "+-.0123456789eE")] && isfinite(*value);
}

enum record_stop_fault record_stops_add(struct record_stops *stops, const char *text) {
    const size_t length = strcspn(text, "<>");
    const char *number = text + length + (text[length] != '\0');
    struct record_stop stop = {.text = text, .is_below = text[length] == '<'};
    if (length == 0 || !read_number(number, &stop.value))
        return RECORD_STOP_NO_CONDITION;
    stop.column = record_table_find(&stops->table, text, length);
    if (stop.column < 0)
        return RECORD_STOP_NO_COLUMN;
    stops->list[stops->count++] = stop;
    return RECORD_STOP_READ;
}

bool record_stops_hold(struct record_stops *stops) {
    record_table_fill(&stops->table);
    for (int i = 0; i < stops->count; i++) {
        const struct record_stop *stop = &stops->list[i];
        const double value = stops->table.values[stop->column];
        if (stop->is_below ? value < stop->value : value > stop->value) {
            stops->reached = stop->text;
            stops->t = stops->table.integrator->t;
            return true;
        }
    }
    return false;
}

/* Bisects down to rounding of the time or of the step, also across a jump, where the later side counts. */
int record_stops_meet(struct record_stops *stops, double t_before) {
    struct refdyn_integrator *integrator = stops->table.integrator;
    double before = t_before, after = integrator->t;
    const double span = after - before;
    if (!record_stops_hold(stops))
        return REFDYN_OK;
    while (after - before > DBL_EPSILON * fmax(span, fmax(fabs(before), fabs(after)))) {
        const double middle = before + (after - before) / 2;
        if (!(middle > before && middle < after))
            break;
        const int status = refdyn_integrator_look(integrator, middle);
        if (status != REFDYN_OK)
            return status;
        *(record_stops_hold(stops) ? &after : &before) = middle;
    }
    const int status = refdyn_integrator_look(integrator, after);
    if (status == REFDYN_OK)
        record_stops_hold(stops);
    return status;
}
