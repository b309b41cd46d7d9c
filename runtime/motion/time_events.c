/*
 * Kinks and jumps of formulas of time alone: see time_events.h.
 *
 * Takes the emitted `breaks`, times that parameters and inputs tell, and `switches`, what changes sign at all
 * others; gives the times at which steps end.
 */
#include "base/arithmetic.h"

#include "motion/time_events.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "motion/step_control.h"

/* Times at which switches are looked at in a step, and where the first one is not known yet. */
enum { SAMPLES = 32, SAMPLES_AT_START = 1000 };

void refdyn_events_lay_out(struct refdyn_time_events *events, const struct refdyn_model *model,
                           struct layout *layout) {
    events->count = model->break_count;
    events->times = layout_doubles(layout, model->break_count);
    events->switches = layout_doubles(layout, 2 * model->switch_count);
}

void refdyn_events_find(struct refdyn_time_events *events, const struct refdyn_workspace *work, double t,
                        const double *q, const double *qd) {
    double *times = events->times;
    events->next = 0;
    events->switched = -INFINITY;
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

/* Rounding of a time event and of what is compared with the time there. */
static double blur(double t) {
    return fmax(2 * DBL_EPSILON * fabs(t), DBL_MIN);
}

double refdyn_events_right_of(const struct refdyn_time_events *events, double t) {
    if (events->count == 0 && events->switched == -INFINITY)
        return t;
    const double same = refdyn_time_resolution(t);
    double right = t;
    for (int i = 0; i < events->count; i++)
        if (fabs(events->times[i] - t) <= same)
            right = fmax(right, events->times[i] + blur(t));
    return fabs(events->switched - t) <= same ? fmax(right, events->switched + blur(t)) : right;
}

/* Are there signs at t that differ from those kept in the first half of `switches`? */
static int has_switched(struct refdyn_time_events *events, const struct refdyn_step *step, double t) {
    const struct refdyn_workspace *work = step->evaluation.work;
    const int count = work->model->switch_count;
    double *kept = events->switches, *now = kept + count;
    work->model->switches(work->p, work->x, t, step->state, step->state + step->n, now);
    for (int i = 0; i < count; i++)
        if ((now[i] < 0) != (kept[i] < 0))
            return 1;
    return 0;
}

/* The first time in (t_begin, until] with other signs than those right of t_begin, INFINITY: none is seen. */
static double find_switch(struct refdyn_time_events *events, const struct refdyn_step *step, double least,
                          double until, int samples) {
    const int count = step->evaluation.work->model->switch_count;
    const double from = step->t_begin + 2 * least;
    double before = from, after = INFINITY;
    if (count == 0 || !(until > from))
        return INFINITY;
    has_switched(events, step, from);
    memcpy(events->switches, events->switches + count, (size_t)count * sizeof(double));
    for (int i = 1; i <= samples && !isfinite(after); i++) {
        const double t = from + (until - from) * i / samples;
        if (has_switched(events, step, t))
            after = t;
        else
            before = t;
    }
    while (isfinite(after) && after - before > blur(after)) {
        const double middle = before + (after - before) / 2;
        *(has_switched(events, step, middle) ? &after : &before) = middle;
    }
    return after;
}

/* Where the step may end, with this known time event ahead. */
static double farthest(const struct refdyn_reach *reach, double t_begin, double ahead) {
    if (reach->step > 0)
        return fmin(t_begin + reach->step, ahead);
    return isfinite(ahead)            ? ahead
           : isfinite(reach->t_final) ? fmax(reach->t_final, reach->t_out)
                                      : reach->t_out;
}

/* Goes past the known ones that lie behind; is one at t_begin? */
static int pass_by(struct refdyn_time_events *events, double t_begin, double least) {
    int is_there = fabs(events->switched - t_begin) <= least;
    for (; events->next < events->count && !(events->times[events->next] > t_begin + least); events->next++)
        is_there |= events->times[events->next] >= t_begin - least;
    return is_there;
}

double refdyn_events_ahead(struct refdyn_time_events *events, struct refdyn_step *step,
                           const struct refdyn_reach *reach) {
    const int samples = reach->step > 0 ? SAMPLES : SAMPLES_AT_START;
    if (pass_by(events, step->t_begin, reach->t_least))
        refdyn_step_break_off(step, 1);
    const double known = events->next < events->count ? events->times[events->next] : INFINITY;
    const double until = farthest(reach, step->t_begin, known);
    const double found = find_switch(events, step, reach->t_least, until, samples);
    events->switched = isfinite(found) ? found : events->switched;
    const double ahead = fmin(known, found);
    refdyn_step_limit(step, isfinite(ahead) ? ahead - blur(ahead) : INFINITY);
    return ahead;
}
