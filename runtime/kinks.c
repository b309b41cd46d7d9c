/*
 * Kinks and jumps of formulas of time alone: see kinks.h.
 *
 * Takes the emitted `breaks`, times that parameters and inputs tell, and `switches`, what changes sign at all
 * others; gives the times at which steps end.
 */
#include "base/arithmetic.h"

#include "private/kinks.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "private/advance.h"

/* Times at which switches are looked at in a step, and where the first one is not known yet. */
enum { SAMPLES = 32, SAMPLES_AT_START = 1000 };

double refdyn_time_resolution(double t) {
    return 4 * DBL_EPSILON * fabs(t);
}

void refdyn_find_breaks(struct refdyn_drive *drive) {
    const struct refdyn_workspace *work = drive->work;
    drive->break_next = 0;
    drive->switched = -INFINITY;
    drive->t_limit = INFINITY;
    if (!work->model->breaks)
        return;
    work->model->breaks(work->p, work->x, drive->t, drive->q, drive->qd, drive->breaks);
    for (int i = 1; i < work->model->break_count; i++) {
        const double moved = drive->breaks[i];
        int place = i;
        for (; place > 0 && drive->breaks[place - 1] > moved; place--)
            drive->breaks[place] = drive->breaks[place - 1];
        drive->breaks[place] = moved;
    }
}

/* Rounding of a break and of what is compared with the time there. */
static double blur(double t) {
    return fmax(2 * DBL_EPSILON * fabs(t), DBL_MIN);
}

double refdyn_right_of(const struct refdyn_drive *drive, double t) {
    const double same = refdyn_time_resolution(t);
    double right = t;
    for (int i = 0; i < drive->work->model->break_count; i++)
        if (fabs(drive->breaks[i] - t) <= same)
            right = fmax(right, drive->breaks[i] + blur(t));
    return fabs(drive->switched - t) <= same ? fmax(right, drive->switched + blur(t)) : right;
}

/* Are there signs at t that differ from those kept in the first half of drive->switches? */
static int has_switched(struct refdyn_drive *drive, double t) {
    const struct refdyn_workspace *work = drive->work;
    const int count = work->model->switch_count;
    double *kept = drive->switches, *now = kept + count;
    work->model->switches(work->p, work->x, t, drive->state, drive->state + work->n, now);
    for (int i = 0; i < count; i++)
        if ((now[i] < 0) != (kept[i] < 0))
            return 1;
    return 0;
}

/* The first time in (t_begin, until] with other signs than those right of t_begin, INFINITY: none is seen. */
static double find_switch(struct refdyn_drive *drive, double least, double until, int samples) {
    const int count = drive->work->model->switch_count;
    const double from = drive->t_begin + 2 * least;
    double before = from, after = INFINITY;
    if (count == 0 || !(until > from))
        return INFINITY;
    has_switched(drive, from);
    memcpy(drive->switches, drive->switches + count, (size_t)count * sizeof(double));
    for (int i = 1; i <= samples && !isfinite(after); i++) {
        const double t = from + (until - from) * i / samples;
        if (has_switched(drive, t))
            after = t;
        else
            before = t;
    }
    while (isfinite(after) && after - before > blur(after)) {
        const double middle = before + (after - before) / 2;
        *(has_switched(drive, middle) ? &after : &before) = middle;
    }
    return after;
}

/* Where a step of `step` (0: not known yet) may end, of a motion that is asked for until t_out. */
static double farthest(const struct refdyn_drive *drive, double step, double t_out, double ahead) {
    if (step > 0)
        return fmin(drive->t_begin + step, ahead);
    return isfinite(ahead) ? ahead : isfinite(drive->t_final) ? fmax(drive->t_final, t_out) : t_out;
}

double refdyn_break_ahead(struct refdyn_drive *drive, double step, double t_out) {
    const int count = drive->work->model->break_count;
    const double least = refdyn_step_least(drive, t_out);
    int is_passed = fabs(drive->switched - drive->t_begin) <= least;
    for (; drive->break_next < count && !(drive->breaks[drive->break_next] > drive->t_begin + least);
         drive->break_next++)
        is_passed |= drive->breaks[drive->break_next] >= drive->t_begin - least;
    if (is_passed) { /* nothing is continued across it */
        drive->tried_t = INFINITY;
        drive->last_h = drive->rate = 0;
    }
    const double known = drive->break_next < count ? drive->breaks[drive->break_next] : INFINITY;
    const double found =
        find_switch(drive, least, farthest(drive, step, t_out, known), step > 0 ? SAMPLES : SAMPLES_AT_START);
    drive->switched = isfinite(found) ? found : drive->switched;
    const double ahead = fmin(known, found);
    drive->t_limit = isfinite(ahead) ? ahead - blur(ahead) : INFINITY;
    return ahead;
}
