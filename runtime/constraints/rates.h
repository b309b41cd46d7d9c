/*
 * Rates of change of a motion's state.
 *
 * A state is q, qd and the work done, 2 n + 1 values; its rates are qd, qdd and power, and behind them the
 * multipliers lambda (m), at which tangents are taken.
 */
#ifndef REFDYN_RATES_H
#define REFDYN_RATES_H

#include "refdyn.h"

/* How the accelerations of a motion are evaluated. */
struct refdyn_evaluation {
    struct refdyn_workspace *work;
    enum refdyn_stabilise stabilise;
    int balance;        /* power is needed, too */
    int by_partition;   /* by the index partition, whatever was emitted */
    int has_no_inverse; /* M is singular, and what was emitted divides by zero: by the index partition */
};

static inline int refdyn_rates_size(const struct refdyn_model *model) {
    return 2 * model->n + 1 + model->m;
}

/* The rates of a state (2 n + 1) at t. Errors: those of refdyn_accelerate. */
int refdyn_rates(const struct refdyn_evaluation *evaluation, double t, const double *state, double *rates);

#endif
