/*
 * `refdyn sim --realise`: finds the drive forces and the motion of a programme that drives perform, and plays
 * the forces back from rest. It writes the motion, the forces as means over the cells between outputs, and
 * the state from which they are played.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/system/system.h"

/* Tails that let modes of the slowest growth decay by ten orders of magnitude, within these bounds [s]. */
static const double tail_decay = 23, tail_least = 0.1, tail_most = 2;
/* Steps of the first guess, as multiples of 1/(slowest growth). */
static const double guess_growth = 4;
/* Steps of the mesh: at most this part of the motion, and this length [s]. */
static const double mesh_part = 0.05, mesh_most = 0.05;
/* Its part for the least effort of a mechanism with coordinates that have no drive. */
static const double mesh_of_effort = 0.5;
/* The largest change of a drive force, relative to its peak, from a mesh to the next one. */
static const double mesh_tol = 0.02;
enum { MESHES_MOST = 4 };
/* A start is at rest if no coordinate accelerates by more [m/s^2, rad/s^2]. */
static const double rest_tol = 1e-6;

const struct option_rule realise_rules[] = {
    {"realise", NULL, OPTION_FLAG, "let the model's drives perform the programme, instead of ideal forces",
     NULL, NULL},
    {"before", "T1", OPTION_POSITIVE,
     "with --realise: time before the start from which the drives act [s] (default: from the growth of "
     "modes)",
     NULL, NULL},
    {"after", "T2", OPTION_POSITIVE,
     "with --realise: time after the end for which they act [s] (default: as before)", NULL, NULL},
    {"mesh", "H", OPTION_POSITIVE, "with --realise: largest step of the mesh [s] (default: 0.05, or T/20)",
     NULL, NULL},
    {"play", "RUN", OPTION_TEXT,
     "apply the drive forces of a --realise run, CSV or HDF5, with the programme's rows released", NULL,
     NULL},
    {.name = NULL}};

/* What the command computes. */
struct work {
    const struct options *options;
    struct scene *scene;
    struct realise_problem problem;
    struct realise_modes modes;
    struct realise_solution solution;
    double before, after, until, mesh, every;
    double *hold;       /* (drives + loops) forces that hold the start */
    double *last;       /* (3 n) coordinates, rates and accelerations that the end comes close to */
    int iterations;     /* on the first mesh */
    double mesh_change; /* of the drive forces, relative, to the mesh that comes closest */
    double *peak;       /* (drives) */
    double *means;      /* (cells x drives) over the outputs' cells */
    int cells;
    double playback;           /* largest error of the motion played back from rest [m, rad] */
    struct record_table table; /* the columns of the output */
    struct record_limits limits;
    double cpu_s;
};

static const struct model *model_of(const struct work *work) {
    return &work->scene->generation.model;
}

/* `--from held` starts at the equilibrium on the programme that the drives hold. */
static bool is_from_held(const struct options *options) {
    return options_is(options, "from", "held");
}

static const char *state_path(const struct options *options) {
    return is_from_held(options) ? NULL : options_state_path(options_text(options, "from"));
}

/* ---- Whether the programme can be realised ---- */

static enum status complain(const struct work *work, struct place place, const char *fact) {
    format_complain_line(place.file ? place.file : model_of(work)->file, place.line, fact);
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

static enum status check_counts(const struct work *work) {
    const struct model *model = model_of(work);
    int rows = 0;
    for (int i = 0; i < model->row_count; i++)
        rows += model->rows[i].is_programme;
    if (model->drive_count == 0)
        return complain(work, model->place,
                        "drives: the model has none; --realise needs a drive for each row of the programme");
    if (rows == 0)
        return complain(work, model->place,
                        "constraints: the model has no programme; --realise needs rows to perform");
    if (model->drive_count < rows)
        return complain(work, model->drives[0].place,
                        format_text("drives: %d for %d rows of the programme; no drive is left for %s",
                                    model->drive_count, rows, names_of_rows(model, model->drive_count)));
    return STATUS_DONE;
}

/* Motions with jumps of rates or forces have no smooth drive forces. Continuous states have no rest. */
static enum status check_smoothness(const struct work *work) {
    const struct model *model = model_of(work);
    const struct refdyn_model *emitted = work->scene->model;
    if (model->state_count > 0)
        return complain(
            work, model->states[0].place,
            format_text("%s: a continuous state, which --realise does not allow", model->states[0].name));
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].is_impact || model->events[i].contact >= 0)
            return complain(
                work, model->events[i].place,
                format_text(
                    "%s: an impact, which --realise does not allow: drives cannot perform jumps of rates",
                    model->events[i].name));
    if (emitted->saturates || emitted->kink_count > 0)
        return complain(
            work, model->place,
            "forces: friction, saturation or another kink in coordinates or rates, which --realise does "
            "not allow: it needs smooth forces");
    if (emitted->event_count > 0)
        return complain(work, model->events[0].place,
                        format_text("%s: an event, which --realise does not allow", model->events[0].name));
    return STATUS_DONE;
}

static double largest_residual(const struct work *work, int *row) {
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
static enum status check_start(struct work *work) {
    struct scene *scene = work->scene;
    const struct model *model = model_of(work);
    const int n = scene->model->n;
    int coordinate, row;
    const char *advice = "; --from held starts at the equilibrium that the drives hold";
    for (int i = 0; i < n; i++)
        if (scene->qd[i] != 0)
            return complain(
                work, model->place,
                format_text("start: %s moves with %.6g; a motion of --realise must start at rest%s",
                            scene->model->coordinates[i].name, scene->qd[i], advice));
    const double acceleration =
        realise_hold(&work->problem, scene->state.t, scene->q, work->hold, &coordinate);
    const double residual = largest_residual(work, &row);
    if (!(residual <= scene->work.consistency_tol * 1e-2))
        return complain(work, model->rows[row].place,
                        format_text("start: is off the programme: the residual of %s is %.3g%s",
                                    model->rows[row].name, residual, advice));
    if (!(acceleration <= rest_tol))
        return complain(
            work, model->place,
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

static void choose_times(struct work *work) {
    const struct options *options = work->options;
    const double length = work->until - work->scene->state.t;
    const struct realise_modes *modes = &work->modes;
    const double tail =
        modes->growing ? fmin(fmax(tail_decay / modes->slowest, tail_least), tail_most) : tail_least;
    work->before = options_has(options, "before") ? options_number(options, "before") : tail;
    work->after = options_has(options, "after") ? options_number(options, "after") : tail;
    work->mesh = options_has(options, "mesh") ? options_number(options, "mesh")
                                              : (is_resolved_more(&work->problem) ? mesh_of_effort : 1) *
                                                    fmin(mesh_most, mesh_part * length);
    work->every = record_distance(length, options_number(options, "every"));
    /* cells begin at multiples of `every` from the start */
    work->before = work->every * ceil(work->before / work->every - 1e-9);
    work->cells = (int)floor((work->before + length + work->after) / work->every + 1e-9);
}

static enum status report_failure(const struct work *work, enum realise_outcome outcome) {
    if (outcome == REALISE_STOPPED)
        fprintf(stderr, "refdyn: %s: interrupted\n", work->scene->model->name);
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

static void take_means(struct work *work, double *means) {
    const struct realise_motion *motion = &work->solution.motion;
    for (int i = 0; i < work->cells; i++)
        realise_means(motion, motion->t[0] + i * work->every, work->every, means + i * work->problem.drives);
}

/* Whether the cell is in the programme, where its kinks are. */
static bool is_in_programme(const struct work *work, int cell) {
    const double t = work->solution.motion.t[0] + cell * work->every;
    return t > work->scene->state.t - 1.5 * work->every && t < work->until + 0.5 * work->every;
}

/* The peak of a drive's mean forces. In a least effort a drive may have next to no force: the largest peak of
 * all drives then counts, by their weights. */
static double peak_of_means(const struct work *work, const double *means, int drive) {
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
static double change_of_means(const struct work *work, const double *means, int *cell) {
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

static enum status refuse_rough(const struct work *work, int cell) {
    const struct model *model = model_of(work);
    int row = 0;
    if (work->problem.spare > 0)
        return complain(
            work, model->drives[0].place,
            format_text("drives: the forces of least effort change by %.2g of their peak from mesh "
                        "to mesh, most about t = %.3g s; a smaller --mesh may help",
                        work->mesh_change, work->solution.motion.t[0] + (cell + 0.5) * work->every));
    while (!model->rows[row].is_programme)
        row++;
    return complain(
        work, model->rows[row].place,
        format_text(
            "%s: too rough for the drives: their forces change by %.2g of their peak from mesh to mesh, "
            "most about t = %.3g s; use a smoother course, such as rd.smoothstep of degree 7 or 9",
            model->rows[row].name, work->mesh_change,
            work->solution.motion.t[0] + (cell + 0.5) * work->every));
}

/* A first guess of a motion on a mesh with steps of at most `mesh`, and what its end comes close to. */
static void guess(struct work *work, double mesh, enum realise_guesses which) {
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

/* Solves on a mesh from a first guess. More drives than rows have several solutions, each near a guess: if
 * one needs more effort than its guess, other guesses are tried, and the least effort counts. */
static enum realise_outcome solve_guesses(struct work *work, double mesh) {
    const int guesses = work->problem.spare > 0 ? REALISE_GUESSES : 1;
    struct realise_solution best = {.iterations = 0};
    enum realise_outcome outcome = REALISE_STUCK;
    double least = INFINITY, at_first = 0;
    for (int i = 0; i < guesses && least > at_first && outcome != REALISE_STOPPED; i++) {
        guess(work, mesh, (enum realise_guesses)i);
        at_first = realise_effort(&work->solution.motion);
        outcome = realise_solve(&work->solution, work->last);
        const double effort = outcome == REALISE_SOLVED ? realise_effort(&work->solution.motion) : INFINITY;
        if (effort < least) {
            least = effort;
            best = work->solution;
        }
    }
    if (outcome == REALISE_STOPPED || !isfinite(least))
        return outcome;
    work->solution = best;
    return REALISE_SOLVED;
}

/* Solves on a mesh, from the motion of the mesh before if `is_refined`. Returns whether the forces equal
 * those of an earlier mesh; otherwise `cell` is where they differ most from those of the mesh that comes
 * closest. */
static bool solve_mesh(struct work *work, double mesh, bool is_refined, struct meshes *meshes, int *cell) {
    if (is_refined) {
        struct realise_motion fine;
        realise_refine(&fine, &work->solution.motion);
        work->solution.motion = fine;
    }
    meshes->outcome = is_refined ? realise_solve(&work->solution, work->last) : solve_guesses(work, mesh);
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
static enum status solve(struct work *work) {
    static const double parts[MESHES_MOST] = {1, 0.5, 0.425, 0.25};
    struct meshes meshes = {.solved = 0, .outcome = REALISE_SOLVED};
    int cell = 0;
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
static void fill_samples(const struct work *work, const struct refdyn_model *model, struct inputs *inputs) {
    const int drives = work->problem.drives, width = 1 + drives;
    int *place = format_allocate((size_t)drives, sizeof *place);
    double *rows = format_allocate((size_t)work->cells * (size_t)width, sizeof *rows);
    for (int d = 0; d < drives; d++)
        place[d] = refdyn_find_name(model->inputs, model->input_count,
                                    model_of(work)->inputs[model_of(work)->drives[d].input].name);
    for (int i = 0; i < work->cells; i++) {
        rows[i * width] = work->solution.motion.t[0] + i * work->every;
        memcpy(rows + i * width + 1, work->means + i * drives, (size_t)drives * sizeof *rows);
    }
    inputs->samples =
        (struct refdyn_samples){.count = work->cells, .width = drives, .place = place, .rows = rows};
}

/* The largest distance of the played motion from the one that was found, of points [m] or, without any, of
 * coordinates, and the largest residual of a position row. */
static double distance_at(struct work *work, const struct refdyn_integrator *played) {
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
            if (model_of(work)->rows[i].is_programme)
                largest = fmax(largest, fabs(scene->work.phi[i]));
    memory_back(&format_memory, mark);
    return largest;
}

static int play(struct work *work, struct scene *scene, const struct refdyn_options *integration) {
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

static enum status play_back(struct work *work, const struct refdyn_options *integration) {
    struct options options = *work->options;
    struct scene scene;
    struct refdyn_options own = *integration;
    options_set_text(&options, "play", "");
    own.tol = fmin(own.tol > 0 ? own.tol : 1e-10, 1e-10);
    enum status status =
        scene_open(&scene, &options, NEEDS_MOTION | NEEDS_POINTS | NEEDS_TANGENT | NEEDS_NO_WARNINGS,
                   state_path(work->options));
    if (status == STATUS_DONE) {
        const int result = play(work, &scene, &own);
        if (result != REFDYN_OK) {
            fprintf(stderr, "refdyn: %s: the forces that were found could not be played back: %s\n",
                    scene.model->name, refdyn_status_text(result));
            work->playback = INFINITY;
        }
    }
    scene_close(&scene);
    return status;
}

/* ---- Output ---- */

/* Places the integrator at the motion's state at t. */
static int show(struct work *work, struct refdyn_integrator *integrator, double t) {
    struct realise_problem *problem = &work->problem;
    const int n = problem->n;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *state = realise_scratch(2, n), *tau = realise_scratch(problem->drives, 1);
    realise_state(&work->solution.motion, t, state, tau);
    for (int d = 0; d < problem->drives; d++) {
        work->scene->work.x[problem->input[d]] = tau[d];
        work->peak[d] = fmax(work->peak[d], fabs(tau[d]));
    }
    const int status = refdyn_integrator_start(integrator, t, state, state + n);
    memory_back(&format_memory, mark);
    return status;
}

/* The columns of the drive forces. */
static int column_of(const struct work *work, int drive) {
    const struct record_table *table = &work->table;
    const char *name = model_of(work)->inputs[model_of(work)->drives[drive].input].name;
    const char *lead = format_text("%s%s", record_input_lead, name);
    const int column = record_table_find(table, lead, strlen(lead));
    return column >= 0 ? column : record_table_find(table, name, strlen(name));
}

static int write_rows(struct work *work, struct refdyn_integrator *integrator, struct row_sink *rows) {
    struct record_table *table = &work->table;
    const struct realise_motion *motion = &work->solution.motion;
    const double begin = motion->t[0];
    for (int i = 0; i <= work->cells; i++) {
        const double t = fmin(begin + i * work->every, motion->t[motion->count]);
        const int status = show(work, integrator, t);
        if (status != REFDYN_OK)
            return status;
        record_table_fill(table);
        if (work->limits.count > 0)
            record_limits_take(&work->limits);
        for (int d = 0; d < work->problem.drives; d++)
            table->values[column_of(work, d)] =
                work->means[(i < work->cells ? i : work->cells - 1) * work->problem.drives + d];
        if (!simulate_row_sink_put(rows, table))
            return RECORD_NOT_WRITTEN;
    }
    return REFDYN_OK;
}

static enum status write_motion(struct work *work, const struct refdyn_options *integration,
                                struct row_sink *rows) {
    struct scene *scene = work->scene;
    struct refdyn_integrator integrator;
    struct refdyn_options own = *integration;
    own.method = REFDYN_RK8;
    own.stabilise = REFDYN_NONE;
    const size_t size = refdyn_integrator_size(scene->model, &own);
    void *memory = format_allocate(1, size);
    int status = refdyn_integrator_init(&integrator, &scene->work, &own, memory, size);
    if (status == REFDYN_OK)
        status = show(work, &integrator, work->solution.motion.t[0]);
    if (status == REFDYN_OK) {
        simulate_table_start(&work->table, &integrator, scene->compiled.spatial);
        simulate_limits_start(&work->limits, simulate_memory(NULL), scene, &integrator);
        if (simulate_row_sink_begin(rows, &work->table))
            status = write_rows(work, &integrator, rows);
        else
            status = RECORD_NOT_WRITTEN;
        if (!simulate_row_sink_end(rows))
            status = RECORD_NOT_WRITTEN;
    }
    if (status != REFDYN_OK && status != RECORD_NOT_WRITTEN)
        return scene_numbers_failed(scene, status, integrator.t, integrator.q, integrator.qd);
    return status == REFDYN_OK ? STATUS_DONE : STATUS_FAULT;
}

static void print_summary(const struct work *work) {
    const struct realise_modes *modes = &work->modes;
    fprintf(stderr, "method       collocation at %d Gauss points, %d intervals from t = %.6g to %.6g s\n",
            REALISE_STAGES, work->solution.motion.count, work->solution.motion.t[0],
            work->solution.motion.t[work->solution.motion.count]);
    fprintf(stderr, "iterations   %d of Newton's method, last correction %.2g\n", work->iterations,
            work->solution.correction);
    fputs("cosines      ", stderr);
    for (int i = 0; i < modes->cosine_count; i++)
        fprintf(stderr, "%s%.3g", i ? ", " : "", modes->cosines[i]);
    fputs(" between rows and drives\n", stderr);
    fprintf(stderr, "modes        %d growing, %d centre, %d decaying", modes->growing, modes->centre,
            modes->decaying);
    if (modes->growing)
        fprintf(stderr, "; growth %.4g to %.4g 1/s", modes->slowest, modes->fastest);
    fputc('\n', stderr);
    for (int d = 0; d < work->problem.drives; d++)
        fprintf(stderr, "drive        %s: largest %.6g %s\n", model_of(work)->drives[d].name, work->peak[d],
                model_of(work)->inputs[model_of(work)->drives[d].input].unit);
    fprintf(stderr, "mesh         forces change by %.2g of their peak from another mesh\n",
            work->mesh_change);
    fprintf(stderr, "playback     from rest, error at most %.3g\n", work->playback);
    fprintf(stderr, "time         %.3g s CPU\n", work->cpu_s);
    record_limits_print(&work->limits, stderr);
}

static void put_summary(const struct work *work, struct document *document) {
    const struct realise_modes *modes = &work->modes;
    format_put_open(document, "realise", '{');
    format_put_array(document, "cosines", modes->cosines, modes->cosine_count);
    format_put_whole(document, "growing", modes->growing);
    format_put_whole(document, "centre", modes->centre);
    format_put_whole(document, "decaying", modes->decaying);
    format_put_number(document, "growth_slowest", modes->slowest);
    format_put_number(document, "growth_fastest", modes->fastest);
    format_put_open(document, "peak", '{');
    for (int d = 0; d < work->problem.drives; d++)
        format_put_number(document, model_of(work)->drives[d].name, work->peak[d]);
    format_put_close(document, '}');
    format_put_number(document, "effort", realise_effort(&work->solution.motion));
    format_put_number(document, "mesh_change", work->mesh_change);
    format_put_whole(document, "newton_iterations", work->iterations);
    format_put_number(document, "playback_error", work->playback);
    format_put_close(document, '}');
    format_put_number(document, "cpu_s", work->cpu_s);
}

static enum status write_summary(const struct work *work, struct target *target) {
    struct document document;
    const struct record_writer writer = scene_writer(&document);
    scene_document_open(&document);
    put_summary(work, &document);
    record_limits_put(&work->limits, &writer);
    record_table_put_units(&work->table, &writer);
    format_put_close(&document, '}');
    if (!format_document_close(&document, target->file))
        return STATUS_NUMBERS;
    return system_target_finish(target) ? STATUS_DONE : STATUS_FAULT;
}

/* RUN.csv or RUN.h5 becomes RUN.start.json. */
static enum status write_start(struct work *work) {
    struct scene *scene = work->scene;
    const char *output = options_text(work->options, "output");
    if (!output || strcmp(output, "-") == 0)
        return STATUS_DONE;
    const char *dot = strrchr(output, '.'), *slash = strrchr(output, '/');
    const int length = dot && (!slash || dot > slash) ? (int)(dot - output) : (int)strlen(output);
    struct target *target =
        system_target_open(&scene->targets, format_text("%.*s.start.json", length, output));
    struct document document;
    if (!target)
        return STATUS_FAULT;
    scene->state.t = work->solution.motion.t[0];
    scene_document_open(&document);
    scene_put_state(&document, scene);
    format_put_close(&document, '}');
    if (!format_document_close(&document, target->file) || !system_target_finish(target))
        return STATUS_FAULT;
    fprintf(stderr, "start        %s\n", target->name);
    return STATUS_DONE;
}

/* ---- The command ---- */

static enum status finish(struct work *work, const struct refdyn_options *integration) {
    struct scene *scene = work->scene;
    const struct task task = {.scene = scene, .options = work->options, .until = work->until};
    const char *output = options_text(work->options, "output");
    const bool is_hdf5 = output && format_names_hdf5(output);
    struct row_sink rows = is_hdf5 ? simulate_row_sink_hdf5(scene->result->part, &task)
                                   : simulate_row_sink_csv(scene->result->file);
    enum status status = write_motion(work, integration, &rows);
    realise_problem_end(&work->problem);
    if (status == STATUS_DONE)
        status = system_target_finish(scene->result) ? STATUS_DONE : STATUS_FAULT;
    if (status != STATUS_DONE)
        return status;
    print_summary(work);
    status = write_start(work);
    if (status == STATUS_DONE && scene->summary)
        status = write_summary(work, scene->summary);
    return status;
}

static enum status place_start(struct work *work) {
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

static enum status realise(struct scene *scene, const struct options *options,
                           const struct refdyn_options *integration) {
    struct work work = {.options = options, .scene = scene, .until = options_number(options, "until")};
    enum status status = check_counts(&work);
    if (status == STATUS_DONE)
        status = check_smoothness(&work);
    if (status == STATUS_DONE)
        status = simulate_check_times(scene, options);
    if (status != STATUS_DONE)
        return status;
    const double began = system_cpu_seconds();
    realise_problem_start(&work.problem, scene);
    work.hold = format_allocate_matrix(work.problem.drives + work.problem.loops, 1);
    work.last = format_allocate_matrix(3, scene->model->n);
    work.peak = format_allocate_matrix(work.problem.drives, 1);
    status = place_start(&work);
    realise_problem_release(&work.problem);
    if (status == STATUS_DONE)
        status = check_start(&work);
    if (status == STATUS_DONE &&
        !realise_modes_find(&work.problem, scene->state.t, scene->q, work.hold, &work.modes)) {
        fprintf(stderr, "refdyn: %s: --realise: the mass matrix is singular at the start\n",
                scene->model->name);
        status = STATUS_NUMBERS;
    }
    if (status == STATUS_DONE) {
        choose_times(&work);
        status = solve(&work);
    }
    work.cpu_s = system_cpu_seconds() - began;
    if (status == STATUS_DONE)
        status = play_back(&work, integration);
    return status == STATUS_DONE ? finish(&work, integration) : status;
}

enum status realise_run(const struct options *options) {
    struct refdyn_options integration;
    struct scene scene;
    enum status status = simulate_options(options, &integration);
    if (status != STATUS_DONE)
        return status;
    status =
        scene_open(&scene, options, NEEDS_RESULT | NEEDS_POINT_RATES | simulate_needs(options) | NEEDS_DRIVES,
                   state_path(options));
    if (status == STATUS_DONE)
        status = realise(&scene, options, &integration);
    scene_close(&scene);
    return status;
}
