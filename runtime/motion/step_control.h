/* The lengths of steps: proposed from errors, or equal parts of an interval. */
#ifndef REFDYN_STEP_CONTROL_H
#define REFDYN_STEP_CONTROL_H

#include "methods/step.h"
#include "refdyn.h"

struct refdyn_step_control {
    double next;            /* adaptive: proposed step, 0: to be found [s] */
    double cap, cap_growth; /* steps longer than this have failed lately [s], and grow to it by this factor */
    double error_last, last;            /* error norm and length of the last accepted step, 0: none [s] */
    double refused_error, refused;      /* the same of the last attempt at this one, 0: none [s] */
    double from, to;                    /* fixed: output interval in progress [s] */
    long interval_steps, interval_done; /* fixed: steps of that interval */
};

/* Smallest step from t_begin that still moves the time by a few units in its last place, also at t_out. */
double refdyn_control_least(double t_begin, double t_out);
/* Times that are nearer to t than this are the same time. */
double refdyn_time_resolution(double t);

/* Adaptive steps begin, or those of another method: with h, 0: to be found. */
void refdyn_control_begin(struct refdyn_step_control *control, double h);
/* Finds the first step towards t_stop where none is proposed: velocities and accelerations move no coordinate
 * by more than a small part of tol^(1/order). It does not depend on the outputs; where nothing moves it is
 * `interval`. */
void refdyn_control_find(struct refdyn_step_control *control, const struct refdyn_step *step, double t_stop,
                         double interval);
/* After a very short step to a requested time: if the proposed step is shorter than `least`, it is dropped,
 * and the next step is chosen as at a start. */
void refdyn_control_drop(struct refdyn_step_control *control, double least);
/* No step is longer than h. */
void refdyn_control_bound(struct refdyn_step_control *control, double h);
/* The step to try: the proposed one, shortened so that it lands on t_stop or leaves more than half of itself.
 */
double refdyn_control_clip(const struct refdyn_step_control *control, double t_begin, double t_stop);
/* Proposes the next step after one of h with this error, in tolerances: accepted; too large, or INFINITY
 * where the step could not be evaluated. */
void refdyn_control_accepted(struct refdyn_step_control *control,
                             const struct refdyn_method_definition *method, double h, double error);
void refdyn_control_refused(struct refdyn_step_control *control,
                            const struct refdyn_method_definition *method, double h, double error);
/* A step of h failed: no longer one than a part of it is soon tried again. */
void refdyn_control_failed(struct refdyn_step_control *control, double h);

/* Fixed steps of at most h from t_begin to t_out, unless that interval is in progress. Error: STEP_TOO_SMALL.
 */
int refdyn_control_plan(struct refdyn_step_control *control, double h, double t_begin, double t_out);
/* Length of these steps, and the end of the next one. */
double refdyn_control_fixed(const struct refdyn_step_control *control, double *t_new);
/* It was taken. */
void refdyn_control_fixed_done(struct refdyn_step_control *control);
/* The next step begins elsewhere: a new interval. */
void refdyn_control_leave_interval(struct refdyn_step_control *control);

#endif
