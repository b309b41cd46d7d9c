/*
 * The nearest state on the programme from far away, where Newton's iteration may lead several turns off.
 *
 * Takes a start q0 and the factored metric M there; finds positions with phi = 0 and a small distance
 * |q - q0| in that metric. Four parts:
 *  - a walk to the programme: Newton's corrections, cut to a stride over which rows hardly bend, and halved
 *    until the residuals fall (Deuflhard, Newton Methods for Nonlinear Problems, 2004, sect. 3.1);
 *  - a slide along it towards q0: the part tau of q0 - q along the programme, u tau = 0, then a walk back to
 *    the programme, halved until the distance falls. It ends where tau = 0, at a least distance;
 *  - whole turns of coordinates that change no row, taken back if the state is then nearer;
 *  - the same from other places. Any nearer state lies in the ball about q0 through the best state so far, so
 *    these places are drawn from that ball, always the same ones.
 */
#include "runtime/core/constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

/* [rad, m] Within this distance Newton's iteration converges without much of a detour. */
static const double reach = 0.1;
/* [rad, m] A step over which sine and cosine are still nearly straight. */
static const double stride_least = 0.25;
/* Rows count as straight along a step if residuals deviate by less than this part of their change. */
static const double straight = 1e-3;
/* Below this Newton's iteration ends the work. */
static const double near_enough = 1e-7;
/* Until a state is found, the search begins at places within this distance. */
static const double first_ball = 2;
/* Smallest part that is tried: of the first one, and of a correction. */
static const double part_least = 1.0 / 64, shortest = 1e-4;
/* Off the programme a row that depends on others looks independent, by about this part of their residuals. */
static const double misses = 0.1, misses_most = 1e-3;
static const double turn_angle = 6.28318530717958647692;
enum { WALK_MOST = 200, SLIDE_MOST = 60, TURNS_MOST = 100, PLACES = 24 };

struct search {
    struct refdyn_workspace *work;
    double t;
    const double *qd;
    double *start, *best, *place, *trial, *next, *step, *pull; /* (n) */
    double *size;                                              /* (m) largest coefficients of the rows */
    uint64_t seed;
};

int refdyn_is_far(const struct refdyn_workspace *work, const double *change) {
    return refdyn_largest(change, work->n, NULL) > reach;
}

static int read(const struct search *search, const double *q) {
    return refdyn_row_terms(search->work, search->t, q, search->qd) == REFDYN_OK;
}

/* ---- To the programme ---- */

/* Sum of squares of the position residuals in units of their rows. */
static double misfit(const struct search *search) {
    const struct refdyn_workspace *work = search->work;
    double sum = 0;
    for (int a = 0; a < work->m; a++) {
        const double part =
            work->model->rows[a].level == REFDYN_POSITION ? work->phi[a] / search->size[a] : 0;
        sum += part * part;
    }
    return sum;
}

static void find_sizes(const struct search *search) {
    struct refdyn_workspace *work = search->work;
    refdyn_row_sizes(work);
    for (int a = 0; a < work->m; a++) {
        const double largest = refdyn_largest_coefficient(work, a);
        search->size[a] = largest > 0 ? largest : 1;
    }
}

/* A row whose own part is less than this counts as dependent. */
static double find_correction(const struct search *search, double dependent) {
    struct refdyn_workspace *work = search->work;
    const double kept = work->rank_tol;
    work->rank_tol += dependent;
    refdyn_smallest_change(work, REFDYN_POSITION, work->phi, search->step);
    work->rank_tol = kept;
    return refdyn_largest(search->step, work->n, NULL);
}

/* Moves q (n) on by a part of the step with which the residuals fall. */
static int take_step(const struct search *search, double part, double *q) {
    const int n = search->work->n;
    const double before = misfit(search), least = part * part_least;
    for (; part >= least && part >= shortest; part /= 2) {
        memcpy(search->next, q, (size_t)n * sizeof *q);
        dense_add(search->next, part, search->step, n);
        if (read(search, search->next) && misfit(search) <= (1 - part / 4) * before) {
            memcpy(q, search->next, (size_t)n * sizeof *q);
            return 1;
        }
        read(search, q);
    }
    return 0;
}

enum way { ON, BLOCKED, THERE };

/* Lengthens steps along which the rows hardly bend. */
static double next_stride(const struct search *search, double stride, double part, double before) {
    const double left = sqrt(misfit(search) / before);
    return fabs(left - (1 - part)) <= straight * part ? 2 * stride : stride_least;
}

/* A step of the walk. Off the programme a row that depends on others looks independent, and asks for a large
 * correction, until enough rows count as dependent. */
static enum way walk_on(const struct search *search, double *stride, double *q) {
    find_sizes(search);
    const double before = misfit(search), off = sqrt(before);
    for (double dependent = fmin(misses * off, misses_most); dependent < 1;
         dependent = 8 * dependent + DBL_EPSILON) {
        const double length = find_correction(search, dependent);
        if (length <= near_enough)
            return off <= near_enough ? THERE : BLOCKED;
        const double part = fmin(1, *stride / length);
        if (take_step(search, part, q)) {
            *stride = next_stride(search, *stride, part, before);
            return ON;
        }
    }
    return BLOCKED;
}

/* q (n) := on the programme; returns whether the walk ends there. */
static int walk(const struct search *search, double *q) {
    enum way way = read(search, q) ? ON : BLOCKED;
    double stride = stride_least;
    for (int i = 0; i < WALK_MOST && way == ON; i++)
        way = walk_on(search, &stride, q);
    return way == THERE;
}

/* ---- Along the programme ---- */

static double distance(const struct search *search, const double *q) {
    const int n = search->work->n;
    for (int j = 0; j < n; j++)
        search->next[j] = q[j] - search->start[j];
    return refdyn_metric_length(search->work, search->next);
}

/* pull := the part of start - q that no row feels: start - q and the smallest change that takes from it what
 * they feel. */
static void find_pull(const struct search *search, const double *q) {
    struct refdyn_workspace *work = search->work;
    const int n = work->n;
    double *felt = search->size;
    for (int j = 0; j < n; j++)
        search->next[j] = search->start[j] - q[j];
    for (int a = 0; a < work->m; a++)
        felt[a] = dense_dot(work->u + a * n, search->next, n);
    refdyn_smallest_change(work, REFDYN_POSITION, felt, search->pull);
    dense_add(search->pull, 1, search->next, n);
}

/* q (n), where a walk has ended, to a least distance. */
static void slide(const struct search *search, double *q) {
    const int n = search->work->n;
    double part = 1, now = distance(search, q);
    for (int i = 0; i < SLIDE_MOST; i++) {
        find_pull(search, q);
        const double length = refdyn_largest(search->pull, n, NULL);
        if (part * length <= near_enough)
            return;
        memcpy(search->trial, q, (size_t)n * sizeof *q);
        dense_add(search->trial, fmin(part, stride_least / length), search->pull, n);
        const double then = walk(search, search->trial) ? distance(search, search->trial) : INFINITY;
        part = then < now ? fmin(1, 2 * part) : part / 2;
        if (then < now) {
            memcpy(q, search->trial, (size_t)n * sizeof *q);
            now = then;
        } else
            read(search, q);
    }
}

/* ---- Whole turns ---- */

static int turns(const struct search *search, int j) {
    return refdyn_is_turn(search->work->model, j);
}

/* Moves q (n) by whole turns of coordinates j and k (-1: none) if that is nearer and on the programme.
 * Returns whether it is; otherwise q stays. */
static int turn(const struct search *search, double *q, int j, int j_turns, int k, int k_turns) {
    const size_t bytes = (size_t)search->work->n * sizeof *q;
    const double now = distance(search, q);
    memcpy(search->trial, q, bytes);
    search->trial[j] += turn_angle * j_turns;
    if (k >= 0)
        search->trial[k] += turn_angle * k_turns;
    if (distance(search, search->trial) >= now || !read(search, search->trial) ||
        misfit(search) > near_enough * near_enough)
        return 0;
    memcpy(q, search->trial, bytes);
    return 1;
}

/* Turns a coordinate alone, or together with another one in the same or the opposite sense. */
static int turn_nearer(const struct search *search, double *q, int j) {
    const int back = q[j] > search->start[j] ? -1 : 1;
    if (turn(search, q, j, back, -1, 0))
        return 1;
    for (int k = 0; k < search->work->n; k++)
        if (k != j && turns(search, k) &&
            (turn(search, q, j, back, k, -back) || turn(search, q, j, back, k, back)))
            return 1;
    return 0;
}

/* Whole turns do not change the rows of links: takes back as many as bring q (n) nearer. */
static void unwind(const struct search *search, double *q) {
    const int n = search->work->n;
    find_sizes(search);
    for (int i = 0, has_turned = 1; i < TURNS_MOST && has_turned; i++) {
        has_turned = 0;
        for (int j = 0; j < n; j++)
            if (turns(search, j) && fabs(q[j] - search->start[j]) > turn_angle / 8)
                has_turned |= turn_nearer(search, q, j);
    }
    read(search, q);
}

/* ---- Places to begin ---- */

/* In -1 ... 1, by a linear congruence (Knuth, The Art of Computer Programming, 3.3.4). */
static double draw(struct search *search) {
    search->seed = search->seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(search->seed >> 11) * 0x1p-52 - 1;
}

/* place := start and a change of this length. */
static void draw_place(struct search *search, double length) {
    const int n = search->work->n;
    double square = 0;
    for (int j = 0; j < n; j++) {
        search->place[j] = draw(search);
        square += search->place[j] * search->place[j];
    }
    for (int j = 0; j < n; j++)
        search->place[j] *= length / sqrt(square);
    refdyn_metric_unspread(search->work, search->place);
    dense_add(search->place, 1, search->start, n);
}

static void divide_room(struct search *search, double *room) {
    const int n = search->work->n;
    double **const parts[] = {&search->start, &search->best, &search->place, &search->trial,
                              &search->next,  &search->step, &search->pull};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        *parts[i] = room + i * (size_t)n;
    search->size = room + sizeof parts / sizeof *parts * (size_t)n;
}

int refdyn_nearest_state(struct refdyn_workspace *work, double t, double *q, const double *qd) {
    struct search search = {.work = work, .t = t, .qd = qd};
    const size_t bytes = (size_t)work->n * sizeof *q;
    int is_found = 0;
    const double far = refdyn_largest(work->change, work->n, NULL);
    double least = refdyn_metric_length(work, work->change) * fmin(1, first_ball / far);
    divide_room(&search, work->away);
    memcpy(search.start, q, bytes);
    memcpy(search.place, q, bytes);
    for (int i = 1; i <= PLACES; i++) {
        if (walk(&search, search.place)) {
            unwind(&search, search.place);
            slide(&search, search.place);
            const double length = distance(&search, search.place);
            if (!is_found || length < least) {
                memcpy(search.best, search.place, bytes);
                least = length;
            }
            is_found = 1;
        }
        draw_place(&search, least * i / PLACES);
    }
    memcpy(q, is_found ? search.best : search.start, bytes);
    if (!is_found)
        read(&search, q);
    return is_found;
}
