/*
 * Through a state where the rows lose rank: see pass.h.
 *
 * Takes a drive at the begin of a step; tells when the rows lose rank ahead, keeps the stages of the step
 * that leads through on the programme, and judges where it arrived. Measure of rank: with the independent
 * rows as vectors, columns scaled by 1/sqrt(M_jj), the volume that they span; it is 0 where they lose rank,
 * in whichever way, and does not depend on the partition. Redundant rows are none of these vectors.
 */
#include "base/arithmetic.h"

#include "private/pass.h"

#include <math.h>
#include <string.h>

#include "private/advance.h"
#include "constraints/constraints.h"
#include "linear/dense.h"
#include "private/slope.h"
#include "private/step.h"

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

/* The independent rows, from the row terms in the workspace, with weighted columns. */
static void gather(struct refdyn_workspace *work) {
    const struct refdyn_partition *partition = &work->partition;
    const int n = work->n;
    for (int a = 0; a < partition->rank; a++) {
        const double *from = work->u + partition->row[a] * n;
        for (int b = 0; b < n; b++)
            work->basis[a * n + b] = from[partition->column[b]] * work->weight[b];
    }
}

static double length_of(const struct refdyn_workspace *work, int a) {
    return sqrt(dense_dot(work->basis + a * work->n, work->basis + a * work->n, work->n));
}

/* The longest of the rows from k on comes to place k. */
static double bring_longest(struct refdyn_workspace *work, int k) {
    const int n = work->n;
    int longest = k;
    for (int a = k + 1; a < work->partition.rank; a++)
        longest = length_of(work, a) > length_of(work, longest) ? a : longest;
    for (int b = 0; b < n && longest > k; b++) {
        const double kept = work->basis[k * n + b];
        work->basis[k * n + b] = work->basis[longest * n + b];
        work->basis[longest * n + b] = kept;
    }
    return length_of(work, k);
}

/* What they span: by Gram and Schmidt, the longest row first. */
static double find_volume(struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank;
    double volume = 1;
    gather(work);
    for (int k = 0; k < rank; k++) {
        const double length = bring_longest(work, k);
        const double *row = work->basis + k * n;
        volume *= length;
        for (int a = k + 1; a < rank && length > 0; a++)
            dense_add(work->basis + a * n, -dense_dot(row, work->basis + a * n, n) / (length * length), row,
                      n);
    }
    return volume;
}

/* ---- When ---- */

/* A path of states: into drive->stage, at t_begin + s. */
typedef int path_function(struct refdyn_drive *drive, double s);

/* The motion continued by the accelerations at the begin. */
static int continued(struct refdyn_drive *drive, double s) {
    const int n = drive->work->n;
    for (int j = 0; j < n; j++) {
        const double rate = drive->slope[j], acceleration = drive->slope[n + j];
        drive->stage[j] = drive->state[j] + s * (rate + s / 2 * acceleration);
        drive->stage[n + j] = rate + s * acceleration;
    }
    return REFDYN_OK;
}

/* Inside the step that was taken. */
static int inside(struct refdyn_drive *drive, double s) {
    const int status =
        refdyn_runge_kutta_interpolate(drive, s / (drive->t_end - drive->t_begin), drive->side);
    memcpy(drive->stage, drive->side, (size_t)(2 * drive->work->n) * sizeof(double));
    return status;
}

/* Volume at a place of the path; INFINITY where it cannot be told. */
static double volume_at(struct refdyn_drive *drive, path_function *path, double s) {
    const double t = fmin(drive->t_begin + s, drive->t_limit);
    if (path(drive, s) || refdyn_row_terms(drive->work, t, drive->stage, drive->stage + drive->work->n))
        return INFINITY;
    const double volume = find_volume(drive->work);
    return isfinite(volume) ? volume : INFINITY;
}

/* The least volume between two places, by golden section; *s is where. */
static double find_least(struct refdyn_drive *drive, path_function *path, double from, double to, double *s) {
    const double golden = (sqrt(5) - 1) / 2;
    double left = to - golden * (to - from), right = from + golden * (to - from);
    double at_left = volume_at(drive, path, left), at_right = volume_at(drive, path, right);
    for (int i = 0; i < NARROWINGS; i++) {
        if (at_left < at_right) {
            to = right, right = left, at_right = at_left;
            left = to - golden * (to - from);
            at_left = volume_at(drive, path, left);
        } else {
            from = left, left = right, at_left = at_right;
            right = from + golden * (to - from);
            at_right = volume_at(drive, path, right);
        }
    }
    *s = at_left < at_right ? left : right;
    return fmin(at_left, at_right);
}

/* Between the ends of the step that was taken. */
static int between(struct refdyn_drive *drive, double s) {
    refdyn_hermite(drive, drive->slope_new, s / (drive->t_end - drive->t_begin), drive->stage);
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
static double find_dip(struct refdyn_drive *drive, path_function *path, const double *at, double begin) {
    double volumes[SAMPLES], s;
    for (int i = 0; i < SAMPLES; i++)
        volumes[i] = volume_at(drive, path, at[i]);
    for (int i = next_dip(volumes, begin, 0); i < SAMPLES; i = next_dip(volumes, begin, i + 1))
        if (find_least(drive, path, i > 0 ? at[i - 1] : 0, at[i + 1], &s) < small_part * begin)
            return s;
    return 0;
}

int refdyn_pass_is_ahead(struct refdyn_drive *drive, double reach, double *t) {
    const double known = drive->singular_t - drive->t_begin;
    double at[SAMPLES];
    if (drive->work->partition.rank <= 0)
        return 0;
    if (known > 0) /* one that was not passed yet: as near as it may be */
        reach = fmin(reach, nearer * known);
    for (int i = 0; i < SAMPLES; i++) /* each twice as far away as the one before */
        at[i] = reach / FIRST_SAMPLE * (1 << i);
    const double s = find_dip(drive, continued, at, volume_at(drive, continued, 0));
    if (s > 0)
        *t = drive->t_begin + s;
    return s > 0;
}

int refdyn_pass_was_crossed(struct refdyn_drive *drive, double t_new) {
    const double h = t_new - drive->t_begin, t_end = drive->t_end;
    double at[SAMPLES];
    if (drive->work->partition.rank <= 0)
        return 0;
    for (int i = 0; i < SAMPLES; i++)
        at[i] = h * (i + 1) / (SAMPLES - 1); /* the last one behind the step, lest a dip at its end be none */
    drive->t_end = t_new;
    const double ends = fmax(volume_at(drive, between, 0), volume_at(drive, between, h));
    const double s = find_dip(drive, between, at, ends);
    volume_at(drive, between, h);
    drive->t_end = t_end;
    if (!(s > 0 && s <= h))
        return 0;
    drive->singular_t = drive->t_begin + s;
    return 1;
}

int refdyn_pass_is_vain(const struct refdyn_drive *drive, double t) {
    const struct refdyn_refused_passage *refused = &drive->refused;
    const double before = refused->t - refused->t_begin;
    return refused->tries > 0 && fabs(t - refused->t) < before && t - drive->t_begin > again_part * before;
}

double refdyn_pass_end(struct refdyn_drive *drive, double t, double t_bound) {
    drive->refused.why = REFDYN_NO_ROOM;
    drive->singular_t = t;
    for (int i = 0; i < PLACES; i++) {
        const double t_new = drive->t_begin + (t - drive->t_begin) / places[i];
        drive->singular_gap = gaps[i];
        if (t_new <= t_bound)
            return t_new;
    }
    return INFINITY;
}

int refdyn_pass_is_near(const struct refdyn_drive *drive, double t) {
    return drive->is_passing && t < drive->t_end &&
           fabs(t - drive->singular_t) < near_part * (drive->t_end - drive->t_begin);
}

/* ---- The step ---- */

/* Stages begin on the programme, also where motions are not projected otherwise. */
int refdyn_pass_enter(struct refdyn_drive *drive) {
    struct refdyn_workspace *work = drive->work;
    const int n = work->n;
    const size_t size = 2 * (size_t)n + 1;
    drive->method_before = drive->method;
    drive->method = REFDYN_RK8;
    drive->is_passing = 1;
    drive->is_aligned = 0;
    drive->refused.why = REFDYN_NO_STATE;
    memcpy(drive->unpassed, drive->state, size * sizeof(double));
    memcpy(drive->unpassed + size, drive->slope, refdyn_slope_bytes(drive));
    int status = refdyn_row_terms(work, drive->t_begin, drive->state, drive->state + n);
    if (status || drive->options.stabilise == REFDYN_PROJECT)
        return status;
    status = refdyn_meet_programme(drive, drive->t_begin, drive->state);
    return status ? status : refdyn_slope(drive, drive->t_begin, drive->state, drive->slope);
}

/* What the other method kept of its steps is gone. */
void refdyn_pass_leave(struct refdyn_drive *drive) {
    if (!drive->is_passing)
        return;
    drive->method = drive->method_before;
    drive->is_passing = drive->is_aligned = 0;
    drive->last_h = drive->factored_h = drive->rate = 0;
    drive->tried_t = INFINITY;
}

/* The largest rate where the rows lose rank, on the motion continued. */
static double speed_there(const struct refdyn_drive *drive) {
    const double *qd = drive->slope, *qdd = drive->slope + drive->work->n;
    double most = 0;
    for (int j = 0; j < drive->work->n; j++)
        most = fmax(most, fabs(qd[j] + (drive->singular_t - drive->t_begin) * qdd[j]) / drive->units[j]);
    return most;
}

int refdyn_pass_follow(struct refdyn_drive *drive, const double *before, const double *state) {
    const int n = drive->work->n;
    const double speed = speed_there(drive);
    const double way = speed * (drive->singular_t - drive->t_begin);
    if (refdyn_largest_change(drive, state, before) <= moved_part * way &&
        refdyn_largest_change(drive, state + n, before + n) <= moved_part * speed)
        return REFDYN_OK;
    drive->refused.why = REFDYN_OTHER_BRANCH;
    return REFDYN_NO_CONVERGENCE;
}

int refdyn_pass_meet(struct refdyn_drive *drive, double t, double *state) {
    const int n = drive->work->n, rank = drive->work->partition.rank;
    double *before = drive->side;
    memcpy(before, state, (size_t)(2 * n) * sizeof *state);
    int status = refdyn_row_terms(drive->work, t, state, state + n);
    if (!status)
        status = refdyn_meet_programme(drive, t, state);
    if (!status && drive->work->partition.rank != rank)
        status = REFDYN_NO_CONVERGENCE;
    return status ? status : refdyn_pass_follow(drive, before, state);
}

double refdyn_pass_error_most(const struct refdyn_drive *drive, double h) {
    const double tol = drive->options.tol, way = h * speed_there(drive);
    return tol > 0 ? fmax(error_share * tol, fmin(rounding / way, rounding_most)) : INFINITY;
}

void refdyn_pass_look_back(struct refdyn_drive *drive, double t_new) {
    const double h = t_new - drive->t_begin, predicted = drive->singular_t - drive->t_begin;
    const double gap = drive->singular_gap * h, t_end = drive->t_end;
    double s;
    drive->t_end = t_new;
    find_least(drive, inside, predicted - gap, predicted + gap, &s);
    drive->t_end = t_end;
    drive->singular_t = drive->t_begin + s;
}

/* ---- What is told ---- */

void refdyn_pass_record(struct refdyn_drive *drive, double t_new, double error) {
    struct refdyn_statistics *statistics = &drive->statistics;
    const struct refdyn_passage passage = {drive->singular_t, drive->t_begin, t_new, error};
    if (statistics->passages < REFDYN_PASSAGES_KEPT)
        statistics->passage[statistics->passages] = passage;
    statistics->passages++;
    statistics->passage_error = fmax(statistics->passage_error, error);
    drive->refused = (struct refdyn_refused_passage){.tries = 0};
}

void refdyn_pass_refuse(struct refdyn_drive *drive, double t_new) {
    const size_t size = 2 * (size_t)drive->work->n + 1;
    drive->refused.tries++;
    drive->refused.t = drive->singular_t;
    drive->refused.t_begin = drive->t_begin;
    drive->refused.stretch = t_new - drive->t_begin;
    if (!drive->is_passing)
        return;
    memcpy(drive->state, drive->unpassed, size * sizeof(double));
    memcpy(drive->slope, drive->unpassed + size, refdyn_slope_bytes(drive));
    refdyn_pass_leave(drive);
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
