/*
 * Passes a state where the rows lose rank (theory, sect. 8.9).
 *
 * There K qdd = k has no unique solution. Off the programme, at a distance e from it and a time s before that
 * state, accelerations are wrong by about e/s^2. On the programme they are smooth along a branch. So one step
 * of rk8 passes that state, which lies in the widest gap between its stages. The stages are first brought
 * onto the programme; the embedded formulas estimate the error as they do elsewhere.
 *
 * In: a motion at the beginning of a step. Out: when the rows lose rank ahead, and the step that passes that
 * state, with its stages on the programme and a check of where it arrived.
 *
 * Measure of rank: the independent rows are vectors, with columns scaled by 1/sqrt(M_jj). Each row has a
 * distance from the span of the rows before it, and one of these distances is 0 where the rows lose rank.
 * Each is divided by its value at a state where the rank is known; the smallest ratio counts. The product of
 * the distances, a volume, would not do: it also falls when many loops approach such a state together, and it
 * hides a single loop among many.
 */
#include "runtime/core/motion/motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"
#include "runtime/core/methods/methods.h"

/* Where in the step the singular state is: in a gap between two stages of rk8, including those of its
 * interpolant; and its distance from them. First the widest gap; then gaps nearer to the end, for steps that
 * have to end early. */
enum { PLACES = 3 };
static const double places[PLACES] = {0.4666, 0.7145, 0.93}, gaps[PLACES] = {0.133, 0.063, 0.07};
/* As a part of the step: nearer to the state, the interpolant has better rates and accelerations than the
 * rows, because of rounding. */
static const double near_part = 0.015;
/* A ratio that falls below this may fall to 0. */
static const double small_part = 0.1;
/* A projection may move a state by at most this part of the way of the motion itself: rates on another branch
 * differ by as much as their own size. */
static const double moved_part = 0.1;
/* Largest error of a step, in tolerances: small, since it adds to all others. */
static const double error_share = 0.1;
/* Error of a state at 1 rad from one where the rows lose rank, by rounding of phi: 512 units in the last
 * place for each independent row, found by trial; in a chain of loops the errors of all rows add up. Nearer,
 * it grows in inverse proportion. The projection after the step removes it, so it adds to no error. */
static const double rounding = 0x1p-43, rounding_most = 0x1p-30;
/* The search for a state that is known to be ahead extends to this multiple of its distance. */
static const double nearer = 8;

/* After a failed attempt the state is tried again from at most this part of the distance. */
static const double again_part = 0.6;
/* The error of a step should be this part of the largest accepted error. */
static const double error_aim = 0.5;
/* Bounds of the ratio of the next step through such a state to this one. */
static const double stretch_least = 0.2, stretch_most = 5;

/* How far ahead the search extends, in adaptive and in fixed steps. */
static const double reach_adaptive = 8, reach_fixed = 4;

/* Golden sections: NARROWINGS to place a step, NARROWINGS_REPORTED for the time in the statistics. */
enum { SAMPLES = 10, FIRST_SAMPLE = 512, NARROWINGS = 12, NARROWINGS_REPORTED = 30 };

/* ---- Rank ---- */

/* The independent rows, in the order of the model, so that rows of neighbouring loops are next to each other.
 */
static void list_rows(struct refdyn_singular_crossing *crossing, const struct refdyn_workspace *work) {
    int *is_independent = work->mark;
    memset(is_independent, 0, (size_t)work->m * sizeof *is_independent);
    for (int a = 0; a < work->partition.rank; a++)
        is_independent[work->partition.row[a]] = 1;
    crossing->count = 0;
    for (int a = 0; a < work->m; a++)
        if (is_independent[a])
            crossing->rows[crossing->count++] = a;
}

/* The first and last of these rows that have an entry above rounding in each column. */
static void find_spans(struct refdyn_singular_crossing *crossing, const struct refdyn_workspace *work) {
    const int n = work->n;
    for (int j = 0; j < n; j++) {
        crossing->first[j] = crossing->count;
        crossing->last[j] = -1;
    }
    for (int a = 0; a < crossing->count; a++) {
        const double *row = work->u + crossing->rows[a] * n;
        const double least = DBL_EPSILON * refdyn_largest(row, n, NULL);
        for (int j = 0; j < n; j++)
            if (fabs(row[j]) > least) {
                crossing->first[j] = a < crossing->first[j] ? a : crossing->first[j];
                crossing->last[j] = a;
            }
    }
}

/* Turns (x, y) so that y[0] becomes 0. */
static void rotate(double *restrict x, double *restrict y, int count) {
    const double length = sqrt(x[0] * x[0] + y[0] * y[0]), c = x[0] / length, s = y[0] / length;
    for (int i = 0; i < count; i++) {
        const double turned = c * x[i] + s * y[i];
        y[i] = c * y[i] - s * x[i];
        x[i] = turned;
    }
}

/* R^T R + x x^T = R'^T R' by rotations; row a of R ends before end[a], x has entries in [from, to). */
static void rotate_in(double *R, int *end, int count, double *x, int from, int to) {
    for (int a = from; a < to; a++) {
        if (x[a] == 0)
            continue;
        to = to > end[a] ? to : end[a];
        end[a] = to;
        rotate(R + a * count + a, x + a, to - a);
    }
}

/* K^T = Q R, column by column of K: |R_aa| is the distance of row a from the span of those before it. Loops
 * in a chain have few entries in R. */
static const double *factor_rows(struct refdyn_singular_crossing *crossing, struct refdyn_workspace *work) {
    const int n = work->n, count = crossing->count;
    int *end = work->mark;
    double *R = work->basis, *x = work->lambda;
    find_spans(crossing, work);
    memset(R, 0, (size_t)count * (size_t)count * sizeof *R);
    memset(end, 0, (size_t)count * sizeof *end);
    for (int j = 0; j < n; j++) {
        memset(x, 0, (size_t)count * sizeof *x);
        for (int a = crossing->first[j]; a <= crossing->last[j]; a++)
            x[a] = work->u[crossing->rows[a] * n + j] * work->weight[j];
        rotate_in(R, end, count, x, crossing->first[j], crossing->last[j] + 1);
    }
    return R;
}

/* ---- When ---- */

/* A path of states: into step->stage, at t_begin + s. */
typedef int path_function(struct refdyn_step *step, double s);

/* The motion continued by the accelerations at the beginning. */
static int continued(struct refdyn_step *step, double s) {
    const int n = step->n;
    for (int j = 0; j < n; j++) {
        const double rate = step->rates[j], acceleration = step->rates[n + j];
        step->stage[j] = step->state[j] + s * (rate + s / 2 * acceleration);
        step->stage[n + j] = rate + s * acceleration;
    }
    return REFDYN_OK;
}

/* Inside the step that was taken. */
static int inside(struct refdyn_step *step, double s) {
    const int status = step->method->kind->interpolate(step, s / (step->t_end - step->t_begin), step->side);
    memcpy(step->stage, step->side, (size_t)(2 * step->n) * sizeof(double));
    return status;
}

/* The factor R at a place of the path; NULL where there is none. */
static const double *factor_at(struct refdyn_motion *motion, path_function *path, double s) {
    struct refdyn_step *step = &motion->step;
    const double t = refdyn_step_inside(step, step->t_begin + s);
    if (path(step, s) || refdyn_row_terms(motion->work, t, step->stage, step->stage + step->n))
        return NULL;
    return factor_rows(&motion->crossing, motion->work);
}

/* The reference of each distance is the largest one at the places that are referred to. */
static void refer_to(struct refdyn_motion *motion, path_function *path, double s) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const double *R = factor_at(motion, path, s);
    for (int a = 0; R && a < crossing->count; a++)
        crossing->distance[a] = fmax(crossing->distance[a], fabs(R[a * crossing->count + a]));
}

static void forget_references(struct refdyn_motion *motion) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    list_rows(crossing, motion->work);
    memset(crossing->distance, 0, (size_t)crossing->count * sizeof *crossing->distance);
}

/* The smallest ratio at a place of the path; INFINITY where there is none. */
static double ratio_at(struct refdyn_motion *motion, path_function *path, double s) {
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    const double *R = factor_at(motion, path, s);
    double least = INFINITY;
    for (int a = 0; R && a < crossing->count; a++)
        least = fmin(least, fabs(R[a * crossing->count + a]) / crossing->distance[a]);
    return least;
}

/* The least ratio between two places, by golden section; *s is where. */
static double find_least(struct refdyn_motion *motion, path_function *path, double from, double to,
                         int narrowings, double *s) {
    const double golden = (sqrt(5) - 1) / 2;
    double left = to - golden * (to - from), right = from + golden * (to - from);
    double at_left = ratio_at(motion, path, left), at_right = ratio_at(motion, path, right);
    for (int i = 0; i < narrowings; i++) {
        if (at_left < at_right) {
            to = right, right = left, at_right = at_left;
            left = to - golden * (to - from);
            at_left = ratio_at(motion, path, left);
        } else {
            from = left, left = right, at_left = at_right;
            right = from + golden * (to - from);
            at_right = ratio_at(motion, path, right);
        }
    }
    *s = at_left < at_right ? left : right;
    return fmin(at_left, at_right);
}

/* Between the ends of the step that was taken. */
static int between(struct refdyn_step *step, double s) {
    refdyn_step_hermite(step, step->rates_new, s / (step->t_end - step->t_begin), step->stage);
    return REFDYN_OK;
}

/* The first of the samples after `from` that is below a half and not above its neighbours; SAMPLES: none. */
static int next_dip(const double *ratios, int from) {
    for (int i = from + 1; i < SAMPLES - 1; i++)
        if (ratios[i] < 0.5 && ratios[i] <= ratios[i + 1] && ratios[i] <= ratios[i - 1])
            return i;
    return SAMPLES;
}

/* The first place between the samples where a ratio may fall to 0; 0: there is none. */
static double find_dip(struct refdyn_motion *motion, path_function *path, const double *at) {
    double ratios[SAMPLES], s;
    for (int i = 0; i < SAMPLES; i++)
        ratios[i] = ratio_at(motion, path, at[i]);
    for (int i = next_dip(ratios, 0); i < SAMPLES; i = next_dip(ratios, i))
        if (find_least(motion, path, at[i - 1], at[i + 1], NARROWINGS, &s) < small_part)
            return s;
    return 0;
}

/* Will the rows lose rank within `reach` from t_begin? Then *t is when, on the motion continued by its
 * accelerations. The row terms in the workspace and the step's stage are lost. */
static int is_ahead(struct refdyn_motion *motion, double reach, double *t) {
    const double known = motion->crossing.t - motion->step.t_begin;
    double at[SAMPLES] = {0};
    if (motion->work->partition.rank <= 0)
        return 0;
    if (known > 0) /* one that was not passed yet */
        reach = fmin(reach, nearer * known);
    for (int i = 1; i < SAMPLES; i++) /* each twice as far away as the one before */
        at[i] = reach / FIRST_SAMPLE * (1 << i);
    forget_references(motion);
    refer_to(motion, continued, 0);
    const double s = find_dip(motion, continued, at);
    if (s > 0)
        *t = motion->step.t_begin + s;
    return s > 0;
}

/* Did the rows lose rank on the ordinary step that was taken? It may be longer than the motion can be
 * continued by its accelerations. If so, crossing->t is when. The workspace holds the row terms of the step's
 * end afterwards. */
static int was_missed(struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const double h = step->t_end - step->t_begin;
    double at[SAMPLES];
    if (motion->work->partition.rank <= 0)
        return 0;
    for (int i = 0; i < SAMPLES; i++)
        at[i] = h * i / (SAMPLES - 2); /* the last one is after the step, so that a dip at its end is seen */
    forget_references(motion);
    refer_to(motion, between, 0);
    refer_to(motion, between, h);
    const double s = find_dip(motion, between, at);
    ratio_at(motion, between, h);
    if (!(s > 0 && s <= h))
        return 0;
    motion->crossing.t = step->t_begin + s;
    return 1;
}

/* Would an attempt be useless? The step through the state at t may be too long, judging by the errors of
 * earlier ones. Or one through the same state has failed from not much further away. */
static int is_vain(const struct refdyn_motion *motion, double t) {
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    const struct refdyn_refused_crossing *refused = &crossing->refused;
    const double before = refused->t - refused->t_begin, distance = t - motion->step.t_begin;
    const int is_same = refused->tries > 0 && fabs(t - refused->t) < before;
    return distance / places[0] > crossing->stretch || (is_same && distance > again_part * before);
}

/* End of the step that passes a state at t, not beyond t_bound; INFINITY: there is none. */
static double end_of_step(struct refdyn_motion *motion, double t, double t_bound) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    crossing->refused.why = REFDYN_NO_ROOM;
    crossing->t = t;
    for (int i = 0; i < PLACES; i++) {
        const double t_new = step->t_begin + (t - step->t_begin) / places[i];
        crossing->gap = gaps[i];
        if (t_new <= t_bound)
            return t_new;
    }
    return INFINITY;
}

static int crossing_is_on(const struct refdyn_motion *motion) {
    return motion->step.guide == &motion->crossing.guide;
}

int refdyn_crossing_is_near(const struct refdyn_motion *motion, double t) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    return crossing_is_on(motion) && t < step->t_end &&
           fabs(t - crossing->t) < near_part * (step->t_end - step->t_begin);
}

/* ---- The step ---- */

/* Stages begin on the programme, also in motions that are not projected otherwise. Error: those of
 * refdyn_rates. */
static int enter(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    struct refdyn_workspace *work = motion->work;
    const int n = work->n;
    const size_t size = 2 * (size_t)n + 1;
    refdyn_special_step_begin(motion, REFDYN_RK8, &crossing->guide);
    crossing->refused.why = REFDYN_NO_STATE;
    memcpy(crossing->unpassed, step->state, size * sizeof(double));
    memcpy(crossing->unpassed + size, step->rates, refdyn_rates_bytes(step));
    int status = refdyn_row_terms(work, step->t_begin, step->state, step->state + n);
    if (status || motion->options.stabilise == REFDYN_PROJECT)
        return status;
    status = refdyn_programme_meet(&motion->programme, step, step->t_begin, step->state);
    return status ? status : refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
}

/* The largest rate where the rows lose rank, on the motion continued by its accelerations. */
static double speed_there(const struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    const double *qd = step->rates, *qdd = step->rates + motion->work->n;
    double most = 0;
    for (int j = 0; j < motion->work->n; j++)
        most = fmax(most, fabs(qd[j] + (crossing->t - step->t_begin) * qdd[j]) / step->units[j]);
    return most;
}

static int follow(void *context, const double *before, const double *state) {
    struct refdyn_motion *motion = context;
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const int n = motion->work->n;
    const double speed = speed_there(motion);
    const double way = speed * (crossing->t - step->t_begin);
    if (refdyn_step_largest_change(step, state, before) <= moved_part * way &&
        refdyn_step_largest_change(step, state + n, before + n) <= moved_part * speed)
        return REFDYN_OK;
    crossing->refused.why = REFDYN_OTHER_BRANCH;
    motion->tried.verdict = REFDYN_TRIED_BRANCH;
    return REFDYN_NO_CONVERGENCE;
}

/* Brings a stage's state (2 n) onto the programme. */
static int bring(void *context, double t, double *state) {
    struct refdyn_motion *motion = context;
    struct refdyn_step *step = &motion->step;
    const int n = step->n, rank = motion->work->partition.rank;
    double *before = step->side;
    memcpy(before, state, (size_t)(2 * n) * sizeof *state);
    int status = refdyn_row_terms(motion->work, t, state, state + n);
    if (!status)
        status = refdyn_programme_meet(&motion->programme, step, t, state);
    if (!status && motion->work->partition.rank != rank)
        status = REFDYN_NO_CONVERGENCE;
    return status ? status : follow(motion, before, state);
}

/* Sets the length of the next step through a singular state. `error`: that of this step, relative to the
 * largest accepted one. */
static void learn_stretch(struct refdyn_motion *motion, double error) {
    const struct refdyn_step *step = &motion->step;
    const double order = step->method->order_error + 1, h = step->t_end - step->t_begin;
    const double factor = pow(error / error_aim, -1 / order);
    const double stretch = h * (factor > stretch_least ? fmin(factor, stretch_most) : stretch_least);
    double *known = &motion->crossing.stretch;
    *known = error <= 1 && isfinite(*known) ? fmax(*known, stretch) : stretch;
}

/* The error of the step; NO_CONVERGENCE if it is too large. */
static int judge(struct refdyn_motion *motion, double *error) {
    const double tol = motion->options.tol, h = motion->step.t_end - motion->step.t_begin;
    const double rounded = motion->work->partition.rank * rounding / (h * speed_there(motion));
    const double most = tol > 0 ? fmax(error_share * tol, fmin(rounded, rounding_most)) : INFINITY;
    *error = refdyn_step_largest_error(&motion->step, h, h);
    motion->tried.verdict = REFDYN_TRIED_ERROR;
    motion->tried.error = tol > 0 ? *error / tol : NAN;
    learn_stretch(motion, *error / most);
    if (*error <= most)
        return REFDYN_OK;
    motion->crossing.refused.why = REFDYN_LARGE_ERROR;
    return REFDYN_NO_CONVERGENCE;
}

/* Locates the state on the step that was taken. The row terms in the workspace are lost. */
static void look_back(struct refdyn_motion *motion) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const struct refdyn_step *step = &motion->step;
    const double predicted = crossing->t - step->t_begin, gap = crossing->gap * (step->t_end - step->t_begin);
    double s;
    find_least(motion, inside, predicted - gap, predicted + gap, NARROWINGS_REPORTED, &s);
    crossing->t = step->t_begin + s;
}

void refdyn_crossing_lay_out(struct refdyn_singular_crossing *crossing, const struct refdyn_model *model,
                             struct layout *layout) {
    crossing->unpassed = layout_doubles(layout, 2 * model->n + 1 + refdyn_rates_size(model));
    crossing->distance = layout_doubles(layout, model->m);
    crossing->rows = layout_ints(layout, model->m);
    crossing->first = layout_ints(layout, model->n);
    crossing->last = layout_ints(layout, model->n);
}

void refdyn_crossing_start(struct refdyn_motion *motion) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    crossing->t = -INFINITY;
    crossing->stretch = INFINITY;
    crossing->refused = (struct refdyn_refused_crossing){.tries = 0};
    crossing->guide = (struct refdyn_stage_guide){bring, follow, motion};
}

/* ---- Record ---- */

static void record(struct refdyn_motion *motion, double error) {
    const struct refdyn_step *step = &motion->step;
    refdyn_statistics_crossing(
        &motion->statistics, (struct refdyn_crossing){motion->crossing.t, step->t_begin, step->t_end, error});
    motion->crossing.refused = (struct refdyn_refused_crossing){.tries = 0};
}

static void refuse(struct refdyn_motion *motion, double t_new) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    struct refdyn_step *step = &motion->step;
    const double *rates = crossing->unpassed + 2 * step->n + 1;
    crossing->refused.tries++;
    crossing->refused.t = crossing->t;
    crossing->refused.t_begin = step->t_begin;
    crossing->refused.stretch = t_new - step->t_begin;
    if (!crossing_is_on(motion))
        return;
    refdyn_step_place(step, step->t_from, step->t_begin, crossing->unpassed);
    memcpy(step->rates, rates, refdyn_rates_bytes(step));
    refdyn_special_step_end(motion);
}

/* ---- Its entry in the list of obstacles ---- */

double refdyn_crossing_find(struct refdyn_motion *motion, struct refdyn_ahead *ahead) {
    const double steps = motion->options.tol > 0 ? reach_adaptive : reach_fixed;
    double t = INFINITY;
    const int is_found = motion->options.singular == REFDYN_PASS && is_ahead(motion, steps * ahead->h, &t);
    return is_found ? t : INFINITY;
}

/* The step has no shorter one that could end at an obstacle seen in it. */
static int meets_none(struct refdyn_motion *motion, const struct refdyn_ahead *ahead) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_ahead none = {.t_out = step->t_end,
                                      .least = refdyn_control_least(step->t_begin, step->t_end)};
    double t;
    const int status = ahead->seen(motion, &none, &t);
    return status ? status : isfinite(t) ? REFDYN_NO_CONVERGENCE : REFDYN_OK;
}

/* One attempt, from t_begin to t_new. */
static int attempt(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double t_new) {
    const double h = t_new - motion->step.t_begin;
    double error;
    int status = enter(motion);
    if (!status)
        status = refdyn_motion_try(motion, t_new, h);
    if (!status)
        status = judge(motion, &error);
    if (status)
        return status;
    look_back(motion);
    status = refdyn_motion_complete(motion);
    if (!status)
        status = meets_none(motion, ahead);
    if (!status) {
        refdyn_tried_meets(motion, REFDYN_OBSTACLE_SINGULAR, -1);
        status = refdyn_motion_accept(motion, h);
    }
    if (!status)
        record(motion, error);
    return status;
}

int refdyn_crossing_step(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    const struct refdyn_options *options = &motion->options;
    const int rank = motion->work->partition.rank;
    if (is_vain(motion, *t))
        return 0;
    const double t_new = end_of_step(motion, *t, fmin(ahead->bound, ahead->time_event));
    if (options->tol > 0 && options->step_max > 0 && isfinite(t_new) &&
        t_new - motion->step.t_begin > options->step_max)
        return 0;
    refdyn_tried_begin(motion, REFDYN_STEP_CROSSING, REFDYN_RK8, t_new - motion->step.t_begin);
    if (!isfinite(t_new))
        motion->tried.verdict = REFDYN_TRIED_NO_ROOM;
    const int status = isfinite(t_new) ? attempt(motion, ahead, t_new) : REFDYN_NO_CONVERGENCE;
    if (!status)
        return 1;
    refdyn_motion_failed(motion, status, motion->failure.t);
    refdyn_motion_refuse(motion, status);
    refuse(motion, t_new);
    refdyn_partition_bound_rank(motion->work, rank);
    return 0;
}

/* Where the rank has grown, the step began in such a state. */
int refdyn_crossing_seen(struct refdyn_motion *motion, const struct refdyn_ahead *ahead, double *t) {
    *t = INFINITY;
    if (motion->options.singular != REFDYN_PASS || motion->options.tol == 0 || crossing_is_on(motion) ||
        motion->work->partition.rank > ahead->rank || !was_missed(motion))
        return REFDYN_OK;
    refdyn_motion_failed(motion, REFDYN_NO_CONVERGENCE, motion->crossing.t);
    return REFDYN_NO_CONVERGENCE;
}

const char *refdyn_refusal_text(enum refdyn_refusal refusal) {
    static const char *const texts[] = {
        [REFDYN_NOT_REFUSED] = "not refused",
        [REFDYN_NO_ROOM] =
            "the step would have to end before, at a time event, a change of inputs or the end of the motion",
        [REFDYN_NO_STATE] = "no state on the programme was found",
        [REFDYN_OTHER_BRANCH] = "the state found may lie on another branch",
        [REFDYN_LARGE_ERROR] = "its error is larger than a tenth of the tolerance",
    };
    return (unsigned)refusal <= REFDYN_LARGE_ERROR ? texts[refusal] : "unknown refusal";
}
