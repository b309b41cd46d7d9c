/*
 * The drive forces of a programme: checks of the model and its start, times and meshes, and the playback of
 * the forces from rest.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/system/system.h"

/* Tails that let modes of the slowest growth decay by ten orders of magnitude, within these bounds [s]. */
static const double tail_decay = 23, tail_least = 0.1, tail_most = 2;
/* Steps of the first guess, as multiples of 1/(slowest growth). */
static const double guess_growth = 4;
/* Steps of the mesh: at most this part of the motion, and by default this length [s]. */
static const double mesh_part = 0.05, mesh_most = 0.05;
/* Its part for the least effort of a mechanism with coordinates that have no drive. */
static const double mesh_of_effort = 0.5;
/* The largest change of a drive force, relative to its peak, from a mesh to the next one. */
static const double mesh_tol = 0.02;
enum { MESHES_MOST = 4 };
/* A start is at rest if no coordinate accelerates by more [m/s^2, rad/s^2]. */
static const double rest_tol = 1e-6;

static bool is_from_held(const struct options *options) {
    return options_has(options, "realise") && options_is(options, "from", "held");
}

const char *realise_state_path(const struct options *options) {
    return is_from_held(options) ? NULL : options_state_path(options_text(options, "from"));
}

/* ---- Whether the programme can be realised ---- */

static enum status complain(const struct model *model, struct place place, const char *fact) {
    format_complain_line(place.file ? place.file : model->file, place.line, fact);
    return STATUS_FAULT;
}

/* The names of the programme's rows from number `first` on. */
static const char *names_of_rows(const struct model *model, int first) {
    struct text text = {.memory = &format_memory};
    for (int i = 0, number = 0; i < model->row_count; i++)
        if (model->rows[i].is_programme && number++ >= first)
            text_add(&text, "%s%s", text.length ? ", " : "", model->rows[i].name);
    return text.data;
}

static enum status check_counts(const struct model *model) {
    int rows = 0;
    for (int i = 0; i < model->row_count; i++)
        rows += model->rows[i].is_programme;
    if (model->drive_count == 0)
        return complain(model, model->place,
                        "drives: the model has none; --realise needs a drive for each row of the programme");
    if (rows == 0)
        return complain(model, model->place,
                        "constraints: the model has no programme; --realise needs rows to perform");
    if (model->drive_count < rows)
        return complain(model, model->drives[0].place,
                        format_text("drives: %d for %d rows of the programme; no drive is left for %s",
                                    model->drive_count, rows, names_of_rows(model, model->drive_count)));
    return STATUS_DONE;
}

/* Motions with jumps of rates or forces have no smooth drive forces. Continuous states have no rest. */
static enum status check_smoothness(const struct model *model, const struct refdyn_model *emitted) {
    if (model->state_count > 0)
        return complain(
            model, model->states[0].place,
            format_text("%s: a continuous state, which --realise does not allow", model->states[0].name));
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].is_impact || model->events[i].contact >= 0)
            return complain(
                model, model->events[i].place,
                format_text(
                    "%s: an impact, which --realise does not allow: drives cannot perform jumps of rates",
                    model->events[i].name));
    if (emitted->saturates || emitted->kink_count > 0)
        return complain(
            model, model->place,
            "forces: friction, saturation or another kink in coordinates or rates, which --realise does "
            "not allow: it needs smooth forces");
    if (emitted->event_count > 0)
        return complain(model, model->events[0].place,
                        format_text("%s: an event, which --realise does not allow", model->events[0].name));
    return STATUS_DONE;
}

enum status realise_check_model(const struct scene *scene) {
    const enum status status = check_counts(&scene->generation.model);
    return status == STATUS_DONE ? check_smoothness(&scene->generation.model, scene->model) : status;
}

static double largest_residual(const struct realise_work *work, int *row) {
    const struct refdyn_workspace *equations = &work->scene->work;
    double largest = 0;
    *row = 0;
    for (int i = 0; i < equations->m; i++) {
        const double size = fmax(fabs(equations->phi[i]), fabs(equations->psi[i]));
        if (size > largest) {
            largest = size;
            *row = i;
        }
    }
    return largest;
}

/* The motion must start at rest on the programme. */
static enum status check_start(struct realise_work *work) {
    struct scene *scene = work->scene;
    const struct model *model = realise_model(work);
    const int n = scene->model->n;
    int coordinate, row;
    const char *advice = "; --from held starts at the equilibrium that the drives hold";
    for (int i = 0; i < n; i++)
        if (scene->qd[i] != 0)
            return complain(
                model, model->place,
                format_text("start: %s moves with %.6g; a motion of --realise must start at rest%s",
                            scene->model->coordinates[i].name, scene->qd[i], advice));
    const double acceleration =
        realise_hold(&work->problem, scene->state.t, scene->q, work->hold, &coordinate);
    const double residual = largest_residual(work, &row);
    if (!(residual <= scene->work.consistency_tol * 1e-2))
        return complain(model, model->rows[row].place,
                        format_text("start: is off the programme: the residual of %s is %.3g%s",
                                    model->rows[row].name, residual, advice));
    if (!(acceleration <= rest_tol))
        return complain(
            model, model->place,
            format_text("start: is not at rest: the drives cannot hold it, %s would accelerate with %.3g%s",
                        coordinate < 0 ? "it" : scene->model->coordinates[coordinate].name, acceleration,
                        advice));
    return STATUS_DONE;
}

/* ---- The solution ---- */

/* The forces of least effort excite the coordinates without a drive. */
static bool is_resolved_more(const struct realise_problem *problem) {
    return problem->spare > 0 && problem->drives + problem->loops < problem->n;
}

/* Cells begin at multiples of `every` from the start. */
static double whole_cells(double before, double every) {
    return every * ceil(before / every - 1e-9);
}

/* The option that makes the motion long: a tail, or another one by which it is divided. */
static const char *name_of_length(const struct options *options, double length, const char *division) {
    const double before = options_number(options, "before"), after = options_number(options, "after");
    return fmax(before, after) <= length ? division : before > after ? "before" : "after";
}

enum status realise_tails(const struct options *options, double length, double every, double *before,
                          double *after) {
    *before = whole_cells(options_number(options, "before"), every);
    *after = options_number(options, "after");
    const char *name = name_of_length(options, length, "every");
    return simulate_check_count(options, name, (*before + length + *after) / every, "outputs",
                                RECORD_KEPT_MAX);
}

/* Bounds the numbers of the linearised intervals. */
static enum status check_mesh(const struct realise_work *work, double length) {
    enum { NUMBERS_MAX = 20 * RECORD_KEPT_MAX };
    const struct realise_problem *problem = &work->problem;
    const double n = problem->n, width = problem->width, choices = REALISE_STAGES * problem->spare;
    const double numbers = REALISE_STAGES * width * (2 * n + 1 + choices) + 2 * n * (2 * n + choices);
    const char *division = options_has(work->options, "mesh") ? "mesh" : "until";
    return simulate_check_count(work->options, name_of_length(work->options, length, division),
                                (work->before + length + work->after) / work->mesh, "intervals of the mesh",
                                floor(NUMBERS_MAX / numbers));
}

static enum status choose_times(struct realise_work *work) {
    const struct options *options = work->options;
    const double length = work->until - work->scene->state.t;
    const struct realise_modes *modes = &work->modes;
    const double tail =
        modes->growing ? fmin(fmax(tail_decay / modes->slowest, tail_least), tail_most) : tail_least;
    const double mesh = (is_resolved_more(&work->problem) ? mesh_of_effort : 1) * mesh_most;
    work->mesh =
        fmin(options_has(options, "mesh") ? options_number(options, "mesh") : mesh, mesh_part * length);
    work->every = record_distance(length, options_number(options, "every"));
    const enum status status = realise_tails(options, length, work->every, &work->before, &work->after);
    if (status != STATUS_DONE)
        return status;
    work->before = options_has(options, "before") ? work->before : whole_cells(tail, work->every);
    work->after = options_has(options, "after") ? work->after : tail;
    work->cells = (int)floor((work->before + length + work->after) / work->every + 1e-9);
    return check_mesh(work, length);
}

static enum status report_failure(const struct realise_work *work, enum realise_outcome outcome) {
    if (outcome == REALISE_STOPPED)
        fprintf(stderr, "refdyn: %s: interrupted\n", work->scene->model->name);
    else if (outcome == REALISE_FALLING)
        fprintf(stderr,
                "refdyn: %s: --realise: the effort still decreases after %d corrections; vibrations with "
                "little damping can decrease it without end; use more damping, a smaller limit of the drive "
                "that excites them, or as many drives as rows\n",
                work->scene->model->name, work->solution.iterations);
    else if (outcome == REALISE_NOT_FINITE)
        fprintf(stderr,
                "refdyn: %s: --realise: iteration %d: the equations of the motion are singular or not "
                "finite; another --mesh "
                "or longer --before and --after may help\n",
                work->scene->model->name, work->solution.iterations);
    else
        fprintf(stderr,
                "refdyn: %s: --realise: no convergence in %d iterations, the last correction is %.3g; "
                "another --mesh, longer --before and --after%s may help\n",
                work->scene->model->name, work->solution.iterations, work->solution.correction,
                work->problem.spare > 0 ? ", or as many drives as rows" : "");
    return STATUS_NUMBERS;
}

static void take_means(struct realise_work *work, double *means) {
    const struct realise_motion *motion = &work->solution.motion;
    for (int i = 0; i < work->cells; i++)
        realise_means(motion, motion->t[0] + i * work->every, work->every, means + i * work->problem.drives);
}

/* Whether the cell is in the programme, where its kinks are. */
static bool is_in_programme(const struct realise_work *work, int cell) {
    const double t = work->solution.motion.t[0] + cell * work->every;
    return t > work->scene->state.t - 1.5 * work->every && t < work->until + 0.5 * work->every;
}

/* The peak of a drive's mean forces. In a least effort a drive may have next to no force: the largest peak of
 * all drives then counts, by their weights. */
static double peak_of_means(const struct realise_work *work, const double *means, int drive) {
    const int drives = work->problem.drives;
    const double *weights = work->problem.weights;
    double peak = 0;
    for (int d = 0; d < drives; d++)
        for (int i = 0; i < work->cells && (d == drive || work->problem.spare > 0); i++)
            peak = fmax(peak, fabs(means[i * drives + d]) * weights[d] / weights[drive]);
    return peak;
}

/* The largest change of a mean force from other means, relative to the peak of its drive; the cell of the
 * programme where the change is largest. */
static double change_of_means(const struct realise_work *work, const double *means, int *cell) {
    const int drives = work->problem.drives;
    double largest = 0, largest_in_programme = -1;
    for (int d = 0; d < drives; d++) {
        const double peak = peak_of_means(work, means, d);
        for (int i = 0; i < work->cells && peak > 0; i++) {
            const double change = fabs(means[i * drives + d] - work->means[i * drives + d]) / peak;
            largest = fmax(largest, change);
            if (change > largest_in_programme && is_in_programme(work, i)) {
                largest_in_programme = change;
                *cell = i;
            }
        }
    }
    return largest;
}

static enum status refuse_rough(const struct realise_work *work, int cell) {
    const struct model *model = realise_model(work);
    int row = 0;
    if (work->problem.spare > 0)
        return complain(
            model, model->drives[0].place,
            format_text("drives: the forces of least effort change by %.2g of their peak from mesh "
                        "to mesh, most about t = %.3g s; a smaller --mesh may help",
                        work->mesh_change, work->solution.motion.t[0] + (cell + 0.5) * work->every));
    while (!model->rows[row].is_programme)
        row++;
    return complain(
        model, model->rows[row].place,
        format_text(
            "%s: too rough for the drives: their forces change by %.2g of their peak from mesh to mesh, "
            "most about t = %.3g s; use a smoother course, such as rd.smoothstep of degree 7 or 9",
            model->rows[row].name, work->mesh_change,
            work->solution.motion.t[0] + (cell + 0.5) * work->every));
}

/* A first guess of a motion on a mesh with steps of at most `mesh`, and what its end comes close to. */
static void guess(struct realise_work *work, double mesh, enum realise_guesses which) {
    struct realise_motion *motion = &work->solution.motion;
    const size_t n = (size_t)work->problem.n;
    realise_mesh(motion, &work->problem, work->before, work->until, work->after, mesh);
    realise_guess(motion, which, work->modes.growing ? guess_growth / work->modes.slowest : 0);
    const double *end = motion->nodes + (size_t)motion->count * 2 * n,
                 *stage = motion->stages +
                          (size_t)(motion->count * REALISE_STAGES - 1) * (size_t)work->problem.width;
    double *rest = format_allocate_matrix(3, work->problem.n);
    memcpy(rest, end, 2 * n * sizeof *rest);
    memcpy(work->last, end, 2 * n * sizeof *rest);
    memcpy(work->last + 2 * n, stage, n * sizeof *rest);
    if (realise_rest(&work->problem, work->until + work->after, work->after, rest))
        memcpy(work->last, rest, 3 * n * sizeof *rest);
}

/* Means of the drive forces of some meshes. */
struct meshes {
    double *means[MESHES_MOST]; /* (cells x drives) of those that were solved */
    int solved;
    enum realise_outcome outcome; /* of the last one */
};

/* Vibrations that neither grow nor decay can decrease the effort without end. A long search then finds no
 * least effort. */
static bool may_vibrate(const struct realise_work *work) {
    return is_resolved_more(&work->problem) && work->modes.vibrates;
}

/* Solves on a mesh from a first guess. More drives than rows have several solutions, each near a guess: if
 * one needs more effort than its guess, other guesses are tried, and the least effort counts. */
static enum realise_outcome solve_guesses(struct realise_work *work, double mesh) {
    const int guesses = work->problem.spare > 0 ? REALISE_GUESSES : 1;
    struct realise_solution best = {.iterations = 0};
    enum realise_outcome outcome = REALISE_STUCK, failure = REALISE_SOLVED;
    double least = INFINITY, at_first = 0;
    for (int i = 0; i < guesses && least > at_first && outcome != REALISE_STOPPED &&
                    !(outcome == REALISE_FALLING && may_vibrate(work));
         i++) {
        guess(work, mesh, (enum realise_guesses)i);
        at_first = realise_effort(&work->solution.motion);
        outcome = realise_solve(&work->solution, work->last);
        if (outcome == REALISE_FALLING || failure == REALISE_SOLVED)
            failure = outcome;
        const double effort = outcome == REALISE_SOLVED ? realise_effort(&work->solution.motion) : INFINITY;
        if (effort < least) {
            least = effort;
            best = work->solution;
        }
    }
    if (outcome == REALISE_STOPPED || !isfinite(least))
        return outcome == REALISE_STOPPED ? outcome : failure;
    work->solution = best;
    return REALISE_SOLVED;
}

/* Solves on a mesh, from the motion of the mesh before if `is_refined`. Returns whether the forces equal
 * those of an earlier mesh; otherwise `cell` is where they differ most from those of the mesh that comes
 * closest. */
static bool solve_mesh(struct realise_work *work, double mesh, bool is_refined, struct meshes *meshes,
                       int *cell) {
    work->solution.is_refined = is_refined;
    if (is_refined) {
        struct realise_motion fine;
        realise_refine(&fine, &work->solution.motion);
        work->solution.motion = fine;
    }
    meshes->outcome = is_refined ? realise_solve(&work->solution, work->last) : solve_guesses(work, mesh);
    if (is_refined && meshes->outcome == REALISE_FALLING)
        meshes->outcome = REALISE_SOLVED; /* the coarse mesh has found the least effort */
    if (meshes->outcome != REALISE_SOLVED)
        return false;
    if (meshes->solved == 0)
        work->iterations = work->solution.iterations;
    work->means = format_allocate((size_t)work->cells * (size_t)work->problem.drives, sizeof *work->means);
    take_means(work, work->means);
    work->mesh_change = INFINITY;
    for (int i = 0; i < meshes->solved; i++) {
        int at = 0;
        const double change = change_of_means(work, meshes->means[i], &at);
        if (change < work->mesh_change) {
            work->mesh_change = change;
            *cell = at;
        }
    }
    meshes->means[meshes->solved++] = work->means;
    return work->mesh_change <= mesh_tol;
}

/* Solves on meshes until two of them have the same drive forces. A single mesh can be wrong although the
 * course is smooth: the equations of an interval are nearly singular if its length and a mode of the motion
 * fit each other, as for a six-axis robot with a flexible forearm at 25 ms. */
static enum status solve(struct realise_work *work) {
    static const double parts[MESHES_MOST] = {1, 0.5, 0.425, 0.25};
    struct meshes meshes = {.solved = 0, .outcome = REALISE_SOLVED};
    int cell = 0;
    work->solution.most = may_vibrate(work) ? 100 : 200;
    const int tries =
        work->problem.spare > 0 ? 1 : MESHES_MOST; /* that may fail; least effort takes seconds */
    for (int i = 0; i < MESHES_MOST && i - meshes.solved < tries && meshes.outcome != REALISE_STOPPED; i++)
        if (solve_mesh(work, work->mesh * parts[i], i == 1 && meshes.outcome == REALISE_SOLVED, &meshes,
                       &cell))
            return STATUS_DONE;
    return meshes.outcome == REALISE_STOPPED || meshes.solved < 2 ? report_failure(work, meshes.outcome)
                                                                  : refuse_rough(work, cell);
}

/* ---- Playback ---- */

/* Samples of the inputs of a model without the programme: the means, from the beginning of their cells. */
static void fill_samples(const struct realise_work *work, const struct refdyn_model *model,
                         struct inputs *inputs) {
    const int drives = work->problem.drives, width = 1 + drives;
    int *place = format_allocate((size_t)drives, sizeof *place);
    double *rows = format_allocate((size_t)work->cells * (size_t)width, sizeof *rows);
    for (int d = 0; d < drives; d++)
        place[d] = refdyn_find_name(model->inputs, model->input_count,
                                    realise_model(work)->inputs[realise_model(work)->drives[d].input].name);
    for (int i = 0; i < work->cells; i++) {
        rows[i * width] = work->solution.motion.t[0] + i * work->every;
        memcpy(rows + i * width + 1, work->means + i * drives, (size_t)drives * sizeof *rows);
    }
    inputs->samples =
        (struct refdyn_samples){.count = work->cells, .width = drives, .place = place, .rows = rows};
}

/* The largest distance of the played motion from the one that was found, of points [m] or, without any, of
 * coordinates, and the largest residual of a position row. */
static double distance_at(struct realise_work *work, const struct refdyn_integrator *played) {
    struct scene *scene = work->scene;
    const struct refdyn_model *model = scene->model;
    const int n = model->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *state = realise_scratch(2, n), *tau = realise_scratch(work->problem.drives, 1),
           *r = realise_scratch(model->point_count, 3), *other = realise_scratch(model->point_count, 3),
           largest = 0;
    realise_state(&work->solution.motion, played->t, state, tau);
    if (model->point_count) {
        model->r(scene->work.p, scene->work.x, played->t, state, state + n, r);
        model->r(scene->work.p, scene->work.x, played->t, played->q, played->qd, other);
    }
    for (int i = 0; i < model->point_count; i++)
        largest = fmax(largest, hypot(hypot(r[3 * i] - other[3 * i], r[3 * i + 1] - other[3 * i + 1]),
                                      r[3 * i + 2] - other[3 * i + 2]));
    for (int i = 0; i < n && model->point_count == 0; i++)
        largest = fmax(largest, fabs(state[i] - played->q[i]));
    if (refdyn_equations(&scene->work, played->t, played->q, played->qd) == REFDYN_OK)
        for (int i = 0; i < model->m; i++)
            if (realise_model(work)->rows[i].is_programme)
                largest = fmax(largest, fabs(scene->work.phi[i]));
    memory_back(&format_memory, mark);
    return largest;
}

static int play(struct realise_work *work, struct scene *scene, const struct refdyn_options *integration) {
    struct motion motion;
    struct inputs inputs = {.path = NULL};
    const double begin = work->solution.motion.t[0];
    fill_samples(work, scene->model, &inputs);
    scene->inputs = &inputs;
    memcpy(scene->q, work->scene->q, (size_t)scene->model->n * sizeof *scene->q);
    memset(scene->qd, 0, (size_t)scene->model->n * sizeof *scene->qd);
    scene->state.t = begin;
    scene_inputs_set(&inputs, begin, scene->work.x);
    int status = simulate_start(&motion, scene, integration, work->until, work->every);
    const long outputs = record_count_outputs(work->until - begin, work->every);
    for (long i = 1; i < outputs && status == REFDYN_OK; i++) {
        status = simulate_to(&motion, i, NULL);
        if (status == REFDYN_OK)
            work->playback = fmax(work->playback, distance_at(work, &motion.integrator));
    }
    simulate_release(&motion);
    scene->inputs = NULL;
    return status;
}

enum status realise_open_played(struct scene *played, const struct options *options, unsigned needs) {
    struct options own = *options;
    options_set_text(&own, "play", "");
    return scene_open(played, &own, NEEDS_MOTION | NEEDS_POINTS | NEEDS_TANGENT | NEEDS_NO_WARNINGS | needs,
                      realise_state_path(options));
}

static enum status play_in(struct realise_work *work, struct scene *played,
                           const struct refdyn_options *integration) {
    struct refdyn_options own = *integration;
    own.tol = fmin(own.tol > 0 ? own.tol : 1e-10, 1e-10);
    const int result = play(work, played, &own);
    if (result == REFDYN_OK)
        return STATUS_DONE;
    fprintf(stderr, "refdyn: %s: the forces that were found could not be played back: %s\n",
            played->model->name, refdyn_status_text(result));
    return STATUS_NUMBERS;
}

static enum status play_back(struct realise_work *work, const struct refdyn_options *integration) {
    struct scene played;
    enum status status = realise_open_played(&played, work->options, 0);
    if (status == STATUS_DONE)
        status = play_in(work, &played, integration);
    scene_close(&played);
    return status;
}

/* ---- The whole ---- */

static enum status place_start(struct realise_work *work) {
    struct scene *scene = work->scene;
    if (!is_from_held(work->options))
        return simulate_place(scene, work->options);
    if (!realise_equilibrium(&work->problem, scene->state.t, scene->q)) {
        fprintf(stderr,
                "refdyn: %s: --from held: no equilibrium on the programme was found that the drives hold\n",
                scene->model->name);
        return STATUS_NUMBERS;
    }
    memset(scene->qd, 0, (size_t)scene->model->n * sizeof *scene->qd);
    refdyn_anchor(&scene->work, scene->state.t, scene->q, scene->qd, scene->given);
    return STATUS_DONE;
}

/* The largest forces at the beginnings of the cells. */
static void find_peaks(struct realise_work *work) {
    const struct realise_motion *motion = &work->solution.motion;
    const int drives = work->problem.drives;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *state = realise_scratch(2, work->problem.n), *tau = realise_scratch(drives, 1);
    for (int i = 0; i <= work->cells; i++) {
        realise_state(motion, fmin(motion->t[0] + i * work->every, motion->t[motion->count]), state, tau);
        for (int d = 0; d < drives; d++)
            work->peak[d] = fmax(work->peak[d], fabs(tau[d]));
    }
    memory_back(&format_memory, mark);
}

static void start(struct realise_work *work, struct scene *scene, const struct options *options) {
    *work =
        (struct realise_work){.options = options, .scene = scene, .until = options_number(options, "until")};
    realise_problem_start(&work->problem, scene);
    work->hold = format_allocate_matrix(work->problem.drives + work->problem.loops, 1);
    work->last = format_allocate_matrix(3, scene->model->n);
    work->peak = format_allocate_matrix(work->problem.drives, 1);
}

static enum status find_forces(struct realise_work *work) {
    struct scene *scene = work->scene;
    enum status status = check_start(work);
    if (status != STATUS_DONE)
        return status;
    if (!realise_modes_find(&work->problem, scene->state.t, scene->q, work->hold, &work->modes)) {
        fprintf(stderr, "refdyn: %s: --realise: the mass matrix is singular at the start\n",
                scene->model->name);
        return STATUS_NUMBERS;
    }
    const enum status chosen = choose_times(work);
    return chosen == STATUS_DONE ? solve(work) : chosen;
}

enum status realise_find(struct realise_work *work, struct scene *scene, struct scene *played,
                         const struct options *options, const struct refdyn_options *integration) {
    const double began = system_cpu_seconds();
    enum status status = realise_check_model(scene);
    if (status == STATUS_DONE)
        status = simulate_check_times(scene, options, RECORD_KEPT_MAX);
    if (status != STATUS_DONE)
        return status;
    start(work, scene, options);
    status = place_start(work);
    realise_problem_release(&work->problem);
    if (status == STATUS_DONE)
        status = find_forces(work);
    work->cpu_s = system_cpu_seconds() - began;
    if (status != STATUS_DONE)
        return status;
    find_peaks(work);
    return played ? play_in(work, played, integration) : play_back(work, integration);
}

/* ---- The motion that was found ---- */

/* Places the integrator at the motion's state at t. */
static int show(struct realise_work *work, struct refdyn_integrator *integrator, double t) {
    struct realise_problem *problem = &work->problem;
    const int n = problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *state = realise_scratch(2, n), *tau = realise_scratch(problem->drives, 1);
    realise_state(&work->solution.motion, t, state, tau);
    for (int d = 0; d < problem->drives; d++)
        work->scene->work.x[problem->input[d]] = tau[d];
    const int status = refdyn_integrator_start(integrator, t, state, state + n);
    memory_back(&format_memory, mark);
    return status;
}

/* The columns of the drive forces. */
static int column_of(const struct realise_work *work, const struct record_table *table, int drive) {
    const char *name = realise_model(work)->inputs[realise_model(work)->drives[drive].input].name;
    const char *lead = format_text("%s%s", record_input_lead, name);
    const int column = record_table_find(table, lead, strlen(lead));
    return column >= 0 ? column : record_table_find(table, name, strlen(name));
}

/* The cell whose force acts at t. */
static int cell_at(const struct realise_work *work, double t) {
    const double cell = floor((t - work->solution.motion.t[0]) / work->every + 1e-9);
    return cell < work->cells ? (int)cell : work->cells - 1;
}

static int put_rows(struct realise_work *work, struct refdyn_integrator *integrator,
                    const struct realise_rows *rows, struct record_table *table,
                    struct record_limits *limits) {
    for (int i = 0; i < rows->count; i++) {
        const double t = rows->times[i];
        int status = show(work, integrator, t);
        if (status != REFDYN_OK)
            return status;
        record_table_fill(table);
        if (limits && limits->count > 0)
            record_limits_take(limits);
        for (int d = 0; d < work->problem.drives; d++)
            table->values[column_of(work, table, d)] =
                work->means[cell_at(work, t) * work->problem.drives + d];
        status = rows->put(rows->context, table, i);
        if (status != REFDYN_OK)
            return status;
    }
    return REFDYN_OK;
}

enum status realise_show(struct realise_work *work, const struct realise_rows *rows,
                         struct record_limits *limits) {
    struct scene *scene = work->scene;
    struct refdyn_integrator integrator;
    struct record_table table;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK8);
    options.stabilise = REFDYN_NONE;
    const size_t size = refdyn_integrator_size(scene->model, &options);
    int status = refdyn_integrator_init(&integrator, &scene->work, &options, format_allocate(1, size), size);
    if (status == REFDYN_OK)
        status = show(work, &integrator, rows->times[0]);
    if (status == REFDYN_OK) {
        simulate_table_start(&table, &integrator, scene->compiled.spatial);
        if (limits)
            simulate_limits_start(limits, simulate_memory(NULL), scene, &integrator);
        status = rows->begin(rows->context, &table);
    }
    if (status == REFDYN_OK)
        status = put_rows(work, &integrator, rows, &table, limits);
    if (status == RECORD_NOT_WRITTEN)
        return STATUS_FAULT;
    return status == REFDYN_OK
               ? STATUS_DONE
               : scene_numbers_failed(scene, status, integrator.t, integrator.q, integrator.qd);
}

int realise_list_numbers(const struct model *model, const struct realise_work *work,
                         struct realise_number **numbers) {
    static const struct realise_work none;
    const struct realise_work *from = work ? work : &none;
    const struct realise_modes *modes = &from->modes;
    int rows = 0, count = 0;
    for (int i = 0; i < model->row_count; i++)
        rows += model->rows[i].is_programme;
    struct realise_number *list = format_allocate((size_t)(rows + model->drive_count) + 9, sizeof *list);
    for (int d = 0; d < model->drive_count; d++)
        list[count++] =
            (struct realise_number){format_text("peak_%s", model->drives[d].name),
                                    model->inputs[model->drives[d].input].unit, work ? work->peak[d] : 0};
    list[count++] = (struct realise_number){"mesh_change", NULL, from->mesh_change};
    list[count++] = (struct realise_number){"playback_error", NULL, from->playback};
    list[count++] = (struct realise_number){"growing", NULL, modes->growing};
    list[count++] = (struct realise_number){"centre", NULL, modes->centre};
    list[count++] = (struct realise_number){"decaying", NULL, modes->decaying};
    list[count++] = (struct realise_number){"growth_slowest", "1/s", modes->slowest};
    list[count++] = (struct realise_number){"growth_fastest", "1/s", modes->fastest};
    list[count++] =
        (struct realise_number){"effort", NULL, work ? realise_effort(&work->solution.motion) : 0};
    list[count++] = (struct realise_number){"newton_iterations", NULL, from->iterations};
    for (int i = 0; i < rows; i++)
        list[count++] = (struct realise_number){format_text("cosine_%d", i + 1), NULL,
                                                work && i < modes->cosine_count ? modes->cosines[i] : NAN};
    *numbers = list;
    return count;
}
