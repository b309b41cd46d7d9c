/* clang-format off */
/*
 * Time events: times at which formulas of time alone have kinks or jumps. Every step ends at the next one, sees its left side,
 * and the motion goes on from its right side, each by so much that no rounding of a comparison can matter.
 *
 * Times of piecewise linear formulas are known. Others are searched for as far as a step may reach: first a change of sign
 * between 32 samples, or more if the frequency of the functions requires it (model.pace), then bisection. A sign that changes and
 * changes back between two samples is found where a parabola through three samples shows it. No step reaches beyond what was searched.
 */
/* clang-format on */
#ifndef REFDYN_TIME_EVENTS_H
#define REFDYN_TIME_EVENTS_H

#include "base/layout.h"
#include "methods/step.h"
#include "refdyn.h"

struct refdyn_time_events {
    int count;        /* of known ones, */
    double *times;    /* (count) ascending [s] */
    int next;         /* the first of them that lies ahead */
    double *switches; /* (4 switch_count) values that change sign at others, at times after a step's begin */
    double switched;  /* the last of these that was found [s] */
};

/* How far a step may reach that looks for time events. */
struct refdyn_reach {
    double step;    /* its length, 0: not known yet [s] */
    double t_out;   /* what is asked for, */
    double t_final; /* end of the motion; INFINITY: not known [s] */
    double t_least; /* steps are no shorter [s] */
};

void refdyn_events_lay_out(struct refdyn_time_events *events, const struct refdyn_model *model,
                           struct layout *layout);
/* The known ones for the present parameters and inputs; none is passed yet. t, q and qd: any. */
void refdyn_events_find(struct refdyn_time_events *events, const struct refdyn_workspace *work, double t,
                        const double *q, const double *qd);
/* t, or behind a time event that is there: where functions have the values with which the motion goes on. */
double refdyn_events_right_of(const struct refdyn_time_events *events, double t);
/* The next one behind the begin of the step, INFINITY: none as far as it or, where their times are known, the
 * motion reaches; the step evaluates nothing behind it, and continues nothing across one at its begin. */
double refdyn_events_ahead(struct refdyn_time_events *events, struct refdyn_step *step,
                           const struct refdyn_reach *reach);

#endif
