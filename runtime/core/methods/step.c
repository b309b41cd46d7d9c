/*
 * Operations on a step that are common to all methods.
 *
 * In: a step and the states at its ends. Out: the start of the next one, sizes of changes and errors, and the
 * cubic between the ends.
 */
#include "runtime/core/methods/methods.h"

#include <math.h>
#include <string.h>

/* Rates beyond a kink continue by their change over this part of the distance before it: small, so that the
 * states are before all other kinks, and a power of two. */
static const double inward = 0x1p-10;

void refdyn_step_lay_out(struct refdyn_step *step, const struct refdyn_model *model, int memory_size,
                         struct layout *layout) {
    const int size = 2 * model->n + 1, rates = refdyn_rates_size(model);
    step->n = model->n;
    step->joints = refdyn_joint_count(model);
    step->state = layout_doubles(layout, size);
    step->rates = layout_doubles(layout, rates);
    step->state_new = layout_doubles(layout, size);
    step->rates_new = layout_doubles(layout, rates);
    step->stage = layout_doubles(layout, size);
    step->side = layout_doubles(layout, rates);
    step->error = layout_doubles(layout, 2 * model->n);
    step->units = layout_doubles(layout, model->n);
    step->memory = layout_doubles(layout, memory_size);
}

void refdyn_step_break_off(struct refdyn_step *step, int is_new) {
    step->is_first = 1;
    if (step->method->kind->begin)
        step->method->kind->begin(step, is_new);
}

void refdyn_step_guide(struct refdyn_step *step, const struct refdyn_stage_guide *guide) {
    step->guide = guide;
    step->evaluation.by_partition = guide != NULL;
}

/* With the state y_k at the kink and d = y_k - y, f(y_k) - (f(y_k + inward d) - f(y_k)) / inward. */
static int continue_rates(const struct refdyn_step *step, double t, const double *state, double *rates) {
    const struct refdyn_side_guard *guard = step->guard;
    const int n = step->n, size = refdyn_rates_size(step->evaluation.work->model);
    for (int i = 0; i <= 2 * n; i++)
        guard->inner[i] = guard->state[i] + inward * (guard->state[i] - state[i]);
    int status = refdyn_rates(&step->evaluation, t, guard->inner, guard->rates);
    if (!status)
        status = refdyn_rates(&step->evaluation, t, guard->state, rates);
    for (int i = n; i < size; i++)
        rates[i] -= (guard->rates[i] - rates[i]) / inward;
    memcpy(rates, state + n, (size_t)n * sizeof *rates);
    return status;
}

int refdyn_step_rates(const struct refdyn_step *step, double t, const double *state, double *rates) {
    const struct refdyn_side_guard *guard = step->guard;
    if (!guard)
        return refdyn_rates(&step->evaluation, t, state, rates);
    memcpy(guard->state, state, refdyn_state_bytes(step));
    return guard->hold(guard->context, t, guard->state) ? continue_rates(step, t, state, rates)
                                                        : refdyn_rates(&step->evaluation, t, state, rates);
}

void refdyn_step_place(struct refdyn_step *step, double t_from, double t_begin, const double *state) {
    step->t_from = t_from;
    step->t_begin = step->t_end = t_begin;
    step->t_complete = NAN;
    memcpy(step->state, state, refdyn_state_bytes(step));
    memcpy(step->state_new, state, refdyn_state_bytes(step));
}

void refdyn_step_next(struct refdyn_step *step, double t_begin) {
    const double h = t_begin - step->t_end;
    memcpy(step->state, step->state_new, refdyn_state_bytes(step));
    for (int i = 0; i <= 2 * step->n && h > 0; i++)
        step->state[i] += h * step->rates_new[i];
    memcpy(step->rates, step->rates_new, refdyn_rates_bytes(step));
    step->t_from = step->t_end;
    step->t_begin = step->t_end = t_begin;
    step->t_complete = NAN;
}

void refdyn_step_give_up(struct refdyn_step *step) {
    memcpy(step->state_new, step->state, refdyn_state_bytes(step));
    memcpy(step->rates_new, step->rates, refdyn_rates_bytes(step));
    step->t_end = step->t_begin;
    step->t_complete = NAN;
}

void refdyn_step_end(struct refdyn_step *step, double t_end) {
    step->t_end = t_end;
}

void refdyn_step_take_up(struct refdyn_step *step, double t_new) {
    refdyn_step_end(step, t_new);
    step->failed_t = step->t_begin;
    step->t_complete = NAN;
    step->is_looked_into = step->is_met = 0;
    step->has_rates_new = step->method->is_last_new;
}

void refdyn_step_complete(struct refdyn_step *step, double t) {
    step->t_complete = t;
    step->row_evaluations = step->evaluation.work->row_evaluations;
}

int refdyn_step_take(struct refdyn_step *step, double t_new, double h) {
    refdyn_step_take_up(step, t_new);
    return step->method->kind->take(step, h);
}

void refdyn_step_limit(struct refdyn_step *step, double t) {
    step->t_limit = t;
}

double refdyn_step_inside(const struct refdyn_step *step, double t) {
    return t < step->t_limit ? t : step->t_limit;
}

int refdyn_step_is_inside(const struct refdyn_step *step, double t) {
    return t < step->t_end && step->t_begin < step->t_end;
}

double refdyn_step_seen_end(const struct refdyn_step *step) {
    return step->t_end > step->t_begin ? step->t_end : step->t_from;
}

double refdyn_step_theta(const struct refdyn_step *step, double t) {
    return (t - step->t_begin) / (step->t_end - step->t_begin);
}

static double largest_change(const struct refdyn_step *step, int count, const double *x, const double *y) {
    double largest = 0;
    for (int j = 0; j < count; j++) {
        const double size = fabs(y ? x[j] - y[j] : x[j]) / step->units[j];
        if (!(size <= largest))
            largest = size;
        if (isnan(size))
            break;
    }
    return largest;
}

double refdyn_step_largest_change(const struct refdyn_step *step, const double *x, const double *y) {
    return largest_change(step, step->n, x, y);
}

double refdyn_step_largest_move(const struct refdyn_step *step, const double *x, const double *y) {
    return largest_change(step, step->joints, x, y);
}

double refdyn_step_largest_error(const struct refdyn_step *step, double h, double span) {
    const int n = step->n;
    double largest = 0;
    for (int j = 0; j < n; j++) {
        const double position = fabs(step->error[j]), velocity = h * fabs(step->error[n + j]);
        if (isnan(position + velocity))
            return NAN;
        const double size = (position > velocity ? position : velocity) / step->units[j],
                     own = j < step->joints ? size : size / span;
        largest = own > largest ? own : largest;
    }
    return largest;
}

/* y_0 (1 + 2 theta) (1 - theta)^2 + h f_0 theta (1 - theta)^2 and the same from the end. */
void refdyn_step_hermite(const struct refdyn_step *step, const double *rates_end, double theta,
                         double *state) {
    const double left = (1 - theta) * (1 - theta), right = theta * theta, h = step->t_end - step->t_begin;
    for (int i = 0; i < 2 * step->n; i++)
        state[i] = left * ((1 + 2 * theta) * step->state[i] + theta * h * step->rates[i]) +
                   right * ((3 - 2 * theta) * step->state_new[i] - (1 - theta) * h * rates_end[i]);
}
