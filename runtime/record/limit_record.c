/*
 * Compares a motion with the limits of its model: for each its extremes, the first time at which it is
 * exceeded, and for how long. Each step is sampled, and extremes and crossings are located within it, so that
 * the results do not depend on the outputs.
 */
#include "runtime/record/record.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PIECES = 4,                     /* of a step, between which values are sampled */
    SAMPLES = PIECES + 2,           /* those of the pieces, and the end after a jump */
    POINTS_MOST = SAMPLES + PIECES, /* samples, and an extreme in each piece */
    PARABOLAS_MOST = 12             /* for an extreme, of which a few suffice where the value is smooth */
};

/* Smaller excesses, as a part of a limit or of the range between two, are rounding. */
static const double slack = 1e-9;
/* Distance of the last piece from a time event at the end of a step, as a part of the step or of the time:
 * the state there has the values that follow the event. States at other jumps have those before it, and the
 * state at the beginning of a step has those after it. */
static const double inside = 1e-11;

struct point {
    double t, value;
};

/* ---- Which columns ---- */

void record_limits_start(struct record_limits *limits, struct record_memory memory,
                         struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial,
                         const struct record_bound *bounds, int count) {
    *limits = (struct record_limits){.count = count, .t = -INFINITY};
    if (count == 0)
        return;
    record_table_start(&limits->table, memory, integrator, spatial);
    limits->list = memory.get(memory.context, (size_t)count * sizeof *limits->list);
    limits->samples = memory.get(memory.context, SAMPLES * (size_t)count * sizeof *limits->samples);
    bool *wanted = memory.get(memory.context, (size_t)limits->table.count * sizeof *wanted);
    for (int i = 0; i < count; i++) {
        const int place = record_table_find(&limits->table, bounds[i].column, strlen(bounds[i].column));
        assert(place >= 0); /* the model was checked when it was read */
        limits->list[i] =
            (struct record_limit){.bound = bounds[i], .place = place, .unit = limits->table.units[place]};
        wanted[place] = true;
    }
    record_limits_clear(limits);
    record_table_want(&limits->table, wanted);
}

void record_limits_clear(struct record_limits *limits) {
    for (int i = 0; i < limits->count; i++) {
        struct record_limit *limit = &limits->list[i];
        limit->smallest = INFINITY;
        limit->largest = -INFINITY;
        limit->t_smallest = limit->t_largest = limit->duration = 0;
        limit->t_first = limit->t_open = limit->begin = limit->end = NAN;
    }
}

/* ---- One limit within a step ---- */

/* The scale of values near this limit. */
static double size_of(const struct record_bound *bound) {
    if (isfinite(bound->from) && isfinite(bound->to))
        return bound->to - bound->from;
    return fmax(1, fabs(isfinite(bound->to) ? bound->to : bound->from));
}

static double excess(const struct record_bound *bound, double value) {
    return fmax(bound->from - value, value - bound->to);
}

bool record_is_beyond(const struct record_bound *bound, double value) {
    return excess(bound, value) > slack * size_of(bound);
}

/* The value at a time of the last step. A time at which there is none keeps *status. */
static double value_at(struct record_limits *limits, const struct record_limit *limit, double t,
                       int *status) {
    const int shown = record_table_look(&limits->table, t);
    if (shown != REFDYN_OK) {
        *status = shown;
        return NAN;
    }
    return limits->table.values[limit->place];
}

/* The vertex of the parabola through three points; NAN if they lie on a line. */
static double vertex(struct point a, struct point b, struct point c) {
    const double left = (b.t - a.t) * (b.value - c.value), right = (b.t - c.t) * (b.value - a.value);
    return b.t - ((b.t - a.t) * left - (b.t - c.t) * right) / (2 * (left - right));
}

/* The extreme (sign 1: largest, -1: smallest) between two points, from a first guess of its time: by
 * parabolas through three points, of which the middle one is the best so far. */
static struct point extreme_between(struct record_limits *limits, const struct record_limit *limit,
                                    struct point low, struct point high, double t, double sign, int *status) {
    const double near = 1e-8 * (high.t - low.t);
    struct point best = {t, value_at(limits, limit, t, status)};
    for (int i = 0; i < PARABOLAS_MOST && *status == REFDYN_OK; i++) {
        double next = vertex(low, best, high);
        if (!(next > low.t && next < high.t))
            next = high.t - best.t > best.t - low.t ? (best.t + high.t) / 2 : (best.t + low.t) / 2;
        if (fabs(next - best.t) < near)
            break;
        const struct point tried = {next, value_at(limits, limit, next, status)};
        const bool is_better = sign * tried.value > sign * best.value;
        *((tried.t < best.t) == is_better ? &high : &low) = is_better ? best : tried;
        best = is_better ? tried : best;
    }
    return best;
}

/* Whether the parabola through three samples at equal distances has its vertex between samples `from` and
 * `from` + 1, or near one of them: at *share of their distance, with value *estimate and its uncertainty. An
 * extreme may be on either side of a sample at which the parabola has its vertex. */
static bool has_vertex(const double *three, int from, double *share, double *estimate, double *uncertainty) {
    const double near = 0.1, part = 0.1;
    const double slope = (three[2] - three[0]) / 2, curvature = three[2] - 2 * three[1] + three[0];
    const double vertex_share = -slope / curvature + 1 - from;
    *share = fmin(fmax(vertex_share, near / 2), 1 - near / 2);
    *estimate = three[1] - slope * slope / (2 * curvature);
    *uncertainty = part * (fabs(slope) + fabs(curvature));
    return curvature != 0 && vertex_share > -near && vertex_share < 1 + near;
}

/* Whether an extreme of this value may matter: beyond those known, or beyond the limit. */
static bool matters(const struct record_limit *limit, double value, double uncertainty) {
    return value + uncertainty > limit->largest || value - uncertainty < limit->smallest ||
           record_is_beyond(&limit->bound, value + uncertainty) ||
           record_is_beyond(&limit->bound, value - uncertainty);
}

/* The samples, and the extremes between them that matter. Returns their number. The last sample is the end
 * of the step, the others bound the pieces. */
static int list_points(struct record_limits *limits, const struct record_limit *limit, const double *t,
                       const double *values, struct point *points, int *status) {
    int count = 0;
    for (int k = 0; k <= PIECES; k++) {
        points[count++] = (struct point){t[k], values[k]};
        const int first = k == 0 ? 0 : k < PIECES - 1 ? k - 1 : PIECES - 2;
        double share, estimate, uncertainty;
        if (k < PIECES && has_vertex(values + first, k - first, &share, &estimate, &uncertainty) &&
            matters(limit, estimate, uncertainty)) {
            const struct point low = {t[k], values[k]}, high = {t[k + 1], values[k + 1]};
            points[count] = extreme_between(limits, limit, low, high, low.t + share * (high.t - low.t),
                                            estimate > values[k] ? 1 : -1, status);
            count += *status == REFDYN_OK;
        }
    }
    points[count++] = (struct point){t[PIECES + 1], values[PIECES + 1]};
    return count;
}

/* The time between two points at which the limit is crossed; only one of them is beyond it. */
static double crossing(struct record_limits *limits, const struct record_limit *limit, struct point from,
                       struct point to, int *status) {
    const bool was_beyond = record_is_beyond(&limit->bound, from.value);
    double before = from.t, after = to.t;
    while (after - before > DBL_EPSILON * fmax(fabs(before), fabs(after)) && *status == REFDYN_OK) {
        const double middle = before + (after - before) / 2;
        if (!(middle > before && middle < after))
            break;
        const bool is_same =
            record_is_beyond(&limit->bound, value_at(limits, limit, middle, status)) == was_beyond;
        *(is_same ? &before : &after) = middle;
    }
    return after;
}

static void widen(struct record_limit *limit, struct point point) {
    if (isnan(point.value) && isnan(limit->t_open))
        limit->t_open = point.t;
    if (point.value < limit->smallest) {
        limit->smallest = point.value;
        limit->t_smallest = point.t;
    }
    if (point.value > limit->largest) {
        limit->largest = point.value;
        limit->t_largest = point.t;
    }
}

static void add_points(struct record_limits *limits, struct record_limit *limit, const struct point *points,
                       int count, int *status) {
    limit->begin = isnan(limit->begin) ? points[0].value : limit->begin;
    limit->end = points[count - 1].value;
    for (int k = 0; k < count; k++) {
        const bool is_out = record_is_beyond(&limit->bound, points[k].value);
        widen(limit, points[k]);
        if (is_out && isnan(limit->t_first))
            limit->t_first = points[k].t;
        if (k + 1 == count)
            return;
        const bool goes_out = record_is_beyond(&limit->bound, points[k + 1].value);
        const double t =
            is_out != goes_out ? crossing(limits, limit, points[k], points[k + 1], status) : points[k + 1].t;
        if (is_out)
            limit->duration += t - points[k].t;
        else if (goes_out) {
            limit->duration += points[k + 1].t - t;
            limit->t_first = fmin(limit->t_first, t); /* of a time and NAN, the time */
        }
    }
}

/* The values at a time of the step, as sample k. */
static int take_sample(struct record_limits *limits, int k, double t) {
    const int status = record_table_look(&limits->table, t);
    for (int i = 0; i < limits->count; i++)
        limits->samples[k * limits->count + i] = limits->table.values[limits->list[i].place];
    return status;
}

int record_limits_pass(struct record_limits *limits) {
    struct refdyn_integrator *integrator = limits->table.integrator;
    const double t_now = integrator->t, first = fmax(limits->t, integrator->t_begin);
    const double aside = inside * fmax(t_now - first, fmax(fabs(first), fabs(t_now)));
    const bool is_at_event = integrator->t_right != t_now;
    const double last = is_at_event ? fmax(t_now - aside, first) : t_now;
    double t[SAMPLES], values[SAMPLES];
    struct point points[POINTS_MOST];
    int status = REFDYN_OK;
    if (!(t_now > first))
        return REFDYN_OK;
    for (int k = 0; k < SAMPLES; k++)
        t[k] = k < PIECES ? first + (last - first) * k / PIECES : k == PIECES ? last : t_now;
    for (int k = 0; k < SAMPLES && status == REFDYN_OK; k++)
        if (k != PIECES || is_at_event)
            status = take_sample(limits, k, t[k]);
    for (int i = 0; i < limits->count && status == REFDYN_OK; i++) {
        struct record_limit *limit = &limits->list[i];
        for (int k = 0; k < SAMPLES; k++)
            values[k] = limits->samples[(k == PIECES && !is_at_event ? k + 1 : k) * limits->count + i];
        if (limits->is_inner)
            values[PIECES + 1] = values[PIECES];
        const int count = list_points(limits, limit, t, values, points, &status);
        add_points(limits, limit, points, count, &status);
    }
    limits->t = t_now;
    const bool is_shown = integrator->t == t_now && limits->table.needs_accelerations;
    return status == REFDYN_OK && !is_shown ? refdyn_integrator_look(integrator, t_now) : status;
}

/* The part of a straight line between two values that is beyond the bound, and where it begins. */
static double part_beyond(const struct record_bound *bound, double before, double after, double *begin) {
    const bool was_beyond = record_is_beyond(bound, before), is_beyond = record_is_beyond(bound, after);
    const double outer = was_beyond ? before : after, crossed = outer > bound->to ? bound->to : bound->from,
                 share = was_beyond == is_beyond ? 0 : (crossed - before) / (after - before);
    *begin = was_beyond ? 0 : share;
    return was_beyond == is_beyond ? (double)is_beyond : was_beyond ? share : 1 - share;
}

void record_limits_take(struct record_limits *limits) {
    const double t = limits->table.integrator->t, length = isfinite(limits->t) ? t - limits->t : 0;
    record_table_fill(&limits->table);
    for (int i = 0; i < limits->count; i++) {
        struct record_limit *limit = &limits->list[i];
        const double value = limits->table.values[limit->place];
        double begin,
            part = part_beyond(&limit->bound, length > 0 ? limits->samples[i] : value, value, &begin);
        widen(limit, (struct point){t, value});
        limit->duration += part * length;
        if (part > 0 && isnan(limit->t_first))
            limit->t_first = t - (1 - begin) * length;
        limits->samples[i] = value;
    }
    limits->t = t;
}

/* ---- Reports ---- */

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

void record_limits_print(const struct record_limits *limits, FILE *out) {
    char first[RECORD_NUMBER_LENGTH], farthest[RECORD_NUMBER_LENGTH];
    for (int i = 0; i < limits->count; i++) {
        const struct record_limit *limit = &limits->list[i];
        const struct record_bound *bound = &limit->bound;
        const bool is_above = limit->largest - bound->to > bound->from - limit->smallest;
        const bool is_force = strncmp(bound->column, record_force_lead, strlen(record_force_lead)) == 0;
        if (!isnan(limit->t_open))
            fprintf(out,
                    "refdyn: warning: %s: redundant rows share %s in any proportion from t = %s s on, so "
                    "that its "
                    "limits are not compared there; remove the redundant rows\n",
                    bound->name, bound->column, near_number(limit->t_open, first));
        if (isnan(limit->t_first))
            continue;
        fprintf(out,
                "refdyn: warning: %s exceeds its limits: %s%.6g%s%s at t = %s s; allowed is %s %.6g; beyond "
                "for %.3g s, from t = %s s on\n",
                bound->name, is_force ? "programme force " : "", is_above ? limit->largest : limit->smallest,
                limit->unit ? " " : "", limit->unit ? limit->unit : "",
                near_number(is_above ? limit->t_largest : limit->t_smallest, farthest),
                is_above ? "at most" : "at least", is_above ? bound->to : bound->from, limit->duration,
                near_number(limit->t_first, first));
    }
}

static void put_finite(const struct record_writer *writer, const char *key, double value) {
    if (isfinite(value))
        writer->number(writer->context, key, value);
    else
        writer->null(writer->context, key);
}

void record_limits_put(const struct record_limits *limits, const struct record_writer *writer) {
    if (limits->count == 0)
        return;
    writer->open(writer->context, "limits", '[');
    for (int i = 0; i < limits->count; i++) {
        const struct record_limit *limit = &limits->list[i];
        const struct record_bound *bound = &limit->bound;
        const double amount = fmax(excess(bound, limit->smallest), excess(bound, limit->largest));
        writer->open(writer->context, NULL, '{');
        writer->text(writer->context, "name", bound->name);
        writer->text(writer->context, "column", bound->column);
        put_finite(writer, "from", bound->from);
        put_finite(writer, "to", bound->to);
        put_finite(writer, "smallest", limit->smallest);
        put_finite(writer, "t_smallest", limit->t_smallest);
        put_finite(writer, "largest", limit->largest);
        put_finite(writer, "t_largest", limit->t_largest);
        put_finite(writer, "t", limit->t_first);
        writer->number(writer->context, "duration", limit->duration);
        writer->number(writer->context, "violation", isnan(limit->t_first) ? 0 : amount);
        writer->close(writer->context, '}');
    }
    writer->close(writer->context, ']');
}
