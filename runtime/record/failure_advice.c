/*
 * Advice after a failed motion: probable causes, and what to do.
 *
 * In: an integrator at its last accepted state, and the start. Out: lines on a stream. Small changes of each
 * coordinate and rate show whether accelerations jump there, because friction that is smooth within a very
 * small width acts like a jump.
 */
#include "runtime/record/record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Each coordinate and rate changes by this part of the larger of its unit and value. */
static const double difference = 1e-9;
/* A jump exceeds jump_least of the acceleration; at twice the distance it differs by at most jump_changes of
 * itself. */
static const double jump_least = 1e-6, jump_changes = 0.25;
/* A row whose slope has fallen to this part of its initial value hardly determines the motion. */
static const double slope_least = 1e-3;

/* ---- Jumps of accelerations ---- */

/* Computes qdd (n) with value j of state (2 n) changed by h. */
static bool accelerate_at(const struct refdyn_integrator *integrator, double *state, int j, double h,
                          double *qdd) {
    const double before = state[j];
    state[j] += h;
    const int status = refdyn_accelerate(integrator->work, integrator->t_right, state,
                                         state + integrator->work->n, integrator->options.stabilise, qdd);
    state[j] = before;
    return status == REFDYN_OK;
}

/* Do accelerations jump where value j passes its present one? rooms (6 n): the state, and scratch. */
static bool jumps_at(const struct refdyn_integrator *integrator, int j, double *rooms) {
    const int n = integrator->work->n;
    const double h = difference * fmax(1, fabs(rooms[j]));
    double *above = rooms + 2 * n, *below = above + n, *far_above = below + n, *far_below = far_above + n;
    if (!accelerate_at(integrator, rooms, j, h, above) || !accelerate_at(integrator, rooms, j, -h, below) ||
        !accelerate_at(integrator, rooms, j, 2 * h, far_above) ||
        !accelerate_at(integrator, rooms, j, -2 * h, far_below))
        return false;
    for (int i = 0; i < n; i++) {
        const double jump = fabs(above[i] - below[i]);
        const double change = fabs(far_above[i] - above[i]) + fabs(far_below[i] - below[i]);
        if (jump > jump_least * fmax(fabs(above[i]), fabs(below[i])) && change <= jump_changes * jump)
            return true;
    }
    return false;
}

/* Do accelerations jump as a position, or a rate, passes its present value? */
static bool jump_by(const struct refdyn_integrator *integrator, bool is_rate) {
    const int n = integrator->work->n;
    double *rooms = malloc(6 * (size_t)n * sizeof *rooms);
    bool jump = false;
    if (!rooms)
        return false;
    memcpy(rooms, integrator->q, 2 * (size_t)n * sizeof *rooms); /* q and qd are contiguous */
    for (int j = 0; j < n && !jump; j++)
        jump = jumps_at(integrator, is_rate ? n + j : j, rooms);
    free(rooms);
    return jump;
}

static void print_jumps(const struct refdyn_integrator *integrator, int status, FILE *out) {
    const bool is_of_rates = jump_by(integrator, true);
    if (is_of_rates)
        fputs("refdyn: a force jumps, or reaches a limit, as a rate passes a value; give friction a "
              "width of 1e-10 or more, as in rd.friction(level, rate, width)\n",
              out);
    if (status == REFDYN_SLIDES && !is_of_rates)
        fputs("refdyn: a force or a row jumps as a position passes a value, within the tolerance; let it "
              "change over a distance, as k * x or rd.tanh(x / width) does\n",
              out);
    if (status == REFDYN_SLIDES)
        fputs("refdyn: a relay needs two levels: write two events that set an input\n", out);
}

/* ---- Rows that lose their slope ---- */

/* The norms (m) of the rows at a state, with columns scaled by 1/sqrt(M_jj). */
static bool find_slopes(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                        double *slopes) {
    if (refdyn_equations(work, t, q, qd) != REFDYN_OK)
        return false;
    for (int a = 0; a < work->m; a++) {
        double square = 0;
        for (int j = 0; j < work->n; j++)
            square += work->u[a * work->n + j] * work->u[a * work->n + j] / work->M[j * work->n + j];
        slopes[a] = sqrt(square);
    }
    return true;
}

static void print_slopes(const struct record_motion *motion, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    struct refdyn_workspace *work = integrator->work;
    double *start = malloc(2 * (size_t)work->m * sizeof *start);
    if (!start)
        return;
    double *now = start + work->m;
    if (find_slopes(work, motion->from, motion->q, motion->qd, start) &&
        find_slopes(work, integrator->t, integrator->q, integrator->qd, now))
        for (int a = 0; a < refdyn_programme_rows(work->model); a++)
            if (now[a] < slope_least * start[a])
                fprintf(
                    out,
                    "refdyn: the slope of constraint %s has fallen to %.3g of its initial value: near here "
                    "the row depends on others or on no coordinate; end the motion earlier, or change the "
                    "programme\n",
                    work->model->rows[a].name, now[a] / start[a]);
    free(start);
}

/* ---- Shorter steps ---- */

static void print_shorter_steps(const struct refdyn_integrator *integrator, FILE *out) {
    const double taken = integrator->statistics.step_largest;
    if (integrator->options.tol > 0)
        fputs("refdyn: a smaller --tol may help\n", out);
    else
        fprintf(out,
                "refdyn: equal steps of %.3g s may be too long: use a smaller --step, or --tol for adaptive "
                "steps of any method but rk4\n",
                taken > 0 ? taken : integrator->options.step);
}

/* Off the programme, rows that depend on each other on it contradict each other. */
static void print_drift(const struct refdyn_integrator *integrator, FILE *out) {
    const struct refdyn_statistics *s = &integrator->statistics;
    const struct refdyn_workspace *work = integrator->work;
    if (integrator->options.stabilise != REFDYN_PROJECT &&
        work->partition.rank < refdyn_programme_rows(work->model) && s->phi_row >= 0 && s->phi_max > 0)
        fprintf(out,
                "refdyn: the rows have drifted off the programme (%s: phi up to %.3g), where redundant rows "
                "contradict each other; use --stabilise project, or give the rows gains (alpha, beta)\n",
                work->model->rows[s->phi_row].name, s->phi_max);
}

/* ---- All advice ---- */

void record_print_advice(const struct record_motion *motion, int status, const char *unfit, FILE *out) {
    const struct refdyn_integrator *integrator = motion->integrator;
    if (status == REFDYN_SLIDES || (status == REFDYN_STEP_TOO_SMALL && integrator->work->model->saturates))
        print_jumps(integrator, status, out);
    if (status == REFDYN_STEP_TOO_SMALL && integrator->work->m > 0)
        print_slopes(motion, out);
    if (!unfit)
        print_drift(integrator, out);
    if (status == REFDYN_EVENTS_ACCUMULATE)
        fputs("refdyn: impacts of rd.event never come to rest; use rd.contact\n", out);
    if (status > REFDYN_OK && !unfit)
        print_shorter_steps(integrator, out);
}
