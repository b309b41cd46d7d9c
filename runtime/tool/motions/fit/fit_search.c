/*
 * The search for the values.
 *
 * It begins with least squares from the given start over all data. If chi^2 then exceeds what noise explains,
 * or the solution is far from the start, it may be one of many local minima: the motion drifts out of phase
 * with the data and back. The search then tries many starts on the first part of the data, where phases still
 * agree, and solves for the better ones. From then on it always continues the start that fits its part of the
 * data best, on the next longer part. A start in a wrong minimum fits longer parts worse, so that others
 * overtake it. A short part does not determine every value: there, a penalty draws each unknown to the start
 * from which it comes, so that different starts stay apart.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/tool/motions/fit/fit.h"
#include "runtime/tool/support/random/random.h"
#include "runtime/tool/support/system/system.h"

enum {
    CANDIDATES = 256,  /* starts that are tried */
    CHOSEN = 12,       /* of them, solved for on the first part of the data before any of them climbs */
    SOLUTIONS = 60,    /* of all parts, from one first part on */
    ROUNDS = 40,       /* of least squares for the result */
    ROUNDS_ROUGH = 12, /* for a rough solution */
    ROWS_ROUGH = 20000 /* measurements of a column of a file that rough solutions use */
};
/* The first parts of the data, one after the other until noise explains chi^2, and the factor from each part
 * to the next one. Factor 2 misses minima. */
static const double first_parts[] = {0.2, 0.1}, growth = 1.5;
/* Starts are within this factor of the given one, or this many units, unless bounds are closer. */
static const double factor_of_starts = 3, units_of_starts = 1;
/* Largest change of an unknown in one step: a factor of 2, or 0.7 of a unit. */
static const double step_most = 0.7;
/* Least squares end when they predict a smaller decrease of chi^2: for the result far below the scatter of
 * chi^2, for a rough solution below what distinguishes minima. */
static const double decrease_least = 1e-4, decrease_rough = 0.5;
/* Noise explains chi^2 if it exceeds its mean by at most this many of its standard deviations. */
static const double deviations_most = 6;
/* A solution is near its start if no unknown has moved further. */
static const double near_most = 0.25;
/* A chosen start differs from better ones by at least this much in some unknown. */
static const double apart_least = 0.4;
/* Two solutions of a part are the same if no unknown differs more, and if derivatives predict a smaller
 * change of chi^2 from one to the other. */
static const double same_most = 0.15, same_change = 1;
/* On a part, an unknown that is this far from its start adds 1 to chi^2. */
static const double draw = 0.5;

/* A start on its way to all data. */
struct climber {
    const double *from; /* (values) its start */
    double *u;          /* (values) the solution of a part */
    double part;        /* of the data; 0 before the first solution */
    double misfit;      /* chi^2 for each degree of freedom of this part */
    double scatter;     /* its standard deviation if the model is right */
    bool is_settled;    /* least squares had all derivatives, and ended as no step was worth its while */
    bool is_done;       /* has reached all data, or failed, or repeats the path of another one */
};

/* A rough solution of a part. */
struct waypoint {
    double *u;
    double part;
};

struct fit_search {
    struct fit *fit;
    const double *start;   /* (values) where the search begins */
    double *lower, *upper; /* (values) bounds of the unknowns */
    double part;           /* of the data that least squares use now */
    const double *from;    /* (values) to which unknowns are drawn */
    struct climber best;   /* the best one that has reached all data */
    struct waypoint waypoints[SOLUTIONS + 1];
    int waypoint_count;
    double fraction; /* of the search, for the progress bar */
};

/* The time at which part `part` of the data ends. */
static double end_of_part(const struct fit *fit, double part) {
    double last = 0;
    for (int i = 0; i < fit->data_count; i++)
        if (!fit->data[i].is_held_out)
            last = fmax(last, fit->data[i].t[fit->data[i].rows - 1]);
    return part >= 1 ? last : fit->batch.t + part * (last - fit->batch.t);
}

/* Whether unknowns are drawn to their start: on parts of the data. */
static bool is_drawn(const struct fit_search *search) {
    return search->part < 1;
}

/* What chi^2 of a part counts for the distance from the given start. */
static double square_of_distance(const struct fit_search *search, const double *u) {
    double sum = 0;
    for (int k = 0; k < search->fit->count; k++)
        sum += (u[k] - search->start[k]) / draw * (u[k] - search->start[k]) / draw;
    return sum;
}

/* The residuals of a part: those of the data, then those that draw unknowns to their start. */
static enum fit_outcome part_residuals(void *context, const double *u, double *r, double *J) {
    const struct fit_search *search = context;
    system_progress_show(&search->fit->progress, search->fraction);
    const double until = end_of_part(search->fit, search->part);
    const int count = search->fit->count, rows = fit_residual_count(search->fit, false, until);
    const size_t all = (size_t)rows + (is_drawn(search) ? (size_t)count : 0);
    const enum fit_outcome outcome = fit_residuals(search->fit, until, u, r, J, all);
    for (int k = 0; k < count && is_drawn(search); k++) {
        r[rows + k] = (u[k] - search->from[k]) / draw;
        for (int j = 0; J && j < count; j++)
            J[(size_t)j * all + (size_t)rows + (size_t)k] = j == k ? 1 / draw : 0;
    }
    return outcome;
}

/* Least squares on search->part from problem->u. The caller releases r and J. */
static enum fit_outcome solve(struct fit_search *search, struct least_squares *problem) {
    const int count = search->fit->count,
              rows = fit_residual_count(search->fit, false, end_of_part(search->fit, search->part));
    problem->count = count;
    problem->rows = rows + (is_drawn(search) ? count : 0);
    problem->lower = search->lower;
    problem->upper = search->upper;
    problem->step_most = step_most;
    problem->residuals = part_residuals;
    problem->context = search;
    problem->r = format_allocate_large((size_t)problem->rows + 1, sizeof *problem->r);
    problem->J = format_allocate_large((size_t)problem->rows * (size_t)count + 1, sizeof *problem->J);
    problem->chi2 = INFINITY;
    return rows >= count || is_drawn(search) ? least_squares_solve(problem) : FIT_FAILED;
}

static double freedom_of(const struct least_squares *problem) {
    return fmax(problem->rows - problem->count, 1);
}

/* ---- Climbing from part to part ---- */

/* The change of chi^2 from the solution to v that the derivatives predict. */
static double change_to(const struct least_squares *problem, const double *v) {
    double sum = 0;
    for (int i = 0; i < problem->rows; i++) {
        double change = 0;
        for (int k = 0; k < problem->count; k++)
            change += problem->J[(size_t)k * (size_t)problem->rows + (size_t)i] * (v[k] - problem->u[k]);
        sum += change * change;
    }
    return sum;
}

static double distance(const double *u, const double *v, int count) {
    double most = 0;
    for (int k = 0; k < count; k++)
        most = fmax(most, fabs(u[k] - v[k]));
    return most;
}

/* Whether an earlier climber has found the same solution of the part. */
static bool is_known(const struct fit_search *search, const struct least_squares *problem) {
    for (int i = 0; i < search->waypoint_count; i++) {
        const struct waypoint *point = &search->waypoints[i];
        if (point->part == search->part && distance(point->u, problem->u, problem->count) < same_most &&
            change_to(problem, point->u) < same_change)
            return true;
    }
    return false;
}

static void add_waypoint(struct fit_search *search, const double *u) {
    struct waypoint *point = &search->waypoints[search->waypoint_count++];
    const size_t count = (size_t)search->fit->count;
    point->part = search->part;
    point->u = format_allocate(count, sizeof *u);
    memcpy(point->u, u, count * sizeof *u);
}

/* Solves roughly for this part of the data. */
static void climb(struct fit_search *search, double part, struct climber *climber) {
    struct least_squares problem = {
        .u = climber->u, .decrease_least = decrease_rough, .rounds_most = ROUNDS_ROUGH};
    search->part = climber->part = fmin(part, 1);
    search->from = climber->from;
    climber->is_settled = solve(search, &problem) == FIT_DONE && search->fit->lost == 0;
    climber->misfit = problem.chi2 / freedom_of(&problem);
    climber->scatter = sqrt(2 / freedom_of(&problem));
    climber->is_done = !is_drawn(search) || !isfinite(climber->misfit) || is_known(search, &problem);
    add_waypoint(search, climber->u);
    if (!is_drawn(search) && (!search->best.u || climber->misfit < search->best.misfit))
        search->best = *climber;
    free(problem.r);
    free(problem.J);
}

static bool is_explained(const struct fit_search *search) {
    return search->best.u && search->best.misfit <= 1 + deviations_most * search->best.scatter;
}

/* Whether the solution from the given start is near it. */
static bool is_near(const struct fit_search *search, const struct climber *climber) {
    return climber->is_settled && distance(climber->u, search->start, search->fit->count) <= near_most;
}

/* ---- Many starts ---- */

/* Candidates (CANDIDATES x values) as a Halton sequence about the start, which is the first of them. */
static void make_candidates(const struct fit_search *search, double *unknowns) {
    const struct fit *fit = search->fit;
    random_halton(fit->count, 0, CANDIDATES, unknowns);
    for (int k = 0; k < fit->count; k++) {
        const double wide = fit->values[k].is_log ? log(factor_of_starts) : units_of_starts,
                     low = fmax(search->start[k] - wide, search->lower[k]),
                     high = fmin(search->start[k] + wide, search->upper[k]);
        const bool is_kept = fit->values[k].kind == FIT_DELAY; /* all candidates have the same outputs */
        for (int i = 0; i < CANDIDATES; i++)
            unknowns[i * fit->count + k] =
                i == 0 || is_kept ? search->start[k] : low + (high - low) * unknowns[i * fit->count + k];
    }
}

/* Takes the best candidate, with all those that are not apart from it; NULL if none is left. */
static double *take_candidate(double *unknowns, double *chi2, int width) {
    int best = 0;
    for (int i = 1; i < CANDIDATES; i++)
        best = chi2[i] < chi2[best] ? i : best;
    double *found = isfinite(chi2[best]) ? unknowns + best * width : NULL;
    for (int i = 0; i < CANDIDATES && found; i++)
        if (distance(unknowns + i * width, found, width) < apart_least)
            chi2[i] = INFINITY;
    return found;
}

/* An upper bound of the misfit: of two equal misfits, the one of the longer part promises more. */
static double doubt_of(const struct climber *climber) {
    return climber->misfit + 2 * climber->scatter;
}

/* The most promising climber; NULL if all are done. */
static struct climber *choose_climber(struct climber *climbers, int count) {
    struct climber *best = NULL;
    for (int i = 0; i < count; i++)
        if (!climbers[i].is_done && (!best || doubt_of(&climbers[i]) < doubt_of(best)))
            best = &climbers[i];
    return best;
}

/* Tries many starts, from this first part of the data on. */
static void try_starts(struct fit_search *search, double first_part, int *starts) {
    struct fit *fit = search->fit;
    const int width = fit->count;
    double *unknowns = format_allocate_matrix(CANDIDATES, width),
           *chi2 = format_allocate_matrix(CANDIDATES, 1);
    struct climber climbers[SOLUTIONS];
    int count = 0;
    make_candidates(search, unknowns);
    if (fit_try_candidates(fit, end_of_part(fit, first_part), unknowns, CANDIDATES, chi2) != FIT_DONE)
        return;
    for (int i = 0; i < CANDIDATES; i++)
        chi2[i] += square_of_distance(search, unknowns + i * width);
    *starts += CANDIDATES;
    search->waypoint_count = 0;
    while (search->waypoint_count < SOLUTIONS && !system_interrupted) {
        struct climber *next = choose_climber(climbers, count);
        const bool is_found = is_explained(search),
                   may_win = next && doubt_of(next) < doubt_of(&search->best);
        double *candidate =
            count < CHOSEN || (!next && !is_found) ? take_candidate(unknowns, chi2, width) : NULL;
        if (candidate) {
            next = &climbers[count++];
            *next = (struct climber){.from = candidate, .u = format_allocate((size_t)width, sizeof *next->u)};
            memcpy(next->u, candidate, (size_t)width * sizeof *next->u);
        } else if (!next || (is_found && !may_win))
            break;
        climb(search, next->part > 0 ? growth * next->part : first_part, next);
        search->fraction = (double)search->waypoint_count / SOLUTIONS;
    }
}

/* ---- The search ---- */

static double *bounds_of(const struct fit *fit, bool is_lower) {
    double *bounds = format_allocate((size_t)fit->all_count, sizeof *bounds);
    for (int k = 0; k < fit->all_count; k++) {
        const struct fit_value *value = &fit->values[k];
        const double bound = is_lower ? value->lower : value->upper;
        bounds[k] = isfinite(bound) ? fit_unknown_of(value, bound) : bound;
    }
    return bounds;
}

/* Data for rough solutions. */
static struct fit_data *thin(const struct fit *fit) {
    struct fit_data *data = format_allocate((size_t)fit->data_count, sizeof *data);
    for (int i = 0; i < fit->data_count; i++)
        fit_data_thin(fit, &fit->data[i], ROWS_ROUGH, &data[i]);
    return data;
}

/* Solves for all data from the best rough solution. */
static void finish(struct fit_search *search, struct fit_solution *solution) {
    struct least_squares problem = {
        .decrease_least = decrease_least, .takes_last = true, .rounds_most = ROUNDS};
    problem.u = solution->u = search->best.u;
    search->part = 1;
    solution->outcome = solve(search, &problem);
    solution->r = problem.r;
    solution->J = problem.J;
    solution->rows = problem.rows;
    solution->chi2 = problem.chi2;
}

void fit_search(struct fit *fit, const double *from, struct fit_solution *solution) {
    const size_t size = (size_t)fit->count * sizeof *from;
    struct fit_search *search = format_allocate(1, sizeof *search);
    struct fit_data *all = fit->data;
    struct climber first = {.from = from, .u = format_allocate((size_t)fit->count, sizeof *first.u)};
    *search = (struct fit_search){
        .fit = fit, .start = from, .lower = bounds_of(fit, true), .upper = bounds_of(fit, false)};
    memcpy(first.u, from, size);
    solution->starts = 1;
    fit->data = thin(fit);
    climb(search, 1, &first);
    bool is_found = is_explained(search) && is_near(search, &first);
    for (size_t i = 0; i < sizeof first_parts / sizeof *first_parts && !is_found && !system_interrupted;
         i++) {
        try_starts(search, first_parts[i], &solution->starts);
        is_found = is_explained(search);
    }
    fit->data = all;
    if (!system_interrupted)
        finish(search, solution);
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
    const int first = held->data->first_start;
    double *u = format_allocate(count, sizeof *u);
    struct least_squares problem = {.count = (int)count,
                                    .rows = rows,
                                    .lower = bounds_of(held->fit, true) + first,
                                    .upper = bounds_of(held->fit, false) + first,
                                    .step_most = step_most,
                                    .decrease_least = decrease_least,
                                    .takes_last = true,
                                    .rounds_most = ROUNDS,
                                    .residuals = held_out_residuals,
                                    .context = held,
                                    .u = u};
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
