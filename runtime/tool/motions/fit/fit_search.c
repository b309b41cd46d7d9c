/*
 * The search for the values.
 *
 * It begins with least squares from the given start over all data. If chi^2 then exceeds what noise explains,
 * or the solution is far from the start, it may be one of many local minima: the motion drifts out of phase
 * with the data and back. The search then tries many starts on the first part of the data, where phases still
 * agree. It solves for the best of them, and continues the better ones on longer and longer parts. A short
 * part does not determine every value: there, a penalty draws each unknown to its start.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"
#include "runtime/tool/support/random/random.h"
#include "runtime/tool/support/system/system.h"

enum {
    CANDIDATES = 64, /* starts that are tried */
    CHOSEN = 12,     /* of them, solved for on the first part of the data */
    KEPT = 2,        /* of them, solved for on all data */
    ROUNDS = 40,     /* of least squares on all data */
    ROUNDS_PART = 8  /* on a part */
};
/* The first parts of the data, one after the other until noise explains chi^2, and the factor from each part
 * to the next one. Factor 2 misses minima. */
static const double first_parts[] = {0.2, 0.1}, growth = 1.5;
/* Starts are within this factor of the given one, or this many units, unless bounds are closer. */
static const double factor_of_starts = 3, units_of_starts = 1;
/* Largest change of an unknown in one step: a factor of 2, or 0.7 of a unit. */
static const double step_most = 0.7;
/* Noise explains chi^2 if it exceeds its mean by at most this many of its standard deviations. */
static const double deviations_most = 6;
/* A solution is near its start if no unknown has moved further. */
static const double near_most = 0.25;
/* From each part to the next one, this share of the starts continues. */
static const double kept_share = 0.7;
/* On a part, an unknown that is this far from its start adds 1 to chi^2. */
static const double draw = 0.5;

struct fit_search {
    struct fit *fit;
    double until;          /* the end of the present part [s] */
    const double *from;    /* (values) the start to which unknowns are drawn; NULL on all data */
    double *lower, *upper; /* (values) bounds of the unknowns */
};

/* The residuals of a part: those of the data, then those that draw unknowns to their start. */
static enum fit_outcome part_residuals(void *context, const double *u, double *r, double *J) {
    const struct fit_search *search = context;
    const int count = search->fit->count, rows = fit_residual_count(search->fit, false, search->until);
    const size_t all = (size_t)rows + (search->from ? (size_t)count : 0);
    const enum fit_outcome outcome = fit_residuals(search->fit, search->until, u, r, J, all);
    for (int k = 0; k < count && search->from; k++) {
        r[rows + k] = (u[k] - search->from[k]) / draw;
        for (int j = 0; J && j < count; j++)
            J[(size_t)j * all + (size_t)rows + (size_t)k] = j == k ? 1 / draw : 0;
    }
    return outcome;
}

/* The time at which part `part` of the data ends. */
static double end_of_part(const struct fit *fit, double part) {
    double last = 0;
    for (int i = 0; i < fit->data_count; i++)
        if (!fit->data[i].is_held_out)
            last = fmax(last, fit->data[i].t[fit->data[i].rows - 1]);
    return part >= 1 ? last : fit->batch.t + part * (last - fit->batch.t);
}

/* Least squares from u on the data until search->until. Returns chi^2. */
static double solve(struct fit_search *search, double *u, int rounds, struct fit_solution *solution) {
    const int count = search->fit->count,
              rows = fit_residual_count(search->fit, false, search->until) + (search->from ? count : 0);
    struct least_squares problem = {.count = count,
                                    .rows = rows,
                                    .lower = search->lower,
                                    .upper = search->upper,
                                    .step_most = step_most,
                                    .rounds_most = rounds,
                                    .residuals = part_residuals,
                                    .context = search,
                                    .u = u};
    if (rows < count)
        return INFINITY;
    problem.r = format_allocate_large((size_t)rows, sizeof *problem.r);
    problem.J = format_allocate_large((size_t)rows * (size_t)count, sizeof *problem.J);
    const enum fit_outcome outcome = least_squares_solve(&problem);
    const bool is_better = solution && (!solution->u || problem.chi2 < solution->chi2);
    if (is_better) {
        if (!solution->u)
            solution->u = format_allocate((size_t)count, sizeof *solution->u);
        free(solution->r);
        free(solution->J);
        memcpy(solution->u, u, (size_t)count * sizeof *u);
        solution->r = problem.r;
        solution->J = problem.J;
        solution->rows = rows;
        solution->chi2 = problem.chi2;
        solution->outcome = outcome;
    } else {
        free(problem.r);
        free(problem.J);
    }
    return problem.chi2;
}

static bool is_explained(const struct fit *fit, const struct fit_solution *solution) {
    const double freedom = fmax(solution->rows - fit->count, 1);
    return solution->u && solution->chi2 <= freedom + deviations_most * sqrt(2 * freedom);
}

static bool is_near(const struct fit *fit, const double *from, const struct fit_solution *solution) {
    for (int k = 0; k < fit->count; k++)
        if (fabs(solution->u[k] - from[k]) > near_most)
            return false;
    return solution->outcome == FIT_DONE;
}

/* ---- Many starts ---- */

/* Candidates (CANDIDATES x values) as a Halton sequence about the start, which is the first of them. */
static void make_candidates(const struct fit_search *search, const double *from, double *unknowns) {
    const struct fit *fit = search->fit;
    random_halton(fit->count, 0, CANDIDATES, unknowns);
    for (int k = 0; k < fit->count; k++) {
        const double wide = fit->values[k].is_log ? log(factor_of_starts) : units_of_starts,
                     low = fmax(from[k] - wide, search->lower[k]),
                     high = fmin(from[k] + wide, search->upper[k]);
        const bool is_kept = fit->values[k].kind == FIT_DELAY; /* all candidates have the same outputs */
        for (int i = 0; i < CANDIDATES; i++)
            unknowns[i * fit->count + k] =
                i == 0 || is_kept ? from[k] : low + (high - low) * unknowns[i * fit->count + k];
    }
}

/* Moves the `wanted` best candidates to the front. */
static void choose_best(double *unknowns, double *chi2, int count, int wanted, int width) {
    for (int i = 0; i < wanted; i++) {
        int best = i;
        for (int k = i + 1; k < count; k++)
            if (chi2[k] < chi2[best])
                best = k;
        for (int k = 0; k < width; k++) {
            const double u = unknowns[i * width + k];
            unknowns[i * width + k] = unknowns[best * width + k];
            unknowns[best * width + k] = u;
        }
        const double other = chi2[i];
        chi2[i] = chi2[best];
        chi2[best] = other;
    }
}

/* Continues `count` starts (count x values) from the first part of the data to all of them. */
static void ascend(struct fit_search *search, const double *from, double *unknowns, int count,
                   double first_part, struct fit_solution *solution) {
    const int width = search->fit->count;
    double *chi2 = format_allocate_matrix(count, 1);
    search->from = from;
    for (double part = first_part; part < 1; part *= growth) {
        system_progress_show(&search->fit->progress, part / 2);
        search->until = end_of_part(search->fit, part);
        for (int i = 0; i < count && !system_interrupted; i++)
            chi2[i] = solve(search, unknowns + i * width, ROUNDS_PART, NULL);
        const int kept = (int)ceil(kept_share * count);
        choose_best(unknowns, chi2, count, kept, width);
        count = kept > KEPT ? kept : count < KEPT ? count : KEPT;
    }
    search->from = NULL;
    search->until = end_of_part(search->fit, 1);
    for (int i = 0; i < count && !system_interrupted; i++)
        solve(search, unknowns + i * width, ROUNDS, solution);
}

/* Tries many starts, from this first part of the data on. */
static void try_starts(struct fit_search *search, const double *from, double first_part,
                       struct fit_solution *solution) {
    struct fit *fit = search->fit;
    const int width = fit->count;
    double *unknowns = format_allocate_matrix(CANDIDATES, width),
           *chi2 = format_allocate_matrix(CANDIDATES, 1);
    int count = 0;
    make_candidates(search, from, unknowns);
    if (fit_try_candidates(fit, end_of_part(fit, first_part), unknowns, CANDIDATES, chi2) != FIT_DONE)
        return;
    solution->starts += CANDIDATES;
    choose_best(unknowns, chi2, CANDIDATES, CHOSEN, width);
    while (count < CHOSEN && isfinite(chi2[count]))
        count++;
    ascend(search, from, unknowns, count, first_part, solution);
}

void fit_search(struct fit *fit, const double *from, struct fit_solution *solution) {
    const size_t count = (size_t)fit->count;
    struct fit_search search = {.fit = fit, .until = end_of_part(fit, 1)};
    search.lower = format_allocate(count, sizeof *search.lower);
    search.upper = format_allocate(count, sizeof *search.upper);
    double *u = format_allocate(count, sizeof *u);
    for (size_t k = 0; k < count; k++) {
        const struct fit_value *value = &fit->values[k];
        search.lower[k] = isfinite(value->lower) ? fit_unknown_of(value, value->lower) : value->lower;
        search.upper[k] = isfinite(value->upper) ? fit_unknown_of(value, value->upper) : value->upper;
        u[k] = from[k];
    }
    solution->starts = 1;
    solve(&search, u, ROUNDS, solution);
    bool is_found = is_explained(fit, solution) && is_near(fit, from, solution);
    for (size_t i = 0; i < sizeof first_parts / sizeof *first_parts && !is_found && !system_interrupted;
         i++) {
        try_starts(&search, from, first_parts[i], solution);
        is_found = is_explained(fit, solution);
    }
    if (system_interrupted)
        solution->outcome = FIT_STOPPED;
}

/* ---- Files that are held out ---- */

struct held_out {
    struct fit *fit;
    const struct fit_data *data;
    double *u; /* (all_count) */
};

static enum fit_outcome held_out_residuals(void *context, const double *starts, double *r, double *J) {
    const struct held_out *held = context;
    const int count = held->fit->request.start_count;
    memcpy(held->u + held->data->first_start, starts, (size_t)count * sizeof *starts);
    return fit_file_residuals(held->fit, held->data, held->u, held->data->first_start, count, r, J);
}

/* Finds the unknown starts of a file, with all other values as they are. */
static enum fit_outcome find_starts(struct held_out *held, int rows) {
    const size_t count = (size_t)held->fit->request.start_count;
    double *bounds = format_allocate(2 * count, sizeof *bounds), *u = format_allocate(count, sizeof *u);
    struct least_squares problem = {.count = (int)count,
                                    .rows = rows,
                                    .lower = bounds,
                                    .upper = bounds + count,
                                    .step_most = step_most,
                                    .rounds_most = ROUNDS,
                                    .residuals = held_out_residuals,
                                    .context = held,
                                    .u = u};
    for (size_t k = 0; k < count; k++) {
        bounds[k] = -INFINITY;
        bounds[count + k] = INFINITY;
    }
    memcpy(u, held->u + held->data->first_start, count * sizeof *u);
    problem.r = format_allocate_large((size_t)rows, sizeof *problem.r);
    problem.J = format_allocate_large((size_t)rows * count, sizeof *problem.J);
    const enum fit_outcome outcome = least_squares_solve(&problem);
    memcpy(held->u + held->data->first_start, u, count * sizeof *u);
    free(problem.r);
    free(problem.J);
    return outcome == FIT_STUCK ? FIT_DONE : outcome;
}

enum fit_outcome fit_validate(struct fit *fit, double *u, double *r) {
    enum fit_outcome outcome = FIT_DONE;
    for (int i = 0; i < fit->data_count && outcome == FIT_DONE; i++) {
        struct held_out held = {fit, &fit->data[i], u};
        const int rows = fit_file_residual_count(fit, held.data, INFINITY);
        if (!held.data->is_held_out)
            continue;
        if (fit->request.start_count > 0 && rows >= fit->request.start_count)
            outcome = find_starts(&held, rows);
        if (outcome == FIT_DONE)
            outcome = fit_file_residuals(fit, held.data, u, 0, 0, r, NULL);
        r += rows;
    }
    return outcome;
}
