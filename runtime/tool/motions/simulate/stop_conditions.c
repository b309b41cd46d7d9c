/* Conditions that end a motion: see simulate.h. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"

#include <float.h>
#include <math.h>
#include <string.h>

static enum status wrong_column(const struct stops *stops, const struct options *options, const char *name) {
    const char *near = message_nearest_name(name, stops->table.names, stops->table.count);
    return usage_error(options->command, "--stop: the CSV has no column '%s'%s%s", name,
                       near ? ", the nearest is " : "", near ? near : "");
}

static enum status read_stop(struct stops *stops, const struct options *options, const char *text) {
    const size_t length = strcspn(text, "<>");
    const char *number = text + length + (text[length] != '\0');
    struct stop stop = {.text = text, .is_below = text[length] == '<'};
    if (length == 0 || !text_to_number(number, &stop.value))
        return usage_error(options->command, "--stop: '%s' is not of the form NAME<VALUE or NAME>VALUE",
                           text);
    const char *name = text_format("%.*s", (int)length, text);
    stop.column = text_index(name, stops->table.names, stops->table.count);
    stops->list[stops->count++] = stop;
    return stop.column < 0 ? wrong_column(stops, options, name) : STATUS_DONE;
}

enum status stops_read(struct stops *stops, const struct options *options,
                       struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial) {
    enum status status = STATUS_DONE;
    *stops = (struct stops){.integrator = integrator};
    stops->list = allocate((size_t)options->value_count, sizeof *stops->list);
    table_start(&stops->table, integrator, spatial);
    const char *text;
    for (int i = 0; status == STATUS_DONE && (text = options_repeated(options, "stop", i)); i++)
        status = read_stop(stops, options, text);
    return status;
}

bool stops_hold(struct stops *stops) {
    table_fill(&stops->table);
    for (int i = 0; i < stops->count; i++) {
        const struct stop *stop = &stops->list[i];
        const double value = stops->table.values[stop->column];
        if (stop->is_below ? value < stop->value : value > stop->value) {
            stops->reached = stop;
            stops->t = stops->integrator->t;
            return true;
        }
    }
    return false;
}

/* By bisection down to neighbouring times: also across a jump, at which the later side counts. */
int stops_meet(struct stops *stops, double t_before) {
    double before = t_before, after = stops->integrator->t;
    if (!stops_hold(stops))
        return REFDYN_OK;
    while (after - before > DBL_EPSILON * fmax(fabs(before), fabs(after))) {
        const double middle = before + (after - before) / 2;
        if (!(middle > before && middle < after))
            break;
        const int status = refdyn_integrator_look(stops->integrator, middle);
        if (status != REFDYN_OK)
            return status;
        *(stops_hold(stops) ? &after : &before) = middle;
    }
    const int status = refdyn_integrator_look(stops->integrator, after);
    if (status == REFDYN_OK)
        stops_hold(stops);
    return status;
}
