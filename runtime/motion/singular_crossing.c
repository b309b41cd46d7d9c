/*
 * Through a state where the rows lose rank: see singular_crossing.h.
 *
 * Takes a motion at the begin of a step; tells when the rows lose rank ahead, keeps the stages of the step
 * that leads through on the programme, and judges where it arrived. Measure of rank: with the independent
 * rows as vectors, columns scaled by 1/sqrt(M_jj), the volume that they span; it is 0 where they lose rank,
 * in whichever way, and does not depend on the partition. Redundant rows are none of these vectors.
 */
#include "base/arithmetic.h"

#include "motion/singular_crossing.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "constraints/constraints.h"
#include "linear/dense.h"
#include "methods/runge_kutta.h"
#include "motion/statistics.h"

/* Where in the step the state lies, between two stages of rk8, those for its interpolant included, and how
 * far from them: in the widest gap, or nearer to the end where the step has to end early. */
enum { PLACES = 3 };
static const double places[PLACES] = {0.4666, 0.7145, 0.93}, gaps[PLACES] = {0.133, 0.063, 0.07};
/* As a part of the step: nearer than that, rows and rounding say less about rates and accelerations than the
 * interpolant. */
static const double near_part = 0.015;
/* A volume that falls to less than this part of that at the begin may fall to 0. */
static const double small_part = 0.1;
/* A projection may move a state by this part of what the motion itself moves it, no more: rates on another
 * branch differ by as much as they are large. */
static const double moved_part = 0.1;
/* Error of a step, in tolerances: a tenth, since it comes on top of all others. */
static const double error_share = 0.1;
/* What rounding of phi makes of a state at 1 rad from one where the rows lose rank, 1024 units in the last
 * place, found by trial; nearer it is in proportion larger. The projection behind takes it away again, so it
 * adds to no error. */
static const double rounding = 0x1p-42, rounding_most = 0x1p-30;
/* A state that is known to lie ahead is looked for again up to so many times its distance. */
static const double nearer = 8;

/* And tried again from this part of the distance on. */
static const double again_part = 0.6;

enum { SAMPLES = 10, FIRST_SAMPLE = 512, NARROWINGS = 30 };

/* ---- Rank ---- */

/* The columns between which a row has entries that are more than rounding. */
struct span {
    int begin, end;
};

static struct span span_of(const double *row, int n) {
    const double least = DBL_EPSILON * refdyn_largest(row, n, NULL);
    struct span span = {0, n};
    while (span.end > 0 && fabs(row[span.end - 1]) <= least)
        span.end--;
    while (span.begin < span.end && fabs(row[span.begin]) <= least)
        span.begin++;
    return span;
}

/* Independent row a, from the row terms in the workspace, with weighted columns. */
static double *gather(struct refdyn_workspace *work, int a) {
    const int n = work->n;
    const double *from = work->u + work->partition.row[a] * n;
    double *row = work->basis + a * n;
    for (int j = 0; j < n; j++)
        row[j] = from[j] * work->weight[j];
    return row;
}

/* row -= what it has along those before; rows that share no column are orthogonal, as those of loops far
 * apart. */
static void leave_own(struct refdyn_workspace *work, int a, double *row) {
    const int n = work->n;
    int *begins = work->mark, *ends = work->mark + work->partition.rank; /* twice the rank: n + m at most */
    struct span span = span_of(row, n);
    for (int k = 0; k < a; k++) {
        const int begin = begins[k] > span.begin ? begins[k] : span.begin;
        const int end = ends[k] < span.end ? ends[k] : span.end;
        const double *unit = work->basis + k * n;
        if (begin >= end)
            continue;
        dense_add(row + begins[k], -dense_dot(unit + begin, row + begin, end - begin), unit + begins[k],
                  ends[k] - begins[k]);
        span.begin = begins[k] < span.begin ? begins[k] : span.begin;
        span.end = ends[k] > span.end ? ends[k] : span.end;
    }
    begins[a] = span.begin;
    ends[a] = span.end;
}

/* What they span: by Gram and Schmidt. */
static double find_volume(struct refdyn_workspace *work) {
    const int n = work->n;
    double volume = 1;
    for (int a = 0; a < work->partition.rank && volume > 0; a++) {
        double *row = gather(work, a);
        leave_own(work, a, row);
        const double length = sqrt(dense_dot(row, row, n));
        volume *= length;
        for (int j = 0; j < n && length > 0; j++)
            row[j] /= length;
    }
    return volume;
}

/* ---- When ---- */

/* A path of states: into step->stage, at t_begin + s. */
typedef int path_function(struct refdyn_step *step, double s);

/* The motion continued by the accelerations at the begin. */
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

/* Volume at a place of the path; INFINITY where it cannot be told. */
static double volume_at(struct refdyn_step *step, path_function *path, double s) {
    const double t = refdyn_step_inside(step, step->t_begin + s);
    if (path(step, s) || refdyn_row_terms(step->evaluation.work, t, step->stage, step->stage + step->n))
        return INFINITY;
    const double volume = find_volume(step->evaluation.work);
    return isfinite(volume) ? volume : INFINITY;
}

/* The least volume between two places, by golden section; *s is where. */
static double find_least(struct refdyn_step *step, path_function *path, double from, double to, double *s) {
    const double golden = (sqrt(5) - 1) / 2;
    double left = to - golden * (to - from), right = from + golden * (to - from);
    double at_left = volume_at(step, path, left), at_right = volume_at(step, path, right);
    for (int i = 0; i < NARROWINGS; i++) {
        if (at_left < at_right) {
            to = right, right = left, at_right = at_left;
            left = to - golden * (to - from);
            at_left = volume_at(step, path, left);
        } else {
            from = left, left = right, at_left = at_right;
            right = from + golden * (to - from);
            at_right = volume_at(step, path, right);
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

/* The first of the samples that is smaller than half of `begin` and than both its neighbours, and behind
 * `from`; SAMPLES: none. */
static int next_dip(const double *volumes, double begin, int from) {
    int i = from;
    while (i < SAMPLES - 1 && !(volumes[i] < begin / 2 && volumes[i] <= volumes[i + 1] &&
                                volumes[i] <= (i > 0 ? volumes[i - 1] : begin)))
        i++;
    return i < SAMPLES - 1 ? i : SAMPLES;
}

/* The first place between the samples where the volume may fall to 0; 0: there is none. */
static double find_dip(struct refdyn_step *step, path_function *path, const double *at, double begin) {
    double volumes[SAMPLES], s;
    for (int i = 0; i < SAMPLES; i++)
        volumes[i] = volume_at(step, path, at[i]);
    for (int i = next_dip(volumes, begin, 0); i < SAMPLES; i = next_dip(volumes, begin, i + 1))
        if (find_least(step, path, i > 0 ? at[i - 1] : 0, at[i + 1], &s) < small_part * begin)
            return s;
    return 0;
}

int refdyn_crossing_is_ahead(struct refdyn_motion *motion, double reach, double *t) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const double known = crossing->t - step->t_begin;
    double at[SAMPLES];
    if (motion->work->partition.rank <= 0)
        return 0;
    if (known > 0) /* one that was not passed yet: as near as it may be */
        reach = fmin(reach, nearer * known);
    for (int i = 0; i < SAMPLES; i++) /* each twice as far away as the one before */
        at[i] = reach / FIRST_SAMPLE * (1 << i);
    const double s = find_dip(step, continued, at, volume_at(step, continued, 0));
    if (s > 0)
        *t = step->t_begin + s;
    return s > 0;
}

int refdyn_crossing_was_missed(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const double h = step->t_end - step->t_begin;
    double at[SAMPLES];
    if (motion->work->partition.rank <= 0)
        return 0;
    for (int i = 0; i < SAMPLES; i++)
        at[i] = h * (i + 1) / (SAMPLES - 1); /* the last one behind the step, lest a dip at its end be none */
    const double ends = fmax(volume_at(step, between, 0), volume_at(step, between, h));
    const double s = find_dip(step, between, at, ends);
    volume_at(step, between, h);
    if (!(s > 0 && s <= h))
        return 0;
    crossing->t = step->t_begin + s;
    return 1;
}

int refdyn_crossing_is_vain(const struct refdyn_motion *motion, double t) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    const struct refdyn_refused_crossing *refused = &crossing->refused;
    const double before = refused->t - refused->t_begin;
    return refused->tries > 0 && fabs(t - refused->t) < before && t - step->t_begin > again_part * before;
}

double refdyn_crossing_end(struct refdyn_motion *motion, double t, double t_bound) {
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

int refdyn_crossing_is_near(const struct refdyn_motion *motion, double t) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    return crossing->is_on && t < step->t_end &&
           fabs(t - crossing->t) < near_part * (step->t_end - step->t_begin);
}

/* ---- The step ---- */

/* Steps by this method from now on, whose stages the guide brings onto the programme; what the one before
 * kept is gone. */
static void follow_with(struct refdyn_motion *motion, enum refdyn_method method,
                        const struct refdyn_stage_guide *guide) {
    struct refdyn_step *step = &motion->step;
    refdyn_method_use(method, step);
    refdyn_step_guide(step, guide);
    refdyn_programme_forget(&motion->programme);
}

/* Stages begin on the programme, also where motions are not projected otherwise. */
int refdyn_crossing_enter(struct refdyn_motion *motion) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    struct refdyn_workspace *work = motion->work;
    const int n = work->n;
    const size_t size = 2 * (size_t)n + 1;
    crossing->before = step->number;
    crossing->is_on = 1;
    follow_with(motion, REFDYN_RK8, &crossing->guide);
    crossing->refused.why = REFDYN_NO_STATE;
    memcpy(crossing->unpassed, step->state, size * sizeof(double));
    memcpy(crossing->unpassed + size, step->rates, refdyn_rates_bytes(step));
    int status = refdyn_row_terms(work, step->t_begin, step->state, step->state + n);
    if (status || motion->options.stabilise == REFDYN_PROJECT)
        return status;
    status = refdyn_programme_meet(&motion->programme, step, step->t_begin, step->state);
    return status ? status : refdyn_rates(&step->evaluation, step->t_begin, step->state, step->rates);
}

void refdyn_crossing_leave(struct refdyn_motion *motion) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    if (!crossing->is_on)
        return;
    crossing->is_on = 0;
    follow_with(motion, crossing->before, NULL);
}

/* The largest rate where the rows lose rank, on the motion continued. */
static double speed_there(const struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_singular_crossing *crossing = &motion->crossing;
    const double *qd = step->rates, *qdd = step->rates + motion->work->n;
    double most = 0;
    for (int j = 0; j < motion->work->n; j++)
        most = fmax(most, fabs(qd[j] + (crossing->t - step->t_begin) * qdd[j]) / step->units[j]);
    return most;
}

int refdyn_crossing_follow(struct refdyn_motion *motion, const double *before, const double *state) {
    struct refdyn_step *step = &motion->step;
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const int n = motion->work->n;
    const double speed = speed_there(motion);
    const double way = speed * (crossing->t - step->t_begin);
    if (refdyn_step_largest_change(step, state, before) <= moved_part * way &&
        refdyn_step_largest_change(step, state + n, before + n) <= moved_part * speed)
        return REFDYN_OK;
    crossing->refused.why = REFDYN_OTHER_BRANCH;
    return REFDYN_NO_CONVERGENCE;
}

/* A stage's state (2 n) onto the programme. */
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
    return status ? status : refdyn_crossing_follow(motion, before, state);
}

int refdyn_crossing_judge(struct refdyn_motion *motion, double *error) {
    const double tol = motion->options.tol, h = motion->step.t_end - motion->step.t_begin;
    const double way = h * speed_there(motion);
    const double most = tol > 0 ? fmax(error_share * tol, fmin(rounding / way, rounding_most)) : INFINITY;
    *error = refdyn_step_largest_error(&motion->step, h);
    if (*error <= most)
        return REFDYN_OK;
    motion->crossing.refused.why = REFDYN_LARGE_ERROR;
    return REFDYN_NO_CONVERGENCE;
}

void refdyn_crossing_look_back(struct refdyn_motion *motion) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    const struct refdyn_step *step = &motion->step;
    const double predicted = crossing->t - step->t_begin, gap = crossing->gap * (step->t_end - step->t_begin);
    double s;
    find_least(&motion->step, inside, predicted - gap, predicted + gap, &s);
    crossing->t = step->t_begin + s;
}

void refdyn_crossing_lay_out(struct refdyn_singular_crossing *crossing, const struct refdyn_model *model,
                             struct layout *layout) {
    crossing->unpassed = layout_doubles(layout, 2 * model->n + 1 + refdyn_rates_size(model));
}

void refdyn_crossing_start(struct refdyn_motion *motion) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    crossing->is_on = 0;
    crossing->t = -INFINITY;
    crossing->refused = (struct refdyn_refused_crossing){.tries = 0};
    crossing->guide = (struct refdyn_stage_guide){bring, motion};
}

/* ---- What is told ---- */

void refdyn_crossing_record(struct refdyn_motion *motion, double error) {
    const struct refdyn_step *step = &motion->step;
    refdyn_statistics_crossing(
        &motion->statistics, (struct refdyn_crossing){motion->crossing.t, step->t_begin, step->t_end, error});
    motion->crossing.refused = (struct refdyn_refused_crossing){.tries = 0};
}

void refdyn_crossing_refuse(struct refdyn_motion *motion, double t_new) {
    struct refdyn_singular_crossing *crossing = &motion->crossing;
    struct refdyn_step *step = &motion->step;
    const double *rates = crossing->unpassed + 2 * step->n + 1;
    crossing->refused.tries++;
    crossing->refused.t = crossing->t;
    crossing->refused.t_begin = step->t_begin;
    crossing->refused.stretch = t_new - step->t_begin;
    if (!crossing->is_on)
        return;
    refdyn_step_place(step, step->t_begin, crossing->unpassed);
    memcpy(step->rates, rates, refdyn_rates_bytes(step));
    refdyn_crossing_leave(motion);
}

const char *refdyn_refusal_text(enum refdyn_refusal refusal) {
    static const char *const texts[] = {
        [REFDYN_NOT_REFUSED] = "not refused",
        [REFDYN_NO_ROOM] =
            "the step would have to end before, at a break, a change of inputs or the end of the motion",
        [REFDYN_NO_STATE] = "no state on the programme was found",
        [REFDYN_OTHER_BRANCH] = "the state found may lie on another branch",
        [REFDYN_LARGE_ERROR] = "its error is larger than a tenth of the tolerance",
    };
    return (int)refusal >= 0 && refusal <= REFDYN_LARGE_ERROR ? texts[refusal] : "unknown refusal";
}
