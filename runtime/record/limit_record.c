/* Records where a motion exceeds the limits of its joints. */
#include "runtime/record/record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Smaller excesses, as a part of a limit or of the range between two, are rounding. */
static const double slack = 1e-9;

/* The limits of a joint. */
enum { POSITION, RATE, FORCE, KINDS };

static const struct {
    const char *what, *slide_unit, *turn_unit;
} kinds[KINDS] = {[POSITION] = {"position", "m", "rad"},
                  [RATE] = {"rate", "m/s", "rad/s"},
                  [FORCE] = {"force", "N", "N m"}};

/* One limit: of a coordinate, its rate or its programme force. */
struct record_limit {
    const char *coordinate, *what, *unit;
    int place; /* of the coordinate */
    double least, most;
    double value, t; /* the value farthest beyond the limit and its time [m, rad ...; s] */
    double beyond;   /* how far it is beyond; 0 if never */
};

static void watch(struct record_limits *record, const struct refdyn_name *coordinate, int place, int kind,
                  double least, double most) {
    if (isinf(least) && isinf(most))
        return;
    record->has_forces |= kind == FORCE;
    record->list[record->count++] = (struct record_limit){
        .coordinate = coordinate->name,
        .what = kinds[kind].what,
        .unit = strcmp(coordinate->unit, "rad") == 0 ? kinds[kind].turn_unit : kinds[kind].slide_unit,
        .place = place,
        .least = least,
        .most = most};
}

void record_limits_start(struct record_limits *record, struct record_memory memory,
                         const struct refdyn_model *model, const struct refdyn_limits *list, int count) {
    *record = (struct record_limits){.count = 0};
    record->list = memory.get(memory.context, (KINDS * (size_t)count + 1) * sizeof *record->list);
    record->force = memory.get(memory.context, ((size_t)model->n + 1) * sizeof *record->force);
    for (int i = 0; i < count; i++) {
        const int place = list[i].coordinate;
        const struct refdyn_name *coordinate = &model->coordinates[place];
        watch(record, coordinate, place, POSITION, list[i].from, list[i].to);
        watch(record, coordinate, place, RATE, -list[i].rate, list[i].rate);
        watch(record, coordinate, place, FORCE, -list[i].force, list[i].force);
    }
}

/* The scale of values near this limit. */
static double size_of(const struct record_limit *limit) {
    if (isfinite(limit->least) && isfinite(limit->most))
        return limit->most - limit->least;
    return fmax(1, fabs(isfinite(limit->most) ? limit->most : limit->least));
}

static void look(struct record_limit *limit, double value, double t) {
    const double beyond = fmax(limit->least - value, value - limit->most);
    if (beyond <= fmax(limit->beyond, slack * size_of(limit)))
        return;
    limit->beyond = beyond;
    limit->value = value;
    limit->t = t;
}

void record_limits_add(struct record_limits *record, struct refdyn_integrator *integrator) {
    if (record->has_forces)
        refdyn_integrator_force(integrator, record->force);
    for (int i = 0; i < record->count; i++) {
        struct record_limit *limit = &record->list[i];
        const double *values = limit->what == kinds[POSITION].what ? integrator->q
                               : limit->what == kinds[RATE].what   ? integrator->qd
                                                                   : record->force;
        look(limit, values[limit->place], integrator->t);
    }
}

/* The number within 1e-15 of the value that has the fewest digits, 15 to 17: "0.94" for 0.9400000000000001.
 */
static const char *near_number(double value, char text[static RECORD_NUMBER_LENGTH]) {
    const double rounding = 1e-15;
    const int fewest = 15, most = 17; /* number of digits; zeros at the end are not printed */
    for (int digits = fewest; digits <= most; digits++) {
        snprintf(text, RECORD_NUMBER_LENGTH, "%.*g", digits, value + 0.0); /* no -0 */
        if (fabs(strtod(text, NULL) - value) <= rounding * fabs(value))
            break;
    }
    return text;
}

void record_limits_print(const struct record_limits *record, FILE *out) {
    char text[RECORD_NUMBER_LENGTH];
    for (int i = 0; i < record->count; i++) {
        const struct record_limit *limit = &record->list[i];
        if (limit->beyond > 0)
            fprintf(
                out, "refdyn: warning: %s exceeds its limits: %s %.6g %s at t = %s s; allowed is %s %.6g\n",
                limit->coordinate, strcmp(limit->what, kinds[FORCE].what) ? limit->what : "programme force",
                limit->value, limit->unit, near_number(limit->t, text),
                limit->value > limit->most ? "at most" : "at least",
                limit->value > limit->most ? limit->most : limit->least);
    }
}

void record_limits_put(const struct record_limits *record, const struct record_writer *writer) {
    if (record->count == 0)
        return;
    writer->open(writer->context, "limits", '[');
    for (int i = 0; i < record->count; i++) {
        const struct record_limit *limit = &record->list[i];
        if (!(limit->beyond > 0))
            continue;
        writer->open(writer->context, NULL, '{');
        writer->text(writer->context, "coordinate", limit->coordinate);
        writer->text(writer->context, "limit", limit->what);
        writer->number(writer->context, "value", limit->value);
        writer->number(writer->context, "allowed", limit->value > limit->most ? limit->most : limit->least);
        writer->number(writer->context, "t", limit->t);
        writer->close(writer->context, '}');
    }
    writer->close(writer->context, ']');
}
