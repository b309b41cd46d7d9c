/* Records where a motion exceeds the limits of its joints. */
#include "runtime/tool/motions/simulate/simulate.h"

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
struct watched_limit {
    const char *coordinate, *what, *unit;
    int place; /* of the coordinate */
    double least, most;
    double value, t; /* the value farthest beyond the limit and its time [m, rad ...; s] */
    double beyond;   /* how far it is beyond; 0 if never */
};

struct limit_record {
    struct watched_limit *list;
    int count;
    bool has_forces;
    double *force; /* (n) */
};

static void watch(struct limit_record *record, const struct frame *frame, int place, int kind, double least,
                  double most) {
    if (isinf(least) && isinf(most))
        return;
    record->has_forces |= kind == FORCE;
    record->list[record->count++] = (struct watched_limit){
        .coordinate = frame->name,
        .what = kinds[kind].what,
        .unit = frame->joint.is_revolute ? kinds[kind].turn_unit : kinds[kind].slide_unit,
        .place = place,
        .least = least,
        .most = most};
}

struct limit_record *simulate_limits_start(const struct scene *scene) {
    const struct tree *tree = &scene->generation.tree;
    struct limit_record *record = format_allocate_large(1, sizeof *record);
    record->list = format_allocate_large(KINDS * (size_t)tree->count, sizeof *record->list);
    for (int i = 0; i < tree->count; i++) {
        const struct limits *limits = tree->frames[i].joint.limits;
        if (!limits)
            continue;
        watch(record, &tree->frames[i], i, POSITION, limits->from, limits->to);
        watch(record, &tree->frames[i], i, RATE, -limits->rate, limits->rate);
        watch(record, &tree->frames[i], i, FORCE, -limits->force, limits->force);
    }
    record->force = format_allocate_large((size_t)tree->count, sizeof *record->force);
    return record;
}

/* The scale of values near this limit. */
static double size_of(const struct watched_limit *limit) {
    if (isfinite(limit->least) && isfinite(limit->most))
        return limit->most - limit->least;
    return fmax(1, fabs(isfinite(limit->most) ? limit->most : limit->least));
}

static void look(struct watched_limit *limit, double value, double t) {
    const double beyond = fmax(limit->least - value, value - limit->most);
    if (beyond <= fmax(limit->beyond, slack * size_of(limit)))
        return;
    limit->beyond = beyond;
    limit->value = value;
    limit->t = t;
}

void simulate_limits_add(struct limit_record *record, struct refdyn_integrator *integrator) {
    if (record->has_forces)
        refdyn_integrator_force(integrator, record->force);
    for (int i = 0; i < record->count; i++) {
        struct watched_limit *limit = &record->list[i];
        const double *values = limit->what == kinds[POSITION].what ? integrator->q
                               : limit->what == kinds[RATE].what   ? integrator->qd
                                                                   : record->force;
        look(limit, values[limit->place], integrator->t);
    }
}

void simulate_limits_print(const struct limit_record *record) {
    char text[NUMBER_LENGTH];
    for (int i = 0; record && i < record->count; i++) {
        const struct watched_limit *limit = &record->list[i];
        if (limit->beyond > 0)
            fprintf(stderr,
                    "refdyn: warning: %s exceeds its limits: %s %.6g %s at t = %s s; allowed is %s %.6g\n",
                    limit->coordinate,
                    strcmp(limit->what, kinds[FORCE].what) ? limit->what : "programme force", limit->value,
                    limit->unit, format_near_number(limit->t, text),
                    limit->value > limit->most ? "at most" : "at least",
                    limit->value > limit->most ? limit->most : limit->least);
    }
}

void simulate_limits_put(const struct limit_record *record, struct document *document) {
    if (!record || record->count == 0)
        return;
    format_put_open(document, "limits", '[');
    for (int i = 0; i < record->count; i++) {
        const struct watched_limit *limit = &record->list[i];
        if (!(limit->beyond > 0))
            continue;
        format_put_open(document, NULL, '{');
        format_put_text(document, "coordinate", limit->coordinate);
        format_put_text(document, "limit", limit->what);
        format_put_number(document, "value", limit->value);
        format_put_number(document, "allowed", limit->value > limit->most ? limit->most : limit->least);
        format_put_number(document, "t", limit->t);
        format_put_close(document, '}');
    }
    format_put_close(document, ']');
}

void simulate_limits_release(struct limit_record *record) {
    if (record) {
        free(record->list);
        free(record->force);
    }
    free(record);
}
