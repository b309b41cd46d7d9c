/*
 * Time events: kinks and jumps of formulas of time alone.
 *
 * In: the emitted `breaks`, times that follow from parameters and inputs, and `switches`, values that change
 * their sign at all other time events. Out: the time of the next event. Every step ends there and sees its
 * left side; the motion continues from its right side. Each side is so far from the event that no rounding of
 * a comparison matters.
 *
 * Switches are examined as far as a step may reach: first a change of sign between 32 samples, or more if the
 * frequency of the functions requires it (model.pace), then bisection. A sign that changes and changes back
 * between two samples is found where a parabola through three samples shows it. No step reaches beyond what
 * was searched.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Samples of the switches in a step; in the first step, whose length is not known yet; and at most, if the
 * switches vary fast. */
enum { SAMPLES = 32, SAMPLES_AT_START = 1000, SAMPLES_MOST = 4000 };
/* Largest advance of a phase between two samples [rad], so that a parabola through three shows each extreme.
 */
static const double phase_most = 0.4;
/* The error of this parabola for a sine, relative to the differences between its three values. */
static const double parabola_misses = 0.125;

/* Rows of events->switches: values at three times; one more row is for the time that is being evaluated. */
enum { ROWS = 3 };

void refdyn_time_events_lay_out(struct refdyn_time_events *events, const struct refdyn_model *model,
                                struct layout *layout) {
    events->count = model->break_count;
    events->times = layout_doubles(layout, model->break_count);
    events->switches = layout_doubles(layout, (ROWS + 1) * model->switch_count);
}

void refdyn_time_events_start(struct refdyn_motion *motion) {
    motion->time_events.switched = -INFINITY;
}

void refdyn_time_events_take(struct refdyn_time_events *events, const struct refdyn_workspace *work, double t,
                             const double *q, const double *qd) {
    double *times = events->times;
    events->next = 0;
    if (!work->model->breaks)
        return;
    work->model->breaks(work->p, work->x, t, q, qd, times);
    for (int i = 1; i < events->count; i++) {
        const double moved = times[i];
        int place = i;
        for (; place > 0 && times[place - 1] > moved; place--)
            times[place] = times[place - 1];
        times[place] = moved;
    }
}

/* Rounding of a time event, and of formulas that compare the time with it. */
static double blur(double t) {
    return fmax(2 * DBL_EPSILON * fabs(t), DBL_MIN);
}

double refdyn_time_events_right_of(const struct refdyn_time_events *events, double t) {
    if (events->count == 0 && events->switched == -INFINITY)
        return t;
    const double same = refdyn_time_resolution(t);
    double right = t;
    for (int i = 0; i < events->count; i++)
        if (fabs(events->times[i] - t) <= same)
            right = fmax(right, events->times[i] + blur(t));
    return fabs(events->switched - t) <= same ? fmax(right, events->switched + blur(t)) : right;
}

/* ---- Dips ---- */

int refdyn_dip_bottom(const struct refdyn_dip *dip, double *x, double *v) {
    const double left = (dip->v[1] - dip->v[0]) / (dip->x[1] - dip->x[0]);
    const double right = (dip->v[2] - dip->v[1]) / (dip->x[2] - dip->x[1]);
    const double curvature = (right - left) / (dip->x[2] - dip->x[0]);
    const double middle = (dip->x[0] + dip->x[1]) / 2;
    if (!(curvature > 0))
        return 0;
    *x = middle - left / (2 * curvature);
    *v = dip->v[0] + (*x - dip->x[0]) * (left + curvature * (*x - dip->x[1]));
    return *x > dip->x[0] && *x < dip->x[2] && *x != dip->x[1];
}

void refdyn_dip_narrow(struct refdyn_dip *dip, double x, double v) {
    const int is_left = x < dip->x[1], is_lower = v < dip->v[1];
    const int kept = is_lower ? (is_left ? 2 : 0) : (is_left ? 0 : 2);
    dip->x[kept] = is_lower ? dip->x[1] : x;
    dip->v[kept] = is_lower ? dip->v[1] : v;
    if (is_lower) {
        dip->x[1] = x;
        dip->v[1] = v;
    }
}

/* ---- Values that change their sign at times that are not known ---- */

/* A search from the beginning of a step: the last times at which switches were evaluated, and the values
 * there.
 */
struct search {
    const struct refdyn_step *step;
    int count;
    double t[ROWS], *values[ROWS], *now;
    double reached; /* nothing changes its sign before this */
};

static void evaluate(const struct search *search, double t, double *values) {
    const struct refdyn_step *step = search->step;
    const struct refdyn_workspace *work = step->evaluation.work;
    work->model->switches(work->p, work->x, t, step->state, step->state + step->n, values);
}

/* Do the signs at t differ from those at the last time of the search? */
static int has_switched(const struct search *search, double t) {
    const double *kept = search->values[ROWS - 1];
    evaluate(search, t, search->now);
    for (int i = 0; i < search->count; i++)
        if ((search->now[i] < 0) != (kept[i] < 0))
            return 1;
    return 0;
}

/* Adds the values of search->now at t, and drops the first of the three. */
static void take_up(struct search *search, double t) {
    double *room = search->values[0];
    for (int k = 0; k + 1 < ROWS; k++) {
        search->t[k] = search->t[k + 1];
        search->values[k] = search->values[k + 1];
    }
    search->t[ROWS - 1] = t;
    search->values[ROWS - 1] = search->now;
    search->now = room;
}

/* Distance to the next sample: `most`, or less if phase_most allows less at t. */
static double spacing(const struct search *search, double t, double most) {
    const struct refdyn_step *step = search->step;
    const struct refdyn_workspace *work = step->evaluation.work;
    double pace[2] = {0, 0};
    if (work->model->pace)
        work->model->pace(work->p, work->x, t, step->state, step->state + step->n, pace);
    return pace[0] * most > phase_most ? phase_most / pace[0] : most;
}

/* May a value be beyond zero where the parabola predicts v? */
static int may_be_beyond(const struct refdyn_dip *dip, double v) {
    const double most = fmax(dip->v[0], fmax(dip->v[1], dip->v[2]));
    const double least = fmin(dip->v[0], fmin(dip->v[1], dip->v[2]));
    return v < fmax(least / 2, parabola_misses * (most - least));
}

/* A time between the last three at which switch i is beyond zero although it is not at these; INFINITY: none.
 */
static double find_dip(const struct search *search, int i) {
    const double side = search->values[ROWS - 1][i] < 0 ? -1 : 1;
    struct refdyn_dip dip;
    double x, v;
    for (int k = 0; k < ROWS; k++) {
        dip.x[k] = search->t[k];
        dip.v[k] = side * search->values[k][i];
    }
    const struct refdyn_dip seen = dip;
    for (int tries = 0;
         tries < REFDYN_DIPS_MOST && refdyn_dip_bottom(&dip, &x, &v) && may_be_beyond(&seen, v); tries++) {
        evaluate(search, x, search->now);
        v = side * search->now[i];
        if (v < 0)
            return x;
        refdyn_dip_narrow(&dip, x, v);
    }
    return INFINITY;
}

/* The first of these times of all switches. */
static double find_dips(const struct search *search) {
    double first = INFINITY;
    for (int i = 0; i < search->count; i++)
        first = fmin(first, find_dip(search, i));
    return first;
}

/* A time after the first change of a sign, which lies between search->reached and it; INFINITY: there is
 * none. The last sample lies beyond `until`, so that times near `until` also lie between three. */
static double look_ahead(struct search *search, double until, int samples) {
    const double most = (until - search->t[ROWS - 1]) / samples;
    for (int i = 1; i <= SAMPLES_MOST && search->reached < until; i++) {
        const double last = search->t[ROWS - 1], t = last + spacing(search, last, most);
        if (!(t > last))
            break;
        if (has_switched(search, t))
            return t;
        take_up(search, t);
        const double dip = i + 1 >= ROWS ? find_dips(search) : INFINITY;
        if (isfinite(dip))
            return dip;
        search->reached = i + 1 >= ROWS ? search->t[1] : search->reached;
    }
    return INFINITY;
}

/* The first time in (t_begin, until] with other signs than those right of t_begin; INFINITY: none as far as
 * *reached. */
static double find_switch(struct refdyn_time_events *events, const struct refdyn_step *step, double least,
                          double until, int samples, double *reached) {
    const int count = step->evaluation.work->model->switch_count;
    const double from = step->t_begin + 2 * least;
    struct search search = {.step = step, .count = count, .reached = from};
    *reached = INFINITY;
    if (count == 0 || !(until > from))
        return INFINITY;
    for (int k = 0; k < ROWS; k++)
        search.values[k] = events->switches + k * count;
    search.now = events->switches + ROWS * count;
    evaluate(&search, from, search.now);
    take_up(&search, from);
    double after = look_ahead(&search, until, samples), before = search.reached;
    while (isfinite(after) && after - before > blur(after)) {
        const double middle = before + (after - before) / 2;
        *(has_switched(&search, middle) ? &after : &before) = middle;
    }
    *reached = search.reached < until ? search.reached : INFINITY;
    return after;
}

/* The signs between t - reach and t + reach change, once: bisection. */
static double bisect(struct search *search, double t, double reach) {
    double before = t - reach, after = t + reach;
    evaluate(search, before, search->values[ROWS - 1]);
    if (!has_switched(search, after))
        return INFINITY;
    while (after - before > blur(after)) {
        const double middle = before + (after - before) / 2;
        *(has_switched(search, middle) ? &after : &before) = middle;
    }
    return after;
}

double refdyn_time_events_near(struct refdyn_motion *motion, double t) {
    const struct refdyn_step *step = &motion->step;
    const int count = motion->work->model->switch_count;
    struct search search = {.step = step, .count = count};
    double found = INFINITY;
    for (int k = 0; k < ROWS; k++)
        search.values[k] = motion->time_events.switches + k * count;
    search.now = motion->time_events.switches + ROWS * count;
    for (double reach = 16 * blur(t); !isfinite(found) && reach < (t - step->t_begin) / 2; reach *= 4)
        found = bisect(&search, t, reach);
    return found;
}

/* How far the step may reach, with this known time event ahead. */
static double farthest(const struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double known) {
    if (ahead->h > 0)
        return fmin(motion->step.t_begin + ahead->h, known);
    return isfinite(known)             ? known
           : isfinite(motion->t_final) ? fmax(motion->t_final, ahead->t_out)
                                       : ahead->t_out;
}

/* Passes the known events up to t_begin. Is one there? */
static int pass_by(struct refdyn_time_events *events, double t_begin, double least) {
    int is_there = fabs(events->switched - t_begin) <= least;
    for (; events->next < events->count && !(events->times[events->next] > t_begin + least); events->next++)
        is_there |= events->times[events->next] >= t_begin - least;
    return is_there;
}

double refdyn_time_events_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    struct refdyn_time_events *events = &motion->time_events;
    struct refdyn_step *step = &motion->step;
    const int samples = (ahead->h > 0 ? SAMPLES : SAMPLES_AT_START) * motion->state_events.looks;
    if (pass_by(events, step->t_begin, ahead->least))
        refdyn_step_break_off(step, 1);
    const double known = events->next < events->count ? events->times[events->next] : INFINITY;
    double searched;
    const double found =
        find_switch(events, step, ahead->least, farthest(motion, ahead, known), samples, &searched);
    events->switched = isfinite(found) ? found : events->switched;
    const double t = fmin(known, isfinite(found) ? found : searched);
    refdyn_step_limit(step, isfinite(t) ? t - blur(t) : INFINITY);
    ahead->time_event = t;
    return t;
}
